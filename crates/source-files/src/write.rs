//! GeoTIFF out: heights as 32-bit floats, classes as bytes, in deflated strips, placed by GeoKeys.
//!
//! Heights are whole quanta of 1/128 m of at most 24 bits, which a 32-bit float holds exactly, so reading the file
//! back gives the same quanta.

use std::io::{self, Seek, Write};

use terrain::{Dem, GridFrame, Post, PostRect, metres_of_quanta};
use tiff::encoder::{DirectoryEncoder, Rational, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard};
use tiff::tags::{CompressionMethod, ResolutionUnit, SampleFormat, Tag};
use tiff::{TiffError, TiffResult};

use crate::geotiff_parts::{VERTICAL_UNIT, deflate, projected_keys, put_predicted, scale_and_tie_point};

/// Posts of a strip, about: a megabyte of heights, so that a large raster has strips for every worker.
const STRIP_POSTS: usize = 1 << 18;
/// Raw bytes up to which a file is an ordinary TIFF, whose offsets have 32 bits.
const ORDINARY_BYTES_MAX: u64 = 3 << 30;

/// Writes heights at the posts `rect` of `grid` as a GeoTIFF in the coordinate system EPSG:`epsg`. `heights` is asked
/// for one band of rows after another, from north to south. Voids become NaN. Nothing is buffered here: give it a
/// `BufWriter`.
///
/// # Errors
/// Those of `out`.
///
/// # Panics
/// When `heights` gives another window than it was asked for.
pub fn write_heights(
    out: &mut (impl Write + Seek),
    grid: &GridFrame,
    rect: PostRect,
    epsg: u16,
    mut heights: impl FnMut(PostRect) -> Dem,
) -> io::Result<()> {
    let strip = |band: PostRect| {
        let dem = heights(band);
        assert_eq!(dem.rect(), band, "the heights of the band that was asked for");
        let mut bytes = Vec::with_capacity(4 * band.post_count());
        (band.south..=band.north).rev().for_each(|row| put_predicted(&mut bytes, &floats(&dem, row)));
        bytes
    };
    write(out, &Head { grid, rect, epsg, kind: Kind::Heights }, strip)
}

/// Writes classes at the posts `rect` of `grid` as a GeoTIFF; `classes` gives those of a band, row-major from the
/// south, as [`write_heights`] asks for heights.
///
/// # Errors
/// As [`write_heights`].
///
/// # Panics
/// When `classes` does not give one class per post of the band.
pub fn write_classes(
    out: &mut (impl Write + Seek),
    grid: &GridFrame,
    rect: PostRect,
    epsg: u16,
    classes: impl FnMut(PostRect) -> Vec<u8>,
) -> io::Result<()> {
    write_bytes(out, grid, rect, epsg, 1, classes)
}

/// [`write_classes`] with several numbers of a byte at each post, one behind the other: a band of the file each.
///
/// # Errors
/// As [`write_heights`].
///
/// # Panics
/// When `numbers` does not give `bands` numbers per post of the rows that were asked for.
pub fn write_bytes(
    out: &mut (impl Write + Seek),
    grid: &GridFrame,
    rect: PostRect,
    epsg: u16,
    bands: u16,
    mut numbers: impl FnMut(PostRect) -> Vec<u8>,
) -> io::Result<()> {
    let count = usize::from(bands);
    let strip = |rows: PostRect| {
        let numbers = numbers(rows);
        assert_eq!(numbers.len(), count * rows.post_count(), "as many numbers per post as there are bands");
        numbers.rchunks(count * rows.posts_wide()).flatten().copied().collect()
    };
    write(out, &Head { grid, rect, epsg, kind: Kind::Bytes(bands) }, strip)
}

/// One row of heights in metres, from west to east.
fn floats(dem: &Dem, row: i32) -> Vec<f32> {
    let rect = dem.rect();
    let voids = (rect.west..=rect.east).map(|col| dem.is_void(Post::new(row, col)));
    let metres = dem.row(row).iter().zip(voids);
    metres.map(|(&quanta, void)| if void { f32::NAN } else { metres_of_quanta(quanta) as f32 }).collect()
}

#[derive(Clone, Copy)]
enum Kind {
    Heights,
    /// So many of them at each post.
    Bytes(u16),
}

impl Kind {
    /// Samples at a post, bits of each, its format, and TIFF's code of the predictor.
    fn sample(self) -> (u16, u16, SampleFormat, u16) {
        match self {
            Kind::Heights => (1, 32, SampleFormat::IEEEFP, 3),
            Kind::Bytes(bands) => (bands, 8, SampleFormat::Uint, 1),
        }
    }
}

/// All of a file but its samples.
struct Head<'a> {
    grid: &'a GridFrame,
    rect: PostRect,
    epsg: u16,
    kind: Kind,
}

fn write(out: &mut (impl Write + Seek), head: &Head, strip: impl FnMut(PostRect) -> Vec<u8>) -> io::Result<()> {
    let bytes = head.rect.post_count() as u64 * 4;
    let written = match bytes <= ORDINARY_BYTES_MAX {
        true => write_tiff::<TiffKindStandard>(out, head, strip),
        false => write_tiff::<TiffKindBig>(out, head, strip),
    };
    written.map_err(io_error)
}

fn io_error(error: TiffError) -> io::Error {
    match error {
        TiffError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

fn write_tiff<K: TiffKind>(
    writer: &mut (impl Write + Seek),
    head: &Head,
    mut strip: impl FnMut(PostRect) -> Vec<u8>,
) -> TiffResult<()> {
    let mut tiff = TiffEncoder::<_, K>::new_generic(writer)?;
    let mut directory = tiff.image_directory()?;
    let rect = head.rect;
    let rows_per_strip = (STRIP_POSTS / rect.posts_wide()).clamp(1, rect.posts_high());
    let (mut offsets, mut sizes) = (Vec::new(), Vec::new());
    let mut north = rect.north;
    while rect.south <= north {
        let south = rect.south.max(north - (rows_per_strip as i32 - 1));
        let deflated = deflate(&strip(PostRect { south, north, ..rect }));
        offsets.push(K::convert_offset(directory.write_data(deflated.as_slice())?)?);
        sizes.push(K::convert_offset(deflated.len() as u64)?);
        north = south - 1;
    }
    write_sample_tags(&mut directory, head, rows_per_strip as u32)?;
    directory.write_tag(Tag::StripOffsets, K::convert_slice(&offsets))?;
    directory.write_tag(Tag::StripByteCounts, K::convert_slice(&sizes))?;
    write_place_tags(&mut directory, head)?;
    directory.finish()
}

fn write_sample_tags<K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, impl Write + Seek, K>,
    head: &Head,
    rows_per_strip: u32,
) -> TiffResult<()> {
    const BLACK_IS_ZERO: u16 = 1;
    let (samples, bits, format, predictor) = head.kind.sample();
    let of_each = |value: u16| vec![value; usize::from(samples)];
    directory.write_tag(Tag::ImageWidth, head.rect.posts_wide() as u32)?;
    directory.write_tag(Tag::ImageLength, head.rect.posts_high() as u32)?;
    directory.write_tag(Tag::BitsPerSample, &of_each(bits)[..])?;
    directory.write_tag(Tag::Compression, CompressionMethod::Deflate.to_u16())?;
    directory.write_tag(Tag::PhotometricInterpretation, BLACK_IS_ZERO)?;
    directory.write_tag(Tag::SamplesPerPixel, samples)?;
    if 1 < samples {
        // Of no kind that programs which show pictures know.
        directory.write_tag(Tag::ExtraSamples, &of_each(0)[1..])?;
    }
    directory.write_tag(Tag::RowsPerStrip, rows_per_strip)?;
    directory.write_tag(Tag::XResolution, Rational { n: 1, d: 1 })?;
    directory.write_tag(Tag::YResolution, Rational { n: 1, d: 1 })?;
    directory.write_tag(Tag::ResolutionUnit, ResolutionUnit::None.to_u16())?;
    directory.write_tag(Tag::Predictor, predictor)?;
    directory.write_tag(Tag::SampleFormat, &of_each(format.to_u16())[..])
}

fn write_place_tags<K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, impl Write + Seek, K>,
    head: &Head,
) -> TiffResult<()> {
    let [model, registration, system, unit] = projected_keys(head.epsg);
    let keys = [[1, 1, 0, 5], model, registration, system, unit, VERTICAL_UNIT];
    let (scale, tie_point) = scale_and_tie_point(head.grid, head.rect);
    directory.write_tag(Tag::ModelPixelScaleTag, &scale[..])?;
    directory.write_tag(Tag::ModelTiepointTag, &tie_point[..])?;
    directory.write_tag(Tag::GeoKeyDirectoryTag, keys.as_flattened())
}
