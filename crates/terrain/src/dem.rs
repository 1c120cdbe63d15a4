//! A window of the DEM: heights in quanta, laid out for the triangle scan.

use crate::{Post, PostRect};

/// Posts a lane load may read beyond the last one it wants.
const LANES: usize = 16;
/// Spare posts after the last row, so that a load from the last post stays in bounds.
const SPARE: usize = 64;

/// Heights at every post of a rectangle, in quanta of 1/128 m.
///
/// Rows are `stride` posts apart: the width rounded up to 16, plus at least 16. A load of 16 posts from any post
/// of the window is therefore in bounds, and the stride is never a power of two, so that the rows of a
/// tall triangle do not share cache sets. Padding holds 0 and means nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Dem {
    rect: PostRect,
    stride: usize,
    heights: Vec<i32>,
    lowest: i32,
    highest: i32,
    /// One bit per post, row-major without padding; empty when no post is void.
    void_bits: Vec<u64>,
    void_count: usize,
}

impl Dem {
    /// A window whose height at each post is `height(post)`; `None` there is a void, which needs
    /// [`Dem::fill_voids`] to get a height that keeps the mesh defined (0 until then).
    pub fn from_fn(rect: PostRect, mut height: impl FnMut(Post) -> Option<i32>) -> Self {
        let mut dem = Self::empty(rect);
        for row in rect.south..=rect.north {
            for col in rect.west..=rect.east {
                let post = Post::new(row, col);
                match height(post) {
                    Some(quanta) => {
                        let index = dem.index(post);
                        dem.heights[index] = quanta;
                    }
                    None => dem.mark_void(post),
                }
            }
        }
        dem.measure();
        dem
    }

    /// A window without voids, from rows of heights from south to north.
    ///
    /// # Panics
    /// When `heights` does not hold exactly the posts of `rect`.
    pub fn from_rows(rect: PostRect, heights: &[i32]) -> Self {
        assert_eq!(heights.len(), rect.post_count(), "a window holds one height per post");
        let mut dem = Self::empty(rect);
        let (stride, wide) = (dem.stride, rect.posts_wide());
        for (padded, row) in dem.heights.chunks_mut(stride).zip(heights.chunks(wide)) {
            padded[..wide].copy_from_slice(row);
        }
        dem.measure();
        dem
    }

    /// A window without voids, each of whose rows is written by `write_row(row, heights)`, south to north.
    ///
    /// Heights are measured while they are in the cache, so this is the fast way to make a window.
    pub fn from_row_fn(rect: PostRect, mut write_row: impl FnMut(i32, &mut [i32])) -> Self {
        let mut dem = Self::empty(rect);
        let (stride, wide) = (dem.stride, rect.posts_wide());
        (dem.lowest, dem.highest) = (i32::MAX, i32::MIN);
        for (padded, row) in dem.heights.chunks_mut(stride).zip(rect.south..=rect.north) {
            let heights = &mut padded[..wide];
            write_row(row, heights);
            for &height in &*heights {
                dem.lowest = dem.lowest.min(height);
                dem.highest = dem.highest.max(height);
            }
        }
        dem
    }

    /// One window of several that cover it together. A post that some of them share has the same height in all.
    pub fn joined(rect: PostRect, parts: &[&Self]) -> Self {
        let mut dem = Self::from_row_fn(rect, |row, heights| {
            for part in parts {
                let Some(both) = part.rect.intersection(&rect) else { continue };
                if both.south <= row && row <= both.north {
                    let [from, to] = [part.rect, rect].map(|of| (both.west - of.west) as usize);
                    let wide = both.posts_wide();
                    heights[to..to + wide].copy_from_slice(&part.row(row)[from..from + wide]);
                }
            }
        });
        for part in parts.iter().filter(|part| 0 < part.void_count) {
            let both = part.rect.intersection(&rect);
            for post in both.iter().flat_map(PostRect::posts).filter(|&post| part.is_void(post)) {
                if !dem.is_void(post) {
                    dem.mark_void(post);
                }
            }
        }
        dem
    }

    fn empty(rect: PostRect) -> Self {
        let padded = rect.posts_wide().next_multiple_of(LANES) + LANES;
        let stride = if padded.is_power_of_two() { padded + LANES } else { padded };
        let heights = vec![0; stride * rect.posts_high() + SPARE];
        Self { rect, stride, heights, lowest: 0, highest: 0, void_bits: Vec::new(), void_count: 0 }
    }

    fn measure(&mut self) {
        let wide = self.rect.posts_wide();
        let rows = self.heights.chunks(self.stride).take(self.rect.posts_high());
        let (mut lowest, mut highest) = (i32::MAX, i32::MIN);
        for row in rows {
            for &height in &row[..wide] {
                lowest = lowest.min(height);
                highest = highest.max(height);
            }
        }
        (self.lowest, self.highest) = (lowest, highest);
    }

    fn index(&self, post: Post) -> usize {
        debug_assert!(self.rect.contains(post), "post {post} lies outside the window");
        (post.row - self.rect.south) as usize * self.stride + (post.col - self.rect.west) as usize
    }

    fn bit(&self, post: Post) -> usize {
        self.rect.index(post)
    }

    fn mark_void(&mut self, post: Post) {
        if self.void_bits.is_empty() {
            self.void_bits = vec![0; self.rect.post_count().div_ceil(64)];
        }
        let bit = self.bit(post);
        self.void_bits[bit / 64] |= 1 << (bit % 64);
        self.void_count += 1;
    }

    /// The posts this window holds.
    pub fn rect(&self) -> PostRect {
        self.rect
    }

    /// Height at `post` in quanta.
    ///
    /// # Panics
    /// When `post` lies outside the window.
    pub fn height(&self, post: Post) -> i32 {
        self.heights[self.index(post)]
    }

    /// Whether the source has no height at `post` (the one held here was filled in).
    pub fn is_void(&self, post: Post) -> bool {
        if self.void_bits.is_empty() {
            return false;
        }
        let bit = self.bit(post);
        self.void_bits[bit / 64] >> (bit % 64) & 1 == 1
    }

    /// How many posts are void.
    pub fn void_count(&self) -> usize {
        self.void_count
    }

    /// Sets a height at every void post, so that the mesh is defined; it stays a void.
    pub fn fill_voids(&mut self, mut height: impl FnMut(Post) -> i32) {
        for row in self.rect.south..=self.rect.north {
            for col in self.rect.west..=self.rect.east {
                let post = Post::new(row, col);
                if self.is_void(post) {
                    let index = self.index(post);
                    self.heights[index] = height(post);
                }
            }
        }
        self.measure();
    }

    /// Heights of one row, west to east, without padding.
    pub fn row(&self, row: i32) -> &[i32] {
        let start = (row - self.rect.south) as usize * self.stride;
        &self.heights[start..start + self.rect.posts_wide()]
    }

    /// The padded heights and the posts between rows, for the scan.
    pub fn padded(&self) -> (&[i32], usize) {
        (&self.heights, self.stride)
    }

    /// Lowest and highest height of the window, voids as filled.
    pub fn range(&self) -> (i32, i32) {
        (self.lowest, self.highest)
    }

    /// Every second post of `rect` in both directions, from its south-western one: a quarter of the posts. The posts of
    /// the result are counted in steps of two.
    ///
    /// # Panics
    /// When `rect` is not wholly inside.
    pub fn every_second(&self, rect: PostRect) -> Dem {
        assert!(self.rect.contains_rect(&rect), "posts are taken from inside the window that holds them");
        let half = rect.halved();
        let fine =
            |post: Post| Post::new(rect.south + 2 * (post.row - half.south), rect.west + 2 * (post.col - half.west));
        let mut coarse = Self::from_row_fn(half, |row, heights| {
            let from = fine(Post::new(row, half.west));
            let of_row = &self.row(from.row)[(from.col - self.rect.west) as usize..];
            heights.iter_mut().zip(of_row.iter().step_by(2)).for_each(|(to, &height)| *to = height);
        });
        if !self.void_bits.is_empty() {
            half.posts().filter(|&post| self.is_void(fine(post))).for_each(|post| coarse.mark_void(post));
        }
        coarse
    }

    /// A copy of part of this window.
    ///
    /// # Panics
    /// When `rect` is not wholly inside.
    pub fn window(&self, rect: PostRect) -> Dem {
        assert!(self.rect.contains_rect(&rect), "a window is cut from inside the window that holds it");
        let mut part = Self::empty(rect);
        let (stride, wide) = (part.stride, rect.posts_wide());
        let offset = (rect.west - self.rect.west) as usize;
        for (padded, row) in part.heights.chunks_mut(stride).zip(rect.south..=rect.north) {
            padded[..wide].copy_from_slice(&self.row(row)[offset..offset + wide]);
        }
        if !self.void_bits.is_empty() {
            for row in rect.south..=rect.north {
                for col in rect.west..=rect.east {
                    if self.is_void(Post::new(row, col)) {
                        part.mark_void(Post::new(row, col));
                    }
                }
            }
        }
        part.measure();
        part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sloping(rect: PostRect) -> Dem {
        Dem::from_fn(rect, |post| Some(post.row * 100 + post.col))
    }

    #[test]
    fn a_window_of_a_window_holds_the_same_heights() {
        let dem = sloping(PostRect::of_size(20, 37));
        let rect = PostRect::new(Post::new(3, 5), Post::new(9, 30));
        let part = dem.window(rect);
        for row in 3..=9 {
            assert_eq!(part.row(row), &dem.row(row)[5..=30]);
        }
        assert_eq!(part.range(), (305, 930));
    }

    #[test]
    fn a_window_written_row_by_row_equals_one_written_post_by_post() {
        let rect = PostRect::new(Post::new(-3, 5), Post::new(9, 30));
        let by_row = Dem::from_row_fn(rect, |row, heights| {
            for (height, col) in heights.iter_mut().zip(rect.west..) {
                *height = row * 100 + col;
            }
        });
        assert_eq!(by_row, sloping(rect));
    }

    #[test]
    fn every_second_post_of_a_part_is_taken_from_its_south_west_corner() {
        let rect = PostRect::new(Post::new(0, 0), Post::new(9, 12));
        let hole = Post::new(5, 7);
        let dem = Dem::from_fn(rect, |post| (post != hole).then_some(post.row * 100 + post.col));
        let coarse = dem.every_second(PostRect::new(Post::new(3, 5), Post::new(8, 11)));
        assert_eq!(coarse.rect(), PostRect::new(Post::new(1, 2), Post::new(3, 5)));
        assert_eq!(coarse.row(2), [505, 0, 509, 511]);
        assert!(coarse.is_void(Post::new(2, 3)) && coarse.void_count() == 1);
    }

    #[test]
    fn sixteen_posts_can_be_loaded_from_any_post() {
        let dem = sloping(PostRect::of_size(5, 33));
        let (heights, stride) = dem.padded();
        assert!(4 * stride + 32 + 16 <= heights.len());
        assert!(!stride.is_power_of_two());
    }

    #[test]
    fn voids_are_remembered_when_filled_and_when_cut() {
        let hole = Post::new(2, 2);
        let mut dem = Dem::from_fn(PostRect::of_size(5, 5), |post| (post != hole).then_some(7));
        dem.fill_voids(|_| 9);
        let part = dem.window(PostRect::new(Post::new(1, 1), Post::new(3, 3)));
        assert!(part.is_void(hole) && !part.is_void(Post::new(1, 1)));
        assert_eq!((part.height(hole), part.void_count()), (9, 1));
        assert_eq!(dem.range(), (7, 9));
    }
}
