//! Why there is no ground.

use schedule::ScheduleError;
use source_files::SourceError;
use store::DatabaseError;
use terrain::TileId;
use thiserror::Error;

/// Why there is no ground.
#[derive(Debug, Error)]
pub enum GroundError {
    /// A raster or a file of polygons cannot be used.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// What features put into the ground cannot be read back.
    #[error(transparent)]
    Database(#[from] DatabaseError),
    /// The job asks for what cannot be.
    #[error("{key}: {found}, expected {expected}")]
    Impossible {
        /// Key of the job, or the argument.
        key: String,
        /// What was found.
        found: String,
        /// What would do.
        expected: String,
        /// What to change.
        hint: String,
    },
    /// The ground has heights that no source has: a fault of ours.
    #[error(
        "heights of the ground run from {:.2} m to {:.2} m, expected them within those of the sources, {:.2} m to \
        {:.2} m",
        found_m.0, found_m.1, expected_m.0, expected_m.1
    )]
    OutsideSources {
        /// The lowest and the highest height of a part of the ground, in metres.
        found_m: (f64, f64),
        /// The same of all sources under the area.
        expected_m: (f64, f64),
    },
    /// A task panicked: a fault of ours.
    #[error("tile {tile} failed in stage read: {message}")]
    Panicked {
        /// The tile.
        tile: TileId,
        /// What the panic said.
        message: String,
    },
    /// The run was asked to stop.
    #[error("stopped in stage read with {done} of {total} tiles done")]
    Stopped {
        /// Tiles, or parts of a file, that were read.
        done: usize,
        /// All there are.
        total: usize,
    },
    /// The system gave no thread.
    #[error("workers: {found}, expected as many threads as workers")]
    NoThread {
        /// What the system said.
        found: String,
    },
}

impl GroundError {
    /// What could be done about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            GroundError::Source(error) => error.hint(),
            GroundError::Database(error) => error.hint().map(str::to_owned),
            GroundError::Impossible { hint, .. } => Some(hint.clone()),
            GroundError::OutsideSources { .. } => {
                Some("this is a fault of the compiler; other rules in dem.voids or dem.resampling may avoid it".into())
            }
            GroundError::Panicked { .. } => {
                Some("this is a fault of the compiler; what was published before is intact".to_owned())
            }
            GroundError::Stopped { .. } => Some("run the same command again; nothing was left half-written".to_owned()),
            GroundError::NoThread { .. } => Some("use fewer --workers".to_owned()),
        }
    }

    /// The error of tasks whose numbers are the places of `tiles`.
    pub fn from_schedule<R, E: From<GroundError>>(tiles: &[TileId], error: ScheduleError<R, E>) -> E {
        let error = match error {
            ScheduleError::Failed { error, .. } => return error,
            ScheduleError::Panicked { task, message } => GroundError::Panicked { tile: tiles[task], message },
            ScheduleError::Stopped { done, tasks } => GroundError::Stopped { done: done.len(), total: tasks },
            ScheduleError::NoThread { message, .. } => GroundError::NoThread { found: message },
        };
        error.into()
    }
}
