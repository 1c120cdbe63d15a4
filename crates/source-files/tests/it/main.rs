//! Files through the public doors: what is read, what is refused and how, and that nothing hostile gets further.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod alike;
mod datums;
mod formats;
#[cfg(feature = "geoparquet")]
mod geoparquet;
mod geotiff;
mod hostile;
mod longitudes;
mod mosaics;
mod osm;
mod overlays;
mod pbf;
mod proportion;
mod real_files;
mod real_vectors;
mod refusals;
mod resampling;
mod support;
mod tiff_parts;
mod vectors;
mod void_rules;
mod windows;
