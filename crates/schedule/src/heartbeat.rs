//! Something small done again and again beside a long task.

use std::thread;
use std::time::Duration;

use crossbeam::channel::{self, RecvTimeoutError};

/// Does `work` on the calling thread, and calls `beat` every so often until it ends, however it ends.
pub fn with_heartbeat<R>(every: Duration, mut beat: impl FnMut() + Send, work: impl FnOnce() -> R) -> R {
    thread::scope(|scope| {
        // Dropped when the work ends or panics, which ends the other thread.
        let (_alive, ended) = channel::bounded::<()>(0);
        scope.spawn(move || {
            while ended.recv_timeout(every) == Err(RecvTimeoutError::Timeout) {
                beat();
            }
        });
        work()
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn it_beats_while_the_work_lasts_and_not_after() {
        let beats = AtomicUsize::new(0);
        let count = || {
            beats.fetch_add(1, Ordering::SeqCst);
        };
        let result = with_heartbeat(Duration::from_millis(1), count, || {
            while beats.load(Ordering::SeqCst) < 3 {
                thread::yield_now();
            }
            7
        });
        let after = beats.load(Ordering::SeqCst);
        assert_eq!(result, 7);
        assert_eq!(beats.load(Ordering::SeqCst), after);
    }

    #[test]
    fn a_panic_in_the_work_ends_it_too() {
        let ended = std::panic::catch_unwind(|| with_heartbeat(Duration::from_secs(9), || {}, || panic!("over")));
        assert!(ended.is_err());
    }
}
