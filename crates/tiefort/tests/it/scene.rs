//! A folder of its own for each test, the program in it, and what every refusal has in common.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

/// Where the jobs of tests lie.
const JOBS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/jobs");

/// An empty folder in which the program runs.
pub struct Scene {
    folder: TempDir,
}

/// What the program said, as text.
pub struct Said {
    pub code: Option<i32>,
    pub stdout: String,
    /// With every message in one line.
    pub stderr: String,
    /// As it was printed.
    pub printed: String,
}

impl Scene {
    /// A folder with `small.tdb`: 8 x 8 load modules in 2 x 2 tiles of the sample terrain.
    pub fn built() -> Self {
        let scene = Self::with_job("small.toml", &[]);
        scene.run_to(0, &["build", "job.toml", "--quiet"]);
        scene
    }

    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// A folder with `tests/jobs/NAME` in it as `job.toml`, `from` replaced by `to`.
    #[track_caller]
    pub fn with_job(name: &str, changes: &[(&str, &str)]) -> Self {
        let scene = Self::new();
        let mut text = fs::read_to_string(Path::new(JOBS).join(name)).unwrap();
        for (from, to) in changes {
            assert!(text.contains(from), "{name} does not hold {from:?}");
            text = text.replacen(from, to, 1);
        }
        fs::write(scene.path("job.toml"), text).unwrap();
        scene
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The program, ready to run here.
    pub fn program(&self) -> std::process::Command {
        let mut program = std::process::Command::new(env!("CARGO_BIN_EXE_tiefort"));
        program.current_dir(self.folder.path()).env_remove("RUST_BACKTRACE");
        program
    }

    pub fn run(&self, arguments: &[&str]) -> Said {
        Said::from(self.program().args(arguments).output().unwrap())
    }

    /// Runs what must end with this exit code.
    #[track_caller]
    pub fn run_to(&self, code: i32, arguments: &[&str]) -> Said {
        let said = self.run(arguments);
        assert_eq!(said.code, Some(code), "{arguments:?}: {}{}", said.stdout, said.stderr);
        said
    }

    /// Every file and folder below, with the content of files.
    pub fn everything(&self) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
        everything_below(self.folder.path())
    }

    /// Runs what must be refused: exit code 2, an error of one paragraph that holds all of `parts`, a hint, and
    /// nothing written.
    #[track_caller]
    pub fn refuses(&self, arguments: &[&str], parts: &[&str]) {
        let before = self.everything();
        let said = self.run_to(2, arguments);
        said.check_error(parts);
        let after = self.everything();
        let new: Vec<_> = after.keys().filter(|path| !before.contains_key(*path)).collect();
        assert!(new.is_empty(), "{arguments:?} was refused and yet left {new:?}");
        assert!(before == after, "{arguments:?} was refused and yet changed a file");
    }
}

/// Sends a signal to a process, by the shell: a program for it is not everywhere.
#[track_caller]
pub fn send(signal: &str, process: u32) {
    let sent = Command::new("sh").args(["-c", &format!("kill {signal} {process}")]).status().unwrap();
    assert!(sent.success(), "kill {signal} {process}");
}

pub fn everything_below(folder: &Path) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path.clone());
                found.insert(path, None);
            } else {
                let bytes = fs::read(&path).unwrap();
                found.insert(path, Some(bytes));
            }
        }
    }
    found
}

impl Said {
    pub fn from(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).expect("the program speaks UTF-8");
        let printed = text(output.stderr);
        // A line that was broken goes on two columns to the right.
        Self { code: output.status.code(), stdout: text(output.stdout), stderr: printed.replace("\n  ", " "), printed }
    }

    /// The error is one paragraph with all of `parts`, then a hint, and no trace of Rust.
    #[track_caller]
    pub fn check_error(&self, parts: &[&str]) {
        let Self { stdout, stderr, .. } = self;
        assert!(stdout.is_empty(), "data before an error: {stdout}");
        let errors: Vec<&str> = stderr.lines().filter_map(|line| line.strip_prefix("error: ")).collect();
        assert_eq!(errors.len(), 1, "expected one error in: {stderr}");
        for part in parts {
            assert!(errors[0].contains(part), "the error does not name {part:?}: {}", errors[0]);
        }
        let hints = stderr.lines().filter(|line| line.strip_prefix("hint: ").is_some_and(|hint| 8 < hint.len()));
        assert_eq!(hints.count(), 1, "expected a hint in: {stderr}");
        for rust in ["panicked", "RUST_BACKTRACE", "Err(", "Error {", "Some(", "unwrap"] {
            assert!(!stderr.contains(rust), "found {rust:?} in: {stderr}");
        }
    }
}

/// Height of a post of hilly ground, in metres, as a text grid has it.
pub fn hills(row: usize, col: usize) -> String {
    format!("{}", 700 + (row * row + 3 * col * row) % 97)
}
