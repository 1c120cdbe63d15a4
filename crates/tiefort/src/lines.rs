//! Progress as plain lines, for logs: one per stage, and at most about one a second in between.

use build::Event;
use store::ReportStage;

use crate::estimate::Estimate;
use crate::terminal;

/// Seconds between lines within a stage.
const PAUSE_S: f64 = 1.0;

/// Counts tiles and decides when a line is due.
#[derive(Debug)]
pub struct Lines {
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
pub fn end_line(time: &ReportStage, tiles: &str, workers: usize) -> String {
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
