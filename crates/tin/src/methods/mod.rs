//! Other ways to choose points, as the literature has them, to compare the iterative method with and to start it from.
//!
//! ```text
//!   vip             posts ranked by how far they stand out            Chen and Guevara 1987
//!   highlow         peaks and pits
//!   lattice_tin     a coarse grid, refined where it fails             ARC/INFO's LATTICETIN
//!   fowler_little   ridges and channels first, then worst posts       Fowler and Little 1979
//!   hierarchical    triangles split into three, nothing flipped       De Floriani and others 1984
//!   earlier         one post per region of residuals, greedy edges    Polis and McKeown 1992
//!   regular_grid    the same step everywhere                          SIMNET
//!   contour_tin     contour lines as edges
//! ```
//! One function each: a window of the DEM and a target in, a TIN out. Vertices stand on posts at the DEM's height, in
//! the order in which they were chosen where there is one; equals go by row, then column.

mod dem_window;
pub use dem_window::{DemWindow, Impossible, TOLERANCE_M};
mod growing;
mod vip;
pub use vip::{Boundary, Distance, vip};
mod highlow;
pub use highlow::{Extrema, highlow};
mod lattice_tin;
pub use lattice_tin::{LatticeTin, lattice_tin};
mod fowler_little;
mod polyline;
pub use fowler_little::{FowlerLittle, fowler_little};
mod hierarchical;
pub use hierarchical::{Hierarchy, Splitting, hierarchical};
mod earlier;
pub use earlier::earlier;
mod regular_grid;
pub use regular_grid::{Diagonal, regular_grid, step_of_points, step_of_spacing};
mod contour;
pub use contour::{Contours, contour_tin};
mod squares;
pub use squares::running_squares;

#[cfg(test)]
mod scene;
