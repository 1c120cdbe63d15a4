//! Why there is no ground, and why tasks ended early.

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
    /// It was not read to its end.
    #[error(transparent)]
    Task(#[from] TaskError),
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
            GroundError::Task(error) => Some(error.hint().to_owned()),
        }
    }

    /// The error of tasks whose numbers are the places of `tiles`; one beyond them names the first.
    pub fn from_schedule<R, E: From<GroundError>>(tiles: &[TileId], error: ScheduleError<R, E>) -> E {
        TaskError::of("read", tiles, error, |error| GroundError::from(error).into())
    }
}

/// Why tasks ended early.
#[derive(Debug, Error)]
pub enum TaskError {
    /// A task panicked: a fault of ours.
    #[error("tile {tile} failed in stage {stage}: {message}")]
    Panicked {
        /// The name of the stage.
        stage: &'static str,
        /// The tile.
        tile: TileId,
        /// What the panic said.
        message: String,
    },
    /// The run was asked to stop.
    #[error("stopped in stage {stage} with {done} of {total} tiles done")]
    Stopped {
        /// The name of the stage.
        stage: &'static str,
        /// Tiles, or parts of a file, that were done.
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

impl TaskError {
    /// What could be done about it.
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Panicked { .. } => "this is a fault of the compiler; what was published before is intact",
            Self::Stopped { .. } => "run the same command again; nothing was left half-written",
            Self::NoThread { .. } => "use fewer --workers",
        }
    }

    /// The error of a stage's tasks, whose numbers are the places of `tiles`; one beyond them names the first.
    pub(crate) fn of<R, E>(
        stage: &'static str,
        tiles: &[TileId],
        error: ScheduleError<R, E>,
        into: impl FnOnce(Self) -> E,
    ) -> E {
        into(match error {
            ScheduleError::Failed { error, .. } => return error,
            ScheduleError::Panicked { task, message } => {
                let tile = tiles.get(task).copied().unwrap_or(TileId { row: 0, col: 0 });
                Self::Panicked { stage, tile, message }
            }
            ScheduleError::Stopped { done, tasks } => Self::Stopped { stage, done: done.len(), total: tasks },
            ScheduleError::NoThread { message, .. } => Self::NoThread { found: message },
        })
    }
}
