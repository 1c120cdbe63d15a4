//! What a file says of its picture, its overviews and its masks.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tiff::decoder::IfdDecoder;
use tiff::tags::{ByteOrder, Tag};

use super::level::{Colors, Level, Packed};
use crate::SourceError;
use crate::directory::{compression_name, first_directory, sample_name, tag};
use crate::error::at_most;
use crate::frame::GeoTags;
use crate::geotiff::{decoder, directory_error, geo_tags, nodata};
use crate::limits::{CHUNKS_MAX, DIRECTORIES_MAX, POSTS_A_SIDE_MAX};
use crate::store::Store;
use crate::unpacked::Packing;

/// Numbers of one strip or tile: it is decoded whole, into two bytes each.
const CHUNK_NUMBERS_MAX: u64 = 1 << 26;
/// Numbers of a pixel: what surveys from the air have is below.
const BANDS_MAX: u64 = 256;
/// Pixels of the parts of a picture that is one strip and not packed, about.
const PART_PIXELS: u32 = 1 << 18;

/// Marks in `NewSubfileType`.
const REDUCED: u32 = 1;
const MASK: u32 = 4;

const REPACK: &str = "rewrite it: gdal_translate -co TILED=YES -co COMPRESS=DEFLATE";

/// The picture and its overviews, each with its mask where it has one, and where the picture lies.
///
/// # Errors
/// Whatever makes it unusable.
pub(super) fn levels(store: &Store) -> Result<(Vec<Level>, GeoTags), SourceError> {
    let path = store.path();
    let mut file = store.handle()?;
    // The library multiplies these before it can be asked what they are.
    check_sizes(path, &first_directory(store, &mut file)?)?;
    let mut decoder = decoder(path, file)?;
    let tags = geo_tags(path, &mut decoder)?;
    let is_big_endian = matches!(decoder.byte_order(), ByteOrder::BigEndian);
    // What no pixel can have, or is no number, marks none of them.
    let nodata = nodata(path, &mut decoder).ok().flatten();
    let nodata = nodata.filter(|number| (0.0..=65535.0).contains(number) && number.fract() == 0.0);
    let about = About { store, is_big_endian, nodata: nodata.map(|number| number as u16) };
    let mut next = decoder.image_ifd().directory().next();
    let (mut found, mut masks) = (vec![about.level(&mut decoder.image_ifd())?], Vec::new());
    for _ in 0..DIRECTORIES_MAX {
        let Some(pointer) = next else { break };
        let directory = decoder.read_directory(pointer).map_err(|error| directory_error(path, error))?;
        let mut ifd = decoder.read_directory_tags(&directory);
        next = directory.next();
        let kind = about.number(&mut ifd, Tag::NewSubfileType)?.unwrap_or(0);
        match (kind & REDUCED != 0, kind & MASK != 0) {
            (_, true) => masks.push(about.level(&mut ifd)?),
            (true, false) => found.push(about.level(&mut ifd)?),
            // Another page.
            (false, false) => {}
        }
    }
    for mask in masks {
        if let Some(level) = found.iter_mut().find(|level| (level.cols, level.rows) == (mask.cols, mask.rows)) {
            level.mask = Some(Box::new(mask));
        }
    }
    Ok((found, tags))
}

/// The file of overviews beside a picture.
pub(super) fn overviews_beside(path: &Path) -> Option<PathBuf> {
    let mut name = path.as_os_str().to_owned();
    name.push(".ovr");
    Some(PathBuf::from(name)).filter(|path| path.is_file())
}

fn check_sizes(path: &Path, directory: &[(u16, u64)]) -> Result<(), SourceError> {
    let first = |tag: u16| directory.iter().find(|&&(found, _)| found == tag).map(|&(_, value)| value);
    for (tag, what, limit) in [
        (tag::IMAGE_WIDTH, "pixels across", POSTS_A_SIDE_MAX),
        (tag::IMAGE_LENGTH, "pixels down", POSTS_A_SIDE_MAX),
        (tag::TILE_WIDTH, "pixels across a tile", POSTS_A_SIDE_MAX),
        (tag::TILE_LENGTH, "pixels down a tile", POSTS_A_SIDE_MAX),
        (tag::SAMPLES_PER_PIXEL, "bands", BANDS_MAX),
    ] {
        at_most(path, first(tag).unwrap_or(0), limit, what)?;
    }
    Ok(())
}

/// A band, and whether colours are multiplied with it.
type Alpha = Option<(u32, bool)>;

/// What all directories of a file have in common.
struct About<'a> {
    store: &'a Store,
    is_big_endian: bool,
    nodata: Option<u16>,
}

impl About<'_> {
    fn refused(&self, found: impl Into<String>, expected: &'static str, remedy: &'static str) -> SourceError {
        SourceError::Picture { path: self.store.path().into(), found: found.into(), expected, remedy: Some(remedy) }
    }

    fn number(&self, ifd: &mut IfdDecoder, tag: Tag) -> Result<Option<u32>, SourceError> {
        ifd.find_tag_unsigned(tag).map_err(|error| directory_error(self.store.path(), error))
    }

    fn list<T: TryFrom<u64>>(&self, ifd: &mut IfdDecoder, tag: Tag) -> Result<Vec<T>, SourceError> {
        let list = ifd.find_tag_unsigned_vec(tag).map_err(|error| directory_error(self.store.path(), error))?;
        Ok(list.unwrap_or_default())
    }

    fn level(&self, ifd: &mut IfdDecoder) -> Result<Level, SourceError> {
        let path = self.store.path();
        let (cols, rows) = (self.side(ifd, Tag::ImageWidth, "width")?, self.side(ifd, Tag::ImageLength, "height")?);
        let is_tiled = self.number(ifd, Tag::TileWidth)?.is_some();
        let (chunk_cols, chunk_rows) = match is_tiled {
            true => (self.side(ifd, Tag::TileWidth, "tile width")?, self.side(ifd, Tag::TileLength, "tile height")?),
            false => (cols, self.number(ifd, Tag::RowsPerStrip)?.unwrap_or(rows).clamp(1, rows)),
        };
        let packed = self.packed(ifd)?;
        let bands = self.number(ifd, Tag::SamplesPerPixel)?.unwrap_or(1).max(1);
        at_most(path, bands.into(), BANDS_MAX, "bands")?;
        let photometric = self.number(ifd, Tag::PhotometricInterpretation)?;
        let bits = self.bits(ifd)?;
        let alpha = self.alpha(ifd, photometric, bands)?;
        let jpeg_tables: Vec<u8> = self.list(ifd, Tag::JPEGTables)?;
        let mut level = Level {
            store: self.store.clone(),
            cols,
            rows,
            chunk_cols,
            chunk_rows,
            is_tiled,
            packed,
            is_predicted: self.is_predicted(ifd)?,
            is_big_endian: self.is_big_endian,
            bands,
            bits,
            is_planar: bands != 1 && self.number(ifd, Tag::PlanarConfiguration)? == Some(2),
            colors: self.colors(ifd, photometric, bands, bits)?,
            is_ycbcr: photometric == Some(6),
            alpha,
            nodata: self.nodata,
            range: [0, u16::MAX],
            jpeg_tables: jpeg_tables.into(),
            chunks: Arc::default(),
            mask: None,
        };
        level.chunks = self.chunks(ifd, &level)?.into();
        self.in_parts(&mut level);
        let pixels = u64::from(level.chunk_cols) * u64::from(level.chunk_rows);
        at_most(path, pixels * u64::from(bands), CHUNK_NUMBERS_MAX, "numbers in a strip or tile")?;
        Ok(level)
    }

    fn side(&self, ifd: &mut IfdDecoder, tag: Tag, what: &'static str) -> Result<u32, SourceError> {
        let found = self.number(ifd, tag)?.unwrap_or(0);
        at_most(self.store.path(), found.into(), POSTS_A_SIDE_MAX, "pixels a side")?;
        if 0 < found { Ok(found) } else { Err(self.store.malformed(&format!("the {what}"), "0".into(), "at least 1")) }
    }

    fn packed(&self, ifd: &mut IfdDecoder) -> Result<Packed, SourceError> {
        Ok(Packed::Plainly(match self.number(ifd, Tag::Compression)?.unwrap_or(1) {
            1 => Packing::None,
            5 => Packing::Lzw,
            7 => return Ok(Packed::Jpeg),
            8 | 32946 => Packing::Deflate,
            32773 => Packing::PackBits,
            50000 => Packing::Zstd,
            other => {
                let found = format!("compression {}", compression_name(other.into()));
                return Err(self.refused(found, "none, LZW, deflate, zstd, PackBits or JPEG", REPACK));
            }
        }))
    }

    fn is_predicted(&self, ifd: &mut IfdDecoder) -> Result<bool, SourceError> {
        match self.number(ifd, Tag::Predictor)?.unwrap_or(1) {
            1 => Ok(false),
            2 => Ok(true),
            other => Err(self.refused(format!("predictor {other}"), "1 (none) or 2 (differences)", REPACK)),
        }
    }

    fn bits(&self, ifd: &mut IfdDecoder) -> Result<u32, SourceError> {
        let of_all: Vec<u32> = self.list(ifd, Tag::BitsPerSample)?;
        let bits = of_all.first().copied().unwrap_or(1);
        let formats: Vec<u32> = self.list(ifd, Tag::SampleFormat)?;
        let format = formats.first().copied().unwrap_or(1);
        if matches!((bits, format), (1 | 2 | 4 | 8 | 16, 1)) && of_all.iter().all(|&other| other == bits) {
            return Ok(bits);
        }
        let found = format!("colours are {}", sample_name(bits.into(), format.into()));
        Err(self.refused(found, "8- or 16-bit unsigned", "bring them to 8 bits: gdal_translate -ot Byte -scale"))
    }

    /// Which band says how opaque a pixel is, and whether its colours are multiplied with that.
    fn alpha(&self, ifd: &mut IfdDecoder, photometric: Option<u32>, bands: u32) -> Result<Alpha, SourceError> {
        let extra: Vec<u16> = self.list(ifd, Tag::ExtraSamples)?;
        if extra.is_empty() && (photometric, bands) == (Some(2), 4) {
            // Some writers leave out what the fourth band is.
            return Ok(Some((3, false)));
        }
        let first = bands.saturating_sub(extra.len() as u32);
        let found = extra.iter().position(|kind| matches!(kind, 1 | 2));
        let alpha = found.map(|at| (first + at as u32, extra[at] == 1));
        Ok(alpha.filter(|&(band, _)| band < bands))
    }

    fn colors(
        &self,
        ifd: &mut IfdDecoder,
        photometric: Option<u32>,
        bands: u32,
        bits: u32,
    ) -> Result<Colors, SourceError> {
        const RGB: &str = "rewrite it: gdal_translate -co PHOTOMETRIC=RGB";
        let words = match photometric {
            // What has three bands and no name for them is mostly red, green and blue.
            Some(0 | 1) if 3 <= bands => return Ok(Colors::Rgb),
            Some(kind @ (0 | 1 | 4)) => return Ok(Colors::Grey { is_inverted: kind == 0 }),
            Some(2) if 3 <= bands => return Ok(Colors::Rgb),
            Some(3) if bits <= 8 => {
                let table: Vec<u16> = self.list(ifd, Tag::ColorMap)?;
                let size = 1 << bits;
                if table.len() == 3 * size {
                    let color = |at: usize| [at, size + at, 2 * size + at].map(|part| (table[part] >> 8) as u8);
                    return Ok(Colors::Palette((0..size).map(color).collect()));
                }
                format!("a palette of {} numbers", table.len())
            }
            Some(6) if bands == 3 && self.packed(ifd)? == Packed::Jpeg => return Ok(Colors::Rgb),
            Some(6) => "YCbCr without JPEG".to_owned(),
            Some(5) => "those of printers (CMYK)".to_owned(),
            Some(other) => format!("of kind {other} in {bands} bands of {bits} bits"),
            None => "not stated".to_owned(),
        };
        Err(self.refused(format!("colours are {words}"), "grey, RGB, RGBA or a palette", RGB))
    }

    /// Where each strip or tile lies, once all are known to lie inside the file.
    fn chunks(&self, ifd: &mut IfdDecoder, level: &Level) -> Result<Vec<(u64, u64)>, SourceError> {
        let [offsets, sizes] = match level.is_tiled {
            true => [Tag::TileOffsets, Tag::TileByteCounts],
            false => [Tag::StripOffsets, Tag::StripByteCounts],
        };
        let offsets: Vec<u64> = self.list(ifd, offsets)?;
        let sizes: Vec<u64> = self.list(ifd, sizes)?;
        let planes = if level.is_planar { level.bands } else { 1 };
        let expected = u64::from(level.chunks_across()) * u64::from(level.chunks_down()) * u64::from(planes);
        at_most(self.store.path(), expected, CHUNKS_MAX, "strips or tiles")?;
        if (offsets.len() as u64, sizes.len() as u64) != (expected, expected) {
            let found = format!("{} offsets and {} lengths", offsets.len(), sizes.len());
            return Err(self.store.malformed("the table of strips or tiles", found, "one of each for every one"));
        }
        for (chunk, (offset, size)) in offsets.iter().zip(&sizes).enumerate() {
            self.store.holds(&format!("strip or tile {chunk} of {expected}"), offset.saturating_add(*size))?;
        }
        Ok(offsets.into_iter().zip(sizes).collect())
    }

    /// Cuts a picture that is one strip and not packed into smaller ones.
    fn in_parts(&self, level: &mut Level) {
        let is_one = !level.is_tiled && level.chunks_down() == 1 && level.packed == Packed::Plainly(Packing::None);
        let whole = level.row_bytes() as u64 * u64::from(level.rows);
        if !is_one || level.chunks.iter().any(|&(_, size)| size < whole) {
            return;
        }
        level.chunk_rows = (PART_PIXELS / level.cols).clamp(1, level.rows);
        let row_bytes = level.row_bytes() as u64;
        let parts = (0..level.rows).step_by(level.chunk_rows as usize);
        let strip = |&(offset, _): &(u64, u64)| {
            let part = |first: u32| {
                let rows = level.chunk_rows.min(level.rows - first);
                (offset + u64::from(first) * row_bytes, u64::from(rows) * row_bytes)
            };
            parts.clone().map(part).collect::<Vec<_>>()
        };
        level.chunks = level.chunks.iter().flat_map(strip).collect();
    }
}
