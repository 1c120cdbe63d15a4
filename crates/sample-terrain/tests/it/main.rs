//! What the sample terrain promises.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

mod features;
mod ground;
