//! What time it is: only the program itself has a real clock.

use std::time::Duration;

/// A clock. Everything that tells or compares times is given one.
pub trait Clock: Sync {
    /// Time since any beginning; never less than before.
    fn now(&self) -> Duration;

    /// Processor time that this process has taken, where that is known.
    fn processor(&self) -> Option<Duration> {
        None
    }

    /// Returns after so much time.
    fn wait(&self, time: Duration);
}
