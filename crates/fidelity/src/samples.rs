//! The DEM between its posts: bilinear.

use terrain::{Dem, Post, PostRect};

/// A DEM that can be asked for heights at any place.
pub(crate) struct DemSamples<'a> {
    dem: &'a Dem,
    rect: PostRect,
    heights: &'a [i32],
    stride: usize,
}

impl<'a> DemSamples<'a> {
    pub fn new(dem: &'a Dem) -> Self {
        let (heights, stride) = dem.padded();
        Self { dem, rect: dem.rect(), heights, stride }
    }

    /// Height at a place (east and north in posts, inside the window), in quanta.
    pub fn height(&self, place: [f64; 2]) -> f64 {
        let ([col, row], [x, y]) = self.cell(place);
        let south = row * self.stride + col;
        let height = |index: usize| f64::from(self.heights[index]);
        let along = |west: f64, east: f64| west + x * (east - west);
        let low = along(height(south), height(south + 1));
        let high = along(height(south + self.stride), height(south + self.stride + 1));
        low + y * (high - low)
    }

    /// Whether a post that the height at a place depends on is void.
    pub fn is_void(&self, place: [f64; 2]) -> bool {
        let ([col, row], _) = self.cell(place);
        let post = |up: usize, right: usize| {
            Post::new(self.rect.south + (row + up) as i32, self.rect.west + (col + right) as i32)
        };
        [post(0, 0), post(0, 1), post(1, 0), post(1, 1)].into_iter().any(|post| self.dem.is_void(post))
    }

    /// The cell a place lies in, column first from the south-west, and where in it. A window without cells has no
    /// places to ask for.
    fn cell(&self, place: [f64; 2]) -> ([usize; 2], [f64; 2]) {
        let axis = |at: f64, first: i32, cells: usize| {
            let at = at - f64::from(first);
            let cell = (at.max(0.0) as usize).min(cells - 1);
            (cell, at - cell as f64)
        };
        let (col, x) = axis(place[0], self.rect.west, self.rect.cells_wide());
        let (row, y) = axis(place[1], self.rect.south, self.rect.cells_high());
        ([col, row], [x, y])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_those_of_posts_and_weighted_between_them() {
        let rect = PostRect::new(Post::new(10, -3), Post::new(12, 0));
        let dem = Dem::from_fn(rect, |post| Some(post.row * post.row * 10 + post.col * 100));
        let samples = DemSamples::new(&dem);
        for row in 10..=12 {
            for col in -3..=0 {
                let expected = f64::from(row * row * 10 + col * 100);
                assert_eq!(samples.height([f64::from(col), f64::from(row)]), expected);
            }
        }
        let (low, high) = (1000.0 - 275.0, 1210.0 - 275.0);
        assert_eq!(samples.height([-2.75, 10.5]), (low + high) / 2.0);
    }

    #[test]
    fn a_void_reaches_the_four_cells_around_it() {
        let rect = PostRect::of_size(5, 5);
        let dem = Dem::from_fn(rect, |post| (post != Post::new(2, 2)).then_some(0));
        let samples = DemSamples::new(&dem);
        assert!(samples.is_void([1.5, 1.5]) && samples.is_void([2.5, 2.9]));
        assert!(!samples.is_void([0.5, 2.0]) && !samples.is_void([3.1, 2.0]) && !samples.is_void([4.0, 4.0]));
    }
}
