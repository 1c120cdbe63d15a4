//! `export` of several databases: one tileset, the finer above the coarser.

use std::fs;

use serde_json::Value;

use crate::scene::{Scene, everything_below};

/// Databases over one ground: `west.tdb` and `east.tdb` meet, `fine.tdb` lies over load modules of the western one,
/// and over parts of others.
fn built() -> Scene {
    let scene = Scene::new();
    let height = |row: i32, col: i32| 700 + (row * row / 40 + row * col / 30 + 7 * (col % 9)) % 97;
    let line = |row| (0..161).map(|col| height(row, col).to_string()).collect::<Vec<_>>().join(" ");
    let lines: Vec<String> = (0..81).map(line).collect();
    let head = "ncols 161\nnrows 81\nxllcenter 505000\nyllcenter 3875000\ncellsize 25\n";
    fs::write(scene.path("ground.asc"), format!("{head}{}\n", lines.join("\n"))).unwrap();
    for (name, origin, size, spacing) in [
        ("west", "[505000, 3875000]", 2000, 25.0),
        ("east", "[507000, 3875000]", 2000, 25.0),
        ("fine", "[505250, 3875250]", 1000, 12.5),
    ] {
        let job = format!(
            "[area]\nname = \"{name}\"\ncrs = \"EPSG:32611\"\norigin_m = {origin}\nsize_m = [{size}, {size}]\n\
             spacing_m = {spacing}\n[dem]\nsources = [{{ file = \"ground.asc\", crs = \"EPSG:32611\" }}]\n\
             vertical_datum = \"EGM96\"\n[load_modules]\nouter_border = \"fixed\"\n[tiles]\ncolumns = 1\nrows = 1\n\
             [limits]\nmean_per_load_module = 32\n"
        );
        fs::write(scene.path(&format!("{name}.toml")), job).unwrap();
        scene.run_to(0, &["build", &format!("{name}.toml"), "--quiet"]);
    }
    scene
}

#[test]
fn several_databases_are_one_tileset_in_which_the_finer_lies_above_the_coarser() {
    let scene = built();
    let export = |words: &[&str]| {
        let all = [&["export", "west.tdb", "east.tdb", "fine.tdb", "--format"], words].concat();
        scene.run_to(0, &all).stderr
    };
    let said = export(&["3dtiles", "--out", "one", "--workers", "1"]);
    for part in [
        "west.tdb: the geoid EGM96 was added to heights",
        "west.tdb: of these 1 load module is left out under finer areas, 8 are cut at their borders",
        "east.tdb: 16 load modules, ",
        "3 databases in one tileset, ",
    ] {
        assert!(said.contains(part), "{part:?} is not in: {said}");
    }
    assert!(!said.contains("east.tdb: 0") && !said.contains("common border"), "{said}");
    let json = |name: &str| -> Value { serde_json::from_slice(&fs::read(scene.path(name)).unwrap()).unwrap() };
    let index = json("one/tileset.json");
    let uri = |tile: &Value| tile["content"]["uri"].as_str().unwrap().to_owned();
    let children = index["root"]["children"].as_array().unwrap();
    let uris: Vec<String> = children.iter().map(uri).collect();
    assert_eq!(uris, ["3/tileset.json", "1/tileset.json", "2/tileset.json"]);
    for (child, uri) in children.iter().zip(&uris) {
        let below = json(&format!("one/{uri}"));
        assert_eq!(child["boundingVolume"], below["root"]["boundingVolume"]);
        let errors = [&index["root"], child, &below["root"]].map(|of| of["geometricError"].as_f64().unwrap());
        assert!(errors[2] <= errors[1] && errors[1] <= errors[0], "{errors:?}");
    }
    // What nothing lies above is what it is alone.
    let alone = ["export", "east.tdb", "--format", "3dtiles", "--out", "alone", "--quiet"];
    scene.run_to(0, &alone);
    let squares = |folder: &str| everything_below(&scene.path(folder).join("groups")).into_values().collect::<Vec<_>>();
    assert!(squares("alone") == squares("one/2"));
    export(&["3dtiles", "--out", "two", "--workers", "2"]);
    let (one, two) = (everything_below(&scene.path("one")), everything_below(&scene.path("two")));
    assert!(one.len() == two.len() && one.values().eq(two.values()), "the same bytes every time");
    export(&["3tz", "--out", "one.3tz"]);
    export(&["3tz", "--out", "two.3tz"]);
    let archive = fs::read(scene.path("one.3tz")).unwrap();
    assert!(archive == fs::read(scene.path("two.3tz")).unwrap());
    let holds = |part: &[u8]| archive.windows(part.len()).any(|window| window == part);
    assert!(one.values().flatten().all(|bytes| holds(&bytes[..bytes.len().min(4096)])));
}

#[test]
fn areas_that_gape_on_their_common_border_are_told() {
    let scene = built();
    let job = fs::read_to_string(scene.path("east.toml")).unwrap().replace("\"fixed\"", "\"refined\"");
    fs::write(scene.path("free.toml"), job).unwrap();
    scene.run_to(0, &["build", "free.toml", "--out", "free.tdb", "--quiet"]);
    let said = scene.run_to(0, &["export", "west.tdb", "free.tdb", "--format", "3tz", "--out", "both.3tz"]).stderr;
    let (_, told) = said.split_once("west.tdb and free.tdb: along ").unwrap();
    assert!(told.contains(" of 2000 m of their common border the grounds lie more than 5 cm apart, "), "{said}");
}

#[test]
fn databases_that_cannot_be_one_tileset_are_refused() {
    let scene = built();
    let with = |words: &[&str], parts: &[&str]| scene.refuses(&[&["export", "west.tdb"], words].concat(), parts);
    let tiles = ["--format", "3dtiles", "--out", "new"];
    with(&["east.tdb", "--format", "glb", "--out", "a.glb"], &["several databases", "glb", "3dtiles or 3tz"]);
    with(&["east.tdb", "--format", "gazebo", "--out", "new"], &["several databases", "gazebo"]);
    with(&[&["east.tdb", "--modules", "0,0..1,1"], &tiles[..]].concat(), &["--modules", "several databases"]);
    with(&[&["east.tdb", "./west.tdb"], &tiles[..]].concat(), &["west.tdb and ./west.tdb", "the same database twice"]);
    let mut copy = std::process::Command::new("cp");
    assert!(copy.args(["-r", "west.tdb", "copy.tdb"]).current_dir(scene.path("")).status().unwrap().success());
    with(&[&["copy.tdb"], &tiles[..]].concat(), &["west.tdb and copy.tdb", "the same database twice"]);
    with(&[&["none.tdb"], &tiles[..]].concat(), &["none.tdb"]);
    with(&[&["east.tdb", "--lod", "1"], &tiles[..]].concat(), &["--lod", "level 1", "0, the only level"]);
}
