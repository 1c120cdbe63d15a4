//! Keep or make, and why: the one place that decides it.

use std::fmt;

use crate::engine::{Key, Parts, Stamp};

/// One artifact of one kind: what it is made from, how it is read, how it is made.
pub trait Artifact {
    /// What the caller is given.
    type Output;
    /// Why it cannot be made, or not be read.
    type Error: fmt::Display;

    /// All that it is made from now.
    fn key(&self) -> Key;

    /// What the published one was made from, as far as that can be said without reading it whole; `None` when there is
    /// none.
    ///
    /// # Errors
    /// When what is there is damaged.
    fn published(&self) -> Result<Option<Stamp>, Self::Error>;

    /// The published one if it is whole, and what it was made from: it may have been replaced since that was asked.
    fn read(&self, key: &Key) -> Option<(Stamp, Self::Output)>;

    /// What an earlier run wrote down of the published one, whose stamp was found.
    fn before(&self, _found: &Stamp) -> Before {
        Before::Unknown
    }

    /// Makes and publishes it.
    ///
    /// # Errors
    /// When something that it is made from cannot be had, or it cannot be written.
    fn make(&self, key: &Key, stamp: &Stamp) -> Result<Self::Output, Self::Error>;
}

/// What is known of how a published artifact was made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Before {
    /// Nothing.
    Unknown,
    /// From these parts.
    Parts(Parts),
    /// In a way that holds only until it is made again; and which.
    Provisional(&'static str),
}

/// How an artifact was come by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome<T> {
    /// What was published is fresh.
    Kept(T),
    /// It was made now, and why.
    Made(T, Cause),
}

impl<T> Outcome<T> {
    /// The artifact.
    pub fn into_inner(self) -> T {
        match self {
            Outcome::Kept(output) | Outcome::Made(output, _) => output,
        }
    }

    /// The same of something else.
    pub fn map<R>(self, to: impl FnOnce(T) -> R) -> Outcome<R> {
        match self {
            Outcome::Kept(output) => Outcome::Kept(to(output)),
            Outcome::Made(output, cause) => Outcome::Made(to(output), cause),
        }
    }
}

/// The published artifact if it is whole and made from what it would be made from now, by this revision; otherwise it
/// is made.
///
/// # Errors
/// When it cannot be made.
pub fn keep_or_make<A: Artifact>(artifact: &A, revision: u32) -> Result<Outcome<A::Output>, A::Error> {
    let key = artifact.key();
    let stamp = key.stamp(revision);
    let published = artifact.published();
    if matches!(published, Ok(Some(found)) if found == stamp)
        && let Some((found, kept)) = artifact.read(&key)
        && found == stamp
    {
        return Ok(Outcome::Kept(kept));
    }
    let cause = cause(artifact, &key, &stamp, published);
    Ok(Outcome::Made(artifact.make(&key, &stamp)?, cause))
}

fn cause<A: Artifact>(artifact: &A, key: &Key, stamp: &Stamp, published: Result<Option<Stamp>, A::Error>) -> Cause {
    let found = match published {
        Err(error) => return Cause::Damaged(error.to_string()),
        Ok(None) => return Cause::New,
        // Its header is as it should be, so what follows is not.
        Ok(Some(found)) if found == *stamp => return Cause::Damaged("its content cannot be read".into()),
        Ok(Some(found)) => found,
    };
    if found.algorithm_revision != stamp.algorithm_revision {
        return Cause::Revision { found: found.algorithm_revision, now: stamp.algorithm_revision };
    }
    match artifact.before(&found) {
        Before::Provisional(which) => Cause::Provisional(which),
        Before::Parts(before) => Cause::Changed(key.changed_since(&before)),
        Before::Unknown => Cause::Other,
    }
}

/// Why an artifact is made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Nothing was published.
    New,
    /// What was published is not as it was written.
    Damaged(String),
    /// Another version of the program made it.
    Revision {
        /// The one that did.
        found: u32,
        /// This one.
        now: u32,
    },
    /// What was published is of a kind that is always made again; and which.
    Provisional(&'static str),
    /// These parts of what it is made from changed.
    Changed(Vec<&'static str>),
    /// It was made from something else, and nothing says from what.
    Other,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cause::New => f.write_str("nothing was there"),
            Cause::Damaged(what) => write!(f, "damaged: {what}"),
            Cause::Revision { found, now } => write!(f, "made by algorithm revision {found}, now {now}"),
            Cause::Provisional(which) => f.write_str(which),
            Cause::Changed(parts) => f.write_str(&parts.join(" and ")),
            Cause::Other => f.write_str("made from something else by a run that was broken off"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Part;
    use std::cell::{Cell, RefCell};

    const INPUT: Part = Part { name: "input", changed: "its input changed" };

    /// The square of a number, published in memory.
    struct Square<'a> {
        of: u64,
        shelf: &'a Shelf,
    }

    #[derive(Default)]
    struct Shelf {
        published: RefCell<Option<(Stamp, Parts, u64)>>,
        is_damaged: Cell<bool>,
        /// What another process publishes before this one reads.
        replaced: RefCell<Option<(Stamp, Parts, u64)>>,
        says_from_what: bool,
    }

    impl Artifact for Square<'_> {
        type Output = u64;
        type Error = &'static str;

        fn key(&self) -> Key {
            Key::new("square").part(INPUT, |part| part.number(self.of))
        }

        fn published(&self) -> Result<Option<Stamp>, &'static str> {
            Ok(self.shelf.published.borrow().as_ref().map(|(stamp, ..)| *stamp))
        }

        fn read(&self, _key: &Key) -> Option<(Stamp, u64)> {
            // Another process may replace it between the two looks.
            if let Some(other) = self.shelf.replaced.take() {
                *self.shelf.published.borrow_mut() = Some(other);
            }
            let published = self.shelf.published.borrow();
            published.as_ref().filter(|_| !self.shelf.is_damaged.get()).map(|(stamp, _, square)| (*stamp, *square))
        }

        fn before(&self, _found: &Stamp) -> Before {
            let published = self.shelf.published.borrow();
            let parts = published.as_ref().filter(|_| self.shelf.says_from_what).map(|(_, parts, _)| parts.clone());
            parts.map_or(Before::Unknown, Before::Parts)
        }

        fn make(&self, key: &Key, stamp: &Stamp) -> Result<u64, &'static str> {
            self.shelf.is_damaged.set(false);
            *self.shelf.published.borrow_mut() = Some((*stamp, key.parts(), self.of * self.of));
            Ok(self.of * self.of)
        }
    }

    #[test]
    fn what_is_fresh_is_kept_and_anything_else_made_for_a_cause() {
        let shelf = Shelf { says_from_what: true, ..Shelf::default() };
        let ask = |of, revision| keep_or_make(&Square { of, shelf: &shelf }, revision).unwrap();
        assert_eq!(ask(3, 1), Outcome::Made(9, Cause::New));
        assert_eq!(ask(3, 1), Outcome::Kept(9));
        assert_eq!(ask(4, 1), Outcome::Made(16, Cause::Changed(vec!["its input changed"])));
        assert_eq!(ask(4, 2), Outcome::Made(16, Cause::Revision { found: 1, now: 2 }));
        shelf.is_damaged.set(true);
        assert_eq!(ask(4, 2), Outcome::Made(16, Cause::Damaged("its content cannot be read".into())));
        assert_eq!(ask(4, 2), Outcome::Kept(16));
    }

    #[test]
    fn what_is_replaced_between_asking_and_reading_is_not_kept() {
        let shelf = Shelf::default();
        let of = |of| Square { of, shelf: &shelf };
        keep_or_make(&of(5), 1).unwrap();
        let other = shelf.published.take();
        keep_or_make(&of(3), 1).unwrap();
        shelf.replaced.replace(other);
        assert_eq!(keep_or_make(&of(3), 1).unwrap().into_inner(), 9);
    }

    #[test]
    fn where_nothing_says_from_what_it_was_made_the_cause_says_so() {
        let shelf = Shelf::default();
        let ask = |of| keep_or_make(&Square { of, shelf: &shelf }, 1).unwrap();
        ask(3);
        assert_eq!(ask(4), Outcome::Made(16, Cause::Other));
    }
}
