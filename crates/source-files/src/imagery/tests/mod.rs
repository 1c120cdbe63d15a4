//! Pictures written here and drawn: places, kinds of colours, strips and tiles, overviews, what is refused.

use std::fs::File;
use std::path::{Path, PathBuf};

use tiff::encoder::colortype::{ColorType, Gray8, Gray16, RGB8, RGBA8};
use tiff::encoder::{TiffEncoder, TiffValue};
use tiff::tags::Tag;

use super::level::PIXELS_MAX;
use super::{Imagery, Keep, Square};
use crate::crs::Crs;

mod jpeg;
mod kinds;
mod whole;
mod writer;

const UTM: &str = "EPSG:32611";
/// The corner of the pictures here, in UTM.
const CORNER: [f64; 2] = [520_000.0, 3_890_000.0];
const RED: [u8; 3] = [250, 10, 20];
const GREY: [u8; 3] = [90, 90, 90];

/// What a file is made of.
struct Made<'a> {
    size: [u32; 2],
    /// The north-western corner and the side of a pixel.
    corner: [f64; 2],
    pixel: f64,
    epsg: Option<u16>,
    rows_per_strip: u32,
    nodata: Option<&'a str>,
}

const PLAIN: Made =
    Made { size: [64, 48], corner: CORNER, pixel: 2.0, epsg: Some(32611), rows_per_strip: 7, nodata: None };

impl Made<'_> {
    fn write<C: ColorType>(&self, path: &Path, data: &[C::Inner])
    where
        [C::Inner]: TiffValue,
    {
        let mut encoder = TiffEncoder::new(File::create(path).unwrap()).unwrap();
        let mut image = encoder.new_image::<C>(self.size[0], self.size[1]).unwrap();
        image.rows_per_strip(self.rows_per_strip).unwrap();
        let [east, north] = self.corner;
        let tags = image.encoder();
        tags.write_tag(Tag::ModelPixelScaleTag, &[self.pixel, self.pixel, 0.0][..]).unwrap();
        tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, east, north, 0.0][..]).unwrap();
        if let Some(epsg) = self.epsg {
            let (model, key): (u16, u16) = if epsg == 4326 { (2, 2048) } else { (1, 3072) };
            let keys: [u16; 16] = [1, 1, 0, 3, 1024, 0, 1, model, 1025, 0, 1, 1, key, 0, 1, epsg];
            tags.write_tag(Tag::GeoKeyDirectoryTag, &keys[..]).unwrap();
        }
        if let Some(nodata) = self.nodata {
            tags.write_tag(Tag::GdalNodata, nodata).unwrap();
        }
        image.write_data(data).unwrap();
    }

    /// Grey with one red pixel.
    fn with_red(&self, [col, row]: [u32; 2]) -> Vec<u8> {
        let count = self.size[0] * self.size[1];
        (0..count).flat_map(|at| if at == row * self.size[0] + col { RED } else { GREY }).collect()
    }
}

fn file(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

fn drawn(picture: &Imagery, square: &Square) -> Option<Vec<[u8; 4]>> {
    let mut pixels = vec![0; 4 * square.side * square.side];
    let is_any = picture.draw(square, &Keep::new(1 << 20), &mut pixels).unwrap();
    is_any.then(|| pixels.chunks(4).map(|pixel| pixel.try_into().unwrap()).collect())
}

/// Column and row of the middle of what is red in a square, weighed by how red it is.
fn middle_of_red(pixels: &[[u8; 4]], side: usize) -> [f64; 2] {
    let (mut sum, mut all) = ([0.0; 2], 0.0);
    for (at, [red, green, ..]) in pixels.iter().enumerate() {
        let weight = f64::from(i32::from(*red) - i32::from(*green)).max(0.0);
        sum = [sum[0] + weight * (at % side) as f64, sum[1] + weight * (at / side) as f64];
        all += weight;
    }
    assert!(0.0 < all, "something is red");
    sum.map(|part| part / all + 0.5)
}

#[test]
fn a_pixel_lies_where_the_file_says_in_its_own_system_and_in_others() {
    let (_folder, path) = file("a.tif");
    let utm = Crs::named(UTM).unwrap();
    for (epsg, pixel) in [(32611, 2.0), (32612, 2.0), (3857, 2.5), (4326, 2.0e-5), (5070, 2.0)] {
        let own = Crs::from_epsg(epsg.into()).unwrap();
        let corner = utm.to(&own, CORNER).unwrap();
        let made = Made { corner, pixel, epsg: Some(epsg), ..PLAIN };
        made.write::<RGB8>(&path, &made.with_red([40, 17]));
        let picture = Imagery::open(&path, 0).unwrap();
        let place = own.to(&utm, [corner[0] + 40.5 * pixel, corner[1] - 17.5 * pixel]).unwrap();
        for pixel_m in [0.5, 1.0, 2.0, 4.0] {
            let square = Square { crs: &utm, corner: [place[0] - 61.3, place[1] + 83.7], pixel_m, side: 256 };
            let [col, row] = middle_of_red(&drawn(&picture, &square).unwrap(), 256);
            let off_m = [col * pixel_m - 61.3, row * pixel_m - 83.7];
            // Half a pixel of the file, which is 2.2 m wide in degrees, or of the square.
            let most_m = 0.5 * pixel_m.max(2.2);
            assert!(off_m.iter().all(|off| off.abs() < most_m), "EPSG:{epsg} at {pixel_m} m: {off_m:?} m off");
        }
    }
}

#[test]
fn beyond_the_picture_nothing_is_drawn_and_its_edge_is_as_sharp_as_its_pixels() {
    let (_folder, path) = file("a.tif");
    PLAIN.write::<RGB8>(&path, &PLAIN.with_red([0, 0]));
    let picture = Imagery::open(&path, 0).unwrap();
    let utm = Crs::named(UTM).unwrap();
    // The picture is 128 m x 96 m; the square begins 32 m west and north of it.
    let square = Square { crs: &utm, corner: [CORNER[0] - 32.0, CORNER[1] + 32.0], pixel_m: 1.0, side: 256 };
    let pixels = drawn(&picture, &square).unwrap();
    for (at, pixel) in pixels.iter().enumerate() {
        let is_inside = (32..160).contains(&(at % 256)) && (32..128).contains(&(at / 256));
        assert_eq!(pixel[3], if is_inside { 255 } else { 0 }, "{at}");
    }
    let away = Square { corner: [CORNER[0] + 1000.0, CORNER[1]], ..square };
    assert!(drawn(&picture, &away).is_none());
    assert!(picture.reaches(&utm, [CORNER[0], CORNER[1] - 10.0], [CORNER[0] + 10.0, CORNER[1]]));
    assert!(!picture.reaches(&utm, [CORNER[0] + 200.0, CORNER[1] - 10.0], [CORNER[0] + 300.0, CORNER[1]]));
    assert!((picture.pixel_m(&utm, CORNER).unwrap() - 2.0).abs() < 1e-9);
}

/// The colour of the pixel of the file at a column and row.
fn color_at(picture: &Imagery, [col, row]: [u32; 2]) -> [u8; 4] {
    let corner = [CORNER[0] + 2.0 * f64::from(col), CORNER[1] - 2.0 * f64::from(row)];
    let utm = Crs::named(UTM).unwrap();
    let square = Square { crs: &utm, corner, pixel_m: 2.0, side: 16 };
    drawn(picture, &square).map_or([0; 4], |pixels| pixels[0])
}

#[test]
fn grey_and_opaqueness_and_16_bits_and_nodata_are_drawn_as_colours() {
    let (_folder, path) = file("a.tif");
    let count = (PLAIN.size[0] * PLAIN.size[1]) as usize;
    let at = |values: &dyn Fn(usize) -> Vec<u8>| (0..count).flat_map(values).collect::<Vec<u8>>();
    PLAIN.write::<Gray8>(&path, &at(&|at| vec![(at % 64) as u8]));
    assert_eq!(color_at(&Imagery::open(&path, 0).unwrap(), [40, 3]), [40, 40, 40, 255]);
    PLAIN.write::<RGBA8>(&path, &at(&|at| vec![200, 100, 50, if at % 64 < 32 { 0 } else { 255 }]));
    let picture = Imagery::open(&path, 0).unwrap();
    assert_eq!([[10, 3], [40, 3]].map(|place| color_at(&picture, place)), [[0; 4], [200, 100, 50, 255]]);
    let made = Made { nodata: Some("7"), ..PLAIN };
    made.write::<RGB8>(&path, &at(&|at| if at % 64 < 32 { vec![7, 7, 7] } else { vec![7, 7, 8] }));
    let picture = Imagery::open(&path, 0).unwrap();
    assert_eq!([[10, 3], [40, 3]].map(|place| color_at(&picture, place)), [[0; 4], [7, 7, 8, 255]]);
    // All of the range is used, then only a part of it.
    let numbers: Vec<u16> = (0..count).map(|at| (at % 64) as u16 * 1024).collect();
    PLAIN.write::<Gray16>(&path, &numbers);
    assert_eq!(color_at(&Imagery::open(&path, 0).unwrap(), [32, 3])[0], 127);
    let numbers: Vec<u16> = numbers.iter().map(|number| 500 + number / 64).collect();
    PLAIN.write::<Gray16>(&path, &numbers);
    let picture = Imagery::open(&path, 0).unwrap();
    let [dark, middle, bright] = [[0, 3], [32, 3], [62, 3]].map(|place| color_at(&picture, place)[0]);
    assert!(dark == 0 && (120..136).contains(&middle) && 250 < bright, "{dark} {middle} {bright}");
}

#[test]
fn a_picture_of_one_strip_is_read_in_parts_and_a_large_one_without_overviews_is_not_read_whole() {
    let (_folder, path) = file("a.tif");
    let made = Made { size: [4096, 4096], rows_per_strip: 4096, pixel: 1.0, ..PLAIN };
    let half = [vec![200; 2048], vec![60; 2048]].concat();
    made.write::<Gray8>(&path, &half.repeat(4096));
    let picture = Imagery::open(&path, 0).unwrap();
    assert!(!picture.is_seen_from_afar() && picture.sizes() == [[4096, 4096]]);
    let (utm, keep) = (Crs::named(UTM).unwrap(), Keep::new(64 << 20));
    let near = Square { crs: &utm, corner: CORNER, pixel_m: 1.0, side: 256 };
    let mut pixels = vec![0; 4 * 256 * 256];
    assert!(picture.draw(&near, &keep, &mut pixels).unwrap());
    assert!(keep.decoded() <= 5, "{} parts of 64 rows", keep.decoded());
    let far = Square { pixel_m: 16.0, ..near };
    assert!(picture.draw(&far, &keep, &mut pixels).unwrap());
    let parts_max = PIXELS_MAX / (64 * 4096) + 5;
    assert!(keep.decoded() <= parts_max, "{} of 64 parts, expected {parts_max} at most", keep.decoded());
    let at = |col: usize| pixels[4 * (100 * 256 + col)];
    assert_eq!([at(20), at(127), at(128), at(250)], [200, 200, 60, 60]);
}

#[test]
fn what_is_no_picture_with_a_place_is_refused_in_words() {
    let (_folder, path) = file("a.tif");
    let refused = |expected: &str, hint: &str| {
        let error = Imagery::open(&path, 0).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
        assert!(error.hint().is_some_and(|found| found.contains(hint)), "{error}: {:?}", error.hint());
    };
    Made { epsg: None, ..PLAIN }.write::<RGB8>(&path, &PLAIN.with_red([0, 0]));
    refused("a.tif: no coordinate reference system", "-a_srs");
    let heights = vec![1.0f32; 64 * 48];
    PLAIN.write::<tiff::encoder::colortype::Gray32Float>(&path, &heights);
    refused("colours are 32-bit floating point, expected 8- or 16-bit unsigned", "-ot Byte -scale");
    std::fs::write(&path, "east,north\n1,2\n").unwrap();
    refused("a.tif: a text file, not a raster, expected a GeoTIFF of colours", "name a picture");
    std::fs::write(&path, b"\x89PNG\r\n\x1a\n").unwrap();
    refused("not a TIFF: it begins with 89 50 4e 47, expected a GeoTIFF", "gdal_translate");
    let mut encoder = TiffEncoder::new(File::create(&path).unwrap()).unwrap();
    encoder.write_image::<RGB8>(64, 48, &PLAIN.with_red([0, 0])).unwrap();
    assert!(Imagery::open(&path, 0).is_err());
}

#[test]
fn a_picture_cut_off_anywhere_or_with_a_byte_changed_is_an_error_or_a_picture_and_never_a_panic() {
    let (_folder, path) = file("a.tif");
    let made = Made { size: [20, 12], rows_per_strip: 5, ..PLAIN };
    made.write::<RGB8>(&path, &made.with_red([3, 3]));
    let bytes = std::fs::read(&path).unwrap();
    let utm = Crs::named(UTM).unwrap();
    let square = Square { crs: &utm, corner: CORNER, pixel_m: 1.0, side: 64 };
    let look = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let picture = Imagery::open(&path, 0)?;
        picture.draw(&square, &Keep::new(1 << 20), &mut vec![0; 4 * 64 * 64])
    };
    assert!(look(&bytes).unwrap());
    for end in 0..bytes.len() {
        assert!(look(&bytes[..end]).is_err(), "cut off at {end} of {}", bytes.len());
    }
    for at in 0..bytes.len() {
        for flip in [1, 0x80, 0xff] {
            let mut other = bytes.clone();
            other[at] ^= flip;
            let _ = look(&other);
        }
    }
}
