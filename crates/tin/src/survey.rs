//! Running a tile ahead, alone, to learn what each triangle would gain.
//!
//! A global greedy run takes triangles in order of their keys; a tile's share of it is what the tile would
//! have inserted before its own top key fell below the common threshold. So the gain of an insertion is
//! the smallest key seen up to it.
//!
//! Gains lie on a fixed ladder of 64 rungs to the octave, so that a small edit rarely moves a threshold.

use std::sync::LazyLock;

use fearless_simd::{Level, dispatch};
use terrain::geometry::LocalPost;
use terrain::limits::{Charged, ModuleLines};
use terrain::{Dem, GainCurve, GainRun, Importance, PostRect, SeamSides, TileId};

use crate::refine::grow;
use crate::sequence::Witness;
use crate::start::Start;
use crate::task::TileTask;

/// A tile to survey.
#[derive(Clone, Debug, PartialEq)]
pub struct SurveyTask {
    /// The growth to run: every side shared with another tile open, nothing inherited.
    pub growth: TileTask,
    /// The sides this tile will own; what it selects on other open sides is its neighbours' to pay.
    pub owned: SeamSides,
    /// The area's load modules, to whose counts costs are booked.
    pub grid: terrain::ModuleGrid,
    /// What a run's cost counts.
    pub cost: CostUnit,
    /// Whether sums of squares count what no post can lower: ground that weighs nothing, but not walls beside features,
    /// which the tile will have as edges.
    pub counts_left: bool,
}

/// What the cost of a run counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CostUnit {
    /// Triangles: two inside a load module, one on each side of a line.
    Triangles,
    /// Points.
    Points,
}

/// The gains of one tile, pins first, then in the order in which it would take them.
pub fn survey(dem: &Dem, importance: &Importance, task: &SurveyTask, level: Level) -> GainCurve {
    let mut recorder = Recorder::new(task);
    // Pins are there whatever they gain: the budget is for them first.
    let pinned = task.growth.start.iter().filter(|start| start.pinned && task.growth.is_charged(start.at));
    pinned.for_each(|start| recorder.selected(LocalPost::of(start.at, task.growth.rect), f64::MAX));
    let start = Start::new(&task.growth);
    let _ = dispatch!(level, simd => grow(simd, dem, importance, &task.growth, start, &mut recorder));
    if task.counts_left {
        recorder.left = 0.0;
    }
    recorder.into_curve(task.growth.tile)
}

struct Recorder {
    rect: PostRect,
    lines: ModuleLines,
    owned: SeamSides,
    cost: CostUnit,
    bin: i32,
    runs: Vec<GainRun>,
    squares: Vec<(i32, f64)>,
    /// Of the sum of squares, what no post can lower.
    left: f64,
}

impl Recorder {
    fn new(task: &SurveyTask) -> Self {
        let (rect, side_cells) = (task.growth.rect, task.grid.side_cells);
        let module = |at: i32| (at / side_cells) as u32;
        let south_west = terrain::ModuleId { row: module(rect.south), col: module(rect.west) };
        let (rows, cols) = (module(rect.cells_high() as i32), module(rect.cells_wide() as i32));
        let lines = ModuleLines { side: side_cells, south_west, rows, cols, reach: task.grid.all() };
        let (runs, squares) = Default::default();
        Self { rect, lines, owned: task.owned, cost: task.cost, bin: i32::MAX, runs, squares, left: 0.0 }
    }

    fn is_ours(&self, post: LocalPost) -> bool {
        let foreign = |on_side: bool, owned: bool| on_side && !owned;
        !(foreign(post.row() == 0, self.owned.south)
            || foreign(post.col() == 0, self.owned.west)
            || foreign(post.row() == self.rect.cells_high() as i32, self.owned.north)
            || foreign(post.col() == self.rect.cells_wide() as i32, self.owned.east))
    }
}

impl Recorder {
    /// The curve: runs of one step and one load module put together, so that its size is bounded.
    fn into_curve(mut self, tile: TileId) -> GainCurve {
        // Steps come best first already; only load modules within a step have to be put in order.
        self.runs.chunk_by_mut(|a, b| a.bin == b.bin).for_each(|step| step.sort_unstable_by_key(|run| run.module));
        self.runs.dedup_by(|next, run| {
            let same = (run.bin, run.module) == (next.bin, next.module);
            run.cost += if same { next.cost } else { 0 };
            same
        });
        self.squares.iter_mut().for_each(|(_, sum)| *sum = (*sum - self.left).max(0.0));
        GainCurve { tile, runs: self.runs, squares: self.squares }
    }
}

impl Witness for Recorder {
    fn squares(&mut self, sum: f64) {
        match self.squares.last_mut() {
            Some((bin, latest)) if *bin == self.bin => *latest = sum,
            _ => self.squares.push((self.bin, sum)),
        }
    }

    fn squares_left(&mut self, sum: f64) {
        self.left = sum;
    }

    fn selected(&mut self, post: LocalPost, gain: f64) {
        self.bin = self.bin.min(ladder_bin(gain));
        if !self.is_ours(post) {
            return;
        }
        let bin = self.bin;
        match (self.lines.charged(post.row(), post.col()), self.cost) {
            (Some(Charged::Inside(module)), CostUnit::Triangles) => self.runs.push(GainRun { module, bin, cost: 2 }),
            (Some(Charged::Between(first, second)), CostUnit::Triangles) => {
                self.runs.push(GainRun { module: first, bin, cost: 1 });
                self.runs.push(GainRun { module: second, bin, cost: 1 });
            }
            (Some(Charged::Beside(module)), CostUnit::Triangles)
            | (
                Some(Charged::Inside(module) | Charged::Between(_, module) | Charged::Beside(module)),
                CostUnit::Points,
            ) => {
                self.runs.push(GainRun { module, bin, cost: 1 });
            }
            (None, _) => {}
        }
    }
}

/// Rungs to the octave.
const RUNGS: usize = 64;

/// 2^(k/64), from square roots and products, which every machine rounds alike.
static RUNG: LazyLock<[f64; RUNGS]> = LazyLock::new(|| {
    let step = (0..RUNGS.ilog2()).fold(2.0f64, |root, _| root.sqrt());
    let mut rungs = [1.0; RUNGS];
    for i in 1..RUNGS {
        rungs[i] = rungs[i - 1] * step;
    }
    rungs
});

/// The rung a gain stands on: `floor(64 log2(gain))`.
///
/// # Panics
/// When `gain` is not a positive, normal number.
fn ladder_bin(gain: f64) -> i32 {
    assert!(0.0 < gain && gain.is_normal(), "a selected post gains something, got {gain}");
    let bits = gain.to_bits();
    let octave = (bits >> 52) as i32 - 1023;
    let mantissa = f64::from_bits(bits & ((1 << 52) - 1) | 1023 << 52);
    octave * RUNGS as i32 + RUNG.partition_point(|&rung| rung <= mantissa) as i32 - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The smallest gain on a rung.
    fn gain_at_bin(bin: i32) -> f64 {
        let (octave, rung) = (bin.div_euclid(RUNGS as i32), bin.rem_euclid(RUNGS as i32));
        RUNG[rung as usize] * f64::from_bits(((octave + 1023) as u64) << 52)
    }

    #[test]
    fn every_rung_begins_at_its_smallest_gain() {
        for bin in -640..6400 {
            let gain = gain_at_bin(bin);
            assert_eq!(ladder_bin(gain), bin);
            assert_eq!(ladder_bin(f64::from_bits(gain.to_bits() - 1)), bin - 1);
        }
    }

    #[test]
    fn an_octave_has_sixty_four_rungs() {
        assert_eq!(ladder_bin(1.0), 0);
        assert_eq!(ladder_bin(2.0), 64);
        assert_eq!(ladder_bin(1.5), 37);
        assert_eq!(ladder_bin(0.5), -64);
    }
}
