//! Values of a job file with their places, and the questions the sections ask of them.
//!
//! Every answer that is not the expected one becomes a [`JobError`] with the line, the key and the text as written.

use std::borrow::Cow;
use std::ops::{Range, RangeInclusive};
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::bounds::NAME_CHARS_MAX;
use crate::key::whole_text;
use crate::{Choice, Fault, JobError, NamedFile, NoArea, Values, keys, remote};

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
        let words = remote::without_secrets(&words);
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

    /// A table of this one that the job leaves out.
    pub fn absent(&self, key: &str) -> Self {
        Self { document: self.document, name: self.key(key), offset: self.offset, table: None }
    }

    /// Whether the job has it.
    pub fn is_there(&self) -> bool {
        self.table.is_some()
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

    /// What `read` makes of the value of `key`, if the job has one.
    pub fn maybe<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Entry<'a>) -> Result<T, JobError>,
    ) -> Result<Option<T>, JobError> {
        self.optional(key).map(|entry| read(&entry)).transpose()
    }

    /// The text of `key`, if the job has one.
    pub fn text(&self, key: &str) -> Result<Option<String>, JobError> {
        self.maybe(key, |entry| entry.prose(|c| c == '\0'))
    }

    /// The value of `key`.
    ///
    /// # Errors
    /// When the job has none.
    pub fn required(&self, key: &str) -> Result<Entry<'a>, JobError> {
        let name = self.key(key);
        self.optional(key).ok_or_else(|| self.missing(key, &keys::expected(&name), &keys::example(&name)))
    }

    /// The value of `key`, or the one that holds where a job leaves it out.
    fn or_usual<T>(
        &self,
        key: &str,
        read: fn(&Entry<'a>) -> Result<T, JobError>,
        usual: fn(&str) -> Option<T>,
    ) -> Result<T, JobError> {
        let usual = || usual(keys::usual_text(&self.key(key))).expect("what holds is a value of its key");
        self.optional(key).map_or_else(|| Ok(usual()), |entry| read(&entry))
    }

    /// The whole number of `key`, as [`Entry::whole`], or its usual one.
    pub fn whole(&self, key: &str) -> Result<u64, JobError> {
        self.or_usual(key, Entry::whole, |text| text.parse().ok())
    }

    /// As [`Section::whole`], of a key whose range fits 32 bits.
    pub fn whole_u32(&self, key: &str) -> Result<u32, JobError> {
        self.whole(key).map(in_32_bits)
    }

    /// The number of `key`, as [`Entry::number`], or its usual one.
    pub fn number(&self, key: &str) -> Result<f64, JobError> {
        self.or_usual(key, Entry::number, |text| text.parse().ok())
    }

    /// Two numbers, or the usual ones.
    pub fn pair(&self, key: &str) -> Result<[f64; 2], JobError> {
        self.or_usual(key, Entry::pair, |text| {
            let (first, second) = text.strip_prefix('[')?.strip_suffix(']')?.split_once(", ")?;
            Some([first.parse().ok()?, second.parse().ok()?])
        })
    }

    /// Yes or no, or its usual one.
    pub fn flag(&self, key: &str) -> Result<bool, JobError> {
        self.or_usual(key, Entry::flag, |text| text.parse().ok())
    }

    /// One of some words, or the usual one.
    pub fn word<T: Choice + Clone>(&self, key: &str) -> Result<T, JobError> {
        self.or_usual(key, Entry::word, |name| T::named(name).cloned())
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

    /// The error that there is no area that the value asks for.
    pub fn no_area(&self, none: NoArea) -> JobError {
        let fault = self.fault(none.expected);
        let found = format!("{}: {}", fault.found, none.found);
        JobError::OutOfRange(Box::new(Fault { found, hint: none.hint, ..*fault }))
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

    /// What the value may be.
    pub fn expected(&self) -> String {
        keys::expected(&self.key)
    }

    /// The value as text.
    pub fn text(&self) -> Result<&'a str, JobError> {
        self.value.get_ref().as_str().ok_or_else(|| self.wrong_kind(&self.expected()))
    }

    /// The value as text of at most the characters of its key, and none that is `refused`.
    pub fn prose(&self, refused: fn(char) -> bool) -> Result<String, JobError> {
        let text = self.text()?;
        let Some(Values::Line(_, most)) = keys::key(&self.key).map(|key| &key.values) else {
            unreachable!("{} is a line of text", self.key)
        };
        let is_good = !text.trim().is_empty() && text.chars().count() <= *most && !text.contains(refused);
        if is_good { Ok(text.to_owned()) } else { Err(self.out_of_range(self.expected())) }
    }

    /// The value as a name of letters, digits and few other characters.
    pub fn name(&self, hint: &str) -> Result<String, JobError> {
        let name = self.text()?;
        let good = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        let begins = name.starts_with(|c: char| c.is_ascii_alphanumeric());
        if !begins || !name.chars().all(good) || NAME_CHARS_MAX < name.len() {
            return Err(self.out_of_range_with(self.expected(), hint));
        }
        Ok(name.to_owned())
    }

    /// The file that the value names, relative to the folder of the job, or its address on another machine.
    pub fn file(&self, job: &Path) -> Result<NamedFile, JobError> {
        let written = self.text()?;
        if written.is_empty() || written.contains('\0') {
            return Err(self.out_of_range("the path of a file, relative to the job file"));
        }
        if remote::is_remote(written) {
            remote::check_address(written).map_err(|expected| self.out_of_range(expected))?;
            return Ok(NamedFile { written: remote::without_query(written).to_owned(), path: written.into() });
        }
        let folder = job.parent().unwrap_or(Path::new(""));
        Ok(NamedFile { written: written.to_owned(), path: folder.join(written) })
    }

    /// The value as yes or no.
    pub fn flag(&self) -> Result<bool, JobError> {
        self.value.get_ref().as_bool().ok_or_else(|| self.wrong_kind(&self.expected()))
    }

    /// The value as a finite number in the range of its key, if it has one; a whole number will do.
    pub fn number(&self) -> Result<f64, JobError> {
        let number = self.finite()?;
        match keys::key(&self.key).map(|key| &key.values) {
            Some(Values::Number(_, range)) if !range.contains(&number) => Err(self.out_of_range(self.expected())),
            _ => Ok(number),
        }
    }

    fn finite(&self) -> Result<f64, JobError> {
        let expected = self.expected();
        let text = match self.value.get_ref() {
            DeValue::Float(float) => float.as_str(),
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
            _ => return Err(self.wrong_kind(&expected)),
        };
        let finite = text.parse::<f64>().ok().filter(|number| number.is_finite());
        finite.ok_or_else(|| self.out_of_range(format!("a finite number: {expected}")))
    }

    /// The value as a whole number in the range of its key.
    pub fn whole(&self) -> Result<u64, JobError> {
        match keys::key(&self.key).map(|key| &key.values) {
            Some(Values::Whole(what, range)) => self.whole_in(range, what),
            _ => unreachable!("{} is a whole number", self.key),
        }
    }

    /// As [`Entry::whole`], of a key whose range fits 32 bits.
    pub fn whole_u32(&self) -> Result<u32, JobError> {
        self.whole().map(in_32_bits)
    }

    /// The value as a whole number in a range.
    pub fn whole_in(&self, range: &RangeInclusive<u64>, what: &str) -> Result<u64, JobError> {
        let expected = whole_text(what, range);
        let DeValue::Integer(integer) = self.value.get_ref() else { return Err(self.wrong_kind(&expected)) };
        let number = u64::from_str_radix(integer.as_str(), integer.radix()).ok();
        number.filter(|number| range.contains(number)).ok_or_else(|| self.out_of_range(expected))
    }

    /// The value as a whole number of either sign.
    pub fn signed(&self) -> Result<i64, JobError> {
        let expected = self.expected();
        let DeValue::Integer(integer) = self.value.get_ref() else { return Err(self.wrong_kind(&expected)) };
        let number = i64::from_str_radix(integer.as_str(), integer.radix()).ok();
        number.ok_or_else(|| self.out_of_range(expected))
    }

    /// The value as two numbers.
    pub fn pair(&self) -> Result<[f64; 2], JobError> {
        match self.list()?.as_slice() {
            [first, second] => Ok([first.number()?, second.number()?]),
            _ => Err(self.wrong_kind(&self.expected())),
        }
    }

    /// The value as one of some words.
    pub fn word<T: Choice + Clone>(&self) -> Result<T, JobError> {
        let found = self.text()?;
        T::named(found).cloned().ok_or_else(|| {
            let names: Vec<&str> = T::WORDS.iter().map(|word| word.name).collect();
            let mut fault = self.fault(self.expected());
            // Of several words the last one may be meant: "track" in "road track".
            let last = found.rsplit(' ').next().unwrap_or(found);
            if let Some(name) = keys::nearest(found, &names).or_else(|| keys::nearest(last, &names)) {
                fault.hint = format!("did you mean \"{name}\"?");
            }
            if let Some((_, instead)) = T::GONE.iter().find(|(gone, _)| *gone == found) {
                fault.hint = (*instead).to_owned();
            }
            JobError::UnknownWord(fault)
        })
    }

    /// The items of a list of so many.
    pub fn items_of(&self, counts: RangeInclusive<usize>) -> Result<Vec<Entry<'a>>, JobError> {
        let items = self.list()?;
        if counts.contains(&items.len()) { Ok(items) } else { Err(self.out_of_range(self.expected())) }
    }

    /// The items of a list.
    pub fn list(&self) -> Result<Vec<Entry<'a>>, JobError> {
        let items = self.value.get_ref().as_array().ok_or_else(|| self.wrong_kind(&self.expected()))?;
        let item = |(index, value): (usize, &'a Spanned<DeValue<'a>>)| Entry {
            document: self.document,
            key: format!("{}[{index}]", self.key),
            offset: value.span().start,
            value,
        };
        Ok(items.iter().enumerate().map(item).collect())
    }

    /// The keys and values of a table of any keys, sorted by key.
    pub fn items(&self) -> Result<Vec<(String, Entry<'a>)>, JobError> {
        let table = self.value.get_ref().as_table().ok_or_else(|| self.wrong_kind(&self.expected()))?;
        let item = |(key, value): (&'a Spanned<Cow<'a, str>>, &'a Spanned<DeValue<'a>>)| {
            let name = key.get_ref().to_string();
            let (document, offset) = (self.document, key.span().start);
            let entry = Entry { document, key: format!("{}.{name}", self.key), offset, value };
            (name, entry)
        };
        let mut items: Vec<_> = table.iter().map(item).collect();
        items.sort_by(|(one, _), (other, _)| one.cmp(other));
        Ok(items)
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

/// A number whose range ends within 32 bits.
pub(crate) fn in_32_bits(number: u64) -> u32 {
    u32::try_from(number).expect("the range ends within 32 bits")
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
