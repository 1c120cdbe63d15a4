//! `sample` and `tin`: a raster out, a mesh out.

use std::fs;

use crate::raster::Raster;
use crate::scene::Scene;

#[test]
fn a_sample_is_the_same_every_time_and_can_be_meshed() {
    let scene = Scene::new();
    scene.run_to(0, &["sample", "--posts", "101", "--seed", "5", "--classes", "classes.tif", "--out", "a.tif"]);
    scene.run_to(0, &["sample", "--posts", "101", "--seed", "5", "--out", "b.tif"]);
    assert!(fs::read(scene.path("a.tif")).unwrap() == fs::read(scene.path("b.tif")).unwrap());
    assert!(scene.path("classes.tif").exists());
    let said = scene.run_to(0, &["tin", "a.tif", "--points", "300", "--out", "mesh.ply"]);
    assert!(said.stdout.is_empty() && said.stderr.contains("300 points"), "{}", said.stderr);
    let mesh = fs::read(scene.path("mesh.ply")).unwrap();
    assert!(mesh.starts_with(b"ply\nformat binary_little_endian 1.0\n"));
}

#[test]
fn an_obj_has_the_points_that_were_asked_for() {
    let scene = Scene::new();
    Raster::sound().write(&scene.path("dem.tif"));
    for method in ["optimised", "paper", "greedy"] {
        scene.run_to(0, &["tin", "dem.tif", "--points", "200", "--method", method, "--out", "mesh.obj", "--quiet"]);
        let mesh = fs::read_to_string(scene.path("mesh.obj")).unwrap();
        assert_eq!(mesh.lines().filter(|line| line.starts_with("v ")).count(), 200, "{method}");
    }
}

#[test]
fn tiles_and_targets_make_a_mesh_too() {
    let scene = Scene::new();
    Raster::sound().write(&scene.path("dem.tif"));
    let tiled = ["tin", "dem.tif", "--max-residual", "1", "--tiles", "2x2", "--method", "greedy", "--out", "mesh.ply"];
    let said = scene.run_to(0, &tiled);
    assert!(said.stderr.contains("the largest residual is reached"), "{}", said.stderr);
    let said = scene.run_to(0, &["tin", "dem.tif", "--rms", "0.5", "--coordinates", "map", "--out", "mesh.obj"]);
    assert!(said.stderr.contains("the RMS residual is reached"), "{}", said.stderr);
    assert!(fs::read_to_string(scene.path("mesh.obj")).unwrap().contains("# crs EPSG:32611\nv 50"));
}

#[test]
fn a_mesh_of_a_bad_raster_is_refused() {
    let scene = Scene::new();
    fs::write(scene.path("dem.tif"), "no raster").unwrap();
    scene.refuses(&["tin", "dem.tif", "--points", "9", "--out", "mesh.ply"], &["dem.tif", "not a TIFF"]);
    scene.refuses(&["tin", "none.tif", "--points", "9", "--out", "mesh.ply"], &["none.tif"]);
}
