//! How many workers there are; and items that know nothing of one another, on the pool they form, kept between calls.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};

use super::ScheduleError;
use super::attempt::{Attempt, Outcome, attempt};

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

/// Runs `task(index, item)` for every item, in any order. Results are in item order.
///
/// With one worker the items run in order on the calling thread.
///
/// # Errors
/// The failure or panic of lowest index among the items that ran, after which no item starts; `Stopped` when `stop`
/// was raised before every item had started. Running items always finish first.
pub fn for_each_independent<T: Sync, R: Send, E: Send>(
    items: &[T],
    workers: &Workers,
    stop: &AtomicBool,
    task: impl Fn(usize, &T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, ScheduleError<R, E>> {
    let failed = AtomicBool::new(false);
    let run = |(index, item): (usize, &T)| {
        let halted = stop.load(Ordering::Relaxed) || failed.load(Ordering::Relaxed);
        (!halted).then(|| {
            let ended = attempt(|| task(index, item));
            if !matches!(ended, Attempt::Done(_)) {
                failed.store(true, Ordering::Relaxed);
            }
            ended
        })
    };
    let attempts: Vec<Option<Attempt<R, E>>> = if workers.count() == 1 || items.len() <= 1 {
        items.iter().enumerate().map(run).collect()
    } else {
        let pool = workers.pool().map_err(|message| ScheduleError::NoThread { workers: workers.count(), message })?;
        // One item a piece: items are whole tiles, and their cost differs by tens.
        pool.install(|| items.par_iter().enumerate().with_max_len(1).map(run).collect())
    };
    let mut outcome = Outcome::new(items.len());
    for (index, ended) in attempts.into_iter().enumerate() {
        if let Some(ended) = ended {
            outcome.accept(index, index, ended);
        }
    }
    outcome.into_results()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    fn squares(workers: &Workers, stop: &AtomicBool) -> Result<Vec<u64>, ScheduleError<u64, String>> {
        let items: Vec<u64> = (0..1000).collect();
        for_each_independent(&items, workers, stop, |_, &item| Ok(item * item))
    }

    #[test]
    fn results_are_in_item_order_for_any_number_of_workers() {
        let expected: Vec<u64> = (0..1000).map(|item| item * item).collect();
        for count in [1, 2, 8] {
            let workers = Workers::new(count);
            for _ in 0..3 {
                assert_eq!(squares(&workers, &AtomicBool::new(false)), Ok(expected.clone()));
            }
        }
    }

    #[test]
    fn every_piece_runs_once_for_any_number_of_workers() {
        for count in [1, 2, 8] {
            let runs: Vec<AtomicUsize> = (0..100).map(|_| AtomicUsize::new(0)).collect();
            Workers::new(count).each()(runs.len(), &|number| {
                runs[number].fetch_add(1, Ordering::Relaxed);
            });
            assert!(runs.iter().all(|runs| runs.load(Ordering::Relaxed) == 1));
        }
    }

    #[test]
    fn a_panic_names_the_item_and_carries_its_message() {
        for count in [1, 2, 8] {
            let ended = for_each_independent(&[5, 6, 7], &Workers::new(count), &AtomicBool::new(false), |_, &item| {
                assert!(item != 6, "six is not welcome");
                Ok::<_, String>(item)
            });
            assert_eq!(ended, Err(ScheduleError::Panicked { task: 1, message: "six is not welcome".into() }));
        }
    }

    #[test]
    fn an_error_stops_the_run() {
        let ran = std::sync::atomic::AtomicUsize::new(0);
        let items = vec![0; 10_000];
        let ended = for_each_independent(&items, &Workers::new(1), &AtomicBool::new(false), |index, _| {
            ran.fetch_add(1, Ordering::Relaxed);
            if index == 3 { Err("three") } else { Ok(()) }
        });
        assert_eq!(ended, Err(ScheduleError::Failed { task: 3, error: "three" }));
        assert_eq!(ran.load(Ordering::Relaxed), 4);
    }

    #[test]
    fn a_raised_flag_starts_nothing() {
        for count in [1, 2] {
            let ended = squares(&Workers::new(count), &AtomicBool::new(true));
            assert_eq!(ended, Err(ScheduleError::Stopped { done: vec![], tasks: 1000 }));
        }
    }

    #[test]
    fn no_items_give_no_results() {
        let none: [u8; 0] = [];
        let ended = for_each_independent(&none, &Workers::new(2), &AtomicBool::new(true), |_, _| Ok::<(), ()>(()));
        assert_eq!(ended, Ok(vec![]));
    }
}
