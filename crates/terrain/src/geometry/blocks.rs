//! Lowest and highest heights of square blocks of posts: what a scan can leave out.

use std::cell::OnceCell;

use crate::Dem;

/// Side of a block, in posts.
pub(crate) const SIDE: usize = 8;
/// Blocks that are looked at together; a row has as many to spare at its end.
pub(crate) const TOGETHER: usize = 8;

/// The blocks of 8 x 8 posts of a window, from its south-west post on, measured when they are first needed.
#[derive(Clone, Debug)]
pub struct Blocks<'a> {
    dem: &'a Dem,
    heights: OnceCell<BlockHeights>,
}

impl<'a> Blocks<'a> {
    /// The blocks of a window; those at its far sides may be smaller.
    pub fn of(dem: &'a Dem) -> Self {
        Self { dem, heights: OnceCell::new() }
    }

    /// What heights they have.
    pub(crate) fn heights(&self) -> &BlockHeights {
        self.heights.get_or_init(|| BlockHeights::of(self.dem))
    }
}

/// The lowest and the highest height of each block of a window.
#[derive(Clone, Debug)]
pub(crate) struct BlockHeights {
    lowest: Vec<i32>,
    highest: Vec<i32>,
    stride: usize,
}

impl BlockHeights {
    fn of(dem: &Dem) -> Self {
        let (high, wide) = (dem.rect().posts_high(), dem.rect().posts_wide());
        let (heights, posts_stride) = dem.padded();
        let (mut lowest, mut highest) = (Vec::new(), Vec::new());
        let (mut low, mut top) = (vec![0; wide], vec![0; wide]);
        let rows: Vec<&[i32]> = heights.chunks(posts_stride).take(high).map(|row| &row[..wide]).collect();
        for band in rows.chunks(SIDE) {
            low.copy_from_slice(band[0]);
            top.copy_from_slice(band[0]);
            for row in &band[1..] {
                for ((low, top), &height) in low.iter_mut().zip(&mut top).zip(*row) {
                    *low = height.min(*low);
                    *top = height.max(*top);
                }
            }
            let spare = [0; TOGETHER];
            lowest.extend(low.chunks(SIDE).map(|posts| posts.iter().copied().fold(i32::MAX, i32::min)));
            lowest.extend(spare);
            highest.extend(top.chunks(SIDE).map(|posts| posts.iter().copied().fold(i32::MIN, i32::max)));
            highest.extend(spare);
        }
        Self { lowest, highest, stride: wide.div_ceil(SIDE) + TOGETHER }
    }

    /// Lowest and highest heights of eight blocks, from one on; those beyond the window are anything.
    #[inline(always)]
    pub fn ranges(&self, row: usize, col: usize) -> (&[i32], &[i32]) {
        let first = row * self.stride + col;
        (&self.lowest[first..][..TOGETHER], &self.highest[first..][..TOGETHER])
    }
}

#[cfg(test)]
mod tests {
    use crate::{Post, PostRect};

    use super::*;

    #[test]
    fn blocks_know_their_lowest_and_highest_posts() {
        let mut random = fastrand::Rng::with_seed(5);
        for (high, wide) in [(1, 1), (8, 8), (9, 7), (17, 40), (30, 65)] {
            let dem = Dem::from_fn(PostRect::of_size(high, wide), |_| Some(random.i32(-900..900)));
            let blocks = BlockHeights::of(&dem);
            let corners =
                (0..high).step_by(SIDE).flat_map(|south| (0..wide).step_by(SIDE).map(move |west| (south, west)));
            for (south, west) in corners {
                let (north, east) = ((south + SIDE).min(high) - 1, (west + SIDE).min(wide) - 1);
                let post = |row: usize, col: usize| Post::new(row as i32, col as i32);
                let of_block = PostRect::new(post(south, west), post(north, east));
                let heights: Vec<i32> = of_block.posts().map(|post| dem.height(post)).collect();
                let (low, top) = blocks.ranges(south / SIDE, west / SIDE);
                let expected = (heights.iter().min(), heights.iter().max());
                assert_eq!((low.first(), top.first()), expected, "{high} x {wide} at {south}, {west}");
            }
        }
    }
}
