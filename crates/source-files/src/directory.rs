//! The first directory of a TIFF, read with every number doubted.
//!
//! The `tiff` crate multiplies what a file says before it can be asked what that is. So its sizes are checked here
//! first: every value lies inside the file, and no size is beyond the limits. It also tells a truncated file from
//! one that is no TIFF at all.

use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use crate::SourceError;
use crate::error::at_most;
use crate::limits::{
    CHUNK_BYTES_A_BYTE, CHUNK_BYTES_FREE, CHUNK_BYTES_MAX, CHUNKS_MAX, POSTS_A_SIDE_MAX, POSTS_MAX, TAGS_MAX,
};
use crate::store::{Handle, Store};
use crate::unpacked::Packing;

/// Tags whose values decide how the file is decoded.
pub(crate) mod tag {
    pub const IMAGE_WIDTH: u16 = 256;
    pub const IMAGE_LENGTH: u16 = 257;
    pub const BITS_PER_SAMPLE: u16 = 258;
    pub const COMPRESSION: u16 = 259;
    pub const PHOTOMETRIC: u16 = 262;
    pub const FILL_ORDER: u16 = 266;
    pub const SAMPLES_PER_PIXEL: u16 = 277;
    pub const ROWS_PER_STRIP: u16 = 278;
    pub const PREDICTOR: u16 = 317;
    pub const TILE_WIDTH: u16 = 322;
    pub const TILE_LENGTH: u16 = 323;
    pub const SAMPLE_FORMAT: u16 = 339;
}

/// How one sample is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SampleKind {
    U8,
    U16,
    I16,
    I32,
    F32,
    F64,
}

impl SampleKind {
    pub(crate) fn bytes(self) -> u64 {
        match self {
            SampleKind::U8 => 1,
            SampleKind::U16 | SampleKind::I16 => 2,
            SampleKind::I32 | SampleKind::F32 => 4,
            SampleKind::F64 => 8,
        }
    }
}

/// Sizes of a raster and of the strips or tiles it is cut into, all within the limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    pub cols: u32,
    pub rows: u32,
    /// Columns of a strip or tile, padding included.
    pub chunk_cols: u32,
    /// Rows of a strip or tile, padding included.
    pub chunk_rows: u32,
    pub tiled: bool,
    pub sample: SampleKind,
    pub packing: Packing,
}

impl Layout {
    pub(crate) fn chunks_across(&self) -> u32 {
        self.cols.div_ceil(self.chunk_cols)
    }

    pub(crate) fn chunk_count(&self) -> u32 {
        self.chunks_across() * self.rows.div_ceil(self.chunk_rows)
    }

    /// Rows that a chunk has at least: the last strip may end with the raster, a tile is filled up.
    pub(crate) fn rows_of(&self, chunk: u32) -> u64 {
        u64::from(match self.tiled {
            true => self.chunk_rows,
            false => self.chunk_rows.min(self.rows - chunk * self.chunk_rows),
        })
    }
}

/// Reads the first directory of an open file and checks it.
pub(crate) fn read_layout(store: &Store, file: &mut Handle) -> Result<Layout, SourceError> {
    let path = store.path();
    let directory = first_directory(store, file)?;
    let first = |tag| directory.iter().find(|&&(found, _)| found == tag).map(|&(_, value)| value);
    Facts { path, file_bytes: store.file_bytes(), first: &first }.layout()
}

/// The tags of the first directory, each with the first of its values; all of them lie inside the file.
pub(crate) fn first_directory(store: &Store, file: &mut Handle) -> Result<Vec<(u16, u64)>, SourceError> {
    Bytes::new(store.path(), file, store.len()).directory()
}

/// A tag as it is stored: its number, TIFF's code of the kind of its values, how many there are, and their bytes.
#[derive(Clone, Debug)]
pub(crate) struct RawTag {
    pub tag: u16,
    pub kind: u16,
    pub count: u64,
    pub bytes: Vec<u8>,
}

/// The open file, read at given places and never past its end.
pub(crate) struct Bytes<'a, R> {
    path: &'a Path,
    file: &'a mut R,
    len: u64,
    little: bool,
    big_tiff: bool,
}

impl<'a, R: Read + Seek> Bytes<'a, R> {
    pub(crate) fn new(path: &'a Path, file: &'a mut R, len: u64) -> Self {
        Self { path, file, len, little: true, big_tiff: false }
    }

    pub(crate) fn is_little(&self) -> bool {
        self.little
    }

    pub(crate) fn is_big_tiff(&self) -> bool {
        self.big_tiff
    }

    /// The first value of a tag of whole numbers.
    pub(crate) fn first(&self, tag: &RawTag) -> Option<u64> {
        self.numbers(&RawTag { bytes: tag.bytes.get(..size_of_kind(tag.kind.into()) as usize)?.into(), ..*tag }).pop()
    }

    /// The values of a tag of whole numbers.
    pub(crate) fn numbers(&self, tag: &RawTag) -> Vec<u64> {
        let size = size_of_kind(tag.kind.into()).max(1) as usize;
        tag.bytes.chunks_exact(size).map(|bytes| number(self.little, bytes)).collect()
    }

    /// The tags of the directory at a place, of at most `count_max` values each, and where the next one begins; 0
    /// where it is the last.
    pub(crate) fn raw_directory(&mut self, at: u64, count_max: u64) -> Result<(Vec<RawTag>, u64), SourceError> {
        const WHAT: &str = "a directory";
        let (count, start, size) = self.head(at, WHAT)?;
        let tags = (0..count).map(|index| self.raw_tag(start + index * size, count_max)).collect::<Result<_, _>>()?;
        let after = start + count * size;
        let next = if self.big_tiff { self.number::<8>(after, WHAT) } else { self.number::<4>(after, WHAT) };
        Ok((tags, next?))
    }

    fn raw_tag(&mut self, at: u64, count_max: u64) -> Result<RawTag, SourceError> {
        let (tag, kind, count, place) = self.placed(at)?;
        if count_max < count {
            let path = self.path.into();
            return Err(SourceError::TooLarge { path, what: "values of a tag", found: count, limit: count_max });
        }
        let mut bytes = vec![0; (count * size_of_kind(kind)) as usize];
        let read = self.file.seek(SeekFrom::Start(place)).and_then(|_| self.file.read_exact(&mut bytes));
        read.map_err(|source| SourceError::Read { path: self.path.into(), source })?;
        Ok(RawTag { tag, kind: kind as u16, count, bytes })
    }

    fn take<const N: usize>(&mut self, at: u64, what: &str) -> Result<[u8; N], SourceError> {
        self.holds(at, N as u64, what)?;
        let mut taken = [0; N];
        let read = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.read_exact(&mut taken));
        read.map_err(|source| SourceError::Read { path: self.path.into(), source })?;
        Ok(taken)
    }

    fn holds(&self, at: u64, size: u64, what: &str) -> Result<(), SourceError> {
        let expected = at.saturating_add(size);
        if expected <= self.len {
            return Ok(());
        }
        Err(SourceError::Truncated { path: self.path.into(), what: what.into(), expected, found: self.len })
    }

    /// An unsigned number of `N` bytes in the file's byte order.
    fn number<const N: usize>(&mut self, at: u64, what: &str) -> Result<u64, SourceError> {
        let bytes: [u8; N] = self.take(at, what)?;
        Ok(number(self.little, &bytes))
    }

    /// Where the first directory is.
    pub(crate) fn header(&mut self) -> Result<u64, SourceError> {
        let start: [u8; 4] = match self.len {
            0..4 => Err(self.not_tiff(&[]))?,
            _ => self.take(0, "the header")?,
        };
        (self.little, self.big_tiff) = match &start {
            b"II\x2a\0" => (true, false),
            b"MM\0\x2a" => (false, false),
            b"II\x2b\0" => (true, true),
            b"MM\0\x2b" => (false, true),
            _ => return Err(self.not_tiff(&start)),
        };
        if !self.big_tiff { self.number::<4>(4, "the header") } else { self.number::<8>(8, "the header") }
    }

    fn not_tiff(&self, start: &[u8]) -> SourceError {
        let hex: Vec<String> = start.iter().map(|byte| format!("{byte:02x}")).collect();
        let found = if hex.is_empty() { format!("{} bytes in all", self.len) } else { hex.join(" ") };
        SourceError::NotTiff { path: self.path.into(), found }
    }

    /// Every tag of the first directory with the first of its values, once all its values are known to lie in the file.
    fn directory(&mut self) -> Result<Vec<(u16, u64)>, SourceError> {
        const WHAT: &str = "the first directory";
        let at = self.header()?;
        let (count, start, size) = self.head(at, WHAT)?;
        let directory: Vec<_> = (0..count).map(|index| self.entry(start + index * size)).collect::<Result<_, _>>()?;
        self.refuse_repeated(&directory)?;
        Ok(directory)
    }

    /// How many tags the directory at a place has, where they begin, and the bytes of each.
    fn head(&mut self, at: u64, what: &str) -> Result<(u64, u64, u64), SourceError> {
        let (count, start, size) = match self.big_tiff {
            false => (self.number::<2>(at, what)?, at.saturating_add(2), 12),
            true => (self.number::<8>(at, what)?, at.saturating_add(8), 20),
        };
        if TAGS_MAX < count {
            return Err(SourceError::TooLarge { path: self.path.into(), what: "tags", found: count, limit: TAGS_MAX });
        }
        self.holds(start, count * size, what)?;
        Ok((count, start, size))
    }

    /// Readers differ on which of two equal tags they believe.
    fn refuse_repeated(&self, directory: &[(u16, u64)]) -> Result<(), SourceError> {
        let mut tags: Vec<u16> = directory.iter().map(|&(tag, _)| tag).collect();
        tags.sort_unstable();
        match tags.windows(2).find(|pair| pair[0] == pair[1]) {
            None => Ok(()),
            Some(pair) => Err(SourceError::Malformed {
                path: self.path.into(),
                what: format!("tag {}", pair[0]),
                found: "there twice".into(),
                expected: "to be there once".into(),
            }),
        }
    }

    /// A tag, the kind of its values, how many there are, and where they lie, once that is inside the file.
    fn placed(&mut self, at: u64) -> Result<(u16, u64, u64, u64), SourceError> {
        let tag = self.number::<2>(at, "a tag")? as u16;
        let kind = self.number::<2>(at + 2, "a tag")?;
        let (count, room, at) = match self.big_tiff {
            false => (self.number::<4>(at + 4, "a tag")?, 4, at + 8),
            true => (self.number::<8>(at + 4, "a tag")?, 8, at + 12),
        };
        let bytes = count.saturating_mul(size_of_kind(kind));
        let place = match (room < bytes, self.big_tiff) {
            (false, _) => at,
            (true, false) => self.number::<4>(at, "a tag")?,
            (true, true) => self.number::<8>(at, "a tag")?,
        };
        self.holds(place, bytes, &format!("the value of tag {tag}"))?;
        Ok((tag, kind, count, place))
    }

    fn entry(&mut self, at: u64) -> Result<(u16, u64), SourceError> {
        let (tag, kind, count, place) = self.placed(at)?;
        let (size, what) = (size_of_kind(kind), format!("the value of tag {tag}"));
        let first = match (count, size) {
            (0, _) | (_, 0) => 0,
            (_, 1) => self.number::<1>(place, &what)?,
            (_, 2) => self.number::<2>(place, &what)?,
            (_, 4) => self.number::<4>(place, &what)?,
            _ => self.number::<8>(place, &what)?,
        };
        Ok((tag, first))
    }
}

/// Bytes of a value by TIFF's code of its kind; 0 for kinds that are not known.
fn size_of_kind(kind: u64) -> u64 {
    match kind {
        1 | 2 | 6 | 7 => 1,
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16..=18 => 8,
        _ => 0,
    }
}

/// An unsigned number in either order of bytes.
pub(crate) fn number(is_little: bool, bytes: &[u8]) -> u64 {
    let add = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
    if is_little { bytes.iter().rev().fold(0, add) } else { bytes.iter().fold(0, add) }
}

/// What the first directory says.
struct Facts<'a> {
    path: &'a Path,
    file_bytes: u64,
    first: &'a dyn Fn(u16) -> Option<u64>,
}

impl Facts<'_> {
    fn layout(&self) -> Result<Layout, SourceError> {
        self.check_colours()?;
        let packing = self.packing()?;
        let sample = self.sample()?;
        let cols = self.side(tag::IMAGE_WIDTH, "the width")?;
        let rows = self.side(tag::IMAGE_LENGTH, "the height")?;
        at_most(self.path, u64::from(cols) * u64::from(rows), POSTS_MAX, "posts")?;
        let tiled = (self.first)(tag::TILE_WIDTH).is_some();
        let (chunk_cols, chunk_rows) = match tiled {
            true => (self.side(tag::TILE_WIDTH, "the tile width")?, self.side(tag::TILE_LENGTH, "the tile height")?),
            false => (cols, self.rows_per_strip(rows)?),
        };
        let layout = Layout { cols, rows, chunk_cols, chunk_rows, tiled, sample, packing };
        let posts = u64::from(chunk_cols) * u64::from(chunk_rows);
        let most = CHUNK_BYTES_FREE.saturating_add(CHUNK_BYTES_A_BYTE.saturating_mul(self.file_bytes));
        at_most(self.path, posts * sample.bytes(), most.min(CHUNK_BYTES_MAX), "bytes in a strip or tile")?;
        let chunks = u64::from(layout.chunks_across()) * u64::from(rows.div_ceil(chunk_rows));
        at_most(self.path, chunks, CHUNKS_MAX, "strips or tiles")?;
        Ok(layout)
    }

    fn side(&self, tag: u16, what: &str) -> Result<u32, SourceError> {
        let malformed = |found: &str| SourceError::Malformed {
            path: self.path.into(),
            what: what.into(),
            found: found.into(),
            expected: "a positive number".into(),
        };
        let posts = (self.first)(tag).ok_or_else(|| malformed("missing"))?;
        at_most(self.path, posts, POSTS_A_SIDE_MAX, "posts a side")?;
        if posts == 0 { Err(malformed("0")) } else { Ok(posts as u32) }
    }

    /// Writers that put the whole raster into one strip say "infinitely many" or leave the tag out.
    fn rows_per_strip(&self, rows: u32) -> Result<u32, SourceError> {
        match (self.first)(tag::ROWS_PER_STRIP) {
            None => Ok(rows),
            Some(found) if u64::from(rows) <= found => Ok(rows),
            Some(_) => self.side(tag::ROWS_PER_STRIP, "the number of rows in a strip"),
        }
    }

    fn sample(&self) -> Result<SampleKind, SourceError> {
        let bands = (self.first)(tag::SAMPLES_PER_PIXEL).unwrap_or(1);
        if bands != 1 {
            return Err(SourceError::Bands { path: self.path.into(), found: bands });
        }
        let bits = (self.first)(tag::BITS_PER_SAMPLE).unwrap_or(1);
        let format = (self.first)(tag::SAMPLE_FORMAT).unwrap_or(1);
        match (bits, format) {
            (8, 1) => Ok(SampleKind::U8),
            (16, 1) => Ok(SampleKind::U16),
            (16, 2) => Ok(SampleKind::I16),
            (32, 2) => Ok(SampleKind::I32),
            (32, 3) => Ok(SampleKind::F32),
            (64, 3) => Ok(SampleKind::F64),
            _ => Err(SourceError::SampleFormat { path: self.path.into(), found: sample_name(bits, format) }),
        }
    }

    fn check_colours(&self) -> Result<(), SourceError> {
        if (self.first)(tag::FILL_ORDER).is_some_and(|order| order != 1) {
            let found = "the bits of each byte are stored in reverse".into();
            return Err(SourceError::TiffFeature { path: self.path.into(), found });
        }
        let found = match (self.first)(tag::PHOTOMETRIC) {
            Some(1) => return Ok(()),
            None => "not stated".into(),
            Some(0) => "inverted (white is zero)".into(),
            Some(2) => "RGB".into(),
            Some(3) => "a palette".into(),
            Some(other) => format!("of kind {other}"),
        };
        Err(SourceError::Photometric { path: self.path.into(), found })
    }

    fn packing(&self) -> Result<Packing, SourceError> {
        let code = (self.first)(tag::COMPRESSION).unwrap_or(1);
        let predicted = (self.first)(tag::PREDICTOR).is_some_and(|predictor| predictor != 1);
        match code {
            1 | 32773 if predicted => Err(SourceError::Malformed {
                path: self.path.into(),
                what: "the predictor of a file without LZW, deflate or zstd".into(),
                found: (self.first)(tag::PREDICTOR).unwrap_or(1).to_string(),
                expected: "1 (none)".into(),
            }),
            1 => Ok(Packing::None),
            5 => Ok(Packing::Lzw),
            8 | 32946 => Ok(Packing::Deflate),
            32773 => Ok(Packing::PackBits),
            50000 => Ok(Packing::Zstd),
            _ => Err(SourceError::Compression { path: self.path.into(), found: compression_name(code) }),
        }
    }
}

pub(crate) fn sample_name(bits: u64, format: u64) -> String {
    let format = match format {
        1 => "unsigned",
        2 => "signed",
        3 => "floating point",
        5 | 6 => "complex",
        _ => "of an undefined kind",
    };
    format!("{bits}-bit {format}")
}

pub(crate) fn compression_name(code: u64) -> String {
    let name = match code {
        2..=4 => "CCITT fax",
        6 | 7 => "JPEG",
        34712 => "JPEG 2000",
        34887 => "LERC",
        34925 => "LZMA",
        50001 => "WebP",
        50002 => "JPEG XL",
        _ => return code.to_string(),
    };
    format!("{name} ({code})")
}
