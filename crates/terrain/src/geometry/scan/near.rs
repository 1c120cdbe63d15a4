//! Wider triangles whose numerators fit 32 bits: spans of 16 lanes, the tail masked.

use std::ops::ControlFlow;

use fearless_simd::{Simd, i32x16, prelude::*};

use super::visit::CandidateSpans;
use crate::geometry::lanes::IOTA;
use crate::geometry::{Facet, LocalPost, Surface};

/// Plane numerators of a row, 16 posts at a time.
struct Lanes<S: Simd> {
    iota: i32x16<S>,
    den: i32x16<S>,
    east: i32x16<S>,
    stride: i32x16<S>,
    origin: i32,
    px: i32,
    py: i32,
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    fn new(simd: S, facet: &Facet) -> Self {
        let iota = i32x16::from_slice(simd, &IOTA);
        let (px, py) = (facet.px as i32, facet.py as i32);
        Self {
            iota,
            den: i32x16::splat(simd, facet.den as i32),
            east: iota * i32x16::splat(simd, px),
            stride: i32x16::splat(simd, px.wrapping_mul(16)),
            origin: facet.origin() as i32,
            px,
            py,
        }
    }

    /// Plane numerators at the 16 posts from (row, col).
    #[inline(always)]
    fn plane(&self, simd: S, row: i32, col: i32) -> i32x16<S> {
        let first = self.origin.wrapping_add(self.py.wrapping_mul(row)).wrapping_add(self.px.wrapping_mul(col));
        self.east + i32x16::splat(simd, first)
    }
}

/// Largest `|n|` over the candidate posts of the closed triangle.
#[inline(always)]
pub fn largest<S: Simd>(simd: S, surface: &Surface, facet: &Facet) -> u64 {
    let lanes = Lanes::new(simd, facet);
    let zero = i32x16::splat(simd, 0);
    let mut largest = zero;
    let (heights, stride) = surface.rows();
    for (row, left, right) in CandidateSpans::new(surface, facet) {
        let mut remaining = right - left + 1;
        let mut index = row as usize * stride + left as usize;
        let mut plane = lanes.plane(simd, row, left);
        while 0 < remaining {
            let height = i32x16::from_slice(simd, &heights[index..index + 16]);
            let numerator = simd.abs_i32x16(height * lanes.den - plane);
            let inside = lanes.iota.simd_lt(i32x16::splat(simd, remaining));
            largest = largest.max(inside.select(numerator, zero));
            plane += lanes.stride;
            index += 16;
            remaining -= 16;
        }
    }
    u64::from(largest.reduce_max() as u32)
}

/// Calls `visit` for the candidate posts whose `|n|` is at least `threshold`, row by row, until it breaks.
#[inline(always)]
pub fn reached<S: Simd>(
    simd: S,
    surface: &Surface,
    facet: &Facet,
    threshold: u64,
    mut visit: impl FnMut(LocalPost) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let Ok(threshold) = i32::try_from(threshold) else { return ControlFlow::Continue(()) };
    let threshold = i32x16::splat(simd, threshold);
    let lanes = Lanes::new(simd, facet);
    let (heights, stride) = surface.rows();
    for (row, left, right) in CandidateSpans::new(surface, facet) {
        let mut col = left;
        let mut plane = lanes.plane(simd, row, left);
        while col <= right {
            let index = row as usize * stride + col as usize;
            let height = i32x16::from_slice(simd, &heights[index..index + 16]);
            let reached = simd.abs_i32x16(height * lanes.den - plane).simd_ge(threshold);
            let inside = lanes.iota.simd_lt(i32x16::splat(simd, right - col + 1));
            let mut hits = (reached & inside).to_bitmask();
            while hits != 0 {
                visit(LocalPost::new(row, col + hits.trailing_zeros() as i32))?;
                hits &= hits - 1;
            }
            plane += lanes.stride;
            col += 16;
        }
    }
    ControlFlow::Continue(())
}
