//! What is known of a key of a job file.

use std::ops::RangeInclusive;

use crate::{Choice, MethodName};

/// What holds of a source where a job does not say: what its file does.
pub(crate) const FILE_SAYS: &str = "as the file says";

/// A table of a job file, or one that stands in it, and its keys.
#[derive(Debug)]
pub struct KeyTable {
    /// Its place: `area`, `area.around`, or `dem.sources[]` for an item of a list.
    pub place: &'static str,
    /// What it is about.
    pub meaning: &'static str,
    /// Its keys.
    pub keys: &'static [Key],
}

/// A key of a job file: all that is known of it.
#[derive(Debug)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// What it may be.
    pub values: Values,
    /// What holds where a job leaves it out.
    pub usual: Usual,
    /// The only values of `tin.method` with which a job may have it; none for all.
    pub methods: &'static [MethodName],
    example: &'static str,
}

/// What a key may be.
#[derive(Debug)]
pub enum Values {
    /// One of some words, each with its meaning and what it costs.
    Words(fn() -> Vec<[String; 3]>),
    /// A whole number.
    Whole(&'static str, RangeInclusive<u64>),
    /// A number.
    Number(&'static str, RangeInclusive<f64>),
    /// A line of text of at most so many characters.
    Line(&'static str, usize),
    /// `true` or `false`.
    Flag,
    /// As it says.
    Form(&'static str),
    /// As it says, with bounds.
    Bounded(fn() -> String),
}

/// What holds where a job leaves a key out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usual {
    /// A job cannot leave it out.
    Needed,
    /// This value.
    Is(&'static str),
    /// As it says.
    Otherwise(&'static str),
}

impl Key {
    pub(crate) const fn new(name: &'static str, meaning: &'static str) -> Self {
        Self { name, meaning, values: Values::Flag, usual: Usual::Needed, methods: &[], example: "" }
    }

    pub(crate) const fn words<T: Choice>(self) -> Self {
        Self { values: Values::Words(words_of::<T>), ..self }
    }

    pub(crate) const fn whole(self, what: &'static str, range: RangeInclusive<u64>) -> Self {
        Self { values: Values::Whole(what, range), ..self }
    }

    pub(crate) const fn number(self, what: &'static str, range: RangeInclusive<f64>) -> Self {
        Self { values: Values::Number(what, range), ..self }
    }

    pub(crate) const fn line(self, what: &'static str, most: usize) -> Self {
        Self { values: Values::Line(what, most), ..self }
    }

    pub(crate) const fn form(self, form: &'static str) -> Self {
        Self { values: Values::Form(form), ..self }
    }

    pub(crate) const fn bounded(self, form: fn() -> String) -> Self {
        Self { values: Values::Bounded(form), ..self }
    }

    pub(crate) const fn usual(self, value: &'static str) -> Self {
        Self { usual: Usual::Is(value), ..self }
    }

    pub(crate) const fn otherwise(self, what: &'static str) -> Self {
        Self { usual: Usual::Otherwise(what), ..self }
    }

    pub(crate) const fn of(self, methods: &'static [MethodName]) -> Self {
        Self { methods, ..self }
    }

    pub(crate) const fn example(self, example: &'static str) -> Self {
        Self { example, ..self }
    }

    /// What it may be, in words.
    pub fn expected(&self) -> String {
        match &self.values {
            Values::Words(words) => {
                words().iter().map(|[name, ..]| format!("\"{name}\"")).collect::<Vec<_>>().join(" or ")
            }
            Values::Whole(what, range) => whole_text(what, range),
            Values::Number(what, range) => format!("{what} from {} to {}", range.start(), range.end()),
            Values::Line(what, most) => format!("{what}, 1 to {most} characters"),
            Values::Flag => "true or false".to_owned(),
            Values::Form(form) => (*form).to_owned(),
            Values::Bounded(form) => form(),
        }
    }

    /// How it may be written.
    pub fn example_text(&self) -> String {
        match (self.example, &self.values, self.usual) {
            ("", Values::Words(_), Usual::Is(word)) => format!("{} = \"{word}\"", self.name),
            ("", _, Usual::Is(value)) => format!("{} = {value}", self.name),
            (example, ..) => example.to_owned(),
        }
    }
}

fn words_of<T: Choice>() -> Vec<[String; 3]> {
    T::WORDS.iter().map(|word| [word.name.to_owned(), word.meaning.to_owned(), word.cost.text()]).collect()
}

/// A whole number, in words.
pub(crate) fn whole_text(what: &str, range: &RangeInclusive<u64>) -> String {
    format!("{what}, a whole number from {} to {}", range.start(), range.end())
}
