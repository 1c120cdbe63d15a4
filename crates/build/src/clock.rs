//! Where the time of a run went: by stage and by tile.

use std::collections::BTreeMap;
use std::time::Duration;

use store::engine::Clock;
use store::{ReportStage, ReportTile};
use terrain::TileId;

use crate::{Event, Progress, Stage};

/// Name of the row for time that no stage accounts for.
const BETWEEN: &str = "between";
/// Seconds below which that row says nothing.
const BETWEEN_S_MIN: f64 = 0.01;

/// Passes on what a run tells, and takes the time of its stages and tiles from a clock.
pub struct Stopwatch<'a> {
    clock: &'a dyn Clock,
    listener: &'a mut dyn Progress,
    /// Up to when time is accounted for: on the clock, and of processors.
    until: [Duration; 2],
    /// In the order in which they first began.
    stages: Vec<ReportStage>,
    between: ReportStage,
    /// Stages that have not ended, the innermost last, and what they had taken before this time.
    open: Vec<(Stage, ReportStage)>,
    /// When each tile at work began.
    begun: BTreeMap<(Stage, TileId), Duration>,
    /// Seconds of each tile, by stage.
    tiles: BTreeMap<[u32; 2], BTreeMap<String, f64>>,
}

impl<'a> Stopwatch<'a> {
    /// Starts now.
    pub fn start(clock: &'a dyn Clock, listener: &'a mut dyn Progress) -> Self {
        Self {
            until: [clock.wall(), clock.cpu()],
            clock,
            listener,
            stages: Vec::new(),
            between: nothing(BETWEEN),
            open: Vec::new(),
            begun: BTreeMap::new(),
            tiles: BTreeMap::new(),
        }
    }

    /// What every stage and tile has taken up to now. A stage that is entered more than once has one row, and what one
    /// inside another takes is not counted to the outer one; the last row is what no stage accounts for, if it is worth
    /// one.
    pub fn times(&mut self) -> (Vec<ReportStage>, Vec<ReportTile>) {
        self.account();
        let between = Some(&self.between).filter(|between| BETWEEN_S_MIN <= between.wall_s);
        let tile = |(&tile, seconds): (_, &BTreeMap<_, _>)| ReportTile { tile, seconds: seconds.clone() };
        (self.stages.iter().chain(between).cloned().collect(), self.tiles.iter().map(tile).collect())
    }

    /// Counts the time that has passed for the innermost open stage.
    fn account(&mut self) {
        let now = [self.clock.wall(), self.clock.cpu()];
        let [wall, cpu] = [0, 1].map(|which| now[which].saturating_sub(self.until[which]).as_secs_f64());
        self.until = now;
        let row = match self.open.last() {
            Some(&(stage, _)) => self.row(stage),
            None => &mut self.between,
        };
        row.wall_s += wall;
        row.cpu_s += cpu;
    }

    fn row(&mut self, stage: Stage) -> &mut ReportStage {
        let known = self.stages.iter().position(|row| row.name == stage.name());
        let at = known.unwrap_or(self.stages.len());
        if known.is_none() {
            self.stages.push(nothing(stage.name()));
        }
        &mut self.stages[at]
    }

    /// What the stage that ends has taken this time; `None` if it never began.
    fn leave(&mut self, stage: Stage) -> Option<ReportStage> {
        let at = self.open.iter().rposition(|(open, _)| *open == stage)?;
        let (_, before) = self.open.remove(at);
        let mut passed = self.row(stage).clone();
        passed.wall_s -= before.wall_s;
        passed.cpu_s -= before.cpu_s;
        Some(passed)
    }
}

impl Progress for Stopwatch<'_> {
    fn tell(&mut self, event: Event) {
        match event {
            Event::Enter(stage, _) => {
                self.account();
                let before = self.row(stage).clone();
                self.open.push((stage, before));
            }
            Event::Leave(stage) => {
                self.account();
                self.leave(stage).into_iter().for_each(|time| self.listener.took(time));
            }
            Event::Started(stage, tile) => {
                self.begun.insert((stage, tile), self.clock.wall());
            }
            Event::Kept(stage, tile) => {
                self.begun.remove(&(stage, tile));
            }
            Event::Done(stage, tile) => {
                if let Some(begun) = self.begun.remove(&(stage, tile)) {
                    let stages = self.tiles.entry([tile.row, tile.col]).or_default();
                    let passed = self.clock.wall().saturating_sub(begun);
                    *stages.entry(stage.name().to_owned()).or_default() += passed.as_secs_f64();
                }
            }
            Event::Because(..) | Event::Note(_) => {}
        }
        self.listener.tell(event);
    }
}

fn nothing(name: &str) -> ReportStage {
    ReportStage { name: name.to_owned(), wall_s: 0.0, cpu_s: 0.0 }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    /// Remembers what stages took.
    #[derive(Default)]
    struct Heard(Vec<ReportStage>);

    impl Progress for Heard {
        fn tell(&mut self, _event: Event) {}

        fn took(&mut self, time: ReportStage) {
            self.0.push(time);
        }
    }

    /// A clock that is set by hand, in seconds.
    struct Hand<'a>(&'a AtomicU64);

    impl Clock for Hand<'_> {
        fn wall(&self) -> Duration {
            Duration::from_secs(self.0.load(Ordering::Relaxed))
        }

        fn wait(&self, time: Duration) {
            self.0.fetch_add(time.as_secs(), Ordering::Relaxed);
        }
    }

    fn rows(stages: &[ReportStage]) -> Vec<(&str, f64)> {
        stages.iter().map(|stage| (&*stage.name, stage.wall_s)).collect()
    }

    /// Tells events a second apart.
    fn told(events: &[Event]) -> (Vec<ReportStage>, Vec<ReportTile>, Vec<ReportStage>) {
        let (now, mut heard) = (AtomicU64::new(7), Heard::default());
        let clock = Hand(&now);
        let mut stopwatch = Stopwatch::start(&clock, &mut heard);
        for event in events {
            now.fetch_add(1, Ordering::Relaxed);
            stopwatch.tell(event.clone());
        }
        let (stages, tiles) = stopwatch.times();
        (stages, tiles, heard.0)
    }

    #[test]
    fn a_stage_that_is_entered_twice_is_one_row_and_each_time_is_told() {
        use Stage::{Assemble, Enforce, Read};
        let visits = [Read, Assemble, Enforce, Assemble];
        let events = visits.map(|stage| [Event::Enter(stage, 4), Event::Leave(stage)]).concat();
        let (stages, _, heard) = told(&events);
        assert_eq!(rows(&stages), [("read", 1.0), ("assemble", 2.0), ("enforce", 1.0), (BETWEEN, 4.0)]);
        assert_eq!(rows(&heard), [("read", 1.0), ("assemble", 1.0), ("enforce", 1.0), ("assemble", 1.0)]);
    }

    #[test]
    fn a_stage_inside_another_is_not_counted_to_it_and_an_open_one_counts_up_to_now() {
        let (publish, page) = (Stage::Publish, Stage::Page);
        let events = [Event::Enter(publish, 0), Event::Enter(page, 0), Event::Leave(page), Event::Note(String::new())];
        let (stages, _, heard) = told(&events);
        assert_eq!(rows(&stages), [("publish", 2.0), ("page", 1.0), (BETWEEN, 1.0)]);
        assert_eq!(rows(&heard), [("page", 1.0)]);
    }

    #[test]
    fn a_stage_that_never_began_has_no_end() {
        let (stages, _, heard) = told(&[Event::Leave(Stage::Refine)]);
        assert_eq!((rows(&stages), heard.len()), (vec![(BETWEEN, 1.0)], 0));
    }

    #[test]
    fn a_tile_has_the_seconds_of_the_stages_that_worked_on_it() {
        let [one, other] = [0, 1].map(|row| TileId { row, col: 3 });
        let events = [
            Event::Started(Stage::Refine, one),
            Event::Started(Stage::Refine, other),
            Event::Kept(Stage::Refine, other),
            Event::Done(Stage::Refine, one),
        ];
        let (_, tiles, _) = told(&events);
        let seconds = BTreeMap::from([("refine".to_owned(), 3.0)]);
        assert_eq!(tiles, [ReportTile { tile: [0, 3], seconds }]);
    }
}
