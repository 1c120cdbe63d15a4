//! Every command with every path that is not what it wants: refused at once, by what is there, with a hint that fits.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::scene::{Said, Scene, send};

/// Longest that a refusal may take, on a machine at its limits.
const SECONDS_MAX: Duration = Duration::from_secs(20);

/// What is named, what it is told as, and what the hint holds: of a path that should be a job, a raster, a database.
struct Wrong {
    path: &'static str,
    as_job: (&'static str, &'static str),
    as_raster: (&'static str, &'static str),
    as_database: (&'static str, &'static str),
}

const WRONG: [Wrong; 9] = [
    Wrong {
        path: "nothere",
        as_job: ("found nothing there", "check the path"),
        as_raster: ("No such file", "check the path"),
        as_database: ("found nothing there", "check the path"),
    },
    Wrong {
        path: "dangling",
        as_job: ("a link that leads nowhere", "path of a job file"),
        as_raster: ("a link that leads nowhere", "remove the link"),
        as_database: ("a link that leads nowhere", "check the path"),
    },
    Wrong {
        path: "folder",
        as_job: ("found a folder", "path of a job file"),
        as_raster: ("a folder", "files in it"),
        as_database: ("found another folder", "no database.json"),
    },
    Wrong {
        path: "empty",
        as_job: ("an empty file", "tiefort init"),
        as_raster: ("an empty file", "not copied or unpacked whole"),
        as_database: ("found a file", "such as ntc.tdb"),
    },
    Wrong {
        path: "bytes",
        as_job: ("not UTF-8", "tiefort init bytes --out"),
        as_raster: ("begins with ff fe", "gdalinfo"),
        as_database: ("found a file", "such as ntc.tdb"),
    },
    Wrong {
        path: "pipe",
        as_job: ("a pipe, a socket or a device", "copy it into a file"),
        as_raster: ("a named pipe", "cannot be read twice"),
        as_database: ("found a file", "such as ntc.tdb"),
    },
    Wrong {
        path: "x.tdb/database.json",
        as_job: ("found JSON", "a job is TOML"),
        as_raster: ("a JSON file, not a raster", "name a raster"),
        as_database: ("found a file", "the folder that this file lies in"),
    },
    Wrong {
        path: "s.tif",
        as_job: ("not UTF-8", "tiefort init s.tif --out"),
        as_raster: ("", ""),
        as_database: ("found a file", "such as ntc.tdb"),
    },
    Wrong {
        path: "s.tif/sub",
        as_job: ("Not a directory", "path of a job file"),
        as_raster: ("Not a directory", "check the path"),
        as_database: ("found nothing there", "check the path"),
    },
];

/// `@` stands for the path.
const OF_JOBS: [&[&str]; 5] = [
    &["build", "@", "--out", "o.tdb"],
    &["plan", "@"],
    &["tile", "@", "0,0"],
    &["task", "@", "survey", "0,0", "--out", "o.tdb"],
    &["worker", "@", "--out", "o.tdb"],
];
const OF_RASTERS: [&[&str]; 7] = [
    &["init", "@"],
    &["compare", "@", "--points", "100"],
    &["tin", "@", "--points", "50", "--out", "o.ply"],
    &["verify", "x.tdb", "--dem", "@"],
    &["fidelity", "x.tdb", "--against", "@"],
    &["explain", "x.tdb", "0,0", "--against", "@"],
    &["report", "x.tdb", "--format", "html", "--against", "@"],
];
const OF_DATABASES: [&[&str]; 10] = [
    &["status", "@"],
    &["report", "@"],
    &["verify", "@"],
    &["inadequate", "@"],
    &["fidelity", "@"],
    &["explain", "@", "0,0"],
    &["diff", "x.tdb", "@"],
    &["export", "@", "--format", "gpkg", "--out", "o.gpkg"],
    &["export", "@", "--format", "modules", "--out", "o"],
    &["render", "@", "--view", "density", "--out", "o.png"],
];
const FILES_OUT: [&[&str]; 6] = [
    &["sample", "--posts", "33", "--out", "@.tif"],
    &["export", "x.tdb", "--format", "ply", "--out", "@.ply"],
    &["export", "x.tdb", "--format", "gpkg", "--out", "@.gpkg"],
    &["export", "x.tdb", "--format", "geotiff", "--out", "@.tif"],
    &["tin", "s.tif", "--points", "50", "--out", "@.obj"],
    &["render", "x.tdb", "--view", "density", "--out", "@.png"],
];
const FOLDERS_OUT: [&[&str]; 6] = [
    &["build", "job.toml", "--out", "@"],
    &["worker", "job.toml", "--out", "@"],
    &["export", "x.tdb", "--format", "modules", "--out", "@"],
    &["inadequate", "x.tdb", "--out", "@"],
    &["compare", "s.tif", "--points", "100", "--pictures", "@"],
    &["man", "--out", "@"],
];

/// A database, a raster, a job, and one of everything that is none of them.
fn scene() -> Scene {
    let scene = Scene::with_job("small.toml", &[]);
    scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html", "--out", "x.tdb"]);
    scene.run_to(0, &["sample", "--posts", "81", "--out", "s.tif"]);
    fs::create_dir(scene.path("folder")).unwrap();
    fs::write(scene.path("folder/thesis.tex"), "x").unwrap();
    fs::write(scene.path("empty"), "").unwrap();
    fs::write(scene.path("bytes"), b"\xff\xfe\x00\x81\xc0\x07".repeat(40)).unwrap();
    symlink(scene.path("gone"), scene.path("dangling")).unwrap();
    assert!(Command::new("mkfifo").arg(scene.path("pipe")).status().unwrap().success());
    scene
}

/// Runs a command on a path that must be refused in time, naming it and what is there, with a hint, and nothing made.
#[track_caller]
fn check(scene: &Scene, command: &[&str], path: &str, parts: &[&str], hint: &str) {
    let arguments: Vec<String> = command.iter().map(|word| word.replace('@', path)).collect();
    let before = names(&scene.path(""));
    let mut program = scene.program();
    program.args(&arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let start = Instant::now();
    let mut child = program.spawn().unwrap();
    while child.try_wait().unwrap().is_none() {
        if SECONDS_MAX < start.elapsed() {
            child.kill().unwrap();
            panic!("{arguments:?} hangs");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let said = Said::from(child.wait_with_output().unwrap());
    assert_eq!(said.code, Some(2), "{arguments:?}: {}{}", said.stdout, said.stderr);
    let error = said.stderr.lines().find_map(|line| line.strip_prefix("error: ")).unwrap_or_default();
    let told = said.stderr.lines().find_map(|line| line.strip_prefix("hint: ")).unwrap_or_default();
    for part in parts {
        assert!(error.contains(part), "{arguments:?}: the error does not name {part:?}: {}", said.stderr);
    }
    assert!(told.contains(hint) && 8 < told.len(), "{arguments:?}: the hint does not hold {hint:?}: {}", said.stderr);
    assert!(!error.contains(".tiefort-"), "a name of ours is told: {}", said.stderr);
    assert_eq!(names(&scene.path("")), before, "{arguments:?} was refused and yet left something");
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = entries.collect();
    names.sort();
    names
}

#[test]
fn a_path_that_is_no_job_is_told_as_what_it_is() {
    let scene = scene();
    for command in OF_JOBS {
        for Wrong { path, as_job: (found, hint), .. } in WRONG {
            check(&scene, command, path, &[path, found], hint);
        }
        check(&scene, command, "x.tdb", &["x.tdb", "the folder of a terrain database"], "the job it was built from");
    }
}

#[test]
fn a_path_that_is_no_raster_is_told_as_what_it_is() {
    let scene = scene();
    for command in OF_RASTERS {
        for Wrong { path, as_raster: (found, hint), .. } in WRONG {
            // A folder means the rasters in it, to `init`.
            let (found, hint) = match (command[0], path) {
                ("init", "folder") => ("a folder without rasters", ".tif"),
                _ => (found, hint),
            };
            if path != "s.tif" {
                check(&scene, command, path, &[path, found], hint);
            }
        }
        if command[0] != "init" {
            check(&scene, command, "x.tdb", &["x.tdb", "the folder of a terrain database"], "--format geotiff");
        }
        if command[0] != "compare" {
            check(&scene, command, "job.toml", &["job.toml", "a job file, not a raster"], "dem.sources");
        }
    }
}

#[test]
fn a_path_that_is_no_database_is_told_as_what_it_is() {
    let scene = scene();
    for command in OF_DATABASES {
        for Wrong { path, as_database: (found, hint), .. } in WRONG {
            check(&scene, command, path, &[path, found], hint);
        }
        check(&scene, command, "job.toml", &["job.toml", "found a job file"], "that is a job");
    }
}

#[test]
fn a_file_is_not_written_where_something_else_stands() {
    let scene = scene();
    for command in FILES_OUT {
        let ending = command.last().unwrap().trim_start_matches('@');
        let place = |name: &str| scene.path(&format!("{name}{ending}"));
        fs::create_dir_all(place("taken")).unwrap();
        let _ = symlink(scene.path("gone"), place("link"));
        assert!(place("fifo").exists() || Command::new("mkfifo").arg(place("fifo")).status().unwrap().success());
        check(&scene, command, "taken", &["taken", "found a folder"], "name the file");
        check(&scene, command, "link", &["link", "a link that leads nowhere"], "remove the link");
        check(&scene, command, "fifo", &["fifo", "a pipe, a socket or a device"], "name a file");
        check(&scene, command, "none/a", &["none/a", "cannot be written"], "make the folder first");
        check(&scene, command, "s.tif/a", &["s.tif/a", "cannot be written"], "a part of the path is a file");
    }
}

#[test]
fn a_folder_is_not_made_where_something_else_stands() {
    let scene = scene();
    for command in FOLDERS_OUT {
        for (path, found) in [
            ("empty", "found a file"),
            ("dangling", "a link that leads nowhere"),
            ("s.tif", "found a file"),
            ("s.tif/a", "Not a directory"),
        ] {
            check(&scene, command, path, &[path, found], "");
        }
        // What only adds files to a folder may add them to any.
        if !["man", "inadequate"].contains(&command[0]) {
            check(&scene, command, "folder", &["folder", "found"], "another");
        }
    }
    check(&scene, &["init", "s.tif", "--out", "@"], "job.toml", &["job.toml", "found a file"], "another name");
    check(&scene, &["init", "s.tif", "--out", "@"], "folder", &["folder", "found a folder"], "another name");
}

#[test]
fn a_file_that_may_not_be_read_is_told_so() {
    use std::os::unix::fs::PermissionsExt;
    let scene = scene();
    fs::copy(scene.path("s.tif"), scene.path("secret")).unwrap();
    fs::set_permissions(scene.path("secret"), fs::Permissions::from_mode(0o000)).unwrap();
    if fs::File::open(scene.path("secret")).is_ok() {
        eprintln!("skipped: this user may read everything");
        return;
    }
    check(&scene, &["plan", "@"], "secret", &["secret", "Permission denied"], "job file");
    check(&scene, &["init", "@"], "secret", &["secret", "Permission denied"], "permissions");
}

#[test]
fn points_to_start_from_are_a_method_or_a_file_by_its_ending() {
    let scene = scene();
    for path in ["nothere", "folder", "s.tif"] {
        let said = scene.run_to(2, &["tin", "s.tif", "--points", "50", "--start", path, "--out", "o.ply"]);
        assert!(said.stderr.contains("METHOD:N") && said.stderr.contains(".csv or .geojson"), "{}", said.stderr);
    }
    let started = ["tin", "s.tif", "--points", "50", "--start", "@", "--out", "o.ply"];
    check(&scene, &started, "none.csv", &["none.csv", "No such file"], "check the path");
}

#[test]
fn a_name_full_of_escapes_is_written_out_wherever_it_is_told() {
    let scene = scene();
    let name = "a\u{1b}[31m\u{7}b";
    fs::write(scene.path(name), "hello").unwrap();
    for command in OF_JOBS.iter().chain(&OF_RASTERS).chain(&OF_DATABASES) {
        let arguments: Vec<String> = command.iter().map(|word| word.replace('@', name)).collect();
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let said = scene.run_to(2, &arguments);
        let all = said.stdout + &said.printed;
        assert!(!all.contains('\u{1b}') && !all.contains('\u{7}') && all.contains("u{1b}"), "{arguments:?}: {all:?}");
    }
}

#[test]
fn pins_that_do_not_say_what_for_are_told_with_what_to_write() {
    let square = "[[[505500,3875500],[506500,3875500],[506500,3876500],[505500,3876500],[505500,3875500]]]";
    for (properties, shape, found, hint) in [
        ("", ("Polygon", square), "a polygon without pin", "\"pin\": \"importance\", \"factor\": 4"),
        ("\"factor\": 4", ("Polygon", square), "a polygon without pin", "\"pin\": \"importance\""),
        ("\"pin\": \"add\"", ("Polygon", square), "a polygon with pin \"add\"", "\"pin\": \"importance\""),
        ("", ("Point", "[506000, 3876000]"), "a point without pin", "\"pin\": \"add\""),
        ("\"pin\": \"importance\"", ("Point", "[506000, 3876000]"), "pin \"importance\"", "\"pin\": \"add\""),
        ("\"pin\": \"height\"", ("Point", "[506000, 3876000]"), "without height_m", "\"height_m\": 712.5"),
    ] {
        let scene = Scene::with_job("small.toml", &[("[tiles]", "[tin]\npins = \"p.geojson\"\n\n[tiles]")]);
        let (kind, coordinates) = shape;
        let geometry = format!("{{ \"type\": \"{kind}\", \"coordinates\": {coordinates} }}");
        let feature =
            format!("{{ \"type\": \"Feature\", \"properties\": {{ {properties} }}, \"geometry\": {geometry} }}");
        let collection = format!("{{ \"type\": \"FeatureCollection\", \"features\": [{feature}] }}");
        fs::write(scene.path("p.geojson"), collection).unwrap();
        for command in [&["plan", "@"][..], &["build", "@", "--out", "o.tdb"]] {
            check(&scene, command, "job.toml", &["p.geojson", "feature 0", found], hint);
        }
    }
}

#[test]
fn a_file_larger_than_files_may_be_is_an_error_and_leaves_nothing_behind() {
    let scene = Scene::new();
    let before = scene.everything();
    let mut shell = Command::new("sh");
    let line = "ulimit -f 10; exec \"$0\" sample --posts 501 --out s.tif";
    shell.current_dir(scene.path("")).args(["-c", line, env!("CARGO_BIN_EXE_tiefort")]);
    let said = shell.output().unwrap();
    let told = String::from_utf8_lossy(&said.stderr);
    assert!(said.status.code() == Some(2) && told.contains("s.tif"), "{:?}: {told}", said.status);
    assert!(scene.everything() == before, "nothing half-written is left");
}

/// Whether some file in a folder, or in a folder in that, has a byte.
fn holds_bytes(folder: &Path) -> bool {
    fs::read_dir(folder).into_iter().flatten().flatten().any(|entry| match entry.metadata() {
        Ok(data) if data.is_dir() => holds_bytes(&entry.path()),
        data => data.is_ok_and(|data| 0 < data.len()),
    })
}

#[test]
fn a_signal_while_a_file_is_being_written_leaves_nothing_behind() {
    let scene = Scene::new();
    let before = scene.everything();
    let mut program = scene.program();
    let mut child =
        program.args(["sample", "--posts", "12001", "--out", "s.tif"]).stderr(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while !holds_bytes(&scene.path("")) && begun.elapsed() < SECONDS_MAX {
        std::thread::yield_now();
    }
    send("-TERM", child.id());
    assert_eq!(child.wait().unwrap().code(), Some(143));
    assert!(scene.everything() == before, "nothing half-written is left");
}
