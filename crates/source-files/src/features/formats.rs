//! Which format a file of features is in, by how it begins.

use std::path::Path;

use super::osm::ATTRIBUTION;
use super::osm::frames::MARK;
use crate::dem_file::{known_but_not_read, text_in};
use crate::error::{A_JOB, A_TEXT};
use crate::store::Store;
use crate::{SourceError, geopackage, shapefile};

/// How a zip archive with something in it begins.
const ZIP_MARK: [u8; 4] = *b"PK\x03\x04";

/// Formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    OpenStreetMap,
    GeoPackage,
    Shapefile,
    GeoJson,
    #[cfg(feature = "geoparquet")]
    GeoParquet,
}

/// Whether the file at `path` begins as one of the formats of features does; `false` where it cannot be read. Not all
/// JSON is GeoJSON: that names what it holds early on.
pub fn is_feature_file(path: &Path) -> bool {
    const LOOKED_AT: u64 = 1 << 16;
    const NAMES: [&[u8]; 3] = [b"\"FeatureCollection\"", b"\"Feature\"", b"\"coordinates\""];
    match open(path) {
        Ok((store, Format::GeoJson)) => store
            .start(LOOKED_AT)
            .is_ok_and(|start| NAMES.iter().any(|name| start.windows(name.len()).any(|window| window == *name))),
        // A zipped Shapefile that unpacks to too much is told as what it is.
        Err(SourceError::TooLarge { .. }) => is_zip(path),
        other => other.is_ok(),
    }
}

fn is_zip(path: &Path) -> bool {
    Store::plain(path).and_then(|store| store.start(4)).is_ok_and(|start| start == ZIP_MARK)
}

/// Whom to name beside anything drawn from the file at `path`, where its format says so.
pub fn feature_attribution(path: &Path) -> Option<&'static str> {
    match open(path).ok()? {
        (_, Format::OpenStreetMap) => Some(ATTRIBUTION),
        #[cfg(feature = "geoparquet")]
        (store, Format::GeoParquet) => super::columnar::attribution(&super::columnar::footer(&store).ok()?),
        _ => None,
    }
}

/// The layers of features in the GeoPackage at `path`; none where it is a file of another format.
///
/// # Errors
/// When the file is none of the formats of features, or is broken.
pub fn feature_layers(path: &Path) -> Result<Vec<String>, SourceError> {
    match open(path)?.1 {
        Format::GeoPackage => geopackage::layer_names(path),
        _ => Ok(Vec::new()),
    }
}

/// Opens a file of features; gzipped GeoJSON and zipped Shapefiles are unpacked.
pub(super) fn open(path: &Path) -> Result<(Store, Format), SourceError> {
    let store = Store::plain(path)?;
    let start = store.start(512)?;
    if start.starts_with(geopackage::MARK) {
        return Ok((store, Format::GeoPackage));
    }
    if start.starts_with(&shapefile::MARK) {
        let ending = path.extension().unwrap_or_default();
        return match ending.eq_ignore_ascii_case("shx") {
            false => Ok((store, Format::Shapefile)),
            true => Err(refused(path, "the index of a Shapefile")),
        };
    }
    if start.get(4..).is_some_and(|start| start.starts_with(MARK)) {
        return Ok((store, Format::OpenStreetMap));
    }
    if start.starts_with(&[0x1f, 0x8b]) {
        let unpacked = Store::inflated_features(path)?;
        let start = unpacked.start(512)?;
        return match is_json(&start) {
            true => Ok((unpacked, Format::GeoJson)),
            false => Err(refused(path, &format!("a gzip file of {}", name_of(path, &start)))),
        };
    }
    if start.starts_with(&ZIP_MARK) {
        let shapes = Store::zipped_shapefile(path)?.swap_remove(0);
        return match shapes.start(4)?.starts_with(&shapefile::MARK) {
            true => Ok((shapes, Format::Shapefile)),
            false => Err(refused(path, "a zip archive of a .shp that is no Shapefile")),
        };
    }
    if is_json(&start) {
        return Ok((store, Format::GeoJson));
    }
    #[cfg(feature = "geoparquet")]
    if start.starts_with(crate::geoparquet::MARK) {
        return Ok((store, Format::GeoParquet));
    }
    Err(refused(path, &name_of(path, &start)))
}

fn refused(path: &Path, found: &str) -> SourceError {
    SourceError::NotFeatures { path: path.into(), found: found.into() }
}

/// Some editors put a byte order mark before UTF-8 text.
fn is_json(start: &[u8]) -> bool {
    let start = start.strip_prefix("\u{feff}".as_bytes()).unwrap_or(start);
    start.trim_ascii_start().starts_with(b"{")
}

/// What a file is that is not read.
fn name_of(path: &Path, start: &[u8]) -> String {
    const MARKS: [(&[u8], &str); 8] = [
        (b"II\x2a\0", "a GeoTIFF raster"),
        (b"MM\0\x2a", "a GeoTIFF raster"),
        (b"II\x2b\0", "a GeoTIFF raster"),
        (b"MM\0\x2b", "a GeoTIFF raster"),
        (b"UHL1", "a DTED raster"),
        (b"BZh", "a bzip2 file"),
        (b"fgb\x03", "a FlatGeobuf file"),
        (b"PAR1", "a Parquet file, which this program was built without"),
    ];
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    let text = String::from_utf8_lossy(start);
    let known = MARKS.iter().find(|(mark, _)| start.starts_with(mark)).map(|&(_, name)| name);
    match ending.as_str() {
        _ if start.is_empty() => "an empty file".into(),
        _ if known.is_some() => known.unwrap_or_default().into(),
        _ if text.contains("<osm") => "OpenStreetMap data as XML".into(),
        _ if text.trim_start().starts_with('<') => "a file of XML (KML, GML or GPX, perhaps)".into(),
        "pbf" => format!("a .pbf file that begins with {} and is no OpenStreetMap data", hexadecimal(start)),
        "dbf" => "the table of a Shapefile".into(),
        "hgt" | "asc" | "flt" | "dt0" | "dt1" | "dt2" => format!("a raster (.{ending})"),
        _ => match known_but_not_read(start).or_else(|| text_in(path, start)) {
            Some(A_TEXT | A_JOB) => "a text file of some other kind".into(),
            Some(found) => found.into(),
            None => format!("a file that begins with {}", hexadecimal(start)),
        },
    }
}

fn hexadecimal(start: &[u8]) -> String {
    start.iter().take(8).map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}
