//! How true the ground is: residuals of load modules against the posts they own, exact.
//!
//! Each post of the area is owned by one load module and there by one triangle (south and west lines
//! inside; the far lines only on the area's northern and eastern border), so sums over load modules are sums
//! over the area. Voids are in no figure. Everything is whole quanta of 1/128 m until it is reported.
//!
//! And what matters to a tank: [`line_of_sight`] and [`slope`], of the load modules of an area or of a plain TIN.

mod tally;
pub use tally::{Residuals, Tally};
mod measure;
pub use measure::{Ground, each_residual, measure, residuals};
mod split;
pub use split::{Split, best_split};
mod source;
pub use source::{SourcePosts, residuals_at_source};
mod cells;
mod triangles;
pub use triangles::Triangles;
mod draw;
mod samples;
mod sight;
pub use sight::{EYE_M, LineOfSight, RANGE_M, line_of_sight};
mod slope;
pub use slope::{SlopeDifference, slope};

#[cfg(test)]
mod scene;
