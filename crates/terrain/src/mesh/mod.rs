//! Triangulations: an array kernel that grows a mesh post by post, and the Delaunay triangulation of a
//! given point set.
//!
//! Topology is decided by exact integers with canonical ties, so a mesh is a function of its set of posts,
//! never of the order in which they came.
//!
//! ```
//! use terrain::{Post, mesh};
//!
//! let corners = [Post::new(0, 0), Post::new(0, 4), Post::new(4, 0), Post::new(4, 4)];
//! let triangles = mesh::delaunay(&corners);
//! // Of two diagonals the one through the smallest post is taken, in whatever order the posts come.
//! assert_eq!(triangles, [[0, 1, 3], [0, 3, 2]]);
//! ```

mod kernel;
pub use kernel::{EdgeRef, Lines, Mesh, Triangle};
mod delaunay;
pub use delaunay::{constrained_delaunay, delaunay};
