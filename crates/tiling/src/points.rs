//! How many points each tile may select, when a job counts points.

use terrain::GainCurve;

/// `points` shared equally; the remainder goes to the first tiles in row-major order.
pub fn points_equally(points: u64, tiles: usize) -> Vec<usize> {
    let (each, rest) = (points as usize / tiles, points as usize % tiles);
    (0..tiles).map(|index| each + usize::from(index < rest)).collect()
}

/// `points` shared by one common threshold of gain: as many points per tile as one greedy run over the
/// whole area would have given it. Curves stand in the order of their tiles and cost one per point; the
/// last rung is filled in rank order, `by_rank` naming tiles from the lowest.
pub fn points_globally(points: u64, curves: &[GainCurve], by_rank: &[usize]) -> Vec<usize> {
    let mut shares = vec![0usize; curves.len()];
    let mut next = vec![0usize; curves.len()];
    let mut left = points;
    while 0 < left {
        let Some(rung) = highest_rung(curves, &next) else { break };
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
    // What no survey saw a use for may be spent anywhere.
    for (share, extra) in shares.iter_mut().zip(points_equally(left, curves.len())) {
        *share += extra;
    }
    shares
}

/// The highest rung among the next runs of all curves.
pub(crate) fn highest_rung(curves: &[GainCurve], next: &[usize]) -> Option<i32> {
    curves.iter().zip(next).filter_map(|(curve, &at)| Some(curve.runs.get(at)?.bin)).max()
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{GainRun, ModuleId, TileId};

    fn curve(col: u32, bins: &[i32]) -> GainCurve {
        let run = |&bin: &i32| GainRun { module: ModuleId { row: 0, col }, bin, cost: 1 };
        GainCurve { tile: TileId { row: 0, col }, runs: bins.iter().map(run).collect() }
    }

    #[test]
    fn the_paper_s_points_are_2125_a_tile() {
        assert_eq!(points_equally(76_500, 36), vec![2125; 36]);
        assert_eq!(points_equally(11, 4), [3, 3, 3, 2]);
    }

    #[test]
    fn the_highest_gains_of_all_tiles_are_taken_first() {
        let curves = [curve(0, &[9, 9, 2, 1]), curve(1, &[8, 5, 2])];
        assert_eq!(points_globally(4, &curves, &[0, 1]), [2, 2]);
        assert_eq!(points_globally(5, &curves, &[0, 1]), [3, 2]);
        assert_eq!(points_globally(5, &curves, &[1, 0]), [2, 3]);
    }

    #[test]
    fn points_beyond_every_curve_are_shared_equally() {
        let curves = [curve(0, &[9]), curve(1, &[])];
        assert_eq!(points_globally(6, &curves, &[0, 1]), [4, 2]);
    }
}
