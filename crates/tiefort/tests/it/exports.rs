//! `export`: every format is written, placed, and refused where it cannot be.

use std::fs;

use serde_json::Value;

use crate::scene::{Scene, everything_below};

/// A finished database `a.tdb` of 8 x 8 load modules in 2 x 2 tiles.
fn built() -> Scene {
    let scene = Scene::with_job("small.toml", &[]);
    scene.run_to(0, &["build", "job.toml", "--out", "a.tdb", "--quiet"]);
    scene
}

/// Formats whose heights are above the ellipsoid.
const FOR_GLOBES: [&str; 5] = ["3dtiles", "quantized-mesh", "3dtiles-terrain", "3tz", "mbtiles"];

#[test]
fn every_format_is_written_and_the_same_every_time() {
    let scene = built();
    let all = [
        ("modules", "modules"),
        ("ply", "mesh.ply"),
        ("obj", "mesh.obj"),
        ("glb", "mesh.glb"),
        ("geotiff", "a.tif"),
        ("gpkg", "a.gpkg"),
        ("openflight", "flt"),
        ("3dtiles", "tiles"),
        ("quantized-mesh", "terrain"),
        ("3dtiles-terrain", "implicit"),
        ("3tz", "tiles.3tz"),
        ("mbtiles", "terrain.mbtiles"),
        ("terrain-rgb", "map.mbtiles"),
        ("terrain-rgb", "map.pmtiles"),
        ("usd", "usd"),
        ("heightmap", "heightmap"),
        ("gazebo", "gazebo"),
    ];
    for (format, name) in all {
        for folder in ["one", "two"] {
            fs::create_dir_all(scene.path(folder)).unwrap();
            let (out, workers) = (format!("{folder}/{name}"), if folder == "one" { "1" } else { "2" });
            let mut arguments = vec!["export", "a.tdb", "--format", format, "--out", &out, "--workers", workers];
            if FOR_GLOBES.contains(&format) {
                arguments.extend(["--assume-datum", "EGM96"]);
            }
            let said = scene.run_to(0, &arguments);
            assert!(said.stdout.is_empty() && said.stderr.contains("64 load modules"), "{format}: {}", said.stderr);
        }
    }
    let (one, two) = (everything_below(&scene.path("one")), everything_below(&scene.path("two")));
    assert_eq!(one.len(), two.len());
    for ((path, bytes), (_, others)) in one.iter().zip(&two) {
        assert!(bytes == others, "{} differs from run to run", path.display());
    }
    assert_eq!(fs::read_dir(scene.path("one/modules")).unwrap().count(), 64);
    // One square of 4 km, its load modules in groups of at most 2,048 triangles.
    let groups = fs::read_dir(scene.path("one/tiles/groups")).unwrap().count();
    assert!((1..=8).contains(&groups), "{groups} groups");
}

#[test]
fn a_block_is_what_was_asked_for_and_says_where_it_lies() {
    let scene = built();
    let block = ["export", "a.tdb", "--format", "glb", "--modules", "2,3..3,5", "--out", "b.glb", "--quiet"];
    assert!(scene.run_to(0, &block).stderr.is_empty());
    let sidecar: Value = serde_json::from_slice(&fs::read(scene.path("b.glb.json")).unwrap()).unwrap();
    assert_eq!(sidecar["offset_m"][0], 506_500.0);
    assert_eq!(sidecar["bounds_m"]["north"], 3_877_000.0);
    assert_eq!(sidecar["load_modules"]["north_east"], serde_json::json!([3, 5]));
    scene.run_to(0, &["export", "a.tdb", "--format", "modules", "--modules", "7,0", "--out", "one"]);
    assert!(scene.path("one/r0007c0000.slm").exists());
}

#[test]
fn residuals_at_every_post_add_up_to_those_of_the_report() {
    let scene = built();
    let words = ["--format", "geotiff", "--layer", "residual", "--out", "residual.tif", "--quiet"];
    scene.run_to(0, &[&["export", "a.tdb"], &words[..]].concat());
    let file = fs::File::open(scene.path("residual.tif")).unwrap();
    let mut decoder = tiff::decoder::Decoder::new(file).unwrap();
    assert!(!decoder.more_images(), "one block needs no overviews");
    let image = decoder.read_image().unwrap();
    let tiff::decoder::DecodingResult::F32(residuals) = image else { panic!("residuals are floats") };
    assert_eq!(residuals.len(), 161 * 161);
    let squares: f64 = residuals.iter().map(|&residual| f64::from(residual).powi(2)).sum();
    let report: Value = serde_json::from_slice(&fs::read(scene.path("a.tdb/report.json")).unwrap()).unwrap();
    let rms_m = report["residual"]["rms_m"].as_f64().unwrap();
    assert!(((squares / residuals.len() as f64).sqrt() - rms_m).abs() < 1e-9);
    let largest = residuals.iter().fold(0.0_f32, |largest, residual| largest.max(residual.abs()));
    assert_eq!(f64::from(largest), report["residual"]["max_m"].as_f64().unwrap());
}

/// The same database with a hole of 50 x 50 posts.
fn built_with_a_hole() -> Scene {
    let changes = [
        (
            "source = \"sample\"\nseed = 1",
            "sources = [{ file = \"holed.asc\", crs = \"EPSG:32611\" }]\nvoids = { hole = true }",
        ),
        ("areas = [{ sample = \"mountains\", class = \"mountains\", weight = 1 }]\n", ""),
    ];
    let scene = Scene::with_job("small.toml", &changes);
    let is_hole = |row: i32, col: i32| (50..100).contains(&row) && (60..110).contains(&col);
    let height = |row: i32, col: i32| 700 + (row * row / 40 + row * col / 30 + 7 * (col % 9)) % 97;
    let value = |row, col| if is_hole(row, col) { -9999 } else { height(row, col) };
    let line = |row| (0..161).map(|col| value(row, col).to_string()).collect::<Vec<_>>().join(" ");
    let lines: Vec<String> = (0..161).map(line).collect();
    let head = "ncols 161\nnrows 161\nxllcenter 505000\nyllcenter 3875000\ncellsize 25\nNODATA_value -9999\n";
    fs::write(scene.path("holed.asc"), format!("{head}{}\n", lines.join("\n"))).unwrap();
    scene.run_to(0, &["build", "job.toml", "--out", "a.tdb", "--quiet"]);
    scene
}

#[test]
fn every_format_leaves_holes_out_or_marks_them_and_says_so() {
    let scene = built_with_a_hole();
    let json = |name: &str| -> Value { serde_json::from_slice(&fs::read(scene.path(name)).unwrap()).unwrap() };
    let left_out = "triangles over holes are left out\n";
    for (format, name, said) in [
        ("modules", "modules", "triangles over holes are of class 255"),
        ("ply", "mesh.ply", left_out),
        ("obj", "mesh.obj", left_out),
        ("glb", "mesh.glb", left_out),
        ("geotiff", "a.tif", "triangles over holes are NaN in the raster"),
        ("gpkg", "a.gpkg", "triangles over holes are in the layer triangles, of class hole"),
        ("openflight", "flt", left_out),
        ("3dtiles", "tiles", left_out),
        ("quantized-mesh", "terrain", "holes.geojson says where they are"),
        ("3dtiles-terrain", "implicit", "holes.geojson says where they are"),
        ("terrain-rgb", "map.pmtiles", "triangles over holes are 0 m high, as places outside of the area"),
        ("3tz", "tiles.3tz", left_out),
        ("mbtiles", "terrain.mbtiles", "the entry holes of metadata says where they are"),
        ("usd", "usd", left_out),
        ("heightmap", "heightmap", "heightmap.json counts the samples"),
        ("gazebo", "gazebo", left_out),
    ] {
        let mut arguments = vec!["export", "a.tdb", "--format", format, "--out", name];
        if FOR_GLOBES.contains(&format) {
            arguments.extend(["--assume-datum", "EGM96"]);
        }
        let found = scene.run_to(0, &arguments).stderr;
        assert!(found.contains(said), "{format}: {found}");
    }
    let triangles = json("a.tdb/report.json")["triangles"].as_u64().unwrap();
    let holes =
        json("terrain/holes.geojson")["features"][0]["geometry"]["coordinates"].as_array().unwrap().len() as u64;
    for name in ["mesh.ply.json", "mesh.obj.json", "mesh.glb.json"] {
        let sidecar = json(name);
        assert_eq!(sidecar["hole_triangles_left_out"], holes, "{name}");
        assert_eq!(sidecar["triangles"], triangles - holes, "{name}");
    }
    let mut decoder = tiff::decoder::Decoder::new(fs::File::open(scene.path("a.tif")).unwrap()).unwrap();
    let tiff::decoder::DecodingResult::F32(heights) = decoder.read_image().unwrap() else { panic!("floats") };
    let empty = heights.iter().filter(|height| height.is_nan()).count();
    // Triangles follow the edge of the hole as well as their number allows.
    assert!((2200..2800).contains(&empty), "{empty} posts without a height");
    assert!(heights[75 * 161 + 85].is_nan() && heights[20 * 161 + 20].is_finite());
}

#[test]
fn what_cannot_be_exported_is_refused() {
    let scene = built();
    let refuses =
        |words: &[&str], parts: &[&str]| scene.refuses(&[&["export", "a.tdb", "--format"], words].concat(), parts);
    refuses(&["ply", "--out", "mesh.obj"], &["mesh.obj", "\"obj\"", "\"ply\""]);
    refuses(&["ply", "--modules", "0,0..8,0", "--out", "mesh.ply"], &["0,0..8,0", "from 0,0 to 7,7"]);
    refuses(&["ply", "--modules", "3,0..2,0", "--out", "mesh.ply"], &["3,0..2,0"]);
    refuses(&["ply", "--lod", "1", "--out", "mesh.ply"], &["--lod", "level 1", "0, the only level"]);
    refuses(&["glb", "--coordinates", "map", "--out", "mesh.glb"], &["--coordinates map"]);
    refuses(&["glb", "--layer", "residual", "--out", "mesh.glb"], &["--layer"]);
    refuses(&["geotiff", "--against", "a.tif", "--out", "b.tif"], &["--against"]);
    refuses(&["gpkg", "--assume-datum", "EGM96", "--out", "b.gpkg"], &["--assume-datum"]);
    refuses(&["modules", "--out", "a.tdb"], &["a.tdb", "expected a name that is free"]);
    refuses(&["heightmap", "--size", "1000", "--out", "new"], &["1000 samples", "505, 1009, 2017"]);
    refuses(&["heightmap", "--engine", "unity", "--size", "505", "--out", "new"], &["505 samples", "513"]);
    refuses(&["usd", "--engine", "unity", "--out", "new"], &["--engine"]);
    refuses(&["usd", "--size", "256", "--out", "new"], &["--size", "expected one of terrain-rgb, heightmap"]);
    refuses(&["terrain-rgb", "--size", "505", "--out", "new.pmtiles"], &["505 pixels", "256 or 512"]);
    refuses(&["terrain-rgb", "--out", "new.png"], &["\"png\"", "\"mbtiles\" or \"pmtiles\""]);
    refuses(&["mbtiles", "--encoding", "terrarium", "--out", "new.mbtiles"], &["--encoding"]);
    fs::write(scene.path("text.tif"), "text").unwrap();
    refuses(&["glb", "--imagery", "text.tif", "--out", "new.glb"], &["a text file, not a raster"]);
    let rgb = ["glb", "--imagery", "text.tif", "--texture", "rgb", "--out", "new.glb"];
    refuses(&rgb, &["--texture rgb", "openflight"]);
    refuses(&["glb", "--material", "prim=a", "--out", "new.glb"], &["\"prim\"", "building_wall"]);
    refuses(&["3tz", "--out", "tiles.zip"], &["\"zip\"", "\"3tz\""]);
    for (format, name) in [("3dtiles", "new"), ("quantized-mesh", "new"), ("3tz", "a.3tz"), ("mbtiles", "a.mbtiles")] {
        refuses(&[format, "--out", name], &["unknown datum", "EGM96"]);
    }
    scene.refuses(&["export", "none.tdb", "--format", "ply", "--out", "mesh.ply"], &["none.tdb"]);
    let said = scene.run_to(2, &["export", "a.tdb", "--format", "3dtiles", "--assume-datum", "sea", "--out", "new"]);
    assert!(said.stderr.contains("expected EGM96"), "{}", said.stderr);
}

#[test]
fn materials_are_called_as_the_job_says_without_building_again() {
    let scene = built();
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    let codes = "name = \"gravel\", surface_code = 77, feature_id = 12";
    let named = format!("\n[exports.materials]\ndefault = {{ {codes} }}\nmountains = {{ {codes} }}\n");
    fs::write(scene.path("job.toml"), job + &named).unwrap();
    let before = everything_below(&scene.path("a.tdb/modules"));
    let said = scene.run_to(0, &["build", "job.toml", "--out", "a.tdb"]).stderr;
    assert!(before == everything_below(&scene.path("a.tdb/modules")), "{said}");
    let square = |more: &[&str], out: &str| {
        scene.run_to(0, &[&["export", "a.tdb", "--format", "openflight", "--out", out], more].concat());
        fs::read(scene.path(out).join("squares/r00c00.flt")).unwrap()
    };
    let has = |bytes: &[u8], part: &[u8]| bytes.windows(part.len()).any(|window| window == part);
    let (job_says, said) =
        (square(&[], "one"), square(&["--material", "default=sand", "--material", "mountains=sand"], "two"));
    assert!(has(&job_says, b"gravel\0") && has(&said, b"sand\0") && !has(&said, b"gravel"));
    // Both codes of a face, which the argument leaves as they are.
    [job_says, said].iter().for_each(|bytes| assert!(has(bytes, &[0, 77, 0, 12])));
}

#[test]
fn every_format_takes_any_level_that_the_database_has() {
    let scene = Scene::with_job("small.toml", &[]);
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    let lod = "\n[lod]\nlevels = [{ inner_share = 0.5 }, { inner_share = 0.2 }]\n";
    fs::write(scene.path("job.toml"), job + lod).unwrap();
    scene.run_to(0, &["build", "job.toml", "--out", "a.tdb", "--quiet"]);
    scene.run_to(0, &["verify", "a.tdb"]);
    let report: Value = serde_json::from_slice(&fs::read(scene.path("a.tdb/report.json")).unwrap()).unwrap();
    let triangles = |level: usize| report["levels"][level]["triangles"].as_u64().unwrap();
    assert!(triangles(2) < triangles(1) && triangles(1) < triangles(0));
    for level in [0, 1, 2] {
        let (lod, out) = (level.to_string(), format!("{level}.glb"));
        scene.run_to(0, &["export", "a.tdb", "--format", "glb", "--lod", &lod, "--out", &out, "--quiet"]);
        let sidecar: Value = serde_json::from_slice(&fs::read(scene.path(&format!("{out}.json"))).unwrap()).unwrap();
        assert_eq!(
            (sidecar["level"].as_u64(), sidecar["triangles"].as_u64()),
            (Some(level), Some(triangles(level as usize)))
        );
    }
    let names = ["m1", "mesh.ply", "mesh.obj", "a.tif", "a.gpkg", "flt", "terrain", "t1", "usd", "gazebo", "map"];
    let formats = ["modules", "ply", "obj", "geotiff", "gpkg", "openflight", "quantized-mesh", "3dtiles"];
    let formats = formats.into_iter().chain(["usd", "gazebo", "heightmap"]);
    for (format, name) in formats.zip(names) {
        let mut arguments = vec!["export", "a.tdb", "--format", format, "--lod", "1", "--out", name];
        if ["3dtiles", "quantized-mesh"].contains(&format) {
            arguments.extend(["--assume-datum", "EGM96"]);
        }
        let said = scene.run_to(0, &arguments).stderr;
        assert!(said.contains(" triangles at level 1"), "{format}: {said}");
        let missing = [&arguments[..5], &["3", "--out", "none.ply"]].concat();
        if format == "ply" {
            scene.refuses(&missing, &["--lod", "level 3", "0 to 2: the database has 3 levels"]);
        }
    }
    let said = scene.run_to(0, &["export", "a.tdb", "--format", "modules", "--out", "all"]).stderr;
    assert!(said.contains("at level 0") && said.contains("up to 2"), "{said}");
    let alone = |folder: &str| fs::read(scene.path(folder).join("r0003c0004.slm")).unwrap();
    assert_eq!((alone("all")[10], alone("m1")[10]), (3, 1));
    let words = ["--format", "3dtiles", "--assume-datum", "EGM96", "--out", "tiles"];
    scene.run_to(0, &[&["export", "a.tdb"], &words[..]].concat());
    let tileset: Value = serde_json::from_slice(&fs::read(scene.path("tiles/tileset.json")).unwrap()).unwrap();
    let mut tile = &tileset["root"];
    let mut names = Vec::new();
    while let Some(child) = tile["children"].get(0) {
        assert!(child["geometricError"].as_f64() <= tile["geometricError"].as_f64());
        names.push(child["content"]["uri"].as_str().unwrap().split("/r").next().unwrap().to_owned());
        tile = child;
    }
    assert_eq!(names, ["squares", "levels/2", "levels/1", "groups"]);
}
