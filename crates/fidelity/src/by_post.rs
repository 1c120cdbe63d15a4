//! Values at the posts of a rectangle, written triangle by triangle and eight posts at a time.

use std::ops::Range;

use fearless_simd::{Simd, f64x8, mask64x8, prelude::*};

/// Posts that are written together.
const LANES: usize = 8;
const IOTA: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// One value a post, by rows from the south-west post on; NaN where none was written.
pub(crate) struct ByPost {
    values: Vec<f64>,
    wide: usize,
}

impl ByPost {
    pub fn new(high: usize, wide: usize) -> Self {
        // The last row may be written beyond its end.
        Self { values: vec![f64::NAN; high * wide + LANES], wide }
    }

    /// The values, row by row.
    pub fn values(&self) -> &[f64] {
        &self.values[..self.values.len() - LANES]
    }

    pub fn set(&mut self, row: usize, col: usize, value: f64) {
        self.values[row * self.wide + col] = value;
    }

    /// Writes to the posts of some rows and columns. For a row, the first of eight columns and the eight as numbers,
    /// `value` tells which of them to write, none outside of the rectangle, and what.
    #[inline(always)]
    pub fn write<S: Simd>(
        &mut self,
        simd: S,
        (rows, cols): (Range<usize>, Range<usize>),
        mut value: impl FnMut(usize, usize, f64x8<S>) -> (mask64x8<S>, f64x8<S>),
    ) {
        let first = f64x8::from_slice(simd, &IOTA);
        for row in rows {
            for col in cols.clone().step_by(LANES) {
                let (is_inside, new) = value(row, col, first + f64x8::splat(simd, col as f64));
                let held = &mut self.values[row * self.wide + col..][..LANES];
                is_inside.select(new, f64x8::from_slice(simd, held)).store_slice(held);
            }
        }
    }
}
