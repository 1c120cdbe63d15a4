//! Others' formats in: rasters of heights and classes, polygons, roads and rivers; and GeoTIFF out.
//!
//! Rows are turned here, once: whatever the file's order, row 0 is the southern one from here on. A file is judged
//! before anything is allocated for it: [`DemFile::open`] tells broken, unsupported and too large apart, and every
//! limit is in [`limits`]. Nothing here starts a thread; [`DemFile::decode`] may be called from several.

pub mod limits;

mod error;
pub use error::{SourceError, short};
mod content;
pub use content::{FileState, content};
mod crs;
mod store;
pub use crs::{Crs, plain_datum, vertical_code};
mod frame;
pub use frame::{RasterFrame, SampleScale};
mod geoid;
pub use geoid::{DatumShift, Geoid};
mod chunk;
pub use chunk::Chunk;
mod directory;
mod geotiff;
mod unpacked;
pub use geotiff::GeoTiff;
mod tiff_part;
pub use tiff_part::TiffLevels;
mod dem_file;
mod dted;
mod hgt;
mod rows;
mod side_files;
mod text_grid;
pub use dem_file::{DemFile, Reading};
mod raster;
mod samples;
pub use raster::Raster;
mod array;
pub use array::{ArrayRaster, PostArray};
mod voids;
pub use voids::{VoidPolicy, VoidSummary};
mod resample;
pub use resample::window_under;
mod join;
mod longitudes;
pub use join::Standing;
pub use longitudes::turns;
mod mosaic;
mod warp;
pub use mosaic::{Mosaic, MosaicRules, MosaicVoids, Patch, window_reaching};
pub use warp::Reach;
mod edges;
pub use edges::{EdgeStep, edge_steps, edge_steps_by_window};
mod geoid_file;
mod windows;
pub use windows::{Look, Windows};
mod wide;
pub use wide::WideMosaic;
mod classes;
pub use classes::ClassRaster;
mod imagery;
pub use imagery::{Care, Imagery, Keep, Square};
mod geopackage;
#[cfg(feature = "geoparquet")]
mod geoparquet;
#[cfg(feature = "geoparquet")]
pub use geoparquet::GeoParquet;
mod kept;
mod polygons;
mod shapefile;
pub use polygons::read_polygons;
mod features;
#[cfg(feature = "geoparquet")]
pub use features::groups_near;
pub use features::{
    BUILT_IN_KEYS, Done, Extent, FeatureFile, Remark, Tags, VectorFeature, VectorShape, Vertices, Wanted,
    feature_attribution, feature_layers, is_feature_file, read_features,
};
mod given;
pub use given::{GivenFeature, GivenShape, read_given};
pub mod geopackage_parts;
pub mod geotiff_parts;
mod write;
pub use write::{write_bytes, write_classes, write_heights};
