//! What becomes of void posts: an error, a smooth filling, or a hole.
//!
//! Heights for voids grow inwards from the posts around them, one ring of posts at a time, each the mean of its
//! known neighbours (sides weigh twice as much as corners). That is decided on the raster, before any tile looks at
//! it, so two tiles see the same height at a void on their seam.

use terrain::PostRect;

use crate::{Raster, SourceError};

/// What becomes of void posts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoidPolicy {
    /// A void is an error.
    Fail,
    /// Voids at most this many posts (of the source, straight or diagonal) from a height get one and are voids no
    /// longer; any other is an error.
    FillWithin(u32),
    /// Voids stay void: no weight, no statistics, and a height only to keep the mesh defined.
    Hole,
}

/// How many posts of the source were void.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VoidSummary {
    /// Got a height and are voids no longer.
    pub filled: usize,
    /// Are void.
    pub left: usize,
}

/// Rounds of smoothing per ring of posts filled, and at most.
const ROUNDS_PER_RING: usize = 4;
const ROUNDS_MAX: usize = 64;

impl Raster {
    /// Settles what its void posts are, and gives every one a height.
    ///
    /// # Errors
    /// When there are voids and the policy does not allow them, or nothing but voids.
    pub fn settle_voids(&mut self, policy: VoidPolicy) -> Result<VoidSummary, SourceError> {
        let count = self.voids.count;
        let path = || self.frame.path.clone();
        if count == 0 {
            return Ok(VoidSummary::default());
        }
        if count == self.window.post_count() {
            return Err(SourceError::AllVoid { path: path(), found: count });
        }
        let first = self.voids.iter().next().expect("there are voids");
        let summary = match policy {
            VoidPolicy::Fail => {
                return Err(SourceError::Voids { path: path(), found: count, first: self.place(first) });
            }
            VoidPolicy::Hole => {
                Filling::new(self).grow(u32::MAX).write(self);
                VoidSummary { filled: 0, left: count }
            }
            VoidPolicy::FillWithin(limit) => {
                let filling = Filling::new(self).grow(limit);
                if let Some(first) = filling.first_unknown(self) {
                    let (found, first) = (count - filling.filled.len(), self.place(first));
                    return Err(SourceError::VoidsTooFar { path: path(), found, limit, first });
                }
                filling.smooth().write(self);
                self.voids.clear();
                VoidSummary { filled: count, left: 0 }
            }
        };
        self.voids.settled = true;
        Ok(summary)
    }
}

impl Raster {
    /// Sets a height at every void post, a smooth one within `within` posts of a height; returns the indices of these.
    pub(crate) fn fill_around(&mut self, within: u32) -> Vec<usize> {
        let near = Filling::new(self).grow(within).smooth();
        let filled = near.filled.clone();
        near.grow(u32::MAX).write(self);
        self.voids.settled = true;
        filled
    }
}

/// Samples of the window while voids are being filled.
struct Filling {
    window: PostRect,
    samples: Vec<f32>,
    known: Vec<bool>,
    /// Filled so far, ring by ring.
    filled: Vec<usize>,
    rings: usize,
}

impl Filling {
    fn new(raster: &Raster) -> Self {
        let count = raster.window.post_count();
        let samples = (0..count).map(|index| raster.samples.get(index) as f32).collect();
        let known = (0..count).map(|index| !raster.voids.contains(index)).collect();
        Self { window: raster.window, samples, known, filled: Vec::new(), rings: 0 }
    }

    /// Fills ring after ring, at most `rings` of them.
    fn grow(mut self, rings: u32) -> Self {
        let border = |index: &usize| !self.known[*index] && self.neighbours(*index).any(|(next, _)| self.known[next]);
        let mut ring: Vec<usize> = (0..self.known.len()).filter(border).collect();
        let mut queued = vec![false; self.known.len()];
        for _ in 0..rings {
            if ring.is_empty() {
                break;
            }
            let heights: Vec<f32> = ring.iter().map(|&index| self.mean_of_known(index)).collect();
            for (&index, height) in ring.iter().zip(heights) {
                (self.samples[index], self.known[index]) = (height, true);
            }
            let mut next_ring = Vec::new();
            for &index in &ring {
                for (next, _) in self.neighbours(index) {
                    if !self.known[next] && !queued[next] {
                        queued[next] = true;
                        next_ring.push(next);
                    }
                }
            }
            self.filled.append(&mut ring);
            ring = next_ring;
            self.rings += 1;
        }
        self
    }

    /// Relaxes the filled posts towards the mean of their sides: a membrane held by the heights around it. What is
    /// not known yet is no height, whatever the file marks it with, and holds nothing.
    fn smooth(mut self) -> Self {
        self.filled.sort_unstable();
        for _ in 0..(self.rings * ROUNDS_PER_RING).min(ROUNDS_MAX) {
            for place in 0..self.filled.len() {
                let index = self.filled[place];
                let sides = self.neighbours(index).filter(|&(next, weight)| weight == SIDE && self.known[next]);
                let (sum, count) = sides
                    .fold((0.0, 0.0), |(sum, count), (next, _)| (sum + f64::from(self.samples[next]), count + 1.0));
                if 0.0 < count {
                    self.samples[index] = (sum / count) as f32;
                }
            }
        }
        self
    }

    fn mean_of_known(&self, index: usize) -> f32 {
        let known = self.neighbours(index).filter(|&(next, _)| self.known[next]);
        let (sum, weights) = known.fold((0.0, 0.0), |(sum, weights), (next, weight)| {
            (sum + weight * f64::from(self.samples[next]), weights + weight)
        });
        (sum / weights) as f32
    }

    /// The up to eight neighbours of a post inside the window, with their weights, in row-major order.
    fn neighbours(&self, index: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
        let (wide, high) = (self.window.posts_wide() as isize, self.window.posts_high() as isize);
        let (row, col) = (index as isize / wide, index as isize % wide);
        AROUND.into_iter().filter_map(move |(up, right, weight)| {
            let (row, col) = (row + up, col + right);
            let inside = 0 <= row && row < high && 0 <= col && col < wide;
            inside.then_some(((row * wide + col) as usize, weight))
        })
    }

    fn first_unknown(&self, raster: &Raster) -> Option<usize> {
        raster.voids.iter().find(|&index| !self.known[index])
    }

    fn write(&self, raster: &mut Raster) {
        for &index in &self.filled {
            raster.samples.set(index, self.samples[index].into());
        }
    }
}

const SIDE: f64 = 2.0;
const CORNER: f64 = 1.0;
const AROUND: [(isize, isize, f64); 8] = [
    (-1, -1, CORNER),
    (-1, 0, SIDE),
    (-1, 1, CORNER),
    (0, -1, SIDE),
    (0, 1, SIDE),
    (1, -1, CORNER),
    (1, 0, SIDE),
    (1, 1, CORNER),
];
