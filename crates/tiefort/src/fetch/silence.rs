//! Whether servers that were asked still send something: a person is told while nothing comes.

use std::io::{self, Read};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::thread;
use std::time::{Duration, Instant};

/// Silence until a person is told first, and between further times.
const TOLD_AFTER: Duration = Duration::from_secs(5);
const TOLD_EACH: Duration = Duration::from_secs(10);
/// How often it is looked at.
const LOOK: Duration = Duration::from_millis(250);

/// What was heard of servers last.
#[derive(Debug, Default)]
pub struct Silence {
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    /// Requests that are at work.
    asking: usize,
    /// The host that was asked last.
    host: String,
    /// When a byte came last, or the first of these requests began.
    heard: Option<Instant>,
    /// When a person was told of the silence since then.
    told: Option<Instant>,
}

impl Silence {
    fn change<T>(&self, change: impl FnOnce(&mut State) -> T) -> T {
        change(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// A request of a host begins.
    pub fn begin(&self, host: &str) {
        self.change(|state| {
            if state.asking == 0 {
                (state.heard, state.told) = (Some(Instant::now()), None);
            }
            state.asking += 1;
            host.clone_into(&mut state.host);
        });
    }

    /// A request ends.
    pub fn end(&self) {
        self.change(|state| state.asking -= 1);
    }

    /// Something came.
    pub fn heard(&self) {
        self.change(|state| (state.heard, state.told) = (Some(Instant::now()), None));
    }

    /// What to tell a person now, if anything.
    fn words(&self, now: Instant) -> Option<String> {
        self.change(|state| {
            let since = now.saturating_duration_since(state.heard.filter(|_| 0 < state.asking)?);
            let is_due = match state.told {
                None => TOLD_AFTER <= since,
                Some(told) => TOLD_EACH <= now.saturating_duration_since(told),
            };
            is_due.then(|| {
                state.told = Some(now);
                format!("waits for {}: no byte has come for {} s", state.host, since.as_secs())
            })
        })
    }
}

/// Tells a person of silence, from a thread of its own, for as long as `silence` is held elsewhere.
pub fn watch(silence: &Arc<Silence>, tell: impl Fn(&str) + Send + 'static) {
    let silence: Weak<Silence> = Arc::downgrade(silence);
    thread::spawn(move || {
        while let Some(silence) = silence.upgrade() {
            if let Some(words) = silence.words(Instant::now()) {
                tell(&words);
            }
            drop(silence);
            thread::sleep(LOOK);
        }
    });
}

/// A body that breaks the silence.
pub struct Heard<'s, R> {
    pub body: R,
    pub silence: &'s Silence,
}

impl<R: Read> Read for Heard<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.body.read(buffer)?;
        if 0 < read {
            self.silence.heard();
        }
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_person_is_told_of_silence_while_a_request_is_at_work() {
        let (silence, start) = (Silence::default(), Instant::now());
        let at = |seconds: u64| silence.words(start + Duration::from_secs(seconds)).is_some();
        assert!(!at(100));
        silence.begin("a.org");
        let told: Vec<u64> = (0..40).filter(|&seconds| at(seconds)).collect();
        assert!(told.len() == 4 && (5..=6).contains(&told[0]) && told[1] == told[0] + 10, "{told:?}");
        assert!(silence.words(start + Duration::from_secs(60)).unwrap().starts_with("waits for a.org: no byte has"));
        silence.heard();
        assert!(!at(3));
        silence.end();
        assert!(!at(100));
    }
}
