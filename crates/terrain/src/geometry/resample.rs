//! Bilinear resampling of one grid of posts onto another, a row at a time.
//!
//! Places are fixed-point: a 1/65536 of a source post (0.4 mm at 25 m, less than 0.2 mm from the true place). So
//! posts that coincide but for floating-point noise are copied exactly, a tap without weight is not read at all,
//! and blends of 16-bit heights are exact in `f64`: two weights of 16 bits each on 16 bits of height.

/// Weights of a tap add up to this.
pub const TAP_UNITS: u32 = 1 << 16;

/// The two source posts of a line between which a wanted post lies.
///
/// `far == near` exactly when `weight` is 0: a post that has no weight is not named, so a void there does not spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tap {
    /// The source post at or before the place.
    pub near: u32,
    /// The next one, where it has weight.
    pub far: u32,
    /// Weight of `far`, in 1/65536; always below 65536.
    pub weight: u32,
}

/// How far outside the source posts a place may lie and still count as the outermost one: 1/1000 of a post,
/// which is what is lost when positions are written in decimals.
const OUTSIDE_UNITS_MAX: i64 = TAP_UNITS as i64 / 1000;

/// `position` (in source posts) in fixed point, half up; saturates far outside any raster.
fn fixed(position: f64) -> i64 {
    (position * f64::from(TAP_UNITS) + 0.5).floor() as i64
}

/// The tap at `position`, counted in source posts from the first of `sources`; `None` when it lies more than
/// 1/1000 of a post outside them.
///
/// # Panics
/// When there are no source posts.
pub fn tap(position: f64, sources: u32) -> Option<Tap> {
    assert!(0 < sources, "a line to sample has at least one post");
    let last = i64::from(sources - 1) * i64::from(TAP_UNITS);
    let units = fixed(position);
    let inside = -OUTSIDE_UNITS_MAX <= units && units <= last + OUTSIDE_UNITS_MAX;
    if !inside || position.is_nan() {
        return None;
    }
    let units = units.clamp(0, last);
    let near = (units / i64::from(TAP_UNITS)) as u32;
    let weight = (units % i64::from(TAP_UNITS)) as u32;
    Some(Tap { near, far: near + u32::from(0 < weight), weight })
}

/// The source post nearest to `position`, half up; `None` when that is none of `sources`.
pub fn nearest(position: f64, sources: u32) -> Option<u32> {
    let units = fixed(position).saturating_add(i64::from(TAP_UNITS / 2));
    let index = units.div_euclid(i64::from(TAP_UNITS));
    (!position.is_nan() && 0 <= index && index < i64::from(sources)).then_some(index as u32)
}

/// Neighbouring taps whose source posts are neighbours too, so that they can be read in lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    near: usize,
    far: usize,
    count: usize,
}

/// The taps of a line, ready to be read from many rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Taps {
    runs: Vec<Run>,
    near_weights: Vec<f64>,
    far_weights: Vec<f64>,
}

impl Taps {
    /// Of `taps`, one for each post wanted, counted from source post `first`.
    ///
    /// # Panics
    /// When a tap lies before `first`.
    pub fn new(taps: &[Tap], first: u32) -> Self {
        let mut runs: Vec<Run> = Vec::new();
        for tap in taps {
            assert!(first <= tap.near, "taps lie on or after the first source post that is read");
            let (near, far) = ((tap.near - first) as usize, (tap.far - first) as usize);
            match runs.last_mut() {
                Some(run) if (run.near + run.count, run.far + run.count) == (near, far) => run.count += 1,
                _ => runs.push(Run { near, far, count: 1 }),
            }
        }
        let near_weights = taps.iter().map(|tap| f64::from(TAP_UNITS - tap.weight)).collect();
        let far_weights = taps.iter().map(|tap| f64::from(tap.weight)).collect();
        Self { runs, near_weights, far_weights }
    }

    /// How many posts are wanted.
    pub fn count(&self) -> usize {
        self.near_weights.len()
    }
}

/// Samples one source row at `taps`: each of `out` is 65536 times the value there, NaN where a NaN has weight.
///
/// # Panics
/// When `out` does not hold one post per tap, or a tap lies outside the row.
pub fn sample_row(row: &[f64], taps: &Taps, out: &mut [f64]) {
    assert_eq!(taps.count(), out.len(), "one tap per post");
    let mut start = 0;
    for run in &taps.runs {
        let posts = start..start + run.count;
        let near = row[run.near..run.near + run.count].iter().zip(&taps.near_weights[posts.clone()]);
        let far = row[run.far..run.far + run.count].iter().zip(&taps.far_weights[posts.clone()]);
        for ((out, (near, near_weight)), (far, far_weight)) in out[posts].iter_mut().zip(near).zip(far) {
            *out = near * near_weight + far * far_weight;
        }
        start += run.count;
    }
}

/// Heights in quanta from source values: `value * quanta_per_unit + quanta_at_zero`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightScale {
    /// Quanta of 1/128 m in one unit of the source.
    pub quanta_per_unit: f64,
    /// Quanta where the source says 0.
    pub quanta_at_zero: f64,
}

/// Blends two sampled rows and rounds once, half away from zero, to quanta. `near` and `far` are the rows that `tap`
/// names, and may be the same. What a NaN gives means nothing.
///
/// # Panics
/// When the rows differ in length.
pub fn blend_rows(near: &[f64], far: &[f64], tap: Tap, scale: HeightScale, out: &mut [i32]) {
    assert!(near.len() == out.len() && far.len() == out.len(), "rows to blend are of one length");
    let (near_weight, far_weight) = (f64::from(TAP_UNITS - tap.weight), f64::from(tap.weight));
    let quanta_per_blend = scale.quanta_per_unit / (f64::from(TAP_UNITS) * f64::from(TAP_UNITS));
    for ((out, &near), &far) in out.iter_mut().zip(near).zip(far) {
        *out = rounded((near * near_weight + far * far_weight) * quanta_per_blend + scale.quanta_at_zero);
    }
}

/// Half away from zero, for values below 2^31 either side; without a branch or a call, so that it runs in lanes.
///
/// Adding 3 x 2^51 leaves the nearest integer, ties to even, in the low bits. A tie that went towards zero shows as a
/// rest of exactly a half (subtraction is exact here) and is put right.
pub fn rounded(value: f64) -> i32 {
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    let shifted = value + WHOLE;
    let rest = value - (shifted - WHOLE);
    let even = shifted.to_bits() as i32;
    even + i32::from((rest == 0.5) & (0.0 < value)) - i32::from((rest == -0.5) & (value < 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const METRES: HeightScale = HeightScale { quanta_per_unit: 128.0, quanta_at_zero: 0.0 };

    #[track_caller]
    fn check_sample(rows: [[f64; 3]; 2], row: f64, col: f64, expected_m: f64) {
        let (vertical, horizontal) = (tap(row, 2).unwrap(), Taps::new(&[tap(col, 3).unwrap()], 0));
        let sampled = rows.map(|row| sampled(&row, &horizontal));
        let mut out = [0];
        let [near, far] = [vertical.near, vertical.far].map(|row| &sampled[row as usize]);
        blend_rows(near, far, vertical, METRES, &mut out);
        assert_eq!(f64::from(out[0]) / 128.0, expected_m, "at {row}, {col}");
    }

    fn sampled(row: &[f64], taps: &Taps) -> Vec<f64> {
        let mut out = vec![0.0; taps.count()];
        sample_row(row, taps, &mut out);
        out
    }

    #[test]
    fn a_place_on_a_post_copies_it_and_one_between_blends() {
        let rows = [[10.0, 20.0, 40.0], [110.0, 120.0, 140.0]];
        check_sample(rows, 0.0, 1.0, 20.0);
        check_sample(rows, 1.0, 2.0, 140.0);
        check_sample(rows, 0.5, 1.25, 75.0);
        check_sample(rows, 0.0, 1.000_000_1, 20.0);
    }

    #[test]
    fn a_post_without_weight_is_not_named() {
        assert_eq!(tap(3.0, 4), Some(Tap { near: 3, far: 3, weight: 0 }));
        assert_eq!(tap(2.5, 4), Some(Tap { near: 2, far: 3, weight: 32768 }));
        let taps = Taps::new(&[0.0, 0.25, 2.0].map(|col| tap(col, 3).unwrap()), 0);
        let sampled = sampled(&[1.0, f64::NAN, 2.0], &taps);
        assert_eq!(sampled.iter().map(|value| value.is_nan()).collect::<Vec<_>>(), [false, true, false]);
    }

    #[test]
    fn a_thousandth_of_a_post_outside_is_still_the_outermost_post() {
        assert_eq!(tap(-0.0009, 4), tap(0.0, 4));
        assert_eq!(tap(3.0009, 4), tap(3.0, 4));
        for outside in [-0.0011, 3.0011, f64::NAN, f64::INFINITY, -1.0e300] {
            assert_eq!(tap(outside, 4), None);
        }
    }

    #[test]
    fn the_nearest_post_owns_half_a_post_on_either_side() {
        assert_eq!(nearest(-0.5, 3), Some(0));
        assert_eq!(nearest(0.49, 3), Some(0));
        assert_eq!(nearest(0.5, 3), Some(1));
        assert_eq!(nearest(2.49, 3), Some(2));
        assert_eq!(nearest(2.5, 3), None);
        assert_eq!(nearest(-0.51, 3), None);
        assert_eq!(nearest(f64::NAN, 3), None);
        assert_eq!(nearest(1.0e300, 3), None);
    }

    #[test]
    fn taps_read_in_runs_equal_taps_read_one_by_one() {
        let row: Vec<f64> = (0..40).map(|i| f64::from(i * i % 17)).collect();
        for step in [0.3, 0.5, 0.99, 1.0, 1.013, 2.7] {
            let places = (0..14).map(|i| 0.25 + f64::from(i) * step);
            let taps: Vec<Tap> = places.map(|place| tap(place, 40).unwrap()).collect();
            let one_by_one = taps.iter().map(|tap| {
                let far = f64::from(tap.weight);
                row[tap.near as usize] * (65536.0 - far) + row[tap.far as usize] * far
            });
            assert_eq!(sampled(&row, &Taps::new(&taps, 0)), one_by_one.collect::<Vec<_>>(), "step {step}");
        }
    }

    #[test]
    fn rounding_is_half_away_from_zero() {
        let cases = [(0.5, 1), (-0.5, -1), (0.499_999_999_999_999_94, 0), (2.5, 3), (-3.5, -4), (-2.4, -2), (-7.0, -7)];
        for (value, expected) in cases {
            assert_eq!(rounded(value), expected, "{value}");
        }
    }
}
