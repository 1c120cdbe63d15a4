//! What a file may ask of us: every limit of the readers, each with its reason.

/// Posts on a side of a raster: a side of the working grid is at most 2^30 posts, and 2^20 posts of the finest
/// public terrain (1 m) already are 1000 km, the largest area there is.
pub const POSTS_A_SIDE_MAX: u64 = 1 << 20;
/// Posts of a raster: whole rasters are held in memory, and 2^31 posts of 16 bits are 4 GiB.
pub const POSTS_MAX: u64 = 1 << 31;
/// Bytes of one strip or tile once decoded: it is decoded whole, by every worker at once.
pub const CHUNK_BYTES_MAX: u64 = 1 << 29;
/// Strips or tiles of a file: their offsets and lengths are held in memory (at about 80 bytes each while read).
pub const CHUNKS_MAX: u64 = 1 << 22;
/// Tags of a directory: the standard names about 100.
pub const TAGS_MAX: u64 = 4096;
/// Directories looked at for a mask of voids: overviews come in powers of two, so 20 suffice for any raster.
pub const DIRECTORIES_MAX: usize = 64;
/// Bytes that a gzip or zip file may unpack to: it is unpacked in memory, and the largest tiles that come so (DTED 2,
/// HGT of one second) have 26 MB.
pub const UNPACKED_BYTES_MAX: u64 = 1 << 28;
/// Files in an archive: one is the raster, the others describe it.
pub const ARCHIVE_ENTRIES_MAX: usize = 1000;
/// Bytes of a GeoJSON file: it is parsed whole, into about ten times as much memory.
pub const GEOJSON_BYTES_MAX: u64 = 256 << 20;
/// Heights in metres to either side of 0: 24 bits of quanta, and no ground on any planet is higher.
pub const HEIGHT_M_MAX: f64 = 131_071.0;
/// Layers of a GeoPackage: each is a query of its own.
pub const LAYERS_MAX: usize = 1000;
/// Features of a layer of a GeoPackage: its polygons are held in memory.
pub const ROWS_MAX: u64 = 1 << 22;
