//! How true the ground is: residuals of load modules against the posts they own, exact.
//!
//! Each post of the area is owned by one load module and there by one triangle (south and west lines
//! inside; the far lines only on the area's northern and eastern border), so sums over load modules are sums
//! over the area. Voids are in no figure. Everything is whole quanta of 1/128 m until it is reported.
//!
//! And what matters to a tank, of the load modules of an area or of a plain TIN: what is seen, how steep it is, where
//! there is cover, where water runs, how far the surfaces lie apart, and what the mesh is like. [`DemGround::measure`]
//! takes all of these at once; [`regular_grid`] is what a TIN is held against.
//!
//! ```
//! use fidelity::{DemGround, Triangles, regular_grid};
//! use terrain::{Dem, Metres, PostRect};
//!
//! // Heights are whole numbers of 1/128 m.
//! let rect = PostRect::of_size(201, 201);
//! let dem = Dem::from_fn(rect, |post| Some((post.row - 100) * (post.row - 100) + post.row * post.col));
//! let grid = regular_grid(&dem, rect, 3200);
//!
//! let ground = DemGround::new(&dem, rect, Metres(25.0));
//! let measures = ground.measure(&Triangles::of_tin(&grid.tin), 1000, 1, None);
//! println!("{:.2} m; {:?}", measures.residual.rms_m, measures.line_of_sight);
//! assert!(measures.residual.rms_m < 1.0);
//! ```

mod tally;
pub use tally::{Histogram, Residuals, Sums, Tally};
mod measure;
pub use measure::{Reference, each_residual, measure, residuals};
mod split;
pub use split::{Split, best_split};
mod source;
pub use source::{PushRow, SourcePosts, residuals_at_source};
mod buildings;
pub use buildings::metres_in_buildings;
mod decks;
pub use decks::DeckFigures;
mod places;
pub use places::residuals_at_places;
mod triangles;
pub use triangles::Triangles;
mod posts;
pub use posts::{PostHeights, residuals_at_posts, residuals_by_class};
mod sight;
pub use sight::{Draw, EYE_M, LineOfSight, Pair, RANGE_M, drawn_pairs, line_of_sight, sees_on};
mod slope;
pub use slope::{GRADES, SlopeClasses, SlopeDifference, slope, slope_classes};
mod hausdorff;
mod nearest;
pub use hausdorff::{Distances, Hausdorff, hausdorff};
mod drainage;
mod flood;
pub use drainage::{CHANNEL_POSTS, Drainage, PIT_M, Streams, drainage};
mod cover;
pub use cover::{COVER_RANGE_M, Cover, DEFILADE_M, Defilade, cover};
mod edges;
mod seam;
pub use seam::{SeamVisibility, seam_visibility};
mod form;
pub use form::{MeshForm, SLIVER_DEGREES, mesh_form};
mod features;
pub use features::{Bodies, FeatureFigures};
mod limit;
pub use limit::{Curvature, Limit, curvature, limit};
mod registration;
pub use measures::{RegularGrid, regular_grid};
pub use registration::{Registration, SHIFT_POSTS_MAX, registration};
mod measures;
pub use measures::{DemGround, Measures, ResidualFigures};

#[cfg(test)]
mod scene;
