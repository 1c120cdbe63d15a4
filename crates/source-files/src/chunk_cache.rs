//! Decoded chunks, kept while there is room: those asked for last stay longest.
//!
//! Tiles that lie beside each other need the same strips of a raster, and are worked on one after the other, so a few
//! hundred megabytes spare nearly all repeated decoding, however large the raster is.

use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex};

use lru::LruCache;

use crate::chunk::Chunk;
use crate::geotiff::FileDecoder;
use crate::kept::{Kept, locked};
use crate::{DemFile, SourceError};

/// Open files whose directory is kept read.
const DECODERS_MAX: usize = 32;

/// A file's place in the list it was given in, and a chunk of it.
type Key = (usize, u32);

/// Decoded chunks of any number of files.
pub(crate) struct ChunkCache {
    kept: Kept<Key, Chunk>,
    decoders: Mutex<LruCache<usize, Vec<FileDecoder>>>,
}

impl std::fmt::Debug for ChunkCache {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ChunkCache").field("bytes_max", &self.kept.bytes_max()).finish_non_exhaustive()
    }
}

impl ChunkCache {
    /// With room for `bytes_max` bytes of samples, and one chunk in any case.
    pub(crate) fn new(bytes_max: u64) -> Self {
        let decoders = LruCache::new(NonZeroUsize::new(DECODERS_MAX).expect("32 is not 0"));
        Self { kept: Kept::new(bytes_max), decoders: Mutex::new(decoders) }
    }

    /// How often a chunk was decoded.
    pub(crate) fn decoded(&self) -> u64 {
        self.kept.decoded()
    }

    /// Chunk `chunk` of `file`, the one at place `index`.
    pub(crate) fn chunk(&self, file: &DemFile, index: usize, chunk: u32) -> Result<Arc<Chunk>, SourceError> {
        self.kept.get((index, chunk), || {
            let decoded = self.decode(file, index, chunk)?;
            let bytes = decoded.bytes();
            Ok((decoded, bytes))
        })
    }

    fn decode(&self, file: &DemFile, index: usize, chunk: u32) -> Result<Chunk, SourceError> {
        let mut kept = locked(&self.decoders).get_mut(&index).and_then(Vec::pop);
        let decoded = file.decode_one(chunk, &mut kept);
        if let Some(decoder) = kept {
            locked(&self.decoders).get_or_insert_mut(index, Vec::new).push(decoder);
        }
        decoded
    }
}
