//! Job files read as people write them: what they become, what is wrong with them, and the pages made from the reader.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

mod canonical;
mod errors;
mod features;
mod files;
mod objects;
mod reference;
mod resolved;
