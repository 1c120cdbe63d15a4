//! The clock of this machine.

use std::thread;
use std::time::{Duration, Instant};
#[cfg(feature = "fetch")]
use std::time::{SystemTime, UNIX_EPOCH};

use build::Clock;
use cpu_time::ProcessTime;

/// Time since it was started.
#[derive(Clone, Copy, Debug)]
pub struct SystemClock {
    wall: Instant,
    cpu: ProcessTime,
}

impl SystemClock {
    /// Starts now.
    pub fn start() -> Self {
        Self { wall: Instant::now(), cpu: ProcessTime::now() }
    }

    /// Seconds since the start.
    pub fn seconds(&self) -> f64 {
        self.wall().as_secs_f64()
    }
}

/// Seconds since the beginning of 1970.
#[cfg(feature = "fetch")]
pub fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

/// The day it is, in UTC, as `2026-11-25`.
#[cfg(feature = "fetch")]
pub fn today() -> String {
    day_text(now() / 86_400)
}

/// A day since the beginning of 1970. Years begin in March here, so that leap days end them.
#[cfg(feature = "fetch")]
pub fn day_text(days: u64) -> String {
    let shifted = days + 719_468;
    let (era, day) = (shifted / 146_097, shifted % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let (day, month, carried) = (day - (153 * month + 2) / 5 + 1, (month + 2) % 12 + 1, month / 10);
    format!("{:04}-{month:02}-{day:02}", era * 400 + year + carried)
}

impl Clock for SystemClock {
    fn wall(&self) -> Duration {
        self.wall.elapsed()
    }

    fn cpu(&self) -> Duration {
        self.cpu.elapsed()
    }

    fn wait(&self, time: Duration) {
        thread::sleep(time);
    }
}

#[cfg(all(test, feature = "fetch"))]
mod tests {
    use super::day_text;

    #[test]
    fn days_are_those_of_the_calendar() {
        for (days, text) in [(0, "1970-01-01"), (59, "1970-03-01"), (11_016, "2000-02-29"), (20_782, "2026-11-25")] {
            assert_eq!(day_text(days), text);
        }
    }
}
