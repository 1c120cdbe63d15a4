//! One picture of a file: the full one, an overview, or a mask of one; cut into strips or tiles.

use std::sync::Arc;

use crate::store::Store;
use crate::unpacked::Packing;

/// Pixels of a picture that are decoded for one square, but for the last strip or tile.
pub(super) const PIXELS_MAX: u64 = 1 << 22;

/// How strips and tiles are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packed {
    /// As rasters of heights are, too.
    Plainly(Packing),
    Jpeg,
}

/// What the numbers of a pixel mean.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Colors {
    Grey {
        /// Whether 0 is white.
        is_inverted: bool,
    },
    /// The first three numbers.
    Rgb,
    /// A number of this table.
    Palette(Arc<[[u8; 3]]>),
}

/// Sizes, packing and place of a picture in its file, all within the limits.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub store: Store,
    pub cols: u32,
    pub rows: u32,
    /// Columns and rows of a strip or tile, padding included.
    pub chunk_cols: u32,
    pub chunk_rows: u32,
    pub is_tiled: bool,
    pub packed: Packed,
    /// Whether each number is the step from the one before.
    pub is_predicted: bool,
    pub is_big_endian: bool,
    /// Numbers of a pixel, and bits of each.
    pub bands: u32,
    pub bits: u32,
    /// Whether each band has strips or tiles of its own.
    pub is_planar: bool,
    pub colors: Colors,
    /// Whether its JPEGs hold brightness and hues, and not red, green and blue.
    pub is_ycbcr: bool,
    /// Which number of a pixel says how opaque it is, and whether the colours are multiplied with that.
    pub alpha: Option<(u32, bool)>,
    /// The number that all colours of a pixel have where there is none.
    pub nodata: Option<u16>,
    /// Of 16-bit colours: what is black and what is white.
    pub range: [u16; 2],
    pub jpeg_tables: Arc<[u8]>,
    /// Where each strip or tile begins in the file, and its bytes.
    pub chunks: Arc<[(u64, u64)]>,
    /// Where the picture is and where there is none.
    pub mask: Option<Box<Level>>,
}

impl Level {
    pub fn chunks_across(&self) -> u32 {
        self.cols.div_ceil(self.chunk_cols)
    }

    pub fn chunks_down(&self) -> u32 {
        self.rows.div_ceil(self.chunk_rows)
    }

    /// Rows that a strip or tile holds: a tile is filled up, the last strip ends with the picture.
    pub fn rows_of(&self, chunk: u32) -> u32 {
        let first = chunk / self.chunks_across() * self.chunk_rows;
        if self.is_tiled { self.chunk_rows } else { self.chunk_rows.min(self.rows - first) }
    }

    /// Column and row of the first pixel of a strip or tile.
    pub fn corner_of(&self, chunk: u32) -> [u32; 2] {
        [chunk % self.chunks_across() * self.chunk_cols, chunk / self.chunks_across() * self.chunk_rows]
    }

    /// Numbers of a pixel that one strip or tile holds.
    pub fn bands_together(&self) -> u32 {
        if self.is_planar { 1 } else { self.bands }
    }

    /// Numbers of a pixel that make its colour.
    pub fn color_bands(&self) -> u32 {
        if self.colors == Colors::Rgb { 3 } else { 1 }
    }

    /// Bytes of a row of a strip or tile, unpacked.
    pub fn row_bytes(&self) -> usize {
        (self.chunk_cols as usize * self.bands_together() as usize * self.bits as usize).div_ceil(8)
    }
}
