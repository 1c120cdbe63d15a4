//! Sum of squared rounded residuals over the posts a triangle owns.
//!
//! Rounding without a division per post, exactly: `floor(|n| * (1/den) + 1/2 + 2^-27)` in f64. A tie lies
//! 2^-27 above the boundary and the rounding error of the product is below 2^-30 for residuals below 2^20
//! quanta; the next value below a tie is at least 1/(2 den) > 2^-24 away for den < 2^23. Sums of squares
//! then stay whole numbers below 2^53 per lane for every triangle that small.

use fearless_simd::{Simd, f64x8, i32x16, prelude::*};

use super::{IOTA, rounded, visit::OwnedSpans};
use crate::{Facet, Surface};

/// Largest `den` for which the reciprocal rounds exactly.
const RECIPROCAL_LIMIT: i64 = 1 << 23;
/// Largest relief, in quanta, for which residuals stay below 2^20.
const RELIEF_LIMIT: i64 = 1 << 20;

/// Sum of squared residuals (quanta squared, each residual rounded) over the candidate posts the triangle
/// owns. A whole number, the same at every instruction level.
#[inline(always)]
pub fn squares_sum<S: Simd>(simd: S, surface: &Surface, facet: &Facet) -> f64 {
    if RECIPROCAL_LIMIT <= facet.den || RELIEF_LIMIT <= surface.relief() {
        return squares_sum_by_division(surface, facet);
    }
    let (iota_low, iota_high) = simd.cvt_f32_i32x16(i32x16::from_slice(simd, &IOTA)).widen();
    let rounding = Rounding::new(simd, facet.den);
    let (px, zero) = (f64x8::splat(simd, facet.px as f64), f64x8::splat(simd, 0.0));
    let (east_low, east_high) = (iota_low * px, iota_high * px);
    let stride_lanes = f64x8::splat(simd, facet.px as f64 * 16.0);
    let origin = facet.origin();
    let (mut sum_low, mut sum_high) = (zero, zero);
    let (heights, stride) = surface.rows();
    let mut spans = OwnedSpans::new(surface, facet);
    while let Some((row, mut left, right)) = spans.next() {
        let first = (origin + facet.py * i64::from(row) + facet.px * i64::from(left)) as f64;
        let first = f64x8::splat(simd, first);
        let (mut plane_low, mut plane_high) = (first + east_low, first + east_high);
        while left <= right {
            let index = row as usize * stride + left as usize;
            let (low, high) = simd.cvt_f32_i32x16(i32x16::from_slice(simd, &heights[index..index + 16])).widen();
            let mut low = rounding.residuals(simd, low, plane_low);
            if right - left < 8 {
                let end = f64x8::splat(simd, f64::from(right - left + 1));
                low = iota_low.simd_lt(end).select(low, zero);
                sum_low = sum_low + low * low;
                break;
            }
            let mut high = rounding.residuals(simd, high, plane_high);
            if right - left < 15 {
                let end = f64x8::splat(simd, f64::from(right - left + 1));
                high = iota_high.simd_lt(end).select(high, zero);
            }
            (sum_low, sum_high) = (sum_low + low * low, sum_high + high * high);
            (plane_low, plane_high) = (plane_low + stride_lanes, plane_high + stride_lanes);
            left += 16;
        }
    }
    simd.reduce_sum_f64x8(sum_low + sum_high)
}

/// Rounding by reciprocal, as the header proves.
struct Rounding<S: Simd> {
    den: f64x8<S>,
    reciprocal: f64x8<S>,
    half: f64x8<S>,
}

impl<S: Simd> Rounding<S> {
    #[inline(always)]
    fn new(simd: S, den: i64) -> Self {
        Self {
            den: f64x8::splat(simd, den as f64),
            reciprocal: f64x8::splat(simd, 1.0 / den as f64),
            half: f64x8::splat(simd, 0.5 + 1.0 / f64::from(1 << 27)),
        }
    }

    /// Rounded absolute residuals of eight heights above eight plane numerators.
    #[inline(always)]
    fn residuals(&self, simd: S, heights: f64x8<S>, plane: f64x8<S>) -> f64x8<S> {
        (simd.abs_f64x8(heights * self.den - plane) * self.reciprocal + self.half).floor()
    }
}

/// The same sum by one division per post, for triangles beyond the reciprocal's proof.
fn squares_sum_by_division(surface: &Surface, facet: &Facet) -> f64 {
    let mut sum = 0u128;
    super::visit_owned(surface, facet, |_, numerator| {
        let residual = u128::from(rounded(numerator, facet.den as u64));
        sum += residual * residual;
    });
    sum as f64
}
