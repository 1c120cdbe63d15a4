//! A build played on paper: how long it would take with so many workers and so many tiles, from what tiles cost.

use job::TileOrder;
use schedule::{RankedTasks, Simulation, simulate};
use terrain::TileId;

use crate::Plan;

/// Seconds that every unit of work takes beside its ground: files, seams, bookkeeping. Measured with tiles of one load
/// module.
const SECONDS_PER_UNIT: f64 = 2e-3;

/// Seconds of one tile, by stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileCosts {
    /// Surveying it.
    pub survey_s: f64,
    /// Refining it.
    pub refine_s: f64,
    /// Assembling its load modules.
    pub assemble_s: f64,
}

/// What the tiles of a job cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Costs {
    /// Rows of tiles.
    pub rows: u32,
    /// Columns of tiles.
    pub columns: u32,
    /// Every tile, row by row from the south-west.
    pub tiles: Vec<TileCosts>,
}

/// A build as it was played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Played {
    /// Rows and columns of tiles.
    pub tiles: (u32, u32),
    /// Tasks at once.
    pub workers: usize,
    /// From beginning to end, in seconds.
    pub seconds: f64,
    /// Share of the workers' time spent at work.
    pub busy: f64,
    /// No number of workers is faster than this.
    pub longest_chain_s: f64,
    /// Tiles refined at once, at most.
    pub at_once: usize,
    /// Memory of the coordinator.
    pub coordinator_bytes: u64,
    /// How many times larger the area is than the job's.
    pub area_times: f64,
}

impl Costs {
    /// What the tiles of a plan are forecast to cost: each by its ground.
    pub fn forecast(plan: &Plan) -> Self {
        let end = |at: fn(TileId) -> u32| plan.tiles.iter().map(|tile| at(tile.tile) + 1).max().unwrap_or(1);
        let posts: f64 = plan.tiles.iter().map(|tile| tile.rect.post_count() as f64).sum();
        let seconds = |tile: &crate::ground::PlannedTile| plan.forecast.seconds * tile.rect.post_count() as f64 / posts;
        // Shares of the stages as on the jobs in `configs`.
        let cost = |seconds: f64| TileCosts {
            survey_s: if plan.is_surveyed { 0.12 * seconds } else { 0.0 },
            refine_s: if plan.is_surveyed { 0.86 * seconds } else { 0.98 * seconds },
            assemble_s: 0.02 * seconds,
        };
        let tiles = plan.tiles.iter().map(|tile| cost(seconds(tile))).collect();
        Self { rows: end(|tile| tile.row), columns: end(|tile| tile.col), tiles }
    }

    /// The same ground in other tiles, if they are no more than `modules`; otherwise an area that goes on like this
    /// one, in tiles like these. And how many times larger that area is.
    fn cut(&self, rows: u32, columns: u32, modules: u64) -> (Self, f64) {
        let (count, before) = (u64::from(rows) * u64::from(columns), self.tiles.len() as f64);
        let is_same_area = count <= modules || count <= self.tiles.len() as u64;
        let share = if is_same_area { before / count as f64 } else { 1.0 };
        let from = |at: u32, now: u32, before: u32| match is_same_area {
            true => ((f64::from(at) + 0.5) / f64::from(now) * f64::from(before)) as u32,
            false => at % before,
        };
        let cost = |row: u32, col: u32| {
            let (row, col) = (from(row, rows, self.rows), from(col, columns, self.columns));
            let known = self.tiles[row as usize * self.columns as usize + col as usize];
            let part = |seconds: f64| if seconds == 0.0 { 0.0 } else { seconds * share + SECONDS_PER_UNIT };
            TileCosts {
                survey_s: part(known.survey_s),
                refine_s: part(known.refine_s),
                assemble_s: part(known.assemble_s),
            }
        };
        let tiles = (0..rows).flat_map(|row| (0..columns).map(move |col| (row, col)));
        let tiles = tiles.map(|(row, col)| cost(row, col)).collect();
        (Self { rows, columns, tiles }, if is_same_area { 1.0 } else { count as f64 / before })
    }
}

/// Plays a build in `rows` x `columns` tiles, once for each number of workers, stage after stage as `build` does it.
/// `modules` are the load modules of the job's area.
///
/// # Panics
/// When there is no tile or no worker.
pub fn play(
    costs: &Costs,
    (rows, columns): (u32, u32),
    modules: u64,
    order: TileOrder,
    workers: &[usize],
) -> Vec<Played> {
    let (costs, area_times) = costs.cut(rows, columns, modules);
    let ranked = ranked(rows, columns, order);
    let none = vec![Vec::new(); costs.tiles.len()];
    let free = RankedTasks::new(&vec![0u8; costs.tiles.len()], &none);
    drop(none);
    let seconds = |of: fn(&TileCosts) -> f64| costs.tiles.iter().map(of).collect::<Vec<f64>>();
    let stages = [
        (&free, seconds(|tile| tile.survey_s)),
        (&ranked, seconds(|tile| tile.refine_s)),
        (&free, seconds(|tile| tile.assemble_s)),
    ];
    let work: f64 = stages.iter().flat_map(|(_, seconds)| seconds).sum();
    let played = |&workers: &usize| {
        let runs: Vec<Simulation> = stages.iter().map(|(tasks, seconds)| simulate(tasks, workers, seconds)).collect();
        let seconds: f64 = runs.iter().map(|run| run.makespan).sum();
        Played {
            tiles: (rows, columns),
            workers,
            seconds,
            busy: if seconds == 0.0 { 1.0 } else { work / (seconds * workers as f64) },
            longest_chain_s: runs.iter().map(|run| run.critical_path).sum(),
            at_once: runs[1].at_once,
            coordinator_bytes: ranked.coordinator_bytes(),
            area_times,
        }
    };
    workers.iter().map(played).collect()
}

/// Tiles as tasks that wait for their neighbours of lower rank.
fn ranked(rows: u32, columns: u32, order: TileOrder) -> RankedTasks {
    let all = || (0..rows).flat_map(|row| (0..columns).map(move |col| (row, col)));
    let color = |row: u32, col: u32| match order {
        TileOrder::Color => 2 * (row % 2) + col % 2,
        TileOrder::Raster => 0,
    };
    let ranks: Vec<(u32, u32, u32)> = all().map(|(row, col)| (color(row, col), row, col)).collect();
    let around = |at: u32, end: u32| at.saturating_sub(1)..(at + 2).min(end);
    let beside = |(row, col): (u32, u32)| {
        let near = around(row, rows).flat_map(|r| around(col, columns).map(move |c| (r, c)));
        near.filter(|&other| other != (row, col)).map(|(r, c)| r as usize * columns as usize + c as usize).collect()
    };
    RankedTasks::new(&ranks, &all().map(beside).collect::<Vec<Vec<usize>>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even(rows: u32, columns: u32) -> Costs {
        let tile = TileCosts { survey_s: 1.0, refine_s: 8.0, assemble_s: 0.5 };
        Costs { rows, columns, tiles: vec![tile; (rows * columns) as usize] }
    }

    #[test]
    fn adjacency_lets_a_quarter_of_the_tiles_run_at_once() {
        let played = play(&even(6, 6), (6, 6), 10_000, TileOrder::Color, &[1, 9, 36]);
        assert_eq!(played[0].at_once, 1);
        assert!((played[0].busy - 1.0).abs() < 1e-9, "{}", played[0].busy);
        assert_eq!((played[1].at_once, played[2].at_once), (9, 9));
        // Refining takes four rounds of tiles, with any number of workers.
        let refine_s = 4.0 * (8.0 + SECONDS_PER_UNIT);
        assert!(refine_s <= played[2].seconds && played[2].busy < 0.3, "{:?}", played[2]);
    }

    #[test]
    fn more_tiles_keep_more_workers_busy_until_they_are_too_small() {
        let costs = even(6, 6);
        let busy = |tiles| play(&costs, tiles, 10_000, TileOrder::Color, &[32])[0].busy;
        assert!(busy((6, 6)) < busy((12, 12)) && busy((12, 12)) < busy((24, 24)));
        let coarse = play(&costs, (6, 6), 10_000, TileOrder::Color, &[1])[0].seconds;
        assert!(coarse < play(&costs, (100, 100), 10_000, TileOrder::Color, &[1])[0].seconds);
    }

    #[test]
    fn more_tiles_than_load_modules_are_a_larger_area() {
        let played = play(&even(2, 2), (20, 20), 100, TileOrder::Color, &[1]);
        assert_eq!(played[0].area_times, 100.0);
        let seconds = 400.0 * (9.5 + 3.0 * SECONDS_PER_UNIT);
        assert!((played[0].seconds - seconds).abs() < 1e-6 * seconds);
    }
}
