//! `fidelity`: what it prints, and what it says when there is nothing to measure.

use std::fs;

use serde_json::Value;

use crate::raster::Raster;
use crate::scene::Scene;

/// A database of the raster beside its job.
fn built() -> Scene {
    let scene = Scene::with_job("raster.toml", &[]);
    Raster::sound().write(&scene.path("dem.tif"));
    scene.run_to(0, &["build", "job.toml", "--out", "area.tdb", "--quiet"]);
    scene
}

#[test]
fn a_database_is_measured_in_words_and_for_programs() {
    let scene = built();
    let text = scene.run_to(0, &["fidelity", "area.tdb"]).stdout;
    for part in [
        "dem.tif",
        "grid",
        "Residual",
        "99 % within",
        "Line of sight",
        "20,000 pairs",
        "95 % sure",
        "Slope",
        "normals",
        "Trafficability",
        "above 45 %",
        "Cover",
        "Drainage",
        "spurious pits",
        "Hausdorff",
        "Registration",
        "Seams",
        "T-junctions",
    ] {
        assert!(text.contains(part), "{part:?} is not in: {text}");
    }
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    let json = scene.run_to(0, &["fidelity", "area.tdb", "--pairs", "500", "--format", "json"]).stdout;
    let found: Value = serde_json::from_str(&json).unwrap();
    for pointer in "/area /against /seed /residual_as_built/rms_m /residual_as_built/mean_abs_m
        /residual_as_built/max_m /residual_as_built/posts /line_of_sight/agreement /line_of_sight/half_width
        /line_of_sight/false_visible /line_of_sight/false_hidden /line_of_sight/visible_share_dem
        /line_of_sight/visible_share_tin /line_of_sight/left_out /slope/rms_degrees /slope/normal_mean_degrees
        /slope/normal_p95_degrees /slope/posts /residual/p50_m /residual/p95_m /residual/p99_m /slope_classes/agreement
        /slope_classes/shares_tin/3 /slope_classes/posts_by_class_on_dem_and_tin/3/3 /hausdorff/max_m
        /hausdorff/dem_to_tin/mean_m /drainage/pits_spurious /drainage/channel_posts_dem /cover/agreement
        /registration/aside_m /seams/ratio /mesh/below_5_degrees /mesh/is_sound /polygons /regular_grid/step_posts
        /regular_grid/step_m /regular_grid/residual/rms_m /regular_grid/line_of_sight/half_width
        /regular_grid/mesh/triangles"
        .split_whitespace()
    {
        assert!(found.pointer(pointer).is_some_and(|value| !value.is_null()), "{json} lacks {pointer}");
    }
    assert_eq!(found["line_of_sight"]["pairs"], 500);
    let again = scene.run_to(0, &["fidelity", "area.tdb", "--pairs", "500", "--format", "json"]).stdout;
    assert_eq!(json, again);
    let other = scene.run_to(0, &["fidelity", "area.tdb", "--pairs", "500", "--seed", "2", "--format", "json"]).stdout;
    assert!(json != other, "another seed drew the same pairs");
}

#[test]
fn residuals_are_told_by_class_and_equal_those_of_the_build() {
    let steep = r#"slope_above_percent = 25, smooth_m = 100, class = "steep""#;
    let scene = Scene::with_job("small.toml", &[(r#"sample = "mountains", class = "mountains""#, steep)]);
    scene.run_to(0, &["build", "job.toml", "--out", "area.tdb", "--quiet"]);
    let text = scene.run_to(0, &["fidelity", "area.tdb", "--pairs", "100"]).stdout;
    assert!(text.contains("On default") && text.contains("On steep"), "{text}");
    let json = scene.run_to(0, &["fidelity", "area.tdb", "--pairs", "100", "--format", "json"]).stdout;
    let found: Value = serde_json::from_str(&json).unwrap();
    let report: Value = serde_json::from_str(&fs::read_to_string(scene.path("area.tdb/report.json")).unwrap()).unwrap();
    for (class, built) in found["classes"].as_array().unwrap().iter().zip(report["classes"].as_array().unwrap()) {
        assert_eq!((&class["name"], &class["residual"]["posts"]), (&built["name"], &built["posts"]));
        let rms_m = |value: &Value| value["residual"]["rms_m"].as_f64().unwrap();
        assert!((rms_m(class) - rms_m(built)).abs() < 1e-9, "{class} {built}");
        assert!(rms_m(class) < rms_m(&class["regular_grid"]), "{class}");
    }
    assert_eq!(found["classes"].as_array().unwrap().len(), 2);
}

#[test]
fn without_the_ground_of_the_build_a_raster_has_to_be_named() {
    let scene = built();
    fs::rename(scene.path("dem.tif"), scene.path("moved.tif")).unwrap();
    scene.refuses(&["fidelity", "area.tdb"], &["area.tdb", "dem.tif", "the raster the database was built from"]);
    let text = scene.run_to(0, &["fidelity", "area.tdb", "--against", "moved.tif"]).stdout;
    assert!(text.contains("against moved.tif"), "{text}");
    scene.refuses(&["fidelity", "area.tdb", "--against", "none.tif"], &["none.tif"]);
    Raster::sound().moved_m(700.0).write(&scene.path("aside.tif"));
    // What such a raster does not reach is left out, and told.
    let text = scene.run_to(0, &["fidelity", "area.tdb", "--against", "aside.tif"]).stdout;
    let words: Vec<&str> = text.split_whitespace().collect();
    assert!(words.join(" ").contains("left out (voids, or no room)"), "{text}");
    Raster::sound().all_void().write(&scene.path("void.tif"));
    scene.refuses(&["fidelity", "area.tdb", "--against", "void.tif"], &["void.tif"]);
}

#[test]
fn what_is_no_sound_database_is_not_measured() {
    let scene = built();
    scene.refuses(&["fidelity", "none.tdb"], &["none.tdb"]);
    let path = scene.path("area.tdb/modules/r00c00.slm");
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&path, bytes).unwrap();
    scene.refuses(&["fidelity", "area.tdb"], &["r00c00.slm"]);
    fs::remove_file(&path).unwrap();
    scene.refuses(&["fidelity", "area.tdb"], &["r00c00.slm"]);
}
