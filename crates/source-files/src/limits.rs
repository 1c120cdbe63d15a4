//! What a file may ask of us: every limit of the readers, each with its reason; and how much memory what is read of one
//! file may take, by how large the file is.
//!
//! Packed data repeats itself, and so do files that were made to do harm: 442 kB of OpenStreetMap data may unpack to a
//! way of 96 million nodes. What is kept is counted as it grows, and a file that asks for more than its share is
//! refused before it has it. The count does not depend on who works on which part.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::SourceError;

/// Posts on a side of a raster: a side of the working grid is at most 2^30 posts, and 2^20 posts of the finest
/// public terrain (1 m) already are 1000 km, the largest area there is.
pub(crate) const POSTS_A_SIDE_MAX: u64 = 1 << 20;
/// Posts of a raster: whole rasters are held in memory, and 2^31 posts of 16 bits are 4 GiB.
pub const POSTS_MAX: u64 = 1 << 31;
/// Bytes of one strip or tile once decoded: it is decoded whole, by every worker at once.
pub(crate) const CHUNK_BYTES_MAX: u64 = 1 << 29;
/// Bytes of one strip or tile once decoded, whatever the size of its file.
pub(crate) const CHUNK_BYTES_FREE: u64 = 64 << 20;
/// Bytes beside that for each byte of the file: flat ground is packed to a thousandth, but not in pieces of that size.
pub(crate) const CHUNK_BYTES_A_BYTE: u64 = 64;
/// Strips or tiles of a file: their offsets and lengths are held in memory (at about 80 bytes each while read).
pub(crate) const CHUNKS_MAX: u64 = 1 << 22;
/// Tags of a directory: the standard names about 100.
pub const TAGS_MAX: u64 = 4096;
/// Directories looked at for a mask of voids: overviews come in powers of two, so 20 suffice for any raster.
pub(crate) const DIRECTORIES_MAX: usize = 64;
/// Bytes that a gzip or zip file may unpack to: it is unpacked in memory, and the largest tiles that come so (DTED 2,
/// HGT of one second) have 26 MB.
pub(crate) const UNPACKED_BYTES_MAX: u64 = 1 << 28;
/// Files in an archive: one is the raster, the others describe it.
pub(crate) const ARCHIVE_ENTRIES_MAX: usize = 1000;
/// Bytes of a GeoJSON file: it is parsed whole, into about ten times as much memory.
pub(crate) const GEOJSON_BYTES_MAX: u64 = 256 << 20;
/// Heights in metres to either side of 0: 24 bits of quanta, and no ground on any planet is higher.
pub const HEIGHT_M_MAX: f64 = 131_071.0;
/// Layers of a GeoPackage: each is a query of its own.
pub(crate) const LAYERS_MAX: usize = 1000;
/// Features of a layer of a GeoPackage: its polygons are held in memory.
pub const ROWS_MAX: u64 = 1 << 22;
/// Bytes of the head of a block of OpenStreetMap data: the format's own limit.
pub(crate) const OSM_HEAD_BYTES_MAX: u64 = 64 << 10;
/// Bytes of a block of OpenStreetMap data, packed or unpacked: the format's own limit.
pub(crate) const OSM_BLOCK_BYTES_MAX: u64 = 32 << 20;
/// Texts, and groups, of a block of OpenStreetMap data: blocks hold 8000 things, each with some tens of tags at most.
pub(crate) const OSM_STRINGS_MAX: usize = 1 << 20;
/// Numbers in one list of OpenStreetMap data, such as the nodes of a way: the project's own data has at most 2000 for
/// ways and 32,000 for relations, other makers' contour lines some ten thousand.
pub(crate) const OSM_NUMBERS_MAX: usize = 1 << 20;
/// Bytes of memory that what is read of a file of lines and polygons may take, whatever its size: 2 million vertices.
pub(crate) const FEATURE_BYTES_FREE: u64 = 64 << 20;
/// Bytes of memory beside that for each byte of the file: real extracts, packed as they are, take fewer than 10.
pub(crate) const FEATURE_BYTES_A_BYTE: u64 = 64;
/// Bytes of memory that what is read of one file may take at most: what the largest machines at hand have to spare.
pub(crate) const FEATURE_BYTES_MAX: u64 = 16 << 30;
/// Bytes that a packed file of lines and polygons may unpack to, whatever its size.
pub(crate) const UNPACKED_FEATURE_BYTES_FREE: u64 = 16 << 20;
/// Bytes beside that for each byte of it: indented GeoJSON is packed to a tenth, tables of a Shapefile that are mostly
/// blanks to a thirtieth.
pub(crate) const UNPACKED_FEATURE_BYTES_A_BYTE: u64 = 48;
/// Things about features that are told one by one; what comes after them is counted.
pub const REMARKS_MAX: usize = 10_000;
/// Rings of one polygon: which lies in which is found by comparing them.
pub(crate) const RINGS_MAX: usize = 1 << 14;
/// Bytes of a Shapefile's shapes, and of its table: both are held in memory while features are read.
pub(crate) const SHAPEFILE_BYTES_MAX: u64 = 512 << 20;
/// Bytes of the footer of a Parquet file: those of Overture, with some hundred row groups, have some millions.
#[cfg(feature = "geoparquet")]
pub(crate) const PARQUET_FOOTER_BYTES_MAX: u64 = 64 << 20;
/// Bytes of a page of a Parquet file once unpacked: pages have a million, but some writers make one of a column.
#[cfg(feature = "geoparquet")]
pub(crate) const PARQUET_PAGE_BYTES_MAX: u64 = 1 << 28;
/// Values of the columns of a Parquet file that are read, whatever its size.
#[cfg(feature = "geoparquet")]
pub(crate) const PARQUET_VALUES_FREE: u64 = 1 << 20;
/// Values beside that for each byte of it: absent ones take hardly any, but each row has a geometry.
#[cfg(feature = "geoparquet")]
pub(crate) const PARQUET_VALUES_A_BYTE: u64 = 4;

/// Bytes that a vertex takes on its way: as it is read, projected, cut and kept.
pub(crate) const VERTEX_BYTES: usize = 32;

/// What a file may take, and what it has taken so far.
#[derive(Debug)]
pub(crate) struct Allowance {
    path: PathBuf,
    file_bytes: u64,
    bytes_max: u64,
    taken: AtomicU64,
}

impl Allowance {
    /// For the file at `path`, which has so many bytes.
    pub(crate) fn new(path: &Path, file_bytes: u64) -> Self {
        let bytes_max = FEATURE_BYTES_FREE.saturating_add(FEATURE_BYTES_A_BYTE.saturating_mul(file_bytes));
        Self { path: path.into(), file_bytes, bytes_max: bytes_max.min(FEATURE_BYTES_MAX), taken: AtomicU64::new(0) }
    }

    /// The file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Counts bytes that are about to be taken.
    ///
    /// # Errors
    /// When they and all before are more than the file may take.
    pub(crate) fn take(&self, bytes: usize) -> Result<(), SourceError> {
        self.count(bytes);
        self.check()
    }

    /// Counts bytes where nothing can be refused.
    pub(crate) fn count(&self, bytes: usize) {
        self.taken.fetch_add(bytes as u64, Ordering::Relaxed);
    }

    /// Whether more was counted than the file may take.
    pub(crate) fn is_spent(&self) -> bool {
        self.bytes_max < self.taken.load(Ordering::Relaxed)
    }

    /// The refusal where more was counted than the file may take.
    pub(crate) fn check(&self) -> Result<(), SourceError> {
        match self.is_spent() {
            false => Ok(()),
            true => Err(SourceError::OutOfProportion {
                path: self.path.clone(),
                file_bytes: self.file_bytes,
                limit: self.bytes_max,
            }),
        }
    }
}
