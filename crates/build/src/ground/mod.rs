//! From a job's sources to its ground: where the area lies, and windows of its heights and weights on demand.
//!
//! [`Ground::open`] opens and judges all that a job names; [`foresee`] judges what headers tell.

mod error;
pub use error::{GroundError, TaskError};
mod area;
pub use area::{GamingArea, PlannedTile, planned_tiles};
mod relief;
pub use relief::{Bounds, Relief, far_m};
mod burn;
pub use burn::{burn, posts_inside, roadside_reach, waterside_reach};
mod buildings;
mod canopy;
mod objects;
pub use objects::FoundObjects;
mod vectors;
pub use vectors::{FeaturesRead, Vectors, site};
mod excluded;
mod given;
pub use given::{Given, GivenPost, border_posts, chosen, posts_of_file, refused, start_posts};
mod ground;
pub use self::ground::{Ground, KEPT_POSTS_MAX, scanned};
pub use terrain::mask::{Sight, Surroundings};
mod window;
pub use window::{Window, feed_post};
mod large;
pub use large::CACHE_BYTES_MAX;
mod source;
pub use source::{decode, reading, warnings_of};
mod records;
pub use records::{records, states};
mod foresee;
#[cfg(feature = "geoparquet")]
pub use foresee::groups_needed;
pub use foresee::{Needed, foresee, needed};
mod locate;
pub use locate::{Corner, corners, covered, find_area, rectangle_around, utm_of};
mod idle_areas;
pub use idle_areas::idle_areas;
mod features_seen;
pub use features_seen::{FeatureRow, FeatureTable, FeaturesSeen, SourceSeen, features_in};

mod census;
mod datums;
mod mask_of;
mod sources;
mod water;
