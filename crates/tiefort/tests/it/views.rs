//! What people look at: pictures, the page, one load module explained, two databases compared.

use std::fs;

use serde_json::Value;

use crate::raster::Raster;
use crate::scene::Scene;

/// Width and height of a PNG.
fn size(scene: &Scene, name: &str) -> (u32, u32) {
    let bytes = fs::read(scene.path(name)).unwrap();
    assert_eq!(bytes[..8], *b"\x89PNG\r\n\x1a\n", "{name}");
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

#[test]
fn every_view_is_a_picture_and_the_same_each_time() {
    let scene = Scene::built();
    let views = ["relief", "perspective", "wireframe", "residual", "density", "limits", "tiles"];
    for view in views {
        for out in ["a.png", "b.png"] {
            let workers = if out == "a.png" { "1" } else { "2" };
            scene.run_to(
                0,
                &["render", "small.tdb", "--view", view, "--size", "240", "--workers", workers, "--out", out],
            );
        }
        assert_eq!(fs::read(scene.path("a.png")).unwrap(), fs::read(scene.path("b.png")).unwrap(), "{view}");
        let (wide, high) = size(&scene, "a.png");
        assert!(240 < wide && 135 < high, "{view}: {wide} x {high}");
    }
}

#[test]
fn a_part_of_the_area_is_drawn_alone_from_any_eye() {
    let scene = Scene::built();
    let part = ["--modules", "2,3..3,6", "--size", "300", "--out", "a.png"];
    for more in [
        &["--view", "residual", "--scale", "2"][..],
        &["--view", "relief", "--of", "both"],
        &["--view", "wireframe", "--direction", "30"],
        &["--view", "perspective", "--eye", "507000,3876500,20", "--direction", "-45", "--exaggeration", "2"],
        // From outside, and from right below the northern edge.
        &["--view", "perspective", "--eye", "400000,3800000,5000", "--of", "tin"],
        &["--view", "perspective", "--eye", "506700,3876999,1", "--pitch", "-80"],
        &["--view", "tiles"],
        &["--view", "limits"],
    ] {
        scene.run_to(0, &[&["render", "small.tdb"], more, &part].concat());
        size(&scene, "a.png");
    }
    let outside = ["render", "small.tdb", "--view", "density", "--modules", "2,3..8,6", "--out", "b.png"];
    scene.refuses(&outside, &["8,6", "rows from 0 to 7"]);
    let outside = ["render", "small.tdb", "--view", "relief", "--modules", "2,3..8,6", "--out", "b.png"];
    scene.refuses(&outside, &["8,6", "rows from 0 to 7"]);
    scene.refuses(&["render", "none.tdb", "--view", "relief", "--out", "b.png"], &["none.tdb"]);
}

#[test]
fn a_build_leaves_a_page_that_report_prints_again() {
    let scene = Scene::built();
    let page = fs::read_to_string(scene.path("small.tdb/report.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("Posts by residual"));
    let said = scene.run_to(0, &["report", "small.tdb", "--format", "html"]);
    assert_eq!(said.stdout, page);
    let csv = fs::read_to_string(scene.path("small.tdb/breaches.csv")).unwrap();
    assert!(csv.starts_with("kind,where,row,col,count,limit,excess"), "{csv}");
    scene.run_to(0, &["build", "job.toml", "--fresh", "--quiet", "--no-html"]);
    assert!(!scene.path("small.tdb/report.html").exists(), "a page of an earlier build would tell of another one");
}

#[test]
fn a_load_module_is_explained_by_numbers_that_add_up() {
    let scene = Scene::built();
    let said = scene.run_to(0, &["explain", "small.tdb", "3,4"]);
    for part in ["Load module 3,4", "of the limit of 100", "in the fullest window", "One more point, two triangles"] {
        assert!(said.stdout.contains(part), "{part:?} is not in: {}", said.stdout);
    }
    let said = scene.run_to(0, &["explain", "small.tdb", "3,4", "--format", "json"]);
    let found: Value = serde_json::from_str(&said.stdout).unwrap();
    let number = |pointer: &str| found.pointer(pointer).and_then(Value::as_f64).expect(pointer);
    // Euler: a square with so many vertices inside and around has so many triangles.
    let around: f64 = (0..4).map(|side| number(&format!("/vertices_on_sides/{side}")) - 1.0).sum();
    assert_eq!(number("/triangles"), 2.0 * number("/vertices_inside") + around - 2.0);
    assert!(number("/one_more/rms_after_m") < number("/residual/rms_m"));
    assert_eq!(number("/residual/of"), 64.0);
    scene.refuses(&["explain", "small.tdb", "8,0"], &["8,0", "row from 0 to 7"]);
}

#[test]
fn a_database_differs_from_another_one_where_their_load_modules_do() {
    let scene = Scene::built();
    let said = scene.run_to(0, &["diff", "small.tdb", "small.tdb"]);
    assert_eq!(said.stdout, "All 64 load modules are alike.\n");
    let text = fs::read_to_string(scene.path("job.toml")).unwrap();
    let other = text.replace("mean_per_load_module = 32", "mean_per_load_module = 24");
    fs::write(scene.path("other.toml"), other).unwrap();
    scene.run_to(0, &["build", "other.toml", "--quiet", "--no-html", "--out", "other.tdb"]);
    let said = scene.run_to(1, &["diff", "small.tdb", "other.tdb", "--all"]);
    for part in ["of 64 load modules differ", "limits.mean_per_load_module  A  32", "apart"] {
        assert!(said.stdout.contains(part), "{part:?} is not in: {}", said.stdout);
    }
    let said = scene.run_to(1, &["diff", "small.tdb", "other.tdb", "--format", "json"]);
    let found: Value = serde_json::from_str(&said.stdout).unwrap();
    let changed = found["changed"].as_array().unwrap();
    let sum = |which: usize| changed.iter().map(|module| module["triangles"][which].as_u64().unwrap()).sum::<u64>();
    let area = |which: usize| found["triangles"][which].as_u64().unwrap();
    assert_eq!(i128::from(sum(0)) - i128::from(sum(1)), i128::from(area(0)) - i128::from(area(1)));
    let moved = text.replace("origin_m = [505000, 3875000]", "origin_m = [505500, 3875000]");
    fs::write(scene.path("moved.toml"), moved).unwrap();
    scene.run_to(0, &["build", "moved.toml", "--quiet", "--no-html", "--out", "moved.tdb"]);
    scene.refuses(&["diff", "small.tdb", "moved.tdb"], &["origin_m", "505500"]);
}

#[test]
fn without_its_raster_a_database_is_drawn_and_explained_as_far_as_it_goes() {
    let scene = Scene::with_job("raster.toml", &[]);
    Raster::sound().write(&scene.path("dem.tif"));
    scene.run_to(0, &["build", "job.toml", "--quiet", "--out", "a.tdb"]);
    fs::rename(scene.path("dem.tif"), scene.path("gone.tif")).unwrap();
    let relief = ["render", "a.tdb", "--view", "relief", "--size", "200", "--out", "a.png"];
    scene.run_to(0, &relief);
    scene.refuses(&["render", "a.tdb", "--view", "residual", "--out", "b.png"], &["dem.tif"]);
    scene.run_to(0, &["render", "a.tdb", "--view", "residual", "--against", "gone.tif", "--out", "b.png"]);
    let said = scene.run_to(0, &["explain", "a.tdb", "0,0"]);
    assert!(said.stdout.contains("was not computed"), "{}", said.stdout);
    let said = scene.run_to(0, &["report", "a.tdb", "--format", "html"]);
    assert!(said.stdout.contains("No map of residuals") && said.stderr.contains("--against"), "{}", said.stderr);
    let said = scene.run_to(0, &["report", "a.tdb", "--format", "html", "--against", "gone.tif"]);
    assert!(said.stdout.contains("Posts by residual"));
}
