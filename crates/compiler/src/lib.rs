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
mod measures;
pub use fidelity::{
    Cover, Distances, Drainage, GRADES, Hausdorff, LineOfSight, Measures, MeshForm, Registration, ResidualFigures,
    SeamVisibility, SlopeClasses, SlopeDifference,
};
pub use measures::{BuiltResidual, DatabaseFidelity, Fidelity, Sights, fidelity, measure};

mod area;
mod assemble;
mod bound;
mod coarse;
mod enforce;
mod ground;
mod publish;
mod refine;
mod refinement;
mod report;
mod sources;
mod survey;
mod tasks;
mod without_limits;
