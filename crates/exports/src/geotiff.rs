//! GeoTIFF: 32-bit floats in deflated blocks with the predictor for floats, placed by GeoKeys, with coarser images of
//! the same ground, so that a viewer of the whole does not read the whole; and rasters of bytes, such as what is seen.

use std::io::{self, Seek, Write};

use source_files::geotiff_parts::{VERTICAL_UNIT, projected_keys, scale_and_tie_point};
use source_files::{plain_datum, write_bytes};
use terrain::{GridFrame, PostRect, Spacing};

use crate::blocks::{BLOCK, Blocks};
use crate::tiff_layout::{self, Image, Value, tag};
use crate::{ExportError, Product};

/// What a file says besides its values.
struct About<'a> {
    product: &'a Product,
    rect: PostRect,
    layer: &'static str,
    epsg: u16,
}

/// Writes images of the posts of `rect`, the finest first, with all that describes them.
///
/// # Errors
/// When it cannot be written, or the coordinate system has no EPSG code that fits a GeoKey.
pub(crate) fn write(
    out: &mut impl Write,
    product: &Product,
    rect: PostRect,
    layer: &'static str,
    images: Vec<Blocks>,
) -> Result<(), ExportError> {
    let epsg = product.epsg().and_then(|code| u16::try_from(code).ok()).ok_or_else(|| ExportError::Impossible {
        what: "the coordinate system".into(),
        found: product.crs().to_owned(),
        expected: "one with an EPSG code".into(),
        hint: "a GeoTIFF names its system by EPSG code; export a mesh instead".into(),
    })?;
    let about = About { product, rect, layer, epsg };
    let image = |(index, image): (usize, Blocks)| {
        let mut tags = sample_tags(&image, 0 < index);
        // Where the coarser ones lie follows from the finest.
        if index == 0 {
            tags.extend(place_tags(&about));
        }
        Image { tags, blocks: image.blocks }
    };
    let images: Vec<Image> = images.into_iter().enumerate().map(image).collect();
    tiff_layout::write(out, &images).map_err(ExportError::write(layer))
}

fn sample_tags(image: &Blocks, is_overview: bool) -> Vec<(u16, Value)> {
    const DEFLATE: u16 = 8;
    const BLACK_IS_ZERO: u16 = 1;
    const TOGETHER: u16 = 1;
    const FLOATS: u16 = 3;
    let short = |number: u16| Value::Shorts(vec![number]);
    let long = |number: usize| Value::Longs(vec![number as u32]);
    vec![
        (tag::SUBFILE_TYPE, long(usize::from(is_overview))),
        (tag::WIDTH, long(image.wide)),
        (tag::LENGTH, long(image.high)),
        (tag::BITS_PER_SAMPLE, short(32)),
        (tag::COMPRESSION, short(DEFLATE)),
        (tag::PHOTOMETRIC, short(BLACK_IS_ZERO)),
        (tag::SAMPLES_PER_PIXEL, short(1)),
        (tag::PLANAR_CONFIGURATION, short(TOGETHER)),
        (tag::PREDICTOR, short(FLOATS)),
        (tag::TILE_WIDTH, long(BLOCK)),
        (tag::TILE_LENGTH, long(BLOCK)),
        (tag::SAMPLE_FORMAT, short(FLOATS)),
        (tag::GDAL_NODATA, Value::Ascii("nan".into())),
    ]
}

fn place_tags(about: &About) -> [(u16, Value); 4] {
    let (scale, tie_point) = scale_and_tie_point(&about.product.frame, about.rect);
    [
        (tag::PIXEL_SCALE, Value::Doubles(scale.to_vec())),
        (tag::TIEPOINT, Value::Doubles(tie_point.to_vec())),
        (tag::GEO_KEYS, Value::Shorts(geo_keys(about).into_flattened())),
        (tag::GDAL_METADATA, Value::Ascii(metadata(about))),
    ]
}

/// The coordinate system: one of heights, too, where these are heights above a datum that has a code.
fn geo_keys(about: &About) -> Vec<[u16; 4]> {
    // GeoTIFF 1.1: of 1.0 GDAL drops the vertical system unless told otherwise.
    let mut keys = vec![[1, 1, 1, 0]];
    keys.extend(projected_keys(about.epsg));
    if let (Some(code), "surface") = (vertical_code(about.product.vertical_datum()), about.layer) {
        keys.extend([[4096, 0, 1, code], VERTICAL_UNIT]);
    }
    keys[0][3] = keys.len() as u16 - 1;
    keys
}

/// What the band holds, for GDAL.
fn metadata(about: &About) -> String {
    let area = &about.product.manifest.area;
    let meaning = match about.layer {
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

/// EPSG code of heights in metres above a datum, where it has one.
fn vertical_code(datum: &str) -> Option<u16> {
    /// Heights above the mean level of the sea, which readers of rasters take for no datum.
    const SEA_LEVEL: u16 = 5714;
    let is_sea_level = matches!(plain_datum(datum).as_str(), "msl" | "epsg5714");
    if is_sea_level { Some(SEA_LEVEL) } else { source_files::vertical_code(datum) }
}

/// Where the numbers lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByteRaster {
    /// Easting and northing of the south-western place.
    pub origin_m: [f64; 2],
    /// Between neighbouring places.
    pub spacing: Spacing,
    /// Places across and up.
    pub size: [usize; 2],
    /// The coordinate system, EPSG:this.
    pub epsg: u16,
    /// Numbers at each place.
    pub bands: u16,
}

/// Writes the numbers. `rows` is asked for one band of rows after another, by the first and the last of them counted
/// from the north, and gives their numbers row by row from the north, those of a place one behind
/// the other.
///
/// # Errors
/// Those of `out`.
pub fn write_byte_raster(
    out: &mut (impl Write + Seek),
    raster: &ByteRaster,
    mut rows: impl FnMut(usize, usize) -> Vec<u8>,
) -> io::Result<()> {
    let ByteRaster { origin_m: [origin_east_m, origin_north_m], spacing, size: [wide, high], epsg, bands } = *raster;
    let frame = GridFrame { origin_east_m, origin_north_m, spacing };
    write_bytes(out, &frame, PostRect::of_size(high, wide), epsg, bands, |band| {
        let from_north = |row: i32| high - 1 - row as usize;
        let numbers = rows(from_north(band.north), from_north(band.south));
        // The writer takes them from the south.
        numbers.rchunks(usize::from(bands) * wide).flatten().copied().collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::{Raster, blocks};
    use crate::samples;
    use std::io::Cursor;
    use tiff::decoder::{Decoder, DecodingResult};
    use tiff::tags::Tag;

    fn image(raster: &Raster) -> Blocks {
        Blocks { wide: raster.wide, high: raster.high(), blocks: blocks(raster) }
    }

    #[test]
    fn values_come_back_from_blocks_as_they_were() {
        let product = samples::product();
        let rect = PostRect::of_size(BLOCK + 3, BLOCK + 5);
        let value = |row: usize, col: usize| (row * 1000 + col) as f32 / 128.0;
        let wide = rect.posts_wide();
        let metres = (0..rect.posts_high()).flat_map(|row| (0..wide).map(move |col| value(row, col))).collect();
        let finest = Raster { wide, metres };
        let coarser = finest.halved();
        let mut file = Vec::new();
        write(&mut file, &product, rect, "surface", vec![image(&finest), image(&coarser)]).unwrap();
        let mut decoder = Decoder::new(Cursor::new(file)).unwrap();
        assert_eq!(decoder.get_tag_u32(Tag::TileWidth).unwrap(), BLOCK as u32);
        for expected in [finest, coarser] {
            let DecodingResult::F32(read) = decoder.read_image().unwrap() else { panic!("floats were written") };
            assert_eq!(read, expected.metres);
            let last = !decoder.more_images();
            assert_eq!(last, decoder.get_tag_u32(Tag::NewSubfileType).unwrap() == 1);
            if !last {
                decoder.next_image().unwrap();
            }
        }
    }

    #[test]
    fn heights_above_a_known_datum_have_a_system_of_their_own_and_residuals_have_none() {
        let mut product = samples::product();
        let mut vertical = |datum: &str, layer: &'static str| {
            product.manifest.area.vertical_datum = datum.into();
            let keys = geo_keys(&About { product: &product, rect: product.grid.area(), layer, epsg: 32611 });
            assert!(keys.is_sorted() && usize::from(keys[0][3]) + 1 == keys.len());
            keys.iter().find(|key| key[0] == 4096).map(|key| key[3])
        };
        for (datum, code) in [("EGM 96", Some(5773)), ("NAVD88", Some(5703)), ("EPSG:3855", Some(3855)), ("", None)] {
            assert_eq!(vertical(datum, "surface"), code, "{datum}");
        }
        assert_eq!(vertical("EGM96", "residual"), None);
        assert_eq!(vertical("ellipsoid", "surface"), None);
    }
}
