//! The posts a triangle owns, where its corners may lie between posts, and the residual at each.
//!
//! The owner of a post is the triangle that holds it after an infinitesimal shift east, then a smaller one
//! north; on the far borders of the area the shift is inward. So the triangles of a sheet share the posts
//! out exactly once, posts that are corners or lie on edges included. Everything is whole numbers: rows
//! are walked with exact floors and remainders, heights are compared as numerators over the doubled area.

use std::ops::Range;

use crate::{Dem, ModuleGrid, ModuleId, Post, PostRect, Spacing};

use crate::geometry::Facet;

/// Where posts lie in the plane of the triangles: every `units_per_post` units from `origin`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PostGrid {
    /// The post at (0, 0) of the plane.
    pub origin: Post,
    /// Units between posts, positive.
    pub units_per_post: i32,
    /// Posts north of `origin` of the row that the triangles south of it own: the area's northern border.
    pub far_row: Option<i32>,
    /// Posts east of `origin` of the column that the triangles west of it own: the area's eastern border.
    pub far_col: Option<i32>,
}

impl PostGrid {
    /// The posts of a load module in its own quanta; those on the area's northern and eastern border belong to
    /// the load modules there.
    pub fn of_module(grid: ModuleGrid, module: ModuleId, spacing: Spacing) -> Self {
        Self {
            origin: grid.posts_of(module).south_west(),
            units_per_post: spacing.quanta_per_post(),
            far_row: (module.row + 1 == grid.rows).then_some(grid.side_cells),
            far_col: (module.col + 1 == grid.cols).then_some(grid.side_cells),
        }
    }

    /// The posts of a whole area in units of posts, its far borders included.
    pub fn of_area(area: PostRect) -> Self {
        Self {
            origin: area.south_west(),
            units_per_post: 1,
            far_row: Some(area.cells_high() as i32),
            far_col: Some(area.cells_wide() as i32),
        }
    }
}

/// Calls `visit` with each owned post and its residual: DEM height less the triangle's, in quanta, rounded
/// half away from zero.
///
/// Corners lie at most 2^16 units apart, heights have 24 bits, so all products stay below 2^61.
///
/// # Panics
/// When the DEM window does not hold the triangle.
#[inline(always)]
pub fn visit_residuals(grid: &PostGrid, facet: &Facet, dem: &Dem, mut visit: impl FnMut(Post, i32)) {
    let division = Division::by(facet.den);
    let step = i64::from(grid.units_per_post);
    let (x0, y0, plane0) = (i64::from(facet.x[0]), i64::from(facet.y[0]), i64::from(facet.z[0]) * facet.den);
    let east = facet.px * step;
    for (row, cols) in OwnedRows::new(grid, facet) {
        let (dx, dy) = (i64::from(cols.start) * step - x0, i64::from(row) * step - y0);
        let mut plane = plane0 + facet.px * dx + facet.py * dy;
        let first = Post::new(grid.origin.row + row, grid.origin.col + cols.start);
        let skipped = (first.col - dem.rect().west) as usize;
        let heights = &dem.row(first.row)[skipped..skipped + cols.len()];
        for (col, &height) in (first.col..).zip(heights) {
            visit(Post::new(first.row, col), division.rounded(i64::from(height) * facet.den - plane));
            plane += east;
        }
    }
}

/// The rows that hold owned posts of a triangle and the range of their columns, both counted from the origin,
/// from south to north.
#[derive(Clone)]
pub struct OwnedRows {
    far_col: Option<i32>,
    units_per_post: i32,
    posts_per_unit: f64,
    middle: (i32, i32),
    high: (i32, i32),
    /// The next row, the first one at or north of the middle corner, and of the highest corner.
    row: i32,
    turn: i32,
    end: i32,
    /// Whether the long side, from the lowest to the highest corner, is the left one.
    long_is_left: bool,
    long: Walk,
    short: Walk,
    /// The row of a flat top on the area's northern border.
    top: Option<i32>,
}

impl OwnedRows {
    /// The rows of a counter-clockwise `facet` with corners at most 2^17 units from the origin.
    #[inline(always)]
    pub fn new(grid: &PostGrid, facet: &Facet) -> Self {
        let [low, middle, high] = by_height(facet);
        let step = grid.units_per_post;
        let posts_per_unit = 1.0 / f64::from(step);
        let first_at = |y: i32| -floored(-i64::from(y), i64::from(step), -f64::from(y) * posts_per_unit).0;
        let (row, turn, end) = (first_at(low.1), first_at(middle.1), first_at(high.1));
        let (dx, dy) = (i64::from(high.0 - low.0), i64::from(high.1 - low.1));
        let long_is_left = dx * i64::from(middle.1 - low.1) < i64::from(middle.0 - low.0) * dy;
        let long = Walk::start(low, high, row, (step, posts_per_unit));
        let short = if row < turn { Walk::start(low, middle, row, (step, posts_per_unit)) } else { long };
        // A flat top on the northern border owns that row; a tip there has no width just south of it.
        let is_top = grid.far_row.is_some_and(|far| far * step == high.1) && middle.1 == high.1;
        let top = is_top.then_some(end);
        let far_col = grid.far_col;
        Self {
            far_col,
            units_per_post: step,
            posts_per_unit,
            middle,
            high,
            row,
            turn,
            end,
            long_is_left,
            long,
            short,
            top,
        }
    }

    /// Columns between two crossings: the left one itself is inside, the right one is not, except on the
    /// area's eastern border.
    #[inline(always)]
    fn cols(&self, left: &Walk, right: &Walk) -> Range<i32> {
        let (start, mut end) = (left.ceil(), right.ceil());
        if self.far_col == Some(right.floor) && left.floor < right.floor {
            end += 1;
        }
        start..end
    }
}

impl Iterator for OwnedRows {
    type Item = (i32, Range<i32>);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        while self.row < self.end {
            if self.row == self.turn {
                self.short = Walk::start(self.middle, self.high, self.row, (self.units_per_post, self.posts_per_unit));
            }
            let (left, right) = if self.long_is_left { (&self.long, &self.short) } else { (&self.short, &self.long) };
            let (row, cols) = (self.row, self.cols(left, right));
            self.row += 1;
            self.long.north();
            self.short.north();
            if !cols.is_empty() {
                return Some((row, cols));
            }
        }
        let row = self.top.take()?;
        let at = |x: i32| Walk::fixed(x, self.units_per_post);
        let (west, east) = (self.middle.0.min(self.high.0), self.middle.0.max(self.high.0));
        Some((row, self.cols(&at(west), &at(east)))).filter(|(_, cols)| !cols.is_empty())
    }
}

/// Corners as (x, y), from the southernmost to the northernmost.
fn by_height(facet: &Facet) -> [(i32, i32); 3] {
    let [mut a, mut b, mut c] = [0, 1, 2].map(|i| (facet.x[i], facet.y[i]));
    if b.1 < a.1 {
        std::mem::swap(&mut a, &mut b);
    }
    if c.1 < b.1 {
        std::mem::swap(&mut b, &mut c);
        if b.1 < a.1 {
            std::mem::swap(&mut a, &mut b);
        }
    }
    [a, b, c]
}

/// Where a side crosses the rows of posts: (floor + remainder / den) posts east of the origin.
#[derive(Clone, Copy)]
struct Walk {
    floor: i32,
    remainder: i64,
    den: i64,
    step_floor: i32,
    step_remainder: i64,
}

impl Walk {
    /// The side from `low` up to `high`, which is higher, at row `row`.
    #[inline(always)]
    fn start(low: (i32, i32), high: (i32, i32), row: i32, (units_per_post, posts_per_unit): (i32, f64)) -> Self {
        let (dx, dy) = (i64::from(high.0) - i64::from(low.0), i64::from(high.1) - i64::from(low.1));
        let units = i64::from(units_per_post);
        let den = dy * units;
        let east = i64::from(low.0) * dy + (i64::from(row) * units - i64::from(low.1)) * dx;
        let reciprocal = 1.0 / dy as f64;
        let (floor, remainder) = floored(east, den, east as f64 * reciprocal * posts_per_unit);
        // A row further north, the place moves by dx / dy posts.
        let (step_floor, step_remainder) = floored(dx, dy, dx as f64 * reciprocal);
        Self { floor, remainder, den, step_floor, step_remainder: step_remainder * units }
    }

    /// The place `x` itself.
    fn fixed(x: i32, units_per_post: i32) -> Self {
        let (floor, remainder) = (x.div_euclid(units_per_post), i64::from(x.rem_euclid(units_per_post)));
        Self { floor, remainder, den: i64::from(units_per_post), step_floor: 0, step_remainder: 0 }
    }

    #[inline(always)]
    fn ceil(&self) -> i32 {
        self.floor + i32::from(0 < self.remainder)
    }

    #[inline(always)]
    fn north(&mut self) {
        self.floor += self.step_floor;
        self.remainder += self.step_remainder;
        if self.den <= self.remainder {
            self.remainder -= self.den;
            self.floor += 1;
        }
    }
}

/// Floor and remainder of `numerator / den`, given the quotient within a thousandth: its nearest whole number
/// is the floor or the next one.
#[inline(always)]
fn floored(numerator: i64, den: i64, quotient: f64) -> (i32, i64) {
    let nearest = nearest(quotient);
    let remainder = numerator - i64::from(nearest) * den;
    let above = remainder < 0;
    (nearest - i32::from(above), remainder + if above { den } else { 0 })
}

/// The whole number nearest to `v`, for |v| < 2^31: the sum has its last binary place at one, so its low bits
/// are that number.
#[inline(always)]
fn nearest(v: f64) -> i32 {
    const PLACE_OF_ONE: f64 = (1_u64 << 52) as f64 * 1.5;
    (v + PLACE_OF_ONE).to_bits() as i32
}

/// Division by one number many times: a reciprocal guesses, the remainder decides.
///
/// The guess is the nearest whole number or, close to a half, its other neighbour, because the quotient has at
/// most 26 bits and the product at most three roundings of 2^-53; one comparison on either side makes it exact.
#[derive(Clone, Copy)]
struct Division {
    den: i64,
    reciprocal: f64,
}

impl Division {
    #[inline(always)]
    fn by(den: i64) -> Self {
        Self { den, reciprocal: 1.0 / den as f64 }
    }

    /// `numerator / den`, half away from zero; the numerator below 2^60, the quotient below 2^26.
    #[inline(always)]
    fn rounded(&self, numerator: i64) -> i32 {
        let guess = nearest(numerator as f64 * self.reciprocal);
        let doubled_rest = 2 * (numerator - i64::from(guess) * self.den);
        let up = self.den < doubled_rest + i64::from(0 < numerator);
        let down = doubled_rest - i64::from(numerator < 0) < -self.den;
        guess + i32::from(up) - i32::from(down)
    }
}

#[cfg(test)]
mod tests {
    use crate::PostRect;
    use fastrand::Rng;

    use super::*;

    /// Whether the facet holds the post after the shift, asked of the three half planes one by one.
    fn owns(grid: &PostGrid, facet: &Facet, row: i32, col: i32) -> bool {
        let (x, y) = (i64::from(col * grid.units_per_post), i64::from(row * grid.units_per_post));
        let east = if grid.far_col == Some(col) { -1 } else { 1 };
        let north = if grid.far_row == Some(row) { -1 } else { 1 };
        (0..3).all(|i| {
            let j = (i + 1) % 3;
            let (dx, dy) = (i64::from(facet.x[j] - facet.x[i]), i64::from(facet.y[j] - facet.y[i]));
            let side = dx * (y - i64::from(facet.y[i])) - dy * (x - i64::from(facet.x[i]));
            (side, -dy * east, dx * north) > (0, 0, 0)
        })
    }

    #[track_caller]
    fn check(grid: &PostGrid, posts: i32, facet: &Facet) {
        let mut found = Vec::new();
        OwnedRows::new(grid, facet).for_each(|(row, cols)| found.extend(cols.map(|col| (row, col))));
        let all = (0..=posts).flat_map(|row| (0..=posts).map(move |col| (row, col)));
        let last = |v: i32, far: Option<i32>| v < posts || far == Some(posts);
        let expected: Vec<_> = all
            .filter(|&(row, col)| last(row, grid.far_row) && last(col, grid.far_col))
            .filter(|&(row, col)| owns(grid, facet, row, col))
            .collect();
        assert_eq!(found, expected, "posts owned by {facet:?}");
    }

    #[test]
    fn owned_posts_are_those_of_the_shifted_triangle() {
        let mut draw = Rng::with_seed(5);
        for round in 0..6000 {
            let (posts, units) = (8, [1, 2, 7, 3200][round % 4]);
            let far = |on: bool| on.then_some(posts);
            let (far_row, far_col) = (far(round % 3 == 0), far(round % 5 == 0));
            let grid = PostGrid { origin: Post::new(0, 0), units_per_post: units, far_row, far_col };
            // A third of the coordinates fall on posts, so edges and corners on posts are common.
            let mut place = || match draw.u8(..3) {
                0 => draw.i32(0..=posts) * units,
                _ => draw.i32(0..=posts * units),
            };
            let (mut x, mut y) = ([0; 3].map(|_| place()), [0; 3].map(|_| place()));
            if Facet::new(x, y, [0; 3]).den < 0 {
                x.swap(1, 2);
                y.swap(1, 2);
            }
            let facet = Facet::new(x, y, [0; 3]);
            if 0 < facet.den {
                check(&grid, posts, &facet);
            }
        }
    }

    #[test]
    fn a_division_is_exact_at_every_half() {
        for den in [1, 2, 3, 12_799, 20_480_000, (1 << 33) - 1, 1 << 33] {
            let division = Division::by(den);
            for quotient in [0, 1, 2, 1000, (1 << 25) - 1] {
                for near in -2..=2 {
                    let numerator: i64 = quotient * den + den / 2 + near;
                    let expected = numerator.signum() * ((2 * numerator.abs() + den) / (2 * den));
                    assert_eq!(i64::from(division.rounded(numerator)), expected, "{numerator} / {den}");
                    assert_eq!(i64::from(division.rounded(-numerator)), -expected, "-{numerator} / {den}");
                }
            }
        }
    }

    #[test]
    fn residuals_are_those_of_a_wide_division() {
        let mut draw = Rng::with_seed(9);
        let rect = PostRect::new(Post::new(30, 70), Post::new(50, 90));
        let dem = Dem::from_fn(rect, |_| Some(draw.i32(-200_000..200_000)));
        for round in 0..400 {
            let units = [1, 25, 3200][round % 3];
            let mut place = || draw.i32(0..=20 * units);
            let (x, y) = ([0; 3].map(|_| place()), [0; 3].map(|_| place()));
            let z = [0; 3].map(|_| draw.i32(-200_000..200_000));
            let facet = Facet::new(x, y, z);
            if facet.den <= 0 {
                continue;
            }
            let grid = PostGrid { origin: rect.south_west(), units_per_post: units, far_row: None, far_col: None };
            visit_residuals(&grid, &facet, &dem, |post, residual| {
                let (east, north) = ((post.col - 70) * units - x[0], (post.row - 30) * units - y[0]);
                let plane = facet.px as i128 * i128::from(east) + facet.py as i128 * i128::from(north);
                let den = i128::from(facet.den);
                let numerator = i128::from(dem.height(post) - z[0]) * den - plane;
                let expected = numerator.signum() * ((2 * numerator.abs() + den) / (2 * den));
                assert_eq!(i128::from(residual), expected);
            });
        }
    }
}
