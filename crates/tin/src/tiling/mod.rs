//! Where tiles meet, in which order they are refined, and what each may spend.
//!
//! Rank order, not timing, defines the result: a tile is seeded by exactly its lower-ranked neighbours.
//! Limits are shared out before any tile is refined, so no tile needs to know what another spends.

mod tiling;
pub use tiling::Tiling;
mod budget;
pub use budget::{Budget, BudgetFault, outer_border_posts, outer_sides};
mod allocate;
pub use allocate::{Allocation, Share, allocate_equally, allocate_globally};
mod points;
pub use points::{Gains, SquaresOfArea, points_equally, points_globally};
