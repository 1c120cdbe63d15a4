//! The lattice on which every vertex of a TIN lies: eighths of a post, or finer steps where features need them.

use serde::{Deserialize, Serialize};

use crate::Post;

/// Lattice steps between neighbouring posts, but for TINs with features (see [`crate::Tin::steps_per_post`]).
pub const LATTICE_PER_POST: i32 = 8;

/// A place on the working lattice, in eighths of a post from the area's south-west post.
///
/// Growing and the paper method use whole posts only; optimising moves free vertices to eighths. Features, and TINs
/// with features, count in finer steps of their own, which they name; what turns places into posts here knows eighths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct LatticePoint {
    /// Eighths of a post north of the area's southern edge.
    pub row: i32,
    /// Eighths of a post east of the area's western edge.
    pub col: i32,
}

impl LatticePoint {
    /// The lattice point at (row, col), in eighths of a post.
    pub const fn new(row: i32, col: i32) -> Self {
        Self { row, col }
    }

    /// The post at this place, if it lies on one.
    pub fn post(self) -> Option<Post> {
        let on_post = self.row % LATTICE_PER_POST == 0 && self.col % LATTICE_PER_POST == 0;
        on_post.then(|| Post::new(self.row / LATTICE_PER_POST, self.col / LATTICE_PER_POST))
    }
}

impl From<Post> for LatticePoint {
    fn from(post: Post) -> Self {
        Self { row: post.row * LATTICE_PER_POST, col: post.col * LATTICE_PER_POST }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_post_survives_the_lattice_and_back() {
        let post = Post::new(-3, 17);
        assert_eq!(LatticePoint::from(post).post(), Some(post));
        assert_eq!(LatticePoint::new(8, 9).post(), None);
    }
}
