//! Orientation and in-circle tests on whole coordinates, with the canonical rule for co-circular points.

use crate::{LatticePoint, Post};

/// A place with whole coordinates and the order in which ties are broken.
pub trait Canonical: Copy + Ord {
    /// Northward coordinate.
    fn row(self) -> i32;
    /// Eastward coordinate.
    fn col(self) -> i32;
}

impl Canonical for Post {
    fn row(self) -> i32 {
        self.row
    }
    fn col(self) -> i32 {
        self.col
    }
}

impl Canonical for LatticePoint {
    fn row(self) -> i32 {
        self.row
    }
    fn col(self) -> i32 {
        self.col
    }
}

/// Doubled signed area of `a`, `b`, `c`: positive when counter-clockwise, zero when collinear.
pub fn orient<P: Canonical>(a: P, b: P, c: P) -> i64 {
    let (bx, by) = (i64::from(b.col()) - i64::from(a.col()), i64::from(b.row()) - i64::from(a.row()));
    let (cx, cy) = (i64::from(c.col()) - i64::from(a.col()), i64::from(c.row()) - i64::from(a.row()));
    bx * cy - by * cx
}

/// In-circle determinant of the counter-clockwise triangle `a`, `b`, `c` and `p`: positive when `p` lies
/// strictly inside the circle, zero on it. Exact for coordinates below 2^30.
pub fn in_circle<P: Canonical>(a: P, b: P, c: P, p: P) -> i128 {
    let relative = |q: P| {
        let (x, y) = (i128::from(q.col()) - i128::from(p.col()), i128::from(q.row()) - i128::from(p.row()));
        (x, y, x * x + y * y)
    };
    let ((ax, ay, a2), (bx, by, b2), (cx, cy, c2)) = (relative(a), relative(b), relative(c));
    a2 * (bx * cy - by * cx) - b2 * (ax * cy - ay * cx) + c2 * (ax * by - ay * bx)
}

/// Whether the edge shared by triangle `a`, `b`, `c` and a triangle with apex `p` should be flipped, where
/// `c` is the corner opposite the shared edge (`a`, `b`).
///
/// Four co-circular points keep the diagonal that contains the smallest of them; that is a consistent
/// perturbation, so the triangulation depends on the set of points only.
pub(crate) fn in_circle_canonical<P: Canonical>(a: P, b: P, c: P, p: P) -> bool {
    match in_circle(a, b, c, p) {
        0 => {
            let smallest = a.min(b).min(c).min(p);
            smallest == p || smallest == c
        }
        determinant => 0 < determinant,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orientation_is_positive_when_counter_clockwise() {
        let (a, b, c) = (Post::new(0, 0), Post::new(0, 4), Post::new(3, 0));
        assert_eq!(orient(a, b, c), 12);
        assert_eq!(orient(a, c, b), -12);
        assert_eq!(orient(a, b, Post::new(0, 9)), 0);
    }

    #[test]
    fn a_square_keeps_the_diagonal_through_its_smallest_corner() {
        let [sw, se, ne, nw] = [Post::new(0, 0), Post::new(0, 1), Post::new(1, 1), Post::new(1, 0)];
        assert_eq!(in_circle(sw, se, ne, nw), 0);
        // Diagonal south-west to north-east: the corners opposite it are se and nw.
        assert!(!in_circle_canonical(ne, sw, se, nw));
        // Diagonal south-east to north-west: the corners opposite it are sw and ne.
        assert!(in_circle_canonical(se, nw, sw, ne));
    }

    #[test]
    fn in_circle_is_exact_for_the_largest_coordinates() {
        let far = (1 << 30) - 1;
        let (a, b, c) = (Post::new(0, 0), Post::new(0, far), Post::new(far, 0));
        assert_eq!(in_circle(a, b, c, Post::new(far, far)), 0);
        assert!(0 < in_circle(a, b, c, Post::new(far - 1, far)));
        assert!(in_circle(a, b, c, Post::new(far + 1, far)) < 0);
    }
}
