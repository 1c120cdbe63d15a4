//! The outline of a triangle, cut where it crosses module lines: what every load module's piece is made of.
//!
//! Corners of load modules are points of the TIN, so none lies inside a triangle or within an edge. A
//! triangle's part inside a load module is therefore convex with all its corners on the triangle's own outline,
//! and it is simply the marks of the outline that lie in the load module, in order. Three marks or more have
//! area; fewer only touch.

use std::cmp::Ordering;

use terrain::LatticePoint;
use terrain::geometry::cut::Line;

/// A point of the outline and the load modules that hold it, its sides included (first and last row and column).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mark {
    pub(crate) what: What,
    pub(crate) rows: (i32, i32),
    pub(crate) cols: (i32, i32),
}

/// What stands at a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum What {
    /// This corner of the triangle.
    Corner(usize),
    /// The crossing of the edge that starts at this corner with a module line.
    Crossing(usize, Line),
}

impl Mark {
    pub(crate) fn lies_in(&self, row: i32, col: i32) -> bool {
        self.rows.0 <= row && row <= self.rows.1 && self.cols.0 <= col && col <= self.cols.1
    }
}

/// First and last row, first and last column of the load modules whose inside a triangle may reach.
pub(crate) fn reach(triangle: [LatticePoint; 3], side: i32) -> ((i32, i32), (i32, i32)) {
    let span = |v: [i32; 3]| {
        let (low, high) = (v[0].min(v[1]).min(v[2]), v[0].max(v[1]).max(v[2]));
        (low.div_euclid(side), (high - 1).div_euclid(side))
    };
    (span(triangle.map(|p| p.row)), span(triangle.map(|p| p.col)))
}

/// Fills `marks` with the outline of a counter-clockwise triangle over load modules of `side` lattice steps.
///
/// # Panics
/// When an edge passes through a corner of a load module, which must be a point of the TIN.
pub(crate) fn outline(triangle: [LatticePoint; 3], side: i32, marks: &mut Vec<Mark>) {
    marks.clear();
    for i in 0..3 {
        let (from, to) = (triangle[i], triangle[(i + 1) % 3]);
        marks.push(Mark { what: What::Corner(i), rows: holders(from.row, side), cols: holders(from.col, side) });
        cross(i, from, to, side, marks);
    }
}

/// Rows (or columns) of load modules that hold a coordinate.
fn holders(v: i32, side: i32) -> (i32, i32) {
    ((v - 1).div_euclid(side), v.div_euclid(side))
}

/// Marks every crossing of an edge, in order from its start.
fn cross(edge: usize, from: LatticePoint, to: LatticePoint, side: i32, marks: &mut Vec<Mark>) {
    let (mut row, mut col) = (Pace::new(from.row, to.row, side), Pace::new(from.col, to.col, side));
    loop {
        let next_is_row = match (row.next_line(), col.next_line()) {
            (None, None) => return,
            (Some(_), None) => true,
            (None, Some(_)) => false,
            (Some(at_row), Some(at_col)) => {
                // Which line comes first on the way: the parts gone are at / whole, compared without division.
                let (to_row, to_col) = (row.part(at_row) * col.whole(), col.part(at_col) * row.whole());
                assert_ne!(to_row.cmp(&to_col), Ordering::Equal, "corners of load modules are points of the TIN");
                to_row < to_col
            }
        };
        let (stepping, other) = if next_is_row { (&mut row, &col) } else { (&mut col, &row) };
        assert!(!other.runs_along_a_line, "corners of load modules are points of the TIN");
        let (line, both) = stepping.step();
        let one = (other.module, other.module);
        let mark = if next_is_row {
            Mark { what: What::Crossing(edge, Line::Row(line)), rows: both, cols: one }
        } else {
            Mark { what: What::Crossing(edge, Line::Col(line)), rows: one, cols: both }
        };
        marks.push(mark);
    }
}

/// How an edge advances through the rows, or the columns, of load modules.
struct Pace {
    from: i32,
    to: i32,
    side: i32,
    /// The row or column the edge is passing through.
    module: i32,
    runs_along_a_line: bool,
}

impl Pace {
    fn new(from: i32, to: i32, side: i32) -> Self {
        let module = if to < from { (from - 1).div_euclid(side) } else { from.div_euclid(side) };
        Self { from, to, side, module, runs_along_a_line: from == to && from % side == 0 }
    }

    /// The line that the edge crosses next, if one lies strictly before its end.
    fn next_line(&self) -> Option<i32> {
        let line = self.side * if self.from < self.to { self.module + 1 } else { self.module };
        let (low, high) = (self.from.min(self.to), self.from.max(self.to));
        (low < line && line < high).then_some(line)
    }

    fn part(&self, line: i32) -> i64 {
        (i64::from(line) - i64::from(self.from)).abs()
    }

    fn whole(&self) -> i64 {
        (i64::from(self.to) - i64::from(self.from)).abs()
    }

    /// Crosses the next line: it, and the rows or columns before and after it from the lower to the higher.
    fn step(&mut self) -> (i32, (i32, i32)) {
        let before = self.module;
        if self.from < self.to {
            self.module += 1;
            (self.side * self.module, (before, self.module))
        } else {
            self.module -= 1;
            (self.side * before, (self.module, before))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many marks each load module of a 3 x 3 grid holds, from the south-west, row by row.
    #[track_caller]
    fn check(triangle: [(i32, i32); 3], expected: [usize; 9]) {
        let triangle = triangle.map(|(row, col)| LatticePoint::new(row, col));
        let mut marks = Vec::new();
        outline(triangle, 10, &mut marks);
        let held = |row: i32, col: i32| marks.iter().filter(|mark| mark.lies_in(row, col)).count();
        let found: Vec<_> = (0..9).map(|i| held(i / 3, i % 3)).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn a_triangle_inside_one_load_module_has_its_corners_there() {
        check([(1, 1), (2, 8), (9, 4)], [3, 0, 0, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn a_triangle_across_one_line_has_a_piece_on_either_side() {
        check([(1, 5), (2, 15), (9, 8)], [4, 3, 0, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn an_edge_along_a_line_crosses_nothing() {
        // The edge lies on column 10: the load module west of it only touches.
        check([(2, 10), (5, 17), (8, 10)], [2, 3, 0, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn a_triangle_from_a_corner_only_touches_the_load_modules_behind_it() {
        check([(10, 10), (7, 18), (14, 17)], [1, 3, 0, 1, 3, 0, 0, 0, 0]);
    }

    #[test]
    fn a_triangle_through_three_sides_leaves_a_piece_of_six() {
        check([(14, 9), (13, 21), (21, 15)], [0, 0, 0, 3, 6, 3, 0, 3, 0]);
    }

    #[test]
    #[should_panic(expected = "corners of load modules are points of the TIN")]
    fn an_edge_through_a_corner_is_refused() {
        check([(5, 5), (15, 15), (18, 2)], [0; 9]);
    }

    #[test]
    #[should_panic(expected = "corners of load modules are points of the TIN")]
    fn an_edge_along_a_line_past_a_corner_is_refused() {
        check([(5, 10), (5, 18), (15, 10)], [0; 9]);
    }
}
