//! The bytes of a source, for its hash: a database says what it was made from.

use std::fs::File;
use std::path::Path;

use crate::SourceError;

/// The file at `path`, whose bytes are read as they are wanted: a source may be larger than the memory there is.
///
/// # Errors
/// When it cannot be opened.
pub fn content(path: &Path) -> Result<File, SourceError> {
    File::open(path).map_err(|source| SourceError::Read { path: path.into(), source })
}
