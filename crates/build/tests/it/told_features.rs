//! What is told of roads and water: in the report, beside it, and to a person who looks at one load module.

use std::fs;
use std::path::Path;

use build::product::WantedGround;
use inspect::{explain, verify};
use serde_json::{Value, json};
use store::files;
use terrain::ModuleId;

use crate::scene::{EPSG, ORIGIN_M, Scene, Words};

/// A road that crosses the area, a stream over it, a lake, and a track that is drawn twice.
fn write_features(folder: &Path) {
    let place = |&(east, north): &(f64, f64)| json!([ORIGIN_M[0] + east, ORIGIN_M[1] + north]);
    let places = |places: &[(f64, f64)]| places.iter().map(place).collect::<Vec<Value>>();
    let feature = |tags: Value, kind: &str, coordinates: Value| {
        let geometry = json!({ "type": kind, "coordinates": coordinates });
        json!({ "type": "Feature", "properties": tags, "geometry": geometry })
    };
    let line = |tags: Value, of: &[(f64, f64)]| feature(tags, "LineString", json!(places(of)));
    let track = [(300.0, 1800.0), (700.0, 1500.0), (650.0, 1200.0)];
    let ring = [(1150.0, 1150.0), (1450.0, 1200.0), (1400.0, 1500.0), (1200.0, 1450.0), (1150.0, 1150.0)];
    let features = [
        line(json!({ "highway": "primary" }), &[(-300.0, 700.0), (800.0, 800.0), (2300.0, 900.0)]),
        line(json!({ "highway": "track" }), &track),
        line(json!({ "highway": "track" }), &track),
        line(json!({ "waterway": "stream" }), &[(1000.0, 2100.0), (1050.0, 900.0), (900.0, -100.0)]),
        feature(json!({ "natural": "water" }), "Polygon", json!([places(&ring)])),
    ];
    let crs = json!({ "type": "name", "properties": { "name": format!("urn:ogc:def:crs:EPSG::{EPSG}") } });
    let all = json!({ "type": "FeatureCollection", "crs": crs, "features": features });
    fs::write(folder.join("f.geojson"), all.to_string()).unwrap();
}

/// 4 x 4 load modules in 2 x 2 tiles.
fn scene(features: bool) -> Scene {
    let section = if features { "[features]\nsources = [\"f.geojson\"]" } else { "" };
    let words = Words { size: (4, 4), tiles: (2, 2), tin: section.into(), ..Words::sample() };
    Scene::with_files(&words, write_features)
}

#[test]
fn the_report_tells_what_features_cost_how_true_they_are_and_what_became_of_them() {
    let scene = scene(true);
    let report = scene.build("a.tdb", 2).report;
    let features = report.features.as_ref().unwrap();
    let names: Vec<&str> = features.classes.iter().map(|class| class.name.as_str()).collect();
    assert_eq!(names, ["primary", "track", "stream", "lake"]);
    let [primary, track, stream, lake] = &features.classes[..] else { panic!("four classes") };
    let km = |of: &store::ReportFeatureClass| of.line_km + of.strip_km + of.channel_km;
    assert!((1.9..2.2).contains(&km(primary)) && (0.7..0.9).contains(&km(track)), "{features:?}");
    assert!((1.5..2.3).contains(&km(stream)) && stream.channel_km == km(stream), "{features:?}");
    assert_eq!((lake.lakes, km(lake)), (1, 0.0));
    // The track's bridge, its copy, and what was left out are not in the ground; nothing else is missing.
    for class in &features.classes {
        assert!(km(class) <= class.wanted_km + 0.001, "{class:?}");
    }
    assert!(0.99 * primary.wanted_km <= km(primary), "{primary:?}");
    let costs: u64 = features.classes.iter().map(|class| class.cost.triangles).sum();
    assert_eq!(features.all.triangles, costs);
    assert!(0.0 < features.all.module_share && features.all.module_share <= 0.8, "{features:?}");

    let checks = &features.checks;
    assert!(0 < checks.edges && 0 < checks.stations && 0 < checks.river_edges && 0 < checks.shore_posts);
    assert_eq!((checks.edges_missing, checks.stations_steeper, checks.river_edges_rising), (0, 0, 0), "{checks:?}");
    assert_eq!((checks.lakes, checks.lake_spread_max_m, checks.shore_posts_below), (1, 0.0, 0), "{checks:?}");
    assert_eq!(checks.strip_fall_max_m, 0.0, "{checks:?}");
    // Some posts are not outside, and the figures are of those that are.
    let posts: u64 = report.classes.iter().map(|class| class.posts).sum();
    assert!(checks.outside_posts < posts && posts / 2 < checks.outside_posts, "{checks:?}");
    assert!(0.0 < checks.outside_rms_m && checks.outside_rms_m < checks.outside_max_m, "{checks:?}");

    // The track's copy, and the road over the stream.
    let text = fs::read_to_string(scene.path("a.tdb/features.geojson")).unwrap();
    let value: Value = serde_json::from_str(&text).unwrap();
    let listed = value["features"].as_array().unwrap();
    let remarks = &features.remarks;
    assert_eq!(listed.len() as u64, remarks.mended + remarks.degraded + remarks.left_out);
    for found in ["it is a copy of another", "a road crosses a river without a bridge"] {
        let is_listed = |feature: &&Value| feature["properties"]["found"] == found;
        assert!(listed.iter().any(|feature| is_listed(&feature)), "{found}: {text}");
    }
}

#[test]
fn a_database_with_features_is_sound_and_a_report_that_tells_others_is_not() {
    let scene = scene(true);
    let mut built = scene.build("a.tdb", 2);
    assert_eq!(verify(&scene.path("a.tdb"), None).unwrap().problems, Vec::<String>::new());
    built.report.features.as_mut().unwrap().checks.edges += 1;
    built.database.write_json(files::REPORT, &built.report).unwrap();
    let problems = verify(&scene.path("a.tdb"), None).unwrap().problems;
    assert!(problems.iter().any(|problem| problem.contains("report.json: features.checks.edges is")), "{problems:?}");
}

#[test]
fn a_load_module_is_explained_with_its_features_and_a_build_without_them_tells_nothing() {
    let scene_of = scene(true);
    scene_of.build("a.tdb", 2);
    let explained = |scene: &Scene, row, col| {
        explain(&scene.path("a.tdb"), ModuleId { row, col }, WantedGround::None, 1).unwrap().features
    };
    let features = explained(&scene_of, 1, 2).unwrap();
    assert!(features.cost.iter().any(|(name, triangles)| name == "primary" && 0 < *triangles), "{features:?}");
    assert!(0.0 < features.share && features.share <= features.share_max, "{features:?}");
    let all: usize = (0..16).map(|at| explained(&scene_of, at / 4, at % 4).unwrap().remarks.len()).sum();
    assert!(0 < all);

    let without = scene(false);
    let report = without.build("a.tdb", 2).report;
    assert_eq!((report.features, explained(&without, 1, 2)), (None, None));
    assert!(!without.path("a.tdb/features.geojson").exists());
    let text = fs::read_to_string(without.path("a.tdb/report.json")).unwrap();
    assert!(!text.contains("\"features\""), "{text}");
}
