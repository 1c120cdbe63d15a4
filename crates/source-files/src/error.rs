//! Why a source could not be used: one variant per cause, each with the file, what was found and what was expected.

use std::io;
use std::path::{Path, PathBuf};

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
    /// The path leads to something that is no regular file.
    #[error("{path}: it is {found}, expected a file")]
    NotAFile { path: PathBuf, found: &'static str },
    /// There is nothing in the file.
    #[error("{path}: an empty file, expected a raster")]
    Empty { path: PathBuf },
    /// The file is not what it was when the build began.
    #[error("{path}: {found} while it was read, expected the file that the build began with")]
    Changed { path: PathBuf, found: String },
    /// The file could be opened but not read on.
    #[error("{path}: reading stopped: {source}")]
    Read { path: PathBuf, source: io::Error },

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

    /// The checksum of a DTED record is not the sum of its bytes.
    #[error("{path}: the checksum of column {column} is {found}, its bytes add up to {expected}")]
    Checksum { path: PathBuf, column: i32, found: u32, expected: u32 },
    /// An archive does not hold one raster.
    #[error("{path}: the archive holds {found} files that could be rasters, expected 1")]
    ArchiveHolds { path: PathBuf, found: usize },
    /// A header of a raw grid without the grid.
    #[error("{path}: the header of a raw grid, but no grid beside it (.flt, .bil, .bin or .raw)")]
    HeaderAlone { path: PathBuf },

    // The file asks for too much.
    /// A size is beyond one of the [`crate::limits`].
    #[error("{path}: too large: {found} {what}, at most {limit} are read")]
    TooLarge { path: PathBuf, what: &'static str, found: u64, limit: u64 },

    /// What is in the file takes more memory than a file of its size may.
    #[error(
        "{path}: its lines and polygons take more than {} MB of memory, at most that is given to a file of {} kB",
        limit / 1_000_000, file_bytes.div_ceil(1000)
    )]
    OutOfProportion { path: PathBuf, file_bytes: u64, limit: u64 },

    // The file is sound, but of a kind that is not read.
    /// A format that is known, but not read.
    #[error("{path}: {found}, which is not read; expected GeoTIFF, DTED, HGT, Esri ASCII, or raw with a .hdr")]
    OtherFormat { path: PathBuf, found: &'static str },
    /// A format that is not known here.
    #[error("{path}: it begins with {found}; expected GeoTIFF, DTED, HGT, Esri ASCII, or raw with a .hdr beside it")]
    UnknownFormat { path: PathBuf, found: String },
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
    /// A file beside the raster says something of its heights that the raster itself does not.
    #[error("{path}: {found}, expected all that changes heights in the file itself")]
    SideFile { path: PathBuf, found: String },
    /// The file begins with something else than its raster.
    #[error("{path}: the first directory is an overview or a mask, expected the full raster")]
    NotFullRaster { path: PathBuf },
    /// Something else of the format that is not read.
    #[error("{path}: {found}, which is not supported")]
    TiffFeature { path: PathBuf, found: String },
    /// A picture of a kind that is not drawn, or that lies nowhere.
    #[error("{path}: {found}, expected {expected}")]
    Picture { path: PathBuf, found: String, expected: &'static str, remedy: Option<&'static str> },

    // The file is sound, but lies nowhere or not where it should.
    /// The file does not say which coordinate system it is in.
    #[error("{path}: no coordinate reference system in the file or in a .prj beside it, expected one")]
    NoCrs { path: PathBuf },
    /// A file with the name of an HGT tile, of another size.
    #[error("{path}: found {found} bytes, expected those of an HGT tile: {expected}")]
    NotHgtSize { path: PathBuf, found: u64, expected: String },
    /// An HGT tile whose name does not say where it lies.
    #[error("{path}: an HGT tile, whose name does not say where it lies, expected one such as N35W117.hgt")]
    NoCorner { path: PathBuf },
    /// Coordinates are degrees.
    #[error("{path}: the coordinate reference system is geographic ({found}), expected a projected one in metres")]
    Geographic { path: PathBuf, found: String },
    /// The coordinate system is not one that can be computed, or compared.
    #[error("{path}: the coordinate reference system is {found}, expected one that is known by its EPSG code")]
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
    /// Posts lie closer together than any ground is measured.
    #[error("{path}: its posts are {found} apart, in the units of its coordinate system; expected at least {limit:e}")]
    TooFine { path: PathBuf, found: String, limit: f64 },
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
    #[error("{path}: coordinate reference system {found}, expected the area's EPSG:{expected}")]
    OtherCrs { path: PathBuf, found: String, expected: u32 },
    /// The raster and the area have no ground in common.
    #[error("{path}: it lies outside the area")]
    OutsideArea { path: PathBuf },
    /// The raster ends before the area does: on which sides, and by how many metres.
    #[error("{path}: does not cover the area: {} missing", sides(missing))]
    NotCovered { path: PathBuf, missing: Vec<(Side, f64)> },

    // The heights cannot be used.
    /// There are voids and the job wants none.
    #[error("{path}: {found} void posts in the area, the first at {first}, expected none")]
    Voids { path: PathBuf, found: usize, first: String },
    /// There are voids too far from any height to be filled.
    #[error("{path}: {found} void posts farther than {limit} posts from a height, the first at {first}")]
    VoidsTooFar { path: PathBuf, found: usize, limit: u32, first: String },
    /// No source reaches some posts of the area; the map has a mark for each part of it, north up.
    #[error(
        "no source reaches {found} of {of} posts of the area; # is covered, + in part, . not at all (north is up):\n\
        {map}"
    )]
    Gaps { found: usize, of: usize, map: String },
    /// No source has a height at some posts that they cover.
    #[error("{found} of {of} posts of the area are void in every source that may give them, the first at {first}")]
    MosaicVoids { found: usize, of: usize, first: String },
    /// There is no height in the area at all.
    #[error("{path}: all {found} posts in the area are void")]
    AllVoid { path: PathBuf, found: usize },
    /// A height is infinite.
    #[error("{path}: an infinite height at {at}, expected a number or a void")]
    Infinite { path: PathBuf, at: String },
    /// A height in metres is beyond [`crate::limits::HEIGHT_M_MAX`].
    #[error("{path}: a height of {} m, expected at most {limit} m either side of 0", short(*found))]
    HeightOutOfRange { path: PathBuf, found: f64, limit: f64 },
    /// A class raster holds fractions.
    #[error("{path}: samples are {found}, expected whole numbers for a class raster")]
    NotClasses { path: PathBuf, found: &'static str },

    // Polygons.
    /// The file is not GeoJSON.
    #[error("{path}: neither a Shapefile, a GeoPackage nor GeoJSON: {reason}")]
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
    #[error("{path}: coordinates are in {found}, which cannot be brought to the area's EPSG:{expected}")]
    PolygonCrs { path: PathBuf, found: String, expected: u32 },
    // Features.
    /// The file is in none of the formats that features are read from.
    #[error(
        "{path}: {found}, which is not read as features; \
        expected OpenStreetMap (.osm.pbf), a GeoPackage, a Shapefile, GeoJSON or GeoParquet"
    )]
    NotFeatures { path: PathBuf, found: String },
    /// A GeoParquet file is packed in a way that is not read.
    #[error("{path}: its pages are packed with {found}, which is not read; expected zstd, snappy, gzip or none")]
    Packing { path: PathBuf, found: &'static str },
    /// The system of the file's coordinates cannot be computed, and nothing else says what it is.
    #[error("{path}: the coordinate reference system is {found}, expected one that can be computed")]
    FeatureCrs { path: PathBuf, found: String },
    /// A system is named for a file whose format knows only one.
    #[error("{path}: {found}; expected no crs, since such data is in longitude and latitude on WGS 84")]
    NoOtherCrs { path: PathBuf, found: String },
    /// The layer that is named is not there, or none is named where there are several.
    #[error("{path}: {found}; expected {expected}")]
    Layer { path: PathBuf, found: String, expected: String },

    // Points and polygons of a job.
    /// A point or polygon that is given is not one.
    #[error("{path}: {place}: found {found}, expected {expected}")]
    Given { path: PathBuf, place: String, found: String, expected: String },
}

/// Checks a number that a file says against a limit.
pub(crate) fn at_most(path: &Path, found: u64, limit: u64, what: &'static str) -> Result<(), SourceError> {
    if found <= limit { Ok(()) } else { Err(SourceError::TooLarge { path: path.into(), what, found, limit }) }
}

impl SourceError {
    /// What could be done about it, in one sentence, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        self.command().or_else(|| self.words_on_features().or_else(|| self.words()).map(str::to_owned))
    }

    /// The command that makes a file that is read of one that is not, as it is to be typed.
    fn command(&self) -> Option<String> {
        use SourceError::*;
        let (words, path) = match self {
            OtherFormat { path, found } if !found.contains("not a raster") => ("convert it: gdal_translate", path),
            Compression { path, .. } => ("rewrite it: gdal_translate -co COMPRESS=DEFLATE", path),
            SampleFormat { path, .. } => ("rewrite it: gdal_translate -ot Float32", path),
            Bands { path, .. } => ("choose the band of heights: gdal_translate -b 1", path),
            Photometric { path, .. } => ("rewrite it: gdal_translate -co PHOTOMETRIC=MINISBLACK", path),
            InternalMask { path } => ("write the mask into the heights: gdalwarp -dstnodata -9999", path),
            SideFile { path, found } if found.contains("mask") => {
                ("write the mask into the heights: gdalwarp -dstnodata -9999", path)
            }
            SideFile { path, .. } => ("write it into the file: gdal_translate", path),
            NotFullRaster { path } | TiffFeature { path, .. } => ("rewrite it: gdal_translate", path),
            Geographic { path, .. } => ("project it, to your own zone: gdalwarp -t_srs EPSG:32611 -r bilinear", path),
            NoPosition { path } | ControlPoints { path, .. } | Rotated { path, .. } => {
                ("warp it onto a north-up grid: gdalwarp -r bilinear", path)
            }
            Picture { path, remedy: Some(remedy), .. } => (*remedy, path),
            NotClasses { path, .. } => ("rewrite it: gdal_translate -ot Byte", path),
            NotFeatures { path, found } if found.contains("OpenStreetMap data") => {
                return Some(format!(
                    "rewrite it: osmium cat -o out.osm.pbf {}",
                    for_a_shell(&path.display().to_string())
                ));
            }
            _ => return None,
        };
        Some(format!("{words} {} out.tif", for_gdal(path)))
    }

    /// Hints about files of lines and polygons.
    fn words_on_features(&self) -> Option<&'static str> {
        use SourceError::*;
        let has = |found: &str, words: &[&str]| words.iter().any(|word| found.contains(word));
        Some(match self {
            NotFeatures { found, .. } => match found.as_str() {
                found if has(found, &["raster"]) => {
                    "rasters of heights go into dem.sources; features come from files of lines and polygons"
                }
                found if has(found, &["an empty file"]) => "the file was not copied or unpacked whole; fetch it again",
                found if has(found, &["archive", "gzip", "bzip2 file"]) => "unpack it and name the file in it",
                found if has(found, &["encoded as"]) => {
                    "write them as well-known binary: ogr2ogr -lco GEOMETRY_ENCODING=WKB out.parquet in.parquet"
                }
                found if has(found, &["Shapefile"]) => "name the .shp; the others are found beside it",
                _ => "name a file of lines or polygons; ogr2ogr makes a GeoPackage of most others",
            },
            Layer { found, .. } if has(found, &["no table", "computed"]) => {
                "make a plain table of it: ogr2ogr out.gpkg in.gpkg LAYER"
            }
            Layer { .. } => "name a layer: sources = [{ file = \"…\", layer = \"…\" }]; ogrinfo lists them",
            FeatureCrs { .. } => "say what it is: features.sources = [{ file = \"…\", crs = \"EPSG:…\" }]",
            NoOtherCrs { .. } => "remove crs",
            Packing { .. } => "pack it anew: ogr2ogr -lco COMPRESSION=ZSTD out.parquet in.parquet",
            OtherFormat { found, .. } if has(found, &["features"]) => {
                "name a raster here; files of lines and polygons go into features.sources"
            }
            TooLarge { what, .. } if has(what, &["block"]) => {
                "no extract of OpenStreetMap has such blocks: the file is damaged; fetch it again"
            }
            OutOfProportion { .. } => "it repeats itself, as no map does: the file is damaged or made to do harm",
            TooLarge { what: "bytes" | "features (or more)", .. } => {
                "cut the part you need: ogr2ogr -spat WEST SOUTH EAST NORTH out.gpkg in.…"
            }
            _ => return None,
        })
    }

    fn words(&self) -> Option<&'static str> {
        use SourceError::*;
        Some(match self {
            Open { .. } => "check the path and its permissions; paths in a job are relative to the job file",
            NotAFile { found: A_DATABASE, .. } => {
                "name a raster; `tiefort export --format geotiff` makes one of a database"
            }
            NotAFile { found: A_FOLDER, .. } => "name the files in it",
            NotAFile { found: A_DANGLING_LINK, .. } => "remove the link, or mend where it leads",
            NotAFile { .. } => "it cannot be read twice: copy what it gives into a file",
            Empty { .. } => "the file was not copied or unpacked whole; fetch it again",
            Changed { .. } => "leave sources alone during a build; run the same command again",
            Malformed { what, .. } if what.contains("nodata") => {
                "give it a number: gdal_translate -a_nodata -9999 in.… out.tif"
            }
            Read { .. } | Truncated { .. } | Malformed { .. } | BrokenChunk { .. } => {
                "the file is damaged or was not copied whole; fetch it again; what `tiefort fetch` brought \
                 comes anew with --update"
            }
            Checksum { .. } => {
                "the file is damaged, or its writer computed no checksums; without strict reading it is used"
            }
            ArchiveHolds { .. } => "unpack it and name the raster",
            HeaderAlone { .. } => "name the file of heights; its header is found beside it",
            OtherFormat { found: A_JOB, .. } => "name a raster, such as those in dem.sources of the job",
            OtherFormat { .. } => "name a raster; if it was fetched from the web, look at what came instead",
            Picture { .. } => "name a picture of the ground from above; jobs, notes and tables are none",
            UnknownFormat { .. } => "look at it with gdalinfo; what that knows, gdal_translate makes a GeoTIFF of",
            NotHgtSize { .. } => "the tile was not copied or unpacked whole, or is of another make; fetch it again",
            NoCorner { .. } => "give its south-west corner: { file = \"x.hgt\", corner = [35, -117] }, latitude first",
            NotTiff { .. } => "DEMs and class rasters are GeoTIFF files; gdal_translate converts other formats",
            TooLarge { .. } => "cut the part you need with gdal_translate -projwin, or tile the file",
            NoCrs { .. } => {
                "say what it is: dem.sources = [{ file = \"…\", crs = \"EPSG:…\" }], or put a .prj beside it"
            }
            UnnamedCrs { .. } | LinearUnit { .. } | OtherCrs { .. } => {
                "project it to the area's system: gdalwarp -t_srs EPSG:… -r bilinear in.tif out.tif, or change area.crs"
            }
            VerticalUnit { .. } => {
                "say how many metres a unit is: dem.sources = [{ file = \"…\", height_unit_m = 0.3048 }]"
            }
            TooFine { .. } => {
                "its header is wrong; write it with the right corners: gdal_translate -a_ullr WEST NORTH EAST SOUTH"
            }
            OutsideArea { .. } => "check area.crs and area.origin_m, and the file's own coordinate system",
            NotCovered { .. } => "move area.origin_m, make area.size_m smaller, or give a DEM that reaches farther",
            Voids { .. } => {
                "set dem.voids = { fill_within_posts = 8 } to fill small gaps, or \"hole\" to leave them out"
            }
            VoidsTooFar { .. } => "raise fill_within_posts, set dem.voids = \"hole\", or move the area",
            Gaps { .. } => "add a source that covers the rest, make the area smaller, or set dem.voids = \"hole\"",
            MosaicVoids { .. } => {
                "set dem.voids = { next_source = true, fill_within_posts = 8 }, or \"hole\" to leave them out"
            }
            AllVoid { .. } => "check area.origin_m, and the file's nodata tag",
            Infinite { .. } | HeightOutOfRange { .. } => {
                "mark such posts as void: gdal_translate -a_nodata … ; if heights are not metres set dem.height_unit_m"
            }
            NotGeoJson { .. } => "give GeoJSON, a Shapefile or a GeoPackage; from others: ogr2ogr out.geojson in.…",
            NotPolygons { .. } | NoPolygons { .. } => "give polygons: ogr2ogr -where \"OGR_GEOMETRY='POLYGON'\" …",
            Ring { .. } => "repair it: ogr2ogr -makevalid out.geojson in.geojson",
            Given { .. } => "give GeoJSON, or comma-separated values with a header: east,north,height_m",
            PolygonCrs { .. } => {
                "project it: ogr2ogr -t_srs EPSG:… -lco RFC7946=NO out.geojson in.geojson (with the area's code)"
            }
            // All others have a command instead.
            _ => return None,
        })
    }
}

/// What a path may lead to instead of a raster, in words that a hint goes by.
pub(crate) const A_FOLDER: &str = "a folder";
pub(crate) const A_DATABASE: &str = "the folder of a terrain database";
pub(crate) const A_DANGLING_LINK: &str = "a link that leads nowhere";
pub(crate) const A_JOB: &str = "a job file, not a raster";
pub(crate) const A_TEXT: &str = "a text file, not a raster";

/// `path` as GDAL opens it and a shell takes it: packed files through the virtual systems it has for them.
fn for_gdal(path: &Path) -> String {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    let system = match ending.as_str() {
        "gz" => "/vsigzip/",
        "zip" => "/vsizip/",
        _ => "",
    };
    for_a_shell(&format!("{system}{}", path.display()))
}

/// A word as a shell takes it.
fn for_a_shell(name: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:@%".contains(c);
    if name.chars().all(is_plain) { name.to_owned() } else { format!("'{}'", name.replace('\'', "'\\''")) }
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

/// A number in a few characters, whatever it is.
pub fn short(number: f64) -> String {
    if number.abs() < 1e12 || number.is_nan() { number.to_string() } else { format!("{number:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hint_with_a_command_names_the_file_as_it_is_to_be_typed() {
        let hint = |path: &str| SourceError::OtherFormat { path: path.into(), found: "a USGS DEM" }.hint();
        let check = |path, named: &str| {
            assert_eq!(hint(path), Some(format!("convert it: gdal_translate {named} out.tif")));
        };
        check("dem/ranges.dem", "dem/ranges.dem");
        check("a b.dem", "'a b.dem'");
        check("it's.dem", "'it'\\''s.dem'");
        check("SainteHelens.dem.gz", "/vsigzip/SainteHelens.dem.gz");
        check("x.zip", "/vsizip/x.zip");
    }
}
