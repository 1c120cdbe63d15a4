//! Why a finished database could not be read back.

use crate::ground::GroundError;
use store::DatabaseError;
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
    /// The GeoPackage of features could not be made.
    #[error("features.gpkg cannot be made: {message}")]
    Package {
        /// What the library says.
        message: String,
    },
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

    /// Whether it can be read without its ground: a file that it was built from is at fault.
    pub fn is_of_the_ground(&self) -> bool {
        matches!(self, Self::Ground(GroundError::Impossible { .. } | GroundError::Source(_)))
    }
}
