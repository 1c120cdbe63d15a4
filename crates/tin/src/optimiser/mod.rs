//! Makes the TIN of a tile truer without making it larger.
//!
//! Selection alone leaves a TIN whose vertices stand on posts, at the DEM's height, joined as Delaunay would have it.
//! Freed from all three, the same number of triangles follows the ground with well under half the residual.
//! What carries it: (i) every vertex moves in x, y and height by Gauss-Newton steps on the true sum of squares, (ii)
//! the moments of the posts under any triangle come from prefix sums along rows, and (iii) the mesh is grown beyond
//! the budget first and thinned by what each vertex is truly worth. What decides in the end is topology: flips are
//! judged by what comes of them once their vertices have moved.
//!
//! ```
//! use terrain::{Dem, Effort, Features, HeightFit, Importance, Lattice, Post, PostRect, SeamSides, Tin, Vertex};
//! use tin::optimiser::{Budget, Task, optimise};
//!
//! // Heights are whole numbers of 1/128 m.
//! let rect = PostRect::of_size(65, 65);
//! let dem = Dem::from_fn(rect, |post| Some((post.row - 32) * (post.row - 32) + 2 * post.col * post.col));
//! // A mesh over every fourth post to begin with.
//! let posts: Vec<Post> = (0..17 * 17).map(|place| Post::new(place / 17 * 4, place % 17 * 4)).collect();
//! let vertices = posts.iter().map(|&post| Vertex { at: post.into(), height: dem.height(post) }).collect();
//! let start = Tin::new(rect, vertices, terrain::mesh::delaunay(&posts));
//!
//! let task = Task {
//!     held: Vec::new(),
//!     forbidden: Vec::new(),
//!     features: Features::default(),
//!     open: SeamSides::OPEN,
//!     line_step: None,
//!     budget: Budget::Triangles(200),
//!     in_squares: None,
//!     effort: Effort::Normal,
//!     height_fit: HeightFit::Squares,
//!     lattice: Lattice::Eighth,
//!     spacing: None,
//!     rms_quanta: None,
//!     largest_quanta: None,
//! };
//! let made = optimise(&dem, &Importance::uniform(rect, 1000), &start, &task);
//! assert!(made.tin.triangles.len() <= 200);
//! ```

mod task;
pub use task::{Budget, Task};
mod optimise;
pub use optimise::{Optimised, fill, optimise, weave_in};
mod recipe;
pub use recipe::overshoot;

mod account;
mod deep_flips;
mod deep_thinning;
mod descent;
mod flips;
mod form;
mod gains;
mod goals;
mod heights;
mod hold;
mod hole;
mod insertion;
mod lanes;
mod moments;
mod normal;
mod parts;
mod patch;
mod place;
mod queue;
mod refit;
mod removal;
mod renumber;
mod sweep;
mod thin;
mod tile_mesh;
mod undo;
mod weave;
mod weighted_heights;
mod work;

#[cfg(test)]
mod feature_cases;
#[cfg(test)]
mod feature_scene;
#[cfg(test)]
mod feature_tests;
#[cfg(test)]
mod scene;
#[cfg(test)]
mod step_tests;
#[cfg(test)]
mod tests;
