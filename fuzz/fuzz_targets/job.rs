//! Job files: a job or an error with its line, and a job that is told in full reads back as the same job.
#![no_main]

use std::path::Path;

use job::Job;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let Ok(job) = Job::from_text(text, Path::new("fuzz.toml")) else { return };
    let canonical = job.canonical_text();
    let again = Job::from_text(&canonical, Path::new("fuzz.toml"));
    let again = again.unwrap_or_else(|error| panic!("what was told in full is refused: {error}\n{canonical}"));
    assert_eq!(again.canonical_text(), canonical);
});
