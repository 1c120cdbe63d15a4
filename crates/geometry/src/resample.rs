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

/// Blends two source rows: each of `out` is `near` and `far` times their weights, 65536 times the height.
///
/// A NaN in a row that has weight is a NaN in `out`. A row without weight must be given as the other one.
///
/// # Panics
/// When the three rows differ in length.
pub fn blend_rows(near: &[f64], far: &[f64], tap: Tap, out: &mut [f64]) {
    assert!(near.len() == out.len() && far.len() == out.len(), "rows to blend are of one length");
    let (near_weight, far_weight) = (f64::from(TAP_UNITS - tap.weight), f64::from(tap.weight));
    for ((out, &near), &far) in out.iter_mut().zip(near).zip(far) {
        *out = near * near_weight + far * far_weight;
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

/// Samples a blended row at `taps` and rounds once, half away from zero, to quanta. A NaN gives 0; ask
/// [`touches_void`] first where there may be one.
///
/// # Panics
/// When `taps` and `out` differ in length, or a tap lies outside the row.
pub fn sample_row(blended: &[f64], taps: &[Tap], scale: HeightScale, out: &mut [i32]) {
    assert_eq!(taps.len(), out.len(), "one tap per post");
    let quanta_per_blend = scale.quanta_per_unit / (f64::from(TAP_UNITS) * f64::from(TAP_UNITS));
    for (out, tap) in out.iter_mut().zip(taps) {
        *out = rounded(at(blended, tap) * quanta_per_blend + scale.quanta_at_zero);
    }
}

/// Whether sampling `blended` at `tap` reads a NaN.
pub fn touches_void(blended: &[f64], tap: Tap) -> bool {
    at(blended, &tap).is_nan()
}

fn at(blended: &[f64], tap: &Tap) -> f64 {
    let (near, far) = (blended[tap.near as usize], blended[tap.far as usize]);
    near * f64::from(TAP_UNITS - tap.weight) + far * f64::from(tap.weight)
}

/// Half away from zero. Truncation and the rest after it are exact, which adding a half first is not.
fn rounded(value: f64) -> i32 {
    let whole = value as i32;
    let rest = value - f64::from(whole);
    whole + i32::from(0.5 <= rest) - i32::from(rest <= -0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    const METRES: HeightScale = HeightScale { quanta_per_unit: 128.0, quanta_at_zero: 0.0 };

    #[track_caller]
    fn check_sample(rows: [[f64; 3]; 2], row: f64, col: f64, expected_m: f64) {
        let (vertical, horizontal) = (tap(row, 2).unwrap(), tap(col, 3).unwrap());
        let mut blended = [0.0; 3];
        blend_rows(&rows[vertical.near as usize], &rows[vertical.far as usize], vertical, &mut blended);
        let mut out = [0];
        sample_row(&blended, &[horizontal], METRES, &mut out);
        assert_eq!(f64::from(out[0]) / 128.0, expected_m, "at {row}, {col}");
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
        let blended = [1.0, f64::NAN];
        assert!(!touches_void(&blended, tap(0.0, 2).unwrap()));
        assert!(touches_void(&blended, tap(0.25, 2).unwrap()));
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
    fn rounding_is_half_away_from_zero() {
        let cases = [(0.5, 1), (-0.5, -1), (0.499_999_999_999_999_94, 0), (2.5, 3), (-2.4, -2), (-7.0, -7)];
        for (value, expected) in cases {
            assert_eq!(rounded(value), expected, "{value}");
        }
    }
}
