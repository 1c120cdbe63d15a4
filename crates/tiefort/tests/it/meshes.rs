//! `sample` and `tin`: a raster out, a mesh out.

use std::fs;

use serde_json::Value;

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
fn a_glb_says_where_it_lies_and_has_no_map_coordinates() {
    let scene = Scene::new();
    Raster::sound().write(&scene.path("dem.tif"));
    scene.run_to(0, &["tin", "dem.tif", "--points", "200", "--out", "mesh.glb", "--quiet"]);
    let mesh = fs::read(scene.path("mesh.glb")).unwrap();
    assert!(mesh.starts_with(b"glTF"));
    let length = u32::from_le_bytes(mesh[12..16].try_into().unwrap()) as usize;
    let document: Value = serde_json::from_slice(&mesh[20..20 + length]).unwrap();
    assert_eq!(document["accessors"][0]["count"], 200);
    assert_eq!(document["asset"]["extras"]["crs"], "EPSG:32611");
    let map = ["tin", "dem.tif", "--points", "9", "--coordinates", "map", "--out", "other.glb"];
    scene.refuses(&map, &["--coordinates map", ".glb"]);
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
    scene.refuses(&["tin", "dem.tif", "--points", "9", "--out", "mesh.ply"], &["dem.tif", "it begins with 6e 6f"]);
    scene.refuses(&["tin", "none.tif", "--points", "9", "--out", "mesh.ply"], &["none.tif"]);
}

#[test]
fn a_mesh_is_measured_when_asked_and_more_points_show_more_of_the_truth() {
    let scene = Scene::new();
    Raster::sound().write(&scene.path("dem.tif"));
    let said = scene.run_to(0, &["tin", "dem.tif", "--points", "60", "--measure", "--out", "mesh.ply"]);
    assert!(said.stdout.is_empty() && said.stderr.contains("Line of sight") && said.stderr.contains("Slope"));
    let said = scene.run_to(0, &["tin", "dem.tif", "--points", "60", "--out", "mesh.ply"]);
    assert!(!said.stderr.contains("Line of sight"), "{}", said.stderr);
    let summary = |points: &str| -> Value {
        let said = scene.run_to(0, &["tin", "dem.tif", "--points", points, "--measure", "--json", "--out", "mesh.ply"]);
        serde_json::from_str(said.stdout.lines().last().unwrap()).unwrap()
    };
    let (few, many) = (summary("20"), summary("2000"));
    let figure = |summary: &Value, pointer: &str| summary.pointer(pointer).and_then(Value::as_f64).unwrap();
    assert!(figure(&few, "/line_of_sight/agreement") < figure(&many, "/line_of_sight/agreement"));
    assert!(figure(&many, "/slope/rms_degrees") < figure(&few, "/slope/rms_degrees"));
}

#[test]
fn no_effort_makes_more_triangles_than_asked_for() {
    let scene = Scene::new();
    scene.run_to(0, &["sample", "--posts", "41", "--out", "dem.tif"]);
    for effort in ["fast", "normal", "best"] {
        for triangles in ["2", "11", "60"] {
            let words = ["--triangles", triangles, "--effort", effort, "--out", "mesh.obj", "--quiet"];
            scene.run_to(0, &[&["tin", "dem.tif"], &words[..]].concat());
            let obj = std::fs::read_to_string(scene.path("mesh.obj")).unwrap();
            let found = obj.lines().filter(|line| line.starts_with("f ")).count();
            assert!(found <= triangles.parse().unwrap(), "{effort}: {found} of {triangles}");
        }
    }
}
