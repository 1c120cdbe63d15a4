//! How high a building stands, by the tags of OpenStreetMap.

use crate::lengths::{decimal, height_of, metres_of};

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
    fn check(tags: &[(&str, &'static str)], expected: Option<(f64, f64)>) {
        let found = building_heights(|key| tags.iter().find(|(name, _)| *name == key).map(|(_, value)| *value));
        assert_eq!(found, expected.map(|(bottom_m, top_m)| BuildingHeights { bottom_m, top_m }), "{tags:?}");
    }

    #[test]
    fn a_building_is_as_high_as_its_height_its_levels_or_the_usual_say() {
        const YES: (&str, &str) = ("building", "yes");
        check(&[("highway", "track")], None);
        check(&[("building", "no"), ("height", "9")], None);
        check(&[YES], Some((0.0, 6.0)));
        check(&[YES, ("height", "12.5 m"), ("building:levels", "2")], Some((0.0, 12.5)));
        check(&[YES, ("height", "100 ft")], Some((0.0, 100.0 * 0.3048)));
        check(&[YES, ("building:levels", "4")], Some((0.0, 12.0)));
        check(&[YES, ("building:levels", "2,5")], Some((0.0, 7.5)));
        check(&[YES, ("height", "20"), ("min_height", "8")], Some((8.0, 20.0)));
        check(&[YES, ("building:min_level", "2")], Some((6.0, 12.0)));
    }

    #[test]
    fn a_height_that_cannot_be_is_passed_over() {
        const YES: (&str, &str) = ("building", "house");
        for wrong in ["high", "0", "-3", "20000", "1e3", "nan", ""] {
            check(&[YES, ("height", wrong), ("building:levels", "3")], Some((0.0, 9.0)));
            check(&[YES, ("height", wrong), ("building:levels", wrong)], Some((0.0, 6.0)));
        }
        check(&[YES, ("height", "10"), ("min_height", "12")], Some((0.0, 10.0)));
    }
}
