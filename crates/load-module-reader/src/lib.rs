//! Reads our load-module files (`modules/r02c03.slm`) and answers what a simulator asks of the ground.
//!
//! Written for simulators: it depends on nothing else of this project, owns all it returns and never panics,
//! whatever the bytes. The layout is described field by field in `docs/FORMAT.md`. Every section of a file carries
//! a checksum, every length and offset has exactly one right value, and what the sections hold is checked too:
//! what is returned is sound, and anything else is a [`ReadError`].
//!
//! [`Area`] reads only the headers of all files of a database. [`Area::load`] brings a [`Block`] of load modules into
//! memory as [`LoadedGround`], and [`LoadedGround::moved`] follows the observer and reads only
//! what is new.
//! Decks of bridges hang above the ground: [`LoadedGround::height_m`] is that of the ground,
//! [`LoadedGround::height_below_m`] that of the topmost of ground and decks not above a ceiling, for vehicles that
//! drive over a bridge and under it. [`Module::lines`] are the middle lines of roads, rails, rivers and streams, those
//! that are left out of the ground too.
//! A query takes constant expected time. [`SlmFile`] is the plain way to read one whole file.
//! Where load modules have several levels of detail, all of this is about the finest, and [`Area::load_level`] brings
//! in another.
//!
//! ```
//! use load_module_reader::{Area, Keep, Sight};
//!
//! # fn main() -> Result<(), load_module_reader::ReadError> {
//! # let database = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/worked");
//! # /*
//! let database = "ntc.tdb";
//! # */
//! let area = Area::open(database, Keep::OnDisk)?;
//! let mut tank = [505_125.0, 3_875_310.5];
//!
//! // 15 x 15 load modules around the tank: a view of 3.5 km and more in every direction.
//! let mut ground = area.load(area.block_around(tank, 7))?;
//!
//! for _ in 0..1000 {
//!     tank[0] += 12.0;
//!     let block = area.block_around(tank, 7);
//!     if block != ground.block() {
//!         // A row or a column of load modules is read, the others are kept.
//!         ground = ground.moved(&area, block)?;
//!     }
//!     let Some(under) = ground.sample(tank) else { break };
//!     let [east, north, up] = under.normal;
//!     println!("{:.2} m, class {}, facing {east:.2} {north:.2} {up:.2}", under.height_m, under.class);
//!
//!     let gun = [tank[0], tank[1], under.height_m + 2.5];
//!     let target = [tank[0] + 1500.0, tank[1] + 400.0];
//!     let Some(height_m) = ground.height_m(target) else { continue };
//!     match ground.sight(gun, [target[0], target[1], height_m + 2.5]) {
//!         Sight::Free => println!("seen"),
//!         Sight::Hidden(share) => println!("hidden by the ground {:.0} % of the way", share * 100.0),
//!         Sight::Unknown => println!("not loaded that far"),
//!     }
//! }
//!
//! // For drawing: vertices and triangles of every load module in view.
//! for module in ground.modules() {
//!     let module = module.module();
//!     println!("{},{}: {} triangles", module.row, module.col, module.triangles.len());
//! }
//! # Ok(())
//! # }
//! ```
//!
//! Files may also be mapped into memory: give [`TileFile::of_bytes`] a map of your own, for which this crate, being
//! free of `unsafe`, has no code; `load-module-reader-c` does that.

// A test that unwraps says by its line what failed.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod format;
pub use format::{
    CANOPY_BYTES, DECK_ENTRY_BYTES, FILE_BYTES_MAX, FIXED_DECKS_BYTES, FIXED_DECKS_PART_BYTES, FIXED_HEADER_BYTES,
    FIXED_LINES_BYTES, FIXED_MODULE_BYTES, FIXED_OBJECTS_BYTES, FIXED_TABLE_BYTES, HOLE_CLASS, INDEX_ENTRY_BYTES,
    LEVELS_MAX, LINE_BYTES, MAGIC, PART_DECKS, PART_LINES, PART_OBJECTS, PARTS_ENTRY_BYTES, PRISM_BYTES,
    QUANTA_PER_METRE, TABLE_ENTRY_BYTES, VERSION, VERSION_OF_GROUND, VERSION_WITH_DECKS,
};
mod error;
pub use error::{ReadError, Section};
mod bytes;
mod header;
mod horizon;
pub use header::Header;
mod vertex;
pub use vertex::Vertex;
mod index;
pub use index::{DecksEntry, IndexEntry};
mod decks;
pub use decks::Decks;
mod lines;
pub use lines::{Line, LineForm, LineKind, LineStorey};
mod objects;
pub use objects::{Canopy, Corner, ObjectKind, Objects, PRISMS_MAX, Prism};
mod module;
mod parts;
pub use module::{Module, Residual};
mod tile_file;
pub use tile_file::{Bytes, Keep, TileFile, open_file};
mod file;
pub use file::SlmFile;
mod lookup;
mod terrain_module;
pub use terrain_module::{Sample, TerrainModule};
mod frame;
pub use frame::{AreaFrame, Block};
mod loaded_ground;
mod obstacle;
mod past;
mod sight;
pub use loaded_ground::{LoadedGround, Sight};
pub use obstacle::{Obstacle, Top};
pub use past::{Hider, PastObjects, Sighting, Standing};
pub use sight::Curvature;
mod eye;
pub use eye::Eye;
mod viewshed;
pub use viewshed::{HIDDEN, Look, NOT_LOOKED_AT, SEEN, Viewshed};
mod profile;
pub use profile::ProfilePoint;
mod area;
pub use area::Area;

#[cfg(test)]
mod sample;
#[cfg(test)]
mod tests;
