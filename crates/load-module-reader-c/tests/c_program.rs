//! A program in C, compiled against the header and linked with the static library, asks everything there is to ask.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::process::Command;

/// The worked example of `FORMAT.md`, byte by byte.
fn worked_example() -> Vec<u8> {
    let text = include_str!("../../../FORMAT.md");
    let hex = text.split("```hex").nth(1).unwrap().split("```").next().unwrap();
    let lines = hex.lines().filter_map(|line| line.split('|').next());
    // The first number of a line is its offset.
    lines.flat_map(|line| line.split_whitespace().skip(1)).map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

/// The static library of this crate, newest first: it lies beside the tests, or one folder up.
fn library() -> PathBuf {
    let exe = std::env::current_exe().unwrap();
    let deps = exe.parent().unwrap();
    let ours = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        name.starts_with("libload_module_reader_c") && name.ends_with(".a")
    };
    let entries = [deps, deps.parent().unwrap()].into_iter().flat_map(|dir| std::fs::read_dir(dir).unwrap());
    let found = entries.map(|entry| entry.unwrap().path()).filter(ours);
    found.max_by_key(|path| path.metadata().unwrap().modified().unwrap()).expect("cargo has built the static library")
}

#[test]
fn a_program_in_c_gets_right_answers() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("modules")).unwrap();
    std::fs::write(folder.path().join("modules/r00c00.slm"), worked_example()).unwrap();
    let program = folder.path().join("drive");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let compiled = Command::new(compiler)
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I"])
        .arg(here.join("include"))
        .arg(here.join("tests/drive.c"))
        .arg(library())
        .args(["-lpthread", "-ldl", "-lm", "-o"])
        .arg(&program)
        .output()
        .unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let ran = Command::new(&program).arg(folder.path()).output().unwrap();
    let said = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.status.success() && said == "0 faults\n", "{said}{}", String::from_utf8_lossy(&ran.stderr));
}
