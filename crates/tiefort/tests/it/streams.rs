//! What goes to stdout, what to stderr, and what happens when the reader is gone, or at an interruption.

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use serde_json::Value;
use store::Lock;

use crate::scene::{Said, Scene, send};

#[test]
fn a_quiet_build_says_nothing() {
    let scene = Scene::with_job("small.toml", &[]);
    let said = scene.run_to(0, &["build", "job.toml", "--quiet"]);
    assert_eq!((said.stdout.as_str(), said.stderr.as_str()), ("", ""));
}

#[test]
fn a_build_announces_itself_in_a_line_and_ends_with_its_table_on_stderr() {
    let scene = Scene::with_job("small.toml", &[]);
    let said = scene.run_to(0, &["build", "job.toml", "--workers", "2"]);
    assert_eq!(said.stdout, "");
    for part in ["small.tdb, 2 workers", "Stages", "busy %", "refine", "Breaches", "Output", "small.tdb"] {
        assert!(said.stderr.contains(part), "{part:?} is not in: {}", said.stderr);
    }
    assert!(!said.stderr.contains('\u{1b}'), "colours or cursor movements without a terminal");
}

#[test]
fn events_are_json_lines_and_the_last_one_is_the_report() {
    let scene = Scene::with_job("small.toml", &[]);
    let said = scene.run_to(0, &["build", "job.toml", "--json"]);
    let events: Vec<Value> = said.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let count = |event: &str, stage: &str| {
        events.iter().filter(|value| value["event"] == event && value["stage"] == stage).count()
    };
    assert_eq!((count("enter", "refine"), count("leave", "refine")), (1, 1));
    assert_eq!((count("started", "refine"), count("done", "refine")), (4, 4));
    let summary = events.last().unwrap();
    assert_eq!((&summary["event"], &summary["report"]["area"]), (&"summary".into(), &"small".into()));
    assert_eq!(summary["report"]["stages"][0]["name"], "read");
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_error() {
    let scene = Scene::with_job("small.toml", &[]);
    scene.run_to(0, &["build", "job.toml", "--quiet"]);
    for arguments in ["plan job.toml", "report small.tdb", "status small.tdb", "build job.toml --json", "--help"] {
        let script = format!("exec 3>&1; {{ \"$0\" {arguments}; echo $? >&3; }} | true");
        let mut shell = Command::new("sh");
        shell.args(["-c", &script, env!("CARGO_BIN_EXE_tiefort")]).current_dir(scene.path(""));
        let said = Said::from(shell.output().unwrap());
        assert_eq!((said.stdout.trim(), said.stderr.contains("error")), ("0", false), "{arguments}: {}", said.stderr);
    }
}

#[test]
fn a_database_that_another_run_builds_is_worth_trying_later() {
    let scene = Scene::with_job("small.toml", &[]);
    scene.run_to(0, &["build", "job.toml", "--quiet"]);
    let lock = Lock::acquire(&scene.path("small.tdb")).unwrap();
    let before = scene.everything();
    for arguments in [&["build", "job.toml"][..], &["tile", "job.toml", "0,0"]] {
        let said = scene.run_to(75, arguments);
        said.check_error(&["small.tdb", "another run"]);
    }
    scene.run_to(75, &["status", "small.tdb"]);
    assert!(before == scene.everything());
    drop(lock);
    scene.run_to(0, &["status", "small.tdb"]);
}

/// Starts a build, sends `signal` when the first tile is refined, and gives what the program said.
#[cfg(unix)]
fn interrupted(scene: &Scene, signal: &str) -> Said {
    let mut program = scene.program();
    program.args(["build", "job.toml", "--json", "--workers", "1"]).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = program.spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let refined = |line: &String| line.contains("\"done\"") && line.contains("\"refine\"");
    assert!(lines.by_ref().map_while(Result::ok).any(|line| refined(&line)), "no tile was refined");
    send(signal, child.id());
    let code = child.wait().unwrap().code();
    let mut stderr = String::new();
    child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
    Said { code, stdout: String::new(), printed: stderr.clone(), stderr }
}

#[cfg(unix)]
#[test]
fn a_build_that_is_interrupted_goes_on_where_it_stopped() {
    let many_tiles = [
        ("size_m = [4000, 4000]", "size_m = [16000, 16000]"),
        ("columns = 2", "columns = 8"),
        ("rows = 2", "rows = 8"),
    ];
    let scene = Scene::with_job("small.toml", &many_tiles);
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        let said = interrupted(&scene, signal);
        assert_eq!(said.code, Some(code), "{}", said.stderr);
        assert!(said.stderr.contains("stopped") && said.stderr.contains("same command"), "{}", said.stderr);
        scene.run_to(2, &["status", "small.tdb"]);
    }
    let said = scene.run_to(0, &["build", "job.toml", "--json"]);
    assert!(said.stdout.contains("\"kept\""), "nothing was kept of two interrupted builds");
    scene.run_to(0, &["build", "job.toml", "--quiet", "--out", "fresh.tdb"]);
    for name in ["tiles/r00c00.tin", "tiles/r07c07.tin", "modules/r03c04.slm", "database.json"] {
        let (went_on, fresh) = (scene.path("small.tdb").join(name), scene.path("fresh.tdb").join(name));
        assert!(std::fs::read(went_on).unwrap() == std::fs::read(fresh).unwrap(), "{name} differs from a fresh build");
    }
}
