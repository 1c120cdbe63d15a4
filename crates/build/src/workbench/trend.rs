//! How a tile's gains go on beyond what was surveyed: points grow by a power of the gain, as they did before.

use terrain::{GainCurve, GainRun};

/// Rungs of the ladder of gains in an octave.
const OCTAVE: f64 = 64.0;
/// Octaves of points to an octave of gains, at least and at most: worst posts of noise and sums of squares of smooth
/// ground are between them.
const GROWTH: (f64, f64) = (0.2, 3.0);

/// Continues a curve from `reach` points, where the survey ended, to so many times as many.
///
/// A curve with far fewer ended because there was nothing left to gain, and stays as it is.
pub(crate) fn continued(mut curve: GainCurve, reach: usize, times: usize) -> GainCurve {
    let points: u64 = curve.runs.iter().map(|run| u64::from(run.cost)).sum();
    // What was selected on sides of other tiles is not in the curve.
    if 4 * points < 3 * reach as u64 {
        return curve;
    }
    let Some(&last) = curve.runs.last() else { return curve };
    let mut left = points / 2;
    let half = curve.runs.iter().find(|run| {
        left = left.saturating_sub(u64::from(run.cost));
        left == 0
    });
    let fall = f64::from(half.map_or(0, |run| run.bin - last.bin)).max(1.0);
    let growth = (OCTAVE / fall).clamp(GROWTH.0, GROWTH.1);
    let (mut spent, most) = (points, points * times as u64);
    for rung in 1.. {
        let expected = (points as f64 * (f64::from(rung) / OCTAVE * growth).exp2()) as u64;
        let cost = expected.min(most) - spent;
        if 0 < cost {
            curve.runs.push(GainRun { bin: last.bin - rung, cost: cost as u32, ..last });
        }
        spent += cost;
        if spent == most {
            return curve;
        }
    }
    curve
}

#[cfg(test)]
mod tests {
    use terrain::{ModuleId, TileId};

    use super::*;

    /// A tile whose points grow by a power of the gain: twice as many for each `fall` rungs.
    fn surveyed(fall: f64, points: u32) -> GainCurve {
        let bin = |point: u32| 600 - (f64::from(point).log2() * fall) as i32;
        let run = |point: u32| GainRun { module: ModuleId { row: 0, col: 0 }, bin: bin(point), cost: 1 };
        GainCurve { tile: TileId { row: 0, col: 0 }, runs: (1..=points).map(run).collect(), squares: Vec::new() }
    }

    fn count(curve: &GainCurve, down_to: i32) -> u32 {
        curve.runs.iter().filter(|run| down_to <= run.bin).map(|run| run.cost).sum()
    }

    #[test]
    fn a_curve_goes_on_as_it_came() {
        for fall in [64.0, 100.0, 150.0] {
            let (found, whole) = (continued(surveyed(fall, 1000), 1000, 3), surveyed(fall, 3000));
            assert_eq!(count(&found, i32::MIN), 3000);
            for rung in (found.runs.last().unwrap().bin..600).step_by(10) {
                let (found, whole) = (f64::from(count(&found, rung)), f64::from(count(&whole, rung)));
                assert!((found - whole).abs() <= 0.03 * whole + 2.0, "{fall}: {found} {whole}");
            }
            assert!(found.runs.is_sorted_by(|a, b| b.bin <= a.bin));
        }
    }

    #[test]
    fn a_curve_that_ended_for_want_of_posts_ends() {
        assert_eq!(continued(surveyed(64.0, 500), 1000, 3), surveyed(64.0, 500));
        let nothing = GainCurve { runs: Vec::new(), ..surveyed(64.0, 1) };
        assert_eq!(continued(nothing.clone(), 0, 3), nothing);
    }
}
