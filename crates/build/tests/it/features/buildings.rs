//! Buildings lie beside the ground and change nothing of it.

use std::fs;

use inspect::verify;
use store::{Folder, files};

use super::drawing::{Drawing, Drawn, line, polygon};
use crate::scene::{Scene, Tree, assert_same};

fn hills(east: f64, north: f64) -> f64 {
    500.0 + 30.0 * ((east * 0.004).sin() + (north * 0.006).cos())
}

fn drawn() -> Vec<Drawn> {
    vec![
        line("highway=primary", &[(-100.0, 300.0), (900.0, 700.0), (2100.0, 1500.0)]),
        polygon("building=yes", &[(100.0, 100.0), (120.0, 100.0), (120.0, 130.0), (100.0, 130.0)]),
        polygon("building=house height=9", &[(700.0, 1100.0), (700.0, 1120.0), (715.0, 1120.0), (715.0, 1100.0)]),
        polygon("building=yes", &[(-80.0, 100.0), (-60.0, 100.0), (-60.0, 130.0), (-80.0, 130.0)]),
        polygon("building=no", &[(400.0, 100.0), (420.0, 100.0), (420.0, 130.0), (400.0, 130.0)]),
    ]
}

fn ground_of(scene: &Scene, folder: &str) -> Tree {
    let is_ground = |path: &std::path::PathBuf| path.starts_with("tiles") || path.starts_with("modules");
    scene.product(folder).into_iter().filter(|(path, _)| is_ground(path)).collect()
}

#[test]
fn buildings_of_the_area_are_kept_and_the_ground_has_the_same_bytes_without_them() {
    let mut drawing = Drawing::new(hills, &drawn());
    drawing.built();
    let folder = Folder::new(drawing.scene.path("area.tdb"));
    let (_, buildings) = folder.read_buildings().unwrap();
    assert_eq!(buildings.iter().map(|building| building.top).collect::<Vec<_>>(), [6 * 8, 9 * 8]);
    assert_eq!(buildings[0].rings[0].iter().min(), Some(&[100 * 8, 100 * 8]));
    assert!(folder.manifest().unwrap().files.contains_key(files::BUILDINGS));
    let with = ground_of(&drawing.scene, "area.tdb");
    assert!(drawing.scene.build("area.tdb", 2).is_unchanged);

    drawing.scene.job.features.as_mut().unwrap().buildings = false;
    let again = drawing.scene.build("area.tdb", 2);
    assert!(again.rebuilt == 0 && !again.is_unchanged, "no tile depends on them");
    drawing.scene.verify("area.tdb");
    assert!(!folder.path(files::BUILDINGS).exists(), "those of an earlier job are gone");
    assert_same(&with, &ground_of(&drawing.scene, "area.tdb"), "without buildings");
}

#[test]
fn a_damaged_file_of_buildings_is_found_and_made_again() {
    let drawing = Drawing::new(hills, &drawn());
    drawing.built();
    let path = drawing.scene.path("area.tdb").join(files::BUILDINGS);
    let whole = fs::read(&path).unwrap();
    let mut damaged = whole.clone();
    *damaged.last_mut().unwrap() ^= 1;
    fs::write(&path, damaged).unwrap();
    let found = verify(&drawing.scene.path("area.tdb"), None).unwrap().problems.join("\n");
    assert!(found.contains("features.buildings"), "{found}");
    assert_eq!(drawing.scene.build("area.tdb", 2).rebuilt, 0);
    assert_eq!(fs::read(&path).unwrap(), whole);
}
