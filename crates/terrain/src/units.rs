//! Metres at doors, integers inside: height quanta, the spacing of the working grid, and where it lies.

use super::Post;

/// Height quanta in a metre; every height the compiler handles is a whole number of them.
pub const QUANTA_PER_METRE: i32 = 128;
/// Metres of a degree of latitude, about.
pub const DEGREE_M: f64 = 111_320.0;

/// A length in metres, where a bare number could be mistaken for posts or quanta.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Metres(pub f64);

/// Metres to quanta of 1/128 m, half away from zero.
///
/// `None` when the height is not finite or beyond ±131,071 m (24 bits of quanta, so that sums stay exact).
pub fn quanta_of_metres(metres: f64) -> Option<i32> {
    const METRES_MAX: f64 = 131_071.0;
    // The largest number below a half. Added and cut off it rounds as `round` does, which is a call where the processor
    // has no instruction for it: 8 ms instead of 23 for 3.9 million posts.
    const HALF: f64 = 0.499_999_999_999_999_94;
    let quanta = metres * f64::from(QUANTA_PER_METRE);
    (metres.abs() <= METRES_MAX).then_some((quanta + HALF.copysign(quanta)) as i32)
}

/// Quanta of 1/128 m to metres, exactly.
pub fn metres_of_quanta(quanta: i32) -> f64 {
    f64::from(quanta) / f64::from(QUANTA_PER_METRE)
}

/// The spacing of the working grid: a whole number of sixteenths of a metre.
///
/// An eighth of it is then a whole number of quanta of 1/128 m, so every lattice point has exact
/// coordinates in a load module: one lattice step is [`Spacing::quanta_per_lattice_step`] quanta.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Spacing {
    sixteenths: u32,
}

impl Spacing {
    /// The spacing of `sixteenths`/16 m; `None` for zero.
    pub fn from_sixteenths(sixteenths: u32) -> Option<Self> {
        (0 < sixteenths).then_some(Self { sixteenths })
    }

    /// The spacing of `metres`, when that is a positive multiple of 1/16 m below 1,000 km.
    pub fn from_metres(metres: f64) -> Option<Self> {
        let sixteenths = metres * 16.0;
        let whole = sixteenths.fract() == 0.0 && 1.0 <= sixteenths && sixteenths <= 16.0e6;
        whole.then_some(Self { sixteenths: sixteenths as u32 })
    }

    /// Sixteenths of a metre between posts.
    pub fn sixteenths(self) -> u32 {
        self.sixteenths
    }

    /// Metres between posts.
    pub fn metres(self) -> f64 {
        f64::from(self.sixteenths) / 16.0
    }

    /// Horizontal quanta (1/128 m) in one lattice step (an eighth of a post).
    pub fn quanta_per_lattice_step(self) -> i32 {
        self.sixteenths as i32
    }

    /// Horizontal quanta (1/128 m) between posts.
    pub fn quanta_per_post(self) -> i32 {
        self.sixteenths as i32 * crate::LATTICE_PER_POST
    }

    /// How many posts make up `length`, when that is a whole positive number.
    pub fn posts_in(self, length: Metres) -> Option<i32> {
        let posts = length.0 * 16.0 / f64::from(self.sixteenths);
        (posts.fract() == 0.0 && 1.0 <= posts && posts <= f64::from(1 << 30)).then_some(posts as i32)
    }
}

/// Position and spacing of the working grid, in metres of the area's projected coordinate system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridFrame {
    /// Easting of post (0, 0), in metres.
    pub origin_east_m: f64,
    /// Northing of post (0, 0), in metres.
    pub origin_north_m: f64,
    /// Distance between neighbouring posts, the same both ways.
    pub spacing: Spacing,
}

impl GridFrame {
    /// Easting of a column of posts, in metres.
    pub fn east_m(&self, col: i32) -> f64 {
        self.origin_east_m + f64::from(col) * self.spacing.metres()
    }

    /// Northing of a row of posts, in metres.
    pub fn north_m(&self, row: i32) -> f64 {
        self.origin_north_m + f64::from(row) * self.spacing.metres()
    }

    /// Easting and northing of `post`, in metres.
    pub fn place_m(&self, post: Post) -> [f64; 2] {
        [self.east_m(post.col), self.north_m(post.row)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_round_half_away_from_zero() {
        assert_eq!(quanta_of_metres(0.5 / 128.0), Some(1));
        assert_eq!(quanta_of_metres(-0.5 / 128.0), Some(-1));
        assert_eq!(quanta_of_metres(f64::NAN), None);
        assert_eq!(quanta_of_metres(f64::INFINITY), None);
        assert_eq!(metres_of_quanta(quanta_of_metres(-12.25).unwrap()), -12.25);
    }

    #[test]
    fn heights_round_as_the_library_rounds() {
        let (mut draw, mut found) = (1u64, [0; 2]);
        for _ in 0..200_000 {
            draw = draw.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // Halves of quanta, and the numbers next to them.
            let half = f64::from((draw >> 40) as i32 - (1 << 23)) / 256.0;
            for metres in [half, half.next_up(), half.next_down(), half * 1.234_567] {
                let rounded = (metres * 128.0).round() as i32;
                assert_eq!(quanta_of_metres(metres), Some(rounded), "{metres}");
                found[usize::from(rounded < 0)] += 1;
            }
        }
        assert!(found.iter().all(|&count| 100_000 < count), "{found:?}");
    }

    #[test]
    fn a_spacing_is_a_multiple_of_a_sixteenth_metre() {
        assert_eq!(Spacing::from_metres(25.0).unwrap().quanta_per_lattice_step(), 400);
        assert_eq!(Spacing::from_metres(31.25).unwrap().sixteenths(), 500);
        assert!(Spacing::from_metres(25.27).is_none());
        assert!(Spacing::from_metres(0.0).is_none());
        assert_eq!(Spacing::from_metres(25.0).unwrap().posts_in(Metres(500.0)), Some(20));
        assert_eq!(Spacing::from_metres(25.0).unwrap().posts_in(Metres(510.0)), None);
    }

    #[test]
    fn a_post_lies_its_row_north_and_its_column_east_of_the_origin() {
        let spacing = Spacing::from_metres(31.25).unwrap();
        let grid = GridFrame { origin_east_m: 500_000.5, origin_north_m: 3_900_000.0, spacing };
        assert_eq!(grid.place_m(Post::new(0, 0)), [500_000.5, 3_900_000.0]);
        assert_eq!(grid.place_m(Post::new(-2, 4)), [500_125.5, 3_899_937.5]);
    }
}
