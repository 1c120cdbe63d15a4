//! The exact fit of heights on a forest: least weighted distances to samples, while neighbours keep to their bounds.
//!
//! The cost of a subtree, as a function of its top's height, is convex and piecewise linear: two heaps hold where it
//! bends, one to the left of its least place and one to the right (the slope trick). A tie to a parent shifts the one
//! by its least and the other by its most difference.

use crate::heaps::{EMPTY, Heaps};

/// No bound: farther than any two heights are apart, and no sum of a few of them overflows.
pub(crate) const UNBOUNDED: i64 = 1 << 40;

/// A height that a node should have, and what each quantum below or above it costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sample {
    pub node: u32,
    pub height: i64,
    pub below: i64,
    pub above: i64,
}

/// Bounds of a height, or of a difference of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Range {
    pub least: i64,
    pub most: i64,
}

impl Range {
    /// Everything.
    pub const ALL: Self = Self { least: -UNBOUNDED, most: UNBOUNDED };

    /// The same difference, seen from the other node.
    pub fn turned(self) -> Self {
        Self { least: -self.most, most: -self.least }
    }

    /// The place in this range that is nearest to a height; where it is empty, its most.
    pub fn nearest(self, height: i64) -> i64 {
        height.max(self.least).min(self.most)
    }
}

/// A node of a forest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    pub node: u32,
    /// Its parent, a later member's node, with the range of the parent's height less its own.
    pub parent: Option<(u32, Range)>,
}

/// What is asked of the heights of nodes.
pub(crate) struct Wanted<'a> {
    /// Sorted by node.
    pub samples: &'a [Sample],
    /// Where the samples of each node begin, and one more.
    pub starts: &'a [u32],
    /// The range of each node, which weighs `hard`.
    pub ranges: &'a [Range],
    /// The weight of what is hard: more than all samples together.
    pub hard: i64,
    /// Of several heights that cost equally little, the one nearest to this.
    pub wishes: &'a [i64],
}

/// Gives the members of a forest, children before parents, the heights that cost least.
pub(crate) fn fit_forest(forest: &[Member], wanted: &Wanted, heights: &mut [i64]) {
    let mut heaps = Heaps::default();
    // Of each node: heaps of where its cost bends to the left, keys negated, and to the right of the least place.
    let mut bends = vec![[EMPTY; 2]; heights.len()];
    let mut best: Vec<Range> = Vec::with_capacity(forest.len());
    for &Member { node, parent } in forest {
        let [mut left, mut right] = bends[node as usize];
        let mut want = |height: i64, below: i64, above: i64| {
            if 0 < below {
                left = heaps.push(left, -height, below);
            }
            if 0 < above {
                right = heaps.push(right, height, above);
            }
        };
        let range = wanted.ranges[node as usize];
        let of_node = wanted.starts[node as usize] as usize..wanted.starts[node as usize + 1] as usize;
        for sample in &wanted.samples[of_node] {
            want(sample.height, sample.below, sample.above);
        }
        want(range.least, if range.least <= -UNBOUNDED { 0 } else { wanted.hard }, 0);
        want(range.most, 0, if UNBOUNDED <= range.most { 0 } else { wanted.hard });
        let least = settle(&mut heaps, &mut left, &mut right);
        best.push(least);
        if let Some((parent, difference)) = parent {
            let [to_left, to_right] = bends[parent as usize];
            let shifted = |heaps: &mut Heaps, to: u32, heap: u32, bound: i64, by: i64| {
                if UNBOUNDED <= bound.abs() {
                    return to;
                }
                heaps.shift(heap, by);
                heaps.meld(to, heap)
            };
            let left = shifted(&mut heaps, to_left, left, difference.least, -difference.least);
            let right = shifted(&mut heaps, to_right, right, difference.most, difference.most);
            bends[parent as usize] = [left, right];
        }
    }
    for (&Member { node, parent }, least) in forest.iter().zip(best).rev() {
        let mut range = least;
        if let Some((parent, difference)) = parent {
            let parent = heights[parent as usize];
            let allowed = Range {
                least: if UNBOUNDED <= difference.most { -UNBOUNDED } else { parent - difference.most },
                most: if difference.least <= -UNBOUNDED { UNBOUNDED } else { parent - difference.least },
            };
            range = Range { least: allowed.nearest(least.least), most: allowed.nearest(least.most) };
        }
        heights[node as usize] = range.nearest(wanted.wishes[node as usize]);
    }
}

/// Exchanges what lies on the wrong side between the two heaps; returns where the cost is least.
fn settle(heaps: &mut Heaps, left: &mut u32, right: &mut u32) -> Range {
    loop {
        let (low, high) = (heaps.top(*left), heaps.top(*right));
        match (low, high) {
            (Some((low, one)), Some((high, other))) if high < -low => {
                let weight = one.min(other);
                *left = heaps.take(*left, weight);
                *right = heaps.take(*right, weight);
                *left = heaps.push(*left, -high, weight);
                *right = heaps.push(*right, -low, weight);
            }
            _ => {
                let least = low.map_or(-UNBOUNDED, |(key, _)| -key);
                return Range { least, most: high.map_or(UNBOUNDED, |(key, _)| key) };
            }
        }
    }
}
