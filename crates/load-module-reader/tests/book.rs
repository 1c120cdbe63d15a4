//! The example of the book is the one that runs here.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

use std::path::Path;

#[allow(dead_code)]
#[path = "../examples/follow.rs"]
mod example;

/// The book, where the whole project is there and not this crate alone.
const PAGE: &str = "../../docs/guides/simulators.md";

#[test]
fn the_example_of_the_book_runs() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    match std::fs::read_to_string(here.join(PAGE)) {
        Ok(page) => {
            let block = page.split("```rust\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
            let is_here = include_str!("../examples/follow.rs").contains(block);
            assert!(is_here, "examples/follow.rs does not hold the block of {PAGE}");
        }
        Err(_) => eprintln!("skipped: {PAGE} is not there"),
    }
    example::follow(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/worked")).unwrap();
}
