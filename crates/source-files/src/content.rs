//! The bytes of a source, for its hash: a database says what it was made from.

use std::path::Path;

use crate::SourceError;

/// All bytes of the file at `path`.
///
/// # Errors
/// When it cannot be read.
pub fn content(path: &Path) -> Result<Vec<u8>, SourceError> {
    std::fs::read(path).map_err(|source| SourceError::Read { path: path.into(), source })
}
