//! The order of the stages: what comes after what, and nothing else.
//!
//! [`build`] is the table of contents; every stage is a crate of its own below this one.

mod progress;
pub use progress::{Event, Progress, Stage};
mod error;
pub use error::CompileError;
mod run;
pub use run::{ALGORITHM_REVISION, Options};
mod build;
pub use build::{Built, build};
mod tile;
pub use tile::{Rebuilt, rebuild_tile};
mod plan;
pub use plan::{Forecast, Plan, PlannedTile, plan, simulate};
mod locate;
pub use locate::{Corner, corners, find_area};
mod look;
pub use look::{Seen, Suggestion, look_at};
mod verify;
pub use verify::{Status, Verdict, status, verify};
mod raster;
pub use raster::{Mesh, TinMethod, TinRequest, sample, tin};
mod compare;
pub use compare::{
    CompareEvent, CompareGround, CompareMethod, CompareRequest, CompareRow, Comparison, Equivalent, Forced, Impossible,
    Made, compare,
};
mod inadequate;
pub use inadequate::{Component, Inadequate, inadequate};
mod measures;
pub use fidelity::{LineOfSight, SlopeDifference};
pub use measures::{BuiltResidual, DatabaseFidelity, Measures, Sights, fidelity, measure};

mod area;
mod assemble;
mod bound;
mod enforce;
mod given;
mod ground;
mod publish;
mod refine;
mod refinement;
mod report;
mod sources;
mod survey;
mod tasks;
