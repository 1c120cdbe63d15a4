//! Vectors that are not as they should be: none of them stops a build, and nothing is changed without a word.

use std::fs;

use super::drawing::Drawing;
use crate::scene::{EPSG, ORIGIN_M, Scene, Words};

/// One feature: properties and geometry as they stand in JSON.
struct Raw {
    properties: String,
    geometry: String,
}

/// A line through places (east, north, and what else a position holds).
fn raw(properties: &str, places: &[(f64, f64, &str)]) -> Raw {
    let place =
        |(east, north, more): &(f64, f64, &str)| format!("[{}, {}{more}]", ORIGIN_M[0] + east, ORIGIN_M[1] + north);
    let places: Vec<String> = places.iter().map(place).collect();
    let geometry = format!("{{\"type\": \"LineString\", \"coordinates\": [{}]}}", places.join(", "));
    Raw { properties: properties.into(), geometry }
}

/// What a build of the features says, a line each: warnings, then what became of single features.
#[track_caller]
fn told(keys: &str, features: &[Raw]) -> Vec<String> {
    let features: Vec<String> = features
        .iter()
        .map(|Raw { properties, geometry }| {
            format!("{{\"type\": \"Feature\", \"properties\": {{{properties}}}, \"geometry\": {geometry}}}")
        })
        .collect();
    let text = format!(
        "{{\"type\": \"FeatureCollection\", \"crs\": {{\"type\": \"name\", \"properties\": {{\"name\": \
         \"urn:ogc:def:crs:EPSG::{EPSG}\"}}}}, \"features\": [{}]}}",
        features.join(",\n")
    );
    let words = Words { features: format!("sources = [\"f.geojson\"]\n{keys}"), ..Drawing::words() };
    let words = Words { dem: "source = \"sample\"\nseed = 1".into(), ..words };
    let scene = Scene::with_files(&words, |folder| fs::write(folder.join("f.geojson"), text).unwrap());
    let report = scene.build("area.tdb", 2).report;
    assert!(report.breaches.is_empty(), "{:?}", report.breaches);
    scene.verify("area.tdb");
    let (.., level) = store::Folder::new(scene.path("area.tdb")).read_level().unwrap();
    let remarks = level.remarks.iter().map(|remark| format!("{}: {}; {}", remark.feature, remark.found, remark.done));
    report.warnings.iter().cloned().chain(remarks).collect()
}

#[track_caller]
fn check(keys: &str, features: &[Raw], expected: &[&str]) {
    let told = told(keys, features);
    for expected in expected {
        assert!(told.iter().any(|line| line.contains(expected)), "{expected}: {told:#?}");
    }
}

const HIGH: &str = "\"highway\": \"primary\"";

fn road() -> Raw {
    raw(HIGH, &[(100.0, 300.0, ""), (1900.0, 700.0, "")])
}

#[test]
fn features_all_outside_are_told_as_a_warning() {
    check(
        "",
        &[raw(HIGH, &[(90_000.0, 300.0, ""), (91_000.0, 700.0, "")])],
        &["f.geojson: none of its 1 lines and polygons"],
    );
}

#[test]
fn a_rule_that_matches_nothing_is_told_with_the_nearest_tag() {
    let rule = "rules = [{ where = { highway = [\"primry\"] }, class = \"big\", kind = \"primary\" }]";
    check(
        rule,
        &[road()],
        &["features.rules[0] (highway = primry) matches nothing; the nearest there is: highway = primary"],
    );
}

#[test]
fn features_of_no_kind_are_told_as_a_warning() {
    let roads = [raw("\"ref\": 7", &[(100.0, 300.0, ""), (1900.0, 700.0, "")])];
    check(
        "",
        &roads,
        &["f.geojson: its features in the area have no kind by their tags (ref) and are left out, 1 in all"],
    );
}

#[test]
fn a_height_or_a_place_that_is_no_number_is_told() {
    let rule = "rules = [{ where = { highway = [\"primary\"] }, kind = \"primary\", z = \"feature\" }]";
    let features = [
        raw(HIGH, &[(100.0, 300.0, ", NaN"), (900.0, 320.0, ", null"), (1900.0, 700.0, ", 560")]),
        raw(HIGH, &[(100.0, 1300.0, ""), (f64::NAN, 320.0, ""), (1900.0, 1700.0, "")]),
        raw(HIGH, &[(100.0, 1500.0, ""), (f64::INFINITY, 320.0, ""), (1900.0, 1800.0, "")]),
    ];
    let none = "a coordinate null, expected a number";
    let expected = ["#0: 2 of 3 heights that are none", &format!("#1: {none}"), &format!("#2: {none}")];
    check(rule, &features, &expected);
}

#[test]
fn widths_that_are_none_are_replaced_by_the_default_and_told() {
    for width in ["0", "-3", "\"wide\"", "1e9", "\"1e9\"", "\"NaN\"", "\"-0\""] {
        let road = raw(&format!("{HIGH}, \"width\": {width}"), &[(100.0, 300.0, ""), (1900.0, 700.0, "")]);
        check("", &[road], &["is not a value it can have; the default was taken"]);
    }
}

#[test]
fn two_pins_on_one_junction_that_disagree_are_told() {
    let rule = "rules = [{ where = { highway = [\"primary\"] }, kind = \"primary\", z = \"feature\" }]";
    let roads = [
        raw(HIGH, &[(200.0, 1000.0, ", 500"), (1000.0, 1000.0, ", 520")]),
        raw(HIGH, &[(1000.0, 1000.0, ", 560"), (1800.0, 1000.0, ", 500")]),
    ];
    check(rule, &roads, &["pinned"]);
}
