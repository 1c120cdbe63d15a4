//! The same bytes from any number of workers and features in any order; and what changes when a road was moved.

use std::fs;

use super::drawing::{Drawing, Drawn, geojson, line, polygon};
use crate::scene::{Scene, assert_same};

fn hills(east: f64, north: f64) -> f64 {
    500.0 + 30.0 * ((east * 0.004).sin() + (north * 0.006).cos()) + 0.03 * north
}

fn drawn() -> Vec<Drawn> {
    vec![
        line("highway=primary", &[(-100.0, 300.0), (900.0, 700.0), (2100.0, 1500.0)]),
        line("highway=track", &[(900.0, 700.0), (1000.0, 1900.0)]),
        line("waterway=stream", &[(300.0, 2000.0), (600.0, 900.0), (700.0, 0.0)]),
        polygon("natural=water", &[(1300.0, 300.0), (1700.0, 350.0), (1600.0, 800.0), (1250.0, 700.0)]),
        line("highway=residential", &[(1500.0, 1900.0), (1900.0, 1000.0)]),
    ]
}

fn products(scene: &Scene, folder: &str) -> crate::scene::Tree {
    let is_product = |path: &std::path::PathBuf| path.starts_with("tiles") || path.starts_with("modules");
    scene.product(folder).into_iter().filter(|(path, _)| is_product(path)).collect()
}

#[test]
fn one_two_and_five_workers_and_features_in_any_order_make_the_same_bytes() {
    let drawing = Drawing::new(hills, &drawn());
    drawing.built();
    let first = drawing.scene.product("area.tdb");
    for workers in [1, 5] {
        drawing.scene.build(&format!("by-{workers}.tdb"), workers);
        assert_same(&first, &drawing.scene.product(&format!("by-{workers}.tdb")), "another number of workers");
    }
    let mut other = drawn();
    other.reverse();
    other.swap(0, 2);
    let other = Drawing::new(hills, &other);
    other.built();
    assert_same(
        &products(&drawing.scene, "area.tdb"),
        &products(&other.scene, "area.tdb"),
        "another order of features",
    );
}

#[test]
fn a_second_build_changes_nothing_and_one_without_its_report_keeps_every_tile() {
    let drawing = Drawing::new(hills, &drawn());
    drawing.built();
    assert!(drawing.scene.build("area.tdb", 2).is_unchanged);
    drawing.scene.forget_report("area.tdb");
    assert_eq!(drawing.scene.build("area.tdb", 2).rebuilt, 0);
}

#[test]
fn a_road_that_was_moved_rebuilds_what_it_reaches_to_the_bytes_of_a_fresh_build() {
    let drawing = Drawing::new(hills, &drawn());
    drawing.built();
    let mut moved = drawn();
    moved[4] = line("highway=residential", &[(1500.0, 1900.0), (1850.0, 1050.0)]);
    fs::write(drawing.scene.path("features.geojson"), geojson(&moved)).unwrap();
    let again = drawing.scene.build("area.tdb", 2);
    assert!(0 < again.rebuilt, "the tile of the road is built again");
    drawing.scene.build("fresh.tdb", 2);
    assert_same(&drawing.scene.product("fresh.tdb"), &drawing.scene.product("area.tdb"), "after a road was moved");
}

#[test]
fn a_tile_built_again_is_as_it_was() {
    let drawing = Drawing::new(hills, &drawn());
    drawing.built();
    let before = products(&drawing.scene, "area.tdb");
    let (rebuilt, is_frozen) = drawing.scene.tile("area.tdb", terrain::TileId { row: 1, col: 1 }, false);
    assert_eq!((rebuilt.len(), is_frozen), (1, false));
    assert_same(&before, &products(&drawing.scene, "area.tdb"), "after one tile");
}

#[test]
fn a_tile_built_again_after_roads_were_drawn_in_it_leaves_an_area_that_is_sound() {
    for tin in ["", "method = \"greedy\""] {
        let words = crate::scene::Words { tin: tin.into(), ..Drawing::words() };
        let drawing = Drawing::of(words, hills, &drawn());
        drawing.built();
        let mut more = drawn();
        more.insert(0, line("highway=residential", &[(1450.0, 1900.0), (1500.0, 1600.0), (1850.0, 1500.0)]));
        more.push(line("highway=track", &[(1100.0, 1200.0), (1300.0, 1300.0), (1250.0, 1450.0)]));
        fs::write(drawing.scene.path("features.geojson"), geojson(&more)).unwrap();
        let again = drawing.scene.try_tile("area.tdb", terrain::TileId { row: 1, col: 1 }, false).unwrap();
        assert!(again.report.breaches.is_empty(), "{tin}: {:?}", again.report.breaches);
        drop(again);
        drawing.scene.verify("area.tdb");
        drawing.scene.build("area.tdb", 2);
        drawing.scene.build("fresh.tdb", 2);
        assert_same(&drawing.scene.product("fresh.tdb"), &drawing.scene.product("area.tdb"), "after a build");
    }
}

#[test]
fn a_file_without_features_makes_the_load_modules_of_a_job_without_them() {
    let (with, without) = (Drawing::new(hills, &[]), Drawing::new(hills, &[]));
    with.built();
    let words = crate::scene::Words { features: String::new(), ..Drawing::words() };
    let plain = Scene::with_files(&words, |folder| {
        fs::copy(without.scene.path("dem.tif"), folder.join("dem.tif")).unwrap();
    });
    plain.build("area.tdb", 2);
    let modules = |scene: &Scene| -> crate::scene::Tree {
        products(scene, "area.tdb").into_iter().filter(|(path, _)| path.starts_with("modules")).collect()
    };
    assert!(modules(&plain) == modules(&with.scene), "features of an empty file change nothing");
}

#[test]
fn greedy_tins_take_features_too() {
    let words = crate::scene::Words { tin: "method = \"greedy\"".into(), ..Drawing::words() };
    Drawing::of(words, hills, &drawn()).built();
}

#[test]
fn levels_of_detail_and_fixed_borders_and_a_number_of_points_take_features() {
    let words = Drawing::words();
    let all = [
        crate::scene::Words { modules: "outer_border = \"fixed\"".into(), ..words.clone() },
        crate::scene::Words { tin: "method = \"greedy\"\npoints = 200".into(), ..words.clone() },
        crate::scene::Words { tin: "effort = \"fast\"".into(), ..words.clone() },
        crate::scene::Words { tin: "effort = \"best\"\nallocation = \"equal\"".into(), ..words.clone() },
        crate::scene::Words { tin: "lattice = \"post\"".into(), ..words },
    ];
    for words in all {
        Drawing::of(words, hills, &drawn()).built();
    }
}
