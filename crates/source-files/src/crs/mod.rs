//! Coordinate reference systems: by EPSG code, by well-known text, by GeoKeys; and from one to another.
//!
//! A system is a PROJ definition that `proj4rs` computes. Only systems whose datum is known are taken: one that
//! agrees with WGS 84 within a metre or so (WGS 84, NAD83, ETRS89 and their kin), or one with the parameters of a
//! shift, which is [`Crs::remark`]ed. A datum that needs a grid of shifts is refused by name.

mod system;
pub use system::Crs;
mod geokeys;
mod named;
mod parameters;
pub(crate) mod vertical;
mod wkt;
pub(crate) use geokeys::GeoKeys;

#[cfg(test)]
mod tests;
