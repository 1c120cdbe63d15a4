//! What surfaces look like and are called: colours of classes whose names say what they are, the same in exports,
//! pictures, the page and the viewer; and names and numbers in formats of others.

use crate::ObjectKind;

/// Another name for a material, and its numbers where a simulator looks materials up by number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MaterialName {
    /// The class, or the material of an object, that is called otherwise.
    pub of: String,
    /// What it is called.
    pub name: String,
    /// Its surface material code, where it has another than its place in the list.
    pub surface_code: Option<u16>,
    /// Its feature identification, where it has one.
    pub feature_id: Option<u16>,
}

/// Names of the materials of objects: for each kind, in the order of kinds, that of its top and that of its sides.
pub const OBJECT_MATERIALS: [&str; 2 * ObjectKind::ALL.len()] = [
    "building_roof",
    "building_wall",
    "tower_roof",
    "tower_wall",
    "wall_top",
    "wall_side",
    "wood_top",
    "wood_side",
    "scrub_top",
    "scrub_side",
    "orchard_top",
    "orchard_side",
    "row_top",
    "row_side",
];

/// Red, green and blue, as screens show them, of classes that features bring, highest roads first. Roads are grey to
/// brown and lighter the smaller they are, water is blue, and nothing else is.
pub const FEATURE_COLORS: [(&str, [u8; 3]); 12] = [
    ("motorway", [52, 48, 46]),
    ("primary", [78, 72, 68]),
    ("minor", [106, 98, 92]),
    ("track", [134, 112, 86]),
    ("rail", [82, 62, 60]),
    ("runway", [64, 64, 62]),
    ("river", [74, 132, 184]),
    ("stream", [122, 176, 212]),
    ("lake", [96, 154, 196]),
    ("water", [96, 154, 196]),
    ("dam", [152, 138, 120]),
    ("breakline", [170, 146, 112]),
];

/// The fixed colour of a class of this name; `None` where the name says nothing of its colour.
pub fn named_class_color(name: &str) -> Option<[u8; 3]> {
    FEATURE_COLORS.iter().find(|(of, _)| *of == name).map(|(_, color)| *color)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn water_is_blue_and_roads_are_grey_to_brown() {
        let color = |name| named_class_color(name).unwrap();
        for name in ["river", "stream", "lake", "water"] {
            let [red, green, blue] = color(name);
            assert!(red < green && green < blue, "{name}");
        }
        for name in ["motorway", "primary", "minor", "track", "rail", "runway", "dam", "breakline"] {
            let [red, green, blue] = color(name);
            assert!(blue <= green && green <= red, "{name}");
        }
        assert!(color("lake") == color("water") && named_class_color("sand").is_none());
    }

    #[test]
    fn smaller_roads_are_lighter() {
        let roads = ["motorway", "primary", "minor", "track"].map(|name| named_class_color(name).unwrap());
        let light = roads.map(|color| color.into_iter().map(u32::from).sum::<u32>());
        assert!(light.is_sorted(), "{light:?}");
    }
}
