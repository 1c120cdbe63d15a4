//! Sum of squared rounded residuals over the posts a triangle owns.
//!
//! Rounding without a division per post, exactly: `floor(|n| * (1/den) + 1/2 + 2^-27)` in f64. A tie lies
//! 2^-27 above the boundary and the rounding error of the product is below 2^-30 for residuals below 2^20
//! quanta; the next value below a tie is at least 1/(2 den) > 2^-24 away for den < 2^23. Sums of squares
//! then stay whole numbers below 2^53 per lane for every triangle that small.

use fearless_simd::{Simd, f64x8, i32x16, prelude::*};

use super::{IOTA, rounded, visit::owned_spans};
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
    let splat = |value: f64| f64x8::splat(simd, value);
    let (iota_low, iota_high) = simd.cvt_f32_i32x16(i32x16::from_slice(simd, &IOTA)).widen();
    let (px, den, zero) = (splat(facet.px as f64), splat(facet.den as f64), splat(0.0));
    let (reciprocal, half) = (splat(1.0 / facet.den as f64), splat(0.5 + 1.0 / f64::from(1 << 27)));
    let (east_low, east_high) = (iota_low * px, iota_high * px);
    let stride_lanes = splat(facet.px as f64 * 16.0);
    let origin = facet.origin();
    let (mut sum_low, mut sum_high) = (zero, zero);
    let (heights, stride) = surface.rows();
    for (row, mut left, right) in owned_spans(surface, facet) {
        let first = splat((origin + facet.py * i64::from(row) + facet.px * i64::from(left)) as f64);
        let (mut plane_low, mut plane_high) = (first + east_low, first + east_high);
        while left <= right {
            let index = row as usize * stride + left as usize;
            let (low, high) = simd.cvt_f32_i32x16(i32x16::from_slice(simd, &heights[index..index + 16])).widen();
            let residual =
                |height: f64x8<S>, plane: f64x8<S>| (simd.abs_f64x8(height * den - plane) * reciprocal + half).floor();
            let (mut low, mut high) = (residual(low, plane_low), residual(high, plane_high));
            if right - left < 15 {
                let end = splat(f64::from(right - left + 1));
                low = iota_low.simd_lt(end).select(low, zero);
                high = iota_high.simd_lt(end).select(high, zero);
            }
            (sum_low, sum_high) = (sum_low + low * low, sum_high + high * high);
            (plane_low, plane_high) = (plane_low + stride_lanes, plane_high + stride_lanes);
            left += 16;
        }
    }
    simd.reduce_sum_f64x8(sum_low + sum_high)
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
