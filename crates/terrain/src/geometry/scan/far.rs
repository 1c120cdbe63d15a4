//! Triangles whose numerators need more than 32 bits (those of the beginning of a run): f64 lanes that hold integers
//! below 2^53, which is exact for tiles of at most 16,384 posts a side.
//!
//! Heights have at most 24 bits, so going over f32 to f64 loses nothing.

use std::ops::ControlFlow;

use fearless_simd::{Simd, f64x8, i32x8, i32x16, prelude::*};

use super::squares::widened;
use super::visit::CandidateSpans;
use crate::geometry::blocks::{BlockHeights, Blocks, SIDE, TOGETHER};
use crate::geometry::lanes::IOTA;
use crate::geometry::{Facet, LocalPost, LocalRect, Surface};

/// Largest `|n|` over the candidate posts of the closed triangle.
///
/// Blocks are left out where neither their lowest nor their highest height can lie further from the plane.
#[inline(always)]
pub fn largest<S: Simd>(simd: S, surface: &Surface, blocks: &Blocks, facet: &Facet) -> u64 {
    let (scan, blocks) = (Scan::new(simd, surface, facet), blocks.heights());
    let within = scan.within;
    if within.east < within.west || within.north < within.south {
        return 0;
    }
    let block = |at: i32| at as usize / SIDE;
    let mut by_lane = scan.zero;
    let mut largest = 0.0;
    for row in block(within.south)..=block(within.north) {
        for first in (block(within.west)..=block(within.east)).step_by(TOGETHER) {
            let mut found = scan.promising(simd, blocks, (row, first), largest);
            while found != 0 {
                by_lane = scan.block(simd, (row, first + found.trailing_zeros() as usize), by_lane);
                found &= found - 1;
                largest = simd.reduce_max_f64x8(by_lane);
            }
        }
    }
    largest as u64
}

/// A triangle and what is known of it before its posts are looked at.
struct Scan<'a, S: Simd> {
    heights: &'a [i32],
    stride: usize,
    facet: &'a Facet,
    /// First and last column, first and last row of candidates within its bounding box.
    within: LocalRect,
    den: f64x8<S>,
    iota: f64x8<S>,
    zero: f64x8<S>,
    /// Of each edge, from its function at a block's south-west post to the largest within the block.
    slack: [f64; 3],
    /// From the plane's numerator there to the lowest and to the highest within the block.
    fall: f64,
    rise: f64,
}

impl<'a, S: Simd> Scan<'a, S> {
    #[inline(always)]
    fn new(simd: S, surface: &Surface<'a>, facet: &'a Facet) -> Self {
        let (x0, x1, y0, y1) = facet.bounds();
        let candidates = surface.candidates();
        let within = LocalRect {
            south: y0.max(candidates.south),
            west: x0.max(candidates.west),
            north: y1.min(candidates.north),
            east: x1.min(candidates.east),
        };
        let (heights, stride) = surface.rows();
        let last = (SIDE - 1) as i64;
        let slack = [0, 1, 2].map(|edge| {
            let (dx, dy) = facet.edge(edge);
            (last * i64::from(dx.max(0) + (-dy).max(0))) as f64
        });
        Self {
            heights,
            stride,
            facet,
            within,
            den: f64x8::splat(simd, facet.den as f64),
            iota: widened(simd, i32x8::from_slice(simd, &IOTA[..8])),
            zero: f64x8::splat(simd, 0.0),
            slack,
            fall: (last * (facet.px.min(0) + facet.py.min(0))) as f64,
            rise: (last * (facet.px.max(0) + facet.py.max(0))) as f64,
        }
    }

    /// The plane's numerators at the post (row, col) and seven more, `step` columns apart.
    #[inline(always)]
    fn plane(&self, simd: S, row: i32, col: i32, step: i64) -> f64x8<S> {
        let facet = self.facet;
        let first = facet.origin() + facet.py * i64::from(row) + facet.px * i64::from(col);
        f64x8::splat(simd, first as f64) + self.iota * f64x8::splat(simd, (facet.px * step) as f64)
    }

    /// The function of an edge at the same posts: below zero outside.
    #[inline(always)]
    fn edge(&self, simd: S, edge: usize, row: i32, col: i32, step: i64) -> f64x8<S> {
        let east = i64::from(self.facet.edge(edge).1) * step;
        let first = self.facet.edge_at(edge, col, row);
        f64x8::splat(simd, first as f64) - self.iota * f64x8::splat(simd, east as f64)
    }

    /// Those of eight blocks, from one on, that reach into the triangle and may hold more than `largest`.
    #[inline(always)]
    fn promising(&self, simd: S, blocks: &BlockHeights, (row, col): (usize, usize), largest: f64) -> u64 {
        let (south, west, step) = ((row * SIDE) as i32, (col * SIDE) as i32, SIDE as i64);
        let (lowest, highest) = blocks.ranges(row, col);
        let plane = self.plane(simd, south, west, step);
        let above = widened(simd, i32x8::from_slice(simd, highest)) * self.den - plane;
        let below = plane - widened(simd, i32x8::from_slice(simd, lowest)) * self.den;
        let above = above - f64x8::splat(simd, self.fall);
        let below = below + f64x8::splat(simd, self.rise);
        let columns = f64x8::splat(simd, f64::from(self.within.east / SIDE as i32 - col as i32));
        let is_more = above.max(below).simd_gt(f64x8::splat(simd, largest)) & self.iota.simd_le(columns);
        let [a, b, c] = self.slack;
        let a = self.edge(simd, 0, south, west, step).simd_ge(f64x8::splat(simd, -a));
        let b = self.edge(simd, 1, south, west, step).simd_ge(f64x8::splat(simd, -b));
        let c = self.edge(simd, 2, south, west, step).simd_ge(f64x8::splat(simd, -c));
        (is_more & a & b & c).to_bitmask()
    }

    /// The larger, by lane, of `largest` and `|n|` at the posts of one block.
    #[inline(always)]
    fn block(&self, simd: S, (row, col): (usize, usize), mut largest: f64x8<S>) -> f64x8<S> {
        let (within, west) = (self.within, (col * SIDE) as i32);
        let south = within.south.max((row * SIDE) as i32);
        let north = within.north.min((row * SIDE + SIDE - 1) as i32);
        let column = |at: i32| f64x8::splat(simd, f64::from(at - west));
        let is_within = self.iota.simd_ge(column(within.west)) & self.iota.simd_le(column(within.east));
        let outside = f64x8::splat(simd, f64::NEG_INFINITY);
        let mut plane = self.plane(simd, south, west, 1);
        let mut a = is_within.select(self.edge(simd, 0, south, west, 1), outside);
        let (mut b, mut c) = (self.edge(simd, 1, south, west, 1), self.edge(simd, 2, south, west, 1));
        let north_a = f64x8::splat(simd, f64::from(self.facet.edge(0).0));
        let north_b = f64x8::splat(simd, f64::from(self.facet.edge(1).0));
        let north_c = f64x8::splat(simd, f64::from(self.facet.edge(2).0));
        let north_plane = f64x8::splat(simd, self.facet.py as f64);
        let first = south as usize * self.stride + west as usize;
        let rows = &self.heights[first..][..(north - south) as usize * self.stride + SIDE];
        for row in rows.chunks(self.stride) {
            let height = widened(simd, i32x8::from_slice(simd, &row[..SIDE]));
            let numerator = simd.abs_f64x8(height * self.den - plane);
            let is_inside = a.min(b).min(c).simd_ge(self.zero);
            largest = largest.max(is_inside.select(numerator, self.zero));
            plane += north_plane;
            (a, b, c) = (a + north_a, b + north_b, c + north_c);
        }
        largest
    }
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
    let (iota_low, iota_high) = simd.cvt_f32_i32x16(i32x16::from_slice(simd, &IOTA)).widen();
    let px = f64x8::splat(simd, facet.px as f64);
    let (den, threshold) = (f64x8::splat(simd, facet.den as f64), f64x8::splat(simd, threshold as f64));
    let (east_low, east_high) = (iota_low * px, iota_high * px);
    let stride_lanes = f64x8::splat(simd, facet.px as f64 * 16.0);
    let origin = facet.origin();
    let (heights, stride) = surface.rows();
    for (row, mut left, right) in CandidateSpans::new(surface, facet) {
        let first = (origin + facet.py * i64::from(row) + facet.px * i64::from(left)) as f64;
        let first = f64x8::splat(simd, first);
        let (mut plane_low, mut plane_high) = (first + east_low, first + east_high);
        while left <= right {
            let index = row as usize * stride + left as usize;
            let height = i32x16::from_slice(simd, &heights[index..index + 16]);
            let (low, high) = simd.cvt_f32_i32x16(height).widen();
            let (low, high) = (simd.abs_f64x8(low * den - plane_low), simd.abs_f64x8(high * den - plane_high));
            let end = f64x8::splat(simd, f64::from(right - left + 1));
            let low = (low.simd_ge(threshold) & iota_low.simd_lt(end)).to_bitmask();
            let high = (high.simd_ge(threshold) & iota_high.simd_lt(end)).to_bitmask();
            let mut hits = low | high << 8;
            while hits != 0 {
                visit(LocalPost::new(row, left + hits.trailing_zeros() as i32))?;
                hits &= hits - 1;
            }
            (plane_low, plane_high) = (plane_low + stride_lanes, plane_high + stride_lanes);
            left += 16;
        }
    }
    ControlFlow::Continue(())
}
