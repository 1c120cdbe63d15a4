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
fn a_raster_without_a_coordinate_system_is_meshed_and_compared_in_a_plane_of_metres() {
    let scene = Scene::new();
    Raster::sound().write(&scene.path("dem.tif"));
    Raster::sound().without_crs().write(&scene.path("bare.tif"));
    let mesh = |raster: &str, more: &[&str], told: &str| {
        let arguments = ["tin", raster, "--points", "200", "--out", "mesh.ply"];
        let said = scene.run_to(0, &[&arguments[..], more].concat());
        assert_eq!(said.stderr.contains("no coordinate system"), !told.is_empty(), "{}", said.stderr);
        assert!(said.stderr.contains(told), "{}", said.stderr);
        fs::read(scene.path("mesh.ply")).unwrap()
    };
    let known = mesh("dem.tif", &[], "");
    let plane = mesh("bare.tif", &[], "bare.tif: no coordinate system: its posts are taken as metres in a plane");
    let given = mesh("bare.tif", &["--crs", "EPSG:32611"], "");
    // All but the header, which names the system and the place: without keys, posts are centres of pixels.
    let body = |mesh: &[u8]| {
        let end = b"end_header\n";
        mesh.windows(end.len()).position(|bytes| bytes == end).map(|at| mesh[at..].to_vec()).unwrap()
    };
    assert!(body(&given) == body(&known) && body(&plane) == body(&known));
    scene.refuses(&["tin", "bare.tif", "--points", "9", "--crs", "EPSG:1", "--out", "a.ply"], &["--crs", "EPSG:1"]);
    let compared = |raster: &str, more: &[&str]| {
        let arguments = ["compare", raster, "--methods", "lattice,optimised", "--points", "300", "--format", "json"];
        let told = scene.run_to(0, &[&arguments[..], more].concat()).stdout;
        let mut told: Value = serde_json::from_str(&told).unwrap();
        told["rows"].as_array_mut().unwrap().iter_mut().for_each(|row| {
            row.as_object_mut().unwrap().remove("seconds");
        });
        told["rows"].clone()
    };
    assert_eq!(compared("bare.tif", &[]), compared("dem.tif", &[]));
    assert_eq!(compared("bare.tif", &["--crs", "EPSG:32611"]), compared("dem.tif", &[]));
}

#[test]
fn a_grid_without_a_coordinate_system_whose_posts_are_not_square_is_resampled_in_its_plane() {
    let scene = Scene::new();
    let rows: Vec<String> =
        (0..41).map(|row| (0..31).map(|col| format!("{} ", row * col % 17)).collect::<String>()).collect();
    let header = "ncols 31\nnrows 41\nxllcorner 1000\nyllcorner 2000\ndx 30\ndy 20\n";
    fs::write(scene.path("a.asc"), format!("{header}{}\n", rows.join("\n"))).unwrap();
    let said = scene.run_to(0, &["tin", "a.asc", "--points", "60", "--out", "mesh.ply"]);
    assert!(said.stderr.contains("in no coordinate system"), "{}", said.stderr);
}

#[test]
fn a_raster_that_might_be_in_degrees_is_not_taken_as_metres() {
    let scene = Scene::new();
    Raster::sound().geographic().without_crs().write(&scene.path("bare.tif"));
    for command in [&["tin", "bare.tif", "--points", "60", "--out", "a.ply"][..], &["compare", "bare.tif"]] {
        let said = scene.run_to(2, command);
        assert!(said.stderr.contains("hint: say what it is: --crs EPSG:"), "{}", said.stderr);
        assert!(!said.stderr.contains("dem.sources"), "{}", said.stderr);
    }
    scene.run_to(0, &["tin", "bare.tif", "--crs", "EPSG:4326", "--points", "60", "--out", "a.ply"]);
}

#[test]
fn the_first_end_that_is_reached_ends_an_optimised_mesh() {
    let scene = Scene::new();
    Raster::sound().write(&scene.path("dem.tif"));
    let triangles = |ends: &[&str]| {
        let arguments = [&["tin", "dem.tif", "--json", "--out", "mesh.ply"], ends].concat();
        let told = scene.run_to(0, &arguments).stdout;
        let summary: Value = serde_json::from_str(told.lines().last().unwrap()).unwrap();
        (summary["triangles"].as_u64().unwrap(), summary["residual"]["max_m"].as_f64().unwrap())
    };
    for ends in [["--points", "1500"], ["--triangles", "3000"]] {
        let (all, _) = triangles(&ends);
        let (few, largest_m) = triangles(&[&ends[..], &["--max-residual", "6"]].concat());
        assert!(2 * few < all && largest_m <= 6.0, "{ends:?}: {few} triangles of {all}, {largest_m} m are left");
    }
}

/// The vertices and the triangles of an OBJ, each by their places, whatever their order.
fn obj(text: &str) -> (std::collections::BTreeSet<String>, std::collections::BTreeSet<Vec<String>>) {
    let places: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("v ")).collect();
    let corner = |word: &str| places[word.split('/').next().unwrap().parse::<usize>().unwrap() - 1].to_owned();
    let faces = text.lines().filter_map(|line| line.strip_prefix("f "));
    let triangle = |line: &str| {
        let mut corners: Vec<String> = line.split_whitespace().map(corner).collect();
        let first = (0..3).min_by_key(|&i| corners[i].clone()).unwrap();
        corners.rotate_left(first);
        corners
    };
    (places.iter().map(|&place| place.to_owned()).collect(), faces.map(triangle).collect())
}

#[test]
fn a_level_is_the_mesh_of_so_many_points_and_holds_the_coarser_ones() {
    let scene = Scene::new();
    Raster::sound().write(&scene.path("dem.tif"));
    let read = |name: &str| fs::read_to_string(scene.path(name)).unwrap();
    for method in ["paper", "greedy", "optimised"] {
        let words = ["tin", "dem.tif", "--levels", "30,100,200", "--method", method, "--out", "mesh.obj"];
        let said = scene.run_to(0, &words).stderr;
        assert!(said.contains("3 levels") && said.contains("mesh-200.obj"), "{said}");
        for points in ["30", "100", "200"] {
            let alone = ["tin", "dem.tif", "--points", points, "--method", method, "--out", "alone.obj", "--quiet"];
            scene.run_to(0, &alone);
            assert_eq!(obj(&read(&format!("mesh-{points}.obj"))), obj(&read("alone.obj")), "{method} {points}");
        }
        let [few, many] = ["30", "200"].map(|points| obj(&read(&format!("mesh-{points}.obj"))).0);
        assert_eq!(few.is_subset(&many), method != "optimised", "{method}");
    }
    assert!(!scene.path("mesh.obj").exists());
    let said = scene.run_to(0, &["tin", "dem.tif", "--levels", "30,60", "--json", "--out", "mesh.ply"]).stdout;
    let summary: Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    assert_eq!((&summary["points"], &summary["levels"][0]["points"]), (&Value::from(60), &Value::from(30)));
    assert!(summary["levels"][0]["file"].as_str().unwrap().ends_with("mesh-30.ply"));
}

#[test]
fn levels_that_cannot_be_are_refused() {
    let scene = Scene::new();
    Raster::sound().write(&scene.path("dem.tif"));
    let refuses = |words: &[&str], parts: &[&str]| {
        scene.refuses(&[&["tin", "dem.tif", "--out", "mesh.ply", "--levels"], words].concat(), parts);
    };
    refuses(&["200,100"], &["--levels", "200,100", "each above the one before"]);
    refuses(&["100,100"], &["--levels", "each above the one before"]);
    refuses(&["100,200", "--tiles", "2x2"], &["2x2 tiles", "one tile"]);
    refuses(&["20,200", "--method", "greedy", "--start", "regular:64"], &["--levels", "20", "at least the"]);
    for words in [&["100", "--points", "200"][..], &["3,100"], &["100", "--rms", "1"], &["many"]] {
        scene.run_to(2, &[&["tin", "dem.tif", "--out", "mesh.ply", "--levels"], words].concat());
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
fn fewer_triangles_than_tiles_begin_with_are_refused() {
    let scene = Scene::new();
    Raster::sound().write(&scene.path("dem.tif"));
    let few = ["tin", "dem.tif", "--triangles", "17", "--tiles", "3x3", "--out", "mesh.ply"];
    scene.refuses(&few, &["--triangles: 17", "at least 18, two in each tile"]);
    scene.run_to(0, &["tin", "dem.tif", "--triangles", "18", "--tiles", "3x3", "--out", "mesh.ply", "--quiet"]);
}

#[test]
fn a_mesh_of_a_bad_raster_is_refused() {
    let scene = Scene::new();
    fs::write(scene.path("dem.tif"), "no raster").unwrap();
    scene.refuses(&["tin", "dem.tif", "--points", "9", "--out", "mesh.ply"], &["dem.tif", "a text file, not a raster"]);
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
fn a_mesh_with_holes_where_the_raster_has_voids_is_measured_too() {
    let scene = Scene::new();
    let half = |east: f64, north: f64| if east < 506_000.0 { f64::NAN } else { 700.0 + (east + north) / 100.0 };
    Raster::around(half).write(&scene.path("dem.tif"));
    let said = scene.run_to(0, &["tin", "dem.tif", "--points", "60", "--measure", "--out", "mesh.ply"]);
    assert!(said.stderr.contains("Line of sight"), "{}", said.stderr);
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

#[test]
fn a_raster_in_degrees_is_resampled_as_init_would_and_a_line_says_to_what() {
    let scene = Scene::new();
    Raster::sound().geographic().write(&scene.path("dem.tif"));
    let arguments = ["tin", "dem.tif", "--points", "200", "--coordinates", "map", "--out", "mesh.obj"];
    let said = scene.run_to(0, &arguments).stderr;
    let told = "note: dem.tif: resampled from posts 0.9 x 0.9 seconds apart to ";
    assert!(said.contains(told) && said.contains(" posts 25 m apart in EPSG:32611"), "{said}");
    let mesh = fs::read_to_string(scene.path("mesh.obj")).unwrap();
    let places: Vec<Vec<f64>> = mesh
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|place| place.split(' ').map(|number| number.parse().unwrap()).collect())
        .collect();
    // The raster covers 116.9 to 116.88 W and 35.08 to 35.1 N: about 1.82 km by 2.22 km.
    let range = |axis: usize| {
        let all = places.iter().map(|place| place[axis]);
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)))
    };
    let (west, east) = range(0);
    let (south, north) = range(1);
    assert!((509_100.0..509_200.0).contains(&west) && (1750.0..1850.0).contains(&(east - west)), "{west} {east}");
    assert!((3_881_900.0..3_882_100.0).contains(&south) && (2150.0..2250.0).contains(&(north - south)));
    let report = scene.run_to(0, &["compare", "dem.tif", "--points", "100"]).stdout;
    assert!(report.contains("resampled to 25 m in EPSG:32611"), "{report}");
}

#[test]
fn a_raster_whose_posts_are_oblong_is_resampled_to_square_ones() {
    let scene = Scene::new();
    let row = |row: usize| (0..81).map(|col| format!("{} ", 700 + (row * row + 3 * col) % 97)).collect::<String>();
    let rows: Vec<String> = (0..81).map(row).collect();
    let head = "ncols 81\nnrows 81\nxllcenter 506000\nyllcenter 3876000\ndx 20\ndy 30\n";
    fs::write(scene.path("dem.asc"), format!("{head}{}\n", rows.join("\n"))).unwrap();
    fs::write(scene.path("dem.prj"), r#"PROJCS["x",AUTHORITY["EPSG","32611"]]"#).unwrap();
    let said = scene.run_to(0, &["tin", "dem.asc", "--points", "200", "--out", "mesh.ply"]).stderr;
    let told = "dem.asc: resampled from posts 20 x 30 m apart to 65 x 97 posts 25 m apart in EPSG:32611";
    assert!(said.contains(told), "{said}");
}
