//! Why a source could not be used: one variant per cause, each with the file, what was found and what was expected.

use std::io;
use std::path::PathBuf;

use terrain::Side;
use thiserror::Error;

/// Why a source could not be read or written.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields are")]
pub enum SourceError {
    // The file cannot be had.
    /// The file could not be opened.
    #[error("{path}: {source}")]
    Open { path: PathBuf, source: io::Error },
    /// The file could be opened but not read on.
    #[error("{path}: reading stopped: {source}")]
    Read { path: PathBuf, source: io::Error },
    /// The file could not be written.
    #[error("{path}: writing stopped: {source}")]
    Write { path: PathBuf, source: io::Error },

    // The file is broken.
    /// The first bytes are not those of a TIFF.
    #[error("{path}: not a TIFF: it begins with {found}, expected 49 49 2a 00, 4d 4d 00 2a or their BigTIFF forms")]
    NotTiff { path: PathBuf, found: String },
    /// A part lies beyond the end of the file.
    #[error("{path}: truncated: {what} ends at byte {expected}, the file at byte {found}")]
    Truncated { path: PathBuf, what: String, expected: u64, found: u64 },
    /// A value contradicts the format, or another value.
    #[error("{path}: malformed: {what} is {found}, expected {expected}")]
    Malformed { path: PathBuf, what: String, found: String, expected: String },
    /// Compressed samples cannot be restored.
    #[error("{path}: strip or tile {chunk} of {chunks} cannot be decoded: {reason}")]
    BrokenChunk { path: PathBuf, chunk: u32, chunks: u32, reason: String },

    // The file asks for too much.
    /// A size is beyond one of the [`crate::limits`].
    #[error("{path}: too large: {found} {what}, at most {limit} are read")]
    TooLarge { path: PathBuf, what: &'static str, found: u64, limit: u64 },

    // The file is sound, but of a kind that is not read.
    /// A compression that is not read.
    #[error("{path}: compression {found} is not supported, expected none, LZW, deflate, zstd or PackBits")]
    Compression { path: PathBuf, found: String },
    /// A type of sample that is not read.
    #[error(
        "{path}: samples are {found}, expected 8- or 16-bit unsigned, 16- or 32-bit signed, \
        or 32- or 64-bit floating point"
    )]
    SampleFormat { path: PathBuf, found: String },
    /// More than one value per post.
    #[error("{path}: {found} bands, expected 1")]
    Bands { path: PathBuf, found: u64 },
    /// Samples stand for colours.
    #[error("{path}: colours are {found}, expected plain values (black is zero)")]
    Photometric { path: PathBuf, found: String },
    /// Voids are marked by a raster of their own.
    #[error("{path}: voids are given by an internal mask, expected a nodata tag")]
    InternalMask { path: PathBuf },
    /// The file begins with something else than its raster.
    #[error("{path}: the first directory is an overview or a mask, expected the full raster")]
    NotFullRaster { path: PathBuf },
    /// Something else of the format that is not read.
    #[error("{path}: {found}, which is not supported")]
    TiffFeature { path: PathBuf, found: String },

    // The file is sound, but lies nowhere or not where it should.
    /// The file does not say which coordinate system it is in.
    #[error("{path}: no coordinate reference system in the file, expected a projected one")]
    NoCrs { path: PathBuf },
    /// Coordinates are degrees.
    #[error("{path}: the coordinate reference system is geographic ({found}), expected a projected one in metres")]
    Geographic { path: PathBuf, found: String },
    /// The coordinate system has no EPSG code that can be compared.
    #[error("{path}: the coordinate reference system is {found}, expected a projected one with an EPSG code")]
    UnnamedCrs { path: PathBuf, found: String },
    /// Eastings and northings are not in metres.
    #[error("{path}: coordinates are in {found}, expected metres")]
    LinearUnit { path: PathBuf, found: String },
    /// The unit of heights is not known.
    #[error("{path}: heights are in {found}, expected metres or feet")]
    VerticalUnit { path: PathBuf, found: String },
    /// The file does not say where the raster lies.
    #[error("{path}: no position in the file, expected a tie point and a pixel scale, or a transformation")]
    NoPosition { path: PathBuf },
    /// The raster is placed by control points.
    #[error("{path}: placed by {found} control points, expected one tie point and a pixel scale")]
    ControlPoints { path: PathBuf, found: usize },
    /// Rows do not run east.
    #[error(
        "{path}: the raster is rotated or sheared (terms {found}), \
        expected rows that run east and columns that run north"
    )]
    Rotated { path: PathBuf, found: String },
    /// The coordinate system is not the area's.
    #[error("{path}: coordinate reference system EPSG:{found}, expected the area's EPSG:{expected}")]
    OtherCrs { path: PathBuf, found: u32, expected: u32 },
    /// The raster ends before the area does: on which sides, and by how many metres.
    #[error("{path}: does not cover the area: {} missing", sides(missing))]
    NotCovered { path: PathBuf, missing: Vec<(Side, f64)> },

    // The heights cannot be used.
    /// There are voids and the job wants none.
    #[error("{path}: {found} void posts in the area, the first at {} m, expected none", place(first_m))]
    Voids { path: PathBuf, found: usize, first_m: [f64; 2] },
    /// There are voids too far from any height to be filled.
    #[error("{path}: {found} void posts farther than {limit} posts from a height, the first at {} m", place(first_m))]
    VoidsTooFar { path: PathBuf, found: usize, limit: u32, first_m: [f64; 2] },
    /// There is no height in the area at all.
    #[error("{path}: all {found} posts in the area are void")]
    AllVoid { path: PathBuf, found: usize },
    /// A height is infinite.
    #[error("{path}: an infinite height at {} m, expected a number or a void", place(place_m))]
    Infinite { path: PathBuf, place_m: [f64; 2] },
    /// A height in metres is beyond [`crate::limits::HEIGHT_M_MAX`].
    #[error("{path}: a height of {found} m, expected at most {limit} m either side of 0")]
    HeightOutOfRange { path: PathBuf, found: f64, limit: f64 },
    /// A class raster holds fractions.
    #[error("{path}: samples are {found}, expected whole numbers for a class raster")]
    NotClasses { path: PathBuf, found: &'static str },

    // Polygons.
    /// The file is not GeoJSON.
    #[error("{path}: not GeoJSON: {reason}")]
    NotGeoJson { path: PathBuf, reason: String },
    /// A geometry is no polygon.
    #[error("{path}: a {found}, expected Polygon or MultiPolygon")]
    NotPolygons { path: PathBuf, found: &'static str },
    /// There is no polygon at all.
    #[error("{path}: no polygon in the file")]
    NoPolygons { path: PathBuf },
    /// A ring of a polygon is not closed. Rings are counted from 0 over the file.
    #[error("{path}: ring {ring} has {found}, expected at least 4 corners, the last equal to the first")]
    Ring { path: PathBuf, ring: usize, found: String },
    /// The file names another coordinate system than the area's.
    #[error("{path}: coordinates are in {found}, expected the area's EPSG:{expected} in metres")]
    PolygonCrs { path: PathBuf, found: String, expected: u32 },
    /// Coordinates can only be degrees.
    #[error(
        "{path}: coordinates look like longitude and latitude ({found}), \
        expected metres of the area's EPSG:{expected}"
    )]
    LonLat { path: PathBuf, found: String, expected: u32 },
}

impl SourceError {
    /// What could be done about it, in one sentence, where there is something to say.
    pub fn hint(&self) -> Option<&'static str> {
        use SourceError::*;
        Some(match self {
            Open { .. } => "check the path and its permissions; paths in a job are relative to the job file",
            Write { .. } => "check that the folder exists, is writable and has room; nothing was left half-written",
            Read { .. } | Truncated { .. } | Malformed { .. } | BrokenChunk { .. } => {
                "the file is damaged or was not copied whole; fetch it again"
            }
            NotTiff { .. } => "DEMs and class rasters are GeoTIFF files; gdal_translate converts other formats",
            TooLarge { .. } => "cut the part you need with gdal_translate -projwin, or tile the file",
            Compression { .. } => "rewrite it: gdal_translate -co COMPRESS=DEFLATE in.tif out.tif",
            SampleFormat { .. } => "rewrite it: gdal_translate -ot Float32 in.tif out.tif",
            Bands { .. } => "choose the band of heights: gdal_translate -b 1 in.tif out.tif",
            Photometric { .. } => "rewrite it: gdal_translate -co PHOTOMETRIC=MINISBLACK in.tif out.tif",
            InternalMask { .. } => "write the mask into the heights: gdalwarp -dstnodata -9999 in.tif out.tif",
            NotFullRaster { .. } | TiffFeature { .. } => "rewrite it: gdal_translate in.tif out.tif",
            NoCrs { .. } => "say what it is: gdal_edit.py -a_srs EPSG:32611 file.tif (with your own code)",
            Geographic { .. } => "project it: gdalwarp -t_srs EPSG:32611 -r bilinear in.tif out.tif (your own zone)",
            UnnamedCrs { .. } | LinearUnit { .. } | OtherCrs { .. } => {
                "project it to the area's system: gdalwarp -t_srs EPSG:… -r bilinear in.tif out.tif, or change area.crs"
            }
            VerticalUnit { .. } => "say how many metres a unit is: dem.height_unit_m = …",
            NoPosition { .. } | ControlPoints { .. } | Rotated { .. } => {
                "warp it onto a north-up grid: gdalwarp -r bilinear in.tif out.tif"
            }
            NotCovered { .. } => "move area.origin_m, make area.size_m smaller, or give a DEM that reaches farther",
            Voids { .. } => {
                "set dem.voids = { fill_within_posts = 8 } to fill small gaps, or \"hole\" to leave them out"
            }
            VoidsTooFar { .. } => "raise fill_within_posts, set dem.voids = \"hole\", or move the area",
            AllVoid { .. } => "check area.origin_m, and the file's nodata tag",
            Infinite { .. } | HeightOutOfRange { .. } => {
                "mark such posts as void: gdal_translate -a_nodata … ; if heights are not metres set dem.height_unit_m"
            }
            NotClasses { .. } => "rewrite it: gdal_translate -ot Byte classes.tif out.tif",
            NotGeoJson { .. } => "convert it: ogr2ogr -f GeoJSON out.geojson in.shp",
            NotPolygons { .. } | NoPolygons { .. } => "give polygons: ogr2ogr -where \"OGR_GEOMETRY='POLYGON'\" …",
            Ring { .. } => "repair it: ogr2ogr -makevalid out.geojson in.geojson",
            PolygonCrs { .. } | LonLat { .. } => {
                "project it: ogr2ogr -t_srs EPSG:… -lco RFC7946=NO out.geojson in.geojson (with the area's code)"
            }
        })
    }
}

fn place([east_m, north_m]: &[f64; 2]) -> String {
    format!("{east_m:.1}, {north_m:.1}")
}

fn sides(missing: &[(Side, f64)]) -> String {
    let name = |side: &Side| match side {
        Side::South => "south",
        Side::East => "east",
        Side::North => "north",
        Side::West => "west",
    };
    let parts: Vec<String> =
        missing.iter().map(|(side, metres)| format!("{metres:.1} m on its {} side", name(side))).collect();
    parts.join(" and ")
}
