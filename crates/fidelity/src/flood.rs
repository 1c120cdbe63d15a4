//! Where water runs: every post drains to one of its eight neighbours, all the way to the border or a void.
//!
//! Depressions are flooded from outside (priority flood, Barnes, Lehman and Mulla 2014): the lowest post of the shore
//! is taken next, and what lies below it is flooded to its level. A post then drains down the steepest way of the
//! flooded ground (D8), and where that is level, back the way the flood came. Either way it drains to a post that was
//! flooded before it, so there are no circles, and one pass backwards adds up how many posts drain through each.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use crate::PostHeights;

/// Heights are compared in 64ths of a quantum, so that gentle slopes of a TIN are slopes; 24 bits of quanta fit.
const PARTS: f64 = 64.0;
const UNREACHED: u32 = u32::MAX;

/// Water on one surface.
pub(crate) struct Flood {
    /// How many posts drain through each, itself included; 0 for voids.
    pub drained: Vec<u32>,
    /// How deep each lies under its flood, in quanta.
    pub depth: Vec<f32>,
}

/// Offsets of the eight neighbours, straight ones first.
pub(crate) const AROUND: [(i32, i32); 8] = [(0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)];

/// Floods a surface and drains it.
pub(crate) fn flood(posts: &PostHeights) -> Flood {
    let heights: Vec<i32> = posts.quanta().iter().map(|&quanta| (quanta * PARTS).round() as i32).collect();
    let mut flood = Filling { posts, level: heights.clone(), to: vec![UNREACHED; heights.len()], order: Vec::new() };
    flood.fill();
    let depth = flood.level.iter().zip(&heights).map(|(&level, &height)| (level - height) as f32 / PARTS as f32);
    let depth = depth.collect();
    Flood { drained: flood.drain(), depth }
}

/// The neighbours of a post that are posts and not void, by index, with their number in [`AROUND`].
pub(crate) fn neighbours(posts: &PostHeights, index: usize) -> impl Iterator<Item = (usize, usize)> {
    let (wide, high) = (posts.wide() as i32, posts.high() as i32);
    let (row, col) = (index as i32 / wide, index as i32 % wide);
    AROUND.iter().enumerate().filter_map(move |(number, (up, right))| {
        let (row, col) = (row + up, col + right);
        let is_post = 0 <= row && row < high && 0 <= col && col < wide;
        let index = (row * wide + col) as usize;
        (is_post && !posts.is_void(index)).then_some((number, index))
    })
}

struct Filling<'a> {
    posts: &'a PostHeights,
    /// Height of the flooded ground.
    level: Vec<i32>,
    /// Where each post drains to: itself where it leaves the ground.
    to: Vec<u32>,
    /// Posts from the first flooded one to the last.
    order: Vec<u32>,
}

impl Filling<'_> {
    fn fill(&mut self) {
        self.order.reserve(self.level.len());
        // The lowest first, among equals the earliest.
        let mut shore = BinaryHeap::new();
        let mut flooded = VecDeque::new();
        let mut count = 0_u32;
        let posts = self.posts;
        for index in posts.known().filter(|&index| is_outlet(posts, index)) {
            self.to[index] = index as u32;
            shore.push(Reverse((self.level[index], count, index as u32)));
            count += 1;
        }
        while let Some(here) = flooded.pop_front().or_else(|| shore.pop().map(|Reverse((.., index))| index)) {
            self.order.push(here);
            let level = self.level[here as usize];
            for (_, next) in neighbours(self.posts, here as usize) {
                if self.to[next] != UNREACHED {
                    continue;
                }
                self.to[next] = here;
                if self.level[next] <= level {
                    self.level[next] = level;
                    flooded.push_back(next as u32);
                } else {
                    shore.push(Reverse((self.level[next], count, next as u32)));
                    count += 1;
                }
            }
        }
    }

    fn drain(&mut self) -> Vec<u32> {
        for &post in &self.order {
            let here = post as usize;
            if self.to[here] != post {
                self.to[here] = self.steepest(here).unwrap_or(self.to[here]);
            }
        }
        let mut drained = vec![0; self.level.len()];
        for &post in self.order.iter().rev() {
            drained[post as usize] += 1;
            let to = self.to[post as usize];
            if to != post {
                drained[to as usize] += drained[post as usize];
            }
        }
        drained
    }

    /// The neighbour down the steepest way, if one is lower.
    fn steepest(&self, here: usize) -> Option<u32> {
        const STRAIGHT_NEIGHBOURS: usize = 4;
        let mut best = (0.0, None);
        for (number, next) in neighbours(self.posts, here) {
            let fall = f64::from(self.level[here] - self.level[next]);
            let fall = if number < STRAIGHT_NEIGHBOURS { fall } else { fall * std::f64::consts::FRAC_1_SQRT_2 };
            if best.0 < fall {
                best = (fall, Some(next as u32));
            }
        }
        best.1
    }
}

/// Whether water leaves the ground at a post: on the border, and beside a void.
fn is_outlet(posts: &PostHeights, index: usize) -> bool {
    let (row, col) = (index / posts.wide(), index % posts.wide());
    let is_border = row == 0 || row + 1 == posts.high() || col == 0 || col + 1 == posts.wide();
    is_border || (posts.has_voids() && neighbours(posts, index).count() < AROUND.len())
}

#[cfg(test)]
mod tests {
    use terrain::{Dem, Post, PostRect};

    use super::*;

    fn posts(rows: usize, cols: usize, height: impl Fn(Post) -> Option<i32>) -> PostHeights {
        let dem = Dem::from_fn(PostRect::of_size(rows, cols), height);
        PostHeights::of_dem(&dem, dem.rect())
    }

    #[test]
    fn a_plane_drains_straight_down() {
        let found = flood(&posts(5, 9, |post| Some(post.col * 10)));
        for row in 1..4 {
            // Posts on the border keep their water, so the easternmost column drains nowhere else.
            let drained: Vec<u32> = (0..9).map(|col| found.drained[row * 9 + col]).collect();
            assert_eq!(drained, [8, 7, 6, 5, 4, 3, 2, 1, 1]);
        }
        assert!(found.depth.iter().all(|&depth| depth == 0.0));
    }

    #[test]
    fn a_basin_is_flooded_to_its_lowest_shore_and_spills_there() {
        // A bowl 10 wide with a notch in its eastern rim.
        let bowl = |post: Post| {
            let rim = post.row == 0 || post.col == 0 || post.row == 10 || post.col == 10;
            Some(if post == Post::new(4, 10) {
                300
            } else if rim {
                500
            } else {
                100 + post.col
            })
        };
        let found = flood(&posts(11, 11, bowl));
        for row in 1..10 {
            for col in 1..10 {
                assert_eq!(found.depth[row * 11 + col], (300 - 100 - col as i32) as f32);
            }
        }
        assert_eq!(found.drained[4 * 11 + 10], 81 + 1);
    }

    #[test]
    fn all_water_leaves_and_none_appears() {
        for seed in 0..5 {
            let ground = posts(40, 33, |post| {
                let mixed = (post.row * 7919 + post.col * 104_729 + seed * 31) % 1009;
                (mixed % 41 != 0).then_some(mixed + 20 * post.row)
            });
            let found = flood(&ground);
            let out: u32 =
                ground.known().filter(|&post| is_outlet(&ground, post)).map(|post| found.drained[post]).sum();
            assert_eq!(out as usize, ground.known().count(), "seed {seed}");
        }
    }
}
