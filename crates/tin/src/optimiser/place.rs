//! Where a vertex stands while it is being moved, and the Morton curve along which what is near in the plane becomes
//! near in memory.

use terrain::{FEATURE_STEPS_MAX, LatticePoint, PostRect, QUANTA_PER_METRE};

use crate::optimiser::hold::Hold;

/// Steps of the working lattice between posts: fine enough that rounding costs nothing (measured), and so coarse that
/// every orientation is exact.
pub(crate) const PER_POST: i32 = 64;

const _: () = assert!(FEATURE_STEPS_MAX <= PER_POST, "vertices of features stand on the working lattice");

/// A place in 64ths of a post from the tile's south-west post.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(crate) struct Place {
    pub y: i32,
    pub x: i32,
}

impl Place {
    pub const fn new(x: i32, y: i32) -> Self {
        Self { y, x }
    }

    /// The place of a point of a tile, on a lattice with so many steps to a post.
    pub fn of(point: LatticePoint, tile: PostRect, steps_per_post: i32) -> Self {
        let step = PER_POST / steps_per_post;
        Self { y: (point.row - tile.south * steps_per_post) * step, x: (point.col - tile.west * steps_per_post) * step }
    }

    /// The point here on a lattice with so many steps to a post.
    ///
    /// # Panics
    /// When the place lies between its points.
    pub fn lattice_point(self, tile: PostRect, steps_per_post: i32) -> LatticePoint {
        let step = PER_POST / steps_per_post;
        assert!(self.x % step == 0 && self.y % step == 0, "a finished vertex stands on the lattice");
        LatticePoint::new(tile.south * steps_per_post + self.y / step, tile.west * steps_per_post + self.x / step)
    }

    /// Posts east and north of the south-west post.
    #[inline(always)]
    pub fn posts(self) -> (f64, f64) {
        const POST: f64 = 1.0 / PER_POST as f64;
        (f64::from(self.x) * POST, f64::from(self.y) * POST)
    }

    /// The first row of posts at or north of here.
    #[inline(always)]
    pub fn row_from(self) -> i32 {
        (self.y + PER_POST - 1) / PER_POST
    }

    /// Squared distance in steps.
    pub fn squared_distance(self, other: Self) -> i64 {
        let (x, y) = (i64::from(self.x - other.x), i64::from(self.y - other.y));
        x * x + y * y
    }

    /// Doubled signed area of `a`, `b`, `c` in squared steps; positive when counter-clockwise.
    #[inline(always)]
    pub fn orient(a: Self, b: Self, c: Self) -> i64 {
        let (bx, by) = (i64::from(b.x - a.x), i64::from(b.y - a.y));
        let (cx, cy) = (i64::from(c.x - a.x), i64::from(c.y - a.y));
        bx * cy - by * cx
    }
}

/// The square of a quarter of a post, in steps.
const LEAST_ALTITUDE_SQUARED: f64 = (PER_POST / 4 * (PER_POST / 4)) as f64;

/// Whether a triangle beside features is one that ground may have. A sound one is, but where it stands like a wall
/// between a corner of a feature and one that may move, less than a post aside: of that no post tells. One that is not
/// sound is as good as its given corners permit: these may stand closer together than a sound triangle is high, and
/// slopes between them are wanted. Of two such corners the third stands off by a quarter of a post; three have a
/// triangle, whatever its shape. None may stand like a wall.
pub(crate) fn is_fit(at: [Place; 3], heights: [f64; 3], holds: [Hold; 3], quanta_per_step: f64) -> bool {
    let is_given = holds.map(Hold::is_fixed);
    let area = Place::orient(at[0], at[1], at[2]);
    if Shape::Sound.admits(at[0], at[1], at[2]) {
        let is_between = holds.iter().any(|hold| hold.has(Hold::FEATURE)) && is_given.contains(&false);
        return !(is_between && is_low(at, area) && is_wall(at, heights, quanta_per_step));
    }
    let stands = match is_given {
        [true, true, true] => 0 < area,
        [true, true, false] => stands_off(area, at[0], at[1]),
        [false, true, true] => stands_off(area, at[1], at[2]),
        [true, false, true] => stands_off(area, at[2], at[0]),
        _ => false,
    };
    stands && !is_wall(at, heights, quanta_per_step)
}

/// Whether a triangle is less than a post high over its longest side.
fn is_low(at: [Place; 3], area: i64) -> bool {
    let long = |k: usize| at[k].squared_distance(at[(k + 1) % 3]);
    let longest = long(0).max(long(1)).max(long(2)) as f64;
    (area as f64).powi(2) < longest * f64::from(PER_POST * PER_POST)
}

/// Whether a corner of a triangle is farther above or below its longest side than aside of it, and by more than half a
/// metre: beside a road no ground looks like that where another triangle may lie.
fn is_wall(at: [Place; 3], heights: [f64; 3], quanta_per_step: f64) -> bool {
    const LEAST: f64 = 0.5 * QUANTA_PER_METRE as f64;
    let long = |k: usize| at[k].squared_distance(at[(k + 1) % 3]);
    let [a, b, c] = match (0..3).max_by_key(|&k| long(k)) {
        Some(1) => [1, 2, 0],
        Some(2) => [2, 0, 1],
        _ => [0, 1, 2],
    };
    let [east, north] = [at[b].x - at[a].x, at[b].y - at[a].y].map(f64::from);
    let squared = long(a) as f64;
    let share = (f64::from(at[c].x - at[a].x) * east + f64::from(at[c].y - at[a].y) * north) / squared;
    let off = (heights[c] - heights[a] - share * (heights[b] - heights[a])).abs();
    let aside = Place::orient(at[0], at[1], at[2]).abs() as f64 / squared.sqrt() * quanta_per_step;
    LEAST < off && aside < off
}

fn stands_off(area: i64, a: Place, b: Place) -> bool {
    let base = a.squared_distance(b) as f64;
    0 < area && base * LEAST_ALTITUDE_SQUARED <= area as f64 * area as f64
}

/// Whether a triangle has an angle below 5 degrees: sound, but no ground looks like that.
pub(crate) fn is_needle(a: Place, b: Place, c: Place) -> bool {
    /// Squared sine of 5 degrees.
    const SINE_SQUARED: f64 = 0.007_596_123_493_895_97;
    let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(from, to)| from.squared_distance(to) as f64);
    // The sine of an angle is the doubled area over the product of the sides at it, the two longest at the smallest.
    let doubled_area = Place::orient(a, b, c) as f64;
    doubled_area * doubled_area * ab.min(bc).min(ca) < SINE_SQUARED * ab * bc * ca
}

/// What a triangle may look like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Of a doubled area of a quarter of a square post and a quarter of a post high, at least. That no triangle turns
    /// over keeps the mesh an embedding; that none is a needle keeps its slopes sane. Without the second rule one in
    /// 400 on the desert stood steeper than 75 degrees, a dark crack in the ground to a driver; it costs
    /// a thousandth of the RMS residual.
    Sound,
    /// Large enough, whatever its slopes: where a residual has to be met.
    Large,
    /// Seen from above at all.
    Upright,
}

impl Shape {
    /// Whether the triangle `a`, `b`, `c` has it.
    #[inline(always)]
    pub fn admits(self, a: Place, b: Place, c: Place) -> bool {
        const LEAST_AREA: i64 = (PER_POST * PER_POST / 4) as i64;
        let area = Place::orient(a, b, c);
        match self {
            Shape::Upright => 0 < area,
            Shape::Large => LEAST_AREA <= area,
            Shape::Sound => {
                let longest = a.squared_distance(b).max(b.squared_distance(c)).max(c.squared_distance(a)) as f64;
                LEAST_AREA <= area && longest * LEAST_ALTITUDE_SQUARED <= area as f64 * area as f64
            }
        }
    }
}

/// `items` in the order in which a Morton curve over whole posts meets them; ties by number.
pub(crate) fn along_curve(items: impl Iterator<Item = u32>, at: impl Fn(u32) -> Place) -> Vec<u32> {
    // One number for both sorts in half the time: a tile has fewer than 2^16 posts a side.
    let mut keyed: Vec<u64> = items.map(|item| key(at(item)) << 32 | u64::from(item)).collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|keyed| keyed as u32).collect()
}

fn key(at: Place) -> u64 {
    spread((at.x / PER_POST) as u32) | spread((at.y / PER_POST) as u32) << 1
}

/// The bits of a number with a gap after each.
fn spread(number: u32) -> u64 {
    let mut bits = u64::from(number);
    for (shift, mask) in [
        (16, 0x0000_ffff_0000_ffff),
        (8, 0x00ff_00ff_00ff_00ff),
        (4, 0x0f0f_0f0f_0f0f_0f0f),
        (2, 0x3333_3333_3333_3333),
        (1, 0x5555_5555_5555_5555),
    ] {
        bits = (bits | bits << shift) & mask;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn given_corners_permit_a_low_triangle_but_no_wall() {
        let places = [Place::new(0, 0), Place::new(8 * PER_POST, 0), Place::new(4 * PER_POST, PER_POST / 64)];
        let quanta_per_step = 4000.0 / f64::from(PER_POST);
        let given = Hold::GIVEN.and(Hold::FEATURE);
        let fit = |height: f64, holds| is_fit(places, [0.0, 0.0, height], holds, quanta_per_step);
        // It lies 62.5 quanta aside of the longest side, and 64 are half a metre.
        assert_eq!(
            [0.0, 60.0, 65.0, -500.0, 500.0].map(|height| fit(height, [given; 3])),
            [true, true, false, false, false]
        );
        assert!(!fit(0.0, [given, given, Hold::FREE]), "one that is not given stands off");
        assert!(is_fit(places, [0.0, 0.0, 500.0], [given; 3], f64::INFINITY), "where no spacing is known");
    }

    #[test]
    fn less_than_a_post_beside_a_feature_no_sound_triangle_stands_like_a_wall() {
        let given = Hold::GIVEN.and(Hold::FEATURE);
        // A third of a post aside of a long edge, 333 quanta.
        let fit = |aside: i32, height: f64, holds| {
            let places = [Place::new(0, 0), Place::new(8 * PER_POST, 0), Place::new(4 * PER_POST, aside)];
            is_fit(places, [0.0, 0.0, height], holds, 1000.0 / f64::from(PER_POST))
        };
        let beside = [given, given, Hold::FREE];
        assert_eq!(
            [0.0, 300.0, -400.0, 400.0].map(|height| fit(PER_POST / 3, height, beside)),
            [true, true, false, false]
        );
        assert!(fit(PER_POST / 3, 400.0, [given; 3]), "three given corners are what they are");
        assert!(fit(PER_POST / 3, 400.0, [Hold::GIVEN, Hold::GIVEN, Hold::FREE]), "those of seams are no feature's");
        assert!(fit(PER_POST, 2000.0, beside), "a post tells of that");
    }

    #[test]
    fn a_needle_has_an_angle_below_five_degrees() {
        // The tangent of 5 degrees is 0.08749.
        for (height, expected) in [(559, true), (560, false)] {
            let [a, b, c] = [(0, 0), (6400, 0), (6400, height)].map(|(x, y)| Place::new(x, y));
            for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
                assert_eq!(is_needle(a, b, c), expected, "{height} high");
            }
        }
    }
}
