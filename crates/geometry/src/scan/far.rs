//! Triangles whose numerators need more than 32 bits (a few hundred at the start of a run): f64 lanes that
//! hold integers below 2^53, which is exact for tiles of at most 16,384 posts a side.
//!
//! Heights have at most 24 bits, so going over f32 to f64 loses nothing.

use std::ops::ControlFlow;

use fearless_simd::{Simd, f64x8, i32x16, prelude::*};

use super::lanes::IOTA;
use crate::{Facet, LocalPost, Spans, Surface};

/// Looks at `|n|` of 16 posts at a time. A trait rather than a closure: closures that several callers
/// share are compiled on their own, without the lanes of the processor.
trait Look<S: Simd> {
    /// The 16 posts from (row, col), as two halves; 0 beyond the span.
    fn look(&mut self, row: i32, col: i32, low: f64x8<S>, high: f64x8<S>) -> ControlFlow<()>;
}

/// Shows the candidate posts of a closed triangle to `look`, row by row, until it breaks.
#[inline(always)]
fn walk<S: Simd>(simd: S, surface: &Surface, facet: &Facet, look: &mut impl Look<S>) -> ControlFlow<()> {
    let (iota_low, iota_high) = simd.cvt_f32_i32x16(i32x16::from_slice(simd, &IOTA)).widen();
    let px = f64x8::splat(simd, facet.px as f64);
    let (den, zero) = (f64x8::splat(simd, facet.den as f64), f64x8::splat(simd, 0.0));
    let (east_low, east_high) = (iota_low * px, iota_high * px);
    let stride_lanes = f64x8::splat(simd, facet.px as f64 * 16.0);
    let origin = facet.origin();
    let (heights, stride) = surface.rows();
    let candidates = surface.candidates();
    for span in Spans::new(facet) {
        if span.row < candidates.south || candidates.north < span.row {
            continue;
        }
        let (mut left, right) = (span.left.max(candidates.west), span.right.min(candidates.east));
        let first = (origin + facet.py * i64::from(span.row) + facet.px * i64::from(left)) as f64;
        let first = f64x8::splat(simd, first);
        let (mut plane_low, mut plane_high) = (first + east_low, first + east_high);
        while left <= right {
            let index = span.row as usize * stride + left as usize;
            let height = i32x16::from_slice(simd, &heights[index..index + 16]);
            let (low, high) = simd.cvt_f32_i32x16(height).widen();
            let (mut low, mut high) = (simd.abs_f64x8(low * den - plane_low), simd.abs_f64x8(high * den - plane_high));
            if right - left < 15 {
                let end = f64x8::splat(simd, f64::from(right - left + 1));
                low = iota_low.simd_lt(end).select(low, zero);
                high = iota_high.simd_lt(end).select(high, zero);
            }
            look.look(span.row, left, low, high)?;
            (plane_low, plane_high) = (plane_low + stride_lanes, plane_high + stride_lanes);
            left += 16;
        }
    }
    ControlFlow::Continue(())
}

struct Largest<S: Simd>(f64x8<S>);

impl<S: Simd> Look<S> for Largest<S> {
    #[inline(always)]
    fn look(&mut self, _row: i32, _col: i32, low: f64x8<S>, high: f64x8<S>) -> ControlFlow<()> {
        self.0 = self.0.max(low).max(high);
        ControlFlow::Continue(())
    }
}

/// Largest `|n|` over the candidate posts of the closed triangle.
#[inline(always)]
pub fn largest<S: Simd>(simd: S, surface: &Surface, facet: &Facet) -> u64 {
    let mut largest = Largest(f64x8::splat(simd, 0.0));
    let _ = walk(simd, surface, facet, &mut largest);
    simd.reduce_max_f64x8(largest.0) as u64
}

struct Reached<S: Simd, V> {
    threshold: f64x8<S>,
    visit: V,
}

impl<S: Simd, V: FnMut(LocalPost) -> ControlFlow<()>> Look<S> for Reached<S, V> {
    #[inline(always)]
    fn look(&mut self, row: i32, col: i32, low: f64x8<S>, high: f64x8<S>) -> ControlFlow<()> {
        let mut hits = low.simd_ge(self.threshold).to_bitmask() | high.simd_ge(self.threshold).to_bitmask() << 8;
        while hits != 0 {
            (self.visit)(LocalPost::new(row, col + hits.trailing_zeros() as i32))?;
            hits &= hits - 1;
        }
        ControlFlow::Continue(())
    }
}

/// Calls `visit` for the candidate posts whose `|n|` is at least `threshold`, row by row, until it breaks.
#[inline(always)]
pub fn reached<S: Simd>(
    simd: S,
    surface: &Surface,
    facet: &Facet,
    threshold: u64,
    visit: impl FnMut(LocalPost) -> ControlFlow<()>,
) -> ControlFlow<()> {
    walk(simd, surface, facet, &mut Reached { threshold: f64x8::splat(simd, threshold as f64), visit })
}
