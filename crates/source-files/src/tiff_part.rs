//! A part of a TIFF: one of its levels, with some of its strips or tiles only.
//!
//! What the file says stays byte for byte as it was, and so does every strip or tile that is copied. One that is not
//! copied has neither place nor length, as sparse files leave out what is void. So a window of the copy is that window
//! of the whole file, down to the last bit of where its posts lie.

use std::io::{self, Read, Seek, Write};
use std::path::Path;

use crate::SourceError;
use crate::directory::{Bytes, RawTag, number, tag};
use crate::limits::{CHUNKS_MAX, DIRECTORIES_MAX};

/// Marks in `NewSubfileType`.
const REDUCED: u64 = 1;
const MASK: u64 = 4;

const SUBFILE_TYPE: u16 = 254;
const STRIP_OFFSETS: u16 = 273;
const STRIP_SIZES: u16 = 279;
const TILE_OFFSETS: u16 = 324;
const TILE_SIZES: u16 = 325;
const PIXEL_SCALE: u16 = 33550;
const TIE_POINT: u16 = 33922;
const TRANSFORMATION: u16 = 34264;
const GEO_KEYS: u16 = 34735;
/// Where a raster lies and what its samples mean: GeoKeys with their numbers and texts, GDAL's metadata and nodata.
const PLACE: [u16; 8] = [PIXEL_SCALE, TIE_POINT, TRANSFORMATION, GEO_KEYS, 34736, 34737, 42112, 42113];
/// Places of other directories, which are not copied.
const POINTERS: [u16; 4] = [330, 34665, 34853, 40965];
const NODATA: u16 = 42113;
const SAMPLE_FORMAT: u16 = 339;
/// Kinds of values: text, 32 bits, 64 bits, doubles.
const ASCII: u16 = 2;
const LONG: u16 = 4;
const LONG8: u16 = 16;
const DOUBLE: u16 = 12;

/// What the directories of a TIFF say: the raster itself, then its overviews, as they come.
#[derive(Clone, Debug)]
pub struct TiffLevels {
    is_little: bool,
    is_big_tiff: bool,
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    tags: Vec<RawTag>,
    /// Columns and rows of posts.
    size: [u64; 2],
    /// Where each strip or tile begins, and its bytes; 0 where there is none.
    chunks: Vec<(u64, u64)>,
}

impl TiffLevels {
    /// Reads the directories of the `len` bytes of `file`; `path` is for messages.
    ///
    /// # Errors
    /// When it is no TIFF, a value lies outside, there are more strips or tiles than are read, or voids are in a mask.
    pub fn read(file: &mut (impl Read + Seek), len: u64, path: &Path) -> Result<Self, SourceError> {
        let mut bytes = Bytes::new(path, file, len);
        let mut next = bytes.header()?;
        let mut levels = Vec::new();
        for index in 0..DIRECTORIES_MAX {
            if next == 0 {
                break;
            }
            let (tags, after) = bytes.raw_directory(next, CHUNKS_MAX)?;
            next = after;
            let number = |wanted| tags.iter().find(|tag| tag.tag == wanted).and_then(|tag| bytes.first(tag));
            let kind = number(SUBFILE_TYPE).unwrap_or(0);
            if kind & MASK != 0 {
                return Err(SourceError::InternalMask { path: path.into() });
            }
            if index == 0 || kind & REDUCED != 0 {
                let size = [tag::IMAGE_WIDTH, tag::IMAGE_LENGTH].map(|side| number(side).unwrap_or(0));
                let chunks = chunks(&bytes, &tags, path, len)?;
                levels.push(Level { tags, size, chunks });
            }
        }
        let is_usable = levels.first().is_some_and(|level| level.size.iter().all(|&side| 0 < side));
        if !is_usable {
            return Err(SourceError::NotFullRaster { path: path.into() });
        }
        let (is_little, is_big_tiff) = (bytes.is_little(), bytes.is_big_tiff());
        // A matrix may turn the raster; the overviews of such a one are left alone.
        if levels[0].tags.iter().any(|tag| tag.tag == TRANSFORMATION) {
            levels.truncate(1);
        }
        levels.retain(|level| level.size.iter().all(|&side| 0 < side));
        Ok(Self { is_little, is_big_tiff, levels })
    }

    /// How many levels there are; 0 is the raster itself.
    pub fn count(&self) -> usize {
        self.levels.len()
    }

    /// Posts of the raster from west to east and from south to north for one of a level.
    pub fn factors(&self, level: usize) -> [f64; 2] {
        [0, 1].map(|axis| self.levels[0].size[axis] as f64 / self.levels[level].size[axis] as f64)
    }

    /// Where a strip or tile of a level begins in the file, and its bytes; 0 where it is left out as all void.
    pub fn chunk(&self, level: usize, chunk: u32) -> (u64, u64) {
        self.levels[level].chunks[chunk as usize]
    }

    /// Writes a level as a file of its own with the strips or tiles `wanted`, in order; `data` gives the bytes of each.
    ///
    /// # Errors
    /// Those of `out` and of `data`, and bytes of another length than the file says.
    pub fn write(
        &self,
        level: usize,
        wanted: &[u32],
        out: &mut impl Write,
        mut data: impl FnMut(u32) -> io::Result<Vec<u8>>,
    ) -> io::Result<()> {
        let chunks = &self.levels[level].chunks;
        let sizes: Vec<u64> = wanted.iter().map(|&chunk| chunks[chunk as usize].1).collect();
        let mut tables = (vec![0; chunks.len()], vec![0; chunks.len()]);
        // The directory is as long whatever the places in it, so it is written once to know where the chunks begin.
        let mut at = self.directory(level, &tables).len() as u64;
        for (&chunk, &size) in wanted.iter().zip(&sizes).filter(|&(_, &size)| 0 < size) {
            (tables.0[chunk as usize], tables.1[chunk as usize]) = (at, size);
            at += size;
        }
        out.write_all(&self.directory(level, &tables))?;
        for (&chunk, &size) in wanted.iter().zip(&sizes).filter(|&(_, &size)| 0 < size) {
            let bytes = data(chunk)?;
            if bytes.len() as u64 != size {
                let message = format!("strip or tile {chunk} has {} bytes, expected {size}", bytes.len());
                return Err(io::Error::new(io::ErrorKind::InvalidData, message));
            }
            out.write_all(&bytes)?;
        }
        Ok(())
    }

    /// The header and the directory of a level with these places and lengths of strips or tiles.
    fn directory(&self, level: usize, tables: &(Vec<u64>, Vec<u64>)) -> Vec<u8> {
        let tags = self.tags(level, tables);
        let (header, count_size, entry_size, room) = if self.is_big_tiff { (16, 8, 20, 8) } else { (8, 2, 12, 4) };
        let mut bytes = match (self.is_little, self.is_big_tiff) {
            (true, false) => b"II\x2a\0".to_vec(),
            (false, false) => b"MM\0\x2a".to_vec(),
            (true, true) => b"II\x2b\0\x08\0\0\0".to_vec(),
            (false, true) => b"MM\0\x2b\0\x08\0\0".to_vec(),
        };
        self.put(&mut bytes, header as u64, room);
        self.put(&mut bytes, tags.len() as u64, count_size);
        let mut values = Vec::new();
        let first = header + count_size + tags.len() * entry_size + room;
        for tag in &tags {
            self.put(&mut bytes, tag.tag.into(), 2);
            self.put(&mut bytes, tag.kind.into(), 2);
            self.put(&mut bytes, tag.count, room);
            match tag.bytes.len() <= room {
                true => {
                    bytes.extend(&tag.bytes);
                    bytes.extend(std::iter::repeat_n(0, room - tag.bytes.len()));
                }
                false => {
                    self.put(&mut bytes, (first + values.len()) as u64, room);
                    values.extend(&tag.bytes);
                    // Values begin at even places.
                    values.extend(std::iter::repeat_n(0, values.len() % 2));
                }
            }
        }
        self.put(&mut bytes, 0, room);
        bytes.append(&mut values);
        bytes
    }

    /// The tags of a level written alone, sorted.
    fn tags(&self, level: usize, (offsets, sizes): &(Vec<u64>, Vec<u64>)) -> Vec<RawTag> {
        let (whole, own) = (&self.levels[0], &self.levels[level]);
        let is_of_chunks = |tag: u16| [STRIP_OFFSETS, STRIP_SIZES, TILE_OFFSETS, TILE_SIZES].contains(&tag);
        let is_kept = |tag: &&RawTag| tag.tag != SUBFILE_TYPE && !POINTERS.contains(&tag.tag) && !is_of_chunks(tag.tag);
        let of_picture = own.tags.iter().filter(is_kept).filter(|tag| !PLACE.contains(&tag.tag));
        let of_place = whole.tags.iter().filter(|tag| PLACE.contains(&tag.tag));
        let mut tags: Vec<RawTag> = of_picture.cloned().collect();
        tags.extend(of_place.map(|tag| if level == 0 { tag.clone() } else { self.coarser(tag, level) }));
        let is_tiled = own.tags.iter().any(|tag| tag.tag == TILE_OFFSETS);
        let names = if is_tiled { [TILE_OFFSETS, TILE_SIZES] } else { [STRIP_OFFSETS, STRIP_SIZES] };
        let (kind, size) = if self.is_big_tiff { (LONG8, 8) } else { (LONG, 4) };
        for (tag, numbers) in names.into_iter().zip([offsets, sizes]) {
            let mut bytes = Vec::with_capacity(numbers.len() * size);
            numbers.iter().for_each(|&number| self.put(&mut bytes, number, size));
            tags.push(RawTag { tag, kind, count: numbers.len() as u64, bytes });
        }
        // What is left out would be 0 for readers of sparse files; as no number it is no ground. Whole numbers have no
        // such value, and a file that leaves something out itself means what it says.
        let is_of = |tag: u16| own.tags.iter().chain(&whole.tags).find(|own| own.tag == tag);
        let is_float = is_of(SAMPLE_FORMAT).is_some_and(|tag| number(self.is_little, &tag.bytes) == 3);
        if is_float && is_of(NODATA).is_none() && own.chunks.iter().all(|&(_, size)| 0 < size) {
            tags.push(RawTag { tag: NODATA, kind: ASCII, count: 4, bytes: b"nan\0".to_vec() });
        }
        tags.sort_by_key(|tag| tag.tag);
        tags
    }

    /// The pixel scale and the tie point of an overview: its pixels cover the same ground as the raster's.
    fn coarser(&self, tag: &RawTag, level: usize) -> RawTag {
        let factors = self.factors(level);
        let change: &dyn Fn(usize, f64) -> f64 = match tag.tag {
            PIXEL_SCALE => &|at, number| number * factors.get(at).copied().unwrap_or(1.0),
            // Columns and rows count from the corner of the first pixel, or from its centre.
            TIE_POINT if self.is_point() => {
                &|at, number| factors.get(at % 6).map_or(number, |factor| (number + 0.5) / factor - 0.5)
            }
            TIE_POINT => &|at, number| factors.get(at % 6).map_or(number, |factor| number / factor),
            _ => return tag.clone(),
        };
        if tag.kind != DOUBLE {
            return tag.clone();
        }
        let number = |eight: &[u8]| f64::from_bits(number(self.is_little, eight));
        let mut bytes = Vec::new();
        for (at, eight) in tag.bytes.chunks_exact(8).enumerate() {
            self.put(&mut bytes, change(at, number(eight)).to_bits(), 8);
        }
        RawTag { bytes, ..tag.clone() }
    }

    /// Whether a pixel's coordinates are those of its centre.
    fn is_point(&self) -> bool {
        const RASTER_TYPE: u64 = 1025;
        let keys = self.levels[0].tags.iter().find(|tag| tag.tag == GEO_KEYS);
        let shorts = |tag: &RawTag| tag.bytes.chunks_exact(2).map(|two| number(self.is_little, two)).collect();
        let shorts: Vec<u64> = keys.map(shorts).unwrap_or_default();
        shorts.chunks_exact(4).skip(1).any(|key| key[0] == RASTER_TYPE && key[3] == 2)
    }

    /// Appends a number of `size` bytes in the file's order.
    fn put(&self, bytes: &mut Vec<u8>, number: u64, size: usize) {
        match self.is_little {
            true => bytes.extend(&number.to_le_bytes()[..size]),
            false => bytes.extend(&number.to_be_bytes()[8 - size..]),
        }
    }
}

/// Where each strip or tile lies, once all are known to lie inside the file.
fn chunks<R: Read + Seek>(
    bytes: &Bytes<R>,
    tags: &[RawTag],
    path: &Path,
    len: u64,
) -> Result<Vec<(u64, u64)>, SourceError> {
    let list = |names: [u16; 2]| {
        let tag = tags.iter().find(|tag| names.contains(&tag.tag));
        tag.map(|tag| bytes.numbers(tag)).unwrap_or_default()
    };
    let (offsets, sizes) = (list([TILE_OFFSETS, STRIP_OFFSETS]), list([TILE_SIZES, STRIP_SIZES]));
    if offsets.len() != sizes.len() || offsets.is_empty() {
        return Err(SourceError::Malformed {
            path: path.into(),
            what: "the table of strips or tiles".into(),
            found: format!("{} offsets and {} lengths", offsets.len(), sizes.len()),
            expected: "one of each for every one".into(),
        });
    }
    let outside = offsets.iter().zip(&sizes).position(|(offset, size)| len < offset.saturating_add(*size));
    if let Some(chunk) = outside {
        let what = format!("strip or tile {chunk} of {}", offsets.len());
        let expected = offsets[chunk].saturating_add(sizes[chunk]);
        return Err(SourceError::Truncated { path: path.into(), what, expected, found: len });
    }
    Ok(offsets.into_iter().zip(sizes).collect())
}
