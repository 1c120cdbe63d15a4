//! How many workers there are, and the pool they form for independent items.

use std::sync::OnceLock;

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

/// A number of workers. One worker is the calling thread itself; nothing is spawned for it.
#[derive(Debug)]
pub struct Workers {
    count: usize,
    /// Made on first use and kept, so that a build spawns its pool once.
    pool: OnceLock<rayon::ThreadPool>,
}

impl Workers {
    /// `count` workers.
    ///
    /// # Panics
    /// When `count` is zero: no thread would do the work.
    pub fn new(count: usize) -> Self {
        assert!(0 < count, "work needs at least one worker");
        Self { count, pool: OnceLock::new() }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Runs `piece(0)` to `piece(count - 1)`, in any order, on the workers; returns when all have ended.
    ///
    /// For small pieces within a task: a panic goes on to the caller, and nothing stops the rest. Without threads to be
    /// had the pieces run on the calling one.
    pub fn each(&self) -> impl Fn(usize, &(dyn Fn(usize) + Sync)) + Sync + '_ {
        move |count, piece| {
            let is_shared = 1 < self.count && 1 < count;
            match is_shared.then(|| self.pool()) {
                Some(Ok(pool)) => pool.install(|| (0..count).into_par_iter().with_max_len(1).for_each(piece)),
                _ => (0..count).for_each(piece),
            }
        }
    }

    /// The pool for independent items, or why the system gave no threads for it.
    pub(crate) fn pool(&self) -> Result<&rayon::ThreadPool, String> {
        if let Some(pool) = self.pool.get() {
            return Ok(pool);
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.count).build().map_err(|e| e.to_string())?;
        Ok(self.pool.get_or_init(|| pool))
    }
}
