//! Waits for work in Rust: without holding Python's lock, telling progress, and looking for Ctrl-C.
//!
//! The work runs in a thread of its own, because only the thread that waits sees a signal. A run looks at its flag
//! between tiles, and a tile may take minutes: so it gets a moment to end by itself, then it is left alone. After that
//! it does what any run does that was asked to stop: it ends its tile and ends. What keeps a folder from others until
//! then is waited for before other such work begins.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle, sleep};
use std::time::Duration;

use build::{Event, Progress};
use pyo3::prelude::*;
use tiefort::library::Failure;

use crate::raised::{named, raised};

/// How often signals are looked for.
const LOOK: Duration = Duration::from_millis(20);
/// What a run has to end by itself.
const GRACE: Duration = Duration::from_millis(400);

/// Work that was left alone and keeps a folder from others until it has ended.
static LEFT_ALONE: Mutex<Vec<JoinHandle<()>>> = Mutex::new(Vec::new());

/// What the work tells.
enum News<T> {
    Event(Event),
    Ended(Result<T, Failure>),
}

/// Sends progress to the thread that waits.
struct Told<T>(Sender<News<T>>);

impl<T: Send> Progress for Told<T> {
    fn tell(&mut self, event: Event) {
        // A run that was left alone has no listener.
        let _ = self.0.send(News::Event(event));
    }
}

/// What becomes of work when the callback raises. After a signal it is left alone in any case.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Raising {
    /// It is left alone after a moment: nothing depends on its end.
    LeavesIt,
    /// It is waited for: until its end it keeps a folder from others. After a signal the next such work waits for it.
    AwaitsIt,
}

/// Runs `work` and returns what it returns; `told` is called with each event as (what, stage, tile, total, note).
///
/// # Errors
/// The failure of `work` as an exception, what `told` raises, and what a signal raises.
pub fn wait<T: Send + 'static>(
    py: Python<'_>,
    told: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&AtomicBool, &mut dyn Progress) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    wait_for(py, told, Raising::LeavesIt, work)
}

/// The same, where the end of the work may have to be waited for.
///
/// # Errors
/// As [`wait`].
pub fn wait_for<T: Send + 'static>(
    py: Python<'_>,
    told: Option<&Bound<'_, PyAny>>,
    raising: Raising,
    work: impl FnOnce(&AtomicBool, &mut dyn Progress) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    if raising == Raising::AwaitsIt {
        await_left_alone(py)?;
    }
    let stop = Arc::new(AtomicBool::new(false));
    let (sender, mut receiver) = channel();
    let flag = Arc::clone(&stop);
    let run = move || {
        let mut progress = Told(sender.clone());
        let ended = catch_unwind(AssertUnwindSafe(|| work(&flag, &mut progress)));
        let _ = sender.send(News::Ended(ended.unwrap_or_else(|_| Err(Failure::bug()))));
    };
    let thread = Builder::new().name("tiefort".into()).spawn(run).map_err(|error| {
        let hint = "end other programs, or raise the limit of threads";
        named(py, "RequestError", &format!("found no thread to work in: {error}, expected one"), hint)
    })?;
    // What the callback raised, while the end is waited for.
    let mut raised_before = None;
    loop {
        let news;
        (receiver, news) = py.detach(move || {
            let news = receiver.recv_timeout(LOOK);
            (receiver, news)
        });
        let heard = match news {
            Ok(News::Ended(ended)) => {
                return raised_before.map_or_else(|| ended.map_err(|failure| raised(py, &failure)), Err);
            }
            Ok(News::Event(event)) if raised_before.is_none() => told.map_or(Ok(()), |told| tell(told, event)),
            Ok(News::Event(_)) | Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => return Err(raised(py, &Failure::bug())),
        };
        let signal = py.check_signals();
        if let (Err(error), true, Ok(())) = (&heard, raising == Raising::AwaitsIt, &signal) {
            stop.store(true, Ordering::Relaxed);
            raised_before = Some(error.clone_ref(py));
        } else if let Err(error) = signal.and(heard) {
            stop.store(true, Ordering::Relaxed);
            py.detach(move || end(&receiver));
            if raising == Raising::AwaitsIt {
                LEFT_ALONE.lock().unwrap_or_else(PoisonError::into_inner).push(thread);
            }
            return Err(error);
        }
    }
}

/// Waits for what was left alone.
///
/// # Errors
/// What a signal raises.
fn await_left_alone(py: Python<'_>) -> PyResult<()> {
    let runs = || {
        let mut left = LEFT_ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        left.retain(|thread| !thread.is_finished());
        !left.is_empty()
    };
    while runs() {
        py.detach(|| sleep(LOOK));
        py.check_signals()?;
    }
    Ok(())
}

/// Waits a moment for work that was asked to stop.
fn end<T>(receiver: &Receiver<News<T>>) {
    while let Ok(News::Event(_)) = receiver.recv_timeout(GRACE) {}
}

fn tell(told: &Bound<'_, PyAny>, event: Event) -> PyResult<()> {
    type Told = (&'static str, Option<&'static str>, Option<(u32, u32)>, Option<usize>, Option<String>);
    let arguments: Told = match event {
        Event::Enter(stage, total) => ("enter", Some(stage.name()), None, Some(total), None),
        Event::Started(stage, tile) => ("started", Some(stage.name()), Some((tile.row, tile.col)), None, None),
        Event::Because(stage, tile, why) => {
            ("because", Some(stage.name()), Some((tile.row, tile.col)), None, Some(why))
        }
        Event::Done(stage, tile) => ("done", Some(stage.name()), Some((tile.row, tile.col)), None, None),
        Event::Kept(stage, tile) => ("kept", Some(stage.name()), Some((tile.row, tile.col)), None, None),
        Event::Leave(stage) => ("leave", Some(stage.name()), None, None, None),
        Event::Note(note) => ("note", None, None, None, Some(note)),
    };
    told.call1(arguments).map(drop)
}
