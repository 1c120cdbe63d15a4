//! How long a run still takes: what its stages are forecast to take, set right by what they have taken so far.

use std::collections::BTreeMap;

use build::{Event, Plan, Stage};
use terrain::TileId;

/// Seconds of measuring that a forecast is worth: machines differ, and the first tiles may be the quick ones.
const TRUST_S: f64 = 1.0;
/// Tiles, about the last ones, that tell how many of the next are kept: a build that goes on keeps those at its
/// beginning.
const RECENT: usize = 8;

/// Listens to a run and says what is left of it.
#[derive(Debug)]
pub struct Estimate {
    /// Forecast seconds of each stage on one worker, those still to come and the current one.
    stages: Vec<(Stage, f64)>,
    /// Seconds that one of the forecast takes, before anything is measured; `None` where nothing is forecast.
    pace: Option<f64>,
    /// When the first of these stages began.
    begun_s: Option<f64>,
    /// Tiles of the current stage: all, worked on, kept.
    tiles: (usize, usize, usize),
    /// Share of tiles that the last stage by tiles worked on; what is kept takes no time, in later stages neither.
    share: f64,
    /// The same of the last tiles of the current stage.
    recent: f64,
    /// Of each tile at work, its part of the seconds that went by since it was begun: all that are at work share them.
    at_work: BTreeMap<TileId, f64>,
    /// When a tile was heard of last.
    heard_s: f64,
    /// Seconds that went by while tiles were kept: they tell nothing of those that are worked on.
    kept_s: f64,
    /// Forecast seconds of what was worked on.
    worked_s: f64,
}

impl Estimate {
    /// That of a build on so many workers.
    pub fn of_build(plan: &Plan, workers: usize) -> Self {
        let seconds = plan.forecast.stages;
        let stages = [
            (Stage::Survey, seconds.survey),
            (Stage::Refine, seconds.refine),
            (Stage::Assemble, seconds.assemble),
            (Stage::Publish, seconds.publish),
            (Stage::Page, seconds.page),
        ];
        let at_once = workers.min(plan.workers_useful).max(1);
        Self { pace: Some(1.0 / at_once as f64), ..Self::new(stages.to_vec()) }
    }

    /// That of a run of which nothing is forecast and one stage takes nearly all of the time.
    pub fn of_one_stage(stage: Stage) -> Self {
        Self::new(vec![(stage, 1.0)])
    }

    fn new(stages: Vec<(Stage, f64)>) -> Self {
        let (at_work, tiles) = (BTreeMap::new(), (0, 0, 0));
        let (share, recent, heard_s, kept_s, worked_s) = (1.0, 1.0, 0.0, 0.0, 0.0);
        Self { stages, pace: None, begun_s: None, tiles, share, recent, at_work, heard_s, kept_s, worked_s }
    }

    /// Takes note of what happened, so many seconds after the start.
    pub fn hear(&mut self, event: &Event, at_s: f64) {
        match event {
            Event::Enter(stage, tiles) => {
                self.tiles = (*tiles, 0, 0);
                if self.seconds(*stage).is_some() && self.begun_s.is_none() {
                    self.begun_s = Some(at_s);
                }
                // What was to come before it did not come.
                if let Some(at) = self.stages.iter().position(|(known, _)| known == stage) {
                    self.stages.drain(..at);
                }
            }
            Event::Started(_, tile) => {
                self.pass_time(at_s);
                self.at_work.insert(*tile, 0.0);
            }
            Event::Done(stage, tile) => {
                self.pass_time(at_s);
                self.at_work.remove(tile);
                self.tiles.1 += 1;
                self.pass_tile(1.0);
                self.worked_s += self.seconds(*stage).unwrap_or(0.0) / self.tiles.0.max(1) as f64;
            }
            Event::Kept(_, tile) => {
                self.pass_time(at_s);
                self.kept_s += self.at_work.remove(tile).unwrap_or(0.0);
                self.tiles.2 += 1;
                self.pass_tile(0.0);
            }
            Event::Leave(stage) => {
                let (all, done, _) = self.tiles;
                if 0 < all {
                    self.share = done as f64 / all as f64;
                } else {
                    self.worked_s += self.seconds(*stage).unwrap_or(0.0);
                }
                self.stages.retain(|(known, _)| known != stage);
                self.tiles = (0, 0, 0);
            }
            Event::Because(..) | Event::Note(_) => {}
        }
    }

    fn pass_time(&mut self, at_s: f64) {
        let part_s = (at_s - self.heard_s) / self.at_work.len().max(1) as f64;
        self.at_work.values_mut().for_each(|seconds| *seconds += part_s);
        self.heard_s = at_s;
    }

    fn pass_tile(&mut self, worked: f64) {
        let (_, done, kept) = self.tiles;
        self.recent += (worked - self.recent) / (done + kept).min(RECENT) as f64;
    }

    /// Seconds that are left; `None` where there is nothing to tell them from.
    pub fn left_s(&self, at_s: f64) -> Option<f64> {
        let passed_s = at_s - self.begun_s? - self.kept_s;
        let pace = match self.pace {
            Some(pace) => (passed_s + TRUST_S) / (self.worked_s + TRUST_S / pace),
            None if 0.0 < self.worked_s => passed_s / self.worked_s,
            None => return None,
        };
        let (all, done, kept) = self.tiles;
        let mut share = self.share;
        let mut left_s = 0.0;
        for (place, (stage, seconds)) in self.stages.iter().enumerate() {
            let is_current = place == 0 && 0 < all;
            if is_current && 0 < done + kept {
                share = self.recent;
            }
            let open = if is_current { all.saturating_sub(done + kept) as f64 / all as f64 } else { 1.0 };
            // The page shows kept tiles, too.
            left_s += seconds * open * if *stage == Stage::Page { 1.0 } else { share };
        }
        Some(left_s * pace)
    }

    fn seconds(&self, stage: Stage) -> Option<f64> {
        self.stages.iter().find(|(known, _)| *known == stage).map(|(_, seconds)| *seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TILE: TileId = TileId { row: 0, col: 0 };

    fn build() -> Estimate {
        let stages = vec![(Stage::Survey, 10.0), (Stage::Refine, 80.0), (Stage::Assemble, 10.0), (Stage::Page, 2.0)];
        Estimate { pace: Some(0.5), ..Estimate::new(stages) }
    }

    #[test]
    fn what_is_left_is_that_of_the_whole_build_and_follows_the_pace_so_far() {
        let mut estimate = build();
        estimate.hear(&Event::Enter(Stage::Read, 0), 0.0);
        assert_eq!(estimate.left_s(1.0), None);
        estimate.hear(&Event::Leave(Stage::Read), 5.0);
        estimate.hear(&Event::Enter(Stage::Survey, 10), 5.0);
        // Nothing is measured yet: 102 forecast seconds on two workers.
        assert_eq!(estimate.left_s(5.0), Some(51.0));
        for _ in 0..10 {
            estimate.hear(&Event::Done(Stage::Survey, TILE), 15.0);
        }
        estimate.hear(&Event::Leave(Stage::Survey), 15.0);
        estimate.hear(&Event::Enter(Stage::Refine, 10), 15.0);
        // It took 10 s instead of 5.
        let left_s = estimate.left_s(15.0).unwrap();
        assert!(80.0 < left_s && left_s < 92.0, "{left_s}");
    }

    #[test]
    fn what_is_kept_takes_no_time_in_later_stages_neither() {
        let mut estimate = build();
        estimate.hear(&Event::Enter(Stage::Survey, 10), 0.0);
        for _ in 0..10 {
            estimate.hear(&Event::Kept(Stage::Survey, TILE), 0.0);
        }
        estimate.hear(&Event::Leave(Stage::Survey), 0.0);
        estimate.hear(&Event::Enter(Stage::Refine, 10), 0.0);
        assert_eq!(estimate.left_s(0.0), Some(1.0), "only the page is left");
    }

    #[test]
    fn a_build_that_goes_on_is_told_by_the_tiles_that_it_makes_itself() {
        let mut estimate = build();
        estimate.hear(&Event::Enter(Stage::Refine, 100), 0.0);
        // Two at a time: 50 tiles are kept in 50 s, then 40 made in 16 s, as forecast for two workers.
        let tile = |number: u32| TileId { row: 0, col: number };
        for pair in 0..45 {
            let [from_s, to_s] = [0, 1].map(|next| match pair + next {
                of @ ..=25 => 2.0 * f64::from(of),
                of => 50.0 + 0.8 * f64::from(of - 25),
            });
            let pair = [tile(2 * pair), tile(2 * pair + 1)];
            pair.iter().for_each(|tile| estimate.hear(&Event::Started(Stage::Refine, *tile), from_s));
            for tile in pair {
                let event = if tile.col < 50 { Event::Kept } else { Event::Done };
                estimate.hear(&event(Stage::Refine, tile), to_s);
            }
        }
        // 10 tiles, the load modules and the page.
        let (left_s, expected_s) = (estimate.left_s(66.0).unwrap(), (8.0 + 10.0 + 2.0) / 2.0);
        assert!((left_s - expected_s).abs() < 0.05 * expected_s, "{left_s}");
    }

    #[test]
    fn without_a_forecast_the_stage_itself_tells_once_a_tile_is_done() {
        let mut estimate = Estimate::of_one_stage(Stage::Refine);
        estimate.hear(&Event::Enter(Stage::Refine, 4), 1.0);
        assert_eq!(estimate.left_s(2.0), None);
        estimate.hear(&Event::Done(Stage::Refine, TILE), 3.0);
        assert_eq!(estimate.left_s(3.0), Some(6.0));
    }
}
