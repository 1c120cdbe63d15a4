//! Residuals at the posts of the source DEM, which need not be those of the working grid.

use std::ops::Range;

use fearless_simd::{Simd, dispatch, f64x8, prelude::*};
use terrain::{LoadModule, ModuleGrid, Post, PostRect, Spacing};

use crate::Tally;
use crate::measure::ByPost;
use crate::places::ON_EDGE;
use crate::tally::{Histogram, Sums};

/// Where the source's posts lie, in horizontal quanta of 1/128 m from the area's south-west post.
pub struct SourcePosts<'a> {
    /// The posts there are, by the source's own rows and columns.
    pub window: PostRect,
    /// East and north of the source's post (0, 0).
    pub south_west: [f64; 2],
    /// Between posts, to the east and to the north.
    pub step: [f64; 2],
    /// Its heights.
    pub push_row_m: &'a PushRow<'a>,
}

/// Appends the heights in metres of some columns of a row; NaN where there is none.
pub type PushRow<'a> = dyn Fn(i32, Range<i32>, &mut Vec<f64>) + Sync + 'a;

/// Residuals at the source's posts inside `modules`, each counted once: a post on a side belongs to the load module
/// north or east of it, on the area's far borders to the one there.
pub fn residuals_at_source(modules: &[LoadModule], grid: ModuleGrid, spacing: Spacing, source: &SourcePosts) -> Tally {
    let mut tally = Tally::default();
    let side = f64::from(grid.side_cells) * f64::from(spacing.quanta_per_post());
    for module in modules {
        let west = f64::from(module.id.col) * side;
        let south = f64::from(module.id.row) * side;
        let cols = inside(source.south_west[0], source.step[0], west, side, module.id.col + 1 == grid.cols);
        let rows = inside(source.south_west[1], source.step[1], south, side, module.id.row + 1 == grid.rows);
        let Some(posts) = posts(rows, cols).and_then(|posts| posts.intersection(&source.window)) else { continue };
        let ground = PostsInModule { module, source, posts, corner: [west, south] };
        ground.count(&mut tally);
    }
    tally
}

/// First and last post of one axis in `[low, low + side)`, or in `[low, low + side]` at the far border.
fn inside(first: f64, step: f64, low: f64, side: f64, is_last: bool) -> (f64, f64) {
    let end = (low + side - first) / step;
    let last = if is_last { end.floor() } else { end.ceil() - 1.0 };
    (((low - first) / step).ceil(), last)
}

fn posts((south, north): (f64, f64), (west, east): (f64, f64)) -> Option<PostRect> {
    let fits = south <= north && west <= east;
    fits.then(|| PostRect::new(Post::new(south as i32, west as i32), Post::new(north as i32, east as i32)))
}

/// One load module and the source posts in it.
struct PostsInModule<'a> {
    module: &'a LoadModule,
    source: &'a SourcePosts<'a>,
    posts: PostRect,
    corner: [f64; 2],
}

impl PostsInModule<'_> {
    fn count(&self, tally: &mut Tally) {
        let level = terrain::geometry::widest_level();
        let sums = dispatch!(level, simd => self.sums(simd, tally.histogram()));
        tally.add_sums(&sums);
    }

    #[inline(always)]
    fn sums<S: Simd>(&self, simd: S, histogram: Histogram) -> Sums {
        // Heights of the triangles by post, in quanta. A post on an edge has that of the first one.
        let mut planes = ByPost::new(self.posts.posts_high(), self.posts.posts_wide());
        for triangle in self.module.triangles.iter().rev() {
            let corners = triangle.map(|v| {
                let vertex = self.module.vertices[usize::from(v)];
                [f64::from(vertex.x), f64::from(vertex.y), f64::from(vertex.z)]
            });
            self.lay(simd, corners, &mut planes);
        }
        let mut residuals = Vec::with_capacity(planes.values().len());
        for row in self.posts.south..=self.posts.north {
            (self.source.push_row_m)(row, self.posts.west..self.posts.east + 1, &mut residuals);
        }
        // NaN where there is no height or no triangle.
        for (residual, plane) in residuals.iter_mut().zip(planes.values()) {
            *residual = *residual * f64::from(terrain::QUANTA_PER_METRE) - plane;
        }
        let mut sums = Sums::default();
        sums.add_rounded(&residuals, histogram);
        sums
    }

    /// Writes the height of a closed triangle's plane at each post of it, in quanta.
    #[inline(always)]
    fn lay<S: Simd>(&self, simd: S, [a, b, c]: [[f64; 3]; 3], planes: &mut ByPost) {
        let scale = 1.0 / ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
        let first = |axis: usize, at: i32| {
            self.source.south_west[axis] + f64::from(at) * self.source.step[axis] - self.corner[axis]
        };
        let (x0, y0) = (first(0, self.posts.west), first(1, self.posts.south));
        let range = |axis: usize, start: f64, posts: usize| {
            let place = |at: f64| (at - start) / self.source.step[axis];
            let low = place(a[axis].min(b[axis]).min(c[axis])) - ON_EDGE;
            let high = place(a[axis].max(b[axis]).max(c[axis])) + ON_EDGE;
            // A conversion drops what is behind the point and stops at 0.
            let from = low as usize;
            from + usize::from((from as f64) < low)..((high + 1.0) as usize).min(posts)
        };
        let rows = range(1, y0, self.posts.posts_high());
        let cols = range(0, x0, self.posts.posts_wide());
        // Shares of b and c at a post, and what they change by from post to post eastwards.
        let step_b = f64x8::splat(simd, self.source.step[0] * (c[1] - a[1]) * scale);
        let step_c = f64x8::splat(simd, -self.source.step[0] * (b[1] - a[1]) * scale);
        let (rise_b, rise_c) = (f64x8::splat(simd, b[2] - a[2]), f64x8::splat(simd, c[2] - a[2]));
        let (low, whole) = (f64x8::splat(simd, -ON_EDGE), f64x8::splat(simd, 1.0 + ON_EDGE));
        let (start, end) = (f64x8::splat(simd, a[2]), f64x8::splat(simd, cols.end as f64));
        planes.write(simd, (rows, cols), |row, _, cols| {
            let (x, y) = (x0 - a[0], y0 + row as f64 * self.source.step[1] - a[1]);
            let at_b = f64x8::splat(simd, (x * (c[1] - a[1]) - y * (c[0] - a[0])) * scale) + cols * step_b;
            let at_c = f64x8::splat(simd, ((b[0] - a[0]) * y - (b[1] - a[1]) * x) * scale) + cols * step_c;
            let is_inside = at_b.simd_ge(low) & at_c.simd_ge(low) & (at_b + at_c).simd_le(whole) & cols.simd_lt(end);
            (is_inside, start + at_b * rise_b + at_c * rise_c)
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::places::tests::ramp;

    const GRID: ModuleGrid = ModuleGrid { rows: 1, cols: 2, side_cells: 4 };

    #[test]
    fn every_source_post_in_the_area_is_counted_once_with_its_residual() {
        let spacing = Spacing::from_metres(25.0).unwrap();
        // Posts every 20 m from 10 m outside the area: 10 x 5 inside; one metre above the ramp.
        let push_row_m = |_: i32, cols: Range<i32>, heights: &mut Vec<f64>| {
            heights.extend(cols.map(|col| (f64::from(col) * 20.0 - 10.0) / 10.0 + 1.0));
        };
        let source = SourcePosts {
            window: PostRect::of_size(7, 12),
            south_west: [-1280.0, -1280.0],
            step: [2560.0, 2560.0],
            push_row_m: &push_row_m,
        };
        let tally = residuals_at_source(&[ramp(0), ramp(1)], GRID, spacing, &source);
        assert_eq!((tally.posts, tally.largest), (50, 128));
        assert!((tally.rms_m() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn posts_on_the_far_border_count_and_voids_do_not() {
        let spacing = Spacing::from_metres(25.0).unwrap();
        // Posts on every fourth cell: 3 x 2 of them on corners of load modules, one void.
        let push_row_m = |row: i32, cols: Range<i32>, heights: &mut Vec<f64>| {
            heights.extend(cols.map(|col| if (row, col) == (1, 1) { f64::NAN } else { f64::from(col) * 10.0 }));
        };
        let source = SourcePosts {
            window: PostRect::of_size(2, 3),
            south_west: [0.0, 0.0],
            step: [12_800.0, 12_800.0],
            push_row_m: &push_row_m,
        };
        let tally = residuals_at_source(&[ramp(0), ramp(1)], GRID, spacing, &source);
        assert_eq!((tally.posts, tally.largest), (5, 0));
    }
}
