//! What can be wrong with a job.

use std::fmt;
use std::path::PathBuf;

use thiserror::Error;

/// Why a job cannot be run. One paragraph each; [`JobError::hint`] adds what to do about it.
#[derive(Debug, Error)]
pub enum JobError {
    /// The job file cannot be opened or read.
    #[error("{path}: found no readable job file ({source}), expected a TOML file")]
    Unreadable {
        /// The job file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// What is named is no job file.
    #[error("{path}: found {found}, expected a job file")]
    NotAJob {
        /// What was named.
        path: PathBuf,
        /// What it is.
        found: &'static str,
        /// What to do about it.
        hint: String,
    },
    /// The job file is far longer than any job.
    #[error("{path}: found {found} bytes, expected a job file of at most {limit}")]
    TooLong {
        /// The job file.
        path: PathBuf,
        /// Its length in bytes.
        found: u64,
        /// The longest that is read.
        limit: u64,
    },
    /// The job file is not text.
    #[error("{path}: found bytes that are not UTF-8 after byte {after}, expected a TOML file")]
    NotText {
        /// The job file.
        path: PathBuf,
        /// How many bytes are good.
        after: usize,
    },
    /// The job file is not TOML.
    #[error("{path}:{line}:{column}: found text that is not TOML: {message}")]
    Syntax {
        /// The job file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What the parser said.
        message: String,
    },
    /// A lock that is not as it was written.
    #[error("{path}: found {found}, expected a lock as `tiefort fetch` writes it")]
    BrokenLock {
        /// The lock.
        path: PathBuf,
        /// What is the matter.
        found: String,
    },
    /// A key that no job has.
    #[error("{0}")]
    UnknownKey(Box<Fault>),
    /// A key that every job needs.
    #[error("{0}")]
    Missing(Box<Fault>),
    /// A value of the wrong type.
    #[error("{0}")]
    WrongKind(Box<Fault>),
    /// A word that is not among those the key knows.
    #[error("{0}")]
    UnknownWord(Box<Fault>),
    /// A value beyond its range, or one that does not fit the grid.
    #[error("{0}")]
    OutOfRange(Box<Fault>),
    /// Keys that do not go together.
    #[error("{0}")]
    Conflict(Box<Fault>),
    /// Something this version does not do yet.
    #[error("{0}")]
    Unsupported(Box<Fault>),
    /// A named file that is not there, or a pattern that finds none.
    #[error("{0}")]
    NoSuchFile(Box<Fault>),
    /// A pattern or a link that leads out of its folder.
    #[error("{0}")]
    LeavesFolder(Box<Fault>),
}

/// One thing wrong at one key of a job file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The job file.
    pub path: PathBuf,
    /// Line, from 1; absent when a whole section is missing.
    pub line: Option<usize>,
    /// The key with its section, as `area.spacing_m`.
    pub key: String,
    /// What the job says.
    pub found: String,
    /// What it could say.
    pub expected: String,
    /// What to do about it.
    pub hint: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        write!(f, ": {}: found {}, expected {}", self.key, self.found, self.expected)
    }
}

impl JobError {
    /// What to do about it, as a sentence without a full stop.
    pub fn hint(&self) -> String {
        let example = "a working job starts with [area] and name, crs, origin_m, size_m, spacing_m";
        match self {
            JobError::Unreadable { .. } => "give the path of a job file, for example configs/ntc.toml".into(),
            JobError::NotAJob { hint, .. } => hint.clone(),
            JobError::TooLong { .. } => example.into(),
            JobError::NotText { path, .. } => {
                format!("a job is text; for a raster this writes one: tiefort init {} --out mine.toml", path.display())
            }
            JobError::BrokenLock { .. } => "remove it, and run `tiefort fetch` again: fetched files are kept".into(),
            JobError::Syntax { .. } => "texts are quoted: name = \"ntc\"; sections are in brackets: [area]".into(),
            JobError::UnknownKey(fault)
            | JobError::Missing(fault)
            | JobError::WrongKind(fault)
            | JobError::UnknownWord(fault)
            | JobError::OutOfRange(fault)
            | JobError::Conflict(fault)
            | JobError::Unsupported(fault)
            | JobError::NoSuchFile(fault)
            | JobError::LeavesFolder(fault) => fault.hint.clone(),
        }
    }
}
