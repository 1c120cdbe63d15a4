//! SIGINT and SIGTERM: the first asks the run to stop in an orderly way, the second ends it at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::failure::Failure;

/// Added to a signal's number, gives the exit code shells expect.
const EXIT_BASE: i32 = 128;

/// Watches for signals from [`Signals::watch`] until the process ends.
#[derive(Debug)]
pub struct Signals {
    stop: Arc<AtomicBool>,
    received: Arc<AtomicUsize>,
}

impl Signals {
    /// Begins to watch.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn watch() -> Result<Self, Failure> {
        let signals = Self { stop: Arc::default(), received: Arc::default() };
        for signal in [SIGINT, SIGTERM] {
            signals.register(signal).map_err(|error| {
                Failure::new(format!("the system refuses to watch signal {signal}: {error}"), "try again")
            })?;
        }
        Ok(signals)
    }

    fn register(&self, signal: i32) -> std::io::Result<()> {
        // In this order: the flag is still down when the first signal comes, so only a second one ends the process.
        flag::register_conditional_shutdown(signal, EXIT_BASE + signal, Arc::clone(&self.stop))?;
        flag::register_usize(signal, Arc::clone(&self.received), signal as usize)?;
        flag::register(signal, Arc::clone(&self.stop))?;
        Ok(())
    }

    /// The flag a run looks at.
    pub fn stop(&self) -> &AtomicBool {
        &self.stop
    }

    /// Exit code of the signal that came, if one did.
    pub fn exit_code(&self) -> Option<u8> {
        let signal = self.received.load(Ordering::SeqCst) as i32;
        (signal != 0).then_some((EXIT_BASE + signal) as u8)
    }
}
