//! What is written in documents of our formats, held against what is written.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

mod format;
mod reference;
