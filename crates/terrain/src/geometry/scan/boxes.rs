//! Triangles under 8 or 16 columns wide (three quarters of all scans), or twice in halves of 16: one lane load per
//! row, no spans, no branches. The numerator and the three edge functions advance by one addition per row.

use fearless_simd::{Simd, i32x8, i32x16, prelude::*};

use crate::geometry::lanes::IOTA;
use crate::geometry::{Facet, LocalPost, Surface};

macro_rules! box_of_lanes {
    ($box:ident, $largest:ident, $first:ident, $lanes:ident, $wide:expr) => {
        /// The part of a triangle in as many columns as there are lanes, at one of its rows.
        struct $box<S: Simd> {
            den: $lanes<S>,
            plane: $lanes<S>,
            north: $lanes<S>,
            edges: [$lanes<S>; 3],
            north_edges: [$lanes<S>; 3],
            zero: $lanes<S>,
        }

        impl<S: Simd> $box<S> {
            /// At row `y0`, from column `x0` on.
            #[inline(always)]
            fn new(simd: S, facet: &Facet, x0: i32, y0: i32) -> Self {
                let iota = $lanes::from_slice(simd, &IOTA[..$wide]);
                let (den, px, py) = (facet.den as i32, facet.px as i32, facet.py as i32);
                let start = facet.z[0]
                    .wrapping_mul(den)
                    .wrapping_add(px.wrapping_mul(x0 - facet.x[0]))
                    .wrapping_add(py.wrapping_mul(y0 - facet.y[0]));
                // den < 2^31 bounds the edge functions over a box this narrow, so they do not wrap.
                let [first0, first1, first2] = [0, 1, 2].map(|edge| facet.edge_at(edge, x0, y0) as i32);
                let [(dx0, dy0), (dx1, dy1), (dx2, dy2)] = [0, 1, 2].map(|edge| facet.edge(edge));
                Self {
                    den: $lanes::splat(simd, den),
                    plane: iota * $lanes::splat(simd, px) + $lanes::splat(simd, start),
                    north: $lanes::splat(simd, py),
                    edges: [
                        $lanes::splat(simd, first0) - iota * $lanes::splat(simd, dy0),
                        $lanes::splat(simd, first1) - iota * $lanes::splat(simd, dy1),
                        $lanes::splat(simd, first2) - iota * $lanes::splat(simd, dy2),
                    ],
                    north_edges: [$lanes::splat(simd, dx0), $lanes::splat(simd, dx1), $lanes::splat(simd, dx2)],
                    zero: $lanes::splat(simd, 0),
                }
            }

            /// `|n|` at the posts of its row, 0 at those outside of the triangle; goes on to the next row.
            #[inline(always)]
            fn next_row(&mut self, simd: S, heights: &[i32]) -> $lanes<S> {
                let numerator = ($lanes::from_slice(simd, &heights[..$wide]) * self.den - self.plane).abs_lanes(simd);
                let ([a, b, c], [north_a, north_b, north_c]) = (self.edges, self.north_edges);
                let inside = (a | b | c).simd_ge(self.zero);
                self.plane += self.north;
                self.edges = [a + north_a, b + north_b, c + north_c];
                inside.select(numerator, self.zero)
            }
        }

        /// Largest `|n|` over the posts of a triangle in as many columns as there are lanes, from `x0` on.
        #[inline(always)]
        pub fn $largest<S: Simd>(simd: S, surface: &Surface, facet: &Facet, x0: i32, y0: i32, y1: i32) -> u64 {
            let mut lanes = $box::new(simd, facet, x0, y0);
            let mut largest = lanes.zero;
            let (heights, stride) = surface.rows();
            let first = y0 as usize * stride + x0 as usize;
            for row in heights[first..][..(y1 - y0) as usize * stride + $wide].chunks(stride) {
                largest = largest.max(lanes.next_row(simd, row));
            }
            u64::from(largest.reduce_max() as u32)
        }

        /// The first post of a triangle as narrow, row by row, whose `|n|` is at least `threshold`.
        #[inline(always)]
        pub fn $first<S: Simd>(simd: S, surface: &Surface, facet: &Facet, threshold: i32) -> Option<LocalPost> {
            let (x0, _, y0, y1) = facet.bounds();
            let mut lanes = $box::new(simd, facet, x0, y0);
            let threshold = $lanes::splat(simd, threshold);
            let (heights, stride) = surface.rows();
            let first = y0 as usize * stride + x0 as usize;
            let rows = heights[first..][..(y1 - y0) as usize * stride + $wide].chunks(stride);
            for (y, row) in (y0..).zip(rows) {
                let hits = lanes.next_row(simd, row).simd_ge(threshold).to_bitmask();
                if hits != 0 {
                    return Some(LocalPost::new(y, x0 + hits.trailing_zeros() as i32));
                }
            }
            None
        }
    };
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

box_of_lanes!(Box8, largest_8, first_8, i32x8, 8);
box_of_lanes!(Box16, largest_16, first_16, i32x16, 16);
