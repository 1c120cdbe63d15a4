//! What more points would gain: a survey's record of one tile, for the allocation.

use crate::{ModuleId, TileId};

/// What a tile would gain, point by point, as a survey found it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GainCurve {
    /// Which tile.
    pub tile: TileId,
    /// Runs of inserted points, best first: `bin` never increases.
    pub runs: Vec<GainRun>,
}

/// Points inserted into one load module at one step of the gain's ladder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GainRun {
    /// The load module that is charged.
    pub module: ModuleId,
    /// Step of the ladder of gains, a 64th of an octave each: a step of 64 doubles the gain per cost.
    pub bin: i32,
    /// Triangles that the points of the run cost together.
    pub cost: u32,
}

impl GainCurve {
    /// Whether the runs come best first, as [`GainCurve::runs`] promises.
    pub fn is_descending(&self) -> bool {
        self.runs.is_sorted_by(|a, b| b.bin <= a.bin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_whose_gain_rises_is_not_descending() {
        let run = |bin| GainRun { module: ModuleId { row: 0, col: 0 }, bin, cost: 2 };
        let mut curve = GainCurve { tile: TileId { row: 0, col: 0 }, runs: vec![run(9), run(9), run(-3)] };
        assert!(curve.is_descending());
        curve.runs.push(run(-2));
        assert!(!curve.is_descending());
    }
}
