//! From a job to a database and back to words.

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::Stdio;

use serde_json::Value;

use crate::scene::{Scene, everything_below};

#[test]
fn a_database_is_reported_on_verified_and_complete() {
    let scene = Scene::built();
    let status = scene.run_to(0, &["status", "small.tdb"]).stdout;
    assert!(status.contains("complete") && status.contains("# #\n  # #") && status.contains("done: 4"), "{status}");
    let report = scene.run_to(0, &["report", "small.tdb"]).stdout;
    for part in ["Gaming area small", "mountains", "largest load module", "Refused posts", "refine"] {
        assert!(report.contains(part), "{part:?} is not in: {report}");
    }
    assert!(report.lines().all(|line| line.chars().count() <= 100), "{report}");
    let verify = scene.run_to(0, &["verify", "small.tdb"]).stdout;
    assert!(verify.contains("sound") && verify.contains("64 load modules"), "{verify}");
}

#[test]
fn the_report_has_the_keys_of_the_contract() {
    let scene = Scene::built();
    let report: Value =
        serde_json::from_str(&scene.run_to(0, &["report", "small.tdb", "--format", "json"]).stdout).unwrap();
    for pointer in "/area /workers /stages/0/name /stages/0/wall_s /stages/0/cpu_s /points/selected /points/border
        /points/corner /points/total /triangles /polygons /per_load_module/mean /per_load_module/max
        /per_load_module/limit /per_load_module/over /per_4km/max /per_4km/limit /per_4km/over /pool/size /pool/used
        /residual/rms_m /residual/max_m /residual/mean_abs_m /residual/p95_m /residual/p99_m /dem_accuracy_m
        /breaches /classes/0/posts /classes/0/points"
        .split_whitespace()
    {
        assert!(report.pointer(pointer).is_some(), "the report lacks {pointer}");
    }
    let names: Vec<_> = report["stages"].as_array().unwrap().iter().map(|stage| stage["name"].clone()).collect();
    for stage in ["read", "survey", "refine", "assemble", "publish"] {
        assert!(names.iter().any(|name| name == stage), "{stage} is not among {names:?}");
    }
    let breaches: Value = serde_json::from_slice(&fs::read(scene.path("small.tdb/breaches.geojson")).unwrap()).unwrap();
    assert_eq!(breaches["features"], serde_json::json!([]));
}

#[test]
fn a_build_killed_while_its_page_is_drawn_is_no_database_until_the_next_one() {
    let scene = Scene::with_job("small.toml", &[]);
    scene.run_to(0, &["build", "job.toml", "--out", "undisturbed.tdb", "--quiet"]);
    let mut build = scene.program();
    build.args(["build", "job.toml", "--log", "json"]).stderr(Stdio::piped());
    let mut build = build.spawn().unwrap();
    let mut lines = BufReader::new(build.stderr.take().unwrap()).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains("\"enter\"") && line.contains("\"page\"")), "no page was drawn");
    build.kill().unwrap();
    build.wait().unwrap();
    let is_there = |name: &str| scene.path("small.tdb").join(name).exists();
    assert!(is_there("breaches.csv") && !is_there("report.json"), "the report lists the page, and comes after it");
    let told = scene.run_to(2, &["status", "small.tdb"]).stdout;
    assert!(told.contains("incomplete") && told.contains("done: 4"), "{told}");
    scene.refuses(&["report", "small.tdb"], &["small.tdb", "incomplete"]);
    scene.run_to(0, &["build", "job.toml", "--quiet"]);
    scene.run_to(0, &["verify", "small.tdb"]);
    let manifest = |name: &str| fs::read(scene.path(name).join("database.json")).unwrap();
    assert!(manifest("small.tdb") == manifest("undisturbed.tdb") && scene.path("small.tdb/report.html").exists());
}

#[test]
fn a_second_build_keeps_every_tile_and_a_fresh_one_none() {
    let scene = Scene::built();
    let database = fs::read(scene.path("small.tdb/database.json")).unwrap();
    let again = scene.run_to(0, &["build", "job.toml"]);
    assert!(again.stderr.contains("nothing changed: all 4 tiles"), "{}", again.stderr);
    let fresh = scene.run_to(0, &["build", "job.toml", "--fresh"]);
    assert!(fresh.stderr.contains("4 built, 0 kept"), "{}", fresh.stderr);
    assert!(fs::read(scene.path("small.tdb/database.json")).unwrap() == database, "the same job gave other bytes");
}

#[test]
fn a_tile_is_run_again_and_changes_nothing() {
    let scene = Scene::built();
    let modules = |scene: &Scene| fs::read(scene.path("small.tdb/modules/r01c01.slm")).unwrap();
    let before = modules(&scene);
    let said = scene.run_to(0, &["tile", "job.toml", "1,1"]);
    assert!(said.stderr.contains("r01c01 built"), "{}", said.stderr);
    assert!(modules(&scene) == before);
    scene.run_to(0, &["verify", "small.tdb"]);
}

#[test]
fn damage_is_found_and_named() {
    let scene = Scene::built();
    let path = scene.path("small.tdb/modules/r00c01.slm");
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&path, bytes).unwrap();
    let said = scene.run_to(2, &["verify", "small.tdb"]);
    assert!(said.stdout.contains("r00c01.slm") && said.stdout.contains("damaged"), "{}", said.stdout);
    scene.run_to(0, &["build", "job.toml", "--quiet"]);
    scene.run_to(0, &["verify", "small.tdb"]);
}

#[test]
fn a_plan_lists_settings_tiles_and_forecast() {
    let scene = Scene::with_job("small.toml", &[]);
    let text = scene.run_to(0, &["plan", "job.toml", "--simulate", "4"]).stdout;
    for part in ["\n  spacing_m", "Load modules", "Memory", "longest chain", "rank  tile"] {
        assert!(text.contains(part), "{part:?} is not in: {text}");
    }
    let plan: Value = serde_json::from_str(&scene.run_to(0, &["plan", "job.toml", "--emit", "json"]).stdout).unwrap();
    assert_eq!(plan["tiles"].as_array().unwrap().len(), 4);
    assert_eq!(plan["tiles"][0]["tile"], serde_json::json!([0, 0]));
    assert!(plan["forecast"]["memory_bytes"].as_u64().unwrap() > 0);
    assert!(!scene.path("small.tdb").exists());
}

/// The most memory a process has held so far, in bytes; nothing once it has ended, or where the system does not say.
fn peak_bytes(process: u32) -> Option<u64> {
    let text = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok()? << 10)
}

#[test]
fn a_forecast_is_near_what_a_build_takes() {
    // Within 1.5 on a quiet machine, as `scripts/bench.py size` measures it; this holds the order of size.
    const FACTOR: f64 = 2.0;
    for size in ["4000, 4000", "24000, 24000"] {
        let scene = Scene::with_job(
            "small.toml",
            &[("4000, 4000", size), ("[limits]", "[tin]\nmethod = \"greedy\"\n[limits]")],
        );
        let text = scene.run_to(0, &["plan", "job.toml", "--emit", "json"]).stdout;
        let forecast = &serde_json::from_str::<Value>(&text).unwrap()["forecast"];
        let mut build = scene.program().args(["build", "job.toml", "--quiet", "--workers", "2"]).spawn().unwrap();
        let mut peak = None;
        while build.try_wait().unwrap().is_none() {
            peak = peak_bytes(build.id()).or(peak);
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        let database = everything_below(&scene.path("small.tdb"));
        let disk: usize = database.values().flatten().map(Vec::len).sum();
        for (what, found) in [("disk_bytes", Some(disk as u64)), ("memory_bytes", peak)] {
            let (expected, Some(found)) = (forecast[what].as_f64().unwrap(), found) else { continue };
            let ratio = expected / found as f64;
            assert!((1.0 / FACTOR..FACTOR).contains(&ratio), "{size}: {what}: {expected} forecast, {found} taken");
        }
    }
}

#[test]
fn a_pinned_down_residual_that_limits_forbid_is_a_breach() {
    let scene = Scene::with_job("small.toml", &[("[limits]", "[tin]\nmax_residual_m = 0.01\n\n[limits]")]);
    let said = scene.run_to(1, &["build", "job.toml"]);
    assert!(said.stderr.contains("residual"), "{}", said.stderr);
    scene.run_to(1, &["report", "small.tdb"]);
    scene.run_to(1, &["status", "small.tdb"]);
    scene.run_to(2, &["build", "job.toml", "--strict"]);
    scene.run_to(2, &["build", "job.toml", "--strict", "--fresh"]);
    scene.run_to(0, &["verify", "small.tdb"]);
    let breaches: Value = serde_json::from_slice(&fs::read(scene.path("small.tdb/breaches.geojson")).unwrap()).unwrap();
    assert_eq!(breaches["features"][0]["properties"]["kind"], "residual");
    // Those that find it finished end as the build does; a unit of it is done.
    for command in [&["worker", "job.toml"][..], &["task", "job.toml", "publish"]] {
        scene.run_to(1, &[command, &["--quiet"]].concat());
        scene.run_to(2, &[command, &["--quiet", "--strict"]].concat());
    }
    scene.run_to(0, &["task", "job.toml", "refine", "0,0", "--quiet"]);
}

#[test]
fn status_tells_of_damage_that_shows_without_reading_files() {
    let scene = Scene::with_job("small.toml", &[]);
    scene.run_to(0, &["build", "job.toml", "--quiet"]);
    let path = |name: &str| scene.path("small.tdb").join(name);
    let manifest = fs::read_to_string(path("database.json")).unwrap();
    let cut = |name: &str| fs::write(path(name), b"short").unwrap();
    let damage: [(&str, &dyn Fn(), &str); 4] = [
        ("modules/r00c00.slm", &|| cut("modules/r00c00.slm"), "found 5 bytes"),
        ("modules/r01c01.slm", &|| fs::remove_file(path("modules/r01c01.slm")).unwrap(), "no such file"),
        ("report.json", &|| fs::remove_file(path("report.json")).unwrap(), "no such file"),
        (
            "report.json",
            &|| fs::copy(path("../other.tdb/database.json"), path("database.json")).map(drop).unwrap(),
            "not of",
        ),
    ];
    let other = fs::read_to_string(scene.path("job.toml"))
        .unwrap()
        .replace("name = \"small\"", "name = \"small\"\ntitle = \"x\"");
    fs::write(scene.path("other.toml"), other).unwrap();
    scene.run_to(0, &["build", "other.toml", "--out", "other.tdb", "--quiet"]);
    for (file, spoil, told) in damage {
        spoil();
        let said = scene.run_to(2, &["status", "small.tdb"]).stdout;
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(said.contains("damaged: `tiefort build`") && said.contains(file) && said.contains(told), "{said}");
        scene.run_to(0, &["build", "job.toml", "--quiet"]);
        let said = scene.run_to(0, &["status", "small.tdb"]).stdout;
        assert!(said.contains("complete") && fs::read_to_string(path("database.json")).unwrap() == manifest, "{said}");
    }
}

#[test]
fn another_title_is_the_same_job_and_no_tile_is_made_again() {
    let scene = Scene::with_job("small.toml", &[]);
    scene.run_to(0, &["build", "job.toml", "--quiet", "--out", "x.tdb"]);
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    let titled = |title: &str| job.replacen("name = \"small\"", &format!("name = \"small\"\ntitle = \"{title}\""), 1);
    let page_of = || fs::read_to_string(scene.path("x.tdb/report.html")).unwrap();
    fs::write(scene.path("job.toml"), titled("First of May")).unwrap();
    // A tile may be run again though the database knows no title yet.
    scene.run_to(0, &["tile", "job.toml", "0,0", "--out", "x.tdb"]);
    assert!(page_of().contains("First of May"));
    fs::write(scene.path("job.toml"), titled("Second of May")).unwrap();
    let said = scene.run_to(0, &["build", "job.toml", "--out", "x.tdb"]).stderr;
    assert!(said.contains("0 built, 4 kept"), "{said}");
    assert!(page_of().contains("Second of May"));
    let said = scene.run_to(0, &["build", "job.toml", "--out", "x.tdb"]).stderr;
    assert!(said.contains("nothing changed"), "{said}");
    scene.run_to(0, &["verify", "x.tdb"]);
    // Any other setting is another job.
    fs::write(scene.path("job.toml"), titled("Second of May").replace("pool = 0", "pool = 1") + "pool = 9\n").unwrap();
    let said = scene.run_to(2, &["tile", "job.toml", "0,0", "--out", "x.tdb"]);
    said.check_error(&["another job", "pool = 9"]);
}
