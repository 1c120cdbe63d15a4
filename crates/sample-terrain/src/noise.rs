//! Integer hashing and gradient noise: the only sources of chance in the sample terrain.
//!
//! Cells are hashed by their full 64-bit coordinates, so the ground never repeats, and noise uses only
//! `+ - * /`, so it is the same on any machine.

/// One independent stream of random numbers: the seed of the terrain mixed with the number of a layer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stream(u64);

impl Stream {
    pub(crate) fn new(seed: u64, layer: u64) -> Self {
        Self(mix(seed ^ mix(layer.wrapping_mul(0x9e37_79b9_7f4a_7c15))))
    }

    /// Two numbers in -1..1 that belong to the cell (east, north).
    pub(crate) fn pair(self, east: i64, north: i64) -> (f64, f64) {
        let cell =
            (east as u64).wrapping_mul(0xd6e8_feb8_6659_fd93) ^ (north as u64).wrapping_mul(0xa076_1d64_78bd_642f);
        let bits = mix(self.0 ^ cell);
        (unit(bits as u32), unit((bits >> 32) as u32))
    }

    /// Gradient noise with cells one unit wide, in about -1..1, mean 0.
    pub(crate) fn noise(self, x: f64, y: f64) -> f64 {
        let (floor_x, floor_y) = (x.floor(), y.floor());
        let (east, north) = (floor_x as i64, floor_y as i64);
        let (fx, fy) = (x - floor_x, y - floor_y);
        let corner = |right: i64, up: i64| {
            let (gx, gy) = self.pair(east + right, north + up);
            gx * (fx - right as f64) + gy * (fy - up as f64)
        };
        let (sx, sy) = (fade(fx), fade(fy));
        let low = corner(0, 0) + sx * (corner(1, 0) - corner(0, 0));
        let high = corner(0, 1) + sx * (corner(1, 1) - corner(0, 1));
        2.0 * (low + sy * (high - low))
    }
}

/// Scrambles all 64 bits (the finaliser of splitmix64).
fn mix(mut bits: u64) -> u64 {
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// 32 random bits as a number in -1..1.
fn unit(bits: u32) -> f64 {
    f64::from(bits as i32) / f64::from(1u32 << 31)
}

/// 0..1 to 0..1 with no slope and no curvature at either end, so that cells join smoothly.
fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_continuous_across_cells_and_bounded() {
        let stream = Stream::new(1, 1);
        for step in -400..400 {
            let (x, y) = (f64::from(step), f64::from(step) * 0.37);
            let step = stream.noise(x - 1e-9, y) - stream.noise(x + 1e-9, y);
            assert!(step.abs() < 1e-7 && stream.noise(x + 0.5, y).abs() < 1.5);
        }
    }

    #[test]
    fn noise_has_mean_zero_and_does_not_repeat_after_powers_of_two() {
        let stream = Stream::new(9, 4);
        let places = || (0..10_000).map(|i| (f64::from(i % 100) * 0.73, f64::from(i / 100) * 0.73));
        let mean = places().map(|(x, y)| stream.noise(x, y)).sum::<f64>() / 10_000.0;
        assert!(mean.abs() < 0.02, "{mean}");
        let again = places().filter(|&(x, y)| stream.noise(x, y) == stream.noise(x + 65_536.0, y)).count();
        assert!(again < 10, "{again} places are the same one period on");
    }
}
