//! Roads, rivers and lakes in small areas of known ground: what must hold of each is asked of the load modules, through
//! the reader for simulators, and of what `level` published.

mod drawing;
pub use drawing::{Drawn, geojson, line, polygon};

mod random;
pub use random::drawn;

mod bad_input;
mod buildings;
mod bytes;
mod left_out;
mod networks;
mod objects;
mod outside;
mod refused;
mod roads;
mod water;
