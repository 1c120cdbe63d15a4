//! What an artifact is made from, part by named part.

use std::collections::BTreeMap;

use crate::engine::{Fingerprint, FingerprintBuilder};

/// Rises when what any part feeds changes its form; every published artifact is stale then.
const KEY_VERSION: u64 = 1;

/// What a published artifact was made by and from: fresh while both are what they would be today.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Rises whenever an algorithm's results may change.
    pub algorithm_revision: u32,
    /// Of all inputs.
    pub fingerprint: Fingerprint,
}

/// One part of what artifacts are made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// As it is written down.
    pub name: &'static str,
    /// What is said when it changed.
    pub changed: &'static str,
}

/// The parts of a key as they are written down: by name, the first 16 hexadecimal digits of each fingerprint.
pub type Parts = BTreeMap<String, String>;

/// What an artifact is made from. Two keys are equal when all parts are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    purpose: &'static str,
    parts: Vec<(Part, Fingerprint)>,
}

impl Key {
    /// Of nothing yet; equal parts for different purposes give different fingerprints.
    pub fn new(purpose: &'static str) -> Self {
        Self { purpose, parts: Vec::new() }
    }

    /// Adds a part: what `feed` feeds.
    #[must_use]
    pub fn part(self, part: Part, feed: impl FnOnce(FingerprintBuilder) -> FingerprintBuilder) -> Self {
        self.known(part, feed(FingerprintBuilder::new(part.name)).finish())
    }

    /// Adds a part whose fingerprint is known.
    #[must_use]
    pub fn known(mut self, part: Part, fingerprint: Fingerprint) -> Self {
        self.parts.push((part, fingerprint));
        self
    }

    /// The fingerprint of all parts.
    pub fn fingerprint(&self) -> Fingerprint {
        let builder = FingerprintBuilder::new(self.purpose).number(KEY_VERSION);
        let feed = |builder: FingerprintBuilder, (part, fingerprint): &(Part, Fingerprint)| {
            builder.text(part.name).fingerprint(*fingerprint)
        };
        self.parts.iter().fold(builder, feed).finish()
    }

    /// The stamp of what this revision makes from them.
    pub fn stamp(&self, algorithm_revision: u32) -> Stamp {
        Stamp { algorithm_revision, fingerprint: self.fingerprint() }
    }

    /// The parts as they are written down.
    pub fn parts(&self) -> Parts {
        self.parts.iter().map(|(part, fingerprint)| (part.name.to_owned(), brief(*fingerprint))).collect()
    }

    /// What changed since parts were written down, in the order of the key.
    pub(crate) fn changed_since(&self, before: &Parts) -> Vec<&'static str> {
        let differs = |(part, now): &&(Part, Fingerprint)| before.get(part.name) != Some(&brief(*now));
        self.parts.iter().filter(differs).map(|(part, _)| part.changed).collect()
    }
}

fn brief(fingerprint: Fingerprint) -> String {
    fingerprint.to_string()[..16].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEIGHTS: Part = Part { name: "heights", changed: "its heights changed" };
    const RULES: Part = Part { name: "rules", changed: "the rules changed" };

    fn key(heights: u64, rules: &str) -> Key {
        Key::new("tests").part(HEIGHTS, |part| part.number(heights)).part(RULES, |part| part.text(rules))
    }

    #[test]
    fn the_parts_that_changed_are_named() {
        let before = key(1, "a").parts();
        assert_eq!(key(1, "a").changed_since(&before), Vec::<&str>::new());
        assert_eq!(key(2, "a").changed_since(&before), ["its heights changed"]);
        assert_eq!(key(2, "b").changed_since(&before), ["its heights changed", "the rules changed"]);
        assert_eq!(key(1, "a").changed_since(&Parts::new()).len(), 2, "a part that was not written down has changed");
    }

    #[test]
    fn every_part_and_the_purpose_count() {
        let all = [key(1, "a"), key(2, "a"), key(1, "b"), Key { purpose: "others", ..key(1, "a") }];
        for (at, one) in all.iter().enumerate() {
            for other in &all[at + 1..] {
                assert_ne!(one.fingerprint(), other.fingerprint());
            }
        }
    }
}
