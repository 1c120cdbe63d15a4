//! The whole compiler on small jobs, through the library: same bytes, sound load modules, runs that are stopped,
//! damaged, repeated in part, or stand on difficult ground.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

mod scene;

mod findings;
mod modes;
mod product;
mod surface;

mod bytes;
mod changed;
mod compare;
mod damage;
mod difficult_ground;
mod distance;
mod ends;
mod features;
mod forger;
mod given;
mod golden;
mod idle_importance;
mod incremental;
mod levels;
mod measures;
mod one_tile_again;
mod published;
mod random_jobs;
mod read_back;
mod real_ground;
mod shared;
mod simulated;
mod soundness;
mod stopped;
mod told_features;
mod water_and_holes;
mod window_figures;
