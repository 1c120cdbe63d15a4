//! A job with roads and water, as a person meets it: what the build, the report, `explain` and exports tell of them.

use std::fs;

use serde_json::Value;

use crate::scene::Scene;

/// A road and a lake in the middle of the small job, in its own coordinate system.
const FEATURES: &str = r#"{ "type": "FeatureCollection",
  "crs": { "type": "name", "properties": { "name": "urn:ogc:def:crs:EPSG::32611" } },
  "features": [
    { "type": "Feature", "properties": { "highway": "primary" }, "geometry": { "type": "LineString",
      "coordinates": [[504800, 3876100], [507000, 3876300], [509300, 3876800]] } },
    { "type": "Feature", "properties": { "natural": "water" }, "geometry": { "type": "Polygon",
      "coordinates": [[[507200, 3877400], [507700, 3877500], [507500, 3877900], [507200, 3877400]]] } }
  ] }"#;

fn scene() -> Scene {
    let scene = Scene::with_job("small.toml", &[("[limits]", "[features]\nsources = [\"f.geojson\"]\n\n[limits]")]);
    fs::write(scene.path("f.geojson"), FEATURES).unwrap();
    scene
}

#[test]
fn roads_and_water_are_told_by_the_build_and_by_every_way_to_look_at_it() {
    let scene = scene();
    let built = scene.run_to(0, &["build", "job.toml", "--out", "a.tdb"]);
    assert!(built.printed.contains("\nFeatures "), "{}", built.printed);
    let text = scene.run_to(0, &["report", "a.tdb"]).stdout;
    for expected in ["\nRoads, water ", "\n  primary ", "\n  lake ", "edges missing from the TIN"] {
        assert!(text.contains(expected), "{text}");
    }
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    let json = scene.run_to(0, &["report", "a.tdb", "--format", "json"]).stdout;
    let report: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(report["features"]["checks"]["edges_missing"], 0);
    assert!(report["files"]["features.geojson"].is_object(), "{json}");
    let page = fs::read_to_string(scene.path("a.tdb/report.html")).unwrap();
    assert!(page.contains("id=\"features\"") && page.contains("Where roads and water run"));
    let explained = scene.run_to(0, &["explain", "a.tdb", "2,4"]).stdout;
    assert!(explained.contains("Roads and water take"), "{explained}");
    scene.run_to(0, &["verify", "a.tdb"]);
    scene.run_to(0, &["render", "a.tdb", "--view", "features", "--size", "300", "--out", "map.png"]);
    scene.run_to(0, &["export", "a.tdb", "--format", "features", "--out", "f.gpkg"]);
    assert!(fs::read(scene.path("f.gpkg")).unwrap().starts_with(b"SQLite format 3"));
}

#[test]
fn a_database_without_roads_and_water_has_no_map_and_no_package_of_them() {
    let scene = Scene::built();
    let without = "a database without roads and water, expected one with some";
    scene.refuses(&["render", "small.tdb", "--view", "features", "--out", "map.png"], &[without]);
    scene.refuses(&["export", "small.tdb", "--format", "features", "--out", "f.gpkg"], &[without]);
    assert!(!scene.run_to(0, &["report", "small.tdb"]).stdout.contains("Roads, water"));
}
