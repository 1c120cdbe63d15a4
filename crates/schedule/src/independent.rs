//! Items that know nothing of one another, on a pool that is kept between calls.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};

use crate::attempt::{Attempt, Outcome, attempt};
use crate::{ScheduleError, Workers};

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
