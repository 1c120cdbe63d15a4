//! Pipes, devices and folders where a file is expected: refused at once, never waited for.

#![cfg(target_os = "linux")]

use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::raster::Raster;
use crate::scene::{Said, Scene};

/// Longer than any refusal takes, also on a machine that does much else.
const AT_MOST: Duration = Duration::from_secs(30);

/// A scene with a sound raster and its job, a pipe without a writer, and a folder.
fn scene() -> Scene {
    let scene = Scene::with_job("raster.toml", &[]);
    Raster::sound().write(&scene.path("dem.tif"));
    assert!(Command::new("mkfifo").arg(scene.path("pipe")).status().unwrap().success());
    fs::create_dir(scene.path("folder")).unwrap();
    scene
}

/// What the program says of `arguments`, which end by themselves with exit code 2.
#[track_caller]
fn ends(scene: &Scene, arguments: &[&str]) -> Said {
    let mut program = scene.program();
    program.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let (mut child, began) = (program.spawn().unwrap(), Instant::now());
    while child.try_wait().unwrap().is_none() {
        if AT_MOST < began.elapsed() {
            child.kill().unwrap();
            panic!("{arguments:?} waits");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let said = Said::from(child.wait_with_output().unwrap());
    assert_eq!(said.code, Some(2), "{arguments:?}: {}{}", said.stdout, said.stderr);
    said
}

/// The same, with one error.
#[track_caller]
fn refused(scene: &Scene, arguments: &[&str]) {
    ends(scene, arguments).check_error(&[]);
}

/// What is no regular file.
const ODD: [&str; 4] = ["pipe", "/dev/zero", "/dev/null", "folder"];

#[test]
fn no_argument_that_names_a_file_is_waited_for() {
    let scene = scene();
    for odd in ODD {
        refused(&scene, &["plan", odd]);
        refused(&scene, &["build", odd]);
        refused(&scene, &["worker", odd, "--out", "x.tdb"]);
        refused(&scene, &["tin", odd, "--points", "100", "--out", "m.ply"]);
        refused(&scene, &["compare", odd, "--points", "100"]);
        if odd != "folder" {
            refused(&scene, &["init", odd]);
        }
        refused(&scene, &["status", odd]);
        refused(&scene, &["report", odd]);
        refused(&scene, &["verify", odd]);
        refused(&scene, &["diff", odd, odd]);
        refused(&scene, &["export", odd, "--format", "ply", "--out", "m.ply"]);
        refused(&scene, &["render", odd, "--view", "relief", "--out", "a.png"]);
    }
    for (odd, name) in [("pipe", "p.csv"), ("/dev/zero", "z.csv"), ("folder", "f.csv")] {
        let leads = if odd.starts_with('/') { odd.into() } else { scene.path(odd) };
        std::os::unix::fs::symlink(leads, scene.path(name)).unwrap();
        refused(&scene, &["tin", "dem.tif", "--points", "100", "--start", name, "--out", "m.ply"]);
    }
}

#[test]
fn no_file_that_a_database_is_measured_against_is_waited_for() {
    let scene = scene();
    scene.run_to(0, &["build", "job.toml", "--out", "x.tdb"]);
    for odd in ODD {
        refused(&scene, &["verify", "x.tdb", "--dem", odd]);
        refused(&scene, &["fidelity", "x.tdb", "--against", odd]);
    }
    // Nor one of the database itself.
    for name in ["database.json", "report.json", "modules/r00c00.slm"] {
        let path = scene.path("x.tdb").join(name);
        let bytes = fs::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        let said = ends(&scene, &["verify", "x.tdb"]);
        let said = (said.stdout + &said.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(said.contains("a pipe, expected a file"), "{name}: {said}");
        fs::remove_file(&path).unwrap();
        fs::write(&path, bytes).unwrap();
    }
    scene.run_to(0, &["verify", "x.tdb"]);
}

#[test]
fn no_file_that_a_job_names_is_waited_for() {
    for (from, to) in [
        ("sources = [\"dem.tif\"]", "sources = [\"ODD\"]"),
        ("[tiles]", "[tin]\nstart = \"ODD.csv\"\n[tiles]"),
        ("[tiles]", "[tin]\npins = \"ODD\"\n[tiles]"),
        ("voids = \"fail\"", "voids = \"fail\"\nwater = \"ODD\""),
        ("voids = \"fail\"", "voids = \"fail\"\ngeoids = [{ datum = \"EGM96\", file = \"ODD\" }]"),
        ("[tiles]", "[importance]\nareas = [{ file = \"ODD\", class = \"a\", weight = 2 }]\n[tiles]"),
        ("[tiles]", "[importance]\nareas = [{ raster = \"ODD\", value = 1, class = \"a\", weight = 2 }]\n[tiles]"),
    ] {
        let scene = scene();
        let job = fs::read_to_string(scene.path("job.toml")).unwrap();
        assert!(job.contains(from));
        std::os::unix::fs::symlink(scene.path("pipe"), scene.path("pipe.csv")).unwrap();
        std::os::unix::fs::symlink(scene.path("folder"), scene.path("folder.csv")).unwrap();
        for odd in ["pipe", "/dev/zero", "folder"] {
            let to = to.replace("ODD.csv", if odd.starts_with('/') { odd } else { "ODD.csv" }).replace("ODD", odd);
            fs::write(scene.path("job.toml"), job.replacen(from, &to, 1)).unwrap();
            for command in ["plan", "build"] {
                refused(&scene, &[command, "job.toml", "--out", "x.tdb"]);
            }
        }
    }
}
