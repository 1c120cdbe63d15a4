//! The whole program from outside: its words, its exit codes, its files.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

mod bad_input;
mod bad_jobs;
mod builds;
mod columns;
mod comparing;
mod correlating;
mod documents;
mod exports;
mod exports_together;
mod features;
#[cfg(feature = "fetch")]
mod fetch;
mod foreseen;
mod full_disk;
mod help;
mod hints;
#[cfg(feature = "viewer")]
mod imagery;
mod large_area;
mod measures;
mod meshes;
mod odd_files;
mod outlook;
#[cfg(unix)]
mod paths;
mod raster;
#[cfg(feature = "fetch")]
mod remote;
mod roads_and_water;
mod scene;
#[cfg(feature = "serve")]
mod serve;
#[cfg(feature = "serve")]
mod server;
mod shared;
mod sight;
mod starts;
mod streams;
mod view;
mod views;
