//! Values of a job file with their places, and the questions the sections ask of them.
//!
//! Every answer that is not the expected one becomes a [`JobError`] with the line, the key and the text as written.

use std::ops::{Range, RangeInclusive};
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::{Fault, JobError, NamedFile, keys};

/// A job file as text, with its path.
#[derive(Clone, Copy)]
pub(crate) struct Document<'a> {
    pub path: &'a Path,
    pub text: &'a str,
}

impl Document<'_> {
    /// Line of a byte of the text, from 1.
    pub fn line(&self, offset: usize) -> usize {
        1 + self.text[..offset].matches('\n').count()
    }

    /// The text of a value as written, shortened to a line.
    fn quote(&self, span: Range<usize>) -> String {
        const CHARS_MAX: usize = 60;
        let words = self.text[span].split_whitespace().collect::<Vec<_>>().join(" ");
        if words.chars().count() <= CHARS_MAX {
            return words;
        }
        words.chars().take(CHARS_MAX).chain("…".chars()).collect()
    }
}

/// A table of a job file: a section, or an inline table.
pub(crate) struct Section<'a> {
    document: Document<'a>,
    name: String,
    /// Where it begins; absent for a section that the job leaves out.
    offset: Option<usize>,
    table: Option<&'a DeTable<'a>>,
}

impl<'a> Section<'a> {
    /// The section of that name, empty when the job leaves it out.
    ///
    /// # Errors
    /// When it is no table, or holds a key that the section does not know.
    pub fn of(document: Document<'a>, root: &'a DeTable<'a>, name: &str) -> Result<Self, JobError> {
        let Some((key, value)) = root.iter().find(|(key, _)| key.get_ref() == name) else {
            return Ok(Self { document, name: name.to_owned(), offset: None, table: None });
        };
        let entry = Entry { document, key: name.to_owned(), offset: key.span().start, value };
        entry.table()
    }

    fn check_keys(&self) -> Result<(), JobError> {
        let known = keys::keys_of(&self.name);
        let unknown = self.table.into_iter().flatten().map(|(key, _)| key);
        let unknown = unknown.filter(|key| !known.contains(&key.get_ref().as_ref()));
        let Some(first) = unknown.min_by_key(|key| key.span().start) else { return Ok(()) };
        let found = first.get_ref();
        Err(JobError::UnknownKey(Box::new(Fault {
            path: self.document.path.to_owned(),
            line: Some(self.document.line(first.span().start)),
            key: self.key(found),
            found: "a key that no job has".to_owned(),
            expected: format!("one of {}", known.join(", ")),
            hint: keys::hint_for_key(&self.name, found),
        })))
    }

    fn key(&self, key: &str) -> String {
        format!("{}.{key}", self.name)
    }

    /// The value of `key`, if the job has one.
    pub fn optional(&self, key: &str) -> Option<Entry<'a>> {
        let (name, value) = self.table?.iter().find(|(name, _)| name.get_ref() == key)?;
        Some(Entry { document: self.document, key: self.key(key), offset: name.span().start, value })
    }

    /// The value of `key`.
    ///
    /// # Errors
    /// When the job has none.
    pub fn required(&self, key: &str, expected: &str) -> Result<Entry<'a>, JobError> {
        self.optional(key).ok_or_else(|| self.missing(key, expected, &keys::example(&self.key(key))))
    }

    /// The error that `key` is missing here.
    pub fn missing(&self, key: &str, expected: &str, hint: &str) -> JobError {
        JobError::Missing(Box::new(Fault {
            path: self.document.path.to_owned(),
            line: self.offset.map(|offset| self.document.line(offset)),
            key: self.key(key),
            found: "nothing".to_owned(),
            expected: expected.to_owned(),
            hint: hint.to_owned(),
        }))
    }
}

/// One value of a job file.
#[derive(Clone)]
pub(crate) struct Entry<'a> {
    document: Document<'a>,
    key: String,
    offset: usize,
    value: &'a Spanned<DeValue<'a>>,
}

impl<'a> Entry<'a> {
    /// The fault of this value, found as written, with an example for a hint.
    pub fn fault(&self, expected: impl Into<String>) -> Box<Fault> {
        Box::new(Fault {
            path: self.document.path.to_owned(),
            line: Some(self.document.line(self.offset)),
            key: self.key.clone(),
            found: self.document.quote(self.value.span()),
            expected: expected.into(),
            hint: keys::example(&self.key),
        })
    }

    /// The error that the value is of the wrong type.
    pub fn wrong_kind(&self, expected: &str) -> JobError {
        let mut fault = self.fault(expected);
        fault.found = format!("the {} {}", kind(self.value.get_ref()), fault.found);
        JobError::WrongKind(fault)
    }

    /// The error that the value is out of range.
    pub fn out_of_range(&self, expected: impl Into<String>) -> JobError {
        JobError::OutOfRange(self.fault(expected))
    }

    /// The error that the value is out of range, with a hint of its own.
    pub fn out_of_range_with(&self, expected: impl Into<String>, hint: impl Into<String>) -> JobError {
        JobError::OutOfRange(Box::new(Fault { hint: hint.into(), ..*self.fault(expected) }))
    }

    /// The error that the value does not go with another key.
    pub fn conflict(&self, beside: &str, expected: &str, hint: &str) -> JobError {
        let mut fault = self.fault(expected);
        fault.found = format!("{} beside {beside}", fault.found);
        fault.hint = hint.to_owned();
        JobError::Conflict(fault)
    }

    /// The error that this version does not do that yet.
    pub fn unsupported(&self, expected: &str, hint: &str) -> JobError {
        let mut fault = self.fault(expected);
        fault.found = format!("{} (not supported yet)", fault.found);
        fault.hint = hint.to_owned();
        JobError::Unsupported(fault)
    }

    /// The value as text.
    pub fn text(&self, expected: &str) -> Result<&'a str, JobError> {
        self.value.get_ref().as_str().ok_or_else(|| self.wrong_kind(expected))
    }

    /// The file that the value names, relative to the folder of the job.
    pub fn file(&self, job: &Path) -> Result<NamedFile, JobError> {
        let written = self.text("the path of a file")?;
        if written.is_empty() || written.contains('\0') {
            return Err(self.out_of_range("the path of a file, relative to the job file"));
        }
        let folder = job.parent().unwrap_or(Path::new(""));
        Ok(NamedFile { written: written.to_owned(), path: folder.join(written) })
    }

    /// The value as yes or no.
    pub fn flag(&self) -> Result<bool, JobError> {
        self.value.get_ref().as_bool().ok_or_else(|| self.wrong_kind("true or false"))
    }

    /// The value as a finite number; a whole number will do.
    pub fn number(&self, expected: &str) -> Result<f64, JobError> {
        let text = match self.value.get_ref() {
            DeValue::Float(float) => float.as_str(),
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
            _ => return Err(self.wrong_kind(expected)),
        };
        let finite = text.parse::<f64>().ok().filter(|number| number.is_finite());
        finite.ok_or_else(|| self.out_of_range(format!("a finite number: {expected}")))
    }

    /// The value as a finite number in a range.
    pub fn number_in(&self, range: RangeInclusive<f64>, expected: &str) -> Result<f64, JobError> {
        let number = self.number(expected)?;
        if range.contains(&number) { Ok(number) } else { Err(self.out_of_range(expected)) }
    }

    /// The value as a whole number in a range.
    pub fn whole(&self, range: RangeInclusive<u64>, what: &str) -> Result<u64, JobError> {
        let expected = format!("{what}, a whole number from {} to {}", range.start(), range.end());
        let DeValue::Integer(integer) = self.value.get_ref() else { return Err(self.wrong_kind(&expected)) };
        let number = u64::from_str_radix(integer.as_str(), integer.radix()).ok();
        number.filter(|number| range.contains(number)).ok_or_else(|| self.out_of_range(expected))
    }

    /// The value as a whole number that fits 32 bits, in a range.
    pub fn whole_u32(&self, range: RangeInclusive<u32>, what: &str) -> Result<u32, JobError> {
        let number = self.whole(u64::from(*range.start())..=u64::from(*range.end()), what)?;
        Ok(u32::try_from(number).expect("the range ends within 32 bits"))
    }

    /// The value as a whole number of either sign.
    pub fn signed(&self, what: &str) -> Result<i64, JobError> {
        let expected = format!("{what}, a whole number");
        let DeValue::Integer(integer) = self.value.get_ref() else { return Err(self.wrong_kind(&expected)) };
        let number = i64::from_str_radix(integer.as_str(), integer.radix()).ok();
        number.ok_or_else(|| self.out_of_range(expected))
    }

    /// The value as two numbers.
    pub fn pair(&self, expected: &str) -> Result<[f64; 2], JobError> {
        match self.list(expected)?.as_slice() {
            [first, second] => Ok([first.number(expected)?, second.number(expected)?]),
            _ => Err(self.wrong_kind(expected)),
        }
    }

    /// The value as one of some words.
    pub fn word<T: Copy>(&self, words: &[(&str, T)]) -> Result<T, JobError> {
        let names: Vec<&str> = words.iter().map(|(name, _)| *name).collect();
        let expected = names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(" or ");
        let found = self.text(&expected)?;
        words.iter().find(|(name, _)| *name == found).map(|(_, meant)| *meant).ok_or_else(|| {
            let mut fault = self.fault(expected);
            if let Some(name) = keys::nearest(found, &names) {
                fault.hint = format!("did you mean \"{name}\"?");
            }
            JobError::UnknownWord(fault)
        })
    }

    /// The items of a list.
    pub fn list(&self, expected: &str) -> Result<Vec<Entry<'a>>, JobError> {
        let items = self.value.get_ref().as_array().ok_or_else(|| self.wrong_kind(expected))?;
        let item = |(index, value): (usize, &'a Spanned<DeValue<'a>>)| Entry {
            document: self.document,
            key: format!("{}[{index}]", self.key),
            offset: value.span().start,
            value,
        };
        Ok(items.iter().enumerate().map(item).collect())
    }

    /// The value as a table that holds no other keys than those of its place.
    pub fn table(&self) -> Result<Section<'a>, JobError> {
        let expected = format!("a table of {}", keys::keys_of(&self.key).join(", "));
        let table = self.value.get_ref().as_table().ok_or_else(|| self.wrong_kind(&expected))?;
        let (name, offset) = (self.key.clone(), Some(self.offset));
        let section = Section { document: self.document, name, offset, table: Some(table) };
        section.check_keys()?;
        Ok(section)
    }

    /// Whether the value is a list.
    pub fn is_list(&self) -> bool {
        self.value.get_ref().is_array()
    }

    /// Whether the value is a table.
    pub fn is_table(&self) -> bool {
        self.value.get_ref().is_table()
    }
}

/// Checks the names of the sections.
pub(crate) fn check_sections<'a>(document: Document<'a>, root: &'a DeTable<'a>) -> Result<(), JobError> {
    let known = keys::section_names();
    let unknown = root.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
    let Some(first) = unknown.min_by_key(|key| key.span().start) else { return Ok(()) };
    let found = first.get_ref();
    Err(JobError::UnknownKey(Box::new(Fault {
        path: document.path.to_owned(),
        line: Some(document.line(first.span().start)),
        key: found.to_string(),
        found: "a section or key that no job has".to_owned(),
        expected: format!("one of [{}]", known.join("], [")),
        hint: keys::hint_for_section(found),
    })))
}

fn kind(value: &DeValue) -> &'static str {
    match value {
        DeValue::String(_) => "text",
        DeValue::Integer(_) => "whole number",
        DeValue::Float(_) => "number",
        DeValue::Boolean(_) => "truth value",
        DeValue::Datetime(_) => "date",
        DeValue::Array(_) => "list",
        DeValue::Table(_) => "table",
    }
}
