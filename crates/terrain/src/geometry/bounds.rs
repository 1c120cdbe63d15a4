//! How low and how high the ground lets a vertex stand.

use crate::{Dem, QUANTA_PER_METRE};
use fearless_simd::{Simd, dispatch, i32x8, prelude::*};

use crate::geometry::widest_level;

/// How far beyond the posts around it a vertex may stand where they hardly differ, in quanta: 1 m.
pub const BEYOND_LEAST: i32 = QUANTA_PER_METRE;
/// Part of the range of the posts around it by which a vertex may stand beyond them: one of so many.
const BEYOND_PARTS: i32 = 10;
/// Half posts to either side within which posts count, those just so far away not among them: two posts to either side
/// of the nearest one, and halfway between two posts only those that are near both.
const REACH: i64 = 5;
/// Posts of a row that are looked at together: no fewer than there are within reach.
const LANES: usize = 8;

/// The lowest and the highest height in quanta that a vertex may have: those of the 5 x 5 posts around the one nearest
/// to it, as far as a window has them, and beyond them a tenth of their range, or 1 m where that is more. The place is
/// a row and a column, both in so many steps to a post.
///
/// # Panics
/// When the place lies outside the window.
pub fn height_bounds(dem: &Dem, place: (i64, i64), steps_per_post: i64) -> (i32, i32) {
    dispatch!(widest_level(), simd => height_bounds_in(simd, dem, place, steps_per_post))
}

/// The same in lanes; results do not depend on them.
#[inline(always)]
pub fn height_bounds_in<S: Simd>(simd: S, dem: &Dem, (row, col): (i64, i64), steps_per_post: i64) -> (i32, i32) {
    let rect = dem.rect();
    let around = |at: i64, first: i32, last: i32| {
        let low = (2 * at - REACH * steps_per_post).div_euclid(2 * steps_per_post) + 1;
        let high = -(-2 * at - REACH * steps_per_post).div_euclid(2 * steps_per_post) - 1;
        (low.max(i64::from(first)) as i32, high.min(i64::from(last)) as i32)
    };
    let (south, north) = around(row, rect.south, rect.north);
    let (west, east) = around(col, rect.west, rect.east);
    let (heights, stride) = dem.padded();
    let (first, wide) = ((west - rect.west) as usize, (east - west) as usize + 1);
    let rows = (south - rect.south) as usize..(north - rect.south) as usize + 1;
    // Rows are padded, so as many lanes stay in bounds; those beyond the last post are not looked at.
    let (mut lows, mut highs) = (i32x8::splat(simd, i32::MAX), i32x8::splat(simd, i32::MIN));
    for start in rows.map(|row| row * stride + first) {
        let row = i32x8::from_slice(simd, &heights[start..start + LANES]);
        (lows, highs) = (lows.min(row), highs.max(row));
    }
    let (mut low, mut high) = ([0; LANES], [0; LANES]);
    lows.store_slice(&mut low);
    highs.store_slice(&mut high);
    let low = low[..wide].iter().fold(i32::MAX, |low, &height| low.min(height));
    let high = high[..wide].iter().fold(i32::MIN, |high, &height| high.max(height));
    let beyond = ((high - low) / BEYOND_PARTS).max(BEYOND_LEAST);
    (low - beyond, high + beyond)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Post, PostRect};

    #[track_caller]
    fn check(at: (i64, i64), steps: i64, rows: std::ops::RangeInclusive<i32>, cols: std::ops::RangeInclusive<i32>) {
        let height = |post: Post| 10_000 * (post.row * post.row) + 900 * post.col;
        let rect = PostRect::new(Post::new(-4, 3), Post::new(6, 14));
        let dem = Dem::from_fn(rect, |post| Some(height(post)));
        let posts = || rows.clone().flat_map(|row| cols.clone().map(move |col| height(Post::new(row, col))));
        let (low, high) = (posts().min().unwrap(), posts().max().unwrap());
        let beyond = ((high - low) / 10).max(128);
        assert_eq!(height_bounds(&dem, at, steps), (low - beyond, high + beyond));
    }

    #[test]
    fn the_posts_around_a_vertex_bound_its_height() {
        check((0, 8), 1, -2..=2, 6..=10);
        check((1, 8 * 8), 8, -2..=2, 6..=10);
        check((-4, 8 * 8 + 7), 8, -2..=1, 7..=11);
        // Halfway between two posts only those that are near both.
        check((4, 8 * 8 + 4), 8, -1..=2, 7..=10);
        check((-4 * 64, 14 * 64), 64, -4..=-2, 12..=14);
        check((5 * 3200 + 1, 4 * 3200 + 1599), 3200, 3..=6, 3..=6);
    }

    #[test]
    fn on_a_plain_a_vertex_may_stand_a_metre_beyond() {
        let dem = Dem::from_fn(PostRect::of_size(3, 3), |_| Some(500));
        assert_eq!(height_bounds(&dem, (1, 1), 1), (372, 628));
    }
}
