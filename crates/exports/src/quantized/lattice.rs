//! The lattice that all tiles of a level share: 32,767 steps of longitude and latitude to a tile, and one ladder of
//! heights for all of them, so that what two tiles have on their common border is equal, bit for bit.

/// Steps along a tile, and of the ladder of heights.
pub(crate) const STEPS: i64 = 32_767;

/// A vertex on the lattice of the finest level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Node {
    /// Steps east of 180 degrees west.
    pub x: i64,
    /// Steps north of the south pole.
    pub y: i64,
    /// Rungs of the ladder of heights.
    pub h: i64,
    /// The direction the ground faces, along the Earth's own axes.
    pub normal: [f64; 3],
}

/// Degrees along a side of a tile of a level.
pub(crate) fn tile_degrees(level: u32) -> f64 {
    180.0 / f64::from(1_u32 << level)
}

/// The ladder of heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ladder {
    /// Height of its foot, metres above the ellipsoid: a whole number.
    pub foot_m: f64,
    /// Metres between rungs: a power of two, so that foot and top are exact as 32-bit floats.
    pub rung_m: f64,
}

impl Ladder {
    /// The finest ladder that reaches from `low` to `high`.
    pub(crate) fn over(low: f64, high: f64) -> Self {
        let foot_m = low.floor();
        let mut rung_m = 1.0 / 128.0;
        while rung_m * (STEPS as f64 - 1.0) < high - foot_m {
            rung_m *= 2.0;
        }
        Self { foot_m, rung_m }
    }

    /// Height of its top.
    pub(crate) fn top_m(&self) -> f64 {
        self.foot_m + STEPS as f64 * self.rung_m
    }

    /// The rung next to a height.
    pub(crate) fn rung(&self, height_m: f64) -> i64 {
        (((height_m - self.foot_m) / self.rung_m).round() as i64).clamp(0, STEPS)
    }

    /// Height of a rung.
    pub(crate) fn height_m(&self, rung: i64) -> f64 {
        self.foot_m + rung as f64 * self.rung_m
    }
}

/// Steps of a level at a longitude and latitude.
pub(crate) fn steps(level: u32, [longitude, latitude]: [f64; 2]) -> [i64; 2] {
    let step = STEPS as f64 / tile_degrees(level);
    [((longitude + 180.0) * step).round() as i64, ((latitude + 90.0) * step).round() as i64]
}

/// Longitude and latitude of steps of a level.
pub(crate) fn lon_lat(level: u32, [x, y]: [i64; 2]) -> [f64; 2] {
    let step = tile_degrees(level) / STEPS as f64;
    [x as f64 * step - 180.0, y as f64 * step - 90.0]
}

/// Columns or rows of tiles that hold steps `low` to `high`, both inside; the last line of a tile is its own.
pub(crate) fn tiles(low: i64, high: i64) -> std::ops::RangeInclusive<i64> {
    let first = low.div_euclid(STEPS);
    first..=(high - 1).div_euclid(STEPS).max(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ladder_reaches_every_height_and_its_ends_are_exact_floats() {
        for (low, high) in [(0.0, 1.0), (-86.3, 250.0), (961.7, 2900.0), (-430.0, 8848.0)] {
            let ladder = Ladder::over(low, high);
            for height_m in [low, high, (low + high) / 2.0] {
                let back = ladder.height_m(ladder.rung(height_m));
                assert!((back - height_m).abs() <= ladder.rung_m / 2.0, "{height_m}: {back}");
            }
            for end in [ladder.foot_m, ladder.top_m()] {
                assert_eq!(f64::from(end as f32), end);
            }
        }
        assert_eq!(Ladder::over(0.0, 200.0).rung_m, 1.0 / 128.0);
    }

    #[test]
    fn neighbouring_tiles_share_the_line_between_them() {
        assert_eq!(tiles(0, STEPS), 0..=0);
        assert_eq!(tiles(STEPS, STEPS + 1), 1..=1);
        assert_eq!(tiles(STEPS - 1, 2 * STEPS + 1), 0..=2);
        assert_eq!(tiles(STEPS, STEPS), 1..=1);
        let place = lon_lat(13, steps(13, [-116.5, 35.25]));
        assert!((place[0] + 116.5).abs() < 1e-6 && (place[1] - 35.25).abs() < 1e-6);
    }
}
