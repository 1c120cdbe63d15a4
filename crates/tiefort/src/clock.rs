//! Where the time went: wall and CPU seconds of each stage, and of what no stage accounts for.

use std::time::Instant;

use compiler::{Event, Stage};
use cpu_time::ProcessTime;
use database::ReportStage;

/// Name of the row for time that no stage accounts for.
const BETWEEN: &str = "between";
/// Seconds below which that row says nothing.
const BETWEEN_S_MIN: f64 = 0.01;

/// Looks at the clock whenever a stage begins or ends.
#[derive(Debug)]
pub struct StageClock {
    start: Instant,
    open: Vec<(Stage, Moment)>,
    /// Since when no stage has been open.
    idle_since: Moment,
    stages: Vec<ReportStage>,
    between: ReportStage,
}

/// Wall and CPU time at one moment.
#[derive(Clone, Copy, Debug)]
struct Moment {
    wall: Instant,
    cpu: ProcessTime,
}

impl Moment {
    fn now() -> Self {
        Self { wall: Instant::now(), cpu: ProcessTime::now() }
    }

    /// What has passed since, as a row of this name.
    fn elapsed(self, name: &str) -> ReportStage {
        let (wall_s, cpu_s) = (self.wall.elapsed().as_secs_f64(), self.cpu.elapsed().as_secs_f64());
        ReportStage { name: name.to_owned(), wall_s, cpu_s }
    }
}

/// What `work` gives, and how long it took, as a row of this name.
pub fn timed<T>(name: &str, work: impl FnOnce() -> T) -> (T, ReportStage) {
    let begun = Moment::now();
    let made = work();
    (made, begun.elapsed(name))
}

impl StageClock {
    /// Starts now.
    pub fn start() -> Self {
        let between = ReportStage { name: BETWEEN.to_owned(), wall_s: 0.0, cpu_s: 0.0 };
        Self { start: Instant::now(), open: Vec::new(), idle_since: Moment::now(), stages: Vec::new(), between }
    }

    /// Seconds since the start.
    pub fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Takes note of a stage that begins or ends; for one that ends, gives its seconds this time. A stage that is
    /// entered more than once adds up.
    pub fn hear(&mut self, event: &Event) -> Option<ReportStage> {
        match event {
            Event::Enter(stage, _) => {
                self.end_idle();
                self.open.push((*stage, Moment::now()));
                None
            }
            Event::Leave(stage) => {
                let at = self.open.iter().rposition(|(open, _)| open == stage)?;
                let passed = self.open.remove(at).1.elapsed(stage.name());
                self.idle_since = Moment::now();
                self.add(&passed);
                Some(passed)
            }
            _ => None,
        }
    }

    fn add(&mut self, passed: &ReportStage) {
        match self.stages.iter_mut().find(|known| known.name == passed.name) {
            Some(known) => lengthen(known, passed),
            None => self.stages.push(passed.clone()),
        }
    }

    fn end_idle(&mut self) {
        if self.open.is_empty() {
            lengthen(&mut self.between, &self.idle_since.elapsed(BETWEEN));
        }
    }

    /// All stages, in the order in which they first ended; last what no stage accounts for, if it is worth a row.
    pub fn stages(mut self) -> Vec<ReportStage> {
        self.end_idle();
        if BETWEEN_S_MIN <= self.between.wall_s {
            self.stages.push(self.between);
        }
        self.stages
    }
}

fn lengthen(stage: &mut ReportStage, by: &ReportStage) {
    stage.wall_s += by.wall_s;
    stage.cpu_s += by.cpu_s;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_that_is_entered_twice_is_one_row() {
        let mut clock = StageClock::start();
        for stage in [Stage::Read, Stage::Assemble, Stage::Enforce, Stage::Assemble] {
            assert!(clock.hear(&Event::Enter(stage, 4)).is_none());
            assert!(clock.hear(&Event::Leave(stage)).is_some());
        }
        let stages = clock.stages();
        let names: Vec<&str> = stages.iter().map(|stage| &*stage.name).filter(|&name| name != BETWEEN).collect();
        assert_eq!(names, ["read", "assemble", "enforce"]);
        assert!(stages.iter().all(|stage| 0.0 <= stage.wall_s && 0.0 <= stage.cpu_s));
    }

    #[test]
    fn a_stage_that_never_began_has_no_end() {
        assert!(StageClock::start().hear(&Event::Leave(Stage::Refine)).is_none());
    }

    #[test]
    fn time_that_no_stage_accounts_for_is_a_row_and_time_inside_one_is_not() {
        let spin = || {
            let start = Instant::now();
            while start.elapsed().as_secs_f64() < 2.0 * BETWEEN_S_MIN {}
        };
        let mut clock = StageClock::start();
        clock.hear(&Event::Enter(Stage::Read, 0));
        spin();
        clock.hear(&Event::Leave(Stage::Read));
        spin();
        clock.hear(&Event::Enter(Stage::Publish, 0));
        clock.hear(&Event::Leave(Stage::Publish));
        let stages = clock.stages();
        let names: Vec<&str> = stages.iter().map(|stage| &*stage.name).collect();
        assert_eq!(names, ["read", "publish", BETWEEN]);
        assert!(2.0 * BETWEEN_S_MIN <= stages[0].wall_s && 2.0 * BETWEEN_S_MIN <= stages[2].wall_s);
    }
}
