//! Decoded strips and tiles of pictures.

use std::sync::Arc;

use super::unpack::Colored;
use crate::SourceError;
use crate::kept::Kept;

/// A picture, its level, and a strip or tile of that.
pub(super) type Key = (usize, usize, u32);

/// Decoded strips and tiles of any number of pictures.
pub struct Keep(Kept<Key, Colored>);

impl Keep {
    /// With room for `bytes_max` bytes, and one strip or tile in any case.
    pub fn new(bytes_max: usize) -> Self {
        Self(Kept::new(bytes_max as u64))
    }

    /// How often a strip or tile was decoded.
    pub fn decoded(&self) -> u64 {
        self.0.decoded()
    }

    pub(super) fn get(
        &self,
        key: Key,
        decode: impl FnOnce() -> Result<Colored, SourceError>,
    ) -> Result<Arc<Colored>, SourceError> {
        self.0.get(key, || {
            let decoded = decode()?;
            let bytes = decoded.bytes() as u64;
            Ok((decoded, bytes))
        })
    }
}
