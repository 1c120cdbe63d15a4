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

mod spec;
pub use spec::{GeoidSpec, LodSpec, NamedFile, ObjectSource, ObjectsSpec, Start, StartMethod, WaterSpec};
mod model;
pub use model::{
    Allocation, Area, Borders, Budget, ClipHeights, Count, DemSource, DemSpec, Edges, ErrorKey, Job, LimitsSpec,
    Method, MethodName, ModulesSpec, Optimising, OuterBorder, Proximity, Sight, SourceEntry, SourceFile, SourceSaid,
    TilesSpec, TinSpec, Voids, WindowLimit,
};
// What a stage takes as it is.
pub use features::Kind as FeatureKind;
pub use terrain::{Effort, HeightFit, LastBatch, Lattice, LodBorder, Resampling, Smooth, TileOrder};
mod importance;
pub use importance::{AreaShape, HOLE_CLASS_NAME, ImportanceArea, ImportanceSpec, SampleClass};
mod features_spec;
pub use features_spec::{FeatureSource, FeaturesSpec, HeightsFrom};
mod remote;
pub use remote::{check_address, is_remote, without_query};
mod fetched;
mod lock;
pub use lock::{Lock, Locked};
mod find;
pub use find::{AreaFound, AreaPlace, AreaRequest, FindArea, NoArea};
mod error;
pub use error::{Fault, JobError};
mod bounds;
mod choice;
pub use choice::{Choice, Cost, Word};
mod key;
pub use key::{Key, KeyTable, Usual, Values};
mod keys;
pub use keys::{key, key_tables, usual, usual_text};
mod entry;
mod feature_keys;
mod files;
mod load;
pub use load::place_of;
mod read;
mod sections;
mod setting_list;
pub use setting_list::Setting;
mod settings;
pub use settings::deciding_lines;
mod settings_features;
