//! What people look at: meshes for viewers, breaches on a map, the report as text.
//!
//! Pure: values in, bytes or text out. Nothing here opens a file, reads a clock or asks what the terminal can do;
//! delete this crate and the load modules still come out the same.

// A test that unwraps says by its line what failed.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod mesh;
pub use mesh::{Coordinates, MeshPlace, write_obj, write_ply};
mod breaches;
pub use breaches::{BreachPlaces, breaches_geojson};
mod map;
pub use map::{heat, write_map};
mod table;
pub use table::{Align, Table, grouped};
mod report;
pub use report::{report_text, stage_table};

#[cfg(test)]
mod samples;
