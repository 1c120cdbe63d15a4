//! Posts of one working tile, packed into 32 bits.

use crate::{Post, PostRect};

/// A post of the working tile: row in the upper, column in the lower 16 bits, so that the order of the
/// numbers is the order in which ties are broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LocalPost(u32);

impl LocalPost {
    /// The post `row` rows north and `col` columns east of the tile's south-west post; both below 65,536.
    #[inline(always)]
    pub const fn new(row: i32, col: i32) -> Self {
        Self((row as u32) << 16 | col as u32 & 0xffff)
    }

    /// The packed number.
    #[inline(always)]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// The post of a packed number.
    #[inline(always)]
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// Rows north of the tile's southern edge.
    #[inline(always)]
    pub const fn row(self) -> i32 {
        (self.0 >> 16) as i32
    }

    /// Columns east of the tile's western edge.
    #[inline(always)]
    pub const fn col(self) -> i32 {
        (self.0 & 0xffff) as i32
    }

    /// Doubled signed area of `a`, `b`, `c`; positive when counter-clockwise.
    #[inline(always)]
    pub fn orient(a: Self, b: Self, c: Self) -> i64 {
        let (bx, by) = (i64::from(b.col() - a.col()), i64::from(b.row() - a.row()));
        let (cx, cy) = (i64::from(c.col() - a.col()), i64::from(c.row() - a.row()));
        bx * cy - by * cx
    }

    /// The canonical in-circle rule for the triangle `corners` entered over the edge opposite `apex`
    /// (one of the corners): inside, or on the circle and the smallest of the four is `p` or `apex`.
    ///
    /// Exact in 64 bits for tiles of at most [`crate::geometry::WORKING_POSTS_MAX`] posts a side: squared distances
    /// stay below 2^29, cross products below 2^29, so the three terms sum to less than 2^60.
    #[inline(always)]
    pub(crate) fn in_circle(corners: &[Self; 3], p: Self, apex: Self) -> bool {
        let relative = |q: Self| {
            let (x, y) = (i64::from(q.col() - p.col()), i64::from(q.row() - p.row()));
            (x, y, x * x + y * y)
        };
        let ((ax, ay, a), (bx, by, b), (cx, cy, c)) =
            (relative(corners[0]), relative(corners[1]), relative(corners[2]));
        let determinant = a * (bx * cy - by * cx) - b * (ax * cy - ay * cx) + c * (ax * by - ay * bx);
        if determinant != 0 {
            return 0 < determinant;
        }
        let smallest = corners[0].min(corners[1]).min(corners[2]).min(p);
        smallest == p || smallest == apex
    }

    /// The packed form of a post of the area.
    pub fn of(post: Post, tile: PostRect) -> Self {
        debug_assert!(tile.contains(post), "post {post} lies outside the tile");
        Self::new(post.row - tile.south, post.col - tile.west)
    }

    /// The post of the area.
    pub fn post(self, tile: PostRect) -> Post {
        Post::new(tile.south + self.row(), tile.west + self.col())
    }
}

/// An inclusive rectangle of posts of the working tile; may be empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LocalRect {
    /// First row.
    pub south: i32,
    /// First column.
    pub west: i32,
    /// Last row.
    pub north: i32,
    /// Last column.
    pub east: i32,
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;

    #[test]
    fn packed_posts_order_by_row_then_column() {
        assert!(LocalPost::new(1, 0) > LocalPost::new(0, 65_535));
        assert!(LocalPost::new(1, 1) > LocalPost::new(1, 0));
        assert_eq!((LocalPost::new(513, 65_535).row(), LocalPost::new(513, 65_535).col()), (513, 65_535));
    }

    #[test]
    fn the_packed_in_circle_test_agrees_with_the_exact_one() {
        let mut draw = Rng::with_seed(1);
        for side in [4, 20, 16_384] {
            for _ in 0..4000 {
                let mut posts = [(); 4].map(|()| Post::new(draw.i32(0..side), draw.i32(0..side)));
                if crate::geometry::orient(posts[0], posts[1], posts[2]) < 0 {
                    posts.swap(0, 1);
                }
                let [a, b, c, p] = posts;
                if crate::geometry::orient(a, b, c) == 0 || [a, b, c].contains(&p) {
                    continue;
                }
                let local = posts.map(|post| LocalPost::new(post.row, post.col));
                let exact = crate::geometry::in_circle_canonical(a, b, c, p);
                assert_eq!(LocalPost::in_circle(&[local[0], local[1], local[2]], local[3], local[2]), exact);
            }
        }
    }
}
