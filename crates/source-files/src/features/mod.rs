//! Roads, rivers, lakes and other lines and polygons: from OpenStreetMap data, GeoPackages, Shapefiles, GeoJSON
//! and GeoParquet, in metres of the area's system.
//!
//! Features are read as they are: nothing is mended here. They are cut at the bounds that the caller names, one load
//! module beyond the area, so that memory is bounded by what lies in the area; inside, every vertex of the file is
//! kept, so what meets in the file meets here. What cannot be read is left out and told, feature by feature; only a
//! file that cannot be read at all is an error.

pub(crate) mod clip;
#[cfg(feature = "geoparquet")]
mod columnar;
mod columns;
pub(crate) mod curves;
mod formats;
mod json;
mod loose;
mod model;
#[cfg(feature = "geoparquet")]
mod moments;
mod nest;
pub(crate) mod osm;
#[cfg(feature = "geoparquet")]
mod overture;
mod packages;
mod placing;
pub(crate) mod raw;
mod seen;
mod shapes;
mod sound;
pub(crate) mod strict;
mod value;
pub(crate) mod well_known;

pub use clip::Extent;
#[cfg(feature = "geoparquet")]
pub use columnar::groups_near;
pub use formats::{feature_attribution, feature_layers, is_feature_file};
pub use model::{BUILT_IN_KEYS, Done, FeatureFile, Remark, Tags, VectorFeature, VectorShape, Vertices, Wanted};

use std::path::Path;

use terrain::Each;

use crate::SourceError;
use formats::Format;

/// Reads the lines and polygons of the file at `path` that lie inside the bounds; `each` runs what falls into pieces.
///
/// # Errors
/// When it is none of the formats, is broken, too large, or in a coordinate system that cannot be brought to the
/// area's, or when it has several layers and none is named. Features that cannot be used are no error.
pub fn read_features(path: &Path, wanted: &Wanted, each: Each) -> Result<FeatureFile, SourceError> {
    let (store, format) = formats::open(path)?;
    if let (Some(layer), true) = (wanted.layer, format != Format::GeoPackage) {
        let (found, expected) = (format!("the layer `{layer}` named"), "no layer: only GeoPackages have some".into());
        return Err(SourceError::Layer { path: path.into(), found, expected });
    }
    if let (Some(crs), Format::OpenStreetMap) = (wanted.crs, format) {
        let found = format!("OpenStreetMap data, said to be in {}", crs.name());
        return Err(SourceError::NoOtherCrs { path: path.into(), found });
    }
    let read = match format {
        Format::OpenStreetMap => osm::read(&store, wanted, each),
        Format::GeoPackage => packages::read(path, wanted),
        Format::Shapefile => shapes::read(&store, wanted),
        Format::GeoJson => json::read(&store, wanted),
        #[cfg(feature = "geoparquet")]
        Format::GeoParquet => columnar::read(&store, wanted),
    };
    let with_buildings = |mut read: FeatureFile| {
        if wanted.buildings && format != Format::OpenStreetMap {
            let is_building = |feature: &&VectorFeature| feature.tag(model::BUILDING_KEY).is_some();
            read.buildings = read.features.iter().filter(is_building).cloned().collect();
        }
        read
    };
    read.map(with_buildings).map_err(|error| match error {
        // Here the caller can say it.
        SourceError::UnnamedCrs { path, found } => SourceError::FeatureCrs { path, found },
        error => error,
    })
}
