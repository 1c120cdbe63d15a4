//! Turns what a run tells into something to look at, on a thread of its own, so that the run never waits for a
//! terminal.
//!
//! Plain lines, for logs, are one per stage, and at most about one a second in between.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use build::{Event, Progress, Stage};
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use store::ReportStage;
use views::fold;

use crate::board::{Board, LEGEND};
use crate::clock::SystemClock;
use crate::estimate::Estimate;
use crate::{events, terminal};

/// Largest board that is drawn, in rows and columns of tiles: it has to fit an ordinary terminal.
const BOARD_MAX: (u32, u32) = (18, 38);
/// Times a second that a terminal is redrawn.
const REDRAWS_HZ: u8 = 10;

/// What a person or a program wants to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Show {
    /// Nothing.
    Nothing,
    /// Bars and the board on a terminal, plain lines elsewhere.
    Progress,
    /// JSON lines on stdout.
    Json,
    /// Every event in words on stderr.
    Verbose,
    /// Every event as JSON lines on stderr.
    JsonLog,
}

/// Where a run is, for ending it in a hurry.
#[derive(Debug, Default)]
pub struct Place {
    stage: Option<Stage>,
    done: usize,
    total: usize,
}

impl Place {
    fn hear(&mut self, event: &Event) {
        match event {
            Event::Enter(stage, tiles) => (self.stage, self.done, self.total) = (Some(*stage), 0, *tiles),
            Event::Done(..) | Event::Kept(..) => self.done += 1,
            _ => {}
        }
    }

    /// In words, as an error of the compiler would say it.
    pub fn words(&self) -> String {
        match (self.stage, self.total) {
            (None, _) => "stopped before the first stage".into(),
            (Some(stage), 0) => format!("stopped in stage {}", stage.name()),
            (Some(stage), total) => {
                format!("stopped in stage {} with {} of {total} tiles done", stage.name(), self.done)
            }
        }
    }
}

/// Listens to a run and passes everything on to the reporter thread.
#[derive(Debug)]
pub struct Listener {
    clock: SystemClock,
    place: Arc<Mutex<Place>>,
    /// What the stage that is about to end has taken.
    took: Option<ReportStage>,
    sender: Option<Sender<Heard>>,
    reporter: Option<JoinHandle<()>>,
}

/// An event with the time at which it happened.
struct Heard {
    event: Event,
    stage_time: Option<ReportStage>,
    at_s: f64,
}

impl Listener {
    /// Starts the reporter thread for a run of `workers` on `tiles` = (rows, columns).
    pub fn start(show: Show, tiles: (u32, u32), workers: usize, estimate: Estimate, clock: SystemClock) -> Self {
        let (sender, receiver) = channel();
        let display = match show {
            Show::Nothing => None,
            Show::Json => Some(Display::Json),
            Show::Verbose => Some(Display::Log(events::event_text)),
            Show::JsonLog => Some(Display::JsonLog),
            Show::Progress if terminal::is_watched() => {
                Some(Display::Bars(Box::new(Bars::new(tiles, Lines::new(workers, estimate)))))
            }
            Show::Progress => Some(Display::Lines(Box::new(Lines::new(workers, estimate)))),
        };
        let reporter = display.map(|display| std::thread::spawn(move || report(receiver, display)));
        Self { clock, place: Arc::default(), took: None, sender: reporter.is_some().then_some(sender), reporter }
    }

    /// Where the run is, as it goes on.
    pub fn place(&self) -> Arc<Mutex<Place>> {
        Arc::clone(&self.place)
    }

    /// Waits until everything is shown.
    pub fn finish(mut self) {
        self.sender = None;
        if let Some(reporter) = self.reporter.take() {
            // A reporter that panicked has said so; the work does not depend on it.
            let _ = reporter.join();
        }
    }
}

impl Progress for Listener {
    fn tell(&mut self, event: Event) {
        let stage_time = if matches!(event, Event::Leave(_)) { self.took.take() } else { None };
        self.place.lock().unwrap_or_else(PoisonError::into_inner).hear(&event);
        if let Some(sender) = &self.sender {
            let at_s = self.clock.seconds();
            // Fails only when the reporter is gone, which must not stop the work.
            let _ = sender.send(Heard { event, stage_time, at_s });
        }
    }

    fn took(&mut self, time: ReportStage) {
        self.took = Some(time);
    }
}

enum Display {
    Json,
    JsonLog,
    Log(fn(&Event, Option<&ReportStage>, f64) -> String),
    Lines(Box<Lines>),
    Bars(Box<Bars>),
}

fn report(receiver: Receiver<Heard>, mut display: Display) {
    for Heard { event, stage_time, at_s } in receiver {
        match &mut display {
            Display::Json => events::print_line(&events::event_json(&event, stage_time.as_ref(), at_s)),
            Display::JsonLog => terminal::tell_json(&events::event_json(&event, stage_time.as_ref(), at_s)),
            Display::Log(line) => terminal::tell(&line(&event, stage_time.as_ref(), at_s)),
            Display::Lines(lines) => {
                if let Some(line) = lines.hear(&event, stage_time.as_ref(), at_s) {
                    terminal::tell(&line);
                }
            }
            Display::Bars(bars) => bars.hear(&event, stage_time.as_ref(), at_s),
        }
    }
    if let Display::Bars(bars) = display {
        bars.clear();
    }
}

/// A terminal: lines of finished stages, below them the bar of the current one and the board.
struct Bars {
    all: MultiProgress,
    bar: ProgressBar,
    board: Board,
    board_rows: Vec<ProgressBar>,
    lines: Lines,
}

impl Bars {
    fn new((rows, columns): (u32, u32), lines: Lines) -> Self {
        let all = MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(REDRAWS_HZ));
        let bar = all.add(ProgressBar::no_length().with_style(style("{prefix:<9} {spinner} {elapsed}")));
        let mut bars = Self { all, bar, board: Board::new(rows, columns), board_rows: Vec::new(), lines };
        if 1 < rows * columns && rows <= BOARD_MAX.0 && columns <= BOARD_MAX.1 {
            bars.board_rows = (0..=rows).map(|_| bars.all.add(ProgressBar::no_length())).collect();
            bars.board_rows.iter().for_each(|row| row.set_style(style("  {msg}")));
            bars.draw_board();
        }
        bars.bar.enable_steady_tick(std::time::Duration::from_millis(250));
        bars
    }

    fn hear(&mut self, event: &Event, stage_time: Option<&ReportStage>, at_s: f64) {
        match event {
            Event::Enter(stage, tiles) => self.enter(stage.name(), *tiles),
            Event::Done(..) | Event::Kept(..) => self.bar.inc(1),
            _ => {}
        }
        self.board.hear(event);
        if !matches!(event, Event::Leave(_) | Event::Note(_) | Event::Because(..)) {
            self.draw_board();
        }
        let line = self.lines.hear(event, stage_time, at_s);
        self.bar.set_message(self.lines.left(at_s));
        if let (Some(line), Event::Leave(_) | Event::Note(_)) = (line, event) {
            // Fails when the terminal is gone; there is no one to tell then.
            let _ = self.all.println(fold(&line, 2));
        }
    }

    fn enter(&mut self, stage: &'static str, tiles: usize) {
        self.bar.set_prefix(stage);
        // The time that has passed is the whole build's, as what is left.
        self.bar.set_position(0);
        if tiles == 0 {
            self.bar.set_style(style("{prefix:<9} {spinner} {elapsed}{msg}"));
        } else {
            let color = if terminal::wants_color() { ".green" } else { "" };
            let template = format!("{{prefix:<9}} [{{bar:24{color}}}] {{pos}} of {{len}} tiles  {{elapsed}}{{msg}}");
            self.bar.set_style(style(&template).progress_chars("##."));
            self.bar.set_length(tiles as u64);
        }
    }

    fn draw_board(&self) {
        let Some((legend, rows)) = self.board_rows.split_last() else { return };
        for (row, line) in rows.iter().zip(self.board.lines()) {
            row.set_message(line);
        }
        legend.set_message(LEGEND);
    }

    fn clear(self) {
        self.bar.finish_and_clear();
        self.board_rows.iter().for_each(ProgressBar::finish_and_clear);
        // Fails when the terminal is gone.
        let _ = self.all.clear();
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).expect("templates are constants of this file and well-formed")
}

/// Seconds between lines within a stage.
const PAUSE_S: f64 = 1.0;

/// Counts tiles and decides when a line is due.
#[derive(Debug)]
struct Lines {
    workers: usize,
    tiles: usize,
    done: usize,
    kept: usize,
    last_s: f64,
    estimate: Estimate,
}

impl Lines {
    /// Nothing has happened yet.
    pub fn new(workers: usize, estimate: Estimate) -> Self {
        Self { workers, tiles: 0, done: 0, kept: 0, last_s: 0.0, estimate }
    }

    /// The line to print now, if one is due.
    pub fn hear(&mut self, event: &Event, stage_time: Option<&ReportStage>, at_s: f64) -> Option<String> {
        self.estimate.hear(event, at_s);
        match event {
            Event::Enter(_, tiles) => {
                (self.tiles, self.done, self.kept) = (*tiles, 0, 0);
                self.last_s = at_s;
                None
            }
            Event::Done(stage, _) => {
                self.done += 1;
                self.due(stage.name(), at_s)
            }
            Event::Kept(stage, _) => {
                self.kept += 1;
                self.due(stage.name(), at_s)
            }
            Event::Leave(stage) => {
                let (wall_s, cpu_s) = stage_time.map(|time| (time.wall_s, time.cpu_s)).unwrap_or_default();
                let time = ReportStage { name: stage.name().to_owned(), wall_s, cpu_s };
                Some(end_line(&time, &self.counted(), self.workers))
            }
            Event::Note(text) => Some(format!("note: {}", terminal::short(&terminal::plain(text)))),
            Event::Started(..) | Event::Because(..) => None,
        }
    }

    fn due(&mut self, stage: &str, at_s: f64) -> Option<String> {
        if at_s - self.last_s < PAUSE_S {
            return None;
        }
        self.last_s = at_s;
        let (finished, tiles) = (self.done + self.kept, self.tiles);
        Some(format!("{stage:<9}{finished:>5} of {tiles} tiles{at_s:>9.1} s{}", self.left(at_s)))
    }

    /// What the whole run still takes, as the end of a line; empty where it cannot be known.
    pub fn left(&self, at_s: f64) -> String {
        self.estimate.left_s(at_s).map(|left_s| format!(", about {} left", time_text(left_s))).unwrap_or_default()
    }

    fn counted(&self) -> String {
        match (self.tiles, self.kept) {
            (0, _) => String::new(),
            (tiles, 0) => format!("{tiles} tiles"),
            (tiles, kept) => format!("{tiles} tiles, {kept} kept"),
        }
    }
}

/// The line of a stage that has ended; `tiles` says how many it went by.
fn end_line(time: &ReportStage, tiles: &str, workers: usize) -> String {
    let ReportStage { name, wall_s, cpu_s } = time;
    let busy = 100.0 * cpu_s / (wall_s * workers as f64);
    let busy = if busy.is_finite() { format!("{busy:.0} % busy") } else { String::new() };
    format!("{name:<9} {tiles:<22}{wall_s:>8.2} s  {busy}").trim_end().to_owned()
}

/// A time as people say it, of which an estimate knows no more than two digits.
fn time_text(seconds: f64) -> String {
    match seconds {
        _ if seconds < 90.0 => format!("{seconds:.0} s"),
        _ if seconds < 90.0 * 60.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use build::Stage;
    use terrain::TileId;

    #[test]
    fn lines_within_a_stage_keep_a_second_apart() {
        let mut lines = Lines::new(2, Estimate::of_one_stage(Stage::Refine));
        assert_eq!(lines.hear(&Event::Enter(Stage::Refine, 36), None, 0.0), None);
        let done = Event::Done(Stage::Refine, TileId { row: 0, col: 0 });
        let told = (1..=36).filter_map(|step| lines.hear(&done, None, f64::from(step) / 10.0)).collect::<Vec<_>>();
        assert_eq!(told.len(), 3);
        assert_eq!(told[0], "refine      10 of 36 tiles      1.0 s, about 3 s left");
    }

    #[test]
    fn a_time_is_told_in_the_unit_people_would_use() {
        for (seconds, text) in [(0.4, "0 s"), (89.0, "89 s"), (91.0, "2 min"), (5000.0, "83 min"), (9000.0, "2.5 h")] {
            assert_eq!(time_text(seconds), text);
        }
    }

    #[test]
    fn a_stage_ends_with_its_seconds_and_how_busy_the_workers_were() {
        let mut lines = Lines::new(2, Estimate::of_one_stage(Stage::Refine));
        lines.hear(&Event::Enter(Stage::Survey, 2), None, 0.0);
        lines.hear(&Event::Kept(Stage::Survey, TileId { row: 0, col: 0 }), None, 0.0);
        let time = ReportStage { name: "survey".into(), wall_s: 2.0, cpu_s: 3.0 };
        let line = lines.hear(&Event::Leave(Stage::Survey), Some(&time), 2.0).unwrap();
        assert_eq!(line, "survey    2 tiles, 1 kept           2.00 s  75 % busy");
    }
}
