//! Triangles under 8 or 16 columns wide (three quarters of all scans): one lane load per row, no spans,
//! no branches. The numerator and the three edge functions advance by one addition per row.

use fearless_simd::{Simd, i32x8, i32x16, prelude::*};

use super::lanes::IOTA;
use crate::{Facet, Surface};

macro_rules! largest_in_box {
    ($name:ident, $lanes:ident, $wide:expr) => {
        /// Largest `|n|` over the posts of a triangle whose bounding box fits the lanes.
        #[inline(always)]
        pub fn $name<S: Simd>(simd: S, surface: &Surface, facet: &Facet, x0: i32, y0: i32, y1: i32) -> u64 {
            let iota = $lanes::from_slice(simd, &IOTA[..$wide]);
            let (den, px, py) = (facet.den as i32, facet.px as i32, facet.py as i32);
            let start = facet.z[0]
                .wrapping_mul(den)
                .wrapping_add(px.wrapping_mul(x0 - facet.x[0]))
                .wrapping_add(py.wrapping_mul(y0 - facet.y[0]));
            // den < 2^31 bounds the edge functions over a box this narrow, so they do not wrap.
            let (first0, dx0, dy0) = edge(facet, 0, 1, x0, y0);
            let (first1, dx1, dy1) = edge(facet, 1, 2, x0, y0);
            let (first2, dx2, dy2) = edge(facet, 2, 0, x0, y0);
            let mut w0 = $lanes::splat(simd, first0) - iota * $lanes::splat(simd, dy0);
            let mut w1 = $lanes::splat(simd, first1) - iota * $lanes::splat(simd, dy1);
            let mut w2 = $lanes::splat(simd, first2) - iota * $lanes::splat(simd, dy2);
            let (step0, step1, step2) = ($lanes::splat(simd, dx0), $lanes::splat(simd, dx1), $lanes::splat(simd, dx2));
            let (den, step) = ($lanes::splat(simd, den), $lanes::splat(simd, py));
            let mut plane = iota * $lanes::splat(simd, px) + $lanes::splat(simd, start);
            let zero = $lanes::splat(simd, 0);
            let mut largest = zero;
            let (heights, stride) = surface.rows();
            let first = y0 as usize * stride + x0 as usize;
            let rows = &heights[first..][..(y1 - y0) as usize * stride + $wide];
            for row in rows.chunks(stride) {
                let numerator = ($lanes::from_slice(simd, &row[..$wide]) * den - plane).abs_lanes(simd);
                let inside = (w0 | w1 | w2).simd_ge(zero);
                largest = largest.max(inside.select(numerator, zero));
                plane += step;
                (w0, w1, w2) = (w0 + step0, w1 + step1, w2 + step2);
            }
            u64::from(largest.reduce_max() as u32)
        }
    };
}

/// Start and steps (north, east) of the function of edge `i`, `j` at (x0, y0).
#[inline(always)]
fn edge(facet: &Facet, i: usize, j: usize, x0: i32, y0: i32) -> (i32, i32, i32) {
    let (dx, dy) = (facet.x[j] - facet.x[i], facet.y[j] - facet.y[i]);
    (dx * (y0 - facet.y[i]) - dy * (x0 - facet.x[i]), dx, dy)
}

/// Absolute values by lane; one instruction where the processor has it.
trait AbsLanes<S: Simd> {
    fn abs_lanes(self, simd: S) -> Self;
}

impl<S: Simd> AbsLanes<S> for i32x8<S> {
    #[inline(always)]
    fn abs_lanes(self, simd: S) -> Self {
        simd.abs_i32x8(self)
    }
}

impl<S: Simd> AbsLanes<S> for i32x16<S> {
    #[inline(always)]
    fn abs_lanes(self, simd: S) -> Self {
        simd.abs_i32x16(self)
    }
}

largest_in_box!(largest_8, i32x8, 8);
largest_in_box!(largest_16, i32x16, 16);
