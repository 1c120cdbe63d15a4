//! The clock of this machine.

use std::thread;
use std::time::{Duration, Instant};

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
