//! Posts of a triangle one at a time: for weights, masks and rare questions, and as the reference.

use crate::{Facet, LocalPost, Span, Spans, Surface};

/// Calls `visit(post, |n|)` for every candidate post of the closed triangle, row by row.
#[inline(always)]
pub fn visit_posts(surface: &Surface, facet: &Facet, visit: impl FnMut(LocalPost, u64)) {
    let candidates = surface.candidates();
    let rows = Spans::new(facet)
        .filter(|span| candidates.south <= span.row && span.row <= candidates.north)
        .map(|span| (span.row, span.left.max(candidates.west), span.right.min(candidates.east)));
    visit_rows(surface, facet, rows, visit);
}

/// Calls `visit(post, |n|)` for every candidate post the triangle owns, row by row.
///
/// The owner of a post is the triangle that holds it after an infinitesimal shift east, then north
/// (inward on the far borders of the tile), so the triangles of a tile share its posts without overlap.
#[inline(always)]
pub fn visit_owned(surface: &Surface, facet: &Facet, visit: impl FnMut(LocalPost, u64)) {
    visit_rows(surface, facet, owned_spans(surface, facet), visit);
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

/// Rows and inclusive columns of the candidate posts a triangle owns; empty rows have `right < left`.
#[inline(always)]
pub(super) fn owned_spans(surface: &Surface, facet: &Facet) -> impl Iterator<Item = (i32, i32, i32)> {
    let (_, _, low, high) = facet.bounds();
    let corners_on = |row: i32| facet.y.iter().filter(|&&y| y == row).count();
    let (flat_bottom, flat_top) = (corners_on(low) == 2, corners_on(high) == 2);
    let (extent, candidates) = (surface.extent(), surface.candidates());
    Spans::new(facet).filter_map(move |span: Span| {
        // The highest row belongs to the triangles above it, unless there is nothing above.
        let is_owned_row = span.row < high || (flat_top && high == extent.north);
        if !is_owned_row || span.row < candidates.south || candidates.north < span.row {
            return None;
        }
        // A post exactly on the right edge belongs to the triangle east of it, unless there is none; a
        // lone lowest corner belongs to the triangle that holds the ground beside it.
        let lone_corner = span.row == low && !flat_bottom;
        let keeps_right = !span.right_exact || (span.right == extent.east && !lone_corner);
        let right = if keeps_right { span.right } else { span.right - 1 };
        Some((span.row, span.left.max(candidates.west), right.min(candidates.east)))
    })
}
