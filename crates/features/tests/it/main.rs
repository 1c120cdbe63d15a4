//! All stages of features together, through the public functions only.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

mod networks;
mod whole;
