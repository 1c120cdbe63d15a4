//! Everything a person reads fits a terminal of 80 columns; words that are wider, such as paths, alone excepted.

use std::fs;
use std::process::Stdio;

use crate::scene::Scene;

const COLUMNS_MAX: usize = 80;
/// Characters of a word from which on it may be wider than a line: a path, or a name.
const WORD_MIN: usize = 60;

#[track_caller]
fn check(what: &str, text: &str) {
    for line in text.lines() {
        let columns = line.chars().count();
        let long = line.split(' ').map(|word| word.chars().count()).filter(|&word| WORD_MIN <= word).sum::<usize>();
        assert!(columns <= COLUMNS_MAX + long, "{what}: {columns} columns: {line}");
        assert!(columns <= COLUMNS_MAX || 0 < long, "{what}: {columns} columns: {line}");
    }
}

/// Runs it and looks at all it prints, whatever comes of it.
#[track_caller]
fn check_run(scene: &Scene, arguments: &[&str]) -> String {
    let said = scene.run(arguments);
    check(&format!("{arguments:?}"), &said.stdout);
    check(&format!("{arguments:?}"), &said.printed);
    said.stdout + &said.printed
}

/// The commands, as the program's own help names them.
fn commands(scene: &Scene) -> Vec<String> {
    let help = scene.run_to(0, &["--help"]).stdout;
    let list = help.split("Commands:").nth(1).unwrap().split("Options:").next().unwrap();
    let names = list.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    names.filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

#[test]
fn help_of_every_command_fits_a_terminal() {
    let scene = Scene::new();
    let commands = commands(&scene);
    assert!(20 < commands.len(), "{commands:?}");
    check_run(&scene, &["--help"]);
    check_run(&scene, &["--version"]);
    check_run(&scene, &[]);
    for command in &commands {
        for wrong in ["--help", "-h", "--no-such-flag-however-long-its-name-may-be-and-it-is-long"] {
            check_run(&scene, &[command, wrong]);
        }
    }
}

#[test]
fn what_commands_print_fits_a_terminal() {
    let scene = Scene::with_job("small.toml", &[("[limits]", "[lod]\nlevels = [{ inner_share = 0.5 }]\n\n[limits]")]);
    let built = check_run(&scene, &["build", "job.toml", "--out", "x.tdb"]);
    assert!(built.contains("\npage ") && built.contains("\n  page "), "the page's time is told: {built}");
    check_run(&scene, &["build", "job.toml", "--out", "x.tdb"]);
    check_run(&scene, &["build", "job.toml", "--out", "y.tdb", "-v"]);
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    fs::write(scene.path("less.toml"), job.replace("per_load_module = 100", "per_load_module = 40")).unwrap();
    check_run(&scene, &["build", "less.toml", "--out", "y.tdb"]);
    for arguments in [
        &["plan", "job.toml"][..],
        &["plan", "job.toml", "--simulate", "1,10000", "--tiles", "2x2,1000x1000"],
        &["report", "y.tdb"],
        &["explain", "y.tdb", "2,2"],
        &["status", "x.tdb"],
        &["verify", "x.tdb"],
        &["diff", "x.tdb", "y.tdb"],
        &["fidelity", "x.tdb", "--pairs", "100"],
        &["inadequate", "x.tdb", "--out", "maps"],
        &["export", "x.tdb", "--format", "modules", "--out", "modules"],
        &["render", "x.tdb", "--view", "density", "--out", "a.png"],
        &["sample", "--posts", "161", "--out", "s.tif"],
        &["init", "s.tif"],
        &["compare", "s.tif", "--points", "1000,2000", "--methods", "vip,highlow,iterative"],
        &["tin", "s.tif", "--points", "300", "--measure", "--out", "m.ply"],
        &["man", "--out", "pages"],
        &["worker", "job.toml", "--out", "w.tdb"],
    ] {
        check_run(&scene, arguments);
    }
}

#[test]
fn an_error_is_wider_than_a_terminal_by_its_path_alone() {
    let scene = Scene::with_job("raster.toml", &[("dem.tif", "a folder/with a name/dem.tif")]);
    let long = format!("{}/nothere.tdb", "folder/".repeat(30));
    for arguments in [&["build", "job.toml"][..], &["plan", "job.toml"], &["verify", &long], &["status", &long]] {
        let text = check_run(&scene, arguments);
        assert!(text.contains("error: ") && text.contains("hint: "), "{text}");
    }
    let said = scene.run_to(2, &["build", &"x".repeat(300)]);
    assert!(said.printed.lines().filter(|line| COLUMNS_MAX < line.len()).count() <= 1, "{}", said.printed);
}

#[test]
fn wrong_arguments_do_not_obey_what_was_typed() {
    let scene = Scene::new();
    let said = scene.run_to(2, &["build", "job.toml", "--\u{1b}[31mred"]);
    assert!(!said.printed.contains('\u{1b}') && said.printed.contains("red"), "{:?}", said.printed);
    let said = scene.run_to(2, &["build", "job.toml", "--workers", &"9".repeat(10_000)]);
    assert!(said.printed.len() < 3000, "{} bytes", said.printed.len());
}

#[test]
fn a_build_says_how_long_all_of_it_still_takes() {
    let changes = [("size_m = [4000, 4000]", "size_m = [16000, 16000]"), ("columns = 2", "columns = 4")];
    let scene = Scene::with_job("small.toml", &changes);
    let mut program = scene.program();
    program.args(["build", "job.toml", "--workers", "1"]).stdout(Stdio::null());
    let said = crate::scene::Said::from(program.output().unwrap());
    let estimates = said.printed.lines().filter(|line| line.contains(" tiles ") && line.ends_with(" left")).count();
    let stages = said.printed.lines().filter(|line| line.ends_with("% busy")).count();
    assert!(6 <= stages, "{}", said.printed);
    // A quick machine may need no line in between.
    assert!(0 < estimates || !said.printed.contains(" of 8 tiles"), "{}", said.printed);
}

#[test]
fn shells_are_told_every_command_and_manual_pages_are_written() {
    let scene = Scene::new();
    for shell in ["bash", "zsh", "fish"] {
        let script = scene.run_to(0, &["completions", shell]).stdout;
        for command in commands(&scene) {
            assert!(script.contains(&command), "{shell} does not know {command}");
        }
        assert!(script.contains("tiefort") && script.contains("release-borders"), "{shell}: {script}");
    }
    if let Ok(checked) = std::process::Command::new("bash").arg("-n").stdin(Stdio::piped()).spawn() {
        let mut checked = checked;
        let script = scene.run_to(0, &["completions", "bash"]).stdout;
        std::io::Write::write_all(&mut checked.stdin.take().unwrap(), script.as_bytes()).unwrap();
        assert!(checked.wait().unwrap().success());
    }
    let page = scene.run_to(0, &["man", "build"]).stdout;
    assert!(page.contains(".TH tiefort-build 1") && page.contains("workers"), "{page}");
    assert!(scene.run_to(0, &["man"]).stdout.contains(".TH tiefort 1"));
    scene.run_to(0, &["man", "--out", "share/man1"]);
    let count = fs::read_dir(scene.path("share/man1")).unwrap().count();
    assert_eq!(count, commands(&scene).iter().filter(|command| *command != "help").count() + 1);
    scene.refuses(&["man", "biuld"], &["biuld", "build"]);
}
