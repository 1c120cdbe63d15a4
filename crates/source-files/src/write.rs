//! GeoTIFF out: heights as 32-bit floats, classes as bytes, in deflated strips, placed by GeoKeys.
//!
//! Heights are whole quanta of 1/128 m of at most 24 bits, which a 32-bit float holds exactly, so reading the file
//! back gives the same quanta. The file appears under its name only when it is whole.

use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use tempfile::NamedTempFile;
use terrain::{Dem, GridFrame, Post, PostRect, metres_of_quanta};
use tiff::encoder::{DirectoryEncoder, Rational, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard};
use tiff::tags::{CompressionMethod, ResolutionUnit, SampleFormat, Tag};
use tiff::{TiffError, TiffResult};

use crate::SourceError;

/// Posts of a strip, about: a megabyte of heights, so that a large raster has strips for every worker.
const STRIP_POSTS: usize = 1 << 18;
/// Raw bytes up to which a file is an ordinary TIFF, whose offsets have 32 bits.
const ORDINARY_BYTES_MAX: u64 = 3 << 30;

/// Writes heights at the posts `rect` of `grid` to a GeoTIFF at `path`, in the coordinate system EPSG:`epsg`.
/// `heights` is asked for one band of rows after another, from north to south. Voids become NaN.
///
/// # Errors
/// When the file cannot be written, or the code does not fit a GeoKey. Nothing is left at `path` then.
///
/// # Panics
/// When `heights` gives another window than it was asked for.
pub fn write_heights(
    path: &Path,
    grid: &GridFrame,
    rect: PostRect,
    epsg: u32,
    mut heights: impl FnMut(PostRect) -> Dem,
) -> Result<(), SourceError> {
    let strip = |band: PostRect| {
        let dem = heights(band);
        assert_eq!(dem.rect(), band, "the heights of the band that was asked for");
        let rows = (band.south..=band.north).rev();
        rows.flat_map(|row| predicted(&floats(&dem, row))).collect()
    };
    write(path, &Plan { grid, rect, epsg, kind: Kind::Heights }, strip)
}

/// Writes classes at the posts `rect` of `grid` to a GeoTIFF at `path`; `classes` gives those of a band, row-major
/// from the south, as [`write_heights`] asks for heights.
///
/// # Errors
/// As [`write_heights`].
///
/// # Panics
/// When `classes` does not give one class per post of the band.
pub fn write_classes(
    path: &Path,
    grid: &GridFrame,
    rect: PostRect,
    epsg: u32,
    mut classes: impl FnMut(PostRect) -> Vec<u8>,
) -> Result<(), SourceError> {
    let strip = |band: PostRect| {
        let classes = classes(band);
        assert_eq!(classes.len(), band.post_count(), "one class per post of the band that was asked for");
        classes.rchunks(band.posts_wide()).flatten().copied().collect()
    };
    write(path, &Plan { grid, rect, epsg, kind: Kind::Classes }, strip)
}

/// One row of heights in metres, from west to east.
fn floats(dem: &Dem, row: i32) -> Vec<f32> {
    let rect = dem.rect();
    let voids = (rect.west..=rect.east).map(|col| dem.is_void(Post::new(row, col)));
    let metres = dem.row(row).iter().zip(voids);
    metres.map(|(&quanta, void)| if void { f32::NAN } else { metres_of_quanta(quanta) as f32 }).collect()
}

/// TIFF's predictor 3: the bytes of a row by significance, highest first, each as the step from the one before.
fn predicted(row: &[f32]) -> Vec<u8> {
    let plane = |byte: usize| row.iter().map(move |value| value.to_be_bytes()[byte]);
    let planes = (0..4).flat_map(plane);
    let mut before = 0;
    planes.map(|byte| byte.wrapping_sub(std::mem::replace(&mut before, byte))).collect()
}

#[derive(Clone, Copy)]
enum Kind {
    Heights,
    Classes,
}

impl Kind {
    /// Bits a sample, its format, and TIFF's code of the predictor.
    fn sample(self) -> (u16, SampleFormat, u16) {
        match self {
            Kind::Heights => (32, SampleFormat::IEEEFP, 3),
            Kind::Classes => (8, SampleFormat::Uint, 1),
        }
    }
}

/// All of a file but its samples.
struct Plan<'a> {
    grid: &'a GridFrame,
    rect: PostRect,
    epsg: u32,
    kind: Kind,
}

fn write(path: &Path, plan: &Plan, strip: impl FnMut(PostRect) -> Vec<u8>) -> Result<(), SourceError> {
    let error = |source| SourceError::Write { path: path.into(), source };
    let epsg = u16::try_from(plan.epsg)
        .map_err(|_| SourceError::UnnamedCrs { path: path.into(), found: format!("EPSG:{}", plan.epsg) })?;
    let mut file = temporary_beside(path).map_err(error)?;
    let mut writer = BufWriter::new(file.as_file_mut());
    let bytes = plan.rect.post_count() as u64 * 4;
    let written = match bytes <= ORDINARY_BYTES_MAX {
        true => write_tiff::<TiffKindStandard>(&mut writer, plan, epsg, strip),
        false => write_tiff::<TiffKindBig>(&mut writer, plan, epsg, strip),
    };
    written.map_err(|tiff| error(io_error(tiff)))?;
    writer.flush().map_err(error)?;
    drop(writer);
    file.as_file().sync_all().map_err(error)?;
    file.persist(path).map_err(|persist| error(persist.error))?;
    Ok(())
}

fn temporary_beside(path: &Path) -> io::Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".tiefort-");
    // A temporary file is private by default; this one is about to be an ordinary file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

fn io_error(error: TiffError) -> io::Error {
    match error {
        TiffError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

fn write_tiff<K: TiffKind>(
    writer: &mut (impl Write + Seek),
    plan: &Plan,
    epsg: u16,
    mut strip: impl FnMut(PostRect) -> Vec<u8>,
) -> TiffResult<()> {
    let mut tiff = TiffEncoder::<_, K>::new_generic(writer)?;
    let mut directory = tiff.image_directory()?;
    let rect = plan.rect;
    let rows_per_strip = (STRIP_POSTS / rect.posts_wide()).clamp(1, rect.posts_high());
    let (mut offsets, mut sizes) = (Vec::new(), Vec::new());
    let mut north = rect.north;
    while rect.south <= north {
        let south = rect.south.max(north - (rows_per_strip as i32 - 1));
        let deflated = deflate(&strip(PostRect { south, north, ..rect }))?;
        offsets.push(K::convert_offset(directory.write_data(deflated.as_slice())?)?);
        sizes.push(K::convert_offset(deflated.len() as u64)?);
        north = south - 1;
    }
    write_sample_tags(&mut directory, plan, rows_per_strip as u32)?;
    directory.write_tag(Tag::StripOffsets, K::convert_slice(&offsets))?;
    directory.write_tag(Tag::StripByteCounts, K::convert_slice(&sizes))?;
    write_place_tags(&mut directory, plan, epsg)?;
    directory.finish()
}

fn deflate(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes)?;
    encoder.finish()
}

fn write_sample_tags<K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, impl Write + Seek, K>,
    plan: &Plan,
    rows_per_strip: u32,
) -> TiffResult<()> {
    const BLACK_IS_ZERO: u16 = 1;
    let (bits, format, predictor) = plan.kind.sample();
    directory.write_tag(Tag::ImageWidth, plan.rect.posts_wide() as u32)?;
    directory.write_tag(Tag::ImageLength, plan.rect.posts_high() as u32)?;
    directory.write_tag(Tag::BitsPerSample, bits)?;
    directory.write_tag(Tag::Compression, CompressionMethod::Deflate.to_u16())?;
    directory.write_tag(Tag::PhotometricInterpretation, BLACK_IS_ZERO)?;
    directory.write_tag(Tag::SamplesPerPixel, 1_u16)?;
    directory.write_tag(Tag::RowsPerStrip, rows_per_strip)?;
    directory.write_tag(Tag::XResolution, Rational { n: 1, d: 1 })?;
    directory.write_tag(Tag::YResolution, Rational { n: 1, d: 1 })?;
    directory.write_tag(Tag::ResolutionUnit, ResolutionUnit::None.to_u16())?;
    directory.write_tag(Tag::Predictor, predictor)?;
    directory.write_tag(Tag::SampleFormat, format.to_u16())
}

fn write_place_tags<K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, impl Write + Seek, K>,
    plan: &Plan,
    epsg: u16,
) -> TiffResult<()> {
    const PROJECTED: u16 = 1;
    const PIXEL_IS_AREA: u16 = 1;
    const METRE: u16 = 9001;
    let keys: [[u16; 4]; 6] = [
        [1, 1, 0, 5],
        [1024, 0, 1, PROJECTED],
        [1025, 0, 1, PIXEL_IS_AREA],
        [3072, 0, 1, epsg],
        [3076, 0, 1, METRE],
        [4099, 0, 1, METRE],
    ];
    let spacing_m = plan.grid.spacing.metres();
    // A post is the centre of its pixel, so the raster's corner lies half a post beyond the north-west post.
    let [east_m, north_m] = plan.grid.place_m(Post::new(plan.rect.north, plan.rect.west));
    let corner = [0.0, 0.0, 0.0, east_m - spacing_m / 2.0, north_m + spacing_m / 2.0, 0.0];
    directory.write_tag(Tag::ModelPixelScaleTag, &[spacing_m, spacing_m, 0.0][..])?;
    directory.write_tag(Tag::ModelTiepointTag, &corner[..])?;
    directory.write_tag(Tag::GeoKeyDirectoryTag, keys.as_flattened())
}
