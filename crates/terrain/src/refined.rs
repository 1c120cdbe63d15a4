//! What is known of one tile: what more points would gain, surveyed for the allocation, and what refining made of it.

use serde::{Deserialize, Serialize};

use crate::numbered::numbered;
use crate::{ModuleId, Post, TileId, Tin};

/// What a tile would gain, point by point, as a survey found it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GainCurve {
    /// Which tile.
    pub tile: TileId,
    /// Runs of inserted points, best first: `bin` never increases.
    pub runs: Vec<GainRun>,
    /// Where the job asks for an RMS residual: for each step that runs stand on, best first, the sum of squared
    /// residuals (quanta squared, every post of the tile once) when all runs down to that step are taken.
    pub squares: Vec<(i32, f64)>,
}

/// Points inserted into one load module at one step of the gain's ladder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct GainRun {
    /// The load module that is charged.
    pub module: ModuleId,
    /// Step of the ladder of gains, a 64th of an octave each: a step of 64 doubles the gain per cost.
    pub bin: i32,
    /// Triangles that the points of the run cost together.
    pub cost: u32,
}

impl GainCurve {
    /// The sum of squared residuals when everything down to `bin` is taken; that of the start above all runs.
    ///
    /// # Panics
    /// When no squares were recorded.
    pub fn squares_at(&self, bin: i32) -> f64 {
        let taken = self.squares.partition_point(|&(step, _)| bin <= step);
        self.squares[taken.saturating_sub(1)].1
    }

    /// Whether the runs come best first, as [`GainCurve::runs`] promises.
    pub fn is_descending(&self) -> bool {
        self.runs.is_sorted_by(|a, b| b.bin <= a.bin)
    }
}

/// The TIN of one tile, as `refine` publishes it. Nothing after it moves a vertex.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileTin {
    /// Which tile.
    pub tile: TileId,
    /// The initial vertices, then the others: in the order in which they were selected or, where they were optimised,
    /// by row and column.
    pub tin: Tin,
    /// How many of the vertices were there before selection began: corners, load-module corners, border
    /// points, inherited points.
    pub initial_count: u32,
    /// Residual (absolute, in quanta) at which each selected vertex was inserted, in order; empty where the TIN was
    /// optimised, since no vertex is then where it was inserted.
    pub residuals: Vec<u32>,
    /// Triangles charged to this tile: its own points, in every load module they touch.
    pub triangles_charged: u32,
    /// Posts that a limit kept out, largest residual first.
    pub refused: Vec<Refusal>,
    /// Why selection ended.
    pub stop: StopReason,
}

/// A post that would have been inserted next, had a limit not stood in the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// The refused post.
    pub post: Post,
    /// The load module whose limit, or whose window's limit, it would have exceeded.
    pub module: ModuleId,
    /// Absolute residual at the post, in quanta, when it was refused.
    pub residual: u32,
    /// Which limit.
    pub by: RefusedBy,
}

/// The limit that refused a post.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RefusedBy {
    /// The limit of a load module.
    Module,
    /// The limit of a window of load modules.
    Window,
    /// What the neighbour's load module keeps free on its inherited side.
    Reservation,
}

/// Why a tile stopped selecting posts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum StopReason {
    /// All points or triangles allotted to the tile are spent.
    BudgetSpent,
    /// The largest residual is within the tolerance.
    ResidualReached,
    /// The RMS residual is within the target.
    RmsReached,
    /// No selectable post is left: every residual is zero, masked or refused.
    Exhausted,
}

impl RefusedBy {
    /// All of them, by their numbers in files.
    pub const ALL: [Self; 3] = [Self::Module, Self::Window, Self::Reservation];
}

impl StopReason {
    /// All of them, by their numbers in files.
    pub const ALL: [Self; 4] = [Self::BudgetSpent, Self::ResidualReached, Self::RmsReached, Self::Exhausted];
}

numbered!(RefusedBy);
numbered!(StopReason);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_are_those_of_the_lowest_step_taken() {
        let squares = vec![(i32::MAX, 90.0), (9, 40.0), (-3, 10.0)];
        let curve = GainCurve { tile: TileId { row: 0, col: 0 }, runs: Vec::new(), squares };
        assert_eq!([20, 9, 4, -3, -9].map(|bin| curve.squares_at(bin)), [90.0, 40.0, 40.0, 10.0, 10.0]);
    }

    #[test]
    fn a_curve_whose_gain_rises_is_not_descending() {
        let run = |bin| GainRun { module: ModuleId { row: 0, col: 0 }, bin, cost: 2 };
        let mut curve =
            GainCurve { tile: TileId { row: 0, col: 0 }, runs: vec![run(9), run(9), run(-3)], squares: Vec::new() };
        assert!(curve.is_descending());
        curve.runs.push(run(-2));
        assert!(!curve.is_descending());
    }
}
