//! Triangulations: an array kernel that grows a mesh post by post, and the Delaunay triangulation of a
//! given point set.
//!
//! Topology is decided by exact integers with canonical ties, so a mesh is a function of its set of posts,
//! never of the order in which they came.

mod kernel;
pub use kernel::{EdgeRef, Mesh, NO_TWIN, Triangle};
mod lines;
pub use lines::Lines;
mod delaunay;
pub use delaunay::delaunay;
mod constrained;
pub use constrained::constrained_delaunay;
