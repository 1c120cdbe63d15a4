//! The fixed ladder of gains: 64 rungs to the octave, so that a small edit rarely moves a threshold.

use std::sync::LazyLock;

/// Rungs to the octave.
const RUNGS: usize = 64;

/// 2^(k/64), from square roots and products, which every machine rounds alike.
static RUNG: LazyLock<[f64; RUNGS]> = LazyLock::new(|| {
    let step = (0..RUNGS.ilog2()).fold(2.0f64, |root, _| root.sqrt());
    let mut rungs = [1.0; RUNGS];
    for i in 1..RUNGS {
        rungs[i] = rungs[i - 1] * step;
    }
    rungs
});

/// The rung a gain stands on: `floor(64 log2(gain))`.
///
/// # Panics
/// When `gain` is not a positive, normal number.
pub fn ladder_bin(gain: f64) -> i32 {
    assert!(0.0 < gain && gain.is_normal(), "a selected post gains something, got {gain}");
    let bits = gain.to_bits();
    let octave = (bits >> 52) as i32 - 1023;
    let mantissa = f64::from_bits(bits & ((1 << 52) - 1) | 1023 << 52);
    octave * RUNGS as i32 + RUNG.partition_point(|&rung| rung <= mantissa) as i32 - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The smallest gain on a rung.
    fn gain_at_bin(bin: i32) -> f64 {
        let (octave, rung) = (bin.div_euclid(RUNGS as i32), bin.rem_euclid(RUNGS as i32));
        RUNG[rung as usize] * f64::from_bits(((octave + 1023) as u64) << 52)
    }

    #[test]
    fn every_rung_begins_at_its_smallest_gain() {
        for bin in -640..6400 {
            let gain = gain_at_bin(bin);
            assert_eq!(ladder_bin(gain), bin);
            assert_eq!(ladder_bin(f64::from_bits(gain.to_bits() - 1)), bin - 1);
        }
    }

    #[test]
    fn an_octave_has_sixty_four_rungs() {
        assert_eq!(ladder_bin(1.0), 0);
        assert_eq!(ladder_bin(2.0), 64);
        assert_eq!(ladder_bin(1.5), 37);
        assert_eq!(ladder_bin(0.5), -64);
    }
}
