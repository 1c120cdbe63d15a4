//! Pictures of the ground in: GeoTIFFs of colours, in any coordinate system, drawn onto squares of another one.
//!
//! ```text
//!   directories   what a file says of its picture, its overviews and its masks
//!   level         one of these, cut into strips or tiles
//!   unpack        a strip or tile as numbers, then as colours
//!   picture       all of them, opened
//!   draw          a square of ground, from the level that is as fine as it; strips and tiles decoded last
//! ```
//! A picture is never in memory as a whole: a square takes the strips or tiles below it, one after the other, and if it
//! is a glimpse no more than [`level::PIXELS_MAX`] pixels of them.

mod directories;
mod draw;
mod level;
mod picture;
mod unpack;

pub use draw::{Care, Keep, Square};
pub use picture::Imagery;

#[cfg(test)]
mod tests;
