//! What time it is: only the program itself has a real clock.

use std::time::Duration;

/// What time it is.
pub trait Clock: Sync {
    /// Time since any beginning that stays the same.
    fn wall(&self) -> Duration;

    /// Processor time of all threads since any beginning; nothing where it is not known.
    fn cpu(&self) -> Duration {
        Duration::ZERO
    }

    /// Returns after so much time.
    fn wait(&self, time: Duration);
}
