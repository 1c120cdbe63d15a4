//! Colours, and the scales that stand for numbers: the one palette of pictures, the page and the viewer.
//!
//! Every scale is told apart by its lightness, so that it reads the same to the colour-blind and in print: heights and
//! counts grow lighter or darker all the way, residuals grow darker both ways from white, purple one way, orange the
//! other (a pair that the common kinds of colour blindness keep apart). Blue is water and nothing else.

use serde_json::{Value, json};
use terrain::FEATURE_COLORS;

/// A colour: red, green and blue, as screens show them.
pub type Color = [u8; 3];

pub(crate) const WHITE: Color = [255, 255, 255];
pub(crate) const INK: Color = [34, 34, 34];
pub(crate) const GREY: Color = [110, 110, 110];
pub(crate) const PALE: Color = [225, 225, 225];
/// Where nothing is known: voids, ground outside.
pub(crate) const NOTHING: Color = [200, 200, 200];
/// What broke a limit; on no scale.
pub(crate) const BREACH: Color = [213, 94, 0];
/// What a limit kept from growing; on no scale.
pub(crate) const BOUND: Color = [230, 159, 0];
/// Water: the only blue, but for the rivers and streams among [`FEATURES`].
pub(crate) const WATER: Color = [96, 154, 196];
/// Roads and water by the names of their classes, in the colours that exports give them, too. The last stands for every
/// other name.
pub(crate) const FEATURES: [(&str, Color); FEATURE_COLORS.len() + 1] = {
    let mut all = [("other", [120, 70, 40]); FEATURE_COLORS.len() + 1];
    let mut at = 0;
    while at < FEATURE_COLORS.len() {
        all[at] = FEATURE_COLORS[at];
        at += 1;
    }
    all
};

/// The place of a class of features among [`FEATURES`], by its name.
pub(crate) fn feature_number(name: &str) -> u8 {
    let last = FEATURES.len() - 1;
    FEATURES.iter().position(|(known, _)| *known == name).unwrap_or(last) as u8
}

/// The sky at its top and at the horizon.
pub(crate) const SKY: [Color; 2] = [[205, 203, 198], [240, 238, 234]];
/// Bare rock, which steep ground turns into in pictures that are driven through.
pub(crate) const ROCK: Color = [139, 126, 108];
/// What distance fades into.
pub(crate) const HAZE: Color = [228, 226, 220];

/// Colours at equal steps from 0 to 1, blended between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ramp(pub &'static [Color]);

/// Heights: from green lowlands over tan to pale tops.
pub(crate) const HEIGHTS: Ramp = Ramp(&[
    [84, 122, 78],
    [112, 146, 90],
    [146, 168, 106],
    [178, 184, 124],
    [200, 192, 142],
    [214, 202, 162],
    [228, 218, 192],
    [246, 241, 230],
]);

/// Counts: from nearly white to dark purple.
pub(crate) const COUNTS: Ramp = Ramp(&[
    [250, 244, 249],
    [236, 218, 233],
    [220, 183, 212],
    [203, 143, 187],
    [180, 99, 158],
    [150, 60, 127],
    [112, 28, 94],
    [70, 8, 60],
]);

/// Use of a limit: from pale yellow, nothing, to dark green, all of it.
pub(crate) const USE: Ramp = Ramp(&[
    [255, 255, 229],
    [247, 252, 185],
    [217, 240, 163],
    [173, 221, 142],
    [120, 198, 121],
    [65, 171, 93],
    [35, 132, 67],
    [0, 104, 55],
    [0, 69, 41],
]);

/// How far off, without a side: from nearly white over orange to dark red.
pub(crate) const ERRORS: Ramp = Ramp(&[
    [255, 250, 238],
    [254, 228, 178],
    [252, 190, 120],
    [238, 134, 78],
    [203, 72, 52],
    [142, 24, 38],
    [64, 4, 18],
]);

/// Residuals: purple where the DEM lies below the triangles, white where it lies on them, orange above.
pub(crate) const RESIDUALS: Ramp = Ramp(&[
    [64, 0, 75],
    [118, 42, 131],
    [153, 112, 171],
    [194, 165, 207],
    [231, 212, 232],
    [247, 247, 247],
    [254, 224, 182],
    [253, 184, 99],
    [224, 130, 20],
    [179, 88, 6],
    [110, 48, 4],
]);

/// Kinds of things without an order, light enough for letters to read on them.
pub(crate) const KINDS: [Color; 4] = [[226, 222, 212], [253, 205, 130], [178, 223, 188], [222, 190, 218]];

/// The palette for programs that draw by themselves, as texts such as `#547a4e`: `heights`, `use`, `errors` and
/// `residuals` from low to high, `breach`, `water`, `nothing`, `rock` for steep ground, `sky` from its top to the
/// horizon, `haze` that distance fades into, and of `features` each class by its name.
pub fn palette() -> Value {
    let all = |colors: &[Color]| colors.iter().copied().map(hex).collect::<Vec<_>>();
    let features: serde_json::Map<String, Value> =
        FEATURES.into_iter().map(|(name, color)| (name.to_owned(), json!(hex(color)))).collect();
    json!({
        "heights": all(HEIGHTS.0),
        "use": all(USE.0),
        "errors": all(ERRORS.0),
        "residuals": all(RESIDUALS.0),
        "breach": hex(BREACH),
        "water": hex(WATER),
        "features": features,
        "nothing": hex(NOTHING),
        "rock": hex(ROCK),
        "sky": all(&SKY),
        "haze": hex(HAZE),
    })
}

/// A colour as style sheets write it.
pub(crate) fn hex([red, green, blue]: Color) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

impl Ramp {
    /// The colour at `share`, which is taken into 0 to 1.
    pub fn at(&self, share: f64) -> Color {
        let steps = self.0.len() - 1;
        let place = share.clamp(0.0, 1.0) * steps as f64;
        let step = (place as usize).min(steps - 1);
        mix(self.0[step], self.0[step + 1], place - step as f64)
    }

    /// Colours at `count` equal steps, to be looked up.
    pub fn table(&self, count: usize) -> Vec<Color> {
        (0..count).map(|step| self.at(step as f64 / (count - 1).max(1) as f64)).collect()
    }
}

/// `share` of the second colour over the first.
pub(crate) fn mix(a: Color, b: Color, share: f64) -> Color {
    std::array::from_fn(|i| (f64::from(a[i]) + (f64::from(b[i]) - f64::from(a[i])) * share + 0.5) as u8)
}

/// A colour under a light: 1 leaves it, less darkens it, more lightens it towards white.
pub(crate) fn lit(color: Color, light: f32) -> Color {
    color.map(|part| {
        let part = f32::from(part);
        let lit = if light <= 1.0 { part * light } else { part + (255.0 - part) * (light - 1.0).min(1.0) };
        (lit + 0.5) as u8
    })
}

/// Ink that reads on a background.
pub(crate) fn ink_on(background: Color) -> Color {
    let [red, green, blue] = background.map(f64::from);
    if 0.3 * red + 0.59 * green + 0.11 * blue < 128.0 { WHITE } else { INK }
}

#[cfg(test)]
mod tests {
    use terrain::named_class_color;

    use super::*;

    fn lightness([red, green, blue]: Color) -> f64 {
        0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue)
    }

    #[test]
    fn scales_of_heights_counts_and_use_change_their_lightness_one_way() {
        for ramp in [HEIGHTS, COUNTS, USE, ERRORS] {
            let light: Vec<f64> = ramp.table(65).into_iter().map(lightness).collect();
            let grows = light.is_sorted();
            assert!(grows || light.iter().rev().is_sorted(), "{ramp:?}");
        }
    }

    #[test]
    fn residuals_are_lightest_in_the_middle_and_no_colour_stands_for_two() {
        let table = RESIDUALS.table(101);
        let light: Vec<f64> = table.iter().copied().map(lightness).collect();
        assert!(light[..=50].is_sorted() && light[50..].iter().rev().is_sorted());
        assert!((0..49).all(|step| table[step][1] < table[step][2] && table[100 - step][2] < table[100 - step][0]));
    }

    /// Whether one would call it blue: between green and purple, and not grey.
    fn is_blue(color: Color) -> bool {
        let [red, green, blue] = color.map(f64::from);
        let (most, least) = (red.max(green).max(blue), red.min(green).min(blue));
        let is_grey = most - least < 0.1 * most.max(1.0);
        // Purple has more red than green, blue has not much more.
        !is_grey && blue == most && red - green < 0.3 * (most - least)
    }

    #[test]
    fn blue_is_water_and_nothing_else() {
        assert!(is_blue(WATER) && is_blue([67, 147, 195]) && is_blue([59, 82, 139]));
        let ramps = [HEIGHTS, COUNTS, USE, ERRORS, RESIDUALS].into_iter().flat_map(|ramp| ramp.table(101));
        let is_water = |name: &str| ["river", "stream", "lake", "water"].contains(&name);
        for (name, color) in FEATURES {
            assert_eq!(is_blue(color), is_water(name), "{name}");
        }
        let others = [BREACH, BOUND, NOTHING, PALE, ROCK, SKY[0], SKY[1], HAZE].into_iter().chain(KINDS);
        for color in ramps.chain(others) {
            assert!(!is_blue(color), "{color:?}");
        }
    }

    #[test]
    fn pictures_and_exports_give_a_class_of_features_one_colour() {
        for (number, (name, color)) in (0..).zip(FEATURES).take(FEATURE_COLORS.len()) {
            assert_eq!((Some(color), number), (named_class_color(name), feature_number(name)));
        }
        assert_eq!(usize::from(feature_number("gravel pit")), FEATURE_COLORS.len());
        assert_eq!(named_class_color("lake"), Some(WATER));
    }

    #[test]
    fn land_is_green_or_tan() {
        for [red, green, blue] in HEIGHTS.table(101) {
            assert!(blue < green && blue < red.max(green) && 0 < green, "{red} {green} {blue}");
        }
    }

    #[test]
    fn the_palette_of_programs_is_that_of_pictures() {
        let palette = palette();
        assert_eq!(palette["water"], "#609ac4");
        for (name, ramp) in [("heights", HEIGHTS), ("use", USE), ("errors", ERRORS), ("residuals", RESIDUALS)] {
            let colors: Vec<String> = ramp.0.iter().copied().map(hex).collect();
            assert_eq!(palette[name], json!(colors), "{name}");
        }
    }

    #[test]
    fn the_ends_of_a_scale_are_its_first_and_last_colour() {
        assert_eq!(USE.at(-1.0), USE.0[0]);
        assert_eq!(USE.at(2.0), USE.0[8]);
        assert_eq!(mix([0, 0, 0], [255, 255, 255], 0.5), [128, 128, 128]);
        assert_eq!(lit([100, 100, 100], 0.5), [50, 50, 50]);
        assert_eq!(lit([100, 100, 100], 1.5), [178, 178, 178]);
    }
}
