//! Rows of posts under a triangle, by an exact integer line walk.

use crate::geometry::Facet;

/// The posts of one row inside a closed triangle: columns `left..=right` (none when `right < left`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// The row.
    pub row: i32,
    /// First column inside.
    pub left: i32,
    /// Last column inside.
    pub right: i32,
    /// Whether the right edge passes exactly through `right`.
    pub right_exact: bool,
}

/// Where an edge crosses each row: floor and remainder, stepped without division.
#[derive(Clone, Copy)]
struct Crossing {
    floor: i32,
    remainder: i32,
    step: i32,
    step_remainder: i32,
    rows: i32,
}

impl Crossing {
    #[inline(always)]
    fn new((y0, x0): (i32, i32), (y1, x1): (i32, i32)) -> Self {
        let rows = y1 - y0;
        if rows == 0 {
            return Self { floor: x0, remainder: 0, step: 0, step_remainder: 0, rows: 1 };
        }
        let (mut step, mut step_remainder) = ((x1 - x0) / rows, (x1 - x0) % rows);
        if step_remainder < 0 {
            step -= 1;
            step_remainder += rows;
        }
        Self { floor: x0, remainder: 0, step, step_remainder, rows }
    }

    #[inline(always)]
    fn advance(&mut self) {
        let sum = self.remainder + self.step_remainder;
        let over = self.rows <= sum;
        self.remainder = if over { sum - self.rows } else { sum };
        self.floor += self.step + i32::from(over);
    }

    #[inline(always)]
    fn ceil(&self) -> i32 {
        self.floor + i32::from(0 < self.remainder)
    }
}

/// The rows of a closed triangle from south to north.
pub struct Spans {
    row: i32,
    middle: i32,
    last: i32,
    left: Crossing,
    right: Crossing,
    upper: Crossing,
    bends_left: bool,
}

impl Spans {
    /// The rows of `facet`.
    #[inline(always)]
    pub(crate) fn new(facet: &Facet) -> Self {
        let mut corners = [0, 1, 2].map(|i| (facet.y[i], facet.x[i]));
        if corners[1].0 < corners[0].0 {
            corners.swap(0, 1);
        }
        if corners[2].0 < corners[1].0 {
            corners.swap(1, 2);
        }
        if corners[1].0 < corners[0].0 {
            corners.swap(0, 1);
        }
        let [low, mid, high] = corners;
        let bends_left =
            i64::from(mid.1 - low.1) * i64::from(high.0 - low.0) < i64::from(high.1 - low.1) * i64::from(mid.0 - low.0);
        let (long, lower) = (Crossing::new(low, high), Crossing::new(low, mid));
        let (left, right) = if bends_left { (lower, long) } else { (long, lower) };
        let upper = Crossing::new(mid, high);
        Self { row: low.0, middle: mid.0, last: high.0, left, right, upper, bends_left }
    }
}

impl Iterator for Spans {
    type Item = Span;

    #[inline(always)]
    fn next(&mut self) -> Option<Span> {
        if self.last < self.row {
            return None;
        }
        if self.row == self.middle {
            // At the middle corner the two short edges meet, so either gives this row's crossing.
            if self.bends_left {
                self.left = self.upper;
            } else {
                self.right = self.upper;
            }
        }
        let span = Span {
            row: self.row,
            left: self.left.ceil(),
            right: self.right.floor,
            right_exact: self.right.remainder == 0,
        };
        self.left.advance();
        self.right.advance();
        self.row += 1;
        Some(span)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(corners: [(i32, i32); 3]) {
        let facet = Facet::new(corners.map(|c| c.1), corners.map(|c| c.0), [0; 3]);
        let inside = |y: i32, x: i32| {
            (0..3).all(|i| {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                0 <= (b.1 - a.1) * (y - a.0) - (b.0 - a.0) * (x - a.1)
            })
        };
        let (x0, x1, y0, y1) = facet.bounds();
        let spans: Vec<Span> = Spans::new(&facet).collect();
        assert_eq!(spans.len() as i32, y1 - y0 + 1);
        for span in spans {
            for x in x0..=x1 {
                assert_eq!(span.left <= x && x <= span.right, inside(span.row, x), "{corners:?} at {},{x}", span.row);
            }
        }
    }

    #[test]
    fn spans_hold_exactly_the_posts_of_the_closed_triangle() {
        // Every counter-clockwise triangle on a 5 x 5 grid.
        let posts: Vec<(i32, i32)> = (0..25).map(|i| (i / 5, i % 5)).collect();
        for &a in &posts {
            for &b in &posts {
                for &c in &posts {
                    if 0 < (b.1 - a.1) * (c.0 - a.0) - (b.0 - a.0) * (c.1 - a.1) {
                        check([a, b, c]);
                    }
                }
            }
        }
    }
}
