//! The tiles of a mesh: how many suit one for which none are asked, how a tile's gains go on beyond what was surveyed,
//! and the TINs of all as one.

use std::collections::HashMap;

use terrain::{GainCurve, GainRun, PostRect, TileTin, Tin, Vertex};

/// Cells of a tile, about: work on smaller ones is spent on borders, and larger ones share out badly.
const CELLS: f64 = 110_000.0;
/// Points of a tile, at least: with fewer, points that tiles share weigh too much.
const POINTS: f64 = 2000.0;
/// Fewer tiles than this are not worth their borders.
const TILES_MIN: f64 = 4.0;

/// Rows and columns of tiles for a mesh of so many points, from the raster's size and that number alone.
pub(crate) fn usual_tiles(rect: PostRect, points: usize) -> (u32, u32) {
    let (high, wide) = (rect.cells_high() as f64, rect.cells_wide() as f64);
    let count = (high * wide / CELLS).min(points as f64 / POINTS);
    if count < TILES_MIN {
        return (1, 1);
    }
    // Squares, but for rasters narrower than one.
    let side = (high * wide / count).sqrt();
    let across = (high.min(wide) / side + 0.5).max(1.0).floor();
    let (across, along) = (across as u32, (count / across + 0.5) as u32);
    if high < wide { (across, along) } else { (along, across) }
}

/// Tiles put together: points on shared lines are equal, so they are one vertex.
pub(crate) fn join(rect: PostRect, tiles: &[TileTin]) -> Tin {
    if let [only] = tiles {
        return only.tin.clone();
    }
    let mut joined = Tin::new(rect, Vec::new(), Vec::new());
    let mut on_lines = HashMap::new();
    for tile in tiles {
        let part = &tile.tin;
        let (low, high) = (part.place_of(part.rect.south_west()), part.place_of(part.rect.north_east()));
        let mut place = |vertex: &Vertex| {
            let at = vertex.at;
            let mut fresh = || {
                joined.vertices.push(*vertex);
                joined.vertices.len() as u32 - 1
            };
            let is_on_line = at.row == low.row || at.row == high.row || at.col == low.col || at.col == high.col;
            if is_on_line { *on_lines.entry(at).or_insert_with(fresh) } else { fresh() }
        };
        let places: Vec<u32> = part.vertices.iter().map(&mut place).collect();
        joined.triangles.extend(part.triangles.iter().map(|corners| corners.map(|v| places[v as usize])));
    }
    joined
}

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
    use terrain::{ModuleId, Post, TileId};

    use super::*;

    #[test]
    fn large_rasters_with_many_points_are_cut_and_others_are_not() {
        let tiles =
            |rows, cols, points| usual_tiles(PostRect::new(Post::new(0, 0), Post::new(rows - 1, cols - 1)), points);
        assert_eq!(tiles(1979, 1979, 76_500), (6, 6));
        assert_eq!(tiles(990, 3958, 76_500), (3, 12));
        assert_eq!(tiles(1979, 1979, 5000), (1, 1));
        assert_eq!(tiles(1979, 1979, 18_000), (3, 3));
        assert_eq!(tiles(460, 376, 100_000), (1, 1));
        assert_eq!(tiles(2, 100_000_000, 1_000_000), (1, 500));
        assert_eq!(tiles(2, 2, 4), (1, 1));
    }

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
