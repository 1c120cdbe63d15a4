//! Every way a job can be wrong, one by one, with the paragraph that is told.

mod features;
mod numbers;
mod sources;
mod together;
mod words;

use std::path::Path;

use job::{Job, JobError};

/// A sound job, one key a line so that each can be replaced.
const SOUND: &str = r#"[area]
name = "ntc"
crs = "EPSG:32611"
origin_m = [505000, 3875000]
size_m = [50000, 50000]
spacing_m = 25
[dem]
source = "sample"
[importance]
default = 8
[tiles]
rows = 6
[load_modules]
side_m = 500
[limits]
pool = 0
[tin]
method = "optimised"
"#;

fn told(error: &JobError) -> String {
    format!("{error} hint: {}", error.hint())
}

/// What is told of the job with `new` in the place of the line that begins with `old`: paragraph and hint.
#[track_caller]
fn told_of(old: &str, new: &str) -> String {
    let mut lines: Vec<&str> = SOUND.lines().collect();
    let at = lines.iter().position(|line| line.starts_with(old)).expect("a line to replace");
    lines[at] = new;
    told(&Job::from_text(&lines.join("\n"), Path::new("a/b.toml")).expect_err("this job is wrong"))
}

#[track_caller]
fn check(old: &str, new: &str, expected: &[&str]) {
    assert_eq!(told_of(old, new), expected.join(" "));
}

#[track_caller]
fn check_part(old: &str, new: &str, expected: &str) {
    let told = told_of(old, new);
    assert!(told.contains(expected), "{told}");
}

#[test]
fn the_job_that_the_others_spoil_is_sound() {
    Job::from_text(SOUND, Path::new("a/b.toml")).unwrap();
}
