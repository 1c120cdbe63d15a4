//! The words every crate speaks: posts, windows of heights, weights, TINs, load modules, limits.
//!
//! Plain values and their invariants. Files of tiles hold some as they are: their fields, in order, are a layout.
//! Coordinates: x east, y north, z up; row 0 is the southern edge; (row, column) is always in that order
//! and is also the order in which every tie is broken.

mod numbered;
mod post;
pub use post::{LATTICE_PER_POST, LatticePoint, Post, PostRect};
mod units;
pub use units::{DEGREE_M, GridFrame, Metres, QUANTA_PER_METRE, Spacing, metres_of_quanta, quanta_of_metres};
mod dem;
pub use dem::Dem;
mod importance;
pub use importance::{HOLE_CLASS, Importance, THOUSANDTHS};
mod tin;
pub use tin::{POINT_COST, Tin, TinFault, Vertex};
mod features;
pub use features::{FEATURE_STEPS_MAX, Features, SideSpan};
mod tile_features;
pub use tile_features::{FeatureSurface, SideSlope, SurfaceGround, TileFeatures, WayLine};
mod earthwork;
pub use earthwork::{Earthwork, OffCause, Role};
mod refined;
mod tile;
pub use refined::{GainCurve, GainRun, Refusal, RefusedBy, StopReason, TileTin};
pub use tile::{ModuleGrid, ModuleId, ModuleRect, SeamSides, Side, TileId};
mod decks;
pub use decks::check_decks;
mod module_line;
pub use module_line::LineTraits;
// Vertices, residuals, decks, lines, and what stands on the ground are the same values here and in a file.
pub use load_module_reader::{
    Canopy, Corner, Decks, Line as ModuleLine, LineForm, LineKind, LineStorey, ObjectKind, Objects, PRISMS_MAX, Prism,
    Residual as ModuleResidual, Vertex as ModuleVertex,
};
mod load_module;
pub use load_module::{LoadModule, ModuleCounts};
mod choices;
pub use choices::{Effort, HeightFit, LastBatch, Lattice, LodBorder, Resampling, Smooth, TileOrder};
mod materials;
pub use materials::{FEATURE_COLORS, MaterialName, OBJECT_MATERIALS, named_class_color};
mod draped;
pub use draped::{Draped, Flat};
mod bands;
pub use bands::{Bands, is_band};
mod each;
pub use each::{Each, gather, in_turn};

pub mod geometry;
pub mod limits;
pub mod mask;
pub mod mesh;
pub mod plans;
