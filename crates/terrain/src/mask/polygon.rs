//! Which posts lie inside a polygon: an even-odd scan along the rows, in exact integers.
//!
//! Corners are rounded once to 1/1024 of a post; from there on nothing is rounded. A post on a western or southern
//! edge is inside, one on an eastern or northern edge is outside, so polygons that share an edge share no post and
//! leave none between them.

use std::ops::Range;

use crate::{GridFrame, PostRect};

/// A polygon: rings of corners (east, north) in metres. A post is inside when an odd number of rings run around it,
/// so rings after the first are holes where they lie inside it. The closing corner may be repeated or not.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    /// Rings in any direction.
    pub rings: Vec<Vec<[f64; 2]>>,
}

/// Steps of a corner's place in one post.
const STEPS: i64 = 1 << 10;
/// No corner lies farther from the grid's origin than the largest grid there may be; beyond, it is moved in.
const STEPS_MAX: f64 = (STEPS << 30) as f64;

/// An edge that goes up: from `low` to `high`, both (east, north) in steps.
#[derive(Clone, Copy)]
struct Edge {
    low: [i64; 2],
    high: [i64; 2],
}

impl Polygon {
    /// The posts among which all that are inside lie.
    pub fn bounds(&self, frame: &GridFrame) -> Option<PostRect> {
        let corners = || self.rings.iter().flatten().map(|&corner| steps(corner, frame));
        let range = |axis: usize| {
            let (low, high) = (corners().map(|at| at[axis]).min()?, corners().map(|at| at[axis]).max()?);
            Some((low.div_euclid(STEPS) as i32, (high.div_euclid(STEPS) + 1) as i32))
        };
        let ((west, east), (south, north)) = (range(0)?, range(1)?);
        Some(PostRect { south, west, north, east })
    }

    /// Calls `claim` with ranges of row-major indices into `rect` that hold exactly the posts inside.
    pub fn visit_spans(&self, frame: &GridFrame, rect: PostRect, mut claim: impl FnMut(Range<usize>)) {
        let mut crossings = vec![Vec::new(); rect.posts_high()];
        for edge in self.rings.iter().flat_map(|ring| edges(ring, frame)) {
            for row in edge.rows(rect) {
                crossings[(row - rect.south) as usize].push(edge.first_col_east_of(row));
            }
        }
        let wide = rect.posts_wide();
        for (row, cols) in crossings.iter_mut().enumerate() {
            cols.sort_unstable();
            for pair in cols.chunks_exact(2) {
                let index = |col: i64| row * wide + (col - i64::from(rect.west)).clamp(0, wide as i64) as usize;
                let span = index(pair[0])..index(pair[1]);
                if !span.is_empty() {
                    claim(span);
                }
            }
        }
    }
}

/// The edges of a ring that are not level; those never decide, since a post's row is met half-open.
fn edges<'a>(ring: &'a [[f64; 2]], frame: &'a GridFrame) -> impl Iterator<Item = Edge> + 'a {
    let next = ring.iter().cycle().skip(1);
    let ends = ring.iter().zip(next).map(|(&from, &to)| (steps(from, frame), steps(to, frame)));
    ends.filter(|(from, to)| from[1] != to[1])
        .map(|(from, to)| if from[1] < to[1] { Edge { low: from, high: to } } else { Edge { low: to, high: from } })
}

fn steps(corner: [f64; 2], frame: &GridFrame) -> [i64; 2] {
    let step = |metres: f64, origin_m: f64| {
        let steps = (metres - origin_m) / frame.spacing.metres() * STEPS as f64;
        steps.clamp(-STEPS_MAX, STEPS_MAX).round() as i64
    };
    [step(corner[0], frame.origin_east_m), step(corner[1], frame.origin_north_m)]
}

impl Edge {
    /// Rows of `rect` the edge crosses: from its lower end on, its upper end left out.
    fn rows(&self, rect: PostRect) -> Range<i32> {
        let first = ceil_div(self.low[1].into(), STEPS.into());
        let end = ceil_div(self.high[1].into(), STEPS.into());
        let (south, past_north) = (i128::from(rect.south), i128::from(rect.north) + 1);
        first.clamp(south, past_north) as i32..end.clamp(south, past_north) as i32
    }

    /// The westernmost column on or east of where the edge crosses `row`.
    fn first_col_east_of(&self, row: i32) -> i64 {
        let [rise, run] = [self.high[1] - self.low[1], self.high[0] - self.low[0]].map(i128::from);
        let up = i128::from(row) * i128::from(STEPS) - i128::from(self.low[1]);
        let crossing = i128::from(self.low[0]) * rise + up * run;
        ceil_div(crossing, rise * i128::from(STEPS)) as i64
    }
}

fn ceil_div(dividend: i128, divisor: i128) -> i128 {
    -(-dividend).div_euclid(divisor)
}
