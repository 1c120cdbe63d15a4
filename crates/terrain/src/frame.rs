//! Where the working grid lies in the area's coordinate system.

use crate::{Post, Spacing};

/// Position and spacing of the working grid, in metres of the area's projected coordinate system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridFrame {
    /// Easting of post (0, 0), in metres.
    pub origin_east_m: f64,
    /// Northing of post (0, 0), in metres.
    pub origin_north_m: f64,
    /// Distance between neighbouring posts, the same both ways.
    pub spacing: Spacing,
}

impl GridFrame {
    /// Easting of a column of posts, in metres.
    pub fn east_m(&self, col: i32) -> f64 {
        self.origin_east_m + f64::from(col) * self.spacing.metres()
    }

    /// Northing of a row of posts, in metres.
    pub fn north_m(&self, row: i32) -> f64 {
        self.origin_north_m + f64::from(row) * self.spacing.metres()
    }

    /// Easting and northing of `post`, in metres.
    pub fn place_m(&self, post: Post) -> [f64; 2] {
        [self.east_m(post.col), self.north_m(post.row)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_post_lies_its_row_north_and_its_column_east_of_the_origin() {
        let spacing = Spacing::from_metres(31.25).unwrap();
        let grid = GridFrame { origin_east_m: 500_000.5, origin_north_m: 3_900_000.0, spacing };
        assert_eq!(grid.place_m(Post::new(0, 0)), [500_000.5, 3_900_000.0]);
        assert_eq!(grid.place_m(Post::new(-2, 4)), [500_125.5, 3_899_937.5]);
    }
}
