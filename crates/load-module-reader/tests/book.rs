//! The example of the book is the one that runs here.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

#[path = "../examples/follow.rs"]
mod follow;

/// The book, where the whole project is there and not this crate alone.
const PAGE: &str = "../../docs/guides/simulators.md";

#[test]
fn the_example_of_the_book_runs() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let example = fs::read_to_string(here.join("examples/follow.rs")).unwrap();
    match fs::read_to_string(here.join(PAGE)) {
        Ok(page) => {
            let block = page.split("```rust\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
            assert!(example.ends_with(&format!("\n\n{block}")), "examples/follow.rs is not the block of {PAGE}");
        }
        Err(_) => eprintln!("skipped: {PAGE} is not there"),
    }
    // The only test of this program, so that no other one minds where it runs.
    let folder = std::env::temp_dir().join(format!("load-module-reader-{}", std::process::id()));
    fs::create_dir_all(folder.join("mine.tdb")).unwrap();
    fs::copy(here.join("examples/worked/r00c00.slm"), folder.join("mine.tdb/r00c00.slm")).unwrap();
    std::env::set_current_dir(&folder).unwrap();
    follow::main().unwrap();
    fs::remove_dir_all(&folder).unwrap();
}
