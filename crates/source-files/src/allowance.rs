//! How much memory what is read of one file may take, by how large the file is.
//!
//! Packed data repeats itself, and so do files that were made to do harm: 442 kB of OpenStreetMap data may unpack to a
//! way of 96 million nodes. What is kept is counted as it grows, and a file that asks for more than its share is
//! refused before it has it. The count does not depend on who works on which part.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::SourceError;
use crate::limits::{FEATURE_BYTES_A_BYTE, FEATURE_BYTES_FREE, FEATURE_BYTES_MAX};

/// Bytes that a vertex takes on its way: as it is read, projected, cut and kept.
pub(crate) const VERTEX_BYTES: usize = 32;

/// What a file may take, and what it has taken so far.
#[derive(Debug)]
pub(crate) struct Allowance {
    path: PathBuf,
    file_bytes: u64,
    bytes_max: u64,
    taken: AtomicU64,
}

impl Allowance {
    /// For the file at `path`, which has so many bytes.
    pub(crate) fn new(path: &Path, file_bytes: u64) -> Self {
        let bytes_max = FEATURE_BYTES_FREE.saturating_add(FEATURE_BYTES_A_BYTE.saturating_mul(file_bytes));
        Self { path: path.into(), file_bytes, bytes_max: bytes_max.min(FEATURE_BYTES_MAX), taken: AtomicU64::new(0) }
    }

    /// The file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Counts bytes that are about to be taken.
    ///
    /// # Errors
    /// When they and all before are more than the file may take.
    pub(crate) fn take(&self, bytes: usize) -> Result<(), SourceError> {
        self.count(bytes);
        self.check()
    }

    /// Counts bytes where nothing can be refused.
    pub(crate) fn count(&self, bytes: usize) {
        self.taken.fetch_add(bytes as u64, Ordering::Relaxed);
    }

    /// Whether more was counted than the file may take.
    pub(crate) fn is_spent(&self) -> bool {
        self.bytes_max < self.taken.load(Ordering::Relaxed)
    }

    /// The refusal where more was counted than the file may take.
    pub(crate) fn check(&self) -> Result<(), SourceError> {
        match self.is_spent() {
            false => Ok(()),
            true => Err(SourceError::OutOfProportion {
                path: self.path.clone(),
                file_bytes: self.file_bytes,
                limit: self.bytes_max,
            }),
        }
    }
}
