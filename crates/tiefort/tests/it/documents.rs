//! Every example of README, of the book and of `--help` runs, but for those that say why not.
//!
//! A block is preceded by a comment where more is to be known of it: `<!-- not run: REASON -->`,
//! `<!-- exit 1: REASON -->`, `<!-- part of a job -->` or `<!-- with: ntc -->`, which asks for `ntc.tdb`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::scene::Scene;

/// A block of code of a page.
struct Block {
    page: String,
    line: usize,
    language: String,
    /// What the comment above it says; empty without one.
    remark: String,
    text: String,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// README and the pages of the book, but for those that are generated or tell of decisions.
fn pages() -> Vec<String> {
    let mut pages = vec!["README.md".to_owned()];
    for folder in ["docs", "docs/guides", "docs/figures", "docs/reference"] {
        let entries = fs::read_dir(root().join(folder)).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        pages.extend(names.filter(|name| name.ends_with(".md")).map(|name| format!("{folder}/{name}")));
    }
    pages.retain(|page| !["commands.md", "job-keys.md", "report-keys.md"].iter().any(|name| page.ends_with(name)));
    pages.sort();
    pages
}

fn blocks(page: &str) -> Vec<Block> {
    let text = fs::read_to_string(root().join(page)).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let mut blocks = Vec::new();
    let mut place = 0;
    while place < lines.len() {
        let Some(language) = lines[place].strip_prefix("```") else {
            place += 1;
            continue;
        };
        let length = lines[place + 1..].iter().position(|line| *line == "```").expect("a block ends");
        let above = if place == 0 { "" } else { lines[place - 1] };
        let remark = above.strip_prefix("<!-- ").and_then(|above| above.strip_suffix(" -->")).unwrap_or_default();
        blocks.push(Block {
            page: page.to_owned(),
            line: place + 1,
            language: language.to_owned(),
            remark: remark.to_owned(),
            text: lines[place + 1..=place + length].join("\n"),
        });
        place += length + 2;
    }
    blocks
}

fn all_blocks(language: &str) -> Vec<Block> {
    let blocks = pages().into_iter().flat_map(|page| blocks(&page));
    blocks.filter(|block| block.language == language).collect()
}

/// Runs a script in a folder, with the program on the path; returns what it said if it ends with another exit code.
fn fault_of(scene: &Scene, script: &str, codes: &[i32], place: &str) -> Option<String> {
    let programs = Path::new(env!("CARGO_BIN_EXE_tiefort")).parent().unwrap().to_owned();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let paths = [scene.path("bin"), programs].into_iter().chain(std::env::split_paths(&path));
    let ran = Command::new("bash")
        .args(["-euo", "pipefail", "-c", script])
        .current_dir(scene.path("."))
        .env("PATH", std::env::join_paths(paths).unwrap())
        .env("HOME", scene.path("."))
        .output()
        .unwrap();
    let code = ran.status.code().unwrap_or(-1);
    let told = [ran.stdout, ran.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).join("\n");
    (!codes.contains(&code)).then(|| format!("{place}: exit code {code}\n{script}\n{told}"))
}

#[track_caller]
fn expect_none(faults: &[String]) {
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

/// What the pages suppose to be there: a raster, and where a page does not make them, a job and a database of it.
fn scene_for(blocks: &[Block]) -> Scene {
    let scene = Scene::new();
    let text: String = blocks.iter().map(|block| format!("{} {}\n", block.remark, block.text)).collect();
    scene.run_to(0, &["sample", "--posts", "161", "--out", "dem.tif"]);
    if !text.contains("init dem.tif --out mine.toml") {
        scene.run_to(0, &["init", "dem.tif", "--out", "mine.toml"]);
        let job = fs::read_to_string(scene.path("mine.toml")).unwrap();
        fs::write(scene.path("mine.toml"), job.replace("columns = 1", "columns = 2").replace("rows = 1", "rows = 2"))
            .unwrap();
        scene.run_to(0, &["build", "mine.toml", "--quiet", "--no-html"]);
    }
    fs::create_dir(scene.path("configs")).unwrap();
    let job = fs::read_to_string(root().join("tests/jobs/small.toml")).unwrap();
    let job = job.replace("name = \"small\"", "name = \"ntc\"") + "\n[features]\nsources = [\"sample\"]\n";
    fs::write(scene.path("configs/ntc.toml"), job).unwrap();
    if text.contains("with: ntc") {
        scene.run_to(0, &["build", "configs/ntc.toml", "--quiet", "--no-html"]);
    }
    scene
}

/// A script without the lines that open the viewer: it may not be built in, and runs until Ctrl-C.
fn without_viewer(script: &str) -> String {
    script.lines().filter(|line| !line.starts_with("tiefort view ")).collect::<Vec<_>>().join("\n")
}

#[test]
fn every_command_of_readme_and_book_runs() {
    let (mut count, mut faults) = (0, Vec::new());
    for page in pages() {
        let mut blocks = blocks(&page);
        blocks.retain(|block| block.language == "sh" && !block.remark.starts_with("not run: "));
        if blocks.is_empty() {
            continue;
        }
        let scene = scene_for(&blocks);
        for block in &blocks {
            let codes: &[i32] = if block.remark.starts_with("exit 1: ") { &[1] } else { &[0] };
            let place = format!("{}:{}", block.page, block.line);
            faults.extend(fault_of(&scene, &without_viewer(&block.text), codes, &place));
            count += 1;
        }
    }
    expect_none(&faults);
    assert!(20 < count, "{count} blocks");
}

#[test]
fn readme_begins_with_two_commands_and_the_whole_check_runs_both() {
    let first = blocks("README.md").swap_remove(0);
    let commands: Vec<&str> = first.text.lines().filter_map(|line| line.split("  #").next()).map(str::trim).collect();
    assert_eq!(commands, ["cargo run --release -- build configs/ntc.toml", "cargo test --workspace"]);
    let read = |name: &str| fs::read_to_string(root().join(name)).unwrap();
    let has = |name: &str, step: &str| read(name).lines().any(|line| line.starts_with(step));
    assert!(has(".ci/run", "source scripts/check.sh") && has("scripts/check.sh", "step cargo test --workspace"));
    assert!(has(".ci/run", "step cargo run --release -- build configs/ntc.toml "));
    // What `cargo run` runs from the root.
    assert!(has("Cargo.toml", "default-members = [\"crates/tiefort\"]"));
    assert!(root().join("configs/ntc.toml").exists());
}

/// Puts the keys of one table over those of another, section by section.
fn lay_over(job: &mut toml::Table, part: toml::Table) {
    for (name, section) in part {
        match (job.get_mut(&name), section) {
            (Some(toml::Value::Table(present)), toml::Value::Table(section)) => present.extend(section),
            (_, section) => drop(job.insert(name, section)),
        }
    }
}

#[test]
fn every_job_of_readme_and_book_is_read() {
    let scene = Scene::new();
    scene.run_to(0, &["sample", "--posts", "161", "--out", "dem.tif"]);
    scene.run_to(0, &["init", "dem.tif", "--out", "mine.toml"]);
    let mine = fs::read_to_string(scene.path("mine.toml")).unwrap();
    let (mut count, mut faults) = (0, Vec::new());
    for block in all_blocks("toml") {
        let place = format!("{}:{}", block.page, block.line);
        let mut job = block.text.clone();
        if block.remark == "part of a job" {
            let mut whole: toml::Table = mine.parse().unwrap();
            lay_over(&mut whole, block.text.parse().expect(&place));
            job = whole.to_string();
        }
        fs::write(scene.path("job.toml"), job).unwrap();
        let said = scene.run(&["plan", "job.toml"]);
        // The files that a part names are examples.
        let lacks_a_file = ["cannot be opened", "which no file matches", "which is not fetched"]
            .iter()
            .any(|words| said.stderr.contains(words));
        if said.code != Some(0) && !(block.remark == "part of a job" && lacks_a_file) {
            faults.push(format!("{place}: {}", said.stderr));
        }
        count += 1;
    }
    expect_none(&faults);
    assert!(5 < count, "{count} blocks");
}

/// Examples of `--help` that are not run, by what they begin with, and why.
const HELP_NOT_RUN: [(&str, &str); 8] = [
    ("tiefort fetch", "asks servers"),
    ("tiefort init n35w117.dt2", "needs DTED"),
    ("tiefort init dem/*.hgt", "needs HGT"),
    ("tiefort init dem.tif roads.osm.pbf", "needs OpenStreetMap data"),
    ("tiefort view", "runs until Ctrl-C"),
    ("tiefort serve", "runs until Ctrl-C"),
    ("curl", "asks a service"),
    ("tiefort worker", "the tests of builds run workers"),
];

/// The examples of all commands, each in one line, as a shell takes them: without the remarks behind them, with
/// folders of this test, and without the engines that would go on.
fn help_examples() -> Vec<String> {
    let text = fs::read_to_string(root().join("docs/reference/commands.md")).unwrap().replace("\\\n      ", "");
    let mut examples = Vec::new();
    for block in text.split("\nExamples:\n").skip(1) {
        let lines = block.lines().take_while(|line| line.starts_with("  "));
        examples.extend(lines.map(|line| {
            let command = line.trim().split("    ").next().unwrap();
            let command = command.split(" && ").next().unwrap().split("      ").next().unwrap();
            let remark = command.split(" on the raster of").next().unwrap();
            remark.replace("/share/", "share/").replace("/data/", "share/")
        }));
    }
    examples
}

/// Everything that examples of `--help` name: rasters, jobs and databases of 50 km, at posts 125 m apart.
fn scene_of_help() -> Scene {
    let scene = Scene::new();
    let tables = ["\n[tin]\nmethod = \"greedy\"\n", "[lod]\nlevels = [{ inner_share = 0.5 }, { inner_share = 0.2 }]\n"];
    for folder in ["bin", "configs", "share", ".zfunc", ".config/fish/completions"] {
        fs::create_dir_all(scene.path(folder)).unwrap();
    }
    fs::create_dir_all(scene.path(".local/share/bash-completion/completions")).unwrap();
    for (name, posts, spacing) in [("dem.tif", "301", "25"), ("large.tif", "1025", "25"), ("desert.tif", "401", "125")]
    {
        scene.run_to(0, &["sample", "--posts", posts, "--spacing", spacing, "--out", name]);
    }
    for (name, dem) in [("ntc", "source = \"sample\""), ("desert", "sources = [\"desert.tif\"]")] {
        let area = format!("name = \"{name}\"\ncrs = \"EPSG:32611\"\norigin_m = [505000, 3875000]");
        let job =
            format!("[area]\n{area}\nsize_m = [50000, 50000]\nspacing_m = 125\n[dem]\n{dem}\n{}", tables.concat());
        fs::write(scene.path(&format!("{name}.toml")), &job).unwrap();
        scene.run_to(0, &["build", &format!("{name}.toml"), "--quiet", "--no-html"]);
    }
    fs::copy(scene.path("ntc.toml"), scene.path("configs/ntc.toml")).unwrap();
    scene.run_to(0, &["init", "dem.tif", "--out", "mine.toml"]);
    fs::write(scene.path("surveyed.csv"), "east,north,height_m\n506000,3876000,1000\n").unwrap();
    fs::write(scene.path("grid.asc"), grid()).unwrap();
    // What output is handed to, jq and man, only reads it here.
    let script = "cp -r ntc.tdb before.tdb; cp -r ntc.tdb after.tdb; cp -r ntc.tdb share\n\
                  for name in jq man; do printf '#!/bin/sh\\ncat\\n' >bin/$name; chmod +x bin/$name; done";
    assert_eq!(fault_of(&scene, script, &[0], "copies"), None);
    scene
}

/// An Esri ASCII grid of 2 km a side.
fn grid() -> String {
    let head = "ncols 81\nnrows 81\nxllcenter 505000\nyllcenter 3875000\ncellsize 25\nnodata_value -9999\n";
    let row = |row: usize| (0..81).map(|col| crate::scene::hills(row, col) + " ").collect::<String>() + "\n";
    head.to_owned() + &(0..81).map(row).collect::<String>()
}

#[test]
fn every_example_of_help_runs() {
    let examples = help_examples();
    assert!(60 < examples.len(), "{examples:?}");
    let (scene, mut faults) = (scene_of_help(), Vec::new());
    for example in examples {
        if HELP_NOT_RUN.iter().any(|(start, _)| example.starts_with(start)) {
            continue;
        }
        let script = if example.contains("--window") { example.replace("dem.tif", "large.tif") } else { example };
        faults.extend(fault_of(&scene, &script, &[0, 1], "--help"));
    }
    expect_none(&faults);
}
