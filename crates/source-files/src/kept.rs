//! What was decoded, kept while there is room: what was asked for last stays longest.

use std::hash::Hash;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lru::LruCache;

/// Decoded parts of files, by key.
pub(crate) struct Kept<K, V> {
    parts: Mutex<Parts<K, V>>,
    bytes_max: u64,
}

struct Parts<K, V> {
    entries: LruCache<K, Entry<V>>,
    bytes: u64,
    decoded: u64,
}

/// What is decoded, or the place where a thread decodes it: others who need it wait there.
type Slot<V> = Arc<Mutex<Option<Arc<V>>>>;

struct Entry<V> {
    slot: Slot<V>,
    bytes: u64,
}

impl<K: Hash + Eq + Copy, V> Kept<K, V> {
    /// With room for `bytes_max` bytes, and one part in any case.
    pub fn new(bytes_max: u64) -> Self {
        Self { parts: Mutex::new(Parts { entries: LruCache::unbounded(), bytes: 0, decoded: 0 }), bytes_max }
    }

    /// How many bytes there is room for.
    pub fn bytes_max(&self) -> u64 {
        self.bytes_max
    }

    /// How often a part was decoded.
    pub fn decoded(&self) -> u64 {
        locked(&self.parts).decoded
    }

    /// The part at a key; `decode` gives it, and its bytes, where it is not kept.
    pub fn get<E>(&self, key: K, decode: impl FnOnce() -> Result<(V, u64), E>) -> Result<Arc<V>, E> {
        let empty = || Entry { slot: Slot::default(), bytes: 0 };
        let slot = locked(&self.parts).entries.get_or_insert_mut(key, empty).slot.clone();
        let mut held = locked(&slot);
        if let Some(found) = &*held {
            return Ok(found.clone());
        }
        let (decoded, bytes) = decode()?;
        let decoded = Arc::new(decoded);
        *held = Some(decoded.clone());
        self.book(key, &slot, bytes);
        Ok(decoded)
    }

    /// Counts what was decoded, and lets go of what was asked for longest ago until there is room for it.
    fn book(&self, key: K, slot: &Slot<V>, bytes: u64) {
        let mut parts = locked(&self.parts);
        parts.decoded += 1;
        // Its users may have let go of it while it was decoded.
        if let Some(entry) = parts.entries.peek_mut(&key).filter(|entry| Arc::ptr_eq(&entry.slot, slot)) {
            entry.bytes = bytes;
            parts.bytes += bytes;
        }
        while self.bytes_max < parts.bytes && 1 < parts.entries.len() {
            let (_, last) = parts.entries.pop_lru().expect("there are at least two");
            parts.bytes -= last.bytes;
        }
    }
}

/// The lock; a panic elsewhere left nothing half-done behind it.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
