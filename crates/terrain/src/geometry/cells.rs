//! A grid of square cells over some ground, each of which lists the outlines that touch it.
//!
//! ```text
//!   +----+----+----+      An outline is entered row of cells by row of cells: its part inside a row spans some
//!   |    |  /\|    |      columns, and all cells of these are listed. A point and a line of sight are outlines too,
//!   +----+-/--\----+      so the same walk finds what may lie under them.
//!   |    |/____\   |
//!   +----+----+----+
//! ```
//! Cells list too many rather than too few: the caller tests what it finds.

use std::cell::Cell;
use std::ops::RangeInclusive;

/// Share of a cell by which rounding may move the end of a span; spans are grown by it.
const MARGIN: f64 = 1e-6;

/// Which outlines touch which cell.
#[derive(Clone, Debug)]
pub struct Cells {
    south_west: [f64; 2],
    side: f64,
    rows: usize,
    cols: usize,
    /// Where each cell's list begins, row by row from the south-west; one more at the end.
    starts: Vec<usize>,
    listed: Vec<u32>,
}

impl Cells {
    /// Cells of `side` over the ground between two corners, listing `count` outlines.
    ///
    /// # Panics
    /// When `side` is not above zero.
    pub fn new(
        south_west: [f64; 2],
        north_east: [f64; 2],
        side: f64,
        count: u32,
        outline: impl Fn(u32) -> [[f64; 2]; 3],
    ) -> Self {
        assert!(0.0 < side, "a cell has a side");
        let along = |axis: usize| ((north_east[axis] - south_west[axis]) / side).ceil().max(1.0) as usize;
        let (rows, cols) = (along(1), along(0));
        let mut cells = Self { south_west, side, rows, cols, starts: vec![0; rows * cols + 1], listed: Vec::new() };
        let mut starts = std::mem::take(&mut cells.starts);
        for item in 0..count {
            cells.each_row(&outline(item), |row, span| span.for_each(|col| starts[row * cols + col + 1] += 1));
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut ends = starts.clone();
        let mut listed = vec![0; starts[rows * cols]];
        for item in 0..count {
            cells.each_row(&outline(item), |row, span| {
                for col in span {
                    let end = &mut ends[row * cols + col];
                    listed[*end] = item;
                    *end += 1;
                }
            });
        }
        Self { starts, listed, ..cells }
    }

    /// What may lie at a place.
    pub fn at(&self, place: [f64; 2]) -> &[u32] {
        let [col, row] = self.scaled(place);
        self.list(last_below(row, self.rows), last_below(col, self.cols))
    }

    /// Whether `test` holds for anything that may lie under a convex outline, such as the straight line between two
    /// places. The same item may come more than once.
    pub fn any_under<const N: usize>(&self, outline: [[f64; 2]; N], mut test: impl FnMut(u32) -> bool) -> bool {
        let mut found = false;
        self.each_row(&outline, |row, mut span| {
            found = found || span.any(|col| self.list(row, col).iter().any(|&item| test(item)));
        });
        found
    }

    /// Calls `visit` with what may lie within `reach` of a place, which may shrink from call to call: first with what
    /// may lie at the place itself. The same item may come more than once.
    pub fn each_near(&self, place: [f64; 2], reach: &Cell<f64>, mut visit: impl FnMut(u32)) {
        self.at(place).iter().for_each(|&item| visit(item));
        let [x, y] = self.scaled(place);
        let (home_row, home_col) = (last_below(y, self.rows), last_below(x, self.cols));
        let span = |at: f64, count: usize| {
            let cells = reach.get() / self.side + MARGIN;
            last_below(at - cells, count)..=last_below(at + cells, count)
        };
        for row in span(y, self.rows) {
            for col in span(x, self.cols) {
                let away = [beyond(x, col), beyond(y, row)];
                let squared = (away[0] * away[0] + away[1] * away[1]) * self.side * self.side;
                if (row, col) != (home_row, home_col) && squared <= reach.get() * reach.get() {
                    self.list(row, col).iter().for_each(|&item| visit(item));
                }
            }
        }
    }

    fn list(&self, row: usize, col: usize) -> &[u32] {
        let cell = row * self.cols + col;
        &self.listed[self.starts[cell]..self.starts[cell + 1]]
    }

    fn scaled(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [(x - self.south_west[0]) / self.side, (y - self.south_west[1]) / self.side]
    }

    /// Calls `visit` with each row of cells that a convex outline touches, and the columns it spans there.
    fn each_row<const N: usize>(&self, outline: &[[f64; 2]; N], mut visit: impl FnMut(usize, RangeInclusive<usize>)) {
        let corners = outline.map(|place| self.scaled(place));
        let south = corners.iter().map(|corner| corner[1]).fold(f64::INFINITY, f64::min) - MARGIN;
        let north = corners.iter().map(|corner| corner[1]).fold(f64::NEG_INFINITY, f64::max) + MARGIN;
        for row in last_below(south, self.rows)..=last_below(north, self.rows) {
            let band = [row as f64 - MARGIN, (row + 1) as f64 + MARGIN];
            let (mut west, mut east) = (f64::INFINITY, f64::NEG_INFINITY);
            for (i, &from) in corners.iter().enumerate() {
                if let Some([first, last]) = part_in_band(from, corners[(i + 1) % N], band) {
                    (west, east) = (west.min(first).min(last), east.max(first).max(last));
                }
            }
            visit(row, last_below(west - MARGIN, self.cols)..=last_below(east + MARGIN, self.cols));
        }
    }
}

/// How far east an edge runs inside a band of rows: where its southern and its northern end in the band lie.
fn part_in_band(from: [f64; 2], to: [f64; 2], [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let (a, b) = if from[1] <= to[1] { (from, to) } else { (to, from) };
    if b[1] < low || high < a[1] {
        return None;
    }
    let at = |y: f64| a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1]));
    Some([if a[1] < low { at(low) } else { a[0] }, if high < b[1] { at(high) } else { b[0] }])
}

/// How far a coordinate lies outside a cell, in cells.
fn beyond(at: f64, cell: usize) -> f64 {
    (cell as f64 - at).max(at - (cell + 1) as f64).max(0.0)
}

/// The cell of a coordinate, the nearest one where it lies outside.
fn last_below(at: f64, count: usize) -> usize {
    (at.max(0.0) as usize).min(count - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LONG: [[f64; 2]; 3] = [[0.5, 0.5], [7.5, 0.5], [0.5, 3.5]];
    const FAR: [[f64; 2]; 3] = [[8.0, 4.0], [7.5, 4.0], [8.0, 3.5]];

    fn two_outlines() -> Cells {
        Cells::new([0.0, 0.0], [8.0, 4.0], 1.0, 2, |item| if item == 0 { LONG } else { FAR })
    }

    #[test]
    fn an_outline_is_listed_where_it_lies_and_not_all_over_its_box() {
        let cells = two_outlines();
        for (place, expected) in [
            ([0.9, 0.9], &[0][..]),
            ([7.4, 0.6], &[0]),
            ([0.6, 3.4], &[0]),
            ([6.5, 3.0], &[]),
            ([7.9, 3.9], &[1]),
            // Beyond the area counts as its last cell.
            ([9.0, 9.0], &[1]),
        ] {
            assert_eq!(cells.at(place), expected, "{place:?}");
        }
    }

    #[test]
    fn what_may_lie_near_is_found_within_reach_and_not_beyond() {
        let cells = two_outlines();
        let near = |place, reach: f64| {
            let mut near = Vec::new();
            cells.each_near(place, &Cell::new(reach), |item| near.push(item));
            near.dedup();
            near
        };
        assert_eq!(near([6.5, 3.5], 0.4), [] as [u32; 0]);
        assert_eq!(near([6.5, 3.5], 0.6), [1]);
        assert_eq!(near([7.9, 2.9], 0.2), [1]);
        assert_eq!(near([0.5, 0.5], 9.0), [0, 1]);
        // A reach that shrinks on the way ends the search.
        let (reach, mut met) = (Cell::new(9.0), Vec::new());
        cells.each_near([0.5, 0.5], &reach, |item| {
            met.push(item);
            reach.set(0.0);
        });
        assert_eq!(met, [0]);
    }

    #[test]
    fn a_line_meets_what_is_listed_along_it_until_a_test_holds() {
        let cells = two_outlines();
        let met = |line| {
            let mut met = Vec::new();
            cells.any_under(line, |item| {
                met.push(item);
                false
            });
            met.sort_unstable();
            met.dedup();
            met
        };
        assert_eq!(met([[0.0, 0.0], [8.0, 4.0]]), [0, 1]);
        assert_eq!(met([[8.0, 2.5], [3.0, 4.0]]), [] as [u32; 0]);
        let mut asked = 0;
        assert!(cells.any_under([[0.0, 0.5], [8.0, 0.5]], |_| {
            asked += 1;
            true
        }));
        assert_eq!(asked, 1);
    }
}
