//! Real extracts, where the folder of shared vectors exists: what its description says is in them is found.

use std::collections::BTreeMap;

use source_files::{BUILT_IN_KEYS, Crs, Extent, FeatureFile, VectorShape, Wanted, read_features};
use terrain::in_turn;

use crate::support::data;

/// Reads a file inside a box of degrees: west, south, east, north.
fn read(file: &str, epsg: u32, [west, south, east, north]: [f64; 4]) -> Option<FeatureFile> {
    let path = data(&format!("vectors/{file}"))?;
    let area = Crs::from_epsg(epsg).unwrap();
    let corners = [[west, south], [east, south], [west, north], [east, north]];
    let corners = corners.map(|corner| Crs::wgs84().to(&area, corner).unwrap());
    let span = |axis: usize| {
        let all = corners.map(|corner| corner[axis]);
        [all.into_iter().fold(f64::INFINITY, f64::min), all.into_iter().fold(f64::NEG_INFINITY, f64::max)]
    };
    let bounds = Extent { east: span(0), north: span(1) };
    let found = read_features(
        &path,
        &Wanted { epsg, bounds, layer: None, crs: None, keys: &BUILT_IN_KEYS, buildings: false, points: false },
        &in_turn,
    )
    .unwrap();
    let places = found.features.iter().flat_map(|feature| match &feature.shape {
        VectorShape::Point(_) => unreachable!("points are not wanted"),
        VectorShape::Line(line) => std::slice::from_ref(line),
        VectorShape::Polygon(rings) => rings,
    });
    for [east, north] in places.flat_map(|run| &run.places) {
        let inside = bounds.east[0] <= *east && *east <= bounds.east[1];
        assert!(inside && bounds.north[0] <= *north && *north <= bounds.north[1], "{file}: {east}, {north}");
    }
    Some(found)
}

/// Ways, each counted once, by `key=value`, and those with the key at all by `key`; relations with that word before it.
fn counts(file: &FeatureFile) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    let mut last = "";
    for feature in &file.features {
        let id = feature.id.split('.').next().unwrap();
        if std::mem::replace(&mut last, id) == id {
            continue;
        }
        for (key, value) in &feature.tags {
            let kind = if id.starts_with("relation/") { "relation " } else { "" };
            *counts.entry(format!("{kind}{key}={value}")).or_default() += 1;
            *counts.entry(format!("{kind}{key}")).or_default() += 1;
        }
    }
    counts
}

/// Everything that the description of the shared data counts is there, neither more nor less.
#[track_caller]
fn check(file: &str, epsg: u32, extent: [f64; 4], expected: &[(&str, usize)], relations: usize) {
    let Some(found) = read(file, epsg, extent) else { return };
    let counts = counts(&found);
    for (tag, count) in expected {
        assert_eq!(counts.get(*tag).copied().unwrap_or(0), *count, "{tag} in {file}");
    }
    let told = |remark: &&source_files::Remark| remark.id.starts_with("relation/");
    assert_eq!(found.remarks.iter().filter(told).count(), relations, "{file}: {:?}", found.remarks);
    assert_eq!(found.attribution, Some("(c) OpenStreetMap contributors, ODbL 1.0"));
}

#[test]
fn real_extracts_hold_what_their_description_counts() {
    let tags = [
        ("highway", 2705),
        ("highway=service", 686),
        ("highway=track", 558),
        ("highway=residential", 463),
        ("highway=secondary", 188),
        ("highway=bridleway", 3),
        ("waterway=stream", 212),
        ("waterway=canal", 8),
        ("waterway=river", 4),
        ("waterway=riverbank", 4),
        ("natural=water", 23),
        ("relation natural=water", 3),
        ("landuse=reservoir", 1),
    ];
    let file = "liechtenstein_south/liechtenstein_south.osm.pbf";
    check(file, 32632, [9.2, 46.9, 9.9, 47.3], &tags, 6);
    let tags = [("highway", 15886), ("highway=service", 4184), ("highway=platform", 147), ("railway", 8)];
    check("porto_alegre/porto_alegre.osm.pbf", 32722, [-51.4, -30.2, -51.0, -29.9], &tags, 0);
    let tags = [
        ("highway", 2056),
        ("highway=track", 900),
        ("highway=motorway_link", 33),
        ("waterway=stream", 192),
        ("railway", 23),
    ];
    check("north_bayreuth/north_bayreuth.osm.pbf", 32632, [11.3, 49.8, 11.8, 50.2], &tags, 2);
    let tags = [("highway", 2314), ("highway=steps", 259), ("railway", 41), ("natural=water", 16), ("waterway", 3)];
    check("monaco/monaco.osm.pbf", 32632, [7.2, 43.6, 7.7, 43.9], &tags, 0);
}

#[test]
fn the_defects_of_a_dirty_extract_that_a_reader_can_see_are_told() {
    let file = "dirty/triesenberg_injected.osm.pbf";
    let Some(found) = read(file, 32632, [9.4, 47.0, 9.7, 47.2]) else { return };
    let count = |what: &str| found.remarks.iter().filter(|remark| remark.found.contains(what)).count();
    assert_eq!(count("not in the file"), 6, "references to missing nodes");
    assert_eq!(count("km from the next"), 4, "displaced nodes");
    assert_eq!(count("fewer than 2 nodes"), 4, "ways of one node");
    assert_eq!(count("no nodes"), 4, "ways without nodes");
    assert_eq!(found.remarks.len(), 18, "{:?}", found.remarks);
    // 2296 highways, of which 4 have no node or one, and two ways each of those that were cut.
    assert!((2285..=2296).contains(&counts(&found)["highway"]));
}

#[test]
fn every_valid_multipolygon_of_the_test_grid_is_put_together() {
    let Some(table) = data("vectors/dirty/testgrid_even.csv") else { return };
    let found = read("dirty/testgrid_even_over_missoula.osm.pbf", 32611, [-114.3, 46.7, -113.8, 47.2]).unwrap();
    let all: Vec<&str> = found.features.iter().filter_map(|feature| feature.tag("test")).collect();
    let text = std::fs::read_to_string(table).unwrap();
    let is_valid = |line: &&str| line.contains(",valid,") && line.contains("valid area(s)");
    // 950 is a boundary, which is no body of water.
    let tests = text.lines().filter(is_valid).filter_map(|line| line.split(',').next()).filter(|test| *test != "950");
    let missing: Vec<&str> = tests.filter(|test| !all.contains(test)).collect();
    assert_eq!(missing, [""; 0]);
}

#[test]
fn other_formats_of_the_shared_vectors_are_read_whole() {
    let check = |file: &str, epsg, extent, expected: (u64, usize)| {
        let Some(found) = read(file, epsg, extent) else { return };
        assert_eq!((found.found, found.features.len()), expected, "{file}");
        assert_eq!((found.outside, found.remarks.len()), (0, 0), "{file}: {:?}", found.remarks);
    };
    let mackay = [-114.0, 43.5, -113.2, 44.3];
    check("mackay_idaho/roads.geojson", 32612, mackay, (430, 431));
    check("mackay_idaho/streams.geojson", 32612, mackay, (110, 110));
    check("mackay_idaho/lakes.geojson", 32612, mackay, (2, 2));
    check("baja_california_sur/roads.geojson", 32612, [-111.3, 24.5, -110.5, 25.2], (145, 145));
    let arco = [10.7, 45.7, 11.1, 46.1];
    check("arco_italy/lago_fiume.shp", 32632, arco, (1, 1));
    check("arco_italy/lato_fiume.shp", 32632, arco, (1, 1));
    check("gibraltar_shores_borders.geojson", 32630, [-7.0, 34.0, -4.0, 38.0], (8, 8));
    check("mojave_35n117w_rivers.geojson", 32611, [-119.0, 34.0, -115.0, 37.0], (7, 7));
}
