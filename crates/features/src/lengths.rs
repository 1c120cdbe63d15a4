//! Lengths as people write them in tags (`7`, `7.5 m`, `23'`, `5'10"`), and how high a building stands by them.

/// The widest a feature can be, in metres: wider is a slip of the pen, since no runway is.
pub const WIDTH_M_MAX: f64 = 500.0;

/// The most lanes a road can have.
pub const LANES_MAX: f64 = 24.0;

const METRES_PER_FOOT: f64 = 0.3048;
const METRES_PER_INCH: f64 = 0.0254;

/// Metres of a length; `None` for what is none, is not positive or is not finite.
pub fn metres_of(text: &str) -> Option<f64> {
    let text = text.trim();
    let (number, unit) = text.split_at(text.find(|c: char| !is_of_number(c)).unwrap_or(text.len()));
    let number = decimal(number)?;
    let metres = match unit.trim() {
        "" | "m" | "metre" | "metres" | "meter" | "meters" => number,
        "cm" => number / 100.0,
        "km" => number * 1000.0,
        "ft" | "feet" | "'" => number * METRES_PER_FOOT,
        "\"" | "in" => number * METRES_PER_INCH,
        feet_and_inches => {
            let inches = feet_and_inches.strip_prefix('\'')?.trim().strip_suffix('"')?;
            number * METRES_PER_FOOT + decimal(inches.trim())? * METRES_PER_INCH
        }
    };
    (0.0 < metres && metres.is_finite()).then_some(metres)
}

/// Metres of a width; `None` also for what is wider than anything.
pub fn width_of(text: &str) -> Option<f64> {
    metres_of(text).filter(|metres| *metres <= WIDTH_M_MAX)
}

/// A height in metres, which may be zero or negative.
pub fn height_of(text: &str) -> Option<f64> {
    let text = text.trim();
    let (sign, size) = text.strip_prefix('-').map_or((1.0, text), |size| (-1.0, size));
    if decimal(size) == Some(0.0) { Some(0.0) } else { metres_of(size).map(|metres| sign * metres) }
}

/// The number of lanes; `None` for what is none.
pub fn lanes_of(text: &str) -> Option<f64> {
    decimal(text.trim()).filter(|lanes| 0.0 < *lanes && *lanes <= LANES_MAX)
}

fn is_of_number(c: char) -> bool {
    c.is_ascii_digit() || c == '.' || c == ','
}

/// A number without sign or exponent, its point a point or a comma.
pub(crate) fn decimal(text: &str) -> Option<f64> {
    let plain = !text.is_empty() && text.chars().all(is_of_number);
    plain.then(|| text.replace(',', ".").parse().ok()).flatten()
}

/// Metres of a storey.
const LEVEL_M: f64 = 3.0;
/// Metres of a building whose tags say nothing of its height.
const HEIGHT_M_USUAL: f64 = 6.0;
/// What is higher is a slip of the pen: the highest building has 828 m.
const HEIGHT_M_MAX: f64 = 1000.0;

/// Metres from the lowest ground under a building to where it begins and to its top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BuildingHeights {
    /// Where it begins: 0 but for what hangs over the ground.
    pub bottom_m: f64,
    /// Its top.
    pub top_m: f64,
}

/// The heights of what has these tags; `None` where it is no building. A height that cannot be is passed over.
pub fn building_heights<'a>(tag: impl Fn(&str) -> Option<&'a str>) -> Option<BuildingHeights> {
    if matches!(tag("building")?.trim(), "" | "no") {
        return None;
    }
    let fits = |metres: &f64| 0.0 < *metres && *metres <= HEIGHT_M_MAX;
    let levels = |key: &str| tag(key).and_then(|text| decimal(text.trim())).map(|levels| levels * LEVEL_M).filter(fits);
    let top_m = tag("height").and_then(metres_of).filter(fits).or_else(|| levels("building:levels"));
    let bottom_m = tag("min_height").and_then(height_of).filter(fits).or_else(|| levels("building:min_level"));
    let bottom_m = bottom_m.unwrap_or(0.0);
    match top_m {
        Some(top_m) if bottom_m < top_m => Some(BuildingHeights { bottom_m, top_m }),
        Some(top_m) => Some(BuildingHeights { bottom_m: 0.0, top_m }),
        None => Some(BuildingHeights { bottom_m, top_m: bottom_m + HEIGHT_M_USUAL }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: Option<f64>) {
        match (width_of(text), expected) {
            (Some(found), Some(expected)) => assert!((found - expected).abs() < 1e-9, "{text}: {found}"),
            (found, expected) => assert_eq!(found, expected, "{text}"),
        }
    }

    #[test]
    fn widths_are_read_as_people_write_them() {
        check("7", Some(7.0));
        check(" 7.5 m", Some(7.5));
        check("7m", Some(7.0));
        check("3,5", Some(3.5));
        check("23'", Some(23.0 * 0.3048));
        check("23 ft", Some(23.0 * 0.3048));
        check("5'10\"", Some(5.0 * 0.3048 + 10.0 * 0.0254));
        check("350 cm", Some(3.5));
    }

    #[test]
    fn what_is_no_width_is_refused() {
        for text in ["", "0", "-3", "wide", "1e9", "1000000000", "nan", "inf", "7 miles", "1.2.3", "3;4", "'", "~5"] {
            check(text, None);
        }
    }

    #[test]
    fn heights_may_be_negative_or_zero() {
        assert_eq!(height_of("-421.5 m"), Some(-421.5));
        assert_eq!(height_of("0"), Some(0.0));
        assert_eq!(height_of("high"), None);
    }

    #[track_caller]
    fn check_height(tags: &[(&str, &'static str)], expected: Option<(f64, f64)>) {
        let found = building_heights(|key| tags.iter().find(|(name, _)| *name == key).map(|(_, value)| *value));
        assert_eq!(found, expected.map(|(bottom_m, top_m)| BuildingHeights { bottom_m, top_m }), "{tags:?}");
    }

    #[test]
    fn a_building_is_as_high_as_its_height_its_levels_or_the_usual_say() {
        const YES: (&str, &str) = ("building", "yes");
        check_height(&[("highway", "track")], None);
        check_height(&[("building", "no"), ("height", "9")], None);
        check_height(&[YES], Some((0.0, 6.0)));
        check_height(&[YES, ("height", "12.5 m"), ("building:levels", "2")], Some((0.0, 12.5)));
        check_height(&[YES, ("height", "100 ft")], Some((0.0, 100.0 * 0.3048)));
        check_height(&[YES, ("building:levels", "4")], Some((0.0, 12.0)));
        check_height(&[YES, ("building:levels", "2,5")], Some((0.0, 7.5)));
        check_height(&[YES, ("height", "20"), ("min_height", "8")], Some((8.0, 20.0)));
        check_height(&[YES, ("building:min_level", "2")], Some((6.0, 12.0)));
    }

    #[test]
    fn a_height_that_cannot_be_is_passed_over() {
        const YES: (&str, &str) = ("building", "house");
        for wrong in ["high", "0", "-3", "20000", "1e3", "nan", ""] {
            check_height(&[YES, ("height", wrong), ("building:levels", "3")], Some((0.0, 9.0)));
            check_height(&[YES, ("height", wrong), ("building:levels", wrong)], Some((0.0, 6.0)));
        }
        check_height(&[YES, ("height", "10"), ("min_height", "12")], Some((0.0, 10.0)));
    }
}
