//! GeoTIFF: 32-bit floats in deflated blocks with the predictor for floats, placed by GeoKeys.

use std::io::{self, Seek, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use terrain::{Post, PostRect};
use tiff::encoder::{DirectoryEncoder, Rational, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard};
use tiff::tags::{CompressionMethod, ResolutionUnit, SampleFormat, Tag};
use tiff::{TiffError, TiffResult};

use crate::{ExportError, Product};

/// Posts along a side of a block.
pub(crate) const BLOCK: usize = 256;
/// Raw bytes up to which a file is an ordinary TIFF, whose offsets have 32 bits.
const ORDINARY_BYTES_MAX: u64 = 3 << 30;

/// The deflated blocks of one band of at most [`BLOCK`] rows, from west to east; what lies beyond the raster is NaN.
pub(crate) fn blocks(values: &[f32], wide: usize) -> Vec<Vec<u8>> {
    let rows: Vec<&[f32]> = values.chunks(wide).collect();
    let block = |west: usize| {
        let mut bytes = Vec::with_capacity(4 * BLOCK * BLOCK);
        for index in 0..BLOCK {
            let mut row = [f32::NAN; BLOCK];
            if let Some(part) = rows.get(index).map(|row| &row[west..wide.min(west + BLOCK)]) {
                row[..part.len()].copy_from_slice(part);
            }
            put_predicted(&mut bytes, &row);
        }
        deflate(&bytes)
    };
    (0..wide).step_by(BLOCK).map(block).collect()
}

/// TIFF's predictor 3: the bytes of a row by significance, highest first, each as the step from the one before.
fn put_predicted(bytes: &mut Vec<u8>, row: &[f32]) {
    let mut before = 0;
    for byte in 0..4 {
        for value in row {
            let next = value.to_be_bytes()[byte];
            bytes.push(next.wrapping_sub(before));
            before = next;
        }
    }
}

fn deflate(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    written.expect("writing to memory cannot fail")
}

/// All of a file but its values.
struct Plan<'a> {
    product: &'a Product,
    rect: PostRect,
    layer: &'static str,
    epsg: u16,
}

/// Writes the blocks, row of blocks by row of blocks from the north, with all that describes them.
///
/// # Errors
/// When it cannot be written, or the coordinate system has no EPSG code that fits a GeoKey.
pub(crate) fn write(
    out: &mut (impl Write + Seek),
    product: &Product,
    rect: PostRect,
    layer: &'static str,
    blocks: &[Vec<u8>],
) -> Result<(), ExportError> {
    let epsg = product.epsg().and_then(|code| u16::try_from(code).ok()).ok_or_else(|| ExportError::Impossible {
        what: "the coordinate system".into(),
        found: product.crs().to_owned(),
        expected: "one with an EPSG code".into(),
        hint: "a GeoTIFF names its system by EPSG code; export a mesh instead".into(),
    })?;
    let plan = Plan { product, rect, layer, epsg };
    let written = match rect.post_count() as u64 * 4 <= ORDINARY_BYTES_MAX {
        true => write_tiff::<TiffKindStandard>(out, &plan, blocks),
        false => write_tiff::<TiffKindBig>(out, &plan, blocks),
    };
    written.map_err(|error| match error {
        TiffError::IoError(source) => ExportError::write(layer)(source),
        other => ExportError::write(layer)(io::Error::other(other)),
    })
}

fn write_tiff<K: TiffKind>(out: &mut (impl Write + Seek), plan: &Plan, blocks: &[Vec<u8>]) -> TiffResult<()> {
    let mut tiff = TiffEncoder::<_, K>::new_generic(out)?;
    let mut directory = tiff.image_directory()?;
    let (mut offsets, mut sizes) = (Vec::new(), Vec::new());
    for block in blocks {
        offsets.push(K::convert_offset(directory.write_data(block.as_slice())?)?);
        sizes.push(K::convert_offset(block.len() as u64)?);
    }
    write_sample_tags(&mut directory, plan)?;
    directory.write_tag(Tag::TileOffsets, K::convert_slice(&offsets))?;
    directory.write_tag(Tag::TileByteCounts, K::convert_slice(&sizes))?;
    write_place_tags(&mut directory, plan)?;
    directory.finish()
}

fn write_sample_tags<K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, impl Write + Seek, K>,
    plan: &Plan,
) -> TiffResult<()> {
    const BLACK_IS_ZERO: u16 = 1;
    const FLOATS: u16 = 3;
    directory.write_tag(Tag::ImageWidth, plan.rect.posts_wide() as u32)?;
    directory.write_tag(Tag::ImageLength, plan.rect.posts_high() as u32)?;
    directory.write_tag(Tag::BitsPerSample, 32_u16)?;
    directory.write_tag(Tag::Compression, CompressionMethod::Deflate.to_u16())?;
    directory.write_tag(Tag::PhotometricInterpretation, BLACK_IS_ZERO)?;
    directory.write_tag(Tag::SamplesPerPixel, 1_u16)?;
    directory.write_tag(Tag::XResolution, Rational { n: 1, d: 1 })?;
    directory.write_tag(Tag::YResolution, Rational { n: 1, d: 1 })?;
    directory.write_tag(Tag::ResolutionUnit, ResolutionUnit::None.to_u16())?;
    directory.write_tag(Tag::Predictor, FLOATS)?;
    directory.write_tag(Tag::TileWidth, BLOCK as u32)?;
    directory.write_tag(Tag::TileLength, BLOCK as u32)?;
    directory.write_tag(Tag::SampleFormat, SampleFormat::IEEEFP.to_u16())
}

fn write_place_tags<K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, impl Write + Seek, K>,
    plan: &Plan,
) -> TiffResult<()> {
    const PROJECTED: u16 = 1;
    const PIXEL_IS_AREA: u16 = 1;
    const METRE: u16 = 9001;
    // GeoTIFF 1.1: of 1.0 GDAL drops the vertical system unless told otherwise.
    let mut keys: Vec<[u16; 4]> = vec![
        [1, 1, 1, 0],
        [1024, 0, 1, PROJECTED],
        [1025, 0, 1, PIXEL_IS_AREA],
        [3072, 0, 1, plan.epsg],
        [3076, 0, 1, METRE],
    ];
    if let (Some(code), "surface") = (vertical_code(plan.product.vertical_datum()), plan.layer) {
        keys.extend([[4096, 0, 1, code], [4099, 0, 1, METRE]]);
    }
    keys[0][3] = keys.len() as u16 - 1;
    let frame = &plan.product.frame;
    let spacing_m = frame.spacing.metres();
    // A post is the centre of its pixel, so the raster's corner lies half a post beyond the north-west post.
    let [east_m, north_m] = frame.place_m(Post::new(plan.rect.north, plan.rect.west));
    let corner = [0.0, 0.0, 0.0, east_m - spacing_m / 2.0, north_m + spacing_m / 2.0, 0.0];
    directory.write_tag(Tag::ModelPixelScaleTag, &[spacing_m, spacing_m, 0.0][..])?;
    directory.write_tag(Tag::ModelTiepointTag, &corner[..])?;
    directory.write_tag(Tag::GeoKeyDirectoryTag, keys.as_flattened())?;
    directory.write_tag(Tag::Unknown(GDAL_METADATA), &*metadata(plan))?;
    directory.write_tag(Tag::GdalNodata, "nan")
}

const GDAL_METADATA: u16 = 42112;

/// What the band holds, for GDAL.
fn metadata(plan: &Plan) -> String {
    let area = &plan.product.manifest.area;
    let meaning = match plan.layer {
        "surface" => "height of the compiled surface, metres",
        _ => "height of the ground less that of the compiled surface, metres",
    };
    let escaped = |text: &str| {
        let ascii: String = text.chars().map(|c| if c.is_ascii() && !c.is_control() { c } else { '?' }).collect();
        ascii.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
    };
    format!(
        "<GDALMetadata><Item name=\"AREA\">{}</Item><Item name=\"VERTICAL_DATUM\">{}</Item>\
         <Item name=\"DESCRIPTION\" sample=\"0\" role=\"description\">{meaning}</Item></GDALMetadata>",
        escaped(&area.name),
        escaped(&area.vertical_datum)
    )
}

/// EPSG code of heights above a datum, where it has one.
fn vertical_code(datum: &str) -> Option<u16> {
    match crate::earth::plain_datum(datum).as_str() {
        "egm96" => Some(5773),
        "egm2008" => Some(3855),
        "navd88" => Some(5703),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use tiff::decoder::{Decoder, DecodingResult};

    use super::*;
    use crate::samples;

    #[test]
    fn values_come_back_from_blocks_as_they_were() {
        let product = samples::product();
        let rect = PostRect::of_size(BLOCK + 3, BLOCK + 5);
        let value = |row: usize, col: usize| (row * 1000 + col) as f32 / 128.0;
        let wide = rect.posts_wide();
        let bands = [(0, BLOCK), (BLOCK, BLOCK + 3)];
        let blocks: Vec<Vec<u8>> = bands
            .into_iter()
            .flat_map(|(from, to)| {
                let values: Vec<f32> = (from..to).flat_map(|row| (0..wide).map(move |col| value(row, col))).collect();
                blocks(&values, wide)
            })
            .collect();
        let mut file = Cursor::new(Vec::new());
        write(&mut file, &product, rect, "surface", &blocks).unwrap();
        let mut decoder = Decoder::new(Cursor::new(file.into_inner())).unwrap();
        assert_eq!(decoder.get_tag_u32(Tag::TileWidth).unwrap(), BLOCK as u32);
        let DecodingResult::F32(read) = decoder.read_image().unwrap() else { panic!("floats were written") };
        let expected = (0..rect.posts_high()).flat_map(|row| (0..wide).map(move |col| value(row, col)));
        assert!(read.into_iter().eq(expected));
    }
}
