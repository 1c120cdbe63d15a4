//! Whether the heights of one surface are feet where those of the other are metres.

use super::shift::Shift;

/// A foot in metres.
const FOOT_M: f64 = 0.3048;
/// How far a scale may be from that of feet, as a share of it.
const NEAR: f64 = 0.01;
/// How many times smaller than by the best shift the differences have to become.
const SMALLER: f64 = 5.0;
/// Places that a scale is found from, at least.
const PLACES_MIN: usize = 8;

/// The heights of one surface are feet, as far as can be told from those of the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feet {
    /// Which one's: 0 for A, 1 for B.
    pub which: usize,
    /// Root mean square of differences as the heights are, and with those of B in the unit of A.
    pub rms: [f64; 2],
}

impl Feet {
    /// From the heights of both at places, and the best shift; `None` where neither looks like feet.
    pub(super) fn of(heights: impl Iterator<Item = [Option<f64>; 2]>, shift: Option<&Shift>) -> Option<Self> {
        let both: Vec<[f64; 2]> = heights.filter_map(|[a, b]| Some([a?, b?])).collect();
        if both.len() < PLACES_MIN {
            return None;
        }
        let scale = scale(&both)?;
        let feet = [(0, FOOT_M), (1, 1.0 / FOOT_M)];
        let (which, exact) = feet.into_iter().find(|(_, exact)| (scale / exact - 1.0).abs() <= NEAR)?;
        let rms_with = |scale: f64| {
            let squares = both.iter().map(|[a, b]| (b / scale - a) * (b / scale - a)).sum::<f64>();
            (squares / both.len() as f64).sqrt()
        };
        let rms = [rms_with(1.0), rms_with(exact)];
        (SMALLER * rms[1] < shift?.rms_m[1]).then_some(Self { which, rms })
    }

    /// What is wrong, without a full stop.
    pub(super) fn in_words(&self) -> String {
        let [before, after] = self.rms;
        let (feet, metres, factor) = if self.which == 1 { ("B", "A", FOOT_M) } else { ("A", "B", 1.0 / FOOT_M) };
        format!(
            "heights of {feet} look like feet, those of {metres} like metres: with B times {factor:.4}, RMS falls from \
             {before:.2} to {after:.2}"
        )
    }
}

/// How much the heights of B rise where those of A rise by 1, by least squares; `None` where those of A are all one.
fn scale(both: &[[f64; 2]]) -> Option<f64> {
    let count = both.len() as f64;
    let [a_mean, b_mean] = [0, 1].map(|which| both.iter().map(|heights| heights[which]).sum::<f64>() / count);
    let product = |one: fn(f64, f64) -> f64| both.iter().map(|[a, b]| one(a - a_mean, b - b_mean)).sum::<f64>();
    let (squares, products) = (product(|a, _| a * a), product(|a, b| a * b));
    (0.0 < squares).then(|| products / squares)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said of ground of hills, and the same with `make` applied to it and noise of a metre.
    fn found(make: impl Fn(f64) -> f64) -> Option<Feet> {
        let mut dice = fidelity::Draw::new(4, 0);
        let both: Vec<[f64; 2]> = (0..300)
            .map(|_| {
                let height = 1500.0 + 400.0 * dice.unit();
                [height, make(height) + dice.unit() - 0.5]
            })
            .collect();
        let difference = |heights: &[f64; 2]| heights[1] - heights[0];
        let mean = both.iter().map(difference).sum::<f64>() / 300.0;
        let spread = both.iter().map(|both| (difference(both) - mean).powi(2)).sum::<f64>() / 300.0;
        let shift =
            Shift { by_m: [0.0, 0.0, -mean], error_m: [0.0; 3], is_level_told: false, rms_m: [0.0, spread.sqrt()] };
        Feet::of(both.into_iter().map(|both| both.map(Some)), Some(&shift))
    }

    #[test]
    fn a_surface_in_feet_is_told_from_one_that_is_raised_or_stretched_otherwise() {
        let feet = found(|height| height / FOOT_M).unwrap();
        assert!(feet.which == 1 && 3000.0 < feet.rms[0] && feet.rms[1] < 1.0, "{feet:?}");
        assert!(feet.in_words().starts_with("heights of B look like feet"), "{}", feet.in_words());
        let metres = found(|height| height * FOOT_M).unwrap();
        assert!(metres.which == 0 && metres.in_words().contains("B times 3.2808"), "{}", metres.in_words());
        for make in [|height| height + 30.0, |height| 2.0 * height, |height| 3.2 * height, |height: f64| -height] {
            assert_eq!(found(make), None);
        }
    }

    #[test]
    fn level_ground_and_few_places_tell_no_scale() {
        let shift = Shift { by_m: [0.0; 3], error_m: [0.0; 3], is_level_told: false, rms_m: [1000.0; 2] };
        let of = |count: usize, a: f64| {
            Feet::of(
                (0..count).map(|index| [Some(a), Some(a / FOOT_M)].map(|h| h.map(|h| h + index as f64 * a))),
                Some(&shift),
            )
        };
        assert_eq!(of(7, 10.0), None);
        assert_eq!(of(9, 0.0), None);
    }
}
