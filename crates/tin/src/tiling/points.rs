//! How many points each tile may select, when a job counts points.

use std::collections::BTreeSet;

use terrain::GainCurve;

/// `points` shared equally; the remainder goes to the first tiles in row-major order.
pub fn points_equally(points: u64, tiles: usize) -> Vec<usize> {
    let (each, rest) = (points as usize / tiles, points as usize % tiles);
    (0..tiles).map(|index| each + usize::from(index < rest)).collect()
}

/// `points` shared by one common threshold of gain: as many points per tile as one greedy run over the
/// whole area would have given it. Curves stand in the order of their tiles and cost one per point; the
/// last rung is filled in rank order. Nothing below the floor is shared out.
pub fn points_globally(points: u64, gains: Gains) -> Vec<usize> {
    let Gains { bands, by_rank, floor } = gains;
    let mut shares = vec![0usize; by_rank.len()];
    let mut left = points;
    for curves in bands {
        let mut next = vec![0usize; curves.len()];
        while let Some(rung) = highest_rung(&curves, &next) {
            if left == 0 || floor.is_some_and(|floor| rung < floor) {
                return shares;
            }
            for &tile in by_rank {
                let runs = &curves[tile].runs;
                while let Some(run) = runs.get(next[tile]).filter(|run| run.bin == rung) {
                    let taken = u64::from(run.cost).min(left);
                    shares[tile] += taken as usize;
                    left -= taken;
                    next[tile] += 1;
                }
            }
        }
    }
    // What no survey saw a use for may be spent anywhere.
    for (share, extra) in shares.iter_mut().zip(points_equally(left, by_rank.len())) {
        *share += extra;
    }
    shares
}

/// Sums of squared residuals of a whole area at steps of the ladder, put together tile by tile.
#[derive(Clone, Debug, PartialEq)]
pub struct SquaresOfArea {
    /// Steps and the sums there, the highest step first.
    sums: Vec<(i32, f64)>,
}

impl SquaresOfArea {
    /// Nothing yet, at the steps that any curve of the area has.
    pub fn at(steps: &BTreeSet<i32>) -> Self {
        Self { sums: steps.iter().rev().map(|&step| (step, 0.0)).collect() }
    }

    /// Adds those of one tile. Tiles come in one order, row-major, so that sums are the same each time.
    ///
    /// # Panics
    /// When no squares were recorded.
    pub fn add(&mut self, curve: &GainCurve) {
        self.sums.iter_mut().for_each(|(step, sum)| *sum += curve.squares_at(*step));
    }

    /// The highest step down to which all gains must be taken for the sum to come down to `goal`; `None` where the
    /// surveys never get there.
    pub fn floor_for(&self, goal: f64) -> Option<i32> {
        // Sums fall from step to step, but for rounding in the choice of posts; the first that is low enough will do.
        self.sums.iter().find(|&&(_, sum)| sum <= goal).map(|&(step, _)| step)
    }
}

/// What the surveys say, the best first.
///
/// The curves of a large area do not fit into memory together, so they come in bands: each holds one curve per tile,
/// row-major, with all its runs on some steps of the ladder, which are higher than those of the next band. A band is
/// asked for when all before it have been taken.
pub struct Gains<'a> {
    /// The bands; costs in triangles, or in points where points are shared out.
    pub bands: &'a mut dyn Iterator<Item = Vec<GainCurve>>,
    /// Tiles from the lowest rank, by row-major place.
    pub by_rank: &'a [usize],
    /// Gains below this step of the ladder are not wanted: the RMS residual asked for is reached without them.
    pub floor: Option<i32>,
}

/// The highest rung among the next runs of all curves.
pub(crate) fn highest_rung(curves: &[GainCurve], next: &[usize]) -> Option<i32> {
    curves.iter().zip(next).filter_map(|(curve, &at)| Some(curve.runs.get(at)?.bin)).max()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::iter::once;
    use terrain::{GainRun, ModuleId, TileId};

    fn curve(col: u32, bins: &[i32]) -> GainCurve {
        let run = |&bin: &i32| GainRun { module: ModuleId { row: 0, col }, bin, cost: 1 };
        GainCurve { tile: TileId { row: 0, col }, runs: bins.iter().map(run).collect(), squares: Vec::new() }
    }

    fn shared(points: u64, curves: &[GainCurve], by_rank: &[usize], floor: Option<i32>) -> Vec<usize> {
        let whole = points_globally(points, Gains { bands: &mut once(curves.to_vec()), by_rank, floor });
        let part = |keep: fn(i32) -> bool| -> Vec<GainCurve> {
            let of = |curve: &GainCurve| curve.runs.iter().copied().filter(|run| keep(run.bin)).collect();
            curves.iter().map(|curve| GainCurve { runs: of(curve), ..curve.clone() }).collect()
        };
        let mut bands = [part(|bin| 5 < bin), part(|bin| bin == 5), part(|bin| bin < 5)].into_iter();
        assert_eq!(points_globally(points, Gains { bands: &mut bands, by_rank, floor }), whole, "in bands");
        whole
    }

    #[test]
    fn nothing_below_the_floor_is_shared_out() {
        let curves = [curve(0, &[9, 9, 2, 1]), curve(1, &[8, 5, 2])];
        assert_eq!(shared(7, &curves, &[0, 1], Some(5)), [2, 2]);
    }

    #[test]
    fn the_floor_is_the_highest_step_that_reaches_the_rms() {
        let with = |col, squares| GainCurve { squares, ..curve(col, &[]) };
        let curves = [
            with(0, vec![(i32::MAX, 900.0), (9, 400.0), (2, 100.0)]),
            with(1, vec![(i32::MAX, 500.0), (8, 100.0), (5, 60.0)]),
        ];
        let steps = curves.iter().flat_map(|curve| curve.squares.iter().map(|&(step, _)| step)).collect();
        let mut squares = SquaresOfArea::at(&steps);
        curves.iter().for_each(|curve| squares.add(curve));
        assert_eq!(squares.floor_for(500.0), Some(8));
        assert_eq!(squares.floor_for(460.0), Some(5));
        assert_eq!(squares.floor_for(10.0), None);
        assert_eq!(squares.floor_for(2000.0), Some(i32::MAX));
    }

    #[test]
    fn the_paper_s_points_are_2125_a_tile() {
        assert_eq!(points_equally(76_500, 36), vec![2125; 36]);
        assert_eq!(points_equally(11, 4), [3, 3, 3, 2]);
    }

    #[test]
    fn the_highest_gains_of_all_tiles_are_taken_first() {
        let curves = [curve(0, &[9, 9, 2, 1]), curve(1, &[8, 5, 2])];
        assert_eq!(shared(4, &curves, &[0, 1], None), [2, 2]);
        assert_eq!(shared(5, &curves, &[0, 1], None), [3, 2]);
        assert_eq!(shared(5, &curves, &[1, 0], None), [2, 3]);
    }

    #[test]
    fn points_beyond_every_curve_are_shared_equally() {
        let curves = [curve(0, &[9]), curve(1, &[])];
        assert_eq!(shared(6, &curves, &[0, 1], None), [4, 2]);
    }
}
