//! A file by the name that a job has for it.

use std::path::PathBuf;

/// A file that the job names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedFile {
    /// As written in the job, or as the job would write a file that a pattern found: for messages and provenance, so
    /// that no output depends on where the job lies.
    pub written: String,
    /// Where it is: the folder of the job file joined with `written`.
    pub path: PathBuf,
}
