//! Random roads, rivers and lakes on random ground: vertices on tile lines and corners, shared, nearly shared, outside,
//! ways that run back and cross themselves. Whatever is drawn, the product is whole, keeps its limits, and is the same
//! from any number of workers.
//!
//! A failure prints its seed; `TIEFORT_SEED=n` runs that one alone, `TIEFORT_JOBS=n` the first n, and
//! `TIEFORT_KEEP=FOLDER` leaves job and features there. Seeds that once failed stay in `KEPT`.

use std::fs;

use build::CompileError;
use build::ground::GroundError;

use super::drawing::{At, Drawn, Laid, check_ground, geojson, line, polygon};
use crate::findings::check_limits;
use crate::product::{Edges, Product};
use crate::random_jobs::{Seed, ground};
use crate::scene::{Draw, Scene, Words, assert_same, write_dem};

/// Drawings tried in every run.
const JOBS: u64 = 40;
/// Seeds that once showed a fault.
const KEPT: [u64; 4] = [72, 113, 119, 137];

const LINES: [&str; 14] = [
    "highway=motorway",
    "highway=primary width=11",
    "highway=residential",
    "highway=track",
    "highway=primary bridge=yes layer=1",
    "highway=track bridge=yes",
    "highway=secondary tunnel=yes layer=-1",
    "railway=rail",
    "aeroway=runway width=30",
    "waterway=river",
    "waterway=stream",
    "waterway=canal tunnel=culvert layer=-1",
    "waterway=dam",
    "highway=unclassified width=wide",
];
const POLYGONS: [&str; 5] =
    ["natural=water", "landuse=reservoir", "natural=water water=river", "aeroway=apron", "natural=water ele=500"];

/// Features of an area of so many load modules, south to north and west to east.
pub fn drawn(draw: &mut Draw, (rows, cols): (u32, u32)) -> Vec<Drawn> {
    let mut places: Vec<At> = Vec::new();
    let mut features = Vec::new();
    for _ in 0..draw.within(1, 12) {
        let is_polygon = draw.below(4) == 0;
        let count = draw.within(2 + u32::from(is_polygon), 8);
        let around = place(draw, (rows, cols), &places);
        let mut own: Vec<At> = Vec::new();
        for _ in 0..count {
            let at = match draw.below(3) {
                // Near the others of its own, so that there are short ones and polygons of any form.
                0 => (around.0 + along(draw, 400), around.1 + along(draw, 400)),
                _ => place(draw, (rows, cols), &places),
            };
            own.push(at);
        }
        places.extend(&own);
        features.push(match is_polygon {
            true => polygon(draw.one_of(&POLYGONS), &own),
            false => line(draw.one_of(&LINES), &own),
        });
        if draw.below(10) == 0 {
            features.push(features[features.len() - 1].clone());
        }
    }
    features
}

/// Metres either way.
fn along(draw: &mut Draw, metres: u32) -> f64 {
    f64::from(draw.within(0, 8 * metres)) / 4.0 - f64::from(metres)
}

fn place(draw: &mut Draw, (rows, cols): (u32, u32), known: &[At]) -> At {
    let anywhere = |draw: &mut Draw, count: u32| f64::from(draw.below(count * 50_000 + 40_000)) / 100.0 - 200.0;
    let line = |draw: &mut Draw, count: u32| f64::from(draw.within(0, count) * 500);
    let last = known.len() as u32;
    match draw.below(8) {
        0 => (line(draw, cols), line(draw, rows)),
        1 => (line(draw, cols), anywhere(draw, rows)),
        2 => (anywhere(draw, cols), line(draw, rows)),
        3 if 0 < last => known[draw.below(last) as usize],
        4 if 0 < last => {
            let near = known[draw.below(last) as usize];
            (near.0 + f64::from(draw.below(9)) / 10.0 - 0.4, near.1 + f64::from(draw.below(9)) / 10.0 - 0.4)
        }
        _ => (anywhere(draw, cols), anywhere(draw, rows)),
    }
}

fn words(draw: &mut Draw) -> Words {
    let size = (draw.within(2, 5), draw.within(2, 6));
    let tiles = (draw.within(1, size.0 / 2), draw.within(1, size.1 / 2));
    let tin = draw.one_of(&[
        "",
        "effort = \"fast\"",
        "lattice = \"post\"",
        "allocation = \"equal\"",
        "method = \"greedy\"",
        "method = \"greedy\"\npoints = 100\nallocation = \"equal\"",
        "method = \"greedy\"\nmax_residual_m = 4",
    ]);
    let limits = draw.one_of(&["", "", "per_load_module = 40", "per_load_module = 250", "per_4km_square = 1200"]);
    let share = draw.one_of(&["", "share_max = 0.9", "share_max = 0.1"]);
    let levels = draw.one_of(&["", "", "\n[lod]\nlevels = [{ inner_share = 0.5 }]"]);
    Words {
        size,
        tiles,
        order: format!("order = \"{}\"", draw.one_of(&["colour", "raster"])),
        modules: draw.one_of(&["", "outer_border = \"fixed\""]).into(),
        limits: limits.into(),
        tin: format!("{tin}{levels}"),
        features: format!("sources = [\"features.geojson\"]\n{share}"),
        ..Words::raster()
    }
}

/// Runs the drawing of a seed; returns whether it was possible at all.
fn run(seed: u64) -> bool {
    let _seed = Seed(seed);
    let mut draw = Draw(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 7);
    let words = words(&mut draw);
    let dem = ground(&mut draw, &words);
    let features = drawn(&mut draw, words.size);
    let scene = Scene::with_files(&words, |folder| {
        if let Ok(kept) = std::env::var("TIEFORT_KEEP") {
            fs::write(format!("{kept}/{seed}.geojson"), geojson(&features)).unwrap();
            fs::write(format!("{kept}/{seed}.toml"), words.text()).unwrap();
            write_dem(&std::path::Path::new(&kept).join("dem.tif"), &dem);
        }
        write_dem(&folder.join("dem.tif"), &dem);
        fs::write(folder.join("features.geojson"), geojson(&features)).unwrap();
    });
    match build::plan(&scene.job) {
        Err(CompileError::Ground(GroundError::Impossible { .. })) => return false,
        planned => drop(planned.unwrap_or_else(|error| panic!("{error}"))),
    }
    let built = scene.build("area.tdb", 2);
    let product = Product::read(&scene.path("area.tdb"));
    product.check(Edges::Constrained);
    check_limits(&scene.job, &product, &built, Edges::Constrained);
    drop(built);
    scene.verify_on_dem("area.tdb");
    check_ground(&scene);
    Laid::open(&scene).check();
    drop(scene.build("alone.tdb", 1));
    assert_same(&scene.product("alone.tdb"), &scene.product("area.tdb"), "by one worker and by two");
    true
}

#[test]
fn random_features_are_whole_and_within_limits_and_the_same_from_any_workers() {
    if let Ok(seed) = std::env::var("TIEFORT_SEED") {
        run(seed.parse().unwrap());
        return;
    }
    let jobs = std::env::var("TIEFORT_JOBS").map_or(JOBS, |jobs| jobs.parse().unwrap());
    let possible = (0..jobs).chain(KEPT).filter(|&seed| run(seed)).count();
    assert!(jobs / 2 < possible as u64, "only {possible} drawings were possible");
}
