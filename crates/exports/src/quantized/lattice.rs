//! The lattice that all tiles of a level share: 32,767 steps of longitude and latitude to a tile, and 1,024 steps of
//! height to a metre, so that two tiles have the same vertices on their common border.
//!
//! A tile is written with heights between its own lowest and highest one, as readers bound it by these; so what two
//! tiles say of a vertex on their border differs by half a step of each at most, 5 mm where ground rises 300 m.

/// Steps along a tile, and between its lowest and its highest height.
pub(crate) const STEPS: i64 = 32_767;

/// A vertex on the lattice of the finest level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Node {
    /// Steps east of 180 degrees west.
    pub x: i64,
    /// Steps north of the south pole.
    pub y: i64,
    /// Steps of height above the ellipsoid.
    pub h: i64,
    /// The direction the ground faces, along the Earth's own axes.
    pub normal: [f64; 3],
}

/// Degrees along a side of a tile of a level.
pub(crate) fn tile_degrees(level: u32) -> f64 {
    180.0 / f64::from(1_u32 << level)
}

/// Steps of height to a metre: whole numbers of them are exact as 32-bit floats up to 16 km.
const HEIGHT_STEPS: f64 = 1024.0;

/// The step next to a height.
pub(crate) fn height_steps(height_m: f64) -> i64 {
    (height_m * HEIGHT_STEPS).round() as i64
}

/// The height of a step.
pub(crate) fn height_m(steps: i64) -> f64 {
    steps as f64 / HEIGHT_STEPS
}

/// The heights of a tile, from its lowest to its highest, in steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ladder {
    /// The lowest.
    pub low: i64,
    /// The highest.
    pub high: i64,
}

impl Ladder {
    /// That of some nodes.
    pub(crate) fn of(nodes: &[Node]) -> Self {
        let heights = || nodes.iter().map(|node| node.h);
        Self { low: heights().min().unwrap_or(0), high: heights().max().unwrap_or(0) }
    }

    /// Where a height lies between the lowest, 0, and the highest, [`STEPS`].
    pub(crate) fn rung(&self, h: i64) -> i64 {
        let range = self.high - self.low;
        // Level ground is its own lowest.
        if range == 0 { 0 } else { (2 * (h - self.low) * STEPS + range) / (2 * range) }
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
    fn a_ladder_reaches_from_the_lowest_to_the_highest_height_and_its_ends_are_exact_floats() {
        for (low, high) in [(0.0, 1.0), (-86.3, 250.0), (961.7, 2900.0), (-430.0, 8848.0), (5.0, 5.0)] {
            let node = |height_m: f64| Node { x: 0, y: 0, h: height_steps(height_m), normal: [0.0, 0.0, 1.0] };
            let ladder = Ladder::of(&[node(high), node(low)]);
            let [foot_m, top_m] = [ladder.low, ladder.high].map(height_m);
            for end in [foot_m, top_m] {
                assert_eq!(f64::from(end as f32), end);
            }
            for asked_m in [low, high, (2.0 * low + high) / 3.0] {
                let rung = ladder.rung(height_steps(asked_m));
                let back = foot_m + rung as f64 / STEPS as f64 * (top_m - foot_m);
                let half_step = (top_m - foot_m) / STEPS as f64 / 2.0 + 0.5 / HEIGHT_STEPS;
                assert!((back - asked_m).abs() <= half_step, "{asked_m}: {back}");
            }
            assert_eq!(ladder.rung(ladder.high), if low < high { STEPS } else { 0 });
        }
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
