//! `docs/FORMAT.md` and the reader written from it alone agree with what the encoder writes.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::{Value, json};
use store::{Fingerprint, TileModules, encode_levels, encode_modules};
use terrain::{
    Decks, GridFrame, LineForm, LineKind, LineStorey, LineTraits, LoadModule, ModuleGrid, ModuleId, ModuleLine,
    ModuleRect, ModuleResidual, ModuleVertex, Side, Spacing, TileId,
};

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn vertex(x: u16, y: u16, z: i32) -> ModuleVertex {
    ModuleVertex { y, x, z }
}

/// A load module of two triangles, 1000 m above the datum in the south and 1002 m in the north-east.
fn flat(id: ModuleId) -> LoadModule {
    LoadModule {
        id,
        side: 64_000,
        vertices: vec![
            vertex(0, 0, 128_000),
            vertex(64_000, 0, 128_000),
            vertex(0, 64_000, 128_128),
            vertex(64_000, 64_000, 128_256),
        ],
        triangles: vec![[0, 1, 3], [0, 3, 2]],
        classes: vec![0, 1],
        polygon_count: 2,
        residual: ModuleResidual { posts: 441, largest: 300, sum_abs: 25_600, sum_squared: 3_276_800 },
        ..LoadModule::default()
    }
}

fn tile(rows: u32, cols: u32) -> TileModules {
    TileModules {
        tile: TileId { row: 0, col: 0 },
        grid: ModuleGrid { rows, cols, side_cells: 20 },
        modules: ModuleRect { south: 0, west: 0, north: rows, east: cols },
        frame: GridFrame {
            origin_east_m: 505_000.0,
            origin_north_m: 3_875_000.0,
            spacing: Spacing::from_metres(25.0).unwrap(),
        },
        crs: "EPSG:32611".into(),
        vertical_datum: "EGM96".into(),
        fingerprint: Fingerprint(std::array::from_fn(|i| i as u8)),
    }
}

fn example() -> Vec<u8> {
    encode_modules(&tile(1, 1), &[flat(ModuleId { row: 0, col: 0 })])
}

/// A level bridge of class 3 over the middle of a load module, 150 m long and 20 m wide at 1010 m.
fn bridge() -> Decks {
    let [a, b] = [vertex(22_400, 30_720, 129_280), vertex(41_600, 30_720, 129_280)];
    let [c, d] = [vertex(41_600, 33_280, 129_280), vertex(22_400, 33_280, 129_280)];
    Decks::of_triangles([([a, b, c], 3), ([a, c, d], 3)])
}

fn example_with_a_deck() -> Vec<u8> {
    let module = LoadModule { decks: bridge(), ..flat(ModuleId { row: 0, col: 0 }) };
    encode_modules(&tile(1, 1), &[module])
}

fn line(class: u8, form: LineForm, storey: LineStorey, width: u16, ends: [ModuleVertex; 2]) -> ModuleLine {
    let is_kept = form != LineForm::Nothing;
    let traits = LineTraits { kind: LineKind::Travelled, form, storey, is_kept, is_in_ground: false, width };
    traits.line(class, ends.to_vec())
}

/// The bridge with the line of its road, and a track that is left out.
fn with_lines(id: ModuleId) -> LoadModule {
    let road = [vertex(22_400, 32_000, 129_280), vertex(41_600, 32_000, 129_280)];
    let track = [vertex(0, 6400, 128_013), vertex(22_400, 6400, 128_026)];
    let lines = vec![
        line(3, LineForm::Strip, LineStorey::Bridge, 2560, road),
        line(4, LineForm::Nothing, LineStorey::Ground, 384, track),
    ];
    LoadModule { decks: bridge(), lines, ..flat(id) }
}

fn example_with_lines() -> Vec<u8> {
    encode_modules(&tile(1, 1), &[with_lines(ModuleId { row: 0, col: 0 })])
}

/// The bytes of the worked example of a version, on the page or beside it: lines of offset, bytes, bar, meaning.
fn bytes_of_docs(version: usize) -> Vec<u8> {
    let read = |name: &str| std::fs::read_to_string(workspace().join("docs").join(name)).unwrap();
    let text = read(["FORMAT.md", "format/deck.hex", "format/lines.hex"][version - 1]);
    let block = text.split("```hex\n").last().unwrap().split("```").next().unwrap();
    let mut bytes = Vec::new();
    for line in block.lines() {
        let mut words = line.split('|').next().unwrap().split_whitespace();
        assert_eq!(words.next().unwrap().parse::<usize>().unwrap(), bytes.len(), "offset of the line {line:?}");
        bytes.extend(words.map(|word| u8::from_str_radix(word, 16).unwrap()));
    }
    bytes
}

#[test]
fn the_worked_example_is_what_the_encoder_writes() {
    for (version, example) in [(1, example()), (2, example_with_a_deck()), (3, example_with_lines())] {
        let written = example.iter().fold(String::new(), |mut text, byte| {
            write!(text, "{byte:02x} ").unwrap();
            text
        });
        assert_eq!(bytes_of_docs(version), example, "the encoder writes {written}");
    }
}

/// Runs Python, or says that there is none.
fn python(arguments: &[&str]) -> Option<Output> {
    match Command::new("python3").arg("-B").args(arguments).current_dir(workspace()).output() {
        Ok(output) => Some(output),
        Err(error) => {
            eprintln!("skipped: python3 does not start: {error}");
            None
        }
    }
}

#[test]
fn the_python_reader_finds_what_was_written() {
    let tile = tile(2, 3);
    let modules: Vec<_> = tile.modules.iter().map(|id| if id.col == 1 { pyramid(id) } else { flat(id) }).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r00c00.slm");
    std::fs::write(&path, encode_modules(&tile, &modules)).unwrap();
    let Some(output) = python(&["scripts/read_slm.py", "--json", path.to_str().unwrap()]) else { return };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let dump: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(dump["header"], header_as_json(1));
    assert_eq!(dump["modules"], Value::Array(modules.iter().map(|module| as_json(module, 0)).collect()));
}

#[test]
fn the_python_reader_finds_every_level() {
    let tile = tile(2, 3);
    let fine: Vec<_> = tile.modules.iter().map(pyramid).collect();
    let coarse: Vec<_> = tile.modules.iter().map(flat).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r00c00.slm");
    let bytes = encode_levels(&tile, &[fine.clone(), coarse.clone()]);
    std::fs::write(&path, &bytes).unwrap();
    let Some(output) = python(&["scripts/read_slm.py", "--json", path.to_str().unwrap()]) else { return };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let dump: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(dump["header"], header_as_json(2));
    let fine = fine.iter().map(|module| as_json(module, 0));
    assert_eq!(dump["modules"], Value::Array(fine.chain(coarse.iter().map(|module| as_json(module, 1))).collect()));
    let Some(output) = python(&["scripts/read_slm.py", path.to_str().unwrap()]) else { return };
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("level 1        12 triangles, rms residual 0.673 m over 2646 posts"), "{said}");
}

#[test]
fn the_python_reader_finds_decks() {
    let tile = tile(2, 3);
    let over = |id: ModuleId| LoadModule { decks: bridge(), ..flat(id) };
    let modules: Vec<_> = tile.modules.iter().map(|id| if id.col == 1 { over(id) } else { flat(id) }).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r00c00.slm");
    std::fs::write(&path, encode_modules(&tile, &modules)).unwrap();
    let path = path.to_str().unwrap();
    let Some(output) = python(&["scripts/read_slm.py", "--json", path]) else { return };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let dump: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(dump["header"], json_of_header(2, 1));
    let expected = modules.iter().map(|module| {
        let mut told = as_json(module, 0);
        let places: Vec<_> = module.decks.vertices.iter().map(|v| json!([v.x, v.y, v.z])).collect();
        let Decks { triangles, classes, .. } = &module.decks;
        told["decks"] = json!({ "vertices": places, "triangles": triangles, "classes": classes });
        told
    });
    assert_eq!(dump["modules"], Value::Array(expected.collect()));
    check_said(&[path], "decks          4 triangles in 2 load modules");
    let at = |north: &'static str| ["--at", "505750", north, path];
    check_said(&at("3875750"), "ground         1001.000 m, class 0, ground\ntopmost        1010.000 m, class 3, deck");
    check_said(&at("3875775"), "topmost        1001.050 m, class 1, ground");
    check_said(&[&["--ceiling", "1009.9"], &at("3875750")[..]].concat(), "topmost        1001.000 m, class 0, ground");
    let high = python(&[&["scripts/read_slm.py", "--ceiling", "1000.9"], &at("3875750")[..]].concat()).unwrap();
    assert!(high.status.code() == Some(1) && String::from_utf8_lossy(&high.stdout).contains("topmost        none"));
}

#[test]
fn the_python_reader_finds_lines() {
    let tile = tile(2, 3);
    let modules: Vec<_> = tile.modules.iter().map(|id| if id.col == 1 { with_lines(id) } else { flat(id) }).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r00c00.slm");
    std::fs::write(&path, encode_modules(&tile, &modules)).unwrap();
    let path = path.to_str().unwrap();
    let Some(output) = python(&["scripts/read_slm.py", "--json", path]) else { return };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let dump: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(dump["header"], json_of_header(3, 1));
    let road = json!({
        "class": 3, "kind": "travelled", "form": "strip", "storey": "bridge", "kept": true, "in_ground": false,
        "width": 2560, "vertices": [[22_400, 32_000, 129_280], [41_600, 32_000, 129_280]],
    });
    let track = json!({
        "class": 4, "kind": "travelled", "form": "nothing", "storey": "ground", "kept": false, "in_ground": false,
        "width": 384, "vertices": [[0, 6400, 128_013], [22_400, 6400, 128_026]],
    });
    assert_eq!(dump["modules"][1]["lines"], json!([road, track]));
    assert_eq!((&dump["modules"][0]["lines"], &dump["modules"][1]["unknown_parts"]), (&json!([]), &json!([])));
    assert_eq!(dump["modules"][1]["decks"]["classes"], json!([3, 3]));
    check_said(&[path], "lines          4, 0.65 km, of which 0.30 km are kept");
    check_said(&["--at", "505750", "3875750", path], "topmost        1010.000 m, class 3, deck");
}

#[track_caller]
fn check_said(arguments: &[&str], expected: &str) {
    let output = python(&[&["scripts/read_slm.py"], arguments].concat()).unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains(expected), "{said}{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_python_reader_refuses_every_damage() {
    check_python_refuses_every_damage(&example());
    check_python_refuses_every_damage(&example_with_a_deck());
    check_python_refuses_every_damage(&example_with_lines());
}

#[track_caller]
fn check_python_refuses_every_damage(good: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r00c00.slm");
    std::fs::write(&path, good).unwrap();
    let program = "import sys; sys.path.insert(0, 'scripts'); import read_slm\n\
        good = open(sys.argv[1], 'rb').read(); read_slm.parse(good)\n\
        bad = [good[:n] for n in range(len(good))] + [good + b'\\0']\n\
        bad += [good[:i] + bytes([good[i] ^ 1 << b]) + good[i + 1:] for i in range(len(good)) for b in range(8)]\n\
        for data in bad:\n\
        \x20   try: read_slm.parse(data)\n\
        \x20   except read_slm.Damaged: continue\n\
        \x20   sys.exit('accepted damage')\n";
    let Some(output) = python(&["-c", program, path.to_str().unwrap()]) else { return };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_python_reader_says_what_is_damaged_and_fails() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r00c00.slm");
    let mut bytes = example();
    bytes[200] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    let Some(output) = python(&["scripts/read_slm.py", path.to_str().unwrap()]) else { return };
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("r00c00.slm: load module 0,0") && said.contains("checksum"), "{said}");
}

fn pyramid(id: ModuleId) -> LoadModule {
    let mut module = flat(id);
    module.vertices.insert(2, vertex(32_000, 25_600, -128));
    module.triangles = vec![[0, 1, 2], [0, 2, 3], [1, 4, 2], [2, 4, 3]];
    module.classes = vec![1, 0, 255, 1];
    module.polygon_count = 3;
    module.residual.sum_squared = u64::MAX;
    module
}

fn header_as_json(levels: u32) -> Value {
    json_of_header(1, levels)
}

fn json_of_header(version: u32, levels: u32) -> Value {
    json!({
        "version": version,
        "levels": levels,
        "tile": [0, 0], "area_modules": [2, 3], "rows": [0, 2], "columns": [0, 3],
        "side": 64000, "side_cells": 20, "spacing_m": 25.0, "origin_m": [505000.0, 3875000.0],
        "crs": "EPSG:32611", "vertical_datum": "EGM96",
        "fingerprint": "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f",
    })
}

fn as_json(module: &LoadModule, level: u32) -> Value {
    let [south, east, north, west] = Side::ALL.map(|side| module.side_vertices(side));
    let residual = &module.residual;
    json!({
        "row": module.id.row,
        "column": module.id.col,
        "level": level,
        "polygons": module.polygon_count,
        "residual": {
            "posts": residual.posts, "largest": residual.largest,
            "sum_abs": residual.sum_abs, "sum_squared": residual.sum_squared,
        },
        "vertices": module.vertices.iter().map(|v| json!([v.x, v.y, v.z])).collect::<Vec<_>>(),
        "triangles": module.triangles,
        "sides": { "south": south, "east": east, "north": north, "west": west },
        "classes": module.classes,
    })
}
