//! `correlate`: two surfaces of one area, accepted or not, and why.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::raster::Raster;
use crate::scene::Scene;

/// Hills of some 40 m, and ripples of so many metres on them.
fn hills(ripples_m: f64) -> impl Fn(f64, f64) -> f64 {
    move |east, north| {
        let (x, y) = (east - 504_500.0, north - 3_874_500.0);
        let hills = 25.0 * (x / 110.0).sin() * (y / 140.0).cos() + 15.0 * ((x + y) / 190.0).sin();
        300.0 + hills + ripples_m * (x / 27.0).sin() * (y / 31.0).sin()
    }
}

/// Builds a database in a folder of the scene from a raster, with this name of its vertical datum.
fn build(scene: &Scene, folder: &str, raster: &Raster, datum: &str) {
    raster.write(&scene.path("dem.tif"));
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    let said = format!("voids = \"hole\"\nvertical_datum = \"{datum}\"");
    fs::write(scene.path(&format!("{folder}.toml")), job.replace("voids = \"fail\"", &said)).unwrap();
    scene.run_to(0, &["build", &format!("{folder}.toml"), "--out", folder, "--quiet", "--no-html"]);
}

/// A scene with `a.tdb` of rippled hills.
fn with_hills() -> Scene {
    let scene = Scene::with_job("raster.toml", &[]);
    build(&scene, "a.tdb", &Raster::around(hills(1.0)), "EGM96");
    scene
}

#[track_caller]
fn found(scene: &Scene, code: i32, arguments: &[&str]) -> Value {
    let said = scene.run_to(code, &[&["correlate", "a.tdb"], arguments, &["--format", "json"]].concat());
    serde_json::from_str(&said.stdout).unwrap_or_else(|error| panic!("{error}: {}", said.stdout))
}

fn criterion<'a>(found: &'a Value, name: &str) -> &'a Value {
    found["criteria"].as_array().unwrap().iter().find(|criterion| criterion["name"] == name).unwrap()
}

#[test]
fn a_database_agrees_with_itself_and_a_plan_says_how_surely() {
    let scene = with_hills();
    let text = scene.run_to(0, &["correlate", "a.tdb", "a.tdb"]).stdout;
    assert!(text.starts_with("Accepted: at least 95 % of the area"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80 || line.contains("BLAKE3")), "{text}");
    let found = found(&scene, 0, &["a.tdb"]);
    let samples = found["plan"]["samples"].as_u64().unwrap();
    assert!(300 < samples && samples < 2000, "{samples}");
    assert_eq!(found["heights"]["largest_m"].as_f64(), Some(0.0));
    assert_eq!(found["slopes"]["classes"]["kappa"].as_f64(), Some(1.0));
    assert_eq!(found["causes"], Value::Array(vec![]));
    for place in found["criteria"].as_array().unwrap() {
        assert_eq!((&place["failures"], &place["accepted"]), (&Value::from(0), &Value::from(true)));
        // Slopes are not told beside the border.
        assert!(place["name"] == "slopes" || place["samples"].as_u64() == Some(samples), "{place}");
    }
}

#[test]
fn a_shift_of_half_a_post_is_named_and_so_is_another_datum() {
    let scene = with_hills();
    build(&scene, "b.tdb", &Raster::around(hills(1.0)).moved_m(12.5), "EGM96");
    let moved = found(&scene, 1, &["b.tdb"]);
    let cause = moved["causes"][0].as_str().unwrap();
    assert!(cause.starts_with("B lies 12.") && cause.contains(" m east of A, half a post"), "{cause}");
    let east_m = moved["shift"]["moves_b_by"]["east_m"].as_f64().unwrap();
    assert!((east_m + 12.5).abs() < 0.5, "{east_m}");
    let text = scene.run_to(1, &["correlate", "a.tdb", "b.tdb"]).stdout;
    assert!(text.starts_with("Not accepted: B lies 12."), "{text}");
    build(&scene, "c.tdb", &Raster::around(|east, north| hills(1.0)(east, north) + 31.5), "WGS 84 ellipsoid");
    let refused = ["correlate", "a.tdb", "c.tdb"];
    scene.refuses(&refused, &["c.tdb: vertical datum: WGS 84 ellipsoid", "a.tdb, EGM96"]);
    let raised = found(&scene, 1, &["c.tdb", "--allow-datums"]);
    let cause = raised["causes"][0].as_str().unwrap();
    assert!(cause.starts_with("B lies 31.5") && cause.contains(" m above A, as above another vertical"), "{cause}");
    assert!(raised["notes"][0].as_str().unwrap().contains("compared as they are"), "{raised}");
}

#[test]
fn smoother_ground_may_agree_in_height_and_yet_show_more() {
    let scene = with_hills();
    Raster::around(hills(0.0)).write(&scene.path("smooth.tif"));
    let found = found(&scene, 1, &["smooth.tif", "--within", "2.5", "--slope-within", "20"]);
    assert_eq!(criterion(&found, "heights")["accepted"], Value::from(true), "{found:#}");
    let sight = criterion(&found, "sight 1 m");
    assert_eq!(sight["accepted"], Value::from(false), "{sight}");
    assert!(found["causes"].as_array().unwrap().iter().any(|cause| cause.as_str().unwrap().contains("B shows more")));
    assert!(found["sights"][0]["hidden_seen"]["kappa"].as_f64().unwrap() < 0.95);
}

#[test]
fn a_certificate_has_the_same_bytes_for_any_number_of_workers() {
    let scene = with_hills();
    Raster::around(hills(0.5)).write(&scene.path("b.tif"));
    let made = |workers: &'static str, page: &'static str| {
        let words = ["correlate", "a.tdb", "b.tif", "--seed", "7", "--workers", workers, "--page", page];
        let said = scene.run(&words);
        (said.code, said.stdout, fs::read_to_string(scene.path(page)).unwrap())
    };
    let one = made("1", "one.html");
    assert_eq!(one, made("3", "three.html"));
    assert!(one.2.contains("<rect") && one.2.contains("BLAKE3") && !one.2.contains("<script"), "{}", one.2);
    let other = found(&scene, one.0.unwrap(), &["b.tif", "--seed", "8"]);
    assert_ne!(other["heights"], found(&scene, one.0.unwrap(), &["b.tif", "--seed", "7"])["heights"]);
}

#[test]
fn ground_that_one_does_not_have_agrees_in_nothing() {
    let scene = with_hills();
    Raster::sound().all_void().write(&scene.path("void.tif"));
    let void = found(&scene, 1, &["void.tif"]);
    assert_eq!(void["causes"][0], Value::from("B has no ground at 100.0 % of the places"));
    assert_eq!((&void["heights"]["rms_m"], &void["shift"]), (&Value::Null, &Value::Null));
    assert_eq!(criterion(&void, "heights")["failures"], criterion(&void, "heights")["samples"]);
    assert_eq!(criterion(&void, "sight 1 m")["accepted"], Value::from(false));
    scene.run_to(1, &["correlate", "a.tdb", "void.tif", "--page", "void.html"]);
}

#[test]
fn what_cannot_be_compared_is_refused_in_a_sentence() {
    let scene = with_hills();
    Raster::sound().moved_m(2000.0).write(&scene.path("beside.tif"));
    Raster::sound().geographic().write(&scene.path("degrees.tif"));
    Raster::sound().without_crs().write(&scene.path("nowhere.tif"));
    Raster::sound().write(&scene.path("b.tif"));
    let refuses = |words: &[&str], parts: &[&str]| scene.refuses(&[&["correlate"], words].concat(), parts);
    refuses(&["a.tdb", "beside.tif"], &["beside.tif: ground from 507000", "ground in common with a.tdb"]);
    refuses(&["a.tdb", "degrees.tif"], &["degrees.tif"]);
    refuses(&["a.tdb", "nowhere.tif"], &["nowhere.tif"]);
    refuses(&["b.tif", "a.tdb"], &["b.tif: no folder"]);
    refuses(&["a.tdb", "none.tdb"], &["none.tdb"]);
    refuses(&["a.tdb", "b.tif", "--samples", "20"], &["samples: 20, expected 59 at least"]);
    refuses(&["a.tdb", "b.tif", "--accept", "0.9999999"], &["accept, risk", "more than 4000000 places"]);
    for wrong in [
        ["--accept", "1"],
        ["--accept", "0"],
        ["--accept", "NaN"],
        ["--risk", "0"],
        ["--risk", "0.6"],
        ["--within", "-1"],
        ["--samples", "4000001"],
        ["--range", "10"],
        ["--objects", "some"],
    ] {
        let said = scene.run_to(2, &["correlate", "a.tdb", "b.tif", &wrong.join("=")]);
        assert!(said.stderr.contains(wrong[0]), "{}", said.stderr);
    }
    assert!(!Path::new(&scene.path("certificate.html")).exists());
}

#[test]
fn over_a_hole_of_one_nothing_agrees_and_over_a_hole_of_both_it_is_drawn_again() {
    let scene = with_hills();
    // No ground in the northern half.
    let holed = |east: f64, north: f64| if north < 3_876_000.0 { hills(1.0)(east, north) } else { f64::NAN };
    let raster = Raster::around(holed);
    raster.write(&scene.path("holed.tif"));
    let one = found(&scene, 1, &["holed.tif", "--within", "5", "--samples", "300"]);
    let missing = one["places"]["ground_in_a_only"].as_u64().unwrap();
    assert!((100..200).contains(&missing), "{one:#}");
    for name in ["slopes", "sight 1 m", "sight 2.5 m", "sight 10 m"] {
        let criterion = criterion(&one, name);
        assert_eq!(criterion["accepted"], Value::from(false), "{criterion}");
        assert!(missing * 9 / 10 <= criterion["failures"].as_u64().unwrap(), "{name}: {criterion}");
    }
    assert!(one["places"]["pairs_over_ground_of_a_only"].as_u64().unwrap() >= missing, "{one:#}");
    let causes = one["causes"].to_string();
    assert!(causes.contains("or go over a hole of one surface, for") && causes.contains("or one is missing, at"));
    // Its own raster lacks the same ground.
    build(&scene, "holed.tdb", &raster, "EGM96");
    let words = ["correlate", "holed.tdb", "holed.tif", "--within", "5", "--accept", "0.9", "--format", "json"];
    let both: Value = serde_json::from_str(&scene.run_to(0, &words).stdout).unwrap();
    assert!(100 < both["places"]["void_in_both"].as_u64().unwrap(), "{both:#}");
    assert!(100 < both["places"]["pairs_left_out"].as_u64().unwrap(), "{both:#}");
}

#[test]
fn heights_in_feet_are_named() {
    let scene = with_hills();
    Raster::around(|east, north| hills(1.0)(east, north) / 0.3048).write(&scene.path("feet.tif"));
    let found = found(&scene, 1, &["feet.tif"]);
    let cause = found["causes"][0].as_str().unwrap();
    assert!(cause.starts_with("heights of B look like feet, those of A like metres: with B times 0.3048"), "{cause}");
    assert_eq!(found["feet"]["in"], Value::from("b"));
    assert!(!found["causes"].to_string().contains("vertical datum"), "{found:#}");
}
