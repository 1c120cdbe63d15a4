//! Why an artifact is made.

use std::fmt;

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
