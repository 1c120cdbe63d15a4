//! A disk that is too small, or read-only: the error says so, nothing half-written stays, and with room the same
//! command goes on.

use std::process::Command;

use crate::scene::{Said, Scene};

/// Builds into a file system of its own that holds 96 kB, then lists what is there.
const SMALL_DISK: &str = "
mkdir disk && mount -t tmpfs -o size=96k tmpfs disk || exit 99
\"$0\" build job.toml --out disk/x.tdb --force
code=$?
find disk -name '.*' -type f >&2
exit $code";

/// Asks, on a file system of its own that holds 96 kB, whether a build that takes more is begun.
const BEFORE_A_BUILD: &str = "
mkdir disk && mount -t tmpfs -o size=96k tmpfs disk || exit 99
cp job.toml disk && cd disk || exit 99
for words in 'plan job.toml' 'build job.toml' 'build job.toml --fresh --out a/b.tdb'; do
  \"$0\" $words >&2
  echo \"$words: $?\"
done
\"$0\" plan job.toml --force >&2
echo \"plan --force: $?\"
ls";

/// Builds, and asks for the same on a disk that has become full, and for a second database there.
const AGAIN: &str = "
mkdir disk && mount -t tmpfs -o size=16m tmpfs disk || exit 99
cp job.toml disk && cd disk && \"$0\" build job.toml --out x.tdb --quiet >&2 || exit 98
cat /dev/zero > rest 2>/dev/null
for words in 'build job.toml --out x.tdb' 'plan job.toml --out x.tdb' 'build job.toml --out y.tdb'; do
  \"$0\" $words >/dev/null
  echo \"$words: $?\"
done
exit 0";

/// Asks on a disk that is read-only for files in the folder of a database, and in another one.
const READ_ONLY: &str = "
\"$0\" build job.toml --out x.tdb --quiet >&2 || exit 98
mkdir disk && mount --bind . disk && mount -o remount,bind,ro disk || exit 99
\"$0\" inadequate disk/x.tdb
echo $?
\"$0\" inadequate disk/x.tdb --out maps >/dev/null
echo $?
exit 0";

/// Builds where no file may grow beyond 1 kB (two blocks of 512 bytes).
const SHORT_FILES: &str = "trap '' XFSZ; ulimit -f 2; exec \"$0\" build job.toml --out x.tdb";

#[test]
fn a_disk_that_is_too_small_is_named_and_nothing_half_written_stays() {
    let scene = Scene::with_job("small.toml", &[("spacing_m = 25", "spacing_m = 12.5")]);
    let mut shell = Command::new("unshare");
    shell.args(["--map-root-user", "--mount", "sh", "-c", SMALL_DISK, env!("CARGO_BIN_EXE_tiefort")]);
    let output = match shell.current_dir(scene.path("")).output() {
        Ok(output) if output.status.code() == Some(2) => output,
        other => {
            eprintln!("skipped: no small file system can be mounted here: {other:?}");
            return;
        }
    };
    let said = Said::from(output);
    said.check_error(&["disk/x.tdb", "no space left"]);
    assert!(!said.stderr.contains("disk/x.tdb/."), "a temporary file was left: {}", said.stderr);
}

/// What a script says on a file system of its own; nothing where none can be mounted.
fn mounted(scene: &Scene, script: &str) -> Option<Said> {
    let mut shell = Command::new("unshare");
    shell.args(["--map-root-user", "--mount", "sh", "-c", script, env!("CARGO_BIN_EXE_tiefort")]);
    match shell.current_dir(scene.path("")).output() {
        Ok(output) if output.status.code() == Some(0) => Some(Said::from(output)),
        other => {
            eprintln!("skipped: no file system can be mounted here: {other:?}");
            None
        }
    }
}

#[test]
fn a_database_that_is_there_takes_no_more_disk_to_build_again() {
    let Some(said) = mounted(&Scene::with_job("small.toml", &[]), AGAIN) else { return };
    let lines: Vec<&str> = said.stdout.lines().collect();
    let expected = ["build job.toml --out x.tdb: 0", "plan job.toml --out x.tdb: 0", "build job.toml --out y.tdb: 2"];
    assert_eq!(lines, expected, "{}", said.stderr);
}

#[test]
fn what_is_looked_for_in_a_read_only_database_goes_into_another_folder() {
    let Some(said) = mounted(&Scene::with_job("small.toml", &[]), READ_ONLY) else { return };
    assert_eq!(said.stdout, "2\n0\n", "{}", said.stderr);
    assert!(said.stderr.contains("--out DIR"), "{}", said.stderr);
}

#[test]
fn a_build_that_is_forecast_not_to_fit_is_refused_before_anything_is_written_unless_forced() {
    let scene = Scene::with_job("small.toml", &[("spacing_m = 25", "spacing_m = 12.5")]);
    let Some(said) = mounted(&scene, BEFORE_A_BUILD) else { return };
    let lines: Vec<&str> = said.stdout.lines().collect();
    let expected = [
        "plan job.toml: 2",
        "build job.toml: 2",
        "build job.toml --fresh --out a/b.tdb: 2",
        "plan --force: 0",
        "job.toml",
    ];
    assert_eq!(lines, expected, "{}", said.stderr);
    for part in ["error: disk of a/b.tdb: ", " free, expected the ", "--force tries all the same"] {
        assert!(said.stderr.contains(part), "{part:?} is not in: {}", said.stderr);
    }
}

#[cfg(unix)]
#[test]
fn a_file_that_cannot_be_written_whole_is_named_and_the_build_goes_on_when_it_can() {
    let scene = Scene::with_job("small.toml", &[]);
    let mut shell = Command::new("sh");
    shell.args(["-c", SHORT_FILES, env!("CARGO_BIN_EXE_tiefort")]).current_dir(scene.path(""));
    let said = Said::from(shell.output().unwrap());
    assert_eq!(said.code, Some(2), "{}", said.stderr);
    let errors: Vec<&str> = said.stderr.lines().filter(|line| line.starts_with("error: ")).collect();
    assert_eq!(errors.len(), 1, "{}", said.stderr);
    assert!(errors[0].contains("x.tdb"), "{}", errors[0]);
    let hidden = |path: &std::path::PathBuf| path.file_name().unwrap().to_string_lossy().starts_with('.');
    let left: Vec<_> = scene.everything().into_keys().filter(hidden).collect();
    assert!(left.is_empty(), "half-written files were left: {left:?}");
    scene.run_to(0, &["build", "job.toml", "--out", "x.tdb"]);
    scene.run_to(0, &["verify", "x.tdb"]);
}
