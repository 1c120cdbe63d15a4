//! Why a finished database could not be read back.

use database::DatabaseError;
use ground::GroundError;
use schedule::ScheduleError;
use terrain::TileId;
use thiserror::Error;

/// Why a finished database could not be read back.
#[derive(Debug, Error)]
pub enum ProductError {
    /// The database cannot be read.
    #[error(transparent)]
    Database(#[from] DatabaseError),
    /// The ground under it cannot be found or used, or it has not what was asked for.
    #[error(transparent)]
    Ground(#[from] GroundError),
}

impl ProductError {
    /// What was asked for is not there.
    pub(crate) fn impossible(
        key: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
        hint: &str,
    ) -> Self {
        let (key, found, expected) = (key.into(), found.into(), expected.into());
        GroundError::Impossible { key, found, expected, hint: hint.to_owned() }.into()
    }

    /// The error of tasks whose numbers are the places of `tiles`.
    pub(crate) fn from_schedule<R>(tiles: &[TileId], error: ScheduleError<R, Self>) -> Self {
        Self::Ground(match error {
            ScheduleError::Failed { error, .. } => return error,
            ScheduleError::Panicked { task, message } => GroundError::Panicked { tile: tiles[task], message },
            ScheduleError::Stopped { done, tasks } => GroundError::Stopped { done: done.len(), total: tasks },
            ScheduleError::NoThread { message, .. } => GroundError::NoThread { found: message },
        })
    }

    /// Whether it can be read without its ground: a file that it was built from is at fault.
    pub fn is_of_the_ground(&self) -> bool {
        matches!(self, Self::Ground(GroundError::Impossible { .. } | GroundError::Source(_)))
    }
}
