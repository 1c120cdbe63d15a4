//! Many processes, one folder: tasks, workers, engines; and what they say.

use std::fs;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::scene::{Said, Scene, everything_below, send};

/// A scene with a job of 3 x 3 tiles, built in `alone.tdb`.
fn nine_tiles() -> Scene {
    let scene = Scene::with_job(
        "small.toml",
        &[("size_m = [4000, 4000]", "size_m = [4500, 4500]"), ("columns = 2", "columns = 3"), ("rows = 2", "rows = 3")],
    );
    scene.run_to(0, &["build", "job.toml", "--out", "alone.tdb", "--quiet"]);
    scene
}

/// The files of a database that do not depend on who built it.
fn product(scene: &Scene, name: &str) -> std::collections::BTreeMap<String, Vec<u8>> {
    let root = scene.path(name);
    let files = everything_below(&root).into_iter().filter_map(|(path, bytes)| Some((path, bytes?)));
    let named = files.map(|(path, bytes)| (path.strip_prefix(&root).unwrap().to_string_lossy().into_owned(), bytes));
    named.filter(|(name, _)| !name.starts_with("report.") && name != "lock").collect()
}

#[track_caller]
fn assert_same(scene: &Scene, name: &str) {
    let (alone, other) = (product(scene, "alone.tdb"), product(scene, name));
    let names: std::collections::BTreeSet<&String> = alone.keys().chain(other.keys()).collect();
    let differing: Vec<_> = names.into_iter().filter(|name| alone.get(*name) != other.get(*name)).collect();
    assert!(differing.is_empty(), "{differing:?} differ");
}

fn start_worker(scene: &Scene) -> Child {
    let mut program = scene.program();
    program.args(["worker", "job.toml", "--out", "area.tdb", "--lease", "1", "--workers", "1", "--quiet"]);
    program.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap()
}

#[test]
fn workers_of_which_some_are_killed_build_the_bytes_of_one_build() {
    let scene = nine_tiles();
    let mut workers: Vec<Child> = (0..4).map(|_| start_worker(&scene)).collect();
    let mut killed = 0;
    while workers.iter_mut().any(|worker| worker.try_wait().unwrap().is_none()) {
        std::thread::sleep(Duration::from_millis(150));
        if killed < 3 && workers[killed].try_wait().unwrap().is_none() {
            workers[killed].kill().unwrap();
            workers[killed].wait().unwrap();
            workers[killed] = start_worker(&scene);
            killed += 1;
        }
    }
    for worker in workers {
        let said = Said::from(worker.wait_with_output().unwrap());
        assert_eq!(said.code, Some(0), "{}", said.stderr);
    }
    assert_same(&scene, "area.tdb");
    scene.run_to(0, &["verify", "area.tdb"]);
    scene.run_to(0, &["report", "area.tdb"]);
    let said = scene.run_to(0, &["worker", "job.toml", "--out", "area.tdb"]);
    assert!(said.stderr.contains("0 units of work"), "{}", said.stderr);
}

#[test]
fn tasks_one_by_one_build_the_bytes_of_one_build() {
    let scene = nine_tiles();
    let task = |code: i32, words: &[&str]| {
        scene.run_to(code, &[&["task", "job.toml", "--out", "area.tdb", "--quiet"], words].concat())
    };
    let early = task(75, &["refine", "0,0"]);
    early.check_error(&["refine-r00c00", "allocate"]);
    task(0, &["survey", "0,0", "0,1", "0,2", "1,0", "1,1", "1,2", "2,0", "2,1", "2,2"]);
    task(0, &["allocate"]);
    for tiles in [&["0,0", "0,2", "2,0", "2,2"][..], &["0,1", "2,1"], &["1,0", "1,2"], &["1,1"]] {
        task(0, &[&["refine"], tiles].concat());
    }
    scene.run_to(2, &["status", "area.tdb"]);
    task(0, &["assemble", "0,0", "0,1"]);
    task(0, &["publish"]);
    assert_same(&scene, "area.tdb");
    task(0, &["refine", "1,1"]);
    task(0, &["publish"]);
    assert_same(&scene, "area.tdb");
    task(2, &["refine"]).check_error(&["refine", "no tile"]);
    task(2, &["allocate", "0,0"]).check_error(&["allocate", "found a tile"]);
    task(2, &["refine", "9,9"]).check_error(&["9,9"]);
}

#[test]
fn a_build_file_for_ninja_names_every_task_after_what_it_needs() {
    let scene = nine_tiles();
    let text = scene.run_to(0, &["plan", "job.toml", "--emit", "ninja", "--pack", "2", "--out", "n.tdb"]).stdout;
    for part in ["rule unit", "words = refine 0,0 0,2", "words = publish", "survey-r00c00", "n.tdb.marks"] {
        assert!(text.contains(part), "{part:?} is not in: {text}");
    }
    fs::write(scene.path("build.ninja"), &text).unwrap();
    match Command::new("ninja").args(["-j", "2"]).current_dir(scene.path("")).output() {
        Ok(output) => {
            let said = Said::from(output);
            assert_eq!(said.code, Some(0), "{}{}", said.stdout, said.stderr);
            assert_same(&scene, "n.tdb");
        }
        Err(error) => eprintln!("skipped: ninja cannot be started: {error}"),
    }
}

#[test]
fn the_job_for_kubernetes_starts_workers_in_the_folder_that_all_files_share() {
    let scene = nine_tiles();
    let text = scene.run_to(0, &["plan", "job.toml", "--emit", "kubernetes", "--out", "it's.tdb"]).stdout;
    let folder = scene.path("").canonicalize().unwrap().display().to_string();
    for part in ["completionMode: Indexed", "completions: 1", &format!("mountPath: \"{folder}"), r"it'\\''s.tdb"] {
        assert!(text.contains(part), "{part:?} is not in: {text}");
    }
    let away = scene.run_to(2, &["plan", "job.toml", "--emit", "kubernetes", "--out", "/nowhere/it.tdb"]);
    away.check_error(&["job.toml", "without a folder in common"]);
}

#[test]
fn scripts_for_slurm_and_dask_are_well_formed() {
    let scene = nine_tiles();
    for (emit, checker, flag) in [("slurm", "bash", "-n"), ("dask", "python3", "-mpy_compile")] {
        let text = scene.run_to(0, &["plan", "job.toml", "--emit", emit, "--out", "it's.tdb"]).stdout;
        assert!(text.contains("publish") && text.contains("survey"), "{text}");
        fs::write(scene.path(emit), &text).unwrap();
        match Command::new(checker).args([flag, emit]).current_dir(scene.path("")).output() {
            Ok(output) => {
                let said = Said::from(output);
                assert_eq!(said.code, Some(0), "{emit}: {}", said.stderr);
            }
            Err(error) => eprintln!("skipped: {checker} cannot be started: {error}"),
        }
    }
}

#[test]
fn a_million_tiles_and_ten_thousand_workers_are_played_from_measured_costs() {
    let scene = nine_tiles();
    let start = Instant::now();
    let arguments = ["--simulate", "1,10000", "--tiles", "3x3,1000x1000", "--emit", "json", "--out", "alone.tdb"];
    let text = scene.run_to(0, &[&["plan", "job.toml"][..], &arguments].concat()).stdout;
    let plan: Value = serde_json::from_str(&text).unwrap();
    let runs = plan["simulation"].as_array().unwrap();
    assert_eq!(runs.len(), 4);
    for run in runs {
        let (busy, chain) = (run["busy"].as_f64().unwrap(), run["longest_chain_s"].as_f64().unwrap());
        assert!(0.0 < busy && busy <= 1.0 + 1e-9 && chain <= run["seconds"].as_f64().unwrap() + 1e-9, "{run}");
        assert!(run["coordinator_bytes"].as_u64().unwrap() < 1 << 30);
    }
    assert!(runs[1]["busy"].as_f64().unwrap() < 0.1, "9 tiles do not keep 10,000 workers busy: {}", runs[1]);
    assert!(0.8 < runs[3]["busy"].as_f64().unwrap(), "a million tiles do: {}", runs[3]);
    // Ten seconds are asked for; other tests run beside this one, unoptimised.
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
}

#[test]
fn what_is_made_again_is_said_with_its_cause() {
    let scene = nine_tiles();
    let again = scene.run_to(0, &["build", "job.toml", "--out", "alone.tdb"]);
    assert!(again.stderr.contains("nothing changed: all 9 tiles"), "{}", again.stderr);
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    fs::write(scene.path("job.toml"), job.replace("mean_per_load_module = 32", "mean_per_load_module = 24")).unwrap();
    let said = scene.run_to(0, &["build", "job.toml", "--out", "alone.tdb", "-v"]);
    for part in ["refined again", "its allowance moved", "refine r00c00 begins", "is done", "publish ends after"] {
        assert!(said.stderr.contains(part), "{part:?} is not in: {}", said.stderr);
    }
    let said = scene.run_to(0, &["build", "job.toml", "--out", "alone.tdb", "--fresh", "--log", "json"]);
    assert_eq!(said.stdout, "");
    let events: Vec<Value> = said.stderr.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(events.iter().any(|event| event["event"] == "done" && event["stage"] == "refine"));
    assert_eq!(events.last().unwrap()["event"], "end");
}

#[test]
fn the_long_version_tells_the_formats() {
    let said = Scene::new().run_to(0, &["--version"]).stdout;
    for part in ["tiefort", "database format 2", "load-module format", "algorithm revision"] {
        assert!(said.contains(part), "{said}");
    }
}

/// One tile that takes several seconds: best effort on 6 km a side.
#[cfg(unix)]
#[test]
fn an_interrupted_run_ends_within_a_second_however_long_its_tile_takes() {
    let changes = [
        ("size_m = [4000, 4000]", "size_m = [16000, 16000]"),
        ("columns = 2", "columns = 1"),
        ("rows = 2", "rows = 1"),
        ("spacing_m = 25", "spacing_m = 12.5"),
    ];
    let scene = Scene::with_job("small.toml", &changes);
    for (command, signal, code) in [("build", "-INT", 130), ("worker", "-TERM", 143)] {
        let mut program = scene.program();
        program.args([command, "job.toml", "--out", "long.tdb", "--log", "json"]);
        let mut child = program.stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().unwrap()));
        let begun = |line: &String| line.contains("\"started\"") && line.contains("survey");
        assert!(lines.by_ref().map_while(Result::ok).any(|line| begun(&line)), "no tile was begun");
        let start = Instant::now();
        send(signal, child.id());
        let ended = child.wait().unwrap();
        let rest: Vec<String> = lines.map_while(Result::ok).collect();
        assert_eq!(ended.code(), Some(code), "{command}: {rest:?}");
        assert!(rest.iter().any(|line| line.contains("run the same command again")), "{command}: {rest:?}");
        // One second is asked for; a machine at its limits is allowed a little more.
        assert!(start.elapsed() < Duration::from_millis(2500), "{command}: {:?}", start.elapsed());
        let hidden = everything_below(&scene.path("long.tdb")).into_keys();
        let left: Vec<_> = hidden.filter(|path| path.to_string_lossy().contains("/.tiefort-")).collect();
        assert!(left.is_empty(), "{command}: {left:?}");
    }
}

#[cfg(unix)]
#[test]
fn output_never_follows_a_link_out_of_its_folder() {
    let scene = nine_tiles();
    let outside = scene.path("outside");
    fs::create_dir(&outside).unwrap();
    for name in ["tiles", "modules", "measured", "survey", "work", "lock"] {
        let area = scene.path("area.tdb");
        fs::create_dir(&area).unwrap();
        std::os::unix::fs::symlink(&outside, area.join(name)).unwrap();
        for command in ["build", "worker"] {
            let said = scene.run_to(2, &[command, "job.toml", "--out", "area.tdb", "--quiet"]);
            said.check_error(&["area.tdb"]);
        }
        assert!(everything_below(&outside).is_empty(), "{name} was followed");
        fs::remove_dir_all(&area).unwrap();
    }
}
