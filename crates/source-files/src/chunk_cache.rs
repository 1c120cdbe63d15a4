//! Decoded chunks, kept while there is room: those asked for last stay longest.
//!
//! Tiles that lie beside each other need the same strips of a raster, and are worked on one after the other, so a few
//! hundred megabytes spare nearly all repeated decoding, however large the raster is.

use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lru::LruCache;

use crate::chunk::Chunk;
use crate::geotiff::FileDecoder;
use crate::{DemFile, SourceError};

/// Open files whose directory is kept read.
const DECODERS_MAX: usize = 32;

/// A file's place in the list it was given in, and a chunk of it.
type Key = (usize, u32);

/// Decoded chunks of any number of files.
pub(crate) struct ChunkCache {
    kept: Mutex<Kept>,
    bytes_max: u64,
    decoders: Mutex<LruCache<usize, Vec<FileDecoder>>>,
}

struct Kept {
    chunks: LruCache<Key, Entry>,
    bytes: u64,
    decoded: u64,
}

/// A chunk, or the place where a thread is decoding it: others who need it wait there.
#[derive(Default)]
struct Entry {
    slot: Arc<Mutex<Option<Arc<Chunk>>>>,
    bytes: u64,
}

impl std::fmt::Debug for ChunkCache {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ChunkCache").field("bytes_max", &self.bytes_max).finish_non_exhaustive()
    }
}

impl ChunkCache {
    /// With room for `bytes_max` bytes of samples, and one chunk in any case.
    pub(crate) fn new(bytes_max: u64) -> Self {
        let kept = Kept { chunks: LruCache::unbounded(), bytes: 0, decoded: 0 };
        let decoders = LruCache::new(NonZeroUsize::new(DECODERS_MAX).expect("32 is not 0"));
        Self { kept: Mutex::new(kept), bytes_max, decoders: Mutex::new(decoders) }
    }

    /// How often a chunk was decoded.
    pub(crate) fn decoded(&self) -> u64 {
        locked(&self.kept).decoded
    }

    /// Chunk `chunk` of `file`, the one at place `index`.
    pub(crate) fn chunk(&self, file: &DemFile, index: usize, chunk: u32) -> Result<Arc<Chunk>, SourceError> {
        let key = (index, chunk);
        let slot = locked(&self.kept).chunks.get_or_insert_mut(key, Entry::default).slot.clone();
        let mut held = locked(&slot);
        if let Some(chunk) = &*held {
            return Ok(chunk.clone());
        }
        let decoded = Arc::new(self.decode(file, index, chunk)?);
        *held = Some(decoded.clone());
        self.book(key, &slot, decoded.bytes());
        Ok(decoded)
    }

    /// Counts a chunk that was decoded, and lets go of those asked for longest ago until there is room for it.
    fn book(&self, key: Key, slot: &Arc<Mutex<Option<Arc<Chunk>>>>, bytes: u64) {
        let mut kept = locked(&self.kept);
        kept.decoded += 1;
        // Its users may have let go of it while it was decoded.
        if let Some(entry) = kept.chunks.peek_mut(&key).filter(|entry| Arc::ptr_eq(&entry.slot, slot)) {
            entry.bytes = bytes;
            kept.bytes += bytes;
        }
        while self.bytes_max < kept.bytes && 1 < kept.chunks.len() {
            let (_, last) = kept.chunks.pop_lru().expect("there are at least two");
            kept.bytes -= last.bytes;
        }
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

/// The lock; a panic elsewhere left nothing half-done behind it.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
