//! How far an export, or another command that counts, is: a bar on a terminal, at most a line a second elsewhere.

use std::sync::Mutex;
use std::time::Instant;

use exports::Step;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use views::grouped;

use crate::terminal;

/// Seconds between lines.
const PAUSE_S: f64 = 1.0;
/// Times a second that a terminal is redrawn.
const REDRAWS_HZ: u8 = 10;

/// Shows steps; may be told of them from any thread.
pub struct Steps {
    start: Instant,
    display: Display,
}

enum Display {
    Nothing,
    Bar(ProgressBar),
    /// Seconds at which the last line was told.
    Lines(Mutex<f64>),
}

impl Steps {
    /// Starts the clock; nothing is shown if `quiet`.
    pub fn start(quiet: bool) -> Self {
        let display = match (quiet, terminal::is_watched()) {
            (true, _) => Display::Nothing,
            (false, true) => Display::Bar(bar()),
            (false, false) => Display::Lines(Mutex::new(0.0)),
        };
        Self { start: Instant::now(), display }
    }

    /// Shows one step.
    pub fn tell(&self, Step { what, done, total }: Step) {
        match &self.display {
            Display::Nothing => {}
            Display::Bar(bar) => {
                bar.set_length(total as u64);
                bar.set_position(done as u64);
                bar.set_message(what);
            }
            Display::Lines(last) => {
                let at_s = self.seconds();
                // A thread that panicked holding it was telling something else.
                let mut last = last.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                if PAUSE_S <= at_s - *last {
                    *last = at_s;
                    let (done, total) = (grouped(done as u64), grouped(total as u64));
                    terminal::tell(&format!("{done} of {total} {what}{at_s:>9.1} s"));
                }
            }
        }
    }

    /// Takes the bar away; seconds since the start.
    pub fn finish(&self) -> f64 {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
        self.seconds()
    }

    fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}

fn bar() -> ProgressBar {
    let color = if terminal::wants_color() { ".green" } else { "" };
    let template = format!("[{{bar:36{color}}}] {{pos}} of {{len}} {{msg}}  {{elapsed}}");
    let style = ProgressStyle::with_template(&template).expect("the template is a constant and well-formed");
    let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr_with_hz(REDRAWS_HZ));
    bar.with_style(style.progress_chars("##."))
}
