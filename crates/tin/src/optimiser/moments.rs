//! Moments of the posts under triangles, summed along edges.
//!
//! The posts a triangle owns lie, row by row, between two of its edges. So every sum over them is a signed sum
//! over its edges of "everything west of the edge", and that of one edge is a walk over the rows it crosses in a
//! table of prefix sums: no post is read, and an edge walked once serves both triangles beside it.

use std::ops::{Add, Neg, Sub};

use fearless_simd::{Simd, f64x4, prelude::*};
use terrain::{Dem, Importance};

use crate::optimiser::place::{PER_POST, Place};

/// Numbers in [`Sums`].
pub(crate) const SUMS: usize = 10;

/// Sums over posts: of weights and of weighted heights, each with the powers of x and y that a plane's fit needs.
///
/// Positions are posts from the tile's south-west post, heights are quanta from [`Moments::level`]. Where weights
/// are whole numbers, so are all sums, and they are exact: adding in another order changes no bit.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Sums {
    /// Of z, 1, x z, z z.
    heights: [f64; 4],
    /// Of x, x x, x y, y y.
    shape: [f64; 4],
    /// Of y z, y.
    rest: [f64; 2],
}

impl Sums {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut sums = self;
        for i in 0..4 {
            sums.heights[i] = f(self.heights[i], other.heights[i]);
            sums.shape[i] = f(self.shape[i], other.shape[i]);
        }
        for i in 0..2 {
            sums.rest[i] = f(self.rest[i], other.rest[i]);
        }
        sums
    }

    /// z, 1, x z, z z, x, x x, x y, y y, y z, y.
    #[inline(always)]
    pub fn all(&self) -> [f64; SUMS] {
        let ([a, b, c, d], [e, f, g, h], [i, j]) = (self.heights, self.shape, self.rest);
        [a, b, c, d, e, f, g, h, i, j]
    }

    /// The sums of which these are [`Sums::all`].
    #[inline(always)]
    pub fn of(all: [f64; SUMS]) -> Self {
        let [a, b, c, d, e, f, g, h, i, j] = all;
        Self { heights: [a, b, c, d], shape: [e, f, g, h], rest: [i, j] }
    }

    /// The same sums with positions counted from `(x, y)`.
    #[inline(always)]
    pub fn about(&self, x: f64, y: f64) -> Local {
        let [z, n, xz, zz] = self.heights;
        let [sx, sxx, sxy, syy] = self.shape;
        let [yz, sy] = self.rest;
        let (dx, dy) = (sx - x * n, sy - y * n);
        Local {
            n,
            x: dx,
            y: dy,
            xx: sxx - x * (sx + dx),
            xy: sxy - x * sy - y * dx,
            yy: syy - y * (sy + dy),
            z,
            xz: xz - x * z,
            yz: yz - y * z,
            zz,
        }
    }
}

impl Add for Sums {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl Sub for Sums {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Neg for Sums {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::default() - self
    }
}

#[cfg(test)]
impl Sums {
    /// Sum of weights.
    pub fn weight(&self) -> f64 {
        self.heights[1]
    }
}

#[cfg(test)]
impl Moments {
    /// Sums over the posts that a counter-clockwise triangle owns.
    pub fn triangle(&self, [a, b, c]: [Place; 3]) -> Sums {
        self.edge(a, b) + self.edge(b, c) + self.edge(c, a)
    }
}

/// Sums about a place of one's own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Local {
    pub n: f64,
    pub x: f64,
    pub y: f64,
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
    pub z: f64,
    pub xz: f64,
    pub yz: f64,
    pub zz: f64,
}

/// Prefix sums of a tile along its rows.
pub(crate) struct Moments {
    /// Posts in a row, and one more: an entry holds the sums over all posts west of it.
    stride: usize,
    /// Of z, 1, x z, z z.
    heights: Vec<[f64; 4]>,
    /// Of x, x x, x, 1: the powers of x that are still to be multiplied by powers of y.
    shape: Vec<[f64; 4]>,
    /// Entries of `shape` from row to row; 0 where all rows are alike.
    shape_stride: usize,
    /// Quanta of height that count as zero, so that sums stay small.
    level: f64,
    far_x: i32,
    far_y: i32,
}

impl Moments {
    /// What one post counts.
    pub fn weight_at(&self, row: i32, col: i32) -> f64 {
        let at = row as usize * self.stride + col as usize;
        self.heights[at + 1][1] - self.heights[at][1]
    }

    /// The sums of a window; a post counts with the square of its weight, as a part of the largest there.
    pub fn new(dem: &Dem, importance: &Importance) -> Self {
        let rect = dem.rect();
        let (wide, high) = (rect.posts_wide(), rect.posts_high());
        let level = mean_height(dem);
        let shares = Shares::new(importance);
        let uniform = importance.uniform_weight().map(|weight| shares.of(weight));
        let mut moments = Self {
            stride: wide + 1,
            heights: Vec::with_capacity((wide + 1) * high),
            shape: Vec::new(),
            shape_stride: if uniform.is_some() { 0 } else { wide + 1 },
            level: f64::from(level),
            far_x: (wide as i32 - 1) * PER_POST,
            far_y: (high as i32 - 1) * PER_POST,
        };
        for row in rect.south..=rect.north {
            let heights = dem.row(row).iter().map(|&height| f64::from(height - level));
            let weights = importance.weights_of_row(row).unwrap_or(&[]);
            let weight = |col: usize| uniform.unwrap_or_else(|| shares.of(weights[col]));
            moments.push_row(heights, weight, row == rect.south);
        }
        moments
    }

    fn push_row(&mut self, heights: impl Iterator<Item = f64>, weight: impl Fn(usize) -> f64, is_first: bool) {
        let keeps_shape = is_first || self.shape_stride != 0;
        let (mut sums, mut shape) = ([0.0; 4], [0.0; 4]);
        self.heights.push(sums);
        if keeps_shape {
            self.shape.push(shape);
        }
        for (col, z) in heights.enumerate() {
            let (w, x) = (weight(col), col as f64);
            // Heights of posts without weight are not even read: a void's means nothing.
            let z = if w == 0.0 { 0.0 } else { z };
            sums = [sums[0] + w * z, sums[1] + w, sums[2] + w * x * z, sums[3] + w * z * z];
            self.heights.push(sums);
            if keeps_shape {
                shape = [shape[0] + w * x, shape[1] + w * x * x, shape[0] + w * x, shape[3] + w];
                self.shape.push(shape);
            }
        }
    }

    /// Quanta of height that count as zero.
    pub fn level(&self) -> f64 {
        self.level
    }

    /// Sums over the posts west of the edge from `a` to `b`, in the rows it crosses; negative when it runs south.
    ///
    /// A post on the edge lies east of it, and a row through its northern end is not crossed; but the tile's far
    /// column and row belong to the triangles there.
    #[inline(always)]
    pub fn edge(&self, a: Place, b: Place) -> Sums {
        if a.y < b.y {
            self.northward(a, b)
        } else if b.y < a.y {
            -self.northward(b, a)
        } else if a.y == self.far_y {
            self.along_far_row(a, b)
        } else {
            Sums::default()
        }
    }

    /// As [`Moments::edge`], in lanes.
    #[inline(always)]
    pub fn edge_in<S: Simd>(&self, simd: S, a: Place, b: Place) -> Sums {
        if a.y < b.y {
            self.northward_in(simd, a, b)
        } else if b.y < a.y {
            -self.northward_in(simd, b, a)
        } else {
            self.edge(a, b)
        }
    }

    #[inline(always)]
    fn northward_in<S: Simd>(&self, simd: S, low: Place, high: Place) -> Sums {
        let (first, end) = (low.row_from(), high.row_from());
        if end <= first {
            return Sums::default();
        }
        let mut walk = Walk::new(low, high, first);
        let far = if low.x == self.far_x && high.x == self.far_x { 1 } else { 0 };
        let zero = f64x4::splat(simd, 0.0);
        let (mut heights, mut shape, mut rest) = (zero, zero, zero);
        for row in first..end {
            let at = walk.next_column() + far;
            let y = f64::from(row);
            let post = f64x4::from_slice(simd, &self.heights[row as usize * self.stride + at]);
            let powers = f64x4::from_slice(simd, &[1.0, 1.0, y, y * y]);
            heights += post;
            shape += f64x4::from_slice(simd, &self.shape[row as usize * self.shape_stride + at]) * powers;
            rest += post * f64x4::splat(simd, y);
        }
        let mut sums = Sums::default();
        heights.store_slice(&mut sums.heights);
        shape.store_slice(&mut sums.shape);
        let mut all = [0.0; 4];
        rest.store_slice(&mut all);
        sums.rest = [all[0], all[1]];
        sums
    }

    #[inline(always)]
    fn northward(&self, low: Place, high: Place) -> Sums {
        let (first, end) = (low.row_from(), high.row_from());
        let mut sums = Sums::default();
        if end <= first {
            return sums;
        }
        let mut walk = Walk::new(low, high, first);
        let far = if low.x == self.far_x && high.x == self.far_x { 1 } else { 0 };
        for row in first..end {
            let at = walk.next_column() + far;
            let y = f64::from(row);
            let heights = &self.heights[row as usize * self.stride + at];
            let shape = &self.shape[row as usize * self.shape_stride + at];
            for (sum, &height) in sums.heights.iter_mut().zip(heights) {
                *sum += height;
            }
            let powers = [1.0, 1.0, y, y * y];
            for i in 0..4 {
                sums.shape[i] += shape[i] * powers[i];
            }
            for (sum, &height) in sums.rest.iter_mut().zip(heights) {
                *sum += height * y;
            }
        }
        sums
    }

    /// Sums over the posts of the far row that an edge along it, running west, lies over.
    fn along_far_row(&self, a: Place, b: Place) -> Sums {
        if a.x < b.x {
            return -self.along_far_row(b, a);
        }
        let column = |x: i32| ((x + PER_POST - 1) / PER_POST + i32::from(x == self.far_x)) as usize;
        let row = (self.far_y / PER_POST) as usize;
        let y = row as f64;
        let west_of = |x: i32| {
            let at = column(x);
            let heights = self.heights[row * self.stride + at];
            let [x, xx, xy, yy] = self.shape[row * self.shape_stride + at];
            Sums { heights, shape: [x, xx, y * xy, y * y * yy], rest: [y * heights[0], y * heights[1]] }
        };
        west_of(a.x) - west_of(b.x)
    }
}

/// Where an edge crosses one row after another, in posts with 32 binary places.
///
/// Rounded, but from the edge's own ends, so both triangles beside it see the same crossing; a rounding can
/// therefore hand a post from one to the other but never lose it.
pub(crate) struct Walk {
    at: i64,
    step: i64,
}

impl Walk {
    /// The walk along an edge that runs north, from the row `first`.
    #[inline(always)]
    pub fn new(low: Place, high: Place, first: i32) -> Self {
        const ONE: f64 = (1u64 << 32) as f64;
        let step = (f64::from(high.x - low.x) / f64::from(high.y - low.y) * ONE) as i64;
        // A step is below 2^52 and a rise below a post, so the product fits.
        let rise = i64::from(first * PER_POST - low.y);
        let start = i64::from(low.x) * ((1 << 32) / i64::from(PER_POST));
        Self { at: start + step * rise / i64::from(PER_POST), step }
    }

    /// The first post at or east of the crossing, and on to the next row.
    #[inline(always)]
    pub fn next_column(&mut self) -> usize {
        let column = (self.at + 0xffff_ffff) >> 32;
        self.at += self.step;
        column as usize
    }
}

/// Squared weights as parts of the largest in a tile, in steps so coarse that all sums stay exact: a triangle without
/// posts has to come out as exactly nothing, or its corners would be pulled about by rounding errors.
struct Shares {
    largest: f64,
}

impl Shares {
    const STEPS: f64 = 4096.0;

    fn new(importance: &Importance) -> Self {
        let rect = importance.rect();
        let of_rows = (rect.south..=rect.north).filter_map(|row| importance.weights_of_row(row));
        let largest = importance.uniform_weight().or(of_rows.flatten().copied().max()).unwrap_or(1);
        Self { largest: f64::from(largest) }
    }

    /// What a post of this weight counts: at least a step, if it counts at all.
    fn of(&self, weight: u16) -> f64 {
        if weight == 0 {
            return 0.0;
        }
        let share = f64::from(weight) / self.largest;
        (share * share * Self::STEPS).round().max(1.0) / Self::STEPS
    }
}

/// Mean height in whole quanta.
fn mean_height(dem: &Dem) -> i32 {
    let rect = dem.rect();
    let sum: i64 = (rect.south..=rect.north).flat_map(|row| dem.row(row)).map(|&height| i64::from(height)).sum();
    (sum / rect.post_count() as i64) as i32
}
