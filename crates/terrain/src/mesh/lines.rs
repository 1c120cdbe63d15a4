//! The lines of posts that edges may not cross: sides of load modules.

use crate::geometry::LocalPost;

/// Constraint lines of a working tile: every `step` posts from its south-west corner, or none.
///
/// An edge is constrained exactly when both its ends lie on the same line, so no flag is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lines {
    /// Posts between lines; `u32::MAX` where there are none.
    step: u32,
    /// `ceil(2^32 / step)`: a multiple of `step` times this wraps to less than `reciprocal`.
    reciprocal: u32,
}

impl Lines {
    /// Lines every `step` posts, from the tile's south-west corner.
    ///
    /// # Panics
    /// When `step` is below 2: every post would lie on a line.
    pub fn every(step: i32) -> Self {
        assert!(2 <= step, "load modules are at least two cells wide");
        Self { step: step as u32, reciprocal: (u32::MAX / step as u32) + 1 }
    }

    /// No lines: a mesh free to be Delaunay.
    pub fn none() -> Self {
        Self { step: u32::MAX, reciprocal: 0 }
    }

    /// Posts between lines, if there are any.
    pub fn step(&self) -> Option<i32> {
        (self.step != u32::MAX).then_some(self.step as i32)
    }

    #[inline(always)]
    fn holds(&self, at: i32) -> bool {
        // Divisibility by multiplication: exact for `at` below 2^16 (the packed range).
        (at as u32).wrapping_mul(self.reciprocal) < self.reciprocal
    }

    /// Whether `post` lies on a line of posts running east.
    #[inline(always)]
    pub fn holds_row(&self, post: LocalPost) -> bool {
        self.holds(post.row())
    }

    /// Whether `post` lies on a line of posts running north.
    #[inline(always)]
    pub fn holds_col(&self, post: LocalPost) -> bool {
        self.holds(post.col())
    }

    /// Whether the edge `a`, `b` lies on a line.
    #[inline(always)]
    pub fn constrain(&self, a: LocalPost, b: LocalPost) -> bool {
        (a.row() == b.row() && self.holds_row(a)) || (a.col() == b.col() && self.holds_col(a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_the_multiples_of_the_step() {
        for step in [2, 3, 4, 7, 16, 20, 21, 500] {
            let lines = Lines::every(step);
            for at in 0..65_536 {
                assert_eq!(lines.holds_row(LocalPost::new(at, 1)), at % step == 0, "{at} of {step}");
            }
        }
    }

    #[test]
    fn without_lines_nothing_is_constrained() {
        let lines = Lines::none();
        assert!(!lines.constrain(LocalPost::new(0, 0), LocalPost::new(0, 5)));
        assert!(!lines.constrain(LocalPost::new(7, 3), LocalPost::new(9, 3)));
    }
}
