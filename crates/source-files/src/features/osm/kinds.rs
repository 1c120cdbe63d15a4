//! Which closed ways of OpenStreetMap stand for an area: the format has lines only, and tags tell.

use crate::features::model::Tags;

/// What a closed way with a key stands for.
enum Closed {
    /// An area, but for some values.
    AreaUnless(&'static [&'static str]),
    /// A line, but for some values.
    LineUnless(&'static [&'static str]),
}

const KEYS: [(&str, Closed); 6] = [
    (
        "natural",
        Closed::AreaUnless(&["coastline", "cliff", "ridge", "arete", "tree_row", "valley", "gully", "earth_bank"]),
    ),
    ("landuse", Closed::AreaUnless(&[])),
    ("water", Closed::AreaUnless(&[])),
    ("waterway", Closed::LineUnless(&["riverbank", "dock", "boatyard", "dam"])),
    ("aeroway", Closed::LineUnless(&["apron", "runway", "aerodrome", "helipad", "heliport", "terminal"])),
    (
        "man_made",
        Closed::AreaUnless(&["embankment", "cutline", "dyke", "pipeline", "groyne", "breakwater", "goods_conveyor"]),
    ),
];

/// Whether a closed way with these tags is an area: where `area` says so, else where one of its keys does and it is
/// no road or railway, which may go round in circles.
pub(super) fn is_area(tags: &Tags) -> bool {
    let value = |key: &str| tags.iter().find(|(other, _)| other.as_ref() == key).map(|(_, value)| value.as_ref());
    match value("area") {
        Some("yes") => return true,
        Some("no") => return false,
        _ => {}
    }
    if value("highway").is_some() || value("railway").is_some() {
        return false;
    }
    KEYS.iter().any(|(key, closed)| match (value(key), closed) {
        (None, _) => false,
        (Some(value), Closed::AreaUnless(lines)) => !lines.contains(&value),
        (Some(value), Closed::LineUnless(areas)) => areas.contains(&value),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(tags: &[(&str, &str)], expected: bool) {
        let tags: Tags = tags.iter().map(|&(key, value)| (key.into(), value.into())).collect();
        assert_eq!(is_area(&tags), expected, "{tags:?}");
    }

    #[test]
    fn closed_ways_are_areas_where_their_tags_say_so() {
        check(&[("highway", "primary")], false);
        check(&[("highway", "pedestrian"), ("area", "yes")], true);
        check(&[("highway", "track"), ("landuse", "forest")], false);
        check(&[("natural", "water")], true);
        check(&[("natural", "water"), ("area", "no")], false);
        check(&[("natural", "coastline")], false);
        check(&[("waterway", "canal")], false);
        check(&[("waterway", "riverbank")], true);
        check(&[("aeroway", "taxiway")], false);
        check(&[("aeroway", "apron")], true);
        check(&[("name", "x")], false);
    }
}
