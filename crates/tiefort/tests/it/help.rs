//! Help and wrong arguments.

use crate::scene::Scene;

/// The names of all commands.
fn commands(scene: &Scene) -> Vec<String> {
    let told = scene.run_to(2, &["man", "no-such-command"]).stderr;
    let (_, names) = told.lines().next().and_then(|line| line.split_once("expected one of ")).unwrap();
    names.split(", ").map(str::to_owned).collect()
}

#[test]
fn the_help_of_every_command_has_an_example_of_it() {
    let scene = Scene::new();
    for command in commands(&scene) {
        let help = scene.run_to(0, &[&command, "--help"]).stdout;
        assert!(help.contains("Examples:"), "{command}: {help}");
        assert!(help.contains(&format!("  tiefort {command} ")), "{command}: {help}");
    }
    assert!(scene.run_to(0, &["--help"]).stdout.contains("Exit codes:"));
}

#[test]
fn the_version_tells_commit_features_and_formats() {
    let version = Scene::new().run_to(0, &["--version"]).stdout;
    let lines: Vec<&str> = version.lines().collect();
    let starts = ["tiefort ", "commit ", "features ", "database format ", "load-module format ", "algorithm revision "];
    assert_eq!(lines.len(), starts.len(), "{version}");
    for (line, start) in lines.iter().zip(starts) {
        assert!(line.starts_with(start) && start.len() < line.len(), "{start}: {version}");
    }
}

#[test]
fn the_help_lists_every_command() {
    let scene = Scene::new();
    let help = scene.run_to(0, &["--help"]).stdout;
    for command in commands(&scene) {
        assert!(help.contains(&format!("\n  {command} ")), "{help}");
    }
}

#[test]
fn an_unknown_flag_ends_with_2_and_names_it() {
    let scene = Scene::new();
    for command in commands(&scene) {
        let said = scene.run_to(2, &[&command, "--no-such-flag"]);
        assert!(said.stderr.contains("--no-such-flag"), "{}", said.stderr);
        assert!(said.stdout.is_empty());
    }
    assert!(scene.run_to(2, &["biuld"]).stderr.contains("build"));
    scene.run_to(2, &[]);
}

#[test]
fn wrong_values_of_arguments_end_with_2_and_say_what_was_expected() {
    let scene = Scene::with_job("small.toml", &[]);
    for (arguments, expected) in [
        (&["build", "job.toml", "--workers", "0"][..], "1..=1024"),
        (&["build", "job.toml", "--workers", "many"], "invalid digit"),
        (&["tile", "job.toml", "2"], "expected ROW,COL"),
        (&["tile", "job.toml", "-1,0"], "expected ROW,COL"),
        (&["tin", "a.tif", "--out", "m.ply"], "--points <N>|--triangles <N>|--max-residual <M>|--rms <R>"),
        (&["tin", "a.tif", "--triangles", "1", "--out", "m.ply"], "2.."),
        (&["tin", "a.tif", "--triangles", "9", "--points", "9", "--out", "m.ply"], "cannot be used with"),
        (&["tin", "a.tif", "--points", "9", "--effort", "high", "--out", "m.ply"], "fast, normal, best"),
        (&["tin", "a.tif", "--points", "9", "--height-fit", "l3", "--out", "m.ply"], "l2, off"),
        (&["tin", "a.tif", "--points", "9", "--lattice", "8", "--out", "m.ply"], "eighth, post"),
        (&["tin", "a.tif", "--rms", "nan", "--out", "m.ply"], "above 0"),
        (&["tin", "a.tif", "--points", "9", "--tiles", "6", "--out", "m.ply"], "expected ROWSxCOLUMNS"),
        (&["sample", "--spacing", "25.27", "--out", "a.tif"], "multiple of 1/16 m"),
        (&["sample", "--posts", "1", "--out", "a.tif"], "2..="),
        (&["report", "x.tdb", "--format", "pdf"], "html"),
        (&["render", "x.tdb", "--view", "photo", "--out", "a.png"], "relief, perspective, wireframe, residual"),
        (&["render", "x.tdb", "--view", "relief", "--size", "9", "--out", "a.png"], "200..=8000"),
        (&["render", "x.tdb", "--view", "relief", "--modules", "3,3..2,2", "--out", "a.png"], "ROW,COL..ROW,COL"),
        (&["render", "x.tdb", "--view", "perspective", "--eye", "1", "--out", "a.png"], "EAST,NORTH"),
        (&["render", "x.tdb", "--view", "perspective", "--pitch", "95", "--out", "a.png"], "-89 to 89"),
        (&["view", "x.tdb", "--port", "65536"], "0..=65535"),
        (&["explain", "x.tdb", "2"], "expected ROW,COL"),
        (&["diff", "x.tdb"], "<B>"),
        (&["fidelity", "x.tdb", "--pairs", "0"], "1..="),
        (&["fidelity", "x.tdb", "--seed", "x"], "--seed"),
        (&["tin", "a.tif", "--points", "9", "--measure", "--quiet", "--out", "m.ply"], "--measure"),
    ] {
        let said = scene.run_to(2, arguments);
        assert!(said.stderr.contains(expected), "{arguments:?}: {}", said.stderr);
    }
}

#[test]
fn arguments_that_do_not_fit_together_are_named() {
    let scene = Scene::with_job("small.toml", &[]);
    scene.refuses(&["tile", "job.toml", "2,0"], &["2,0", "row from 0 to 1"]);
    scene.refuses(&["tin", "a.tif", "--points", "9", "--out", "m.xyz"], &["m.xyz", "\"xyz\"", "ply"]);
    let key = ["tin", "a.tif", "--points", "9", "--method", "paper", "--key", "max", "--out", "m.ply"];
    scene.refuses(&key, &["--key", "greedy"]);
    for method in ["paper", "greedy"] {
        for flag in [["--effort", "fast"], ["--height-fit", "off"], ["--lattice", "post"]] {
            let given = ["tin", "a.tif", "--points", "9", "--method", method, flag[0], flag[1], "--out", "m.ply"];
            scene.refuses(&given, &[flag[0], "another method than optimised"]);
        }
        let counted = ["tin", "a.tif", "--triangles", "9", "--method", method, "--out", "m.ply"];
        scene.refuses(&counted, &["--triangles", "expected --points"]);
    }
    let map = ["render", "x.tdb", "--view", "density", "--eye", "1,2", "--out", "a.png"];
    scene.refuses(&map, &["--eye", "perspective or wireframe"]);
    let map = ["render", "x.tdb", "--view", "relief", "--against", "a.tif", "--out", "a.png"];
    scene.refuses(&map, &["--against", "no use for it"]);
    scene.refuses(&["report", "x.tdb", "--against", "a.tif"], &["--against", "--format html"]);
    scene.refuses(&["sample", "--posts", "9", "--classes", "a.tif", "--out", "a.tif"], &["a.tif", "two"]);
}
