//! The order of the stages: what comes after what, and nothing else.
//!
//! [`build`] is the table of contents; every stage is a crate of its own below this one.

mod progress;
pub use progress::{Event, Progress, Stage};
mod clock;
pub use clock::Stopwatch;
/// What time it is.
pub use engine::Clock;
mod error;
pub use error::CompileError;
mod run;
pub use run::{ALGORITHM_REVISION, Options, run_name};
mod cause;
mod keys;
pub use keys::{modules as modules_key, rules};
mod build;
pub use build::{Built, build};
mod tile;
pub use tile::{Rebuilt, rebuild_tile};
mod order;
pub use order::{ORDER, Unit, is_of_tiles, needs, units};
mod unit;
pub use unit::{UnitEnd, perform};
mod worker;
pub use worker::{Sharing, WorkerEnd, work};
mod plan;
pub use plan::{Plan, plan};
mod foresee;
pub use foresee::foresee;
mod foresee_features;
pub use foresee_features::{FeaturesForeseen, foresee_features};
mod forecast;
pub use forecast::{Forecast, PAGE_MODULES_MAX, PAGE_POSTS_MAX, StageSeconds};
mod played;
pub use played::{Costs, Played, TileCosts, play};
mod level;
mod levels;
mod pieces;
mod profile;
mod read_features;

mod assemble;
mod assembled;
mod bound;
mod coarse;
mod curves;
mod enforce;
mod enter;
mod measured;
pub use measured::sums_of;
mod publish;
pub use publish::database_area;
mod refine;
mod refinement;
mod refused;
pub use refinement::{Most, Refinement};
mod report;
pub use report::residual_of;
mod strips;
mod sums;
pub use sums::{Adding, Sums};
mod survey;
mod tasks;
pub use tasks::{TileBudget, inherited, is_surveyed, posts_of, tile_refinement};
mod tins;
mod without_limits;
