//! Sum of squared rounded residuals over the posts a triangle owns.
//!
//! Rounding without a division per post, exactly: `floor(|n| * (1/den) + 1/2 + 2^-27)` in f64. A tie lies
//! 2^-27 above the boundary and the rounding error of the product is below 2^-30 for residuals below 2^20
//! quanta; the next value below a tie is at least 1/(2 den) > 2^-24 away for den < 2^23. Sums of squares
//! then stay whole numbers below 2^53 per lane for every triangle that small.

use fearless_simd::{Simd, f64x8, i32x8, i32x16, prelude::*};

use super::visit::{OwnedSpans, visit_owned};
use crate::geometry::lanes::{IOTA, rounded};
use crate::geometry::{Facet, Surface};

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
    let (x0, x1, y0, y1) = facet.bounds();
    let (candidates, extent) = (surface.candidates(), surface.extent());
    // Away from masked sides and from the far borders, whose posts have owners of their own, the edge
    // functions alone tell who owns a post.
    let is_plain = candidates.west <= x0
        && x1 <= candidates.east.min(extent.east - 1)
        && candidates.south <= y0
        && y1 <= candidates.north.min(extent.north - 1);
    if is_plain && x1 - x0 < 8 {
        return squares_in_box_8(simd, surface, facet, x0, y0, y1);
    }
    if is_plain && x1 - x0 < 16 {
        return squares_in_box_16(simd, surface, facet, x0, y0, y1);
    }
    if is_plain && x1 - x0 < 32 {
        let west = squares_in_box_16(simd, surface, facet, x0, y0, y1);
        return west + squares_in_box_16(simd, surface, facet, x0 + 16, y0, y1);
    }
    squares_in_spans(simd, surface, facet)
}

/// The function of an edge at (x0, y0), lowered where the triangle does not own the edge.
#[inline(always)]
fn owned_edge(facet: &Facet, edge: usize, x0: i32, y0: i32) -> i32 {
    facet.edge_at(edge, x0, y0) as i32 - i32::from(!facet.owns_edge(edge))
}

/// A triangle under 8 columns wide: one load per row, no spans.
#[inline(always)]
fn squares_in_box_8<S: Simd>(simd: S, surface: &Surface, facet: &Facet, x0: i32, y0: i32, y1: i32) -> f64 {
    let iota = i32x8::from_slice(simd, &IOTA[..8]);
    let [first0, first1, first2] = [0, 1, 2].map(|edge| owned_edge(facet, edge, x0, y0));
    let [(dx0, dy0), (dx1, dy1), (dx2, dy2)] = [0, 1, 2].map(|edge| facet.edge(edge));
    let mut w0 = i32x8::splat(simd, first0) - iota * i32x8::splat(simd, dy0);
    let mut w1 = i32x8::splat(simd, first1) - iota * i32x8::splat(simd, dy1);
    let mut w2 = i32x8::splat(simd, first2) - iota * i32x8::splat(simd, dy2);
    let (step0, step1, step2) = (i32x8::splat(simd, dx0), i32x8::splat(simd, dx1), i32x8::splat(simd, dx2));
    let (zero, one) = (i32x8::splat(simd, 0), i32x8::splat(simd, 1));
    let rounding = Rounding::new(simd, facet.den);
    let start = facet.origin() + facet.py * i64::from(y0) + facet.px * i64::from(x0);
    let east = widened(simd, iota) * f64x8::splat(simd, facet.px as f64);
    let mut plane = east + f64x8::splat(simd, start as f64);
    let step = f64x8::splat(simd, facet.py as f64);
    let mut sum = f64x8::splat(simd, 0.0);
    let (heights, stride) = surface.rows();
    let first = y0 as usize * stride + x0 as usize;
    let rows = &heights[first..][..(y1 - y0) as usize * stride + 8];
    for row in rows.chunks(stride) {
        let height = widened(simd, i32x8::from_slice(simd, &row[..8]));
        let inside = (w0 | w1 | w2).simd_ge(zero).select(one, zero);
        let residual = rounding.residuals(simd, height, plane) * widened(simd, inside);
        sum += residual * residual;
        plane += step;
        (w0, w1, w2) = (w0 + step0, w1 + step1, w2 + step2);
    }
    simd.reduce_sum_f64x8(sum)
}

/// Largest size of a whole number that `widened` takes.
pub const WIDENED_MAX: i32 = 1 << 24;

/// Eight whole numbers up to `WIDENED_MAX` in size as f64, exactly: each is an `f32` on the way.
#[inline(always)]
pub fn widened<S: Simd>(simd: S, numbers: i32x8<S>) -> f64x8<S> {
    let (low, high) = simd.cvt_f32_i32x8(numbers).widen();
    simd.combine_f64x4(low, high)
}

/// The part of a triangle within 16 columns: one load per row, no spans.
#[inline(always)]
fn squares_in_box_16<S: Simd>(simd: S, surface: &Surface, facet: &Facet, x0: i32, y0: i32, y1: i32) -> f64 {
    let iota = i32x16::from_slice(simd, &IOTA);
    let [first0, first1, first2] = [0, 1, 2].map(|edge| owned_edge(facet, edge, x0, y0));
    let [(dx0, dy0), (dx1, dy1), (dx2, dy2)] = [0, 1, 2].map(|edge| facet.edge(edge));
    let mut w0 = i32x16::splat(simd, first0) - iota * i32x16::splat(simd, dy0);
    let mut w1 = i32x16::splat(simd, first1) - iota * i32x16::splat(simd, dy1);
    let mut w2 = i32x16::splat(simd, first2) - iota * i32x16::splat(simd, dy2);
    let (step0, step1, step2) = (i32x16::splat(simd, dx0), i32x16::splat(simd, dx1), i32x16::splat(simd, dx2));
    let (zero, one) = (i32x16::splat(simd, 0), i32x16::splat(simd, 1));
    let rounding = Rounding::new(simd, facet.den);
    let start = facet.origin() + facet.py * i64::from(y0) + facet.px * i64::from(x0);
    let (start, px) = (f64x8::splat(simd, start as f64), f64x8::splat(simd, facet.px as f64));
    let (east_low, east_high) = simd.cvt_f32_i32x16(iota).widen();
    let (mut plane_low, mut plane_high) = (east_low * px + start, east_high * px + start);
    let step = f64x8::splat(simd, facet.py as f64);
    let (mut sum_low, mut sum_high) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 0.0));
    let (heights, stride) = surface.rows();
    let first = y0 as usize * stride + x0 as usize;
    let rows = &heights[first..][..(y1 - y0) as usize * stride + 16];
    for row in rows.chunks(stride) {
        let (low, high) = simd.cvt_f32_i32x16(i32x16::from_slice(simd, &row[..16])).widen();
        let inside = (w0 | w1 | w2).simd_ge(zero).select(one, zero);
        let (inside_low, inside_high) = simd.cvt_f32_i32x16(inside).widen();
        let low = rounding.residuals(simd, low, plane_low) * inside_low;
        let high = rounding.residuals(simd, high, plane_high) * inside_high;
        (sum_low, sum_high) = (sum_low + low * low, sum_high + high * high);
        (plane_low, plane_high) = (plane_low + step, plane_high + step);
        (w0, w1, w2) = (w0 + step0, w1 + step1, w2 + step2);
    }
    simd.reduce_sum_f64x8(sum_low + sum_high)
}

/// Any triangle, row by row.
#[inline(always)]
fn squares_in_spans<S: Simd>(simd: S, surface: &Surface, facet: &Facet) -> f64 {
    let (iota_low, iota_high) = simd.cvt_f32_i32x16(i32x16::from_slice(simd, &IOTA)).widen();
    let rounding = Rounding::new(simd, facet.den);
    let (px, zero) = (f64x8::splat(simd, facet.px as f64), f64x8::splat(simd, 0.0));
    let (east_low, east_high) = (iota_low * px, iota_high * px);
    let stride_lanes = f64x8::splat(simd, facet.px as f64 * 16.0);
    let origin = facet.origin();
    let (mut sum_low, mut sum_high) = (zero, zero);
    let (heights, stride) = surface.rows();
    for (row, mut left, right) in OwnedSpans::new(surface, facet) {
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
                sum_low += low * low;
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
    visit_owned(surface, facet, |_, numerator| {
        let residual = u128::from(rounded(numerator, facet.den as u64));
        sum += residual * residual;
    });
    sum as f64
}
