//! The triangle scan: how far the DEM lies from a triangle's plane at the posts under it.
//!
//! With `n(x, y) = z * den - plane * den`, the residual at a post is `|n| / den`, rounded half away from
//! zero. Inside the closed triangle the plane lies between the heights of its corners, so
//! `|n| <= den * relief`; while that is below 2^31, arithmetic that wraps at 32 bits gives `n` exactly,
//! whatever overflowed on the way. Larger triangles take 64-bit lanes.

mod boxes;
mod far;
mod near;
mod squares;
mod visit;

use std::ops::ControlFlow;

use fearless_simd::Simd;

use crate::geometry::{Blocks, Facet, LocalPost, Surface};

pub use crate::geometry::lanes::rounded;
pub use squares::{WIDENED_MAX, squares_sum, widened};
pub use visit::{visit_owned, visit_posts};

/// Largest `den * relief` for which 32-bit lanes are exact.
const NARROW_LIMIT: i64 = 1 << 31;

/// Largest `|n|` over the candidate posts of the closed triangle.
#[inline(always)]
pub fn largest_numerator<S: Simd>(simd: S, surface: &Surface, blocks: &Blocks, facet: &Facet) -> u64 {
    if NARROW_LIMIT <= facet.den * surface.relief() {
        return far::largest(simd, surface, blocks, facet);
    }
    let (x0, _, y0, y1) = facet.bounds();
    match columns(surface, facet) {
        Some(..8) => boxes::largest_8(simd, surface, facet, x0, y0, y1),
        Some(8..16) => boxes::largest_16(simd, surface, facet, x0, y0, y1),
        Some(16..32) => {
            let west = boxes::largest_16(simd, surface, facet, x0, y0, y1);
            west.max(boxes::largest_16(simd, surface, facet, x0 + 16, y0, y1))
        }
        _ => near::largest(simd, surface, facet),
    }
}

/// Columns from the first to the last of a triangle all of whose posts are candidates.
#[inline(always)]
fn columns(surface: &Surface, facet: &Facet) -> Option<i32> {
    let (x0, x1, y0, y1) = facet.bounds();
    let candidates = surface.candidates();
    let is_within = candidates.west <= x0 && x1 <= candidates.east && candidates.south <= y0 && y1 <= candidates.north;
    is_within.then_some(x1 - x0)
}

/// The first candidate post, row by row, whose `|n|` is at least `threshold` (1 or more).
#[inline(always)]
pub fn locate<S: Simd>(simd: S, surface: &Surface, facet: &Facet, threshold: u64) -> Option<LocalPost> {
    if facet.den * surface.relief() < NARROW_LIMIT
        && let Ok(threshold) = i32::try_from(threshold)
    {
        match columns(surface, facet) {
            Some(..8) => return boxes::first_8(simd, surface, facet, threshold),
            Some(8..16) => return boxes::first_16(simd, surface, facet, threshold),
            _ => {}
        }
    }
    let mut first = None;
    let _ = reached(simd, surface, facet, threshold, |post| {
        first = Some(post);
        ControlFlow::Break(())
    });
    first
}

/// Calls `visit` for every candidate post whose `|n|` is at least `threshold` (1 or more), row by row.
#[inline(always)]
pub fn locate_all<S: Simd>(
    simd: S,
    surface: &Surface,
    facet: &Facet,
    threshold: u64,
    mut visit: impl FnMut(LocalPost),
) {
    let _ = reached(simd, surface, facet, threshold, |post| {
        visit(post);
        ControlFlow::Continue(())
    });
}

#[inline(always)]
fn reached<S: Simd>(
    simd: S,
    surface: &Surface,
    facet: &Facet,
    threshold: u64,
    visit: impl FnMut(LocalPost) -> ControlFlow<()>,
) -> ControlFlow<()> {
    if NARROW_LIMIT <= facet.den * surface.relief() {
        far::reached(simd, surface, facet, threshold, visit)
    } else {
        near::reached(simd, surface, facet, threshold, visit)
    }
}

#[cfg(test)]
mod tests;
