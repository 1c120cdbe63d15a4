//! Posts of the working grid, rectangles of them, and the lattice on which every vertex of a TIN lies: eighths of a
//! post, or finer steps where features need them.

use serde::{Deserialize, Serialize};

/// One post of the working grid. Row 0 is the southern edge, column 0 the western one.
///
/// The order (row, then column) is the order in which ties are broken everywhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Post {
    /// Posts north of the southern edge.
    pub row: i32,
    /// Posts east of the western edge.
    pub col: i32,
}

impl Post {
    /// The post at (row, col).
    pub const fn new(row: i32, col: i32) -> Self {
        Self { row, col }
    }
}

impl std::fmt::Display for Post {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{},{}", self.row, self.col)
    }
}

/// A rectangle of posts that holds all four of its border lines.
///
/// `n` cells have `n + 1` posts a side; ask [`PostRect::posts_wide`] or [`PostRect::cells_wide`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct PostRect {
    /// Southernmost row.
    pub south: i32,
    /// Westernmost column.
    pub west: i32,
    /// Northernmost row, itself inside.
    pub north: i32,
    /// Easternmost column, itself inside.
    pub east: i32,
}

impl PostRect {
    /// The rectangle between two corner posts, both inside.
    ///
    /// # Panics
    /// When `north < south` or `east < west`: an empty rectangle has no posts to hold.
    pub fn new(south_west: Post, north_east: Post) -> Self {
        assert!(
            south_west.row <= north_east.row && south_west.col <= north_east.col,
            "a rectangle of posts runs from its south-west to its north-east post, got {south_west} to {north_east}"
        );
        Self { south: south_west.row, west: south_west.col, north: north_east.row, east: north_east.col }
    }

    /// The rectangle of `rows` x `cols` posts whose south-west post is (0, 0).
    pub fn of_size(rows: usize, cols: usize) -> Self {
        Self::new(Post::new(0, 0), Post::new(rows as i32 - 1, cols as i32 - 1))
    }

    /// Columns of posts.
    pub fn posts_wide(&self) -> usize {
        (self.east - self.west) as usize + 1
    }

    /// Rows of posts.
    pub fn posts_high(&self) -> usize {
        (self.north - self.south) as usize + 1
    }

    /// Columns of cells.
    pub fn cells_wide(&self) -> usize {
        (self.east - self.west) as usize
    }

    /// Rows of cells.
    pub fn cells_high(&self) -> usize {
        (self.north - self.south) as usize
    }

    /// All posts inside.
    pub fn post_count(&self) -> usize {
        self.posts_wide() * self.posts_high()
    }

    /// The south-west corner.
    pub fn south_west(&self) -> Post {
        Post::new(self.south, self.west)
    }

    /// The north-east corner.
    pub fn north_east(&self) -> Post {
        Post::new(self.north, self.east)
    }

    /// The four corners: south-west, south-east, north-east, north-west.
    pub fn corners(&self) -> [Post; 4] {
        [
            Post::new(self.south, self.west),
            Post::new(self.south, self.east),
            Post::new(self.north, self.east),
            Post::new(self.north, self.west),
        ]
    }

    /// Whether `post` lies inside or on a border line.
    pub fn contains(&self, post: Post) -> bool {
        self.south <= post.row && post.row <= self.north && self.west <= post.col && post.col <= self.east
    }

    /// Every post, row by row from the south-west.
    pub fn posts(&self) -> impl Iterator<Item = Post> + use<> {
        let Self { south, west, north, east } = *self;
        (south..=north).flat_map(move |row| (west..=east).map(move |col| Post::new(row, col)))
    }

    /// Place of a post that lies inside among [`PostRect::posts`].
    #[inline]
    pub fn index(&self, post: Post) -> usize {
        (post.row - self.south) as usize * self.posts_wide() + (post.col - self.west) as usize
    }

    /// Whether a post of it lies on a border line.
    pub fn has_on_border(&self, post: Post) -> bool {
        post.row == self.south || post.row == self.north || post.col == self.west || post.col == self.east
    }

    /// Whether all of `other` lies inside.
    pub fn contains_rect(&self, other: &PostRect) -> bool {
        self.contains(other.south_west()) && self.contains(other.north_east())
    }

    /// The part both rectangles hold, border lines included.
    pub fn intersection(&self, other: &PostRect) -> Option<PostRect> {
        let cut = PostRect {
            south: self.south.max(other.south),
            west: self.west.max(other.west),
            north: self.north.min(other.north),
            east: self.east.min(other.east),
        };
        (cut.south <= cut.north && cut.west <= cut.east).then_some(cut)
    }

    /// The rectangle in steps of two posts: an odd row or column at its far end is left out.
    pub fn halved(&self) -> PostRect {
        let (south, west) = (self.south.div_euclid(2), self.west.div_euclid(2));
        let half = |cells: usize| (cells / 2) as i32;
        PostRect { south, west, north: south + half(self.cells_high()), east: west + half(self.cells_wide()) }
    }

    /// The rectangle grown by `posts` on every side.
    pub fn grown(&self, posts: i32) -> PostRect {
        PostRect {
            south: self.south - posts,
            west: self.west - posts,
            north: self.north + posts,
            east: self.east + posts,
        }
    }
}

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
    fn a_rectangle_holds_all_four_border_lines() {
        let rect = PostRect::of_size(3, 5);
        assert_eq!((rect.posts_high(), rect.posts_wide()), (3, 5));
        assert_eq!((rect.cells_high(), rect.cells_wide()), (2, 4));
        assert!(rect.corners().iter().all(|&corner| rect.contains(corner)));
        assert!(!rect.contains(Post::new(3, 0)));
    }

    #[test]
    fn neighbouring_rectangles_intersect_in_the_line_they_share() {
        let west = PostRect::new(Post::new(0, 0), Post::new(4, 4));
        let east = PostRect::new(Post::new(0, 4), Post::new(4, 8));
        let seam = west.intersection(&east).expect("they share column 4");
        assert_eq!((seam.posts_wide(), seam.posts_high()), (1, 5));
        assert_eq!(west.intersection(&PostRect::new(Post::new(0, 5), Post::new(1, 6))), None);
    }

    #[test]
    fn a_post_survives_the_lattice_and_back() {
        let post = Post::new(-3, 17);
        assert_eq!(LatticePoint::from(post).post(), Some(post));
        assert_eq!(LatticePoint::new(8, 9).post(), None);
    }
}
