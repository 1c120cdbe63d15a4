//! What more points would gain: a survey's record of one tile, for the allocation.

use serde::{Deserialize, Serialize};

use crate::{ModuleId, TileId};

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
