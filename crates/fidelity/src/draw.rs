//! Numbers that look drawn and are the same everywhere: SplitMix64 (Steele, Lea and Flood 2014), started anew for
//! each pair from the seed and the pair's number, so that no pair depends on another.

/// The fraction of the golden ratio, as an odd number: how far SplitMix64 steps.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// How often a pair that leaves the area is drawn again before it is left out.
const DRAWS_MAX: u32 = 1000;

/// The numbers of one pair, or of one place.
pub struct Draw(u64);

impl Draw {
    /// The numbers of a pair.
    pub fn new(seed: u64, index: u64) -> Self {
        Self(mix(seed ^ mix(index.wrapping_add(STEP))))
    }

    /// At least 0 and below 1, in steps of 2^-53.
    pub fn unit(&mut self) -> f64 {
        const STEPS: f64 = (1_u64 << 53) as f64;
        self.0 = self.0.wrapping_add(STEP);
        (mix(self.0) >> 11) as f64 / STEPS
    }

    /// A place of a rectangle from 0 to its size, each as likely as any other: east, then north.
    pub fn place(&mut self, [wide, high]: [f64; 2]) -> [f64; 2] {
        [wide * self.unit(), high * self.unit()]
    }

    /// Two places of a rectangle from 0 to its size: the first anywhere, the second in any direction from it and at any
    /// distance from `nearest` to `farthest`. `None` where none was found.
    pub fn pair(&mut self, [wide, high]: [f64; 2], [nearest, farthest]: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        // Nothing farther than the diagonal fits, so leaving it out changes no chance, only how often we draw.
        let farthest = farthest.min((wide * wide + high * high).sqrt());
        if farthest < nearest {
            return None;
        }
        (0..DRAWS_MAX).find_map(|_| {
            let [x, y] = self.place([wide, high]);
            let [east, north] = self.direction();
            let range = nearest + (farthest - nearest) * self.unit();
            let (to_x, to_y) = (x + range * east, y + range * north);
            let is_inside = 0.0 <= to_x && to_x <= wide && 0.0 <= to_y && to_y <= high;
            is_inside.then_some([[x, y], [to_x, to_y]])
        })
    }

    /// A direction, each as likely as any other: a point of the disc, moved to its rim. East, then north.
    fn direction(&mut self) -> [f64; 2] {
        /// Squared radius below which rounding would bend the direction.
        const HUB: f64 = 1e-6;
        loop {
            let [x, y] = [2.0 * self.unit() - 1.0, 2.0 * self.unit() - 1.0];
            let squared = x * x + y * y;
            if HUB < squared && squared <= 1.0 {
                // A square root is exact to the last bit on every machine; a sine is not.
                let length = squared.sqrt();
                return [x / length, y / length];
            }
        }
    }
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_pair_depend_on_seed_and_number_alone() {
        let first = |seed, index| Draw::new(seed, index).unit();
        assert_eq!(first(3, 7), first(3, 7));
        assert!(first(3, 7) != first(3, 8) && first(3, 7) != first(4, 7) && first(3, 7) != first(7, 3));
        // A change of this changes every published figure.
        assert_eq!(Draw::new(1, 0).unit().to_bits(), UNIT_OF_FIRST_PAIR);
    }

    const UNIT_OF_FIRST_PAIR: u64 = 4_602_881_968_005_306_593;

    #[test]
    fn units_and_directions_are_spread_evenly() {
        let (mut tenths, mut octants) = ([0_u32; 10], [0_u32; 8]);
        for index in 0..80_000 {
            let mut draw = Draw::new(9, index);
            tenths[(draw.unit() * 10.0) as usize] += 1;
            let [x, y] = draw.direction();
            assert!((x * x + y * y - 1.0).abs() < 1e-14);
            let octant = usize::from(x < 0.0) + 2 * usize::from(y < 0.0) + 4 * usize::from(x.abs() < y.abs());
            octants[octant] += 1;
        }
        // Six standard deviations.
        assert!(tenths.iter().all(|&count| count.abs_diff(8000) < 510), "{tenths:?}");
        assert!(octants.iter().all(|&count| count.abs_diff(10_000) < 562), "{octants:?}");
    }
}
