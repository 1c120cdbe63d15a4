//! Meshes without a job: from a raster alone, at several levels, and one method beside another; and a first look at
//! rasters, which suggests a job.

mod mesh;
pub use mesh::{Mesh, tin, tin_of_raster};
mod request;
pub use request::{TinMethod, TinRequest, TinStart};
mod tin_levels;
pub use tin_levels::tin_levels;
mod compare;
pub use compare::{
    CompareEvent, CompareGround, CompareMethod, CompareRequest, CompareRow, Comparison, Equivalent, Forced, HeldGround,
    Impossible, Made, compare,
};
mod look;
pub use look::{Seen, Suggestion, look_at};
mod vectors;
pub use source_files::is_feature_file;
pub use vectors::{SeenFeatures, look_at_features};
mod sample;
pub use sample::Sample;
mod surface;
pub use surface::{PostHeights, SurfaceRaster, is_same_datum};

mod heights;
mod outlook;
mod suiting;
mod tally;
mod tiles;
