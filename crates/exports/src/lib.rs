//! A finished database in other programs' formats. We write these and never read them.
//!
//! [`Product::read`] takes the load modules of an area, or of a block of it, into memory; each export is a function of
//! the product. What becomes one file is written to an `io::Write`; what becomes many is handed, file by file, to a
//! [`Put`], which may be called from several threads. Nothing here opens a file (GeoPackage, whose library does,
//! excepted), prints, or reads a clock.

// A test that unwraps says by its line what failed.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod error;
pub use error::ExportError;
mod work;
pub use work::{Put, Step, Work};
mod classes;
mod sheets;
pub use sheets::Sheet;
mod product;
pub use product::{Block, Levels, Product};
mod textures;
pub use textures::{Texture, TextureFile, Textures};
mod detail;
mod forecast;
pub use forecast::Forecast;
mod formats;
pub use formats::{CARRIES, Carries, Format, LEFT_OUT, carries_text};
mod lanes;
mod mesh;
mod objects;
mod ribbons;
pub use mesh::{Coordinates, Mesh};
mod sidecar;
pub use sidecar::{Facts, sidecar};
mod polygon_files;
pub use polygon_files::{obj_materials, write_obj, write_ply};
mod tin_files;
pub use tin_files::{TinPlace, write_tin_obj, write_tin_ply};
mod glb;
mod glb_features;
pub use glb::{write_glb, write_tin_glb};
mod modules;
pub use modules::{module_file, write_modules};
mod blocks;
mod geotiff;
mod surface;
mod tiff_layout;
pub use geotiff::{ByteRaster, write_byte_raster};
/// Coordinate systems, for places that are asked for in another one than the area's.
pub use source_files::Crs;
pub use surface::{GroundHeights, write_residual, write_surface};
mod gpkg;
mod gpkg_objects;
mod gpkg_styles;
pub use gpkg::write_gpkg;
mod earth;
pub use earth::{Datum, Earth};
mod flt_records;
mod openflight;
pub use openflight::write_openflight;
mod coarse;
mod globe;
mod skirts;
mod tiles3d;
mod triangle_index;
pub use tiles3d::{Tileset, write_3dtiles};
mod borders;
mod covered;
mod together;
pub use borders::Gap;
pub use covered::Covered;
pub use together::{Together, WrittenArea};
mod quantized;
pub use quantized::{QuantizedMesh, write_quantized_mesh};
mod terrain_tiles;
pub use terrain_tiles::write_3dtiles_terrain;
mod archives;
pub use archives::{write_3tz, write_mbtiles};
mod web_map;
pub use web_map::{HeightEncoding, WebMap, write_pmtiles, write_web_mbtiles};
mod usd;
pub use usd::write_usd;
mod boxes;
mod gazebo;
pub use gazebo::write_gazebo;
mod heightmap;
pub use heightmap::{Engine, write_heightmap};

#[cfg(test)]
mod samples;
#[cfg(test)]
mod tests;
