//! Why an export ended without its files.

use schedule::ScheduleError;
use store::DatabaseError;
use thiserror::Error;

/// Why an export ended without its files.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The database cannot be read.
    #[error(transparent)]
    Database(#[from] DatabaseError),
    /// What was asked for is not in the database.
    #[error("{what}: found {found}, expected {expected}")]
    Impossible {
        /// Which argument, or which part of the database.
        what: String,
        /// What was found.
        found: String,
        /// What would do.
        expected: String,
        /// What to do instead.
        hint: String,
    },
    /// The ground that the database was built from cannot be read.
    #[error("{message}")]
    Ground {
        /// Why.
        message: String,
        /// What could be done about it.
        hint: Option<String>,
    },
    /// A file cannot be written.
    #[error("{name}: cannot be written: {source}")]
    Write {
        /// Its name inside the export.
        name: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The export was asked to stop.
    #[error("stopped with {done} of {total} {what} done")]
    Stopped {
        /// What is counted.
        what: &'static str,
        /// How many were done.
        done: usize,
        /// How many there are.
        total: usize,
    },
    /// A task panicked: a fault of ours.
    #[error("{what} {index} failed: {message}")]
    Panicked {
        /// What is counted.
        what: &'static str,
        /// Which one.
        index: usize,
        /// What the panic said.
        message: String,
    },
    /// The system gave no thread.
    #[error("workers: {found}, expected as many threads as workers")]
    NoThread {
        /// What the system said.
        found: String,
    },
}

impl ExportError {
    /// What could be done about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Database(error) => error.hint().map(str::to_owned),
            Self::Impossible { hint, .. } => Some(hint.clone()),
            Self::Ground { hint, .. } => hint.clone(),
            Self::Write { .. } => Some("check that there is room and that the folder is writable".into()),
            Self::Stopped { .. } => Some("run the same command again; nothing was left half-written".into()),
            Self::Panicked { .. } => Some("this is a fault of tiefort; the database is intact".into()),
            Self::NoThread { .. } => Some("use fewer --workers".into()),
        }
    }

    /// The same where several databases are read, of which this one is meant.
    pub(crate) fn of(self, name: &str) -> Self {
        match self {
            Self::Impossible { what, found, expected, hint } => {
                Self::Impossible { what: format!("{name}: {what}"), found, expected, hint }
            }
            error => error,
        }
    }

    /// A file of this name that could not be written.
    pub fn write(name: &str) -> impl Fn(std::io::Error) -> Self {
        move |source| Self::Write { name: name.to_owned(), source }
    }

    /// The error of a run of tasks.
    pub(crate) fn of_schedule<R>(what: &'static str, error: ScheduleError<R, Self>) -> Self {
        match error {
            ScheduleError::Failed { error, .. } => error,
            ScheduleError::Panicked { task, message } => Self::Panicked { what, index: task, message },
            ScheduleError::Stopped { done, tasks } => Self::Stopped { what, done: done.len(), total: tasks },
            ScheduleError::NoThread { message, .. } => Self::NoThread { found: message },
        }
    }
}
