//! The order of the stages: what comes after what, and nothing else.
//!
//! [`build`] is the table of contents; every stage is a crate of its own below this one.

mod progress;
pub use progress::{Event, Progress, Stage};
mod clock;
pub use clock::Stopwatch;
/// What time it is.
pub use store::engine::Clock;
mod error;
pub use error::CompileError;
mod run;
pub use run::{ALGORITHM_REVISION, Options, run_name};
mod keys;
pub use keys::{kept_features, modules as modules_key, rules};
mod build;
pub use build::{Built, build};
mod tile;
pub use tile::{Rebuilt, rebuild_tile};
mod outlines;
pub use outlines::{OBJECT_BUDGETS, ObjectBudget, ObjectBudgets};
mod tile_objects;
pub use tile_objects::TileObjects;
mod order;
pub use order::{ORDER, Unit, is_of_tiles, needs, units};
mod unit;
pub use unit::{UnitEnd, perform};
mod forecast;
mod worker;
pub use forecast::{Forecast, PAGE_MODULES_MAX, PAGE_POSTS_MAX, Plan, StageSeconds, plan};
pub use worker::{Sharing, WorkerEnd, work};
mod foresee;
pub use foresee::{FeaturesForeseen, foresee, foresee_features};
mod budgets;
mod chains;
mod earthworks;
pub use budgets::{BUDGETS, Budgeted, Budgets, limits_of};
mod played;
pub use played::{Costs, Played, TileCosts, play};
mod left_out;
mod level;
pub use left_out::LeftOut;
pub use level::level_fingerprint;
mod levels;
mod pieces;
mod profile;
mod read_features;

mod assemble;
mod bound;
mod curves;
mod enforce;
pub use assemble::sums_of;
mod publish;
pub use publish::database_area;
mod refine;
mod refinement;
pub use refinement::{Most, Refinement};
mod report;
pub use report::{limit_of, residual_of};
mod strips;
mod sums;
pub use sums::{Adding, Sums};
mod survey;
mod tasks;
pub use tasks::{inherited, is_surveyed, posts_of, tile_refinement};

pub mod ground;
pub mod product;
pub mod workbench;
