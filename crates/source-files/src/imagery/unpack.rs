//! A strip or tile as the numbers of its pixels, and these as colours.

use std::io::{Read, Seek, SeekFrom};

use flate2::bufread::ZlibDecoder;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::level::{Colors, Level, Packed};
use crate::SourceError;
use crate::unpacked::{Lzw, Packing};

/// Strips or tiles that the range of 16-bit colours is taken from.
const RANGE_CHUNKS: usize = 16;
/// Parts of pixels that are darker than black, and brighter than white, then.
const RANGE_CUT: f64 = 0.02;
/// From here on, 16-bit colours use all of their range.
const WHOLE_RANGE: u16 = 1 << 15;

/// A strip or tile in colours: red, green, blue, and how opaque it is.
pub(super) struct Colored {
    pub cols: u32,
    pub rows: u32,
    /// None where there is no picture at all.
    pixels: Option<Vec<[u8; 4]>>,
}

impl Colored {
    pub fn at(&self, col: u32, row: u32) -> [u8; 4] {
        self.pixels.as_ref().map_or([0; 4], |pixels| pixels[row as usize * self.cols as usize + col as usize])
    }

    pub fn bytes(&self) -> usize {
        4 * self.pixels.as_ref().map_or(16, Vec::len)
    }
}

/// A strip or tile in colours.
///
/// # Errors
/// When the file is gone, or it cannot be decoded.
pub(super) fn colored(level: &Level, chunk: u32) -> Result<Colored, SourceError> {
    let (cols, rows) = (level.chunk_cols, level.rows_of(chunk));
    let Some(numbers) = numbers(level, chunk)? else { return Ok(Colored { cols, rows, pixels: None }) };
    let bands = level.bands as usize;
    let mut pixels: Vec<[u8; 4]> = numbers.chunks_exact(bands).map(|pixel| color(level, pixel)).collect();
    if let Some(mask) = &level.mask {
        let hidden = hidden_by(mask, level.corner_of(chunk), [cols, rows])?;
        pixels.iter_mut().zip(hidden).filter(|(_, is_hidden)| *is_hidden).for_each(|(pixel, _)| *pixel = [0; 4]);
    }
    Ok(Colored { cols, rows, pixels: Some(pixels) })
}

fn color(level: &Level, pixel: &[u16]) -> [u8; 4] {
    let ours = &pixel[..level.color_bands() as usize];
    if level.nodata.is_some_and(|nodata| ours.iter().all(|&number| number == nodata)) {
        return [0; 4];
    }
    let eight = |number: u16| -> u8 {
        match level.bits {
            8 => number as u8,
            16 => {
                let [low, high] = level.range.map(i32::from);
                ((i32::from(number) - low) * 255 / (high - low)).clamp(0, 255) as u8
            }
            bits => (u32::from(number) * 255 / ((1 << bits) - 1)) as u8,
        }
    };
    let mut rgb = match &level.colors {
        Colors::Rgb => [0, 1, 2].map(|band| eight(pixel[band])),
        Colors::Grey { is_inverted } => [if *is_inverted { 255 - eight(pixel[0]) } else { eight(pixel[0]) }; 3],
        Colors::Palette(table) => table.get(usize::from(pixel[0])).copied().unwrap_or_default(),
    };
    let Some((band, is_multiplied)) = level.alpha else { return [rgb[0], rgb[1], rgb[2], 255] };
    let number = pixel[band as usize];
    let alpha = if level.bits == 16 { (number >> 8) as u8 } else { eight(number) };
    if is_multiplied && 0 < alpha {
        rgb = rgb.map(|part| (u32::from(part) * 255 / u32::from(alpha)).min(255) as u8);
    }
    [rgb[0], rgb[1], rgb[2], alpha]
}

/// Whether the mask says that there is no picture, for each pixel of a strip or tile.
fn hidden_by(mask: &Level, [west, north]: [u32; 2], [cols, rows]: [u32; 2]) -> Result<Vec<bool>, SourceError> {
    let mut hidden = vec![false; cols as usize * rows as usize];
    let (east, south) = ((west + cols).min(mask.cols), (north + rows).min(mask.rows));
    for down in north / mask.chunk_rows..south.div_ceil(mask.chunk_rows) {
        for across in west / mask.chunk_cols..east.div_ceil(mask.chunk_cols) {
            let chunk = down * mask.chunks_across() + across;
            let (numbers, [left, top]) = (numbers(mask, chunk)?, mask.corner_of(chunk));
            for row in north.max(top)..south.min(top + mask.rows_of(chunk)) {
                for col in west.max(left)..east.min(left + mask.chunk_cols) {
                    let at = ((row - top) * mask.chunk_cols + col - left) as usize;
                    let is_hidden = numbers.as_ref().is_none_or(|numbers| numbers[at * mask.bands as usize] == 0);
                    hidden[((row - north) * cols + col - west) as usize] = is_hidden;
                }
            }
        }
    }
    Ok(hidden)
}

/// The numbers of all pixels of a strip or tile, pixel by pixel, padding included; `None` where the writer left it out.
fn numbers(level: &Level, chunk: u32) -> Result<Option<Vec<u16>>, SourceError> {
    if !level.is_planar {
        return plane(level, chunk);
    }
    let (bands, a_plane) = (level.bands as usize, level.chunks_across() * level.chunks_down());
    let mut all = vec![0; level.chunk_cols as usize * level.rows_of(chunk) as usize * bands];
    for band in 0..level.bands {
        let Some(numbers) = plane(level, band * a_plane + chunk)? else { return Ok(None) };
        for (pixel, number) in all.chunks_exact_mut(bands).zip(numbers) {
            pixel[band as usize] = number;
        }
    }
    Ok(Some(all))
}

/// The numbers of one strip or tile as it is stored.
fn plane(level: &Level, stored: u32) -> Result<Option<Vec<u16>>, SourceError> {
    let (offset, size) = level.chunks[stored as usize];
    if size == 0 {
        return Ok(None);
    }
    let broken = |reason: String| SourceError::BrokenChunk {
        path: level.store.path().into(),
        chunk: stored,
        chunks: level.chunks.len() as u32,
        reason,
    };
    let mut file = level.store.handle()?;
    let mut packed = Vec::new();
    file.seek(SeekFrom::Start(offset))
        .and_then(|_| file.take(size).read_to_end(&mut packed))
        .map_err(|source| level.store.stopped(source))?;
    let rows = level.rows_of(stored % (level.chunks_across() * level.chunks_down())) as usize;
    let bytes = match level.packed {
        Packed::Plainly(packing) => unpacked(packing, &packed, rows, level.row_bytes()),
        Packed::Jpeg => pictured(level, packed, rows),
    };
    let bytes = bytes.map_err(broken)?;
    let mut numbers = Vec::with_capacity(rows * level.chunk_cols as usize * level.bands_together() as usize);
    bytes.chunks_exact(level.row_bytes()).for_each(|row| put_row(level, row, &mut numbers));
    Ok(Some(numbers))
}

/// Appends the numbers of a row.
fn put_row(level: &Level, row: &[u8], numbers: &mut Vec<u16>) {
    let (bands, first) = (level.bands_together() as usize, numbers.len());
    match level.bits {
        8 => numbers.extend(row.iter().map(|&byte| u16::from(byte))),
        16 => numbers.extend(row.chunks_exact(2).map(|pair| match level.is_big_endian {
            true => u16::from_be_bytes([pair[0], pair[1]]),
            false => u16::from_le_bytes([pair[0], pair[1]]),
        })),
        bits => {
            let a_byte = 8 / bits as usize;
            let all = level.chunk_cols as usize * bands;
            numbers.extend((0..all).map(|at| {
                let shift = 8 - bits as usize * (at % a_byte + 1);
                u16::from(row[at / a_byte] >> shift & ((1u16 << bits) - 1) as u8)
            }));
        }
    }
    if level.is_predicted {
        let most = if level.bits == 16 { u16::MAX } else { 0xff };
        for at in first + bands..numbers.len() {
            numbers[at] = numbers[at].wrapping_add(numbers[at - bands]) & most;
        }
    }
}

/// Rows of a strip or tile, no byte more.
fn unpacked(packing: Packing, packed: &[u8], rows: usize, row_bytes: usize) -> Result<Vec<u8>, String> {
    let mut bytes = vec![0; rows * row_bytes];
    let done = match packing {
        Packing::None => (&mut &packed[..]).read_exact(&mut bytes),
        Packing::Deflate => ZlibDecoder::new(packed).read_exact(&mut bytes),
        Packing::Lzw => Lzw::new(packed).read_exact(&mut bytes),
        Packing::Zstd => zstd::Decoder::with_buffer(packed).and_then(|mut decoder| decoder.read_exact(&mut bytes)),
        Packing::PackBits => return runs(packed, bytes),
    };
    done.map_err(|error| error.to_string())?;
    Ok(bytes)
}

/// Runs of PackBits (TIFF 6.0, section 9).
fn runs(packed: &[u8], mut bytes: Vec<u8>) -> Result<Vec<u8>, String> {
    let (mut from, mut to) = (packed.iter().copied(), 0);
    while to < bytes.len() {
        let head = from.next().ok_or("its last run of PackBits is missing")?.cast_signed();
        let count = if head < 0 { 1 - isize::from(head) } else { isize::from(head) + 1 } as usize;
        if head == -128 {
            continue;
        }
        let room = bytes.get_mut(to..to + count).ok_or("a run of PackBits goes beyond its rows")?;
        if head < 0 {
            room.fill(from.next().ok_or("its last run of PackBits is cut off")?);
        } else {
            for byte in room {
                *byte = from.next().ok_or("its last run of PackBits is cut off")?;
            }
        }
        to += count;
    }
    Ok(bytes)
}

/// Rows of a strip or tile that is a JPEG, whose tables may stand in the directory.
fn pictured(level: &Level, packed: Vec<u8>, rows: usize) -> Result<Vec<u8>, String> {
    let whole = match &level.jpeg_tables[..] {
        // The end of the tables and the beginning of the picture are left out, and they are one.
        [tables @ .., _, _] if 2 <= packed.len() => [tables, &packed[2..]].concat(),
        _ => packed,
    };
    let mut decoder = JpegDecoder::new(ZCursor::new(whole));
    let in_words = |error: zune_jpeg::errors::DecodeErrors| format!("its JPEG cannot be decoded: {error}");
    decoder.decode_headers().map_err(in_words)?;
    let found = decoder.info().ok_or("its JPEG has no size")?;
    let (wide, high, parts) = (usize::from(found.width), usize::from(found.height), usize::from(found.components));
    let bands = level.bands_together() as usize;
    if (wide, parts) != (level.chunk_cols as usize, bands) || high < rows {
        return Err(format!(
            "its JPEG has {wide} x {high} pixels of {parts} numbers, expected {} x {rows} of {bands}",
            level.chunk_cols
        ));
    }
    // Red, green and blue may stand there as they are; then nothing is to be converted.
    let own = decoder.input_colorspace();
    let wanted = if level.is_ycbcr { Some(ColorSpace::RGB) } else { own };
    if let Some(space) = wanted {
        decoder.set_options(DecoderOptions::default().jpeg_set_out_colorspace(space));
    }
    let mut bytes = decoder.decode().map_err(in_words)?;
    if bytes.len() < rows * level.row_bytes() {
        return Err(format!("its JPEG has {} bytes, expected {}", bytes.len(), rows * level.row_bytes()));
    }
    bytes.truncate(rows * level.row_bytes());
    Ok(bytes)
}

/// Finds what is black and what is white in 16-bit colours: all of their range where they use its upper half, and the
/// darkest and brightest of them but for some in a hundred where they do not.
pub(super) fn set_range(levels: &mut [Level]) -> Result<(), SourceError> {
    let least = levels.last().expect("there is one at least");
    if least.bits != 16 {
        return Ok(());
    }
    let all = least.chunks_across() * least.chunks_down();
    let step = all.div_ceil(RANGE_CHUNKS as u32).max(1);
    let mut counts = vec![0u64; 1 << 16];
    for chunk in (step / 2..all).step_by(step as usize) {
        count(least, chunk, &mut counts)?;
    }
    let total: u64 = counts.iter().sum();
    let below = |share: f64| {
        let (wanted, mut sum) = ((share * total as f64) as u64, 0);
        let found = counts.iter().position(|count| {
            sum += count;
            wanted < sum
        });
        found.unwrap_or(counts.len() - 1) as u16
    };
    let [low, high] = [below(RANGE_CUT), below(1.0 - RANGE_CUT)];
    let range = if WHOLE_RANGE <= high { [0, u16::MAX] } else { [low.min(u16::MAX - 1), high.max(low + 1)] };
    levels.iter_mut().for_each(|level| level.range = range);
    Ok(())
}

/// Counts the numbers of all colours of a strip or tile, but for pixels where there is no picture.
fn count(level: &Level, chunk: u32, counts: &mut [u64]) -> Result<(), SourceError> {
    let Some(numbers) = numbers(level, chunk)? else { return Ok(()) };
    let (corner, size) = (level.corner_of(chunk), [level.chunk_cols, level.rows_of(chunk)]);
    let hidden = level.mask.as_ref().map(|mask| hidden_by(mask, corner, size)).transpose()?;
    for (at, pixel) in numbers.chunks_exact(level.bands as usize).enumerate() {
        let (col, row) = (corner[0] + at as u32 % size[0], corner[1] + at as u32 / size[0]);
        let colors = &pixel[..level.color_bands() as usize];
        // A tile may reach beyond the picture.
        let is_there = col < level.cols
            && row < level.rows
            && hidden.as_ref().is_none_or(|hidden| !hidden[at])
            && level.alpha.is_none_or(|(band, _)| 0 < pixel[band as usize])
            && level.nodata.is_none_or(|nodata| colors.iter().any(|&number| number != nodata));
        if is_there {
            colors.iter().for_each(|&number| counts[usize::from(number)] += 1);
        }
    }
    Ok(())
}
