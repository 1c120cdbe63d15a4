//! What a load module holds: a tile's TIN cut into the squares that a simulator loads at once.
//!
//! With constrained edges the squares are already there and only have to be told apart ([`concatenate`]).
//! With clipped edges the points of a tile and of its surroundings are triangulated again, the same
//! over every seam, and each triangle is clipped to the squares it lies in ([`clip`]); points whose removal
//! costs least make room where a square holds too much ([`propose_removals`]).
//!
//! Everything is whole numbers: coordinates and heights in quanta of 1/128 m. What both load modules of a
//! side hold on it is computed from the side's points and edges alone, so they hold equal bits.

mod layout;
pub use layout::Layout;
mod classes;
mod concatenate;
mod decks;
pub use decks::{SPARE_MAX, cut_decks};
mod clear;
pub use classes::classify_natural;
pub use clear::put_decks;
mod lift;
pub use lift::lift_decks;
mod lines;
pub use lines::cut_lines;
mod stand;
pub use stand::{highest_in, stand};
mod pieces;
pub use concatenate::concatenate;
mod clip;
mod outline;
pub use clip::{ClipHeights, clip, halo_posts};
mod hole;
mod removals;
pub use removals::{Freed, Removal, RemovalGround, propose_removals};
mod faces;
mod levels;
pub use faces::{Face, Faces};
pub use levels::{LevelFeatures, LevelGround, Levels, coarser_levels};
#[cfg(test)]
mod sheets;
