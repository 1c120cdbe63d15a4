//! Why a run ended without a result.

use crate::ground::{GroundError, TaskError};
use crate::product::ProductError;
use schedule::ScheduleError;
use source_files::SourceError;
use store::DatabaseError;
use store::engine::StoreError;
use terrain::TileId;
use thiserror::Error;

use crate::Stage;

/// Why a run ended without a result.
#[derive(Debug, Error)]
pub enum CompileError {
    /// The job has no ground: a raster or a file cannot be used, or the job asks for what cannot be.
    #[error(transparent)]
    Ground(#[from] GroundError),
    /// The database cannot be read or written.
    #[error(transparent)]
    Database(#[from] DatabaseError),
    /// A stage was not worked through to its end.
    #[error(transparent)]
    Task(#[from] TaskError),
    /// Other processes build something else in the same directory.
    #[error("{path}: other processes are building from another job or other sources here")]
    OtherRun {
        /// The directory.
        path: String,
    },
    /// What a unit of work needs is not done yet.
    #[error("{unit} needs {needs}, which is not done yet")]
    NotReady {
        /// The unit of work.
        unit: String,
        /// What it waits for.
        needs: String,
    },
    /// The GeoPackage of features could not be made.
    #[error("features.gpkg cannot be made: {message}")]
    Package {
        /// What the library says.
        message: String,
    },
    /// The database was made for another job.
    #[error("{path}: built from another job than this one, expected the same job: {difference}")]
    OtherJob {
        /// The database.
        path: String,
        /// The first line that differs.
        difference: String,
    },
}

impl From<StoreError> for CompileError {
    fn from(error: StoreError) -> Self {
        CompileError::Database(error.into())
    }
}

impl From<SourceError> for CompileError {
    fn from(error: SourceError) -> Self {
        CompileError::Ground(error.into())
    }
}

impl From<ProductError> for CompileError {
    fn from(error: ProductError) -> Self {
        match error {
            ProductError::Database(error) => CompileError::Database(error),
            ProductError::Ground(error) => CompileError::Ground(error),
            ProductError::Package { message } => CompileError::Package { message },
        }
    }
}

impl CompileError {
    /// What could be done about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            CompileError::Ground(error) => error.hint(),
            CompileError::Database(error) => error.hint().map(str::to_owned),
            CompileError::Task(error) => Some(error.hint().to_owned()),
            CompileError::Package { .. } => Some("free some memory and build again".to_owned()),
            CompileError::OtherRun { .. } => {
                Some("wait for them to end, or build into another folder with --out".to_owned())
            }
            CompileError::NotReady { .. } => Some("try again when it is, or run `tiefort build`".to_owned()),
            CompileError::OtherJob { .. } => Some("run `tiefort build` first, which rebuilds what changed".to_owned()),
        }
    }

    /// Whether trying again later may work.
    pub fn is_transient(&self) -> bool {
        match self {
            CompileError::Database(error) => error.is_transient(),
            CompileError::NotReady { .. } | CompileError::OtherRun { .. } => true,
            _ => false,
        }
    }

    /// Whether the run ended because it was asked to.
    pub fn is_stopped(&self) -> bool {
        matches!(
            self,
            CompileError::Task(TaskError::Stopped { .. })
                | CompileError::Ground(GroundError::Task(TaskError::Stopped { .. }))
        )
    }

    /// The error of a stage's tasks, whose numbers are row-major places of `tiles`; one beyond them names the first.
    pub fn from_schedule<R>(stage: Stage, tiles: &[TileId], error: ScheduleError<R, CompileError>) -> CompileError {
        TaskError::of(stage.name(), tiles, error, Self::Task)
    }
}
