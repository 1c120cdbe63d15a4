//! Residuals at the posts of the source DEM, which need not be those of the working grid.

use std::ops::Range;

use fearless_simd::{Simd, dispatch};
use geometry::resample::rounded;
use terrain::{LoadModule, ModuleGrid, Post, PostRect, Spacing};

use crate::Tally;
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
        // Heights of the triangles by post, in quanta; NaN outside of all. A post on an edge has that of the first one.
        let mut planes = vec![f64::NAN; self.posts.post_count()];
        for triangle in self.module.triangles.iter().rev() {
            let corners = triangle.map(|v| {
                let vertex = self.module.vertices[usize::from(v)];
                [f64::from(vertex.x), f64::from(vertex.y), f64::from(vertex.z)]
            });
            self.lay(corners, &mut planes);
        }
        let mut heights = Vec::with_capacity(planes.len());
        for row in self.posts.south..=self.posts.north {
            (self.source.push_row_m)(row, self.posts.west..self.posts.east + 1, &mut heights);
        }
        let level = geometry::widest_level();
        let sums = dispatch!(level, simd => count_in(simd, &heights, &planes, tally.histogram()));
        tally.add_sums(&sums);
    }

    /// Writes the height of a closed triangle's plane at each post of it, in quanta.
    #[inline(always)]
    fn lay(&self, [a, b, c]: [[f64; 3]; 3], planes: &mut [f64]) {
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
            let from = low as u32;
            ((from + u32::from(f64::from(from) < low)) as i32, ((high + 1.0) as u32).min(posts as u32) as i32)
        };
        let (south, north) = range(1, y0, self.posts.posts_high());
        let (west, east) = range(0, x0, self.posts.posts_wide());
        // Shares of b and c at a post, and what they change by from post to post eastwards.
        let step_b = self.source.step[0] * (c[1] - a[1]) * scale;
        let step_c = -self.source.step[0] * (b[1] - a[1]) * scale;
        let sides = [step_b, step_c, -(step_b + step_c)].map(Slope::of);
        for row in south..north {
            let (x, y) = (x0 - a[0], y0 + f64::from(row) * self.source.step[1] - a[1]);
            let at_b = (x * (c[1] - a[1]) - y * (c[0] - a[0])) * scale;
            let at_c = ((b[0] - a[0]) * y - (b[1] - a[1]) * x) * scale;
            let mut near = (f64::from(west), f64::from(east));
            for (side, share) in sides.iter().zip([at_b, at_c, 1.0 - at_b - at_c]) {
                near = side.narrowed(near, share);
            }
            let at = |col: i32| (at_b + f64::from(col) * step_b, at_c + f64::from(col) * step_c);
            let is_inside = |col: i32| {
                let (at_b, at_c) = at(col);
                -ON_EDGE <= at_b && -ON_EDGE <= at_c && at_b + at_c <= 1.0 + ON_EDGE
            };
            let (mut from, mut end) = (near.0 as i32, near.1 as i32);
            while from < end && !is_inside(from) {
                from += 1;
            }
            while from < end && !is_inside(end - 1) {
                end -= 1;
            }
            if end <= from {
                continue;
            }
            let row = row as usize * self.posts.posts_wide();
            for (col, plane) in (from..end).zip(&mut planes[row + from as usize..row + end as usize]) {
                let (at_b, at_c) = at(col);
                *plane = a[2] + at_b * (b[2] - a[2]) + at_c * (c[2] - a[2]);
            }
        }
    }
}

/// Sums and a histogram of what heights in metres are above heights in quanta; posts without either are left out.
#[inline(always)]
fn count_in<S: Simd>(_: S, heights_m: &[f64], planes: &[f64], mut histogram: Histogram) -> Sums {
    let mut sums = Sums::default();
    let mut residuals = [0; TOGETHER];
    for (heights_m, planes) in heights_m.chunks(TOGETHER).zip(planes.chunks(TOGETHER)) {
        // NaN where either is.
        let above = |(height_m, plane): (&f64, &f64)| height_m * f64::from(terrain::QUANTA_PER_METRE) - plane;
        let mut known = 0;
        for (above, to) in heights_m.iter().zip(planes).map(above).zip(&mut residuals) {
            *to = rounded(above);
            known += usize::from(!above.is_nan());
        }
        if known < planes.len() {
            let found = heights_m.iter().zip(planes).map(above).filter(|above| !above.is_nan());
            found.zip(&mut residuals).for_each(|(above, to)| *to = rounded(above));
        }
        sums.add_all(&residuals[..known]);
        residuals[..known].iter().for_each(|&residual| histogram.add(residual));
    }
    sums
}

/// Posts whose residuals are found together.
const TOGETHER: usize = 64;

/// Share of the triangle by which rounding may put a post on an edge outside both sides of it.
const ON_EDGE: f64 = 1e-9;

/// How a corner's share of a triangle changes along a row.
struct Slope {
    grows: bool,
    shrinks: bool,
    /// Columns it takes to grow by the whole, negative.
    columns: f64,
}

impl Slope {
    fn of(step: f64) -> Self {
        Self { grows: 0.0 < step, shrinks: step < 0.0, columns: -1.0 / step }
    }

    /// The part of a range of columns in which the share, so large at column 0, may not be negative: too wide by a
    /// column at either end, so that rounding loses no post.
    #[inline(always)]
    fn narrowed(&self, (first, end): (f64, f64), share: f64) -> (f64, f64) {
        let crossing = share * self.columns;
        if self.grows {
            (if first < crossing - 1.0 { crossing - 1.0 } else { first }, end)
        } else if self.shrinks {
            (first, if crossing + 2.0 < end { crossing + 2.0 } else { end })
        } else {
            (first, end)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{Decks, ModuleId, ModuleResidual, ModuleVertex};

    const GRID: ModuleGrid = ModuleGrid { rows: 1, cols: 2, side_cells: 4 };

    /// Two load modules of 100 m on a plane that rises 1 m every 10 m to the east.
    fn ramp() -> Vec<LoadModule> {
        let module = |col: u32| {
            let z = |x: u16| (i32::from(x) + col as i32 * 12_800) / 10;
            let vertex = |y, x| ModuleVertex { y, x, z: z(x) };
            LoadModule {
                id: ModuleId { row: 0, col },
                side: 12_800,
                vertices: vec![vertex(0, 0), vertex(0, 12_800), vertex(12_800, 0), vertex(12_800, 12_800)],
                triangles: vec![[0, 1, 3], [0, 3, 2]],
                classes: vec![0, 0],
                polygon_count: 2,
                residual: ModuleResidual::default(),
                decks: Decks::default(),
            }
        };
        vec![module(0), module(1)]
    }

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
        let tally = residuals_at_source(&ramp(), GRID, spacing, &source);
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
        let tally = residuals_at_source(&ramp(), GRID, spacing, &source);
        assert_eq!((tally.posts, tally.largest), (5, 0));
    }
}
