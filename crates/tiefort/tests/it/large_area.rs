//! What commands about a place open of an area of many load modules.

use std::fs;

use load_module_reader::{Area, Keep};
use serde_json::Value;

use crate::scene::Scene;

/// Load modules and tiles along a side of the area: 3 x 3 load modules to a tile.
const MODULES: u32 = 132;
const TILES: u32 = 44;
/// Rows and columns of load modules that are drawn to compare one with.
const DRAWN: u32 = 32;

const JOB: &str = r#"
[area]
name = "wide"
crs = "EPSG:32611"
origin_m = [500000, 3870000]
size_m = [66000, 66000]
spacing_m = 125
[dem]
source = "sample"
[tiles]
columns = 44
rows = 44
[limits]
per_load_module = 16
mean_per_load_module = 6
per_4km_square = 1024
[tin]
effort = "fast"
"#;

/// The row or column of the middle of each of [`DRAWN`] equal parts.
fn drawn() -> Vec<u32> {
    (0..DRAWN).map(|part| (2 * part + 1) * MODULES / (2 * DRAWN)).collect()
}

#[test]
fn commands_about_a_place_open_what_lies_around_it() {
    let scene = Scene::new();
    fs::write(scene.path("job.toml"), JOB).unwrap();
    scene.run_to(0, &["build", "job.toml", "--quiet"]);
    let (from, to) = ("533010,3903010,5", "535000,3904000,5");
    let wanted: [&[&str]; 6] = [
        &["explain", "wide.tdb", "66,67"],
        &["explain", "wide.tdb", "66,67", "--format", "json"],
        &["sight", "wide.tdb", "--from", from, "--to", to],
        &["profile", "wide.tdb", "533010,3903010", "535000,3904000"],
        &["export", "wide.tdb", "--format", "ply", "--modules", "64,64..68,68", "--quiet", "--out", "block.ply"],
        &["render", "wide.tdb", "--view", "relief", "--modules", "64,64..68,68", "--out", "block.png"],
    ];
    let answers = || {
        let said: Vec<String> = wanted.iter().map(|arguments| scene.run_to(0, arguments).stdout).collect();
        (said, ["block.ply", "block.png"].map(|name| fs::read(scene.path(name)).unwrap()))
    };
    let before = answers();
    let whole = Area::open(scene.path("wide.tdb"), Keep::OnDisk).unwrap();
    let whole = whole.load(whole.whole()).unwrap();
    let mean_squares = |row: u32, col: u32| {
        let residual = whole.modules()[(row * MODULES + col) as usize].module().residual;
        residual.sum_squared as f64 / f64::from(residual.posts)
    };
    let drawn = drawn();
    let squares = drawn.iter().flat_map(|&row| drawn.iter().map(move |&col| mean_squares(row, col)));
    let worse = squares.filter(|&other| mean_squares(66, 67) < other).count();
    let told: Value = serde_json::from_str(&before.0[1]).unwrap();
    let expected = serde_json::json!([worse + 1, 1024, 17_424]);
    assert_eq!(
        ["place", "of", "drawn_of"].map(|key| &told["residual"][key]),
        [&expected[0], &expected[1], &expected[2]]
    );
    let share = format!("of 1,024 load modules drawn evenly, {:.0} % have a larger one", worse as f64 / 10.24);
    let text = before.0[0].split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains(&share), "{share}: {text}");
    // All but headers is destroyed wherever nothing should be opened.
    let is_drawn = |tile: u32| drawn.iter().any(|module| module / 3 == tile);
    let is_near = |tile: u32| (17..28).contains(&tile);
    let mut destroyed = 0;
    for (row, col) in (0..TILES).flat_map(|row| (0..TILES).map(move |col| (row, col))) {
        if (is_drawn(row) && is_drawn(col)) || (is_near(row) && is_near(col)) {
            continue;
        }
        let path = scene.path(&format!("wide.tdb/modules/r{row:02}c{col:02}.slm"));
        let mut bytes = fs::read(&path).unwrap();
        let header = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        bytes[header..].fill(0xff);
        fs::write(path, bytes).unwrap();
        destroyed += 1;
    }
    assert!(800 < destroyed, "{destroyed}");
    assert!(answers() == before, "answers depend on what is far away");
    scene.run_to(2, &["verify", "wide.tdb"]);
}
