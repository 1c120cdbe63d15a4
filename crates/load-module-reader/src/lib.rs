//! Reads our load-module files (`modules/r02c03.slm`), all the load modules of one tile each.
//!
//! Written for simulators: it depends on nothing else of this project, owns all it returns and never panics,
//! whatever the bytes. The layout is described field by field in `FORMAT.md`. Every section of a file carries
//! a checksum, every length and offset has exactly one right value, and what the sections hold is checked too:
//! what [`SlmFile::parse`] returns is sound, and anything else is a [`ReadError`].
//!
//! ```no_run
//! # fn main() -> Result<(), load_module_reader::ReadError> {
//! let file = load_module_reader::SlmFile::open("ntc.tdb/modules/r00c00.slm")?;
//! if let Some(module) = file.module(3, 5) {
//!     let [east_m, north_m] = file.header().module_origin_m(3, 5);
//!     println!("{} triangles at {east_m} {north_m}", module.triangles.len());
//! }
//! # Ok(())
//! # }
//! ```

// A test that unwraps says by its line what failed.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod error;
pub use error::{ReadError, Section};
mod bytes;
mod header;
pub use header::{FIXED_HEADER_BYTES, Header, LEVEL_COUNT, MAGIC, QUANTA_PER_METRE, VERSION};
mod index;
pub use index::{INDEX_ENTRY_BYTES, IndexEntry};
mod module;
pub use module::{FIXED_MODULE_BYTES, Module, Residual, Vertex};
mod file;
pub use file::{FILE_BYTES_MAX, SlmFile};

#[cfg(test)]
mod sample;
