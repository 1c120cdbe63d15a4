//! Job files: everything a run needs, read from TOML, checked, and held as plain data.
//!
//! ```text
//!   job.toml ─► toml (values with their places) ─► sections, one function each ─► files found on disk ─► Job
//!     Job ─► describe: every setting and its meaning
//!     Job ─► canonical_text: the same job, in the one way to write it
//! ```
//! A job is read whole before any work, and what is wrong with it is told with file, line, key, what was found, what
//! was expected, and a hint. A key that is not implemented yet is an error, never ignored.
//!
//! What is absent: no look at what a DEM or a mask holds (whether the area is covered is `source-files`' to say), no
//! arithmetic of limits beyond their ranges (whether they can be met is `plan`'s).
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod named_file;
pub use named_file::NamedFile;
mod model;
pub use model::{
    Allocation, Area, Borders, Budget, ClipHeights, Count, DemSource, DemSpec, Edges, Effort, ErrorKey, HeightFit, Job,
    LastBatch, Lattice, LimitsSpec, Method, ModulesSpec, Optimising, OuterBorder, Proximity, Resampling, SourceEntry,
    SourceFile, SourceSaid, TileOrder, TilesSpec, TinSpec, Voids, WindowLimit,
};
mod importance;
pub use importance::{AreaShape, HOLE_CLASS_NAME, ImportanceArea, ImportanceSpec, SampleClass, Smooth};
mod ground;
pub use ground::{GeoidSpec, WaterSpec};
mod lod;
pub use lod::{LodBorder, LodSpec};
mod given;
pub use given::{Start, StartMethod};
mod find;
pub use find::{AreaFound, AreaPlace, AreaRequest, FindArea, NoArea};
mod error;
pub use error::{Fault, JobError};
mod bounds;
mod entry;
mod files;
mod keys;
mod load;
mod read;
mod settings;
pub use settings::{Setting, deciding_lines};
