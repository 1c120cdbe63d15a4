//! The TIN of one tile: which post comes next, and when to stop.
//!
//! Polis and McKeown, "Issues in iterative TIN generation to support large scale simulations" (AutoCarto
//! 11, 1993), section 2: insert the posts of largest weighted residual again and again. [`refine`] does
//! that for one tile and sees nothing but the tile's window; [`survey`] runs the same growth ahead to
//! learn what each triangle would gain.
//!
//! ```
//! use fearless_simd::Level;
//! use terrain::{Dem, Importance, PostRect, TileId};
//! use tin::{Rule, Stop, TileTask};
//!
//! // Heights are whole numbers of 1/128 m.
//! let rect = PostRect::of_size(65, 65);
//! let dem = Dem::from_fn(rect, |post| Some(post.row * post.row + 3 * post.row * post.col));
//! let stop = Stop { points: Some(200), ..Stop::default() };
//! let task = TileTask { stop, ..TileTask::plain(TileId { row: 0, col: 0 }, rect, Rule::WorstFirst) };
//!
//! let made = tin::refine(&dem, &Importance::uniform(rect, 1000), &task, Level::new());
//! assert_eq!(made.tin.vertices.len(), 4 + 200);
//! ```
//!
//! Everything generic over the lanes is inlined into the one dispatch around a tile's refinement: a function left
//! on its own would be compiled for the oldest processor and call each lane operation.

mod task;
pub use task::{Frame, Proximity, Rule, StartPost, Stop, TileTask};
mod refine;
pub use refine::refine;
mod sequence;
pub use sequence::prefix;
mod survey;
pub use survey::{CostUnit, SurveyTask, survey};

mod batch;
mod criterion;
mod growth;
mod queue;
mod start;
mod weighted_surface;

pub mod load_modules;
pub mod methods;
pub mod optimiser;
pub mod tiling;
