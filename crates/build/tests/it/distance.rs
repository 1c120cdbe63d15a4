//! The distance from the limit that a build tells, held against ground whose limit is known.

use std::fs;

use build::Built;
use store::Folder;
use terrain::{Dem, quanta_of_metres};

use crate::modes;
use crate::product::Product;
use crate::scene::{SIDE_CELLS, Scene, Words, assert_same, differing, tile};
use crate::surface::sums_of_product;

/// Metres of height for each square metre of squared distance: H is diagonal, 2 of these twice.
const STEEPNESS: f64 = 0.000_2;

/// A round bowl in the middle of an area; posts are 25 m apart.
fn bowl(words: &Words) -> Dem {
    let rect = words.grid().area();
    let from_middle = |at: i32, cells: usize| (f64::from(at) - cells as f64 / 2.0) * 25.0;
    Dem::from_fn(rect, |post| {
        let (x, y) = (from_middle(post.col, rect.cells_wide()), from_middle(post.row, rect.cells_high()));
        quanta_of_metres(STEEPNESS * (x * x + y * y))
    })
}

/// The RMS residual of the best surface on so many load modules of 500 m, in metres: the determinant is the same
/// everywhere, and positive.
fn limit_m(modules: f64, triangles: u64) -> f64 {
    (4.0 * STEEPNESS * STEEPNESS / 180.0).sqrt() * modules * 500.0 * 500.0 / triangles as f64
}

#[track_caller]
fn check(words: &Words, dem: &Dem, modules: f64) -> Built {
    let scene = Scene::on(words, dem);
    let built = scene.build("area", 2);
    let (report, limit) = (&built.report, built.report.limit.unwrap());
    assert_eq!(limit.triangles, report.triangles);
    let expected = limit_m(modules, report.triangles);
    assert!((limit.rms_m / expected - 1.0).abs() < 0.02, "{limit:?}, expected {expected} m");
    assert!(limit.rough_share < 0.01, "{limit:?}");
    // By triangles read back and heights as they are written above: nothing is shared with what the report is from.
    let found = sums_of_product(&Product::read(&scene.path("area")), dem).rms_m() / expected;
    let eta = limit.eta.unwrap();
    assert!((eta / found - 1.0).abs() < 0.02, "eta {eta}, expected {found}");
    scene.verify("area");
    built
}

#[test]
fn eta_of_a_bowl_is_its_residual_over_the_formula_however_it_is_tiled() {
    for tiles in [(1, 1), (3, 3), (4, 5)] {
        let words = Words { tiles, ..Words::raster() };
        let eta = check(&words, &bowl(&words), 90.0).report.limit.unwrap().eta.unwrap();
        assert!((1.0..1.6).contains(&eta), "{eta}");
    }
}

#[test]
fn eta_is_that_of_the_finest_level() {
    let plain = Words { tiles: (2, 2), ..Words::raster() };
    let without = check(&plain, &bowl(&plain), 90.0).report;
    let tin = "[lod]\nlevels = [{ inner_share = 0.5 }]".to_owned();
    let words = Words { tin, ..plain };
    let with = check(&words, &bowl(&words), 90.0).report;
    assert_eq!(with.levels.len(), 2);
    assert_eq!(with.limit, without.limit);
}

#[test]
fn ground_without_heights_has_no_limit_to_be_near_to() {
    let words = Words { tiles: (2, 2), ..Words::raster() };
    // The four eastern columns of load modules, as no triangle has to follow what is not known.
    let bowl = bowl(&words);
    let dem = Dem::from_fn(bowl.rect(), |post| (post.col <= 6 * SIDE_CELLS).then(|| bowl.height(post)));
    let words = Words { dem: format!("{}\nvoids = \"hole\"", words.dem), ..words };
    check(&words, &dem, 54.0);
}

#[test]
fn eta_is_the_same_for_any_workers_and_when_a_tile_is_run_again() {
    let names = ["optimised", "mountains masked", "two tiles excluded", "levels of detail", "clip, paper"];
    for mode in modes::all().into_iter().filter(|(name, _)| names.contains(name)) {
        let (name, scene) = (mode.0, modes::scene(&mode));
        let limit = scene.build("one", 1).report.limit;
        assert!(limit.is_some_and(|limit| limit.eta.is_some()), "{name}: {limit:?}");
        assert_eq!(scene.build("many", 4).report.limit, limit, "{name}");
        assert_same(&scene.product("one"), &scene.product("many"), name);
        let (_, is_frozen) = scene.tile("one", tile(1, 1), false);
        let again = Folder::new(scene.path("one")).report().unwrap();
        assert!(is_frozen || again.limit == limit, "{name}: {:?}, expected {limit:?}", again.limit);
    }
}

#[test]
fn what_an_earlier_version_measured_is_measured_again_and_load_modules_are_kept() {
    let scene = Scene::new(&Words::sample());
    scene.build("area", 2);
    let before = scene.product("area");
    let path = Folder::new(scene.path("area")).measured_path(tile(0, 1));
    let mut bytes = fs::read(&path).unwrap();
    bytes[8] = 1;
    fs::write(&path, &bytes).unwrap();
    let problems = inspect::verify(&scene.path("area"), None).unwrap().problems;
    assert!(problems.iter().any(|problem| problem.ends_with("found format version 1, expected 5")), "{problems:#?}");
    scene.build("area", 2);
    assert_eq!(differing(&before, &scene.product("area")), [""; 0]);
    scene.verify("area");
}
