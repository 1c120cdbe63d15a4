//! Posts of a triangle one at a time: for weights, masks and rare questions, and as the reference.

use crate::geometry::{Facet, LocalPost, LocalRect, Spans, Surface};

/// Calls `visit(post, |n|)` for every candidate post of the closed triangle, row by row.
#[inline(always)]
pub fn visit_posts(surface: &Surface, facet: &Facet, visit: impl FnMut(LocalPost, u64)) {
    visit_rows(surface, facet, CandidateSpans::new(surface, facet), visit);
}

/// Calls `visit(post, |n|)` for every candidate post the triangle owns, row by row.
///
/// The owner of a post is the triangle that holds it after an infinitesimal shift east, then north
/// (inward on the far borders of the tile), so the triangles of a tile share its posts without overlap.
#[inline(always)]
pub fn visit_owned(surface: &Surface, facet: &Facet, visit: impl FnMut(LocalPost, u64)) {
    visit_rows(surface, facet, OwnedSpans::new(surface, facet), visit);
}

#[inline(always)]
fn visit_rows(
    surface: &Surface,
    facet: &Facet,
    rows: impl Iterator<Item = (i32, i32, i32)>,
    mut visit: impl FnMut(LocalPost, u64),
) {
    let (heights, stride) = surface.rows();
    let origin = facet.origin();
    for (row, left, right) in rows {
        let mut plane = origin + facet.py * i64::from(row) + facet.px * i64::from(left);
        for col in left..=right {
            let height = i64::from(heights[row as usize * stride + col as usize]);
            visit(LocalPost::new(row, col), (height * facet.den - plane).unsigned_abs());
            plane += facet.px;
        }
    }
}

/// Rows and inclusive columns of the candidate posts of a closed triangle; empty rows have `right < left`.
pub(super) struct CandidateSpans {
    spans: Spans,
    candidates: LocalRect,
}

impl CandidateSpans {
    #[inline(always)]
    pub fn new(surface: &Surface, facet: &Facet) -> Self {
        Self { spans: Spans::new(facet), candidates: surface.candidates() }
    }
}

impl Iterator for CandidateSpans {
    type Item = (i32, i32, i32);

    #[inline(always)]
    fn next(&mut self) -> Option<(i32, i32, i32)> {
        loop {
            let span = self.spans.next()?;
            if self.candidates.north < span.row {
                return None;
            }
            if self.candidates.south <= span.row {
                let (west, east) = (self.candidates.west, self.candidates.east);
                return Some((span.row, span.left.max(west), span.right.min(east)));
            }
        }
    }
}

/// Rows and inclusive columns of the candidate posts a triangle owns; empty rows have `right < left`.
pub(super) struct OwnedSpans {
    spans: Spans,
    candidates: LocalRect,
    /// Rows from here on belong to the triangles above.
    end: i32,
    /// The lowest row, when a single corner stands on it.
    lone_corner: i32,
    last_col: i32,
}

impl OwnedSpans {
    #[inline(always)]
    pub fn new(surface: &Surface, facet: &Facet) -> Self {
        let (_, _, low, high) = facet.bounds();
        let is_flat = |row: i32| facet.y.iter().filter(|&&y| y == row).count() == 2;
        let (extent, candidates) = (surface.extent(), surface.candidates());
        // The highest row belongs to the triangles above it, unless there is nothing above.
        let keeps_top = high == extent.north && is_flat(high);
        let end = (high + i32::from(keeps_top)).min(candidates.north + 1);
        let lone_corner = if is_flat(low) { i32::MIN } else { low };
        Self { spans: Spans::new(facet), candidates, end, lone_corner, last_col: extent.east }
    }
}

impl Iterator for OwnedSpans {
    type Item = (i32, i32, i32);

    #[inline(always)]
    fn next(&mut self) -> Option<(i32, i32, i32)> {
        loop {
            let span = self.spans.next()?;
            if self.end <= span.row {
                return None;
            }
            if span.row < self.candidates.south {
                continue;
            }
            // A post exactly on the right edge belongs to the triangle east of it, unless there is none; a
            // lone lowest corner belongs to the triangle that holds the ground beside it.
            let is_last = span.right == self.last_col && span.row != self.lone_corner;
            let right = span.right - i32::from(span.right_exact && !is_last);
            return Some((span.row, span.left.max(self.candidates.west), right.min(self.candidates.east)));
        }
    }
}
