//! The feature lattice, on which every vertex of a feature stands.
//!
//! It is the finest power-of-two fraction of a post that is a whole number of quanta, at most 64 steps a post, so a
//! vertex has exact coordinates in a load module and every question about two features is one of whole numbers.

use terrain::{LatticePoint, Spacing};

/// Most lattice steps between neighbouring posts.
pub const STEPS_PER_POST_MAX: i32 = 64;

/// Farthest coordinate of a place, in steps: products of differences, in half steps, stay within 64 bits.
pub const COORDINATE_MAX: i32 = 1 << 28;

/// A place on the feature lattice, in steps from the area's south-west post.
///
/// The order (row, then column) breaks every tie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Place {
    /// Steps north of the area's southern edge.
    pub row: i32,
    /// Steps east of the area's western edge.
    pub col: i32,
}

impl Place {
    /// The place at (row, col), in steps.
    pub const fn new(row: i32, col: i32) -> Self {
        Self { row, col }
    }

    /// Columns east and rows north from here to `other`.
    pub fn to(self, other: Place) -> [i64; 2] {
        [i64::from(other.col) - i64::from(self.col), i64::from(other.row) - i64::from(self.row)]
    }

    /// The squared distance to `other`, in squared steps.
    pub fn squared_to(self, other: Place) -> i64 {
        let [east, north] = self.to(other);
        east * east + north * north
    }
}

impl From<Place> for LatticePoint {
    fn from(Place { row, col }: Place) -> Self {
        Self::new(row, col)
    }
}

/// Twice the area of the triangle `a`, `b`, `c`: positive where it turns left. Exact for every place.
pub fn turn(a: Place, b: Place, c: Place) -> i64 {
    let ([ax, ay], [bx, by]) = (a.to(b), a.to(c));
    ax * by - ay * bx
}

/// How steps, posts and quanta go together in one area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeatureLattice {
    spacing: Spacing,
    steps_per_post: i32,
}

impl FeatureLattice {
    /// The feature lattice of a working grid.
    pub fn of(spacing: Spacing) -> Self {
        let fraction = 1 << spacing.quanta_per_post().trailing_zeros().min(STEPS_PER_POST_MAX.trailing_zeros());
        Self { spacing, steps_per_post: fraction }
    }

    /// Steps between neighbouring posts: a power of two, 8 to 64.
    pub fn steps_per_post(self) -> i32 {
        self.steps_per_post
    }

    /// Quanta of 1/128 m in a step.
    pub fn quanta_per_step(self) -> i32 {
        self.spacing.quanta_per_post() / self.steps_per_post
    }

    /// Metres in a step.
    pub fn metres_per_step(self) -> f64 {
        terrain::metres_of_quanta(self.quanta_per_step())
    }

    /// Whole steps in `metres`, rounded down.
    pub fn steps_in(self, metres: f64) -> i64 {
        (metres / self.metres_per_step()) as i64
    }

    /// The place nearest to a position in posts (east, north); `None` when it is not finite or too far away.
    pub fn place_of(self, posts: [f64; 2]) -> Option<Place> {
        let [col, row] = posts.map(|axis| (axis * f64::from(self.steps_per_post) + 0.5).floor());
        let near = |steps: f64| steps.abs() <= f64::from(COORDINATE_MAX);
        (near(col) && near(row)).then(|| Place::new(row as i32, col as i32))
    }

    /// Posts east and north of the area's south-west post.
    pub fn posts_of(self, place: Place) -> [f64; 2] {
        [place.col, place.row].map(|steps| f64::from(steps) / f64::from(self.steps_per_post))
    }

    /// The length between two places, in quanta, rounded down.
    pub fn length(self, a: Place, b: Place) -> i64 {
        let scale = i128::from(self.quanta_per_step());
        (i128::from(a.squared_to(b)) * scale * scale).unsigned_abs().isqrt() as i64
    }

    /// The most a way of a grade may rise between two neighbouring places, in quanta, rounded down. `flat` quanta of
    /// it are level, but no more than three quarters.
    pub fn rise_max(self, a: Place, b: Place, grade_ppm: u32, flat: i32) -> i32 {
        let scale = i128::from(self.quanta_per_step()) * i128::from(grade_ppm);
        // Quanta times parts per million.
        let whole = (i128::from(a.squared_to(b)) * scale * scale).unsigned_abs().isqrt();
        let level = (u128::from(flat.unsigned_abs()) * u128::from(grade_ppm)).min(whole / 4 * 3);
        ((whole - level) / 1_000_000).min(1 << 28) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(spacing_m: f64, steps: i32, quanta: i32) {
        let lattice = FeatureLattice::of(Spacing::from_metres(spacing_m).unwrap());
        assert_eq!((lattice.steps_per_post(), lattice.quanta_per_step()), (steps, quanta), "{spacing_m} m");
    }

    #[test]
    fn a_step_is_the_finest_power_of_two_fraction_of_a_post_that_is_whole_quanta() {
        check(25.0, 64, 50);
        check(31.25, 32, 125);
        check(10.0, 64, 20);
        check(1.0, 64, 2);
        check(0.0625, 8, 1);
        check(1.0625, 8, 17);
    }

    #[test]
    fn a_position_far_away_or_not_finite_has_no_place() {
        let lattice = FeatureLattice::of(Spacing::from_metres(25.0).unwrap());
        assert_eq!(lattice.place_of([1.0, -0.5]), Some(Place::new(-32, 64)));
        assert_eq!(lattice.place_of([f64::NAN, 0.0]), None);
        assert_eq!(lattice.place_of([0.0, f64::INFINITY]), None);
        assert_eq!(lattice.place_of([1e9, 0.0]), None);
    }

    #[test]
    fn a_rise_is_rounded_down_once() {
        let lattice = FeatureLattice::of(Spacing::from_metres(25.0).unwrap());
        let (a, b) = (Place::new(0, 0), Place::new(0, 64));
        assert_eq!(lattice.length(a, b), 3200);
        assert_eq!(lattice.rise_max(a, b, 60_000, 0), 192);
        assert_eq!(lattice.rise_max(a, Place::new(1, 1), 20_000, 0), 1);
        assert_eq!(lattice.rise_max(a, b, 60_000, 800), 144);
        assert_eq!(lattice.rise_max(a, b, 60_000, 3200), 48);
    }
}
