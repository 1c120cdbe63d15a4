//! What surfaces are called and numbered in formats of others.

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
