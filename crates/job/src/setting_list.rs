//! One setting of a job, and the list of them as it is written: as TOML, and with what each means.

use std::fmt::Display;

use crate::{Choice, key};

/// One setting of a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The key with its section, as `area.spacing_m`.
    pub key: &'static str,
    /// The value as the job file writes it.
    pub value: String,
    /// What it means for this run.
    pub meaning: String,
}

/// The settings so far.
pub(crate) struct List(pub Vec<Setting>);

impl List {
    /// A setting that means the same in every run.
    pub(crate) fn add(&mut self, key: &'static str, value: String) {
        self.say(key, value, meaning(key));
    }

    /// A setting, and what it comes to in this run.
    pub(crate) fn add_with(&mut self, key: &'static str, value: String, here: impl Display) {
        self.say(key, value, format!("{}: {here}", meaning(key)));
    }

    /// A setting of some words.
    pub(crate) fn choice<T: Choice>(&mut self, key: &'static str, value: &T) {
        let word = value.word();
        self.say(key, quoted(word.name), word.text());
    }

    /// A setting with a meaning of its own.
    pub(crate) fn say(&mut self, key: &'static str, value: String, meaning: impl Into<String>) {
        self.0.push(Setting { key, value, meaning: meaning.into() });
    }
}

fn meaning(name: &str) -> &'static str {
    key(name).map_or("", |key| key.meaning)
}

/// A number as TOML, the shortest that reads back the same: 500 for 500.0, 31.25, 1e-7.
pub(crate) fn number(value: f64) -> String {
    let value = value + 0.0; // so that -0 is written as 0
    if value.fract() == 0.0 && value.abs() < 1.0e15 { format!("{value:.0}") } else { format!("{value:?}") }
}

/// A text as a TOML basic string.
pub(crate) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out += &format!("\\u{:04X}", u32::from(c)),
            c => out.push(c),
        }
    }
    out + "\""
}

/// So many of what is counted, in words.
pub(crate) fn counted(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_the_same() {
        for value in [500.0, 31.25, 0.0078125, 1.0e-4, 5264750.5, 0.1 + 0.2, -3.0] {
            assert_eq!(number(value).parse::<f64>().unwrap(), value);
        }
        assert_eq!(number(500.0), "500");
    }

    #[test]
    fn text_is_escaped() {
        assert_eq!(quoted("a\"b\\c\n"), "\"a\\\"b\\\\c\\u000A\"");
    }
}
