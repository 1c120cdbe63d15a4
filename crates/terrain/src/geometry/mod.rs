//! Exact questions about posts: left or right, inside a circle, under a triangle, across a line.
//!
//! Topology is decided in integers only; there is no epsilon. The triangle scan answers, for the posts
//! under a triangle, how far the DEM lies from its plane, in wrapping lanes that are proven exact. Only what measures
//! and shows looks triangles up by place in `f64`, in [`Cells`].

pub mod cut;
pub mod owned;
pub mod resample;

mod predicates;
pub(crate) use predicates::in_circle_canonical;
pub use predicates::{Canonical, in_circle, orient};
mod local;
pub use local::{LocalPost, LocalRect};
mod facet;
pub use facet::Facet;
mod spans;
pub use spans::{Span, Spans};
mod surface;
pub use surface::{Surface, WORKING_POSTS_MAX};
mod blocks;
pub use blocks::Blocks;
mod cells;
pub use cells::Cells;
mod scan;
pub use scan::{
    WIDENED_MAX, largest_numerator, locate, locate_all, rounded, squares_sum, visit_owned, visit_posts, widened,
};
mod lanes;
pub use lanes::{levels_available, widest_level};
mod bounds;
pub use bounds::{BEYOND_LEAST, height_bounds, height_bounds_in};
mod ridge;
pub use ridge::is_ridge_candidate;

/// How far along an edge its place nearest to another lies, from 0 to 1; both are seen from where the edge begins.
#[inline]
pub fn nearest_share([along_x, along_y]: [f64; 2], [x, y]: [f64; 2]) -> f64 {
    let squared = along_x * along_x + along_y * along_y;
    if squared == 0.0 { 0.0 } else { ((x * along_x + y * along_y) / squared).clamp(0.0, 1.0) }
}
