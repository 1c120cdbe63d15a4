//! Where an edge of a TIN crosses a module line: the one point that clipping makes.
//!
//! It is computed from the whole edge, ends in canonical order, and from the line alone, in whole numbers;
//! so the load modules on both sides of the line, and both triangles of the edge, get the same bits.

use crate::{Spacing, Vertex};

/// A line of lattice points, in eighths of a post from the area's south-west post.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// All points of one lattice row: it runs west to east.
    Row(i32),
    /// All points of one lattice column: it runs south to north.
    Col(i32),
}

/// A crossing, rounded once to quanta of 1/128 m.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossing {
    /// Along the line, from the area's western or southern edge.
    pub along: i64,
    /// Height of the edge there; the edge stays straight, so pieces of a triangle stay in its plane.
    pub height: i32,
}

/// Where the edge between `a` and `b` crosses `line`; both orders of the ends give the same answer.
///
/// Both numbers are rounded half away from zero; rounding keeps the order of crossings along a line.
/// Exact for heights of 24 bits and any lattice points of an area (coordinates that are not negative).
///
/// # Panics
/// When the ends do not lie strictly on either side of the line.
pub fn crossing(a: Vertex, b: Vertex, line: Line, spacing: Spacing) -> Crossing {
    let (a, b) = if a.at <= b.at { (a, b) } else { (b, a) };
    // Of each end: how far along the line it lies, and how far across.
    let place = |v: Vertex| match line {
        Line::Row(row) => (i64::from(v.at.col), i64::from(v.at.row) - i64::from(row)),
        Line::Col(col) => (i64::from(v.at.row), i64::from(v.at.col) - i64::from(col)),
    };
    let ((along_a, across_a), (along_b, across_b)) = (place(a), place(b));
    assert!(across_a.signum() * across_b.signum() < 0, "an edge is cut by a line that separates its ends");
    // The crossing lies at part / whole of the way from a to b, 0 < part < whole.
    let (part, whole) = (across_a.abs(), across_a.abs() + across_b.abs());
    let step = i128::from(spacing.quanta_per_lattice_step());
    let along = step * (i128::from(along_a) * i128::from(whole) + i128::from(along_b - along_a) * i128::from(part));
    let (rise, whole_wide) = (i64::from(b.height) - i64::from(a.height), i128::from(whole));
    let height = i128::from(a.height) * whole_wide + i128::from(rise) * i128::from(part);
    Crossing { along: rounded(along, whole), height: rounded(height, whole) as i32 }
}

/// `numerator / den` for a positive `den`, half away from zero.
fn rounded(numerator: i128, den: i64) -> i64 {
    let magnitude = match u64::try_from(2 * numerator.unsigned_abs()) {
        // Nearly always: one machine division instead of a wide one.
        Ok(doubled) if doubled <= u64::MAX / 2 => i64::try_from((doubled + den as u64) / (2 * den as u64)),
        _ => i64::try_from((2 * numerator.unsigned_abs() + den as u128) / (2 * den as u128)),
    };
    let magnitude = magnitude.expect("a crossing lies between two lattice points");
    if numerator < 0 { -magnitude } else { magnitude }
}

#[cfg(test)]
mod tests {
    use crate::LatticePoint;

    use super::*;

    fn vertex(row: i32, col: i32, height: i32) -> Vertex {
        Vertex { at: LatticePoint::new(row, col), height }
    }

    #[track_caller]
    fn check(a: Vertex, b: Vertex, line: Line, sixteenths: u32, expected: (i64, i32)) {
        let spacing = Spacing::from_sixteenths(sixteenths).unwrap();
        let found = crossing(a, b, line, spacing);
        assert_eq!((found.along, found.height), expected);
        assert_eq!(crossing(b, a, line, spacing), found, "the order of the ends does not matter");
    }

    #[test]
    fn a_crossing_is_rounded_half_away_from_zero() {
        // Half-way from column 1 to column 2: 1.5 steps of 1 quantum.
        check(vertex(0, 1, 5), vertex(2, 2, 8), Line::Row(1), 1, (2, 7));
        check(vertex(0, 1, -5), vertex(2, 2, -8), Line::Row(1), 1, (2, -7));
        check(vertex(0, 2, -1), vertex(2, 1, 2), Line::Row(1), 1, (2, 1));
    }

    #[test]
    fn rows_and_columns_are_cut_alike() {
        check(vertex(10, 100, 0), vertex(40, 190, 300), Line::Row(20), 400, (130 * 400, 100));
        check(vertex(100, 10, 0), vertex(190, 40, 300), Line::Col(20), 400, (130 * 400, 100));
        // A third of a step: 1 + 1/3 lattice steps of 400 quanta.
        check(vertex(0, 1, 0), vertex(3, 2, 100), Line::Row(1), 400, (533, 33));
    }

    #[test]
    fn crossings_far_from_the_origin_are_exact() {
        let far = i32::MAX - 10;
        let (a, b) = (vertex(far, 0, 1 << 24), vertex(far + 9, far, -(1 << 24)));
        let along = (i128::from(far) * 2 * 16_000_000 + 4) / 9;
        let height = ((1 << 24) as f64 * 5.0 / 9.0).round() as i32;
        check(a, b, Line::Row(far + 2), 16_000_000, (along as i64, height));
    }

    #[test]
    fn order_along_a_line_survives_rounding() {
        let spacing = Spacing::from_sixteenths(1).unwrap();
        let from = vertex(0, 0, 0);
        let places: Vec<_> =
            (0..500).map(|col| crossing(from, vertex(90, col, 0), Line::Row(8), spacing).along).collect();
        assert!(places.is_sorted());
    }

    #[test]
    #[should_panic(expected = "separates its ends")]
    fn an_edge_that_only_touches_a_line_is_not_cut() {
        crossing(vertex(8, 0, 0), vertex(16, 9, 0), Line::Row(8), Spacing::from_sixteenths(16).unwrap());
    }
}
