//! SIGINT and SIGTERM: the first asks the run to stop in an orderly way and ends it within a second, the second ends
//! it at once.
//!
//! A run looks at the flag between tiles, and a tile may take minutes. So a thread gives it a moment to stop by itself,
//! then holds writing back, so that nothing is left half-written, says how to go on, and ends the process. What a
//! tile has not published is done again by the next run.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Once};
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use store::engine::Writing;

use crate::failure::Failure;
use crate::left_over::{self, Making};
use crate::terminal;

/// Added to a signal's number, gives the exit code shells expect.
const EXIT_BASE: i32 = 128;
/// How often the flag is looked at.
const LOOK: Duration = Duration::from_millis(20);
/// What a run has to stop by itself.
const GRACE: Duration = Duration::from_millis(400);
/// The time that a thread has to finish writing a file.
const WRITING: Duration = Duration::from_millis(300);

/// Whether this process is the program, and not one that uses it as a library and has signals of its own.
static IS_PROGRAM: AtomicBool = AtomicBool::new(false);
/// Whether some command watches for signals by itself.
static IS_WATCHED: AtomicBool = AtomicBool::new(false);

/// To be called where the program begins. A file larger than files may be (`ulimit -f`) becomes a write that fails, as
/// on a full disk, and what was half-written is removed; the system would end the process there.
pub fn begin() {
    IS_PROGRAM.store(true, Ordering::SeqCst);
    #[cfg(unix)]
    let _ = flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// Notes what is being made at `path`, under a name that is not its final one: no signal leaves it behind.
pub fn making(path: &Path) -> Making {
    end_where_nothing_else_does();
    Making::begin(path)
}

/// Ends the program as the first signal would, once what it is making is removed, where no command watches by itself.
fn end_where_nothing_else_does() {
    static ONCE: Once = Once::new();
    if !IS_PROGRAM.load(Ordering::SeqCst) {
        return;
    }
    ONCE.call_once(|| {
        if IS_WATCHED.load(Ordering::SeqCst) {
            return;
        }
        let Ok(signals) = Signals::watch() else { return };
        thread::spawn(move || {
            while !signals.stop.load(Ordering::Relaxed) {
                thread::sleep(LOOK);
            }
            let _nothing_begins = left_over::remove_all_made();
            std::process::exit(i32::from(signals.exit_code().unwrap_or(1)));
        });
    });
}

/// Watches for signals from [`Signals::watch`] until the process ends.
#[derive(Clone, Debug)]
pub struct Signals {
    stop: Arc<AtomicBool>,
    received: Arc<AtomicUsize>,
    /// Whether the end of the process has been told.
    told: Arc<AtomicBool>,
}

impl Signals {
    /// Begins to watch.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn watch() -> Result<Self, Failure> {
        IS_WATCHED.store(true, Ordering::SeqCst);
        let signals = Self { stop: Arc::default(), received: Arc::default(), told: Arc::default() };
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

    /// Ends the process soon after a signal, if it has not ended by itself: `last` is done first and says what to tell.
    pub fn end_in_time(&self, last: impl FnOnce() -> Failure + Send + 'static) {
        let signals = self.clone();
        thread::spawn(move || {
            while !signals.stop.load(Ordering::Relaxed) {
                thread::sleep(LOOK);
            }
            thread::sleep(GRACE);
            let failure = last();
            // Held until the process is gone.
            let _held_back = held_back_within(WRITING);
            signals.tell_once(|| {
                failure.tell();
            });
            let _nothing_begins = left_over::remove_all_made();
            std::process::exit(i32::from(signals.exit_code().unwrap_or(1)));
        });
    }

    /// Tells how the process ends, unless it is being told already: then the process ends under this call.
    pub fn tell_once(&self, tell: impl FnOnce()) {
        if self.told.swap(true, Ordering::SeqCst) {
            loop {
                thread::park();
            }
        }
        tell();
    }
}

/// Keeps other threads from beginning to write; without effect where one writes for longer than `patience`.
fn held_back_within(patience: Duration) -> Option<Writing> {
    let start = Instant::now();
    loop {
        match Writing::held_back() {
            None if start.elapsed() < patience => thread::sleep(Duration::from_millis(5)),
            held => return held,
        }
    }
}

/// Says that the process is being ended where it is, and what to do then.
pub fn stopped(place: &str, hint: &str) -> Failure {
    terminal::clear_line();
    Failure::new(place, hint)
}
