//! `compare`, `inadequate`, `diff`, and jobs with points of their own.

use std::fs;

use serde_json::Value;

use crate::raster::Raster;
use crate::scene::Scene;

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// A folder with the sample terrain as a raster.
fn with_dem() -> Scene {
    let scene = Scene::new();
    scene.run_to(0, &["sample", "--posts", "101", "--out", "dem.tif"]);
    scene
}

#[test]
fn methods_are_compared_in_words_and_for_programs() {
    let scene = with_dem();
    let said = scene.run_to(0, &["compare", "dem.tif", "--points", "450,700"]);
    for part in
        ["101 rows, 101 columns", "10,201 posts, 25 m apart", "equivalent", "400 of its 450 points are the border"]
    {
        assert!(said.stdout.contains(part), "{part:?} is not in: {}", said.stdout);
    }
    assert!(said.stderr.contains("20 of 20"), "{}", said.stderr);
    let named =
        ["compare", "dem.tif", "--methods", "iterative,lattice", "--points", "300", "--format", "json", "--quiet"];
    let said = scene.run_to(0, &named);
    assert_eq!(said.stderr, "");
    let found = json(&said.stdout);
    assert_eq!((&found["posts"], &found["rows"][1]["method"]), (&Value::from(10_201), &Value::from("lattice")));
    assert!(0 < found["rows"][1]["equivalent_points"].as_u64().unwrap());
    assert!(found["rows"][0]["equivalent_points"].is_null());
}

#[test]
fn every_tin_of_a_comparison_is_drawn_twice() {
    let scene = with_dem();
    let drawn =
        ["compare", "dem.tif", "--methods", "lattice,highlow", "--points", "300", "--quiet", "--pictures", "figures"];
    scene.run_to(0, &drawn);
    let names = fs::read_dir(scene.path("figures")).unwrap().map(|entry| entry.unwrap().path());
    let names: Vec<_> = names.inspect(|path| assert!(fs::read(path).unwrap().starts_with(b"\x89PNG"))).collect();
    assert_eq!(names.len(), 4, "{names:?}");
    scene.refuses(&drawn, &["figures"]);
}

#[test]
fn what_cannot_be_compared_is_told_with_what_is_possible() {
    let scene = with_dem();
    let refuses = |arguments: &[&str], parts: &[&str]| {
        let all: Vec<&str> = ["compare", "dem.tif", "--quiet"].iter().chain(arguments).copied().collect();
        scene.refuses(&all, parts);
    };
    refuses(&["--methods", "vip", "--points", "100"], &["vip", "100 points", "400 to 10201 points"]);
    refuses(&["--points", "20000"], &["20000 points", "4 to 10201"]);
    refuses(&["--window", "50,50,60x10"], &["--window", "101 rows and 101 columns"]);
    assert!(scene.run_to(2, &["compare", "dem.tif", "--methods", "vpi"]).stderr.contains("fowler-little"));
    assert!(scene.run_to(2, &["compare", "dem.tif", "--points", "3"]).stderr.contains("4.."));
    assert!(scene.run_to(2, &["compare", "dem.tif", "--window", "1,2"]).stderr.contains("ROW,COL,ROWSxCOLUMNS"));
    scene.refuses(&["compare", "none.tif"], &["none.tif"]);
}

#[test]
fn a_job_is_compared_on_the_posts_of_its_raster() {
    let scene = Scene::with_job("raster.toml", &[]);
    Raster::sound().write(&scene.path("dem.tif"));
    let arguments = ["compare", "job.toml", "--methods", "regular", "--points", "100", "--quiet"];
    assert!(scene.run_to(0, &arguments).stdout.contains("posts of dem.tif in the area of"));
}

/// A pin as a feature.
fn pin(said: &str, east_m: f64, north_m: f64) -> String {
    format!(
        r#"{{"type":"Feature","properties":{{{said}}},
            "geometry":{{"type":"Point","coordinates":[{east_m},{north_m}]}}}}"#
    )
}

#[test]
fn what_is_inadequate_is_found_pinned_built_again_and_compared() {
    let tin = "per_4km_square = 4096\n[tin]\nmethod = \"paper\"\npoints = 300";
    let scene = Scene::with_job("small.toml", &[("per_4km_square = 4096", tin)]);
    scene.run_to(0, &["build", "job.toml", "--out", "before.tdb", "--quiet"]);
    let text = scene.run_to(0, &["inadequate", "before.tdb"]).stdout;
    assert!(text.contains("pieces of ground") && text.contains("what could be done"), "{text}");
    for name in ["error.png", "density.png"] {
        assert!(fs::read(scene.path("before.tdb").join(name)).unwrap().starts_with(b"\x89PNG"));
    }
    let found = json(&fs::read_to_string(scene.path("before.tdb/inadequate.geojson")).unwrap());
    let worst = &found["features"][0]["properties"];
    let at = |key: &str| worst["worst"][key].as_f64().unwrap();
    assert!(found["tolerance_m"].as_f64().unwrap() < worst["largest_m"].as_f64().unwrap());
    assert_eq!(worst["area_m2"].as_f64().unwrap(), 625.0 * worst["posts"].as_f64().unwrap());
    // A database with maps in it is as sound as before.
    scene.run_to(0, &["verify", "before.tdb"]);

    let pins = pin(r#""pin":"add""#, at("east_m"), at("north_m"));
    fs::write(scene.path("pins.geojson"), pins).unwrap();
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    fs::write(scene.path("job.toml"), job + "\npins = \"pins.geojson\"\n").unwrap();
    scene.run_to(0, &["build", "job.toml", "--out", "after.tdb", "--quiet"]);
    let text = scene.run_to(1, &["diff", "before.tdb", "after.tdb"]).stdout;
    for part in ["RMS residual m", "tin.pins", "pins.geojson", "load modules differ"] {
        assert!(text.contains(part), "{part:?} is not in: {text}");
    }
    let same = json(&scene.run_to(0, &["diff", "after.tdb", "after.tdb", "--format", "json"]).stdout);
    assert_eq!(same["changed"], json("[]"));
    // Weights of pins are found again beside the database.
    scene.run_to(0, &["inadequate", "after.tdb", "--tolerance", "2", "--format", "json"]);
    scene.run_to(0, &["fidelity", "after.tdb", "--pairs", "50"]);
}

#[test]
fn pins_that_cannot_be_are_refused_before_anything_is_written() {
    let pinned = "per_4km_square = 4096\n[tin]\npins = \"pins.geojson\"";
    let scene = Scene::with_job("small.toml", &[("per_4km_square = 4096", pinned)]);
    let refuses = |text: &str, parts: &[&str]| {
        fs::write(scene.path("pins.geojson"), text).unwrap();
        let said = scene.run_to(2, &["build", "job.toml", "--out", "a.tdb", "--quiet"]);
        said.check_error(parts);
    };
    refuses(&pin(r#""pin":"add""#, 1.0e6, 0.0), &["pins.geojson", "feature 0", "outside the area"]);
    refuses(&pin(r#""pin":"push""#, 506_000.0, 3_876_000.0), &["a point with pin \"push\"", "\"forbid\""]);
    refuses("{}", &["pins.geojson", "expected GeoJSON"]);
    let line = r#"{"type":"LineString","coordinates":[[506000,3876000],[506100,3876000]]}"#;
    refuses(line, &["LineString (not supported yet)", "Point or Polygon"]);
    fs::remove_file(scene.path("pins.geojson")).unwrap();
    scene.run_to(2, &["build", "job.toml", "--out", "a.tdb", "--quiet"]).check_error(&["tin.pins", "pins.geojson"]);
    assert!(!scene.path("a.tdb/database.json").exists());
}

#[test]
fn a_mesh_starts_from_what_another_method_chooses() {
    let scene = with_dem();
    for tiles in ["1x1", "2x2"] {
        let start = ["tin", "dem.tif", "--points", "300", "--tiles", tiles, "--method", "paper", "--out", "m.ply"];
        let plain = json(scene.run_to(0, &[&start[..], &["--json"]].concat()).stdout.lines().last().unwrap());
        let given = ["--start", "vip:100", "--json"];
        let started = json(scene.run_to(0, &[&start[..], &given].concat()).stdout.lines().last().unwrap());
        assert_eq!((&plain["points"], &started["points"]), (&Value::from(300), &Value::from(300)), "{tiles}");
        // VIP's points are no help.
        assert!(plain["residual"]["rms_m"].as_f64() < started["residual"]["rms_m"].as_f64());
    }
    let wrong =
        |start: &str| scene.run_to(2, &["tin", "dem.tif", "--points", "9", "--start", start, "--out", "m.ply"]).stderr;
    assert!(wrong("vip").contains("vip:1000") && wrong("vpi:5").contains("fowler-little"));
    assert!(wrong("highlow:5").contains("highlow alone"));
}

#[test]
fn a_mesh_starts_from_points_of_a_file_and_keeps_their_heights() {
    let scene = with_dem();
    // The sample's south-west post lies at 505000 east, 3875000 north; one point is on the line between tiles.
    fs::write(
        scene.path("points.csv"),
        "east,north,height_m\n506000,3875505,1234.5\n506250,3876000,77\n506000,3876500,",
    )
    .unwrap();
    let start = ["tin", "dem.tif", "--start", "points.csv", "--coordinates", "map", "--out", "m.obj"];
    for method in ["optimised", "paper", "greedy"] {
        for tiles in ["1x1", "2x2"] {
            scene.run_to(0, &[&start[..], &["--points", "200", "--method", method, "--tiles", tiles]].concat());
            let mesh = fs::read_to_string(scene.path("m.obj")).unwrap();
            let places: Vec<Vec<f64>> = mesh
                .lines()
                .filter_map(|line| line.strip_prefix("v "))
                .map(|line| line.split(' ').map(|number| number.parse().unwrap()).collect())
                .collect();
            for (north, east, height) in [(3_875_500.0, 506_000.0, 1234.5), (3_876_000.0, 506_250.0, 77.0)] {
                assert!(places.contains(&vec![east, north, height]), "{method}, {tiles}: {east} {north}");
            }
        }
    }
    let few = [&start[..], &["--points", "6"]].concat();
    scene.run_to(2, &few).check_error(&["--start: 3 points", "at most 2"]);
    fs::write(scene.path("points.csv"), "east,north\n1,2\n").unwrap();
    scene.run_to(2, &[&start[..], &["--points", "60"]].concat()).check_error(&["points.csv: line 2", "outside the"]);
}

#[test]
fn what_a_method_makes_is_improved_in_a_row_of_its_own() {
    let scene = with_dem();
    let compare = ["compare", "dem.tif", "--points", "500", "--methods", "regular,iterative", "--format", "json"];
    let found = json(&scene.run_to(0, &[&compare[..], &["--start", "regular:100,highlow"]].concat()).stdout);
    let rms_m = |name: &str| {
        let row = found["rows"].as_array().unwrap().iter().find(|row| row["method"] == name);
        let row = row.unwrap_or_else(|| panic!("no row of {name}: {found:#}"));
        assert!(row["points"].as_u64() <= Some(500), "{name}: {row}");
        row["rms_m"].as_f64().unwrap()
    };
    assert!(rms_m("iterative from regular:100") < rms_m("regular"));
    assert!(rms_m("iterative from highlow") < rms_m("regular"));
    let wrong = |start: &str| scene.run_to(2, &[&compare[..], &["--start", start]].concat()).stderr;
    assert!(wrong("highlow:9").contains("highlow alone") && wrong("vip").contains("vip:1000"));
}

#[test]
fn load_modules_of_another_build_are_refused_until_a_build_makes_them_again() {
    let scene = Scene::built();
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    fs::write(scene.path("other.toml"), job.replace("seed = 1", "seed = 2")).unwrap();
    scene.run_to(0, &["build", "other.toml", "--out", "other.tdb", "--quiet", "--no-html"]);
    let name = "modules/r01c01.slm";
    fs::copy(scene.path("other.tdb").join(name), scene.path("small.tdb").join(name)).unwrap();
    for arguments in [
        &["export", "small.tdb", "--format", "obj", "--out", "a.obj"][..],
        &["export", "small.tdb", "--format", "obj", "--out", "a.obj", "--modules", "7,7"],
        &["render", "small.tdb", "--view", "relief", "--out", "a.png"],
        &["fidelity", "small.tdb"],
        &["correlate", "small.tdb", "other.tdb"],
        &["diff", "small.tdb", "other.tdb"],
    ] {
        scene.refuses(arguments, &[name, "not of the build that database.json tells of"]);
    }
    scene.run_to(2, &["tile", "job.toml", "0,0", "--out", "small.tdb", "--quiet"]).check_error(&[name]);
    scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
    scene.run_to(0, &["verify", "small.tdb"]);
    scene.run_to(0, &["correlate", "small.tdb", "small.tdb"]);
}
