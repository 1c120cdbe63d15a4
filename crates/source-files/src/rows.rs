//! Rasters that are nothing but rows of numbers: SRTM's HGT, and raw grids with a header beside them.

use std::ops::RangeInclusive;

use terrain::PostRect;

use crate::SourceError;
use crate::chunk::{Chunk, Header};
use crate::directory::SampleKind;
use crate::frame::SampleScale;
use crate::samples::Samples;
use crate::store::Store;

/// Bytes decoded at once, about.
const CHUNK_BYTES: u64 = 1 << 20;

/// Where the rows of a raster are and how their numbers are stored. The first row is the northern one.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    pub store: Store,
    pub cols: u32,
    pub rows: u32,
    /// Bytes before the first row.
    pub skipped: u64,
    /// Bytes from row to row.
    pub row_bytes: u64,
    pub kind: SampleKind,
    pub big_endian: bool,
    pub nodata: Option<f64>,
}

/// A raster in chunks of so many whole rows each, counted from the north.
#[derive(Clone, Copy)]
pub(crate) struct RowChunks {
    pub cols: u32,
    pub rows: u32,
    pub rows_per_chunk: u32,
}

impl RowChunks {
    pub(crate) fn posts_of(self, chunk: u32) -> PostRect {
        let first = chunk * self.rows_per_chunk;
        let last = (first + self.rows_per_chunk).min(self.rows) - 1;
        let row = |stored: u32| (self.rows - 1 - stored) as i32;
        PostRect { south: row(last), west: 0, north: row(first), east: self.cols as i32 - 1 }
    }

    /// The chunks that hold some rows, counted from the south.
    pub(crate) fn holding(self, south: i32, north: i32) -> RangeInclusive<u32> {
        let chunk = |row: i32| (self.rows - 1 - row as u32) / self.rows_per_chunk;
        chunk(north)..=chunk(south)
    }
}

impl Rows {
    /// Checks that all rows are there.
    pub(crate) fn check(&self) -> Result<(), SourceError> {
        let end = self.row_bytes.checked_mul(u64::from(self.rows)).and_then(|bytes| bytes.checked_add(self.skipped));
        self.store.holds("the last row", end.unwrap_or(u64::MAX))
    }

    pub(crate) fn header(&self, frame: crate::RasterFrame, unit_m: f64) -> Header {
        let scale = SampleScale { unit_m, ..SampleScale::METRES };
        Header { frame, scale, kind: self.kind, nodata: self.nodata, shift: None }
    }

    /// How its rows fall into chunks.
    pub(crate) fn chunks(&self) -> RowChunks {
        let rows_per_chunk = (CHUNK_BYTES / self.row_bytes.max(1)).clamp(1, u64::from(self.rows)) as u32;
        RowChunks { cols: self.cols, rows: self.rows, rows_per_chunk }
    }

    pub(crate) fn decode(&self, chunk: u32) -> Result<Chunk, SourceError> {
        let chunks = self.chunks();
        let posts = chunks.posts_of(chunk);
        let first = u64::from(chunk * chunks.rows_per_chunk);
        let wide = self.cols as usize * self.kind.bytes() as usize;
        let (at, size) = (self.skipped + first * self.row_bytes, self.row_bytes as usize);
        // The last row of a file need not have the padding that others have.
        let count = (posts.posts_high() - 1) * size + wide;
        let bytes = self.store.bytes_at(&mut self.store.handle()?, at, count)?;
        let rows = bytes.chunks(size).flat_map(|row| &row[..wide]).copied();
        let samples = Samples::from_bytes(self.kind, self.big_endian, &rows.collect::<Vec<u8>>());
        Ok(Chunk { posts, stride: self.cols as usize, south_first: false, samples: Some(samples), notes: Vec::new() })
    }
}
