//! Where along a line of sight the triangles of one load module stand in its way.

use crate::QUANTA_PER_METRE;
use crate::lookup::{Corners, Lookup, STEPS};

/// A line of sight over a load module, in quanta from its south-west corner.
pub(crate) struct Line {
    pub(crate) start: [f64; 2],
    pub(crate) end: [f64; 2],
    /// From the start to the end.
    along: [f64; 2],
    pub(crate) length_squared: f64,
    /// Heights of both ends.
    heights: [f64; 2],
    /// Four times as much as its middle hangs below the straight line, for the curvature of the earth.
    sag: f64,
    /// Whether its end is known to lie below the ground.
    pub(crate) is_end_below: bool,
}

impl Line {
    /// The line between two places in quanta, over the load module with this corner.
    pub(crate) fn in_module(corner: [f64; 2], from: [f64; 3], to: [f64; 3], curvature: Curvature) -> Self {
        let local = |place: [f64; 3]| [place[0] - corner[0], place[1] - corner[1]];
        let (start, end) = (local(from), local(to));
        let along = [end[0] - start[0], end[1] - start[1]];
        let length_squared = along[0] * along[0] + along[1] * along[1];
        let sag = curvature.per_metre() * length_squared / f64::from(QUANTA_PER_METRE);
        Self { start, end, along, length_squared, heights: [from[2], to[2]], sag, is_end_below: false }
    }

    /// How far left of the line a place lies, and how far ahead, both times the length.
    pub(crate) fn seen(&self, place: [f64; 3]) -> (f64, f64) {
        let (dx, dy) = (place[0] - self.start[0], place[1] - self.start[1]);
        (self.along[0] * dy - self.along[1] * dx, self.along[0] * dx + self.along[1] * dy)
    }

    /// Whether a place that lies so far left of the line counts as left of it. One on the line counts as south of it,
    /// or west, since what lies on a line between load modules is looked up in the one north or east of it: so a line
    /// meets the same from both of its ends.
    pub(crate) fn is_left(&self, left: f64) -> bool {
        let is_west_left = self.along[0] == 0.0 && 0.0 < self.along[1];
        if self.along[0] < 0.0 || is_west_left { 0.0 <= left } else { 0.0 < left }
    }

    /// Height of the line at a share of it.
    pub(crate) fn height(&self, at: f64) -> f64 {
        self.heights[0] + at * (self.heights[1] - self.heights[0]) - self.sag * at * (1.0 - at)
    }

    /// The place at a share of it.
    pub(crate) fn place(&self, at: f64) -> [f64; 2] {
        [0, 1].map(|axis| self.start[axis] + at * self.along[axis])
    }

    /// The shares of it at which it has a height.
    pub(crate) fn shares_at(&self, height: f64) -> [Option<f64>; 2] {
        let (rise, over) = (self.heights[1] - self.heights[0] - self.sag, self.heights[0] - height);
        let within = |at: f64| (0.0..=1.0).contains(&at).then_some(at);
        if self.sag == 0.0 {
            return [within(-over / rise), None];
        }
        // The larger root of the two first, the other from their product: no difference of near numbers.
        let root = (rise * rise - 4.0 * self.sag * over).sqrt();
        let large = -0.5 * (rise + root.copysign(rise));
        [within(large / self.sag), within(over / large)]
    }

    /// The lowest it may be between two shares of it, or a little less.
    pub(crate) fn lowest(&self, [first, last]: [f64; 2]) -> f64 {
        let bow = last - first;
        self.height(first).min(self.height(last)) - self.sag * bow * bow / 4.0
    }

    /// Where the line goes below straight ground between two shares of it, by how far it is above the ground at both.
    fn enters(&self, [first, above_first]: [f64; 2], [last, above_last]: [f64; 2]) -> f64 {
        // How far above, over the part from 0 to 1: above_first + fall * part + bow * part^2, the smaller root.
        let bow = self.sag * (last - first) * (last - first);
        let fall = above_last - above_first - bow;
        let root = (fall * fall - 4.0 * bow * above_first).max(0.0).sqrt();
        let part = if above_first <= 0.0 { 0.0 } else { 2.0 * above_first / (root - fall) };
        (first + part.min(1.0) * (last - first)).clamp(0.0, 1.0)
    }

    /// Where the straight ground between two of its edges rises highest above a line that sags, and by how much; the
    /// edges themselves are looked at elsewhere.
    fn highest_between(&self, corners: &Corners) -> Option<[f64; 2]> {
        if self.sag == 0.0 {
            return None;
        }
        let [first, last] = part_over(corners, self)?;
        let slope = (last[1] - first[1]) / (last[0] - first[0]);
        let at = (1.0 + (slope - (self.heights[1] - self.heights[0])) / self.sag) / 2.0;
        let is_between = first[0] < at && at < last[0];
        is_between.then(|| [at, first[1] + slope * (at - first[0]) - self.height(at)])
    }
}

/// How the earth falls away below a level line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curvature(pub(crate) f64);

impl Curvature {
    /// The ground as a map has it.
    pub const NONE: Self = Self(0.0);

    /// A round earth of 6,371 km whose air bends light by `refraction` of that: 0 for none, 0.13 as is usual for light.
    /// More than all of it is taken as all.
    pub fn of_earth(refraction: f64) -> Self {
        const RADIUS_M: f64 = 6_371_000.0;
        // What is no number bends nothing.
        Self((1.0 - refraction.max(0.0)).max(0.0) / (2.0 * RADIUS_M))
    }

    /// Metres that the ground falls at a metre's distance; it falls with the square of that.
    pub fn per_metre(self) -> f64 {
        self.0
    }
}

/// Where along a line the triangles of the ground first rise above it; infinity when they do not.
pub(crate) fn hidden_at(lookup: &Lookup, side: u16, line: &Line) -> f64 {
    let mut nearest = f64::INFINITY;
    if 0.0 < line.length_squared {
        lookup.triangles_along(side, line.start, line.end, |corners| nearest = nearest.min(risen_at(&corners, line)));
    } else if let Some(height_m) = lookup.height_m(steps_of(line.start, side)) {
        // Straight up or down.
        let [before, after] = line.heights.map(|height| height - height_m * f64::from(QUANTA_PER_METRE));
        nearest = if 0.0 <= before && after < 0.0 { before / (before - after) } else { nearest };
    }
    nearest
}

/// The steps of a place in quanta of a load module.
pub(crate) fn steps_of(place: [f64; 2], side: u16) -> [i64; 2] {
    let end = i64::from(side) * STEPS;
    place.map(|quanta| ((quanta * STEPS as f64).round() as i64).clamp(0, end))
}

/// Where along a line one triangle first rises above it; infinity where it does not.
pub(crate) fn risen_at(corners: &Corners, line: &Line) -> f64 {
    let seen = corners.map(|corner| line.seen(corner.map(f64::from)));
    if seen.iter().all(|&(left, _)| 0.0 < left) || seen.iter().all(|&(left, _)| left < 0.0) {
        return f64::INFINITY;
    }
    // Between two edges the ground is straight, so that it rises above the line is seen where an edge is crossed.
    let (mut is_hidden, mut first, mut last) = (false, [f64::INFINITY, 0.0], [f64::NEG_INFINITY, 0.0]);
    for i in 0..3 {
        let ((left_a, ahead_a), (left_b, ahead_b)) = (seen[i], seen[(i + 1) % 3]);
        if (0.0 < left_a) == (0.0 < left_b) && (left_a < 0.0) == (left_b < 0.0) || left_a == left_b {
            continue;
        }
        let [height_a, height_b] = [corners[i], corners[(i + 1) % 3]].map(|corner| f64::from(corner[2]));
        let share = left_a / (left_a - left_b);
        let at = (ahead_a + share * (ahead_b - ahead_a)) / line.length_squared;
        let above = line.height(at) - (height_a + share * (height_b - height_a));
        is_hidden |= (0.0..=1.0).contains(&at) && above < 0.0;
        first = if at < first[0] { [at, above] } else { first };
        last = if last[0] < at { [at, above] } else { last };
    }
    let is_risen_between = || line.highest_between(corners).is_some_and(|[_, above]| 0.0 < above);
    let is_end_in = || line.is_end_below && first[0] <= 1.0 && 1.0 <= last[0];
    if is_hidden || is_end_in() || is_risen_between() { line.enters(first, last) } else { f64::INFINITY }
}

/// The least height in quanta of a line above the triangles of the ground, where it crosses their edges; infinity where
/// it crosses none. Between two edges the ground is straight, so beside the line's ends this is its least of all.
pub(crate) fn least_above(lookup: &Lookup, side: u16, line: &Line) -> f64 {
    let mut least = f64::INFINITY;
    if line.length_squared == 0.0 {
        return least;
    }
    lookup.triangles_along(side, line.start, line.end, |corners| {
        for i in 0..3 {
            let edge = [corners[i], corners[(i + 1) % 3]].map(|place| place.map(f64::from));
            let [(left_a, ahead_a), (left_b, ahead_b)] = edge.map(|place| line.seen(place));
            if (0.0 < left_a) == (0.0 < left_b) && (left_a < 0.0) == (left_b < 0.0) || left_a == left_b {
                continue;
            }
            let share = left_a / (left_a - left_b);
            let at = (ahead_a + share * (ahead_b - ahead_a)) / line.length_squared;
            if (0.0..=1.0).contains(&at) {
                let height = edge[0][2] + share * (edge[1][2] - edge[0][2]);
                least = least.min(line.height(at) - height);
            }
        }
        if let Some([_, above]) = line.highest_between(&corners) {
            least = least.min(-above);
        }
    });
    least
}

/// Where along a line a deck is first crossed, from above or from below; infinity when none is.
pub(crate) fn crossed_at(decks: &Lookup, side: u16, line: &Line) -> f64 {
    if line.length_squared == 0.0 {
        return crossed_upright(decks, side, line);
    }
    let mut nearest = f64::INFINITY;
    decks.triangles_along(side, line.start, line.end, |corners| {
        let Some([first, last]) = part_over(&corners, line) else { return };
        let [before, after] = [first, last].map(|[at, height]| above(line.height(at), height));
        if (0.0 <= before) != (0.0 <= after) {
            let at = first[0] + (last[0] - first[0]) * (before / (before - after));
            nearest = nearest.min(at.clamp(0.0, 1.0));
        }
    });
    nearest
}

/// How far a line is above a deck, in quanta. A place on a deck is above it, also where rounding has put it a
/// micrometre too low; so every crossing is found in exactly one of the triangles that meet there.
fn above(line: f64, deck: f64) -> f64 {
    const ROUNDING: f64 = 1e-6 * QUANTA_PER_METRE as f64;
    line - deck + ROUNDING
}

/// The part of a line over or under a triangle: how far along it begins and ends, and the triangle's height there.
pub(crate) fn part_over(corners: &Corners, line: &Line) -> Option<[[f64; 2]; 2]> {
    // Most triangles beside a line are not crossed.
    let is_left = corners.map(|corner| line.is_left(line.seen(corner.map(f64::from)).0));
    if is_left[0] == is_left[1] && is_left[1] == is_left[2] {
        return None;
    }
    let mut ends = [[0.0; 2]; 2];
    let mut count = 0;
    for i in 0..3 {
        // In one direction, whichever of its triangles asks: then both find the same bits.
        let (a, b) = (corners[i].min(corners[(i + 1) % 3]), corners[i].max(corners[(i + 1) % 3]));
        let (a, b) = (a.map(f64::from), b.map(f64::from));
        let ((left_a, ahead_a), (left_b, ahead_b)) = (line.seen(a), line.seen(b));
        // None or two of the edges are crossed.
        if line.is_left(left_a) == line.is_left(left_b) {
            continue;
        }
        let share = left_a / (left_a - left_b);
        let at = (ahead_a + share * (ahead_b - ahead_a)) / line.length_squared;
        ends[count] = [at, a[2] + share * (b[2] - a[2])];
        count += 1;
    }
    let [first, last] = if ends[0][0] <= ends[1][0] { ends } else { [ends[1], ends[0]] };
    if count < 2 || last[0] < 0.0 || 1.0 < first[0] {
        return None;
    }
    let at = |share: f64| [share, first[1] + (share - first[0]) / (last[0] - first[0]) * (last[1] - first[1])];
    let begin = if first[0] < 0.0 { at(0.0) } else { first };
    Some([begin, if 1.0 < last[0] { at(1.0) } else { last }])
}

/// The same of a line straight up or down.
fn crossed_upright(decks: &Lookup, side: u16, line: &Line) -> f64 {
    let mut nearest = f64::INFINITY;
    for (_, height_m, _) in decks.triangles(steps_of(line.start, side)) {
        let height = height_m * f64::from(QUANTA_PER_METRE);
        let [before, after] = line.heights.map(|line| above(line, height));
        if (0.0 <= before) != (0.0 <= after) {
            nearest = nearest.min((before / (before - after)).clamp(0.0, 1.0));
        }
    }
    nearest
}

/// Where along a line between two places in quanta a load module is entered.
pub(crate) fn entered_at(corner: [f64; 2], side: f64, from: [f64; 3], to: [f64; 3]) -> f64 {
    let enters = |axis: usize| {
        let (low, high) = (corner[axis], corner[axis] + side);
        match from[axis] {
            at if at < low => (low - at) / (to[axis] - at),
            at if high < at => (high - at) / (to[axis] - at),
            _ => 0.0,
        }
    };
    // The larger of two numbers one of which is not a number is the other.
    enters(0).max(enters(1)).clamp(0.0, 1.0)
}
