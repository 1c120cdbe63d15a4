//! Others' formats in: GeoTIFF rasters of heights and classes, GeoJSON polygons; and GeoTIFF out.
//!
//! Rows are turned here, once: whatever the file's order, row 0 is the southern one from here on. A file is judged
//! before anything is allocated for it: [`GeoTiff::open`] tells broken, unsupported and too large apart, and every
//! limit is in [`limits`]. Nothing here starts a thread; [`GeoTiff::decode`] may be called from several.

pub mod limits;

mod error;
pub use error::SourceError;
mod content;
pub use content::content;
mod directory;
mod frame;
pub use frame::{RasterFrame, SampleScale};
mod geotiff;
pub use geotiff::{Chunk, GeoTiff};
mod raster;
mod samples;
pub use raster::Raster;
mod voids;
pub use voids::{VoidPolicy, VoidSummary};
mod resample;
pub use resample::window_under;
mod classes;
pub use classes::ClassRaster;
mod polygons;
pub use polygons::read_polygons;
mod write;
pub use write::{write_classes, write_heights};
