//! Every kind of picture that is read, written here and compared with its colours pixel by pixel.

use super::writer::{Form, Layout, PIXEL_M, Packing, Picture, write};
use super::{CORNER, UTM, file};
use crate::crs::Crs;
use crate::imagery::{Imagery, Keep, Square};

/// No multiple of any side of tiles, and not square.
const SIZE: [u32; 2] = [50, 37];
/// Pixels along the side of the squares that are drawn.
const SIDE: usize = 64;
const NOTHING: [u8; 4] = [0; 4];

/// Differs from pixel to pixel in all three parts.
fn color(col: u32, row: u32) -> [u8; 3] {
    [5 * col as u8, 255 - 6 * row as u8, (7 * col + 11 * row) as u8]
}

/// One for each 16 x 16 pixels.
fn patch(col: u32, row: u32) -> [u8; 3] {
    [[200, 40, 30], [30, 180, 60], [20, 60, 220], [240, 240, 240], [0, 0, 0]][(col / 16 + 2 * (row / 16)) as usize % 5]
}

fn opaque([red, green, blue]: [u8; 3]) -> [u8; 4] {
    [red, green, blue, 255]
}

/// What is drawn of a picture from its corner, with pixels so many times as large as its own.
fn drawn(picture: &Imagery, times: u32) -> Vec<[u8; 4]> {
    let utm = Crs::named(UTM).unwrap();
    let square = Square { crs: &utm, corner: CORNER, pixel_m: PIXEL_M * f64::from(times), side: SIDE };
    let mut pixels = vec![0; 4 * SIDE * SIDE];
    picture.draw(&square, &Keep::new(1 << 20), &mut pixels).unwrap();
    pixels.as_chunks().0.to_vec()
}

/// Compares the pictures of a file, drawn pixel by pixel, with the colours that it should have.
#[track_caller]
fn check(form: Form, pictures: &[Picture], off_max: u8, expected: impl Fn(u32, u32) -> [u8; 4]) {
    let (_folder, path) = file("a.tif");
    write(&path, form, pictures);
    let what = |first: &Picture| {
        let Picture { layout, packing, is_planar, is_predicted, bits, bands, .. } = first;
        format!("{layout:?} {packing:?} planar {is_planar} predicted {is_predicted} {bits} bits {bands} bands {form:?}")
    };
    let picture = Imagery::open(&path, 0).unwrap_or_else(|error| panic!("{error}: {}", what(&pictures[0])));
    for (at, pixel) in drawn(&picture, 1).into_iter().enumerate() {
        let (col, row) = ((at % SIDE) as u32, (at / SIDE) as u32);
        let is_inside = col < SIZE[0] && row < SIZE[1];
        let expected = if is_inside { expected(col, row) } else { NOTHING };
        let off = pixel.iter().zip(expected).map(|(part, expected)| part.abs_diff(expected)).max();
        assert!(off <= Some(off_max), "{pixel:?} at {col},{row}, expected {expected:?}: {}", what(&pictures[0]));
    }
}

const PLAIN: Form = Form { is_big_endian: false, is_big: false, nodata: None };
const LAYOUTS: [Layout; 4] = [Layout::Tiles(16, 16), Layout::Tiles(64, 32), Layout::Strips(7), Layout::Strips(37)];

#[test]
fn a_picture_has_the_same_colours_in_every_layout_and_packing() {
    let packings = [Packing::None, Packing::PackBits, Packing::Lzw, Packing::Deflate, Packing::Zstd];
    for (layout, packing) in LAYOUTS.into_iter().flat_map(|layout| packings.map(|packing| (layout, packing))) {
        for (is_planar, is_predicted) in [(false, false), (true, false), (false, true), (true, true)] {
            let rgb = Picture { layout, packing, is_planar, is_predicted, ..Picture::rgb(SIZE, color) };
            let is_big_endian = is_predicted;
            check(Form { is_big_endian, ..PLAIN }, std::slice::from_ref(&rgb), 0, |col, row| opaque(color(col, row)));
            check(Form { is_big: true, ..PLAIN }, std::slice::from_ref(&rgb), 0, |col, row| opaque(color(col, row)));
            // All of the range is used, so that nothing is stretched.
            let numbers = rgb.numbers.iter().map(|number| 257 * number).collect();
            let deep = Picture { bits: 16, numbers, ..rgb };
            check(Form { is_big_endian, ..PLAIN }, &[deep], 0, |col, row| opaque(color(col, row)));
        }
    }
}

#[test]
fn jpegs_have_their_colours_however_they_stand_in_a_file() {
    // Strips end where blocks do, as those of other writers.
    let layouts = [Layout::Tiles(16, 16), Layout::Tiles(64, 32), Layout::Strips(8), Layout::Strips(37)];
    for (layout, is_big_endian) in layouts.into_iter().zip([false, true, false, true]) {
        for (has_tables, photometric) in [(true, 6), (false, 6), (true, 2), (false, 2)] {
            let packing = Packing::Jpeg { has_tables };
            let rgb = Picture { layout, packing, photometric, ..Picture::rgb(SIZE, patch) };
            let form = Form { is_big_endian, ..PLAIN };
            check(form, std::slice::from_ref(&rgb), 2, |col, row| opaque(patch(col, row)));
            let planar = Picture { is_planar: true, photometric: 2, ..rgb.clone() };
            check(form, &[planar], 0, |col, row| opaque(patch(col, row)));
            let grey =
                Picture { layout, packing, ..Picture::of(SIZE, 1, 1, |col, row| vec![patch(col, row)[0].into()]) };
            check(form, &[grey], 0, |col, row| opaque([patch(col, row)[0]; 3]));
        }
    }
    // Hues of 2 x 2 pixels: near the border of two patches they may be mixed.
    for layout in [Layout::Tiles(16, 16), Layout::Tiles(32, 32), Layout::Strips(16), Layout::Strips(37)] {
        let packing = Packing::Jpeg { has_tables: false };
        let rgb = Picture { layout, packing, photometric: 6, subsampling: 2, ..Picture::rgb(SIZE, patch) };
        let (_folder, path) = file("a.tif");
        write(&path, PLAIN, &[rgb]);
        let pixels = drawn(&Imagery::open(&path, 0).unwrap(), 1);
        for (col, row) in (0..SIZE[0]).flat_map(|col| (0..SIZE[1]).map(move |row| (col, row))) {
            let is_near_border = [col, row].iter().any(|place| matches!(place % 16, 0 | 1 | 14 | 15));
            let (pixel, expected) = (pixels[row as usize * SIDE + col as usize], opaque(patch(col, row)));
            let off = pixel.iter().zip(expected).map(|(part, expected)| part.abs_diff(expected)).max();
            assert!(is_near_border || off <= Some(3), "{pixel:?} at {col},{row}, expected {expected:?}: {layout:?}");
        }
    }
}

#[test]
fn a_palette_gives_the_colours_at_every_depth() {
    for (bits, layout) in [1, 2, 4, 8].into_iter().flat_map(|bits| LAYOUTS.map(|layout| (bits, layout))) {
        let count = 1 << bits;
        let entry = |number: u16| [17 * number % 256, 255 - 31 * number % 256, 3 * number % 256].map(|part| part as u8);
        let part = |part: usize| (0..count).map(move |number| 257 * u16::from(entry(number)[part]));
        let number = |col: u32, row: u32| (col + 3 * row) as u16 % count;
        let packing = if bits < 4 { Packing::PackBits } else { Packing::Deflate };
        let palette: Vec<u16> = (0..3).flat_map(part).collect();
        let picture =
            Picture { bits, layout, packing, palette, ..Picture::of(SIZE, 1, 3, |col, row| vec![number(col, row)]) };
        check(PLAIN, std::slice::from_ref(&picture), 0, |col, row| opaque(entry(number(col, row))));
        check(Form { nodata: Some("1"), ..PLAIN }, &[picture], 0, |col, row| match number(col, row) {
            1 => NOTHING,
            number => opaque(entry(number)),
        });
    }
}

#[test]
fn grey_is_read_at_every_depth_and_either_way_round() {
    for (bits, photometric) in [1, 2, 4, 8, 16].into_iter().flat_map(|bits| [(bits, 0), (bits, 1)]) {
        let most = ((1u32 << bits) - 1) as u16;
        // The brightest is there, so that 16 bits are not stretched.
        let number = move |col: u32, row: u32| if row == 0 { most } else { (977 * col + 1733 * row) as u16 & most };
        let picture = Picture { bits, ..Picture::of(SIZE, 1, photometric, |col, row| vec![number(col, row)]) };
        check(PLAIN, &[picture], 0, |col, row| {
            let level = (u32::from(number(col, row)) * 255 / u32::from(most)) as u8;
            opaque([if photometric == 0 { 255 - level } else { level }; 3])
        });
    }
}

/// What a band beyond the colours may be.
const UNKNOWN: u16 = 0;
const MULTIPLIED: u16 = 1;
const ALPHA: u16 = 2;

#[test]
fn a_band_of_opaqueness_makes_pixels_transparent() {
    let alpha = |col: u32| [0, 255, 128, 3][col as usize % 4];
    let faded = |color: [u8; 3], alpha: u8| {
        let [red, green, blue] = color.map(|part| (f32::from(part) * f32::from(alpha) / 255.0 + 0.5) as u8);
        [red, green, blue, alpha]
    };
    let straight = |col: u32, row: u32| faded(color(col, row), alpha(col));
    for is_planar in [false, true] {
        let with = |extra: &[u16], bands: u32, pixel: &dyn Fn(u32, u32) -> Vec<u8>| Picture {
            extra: extra.to_vec(),
            is_planar,
            ..Picture::of(SIZE, bands, 2, |col, row| pixel(col, row).into_iter().map(u16::from).collect())
        };
        let rgba = |col: u32, row: u32| [&color(col, row)[..], &[alpha(col)]].concat();
        for extra in [&[ALPHA][..], &[]] {
            check(PLAIN, &[with(extra, 4, &rgba)], 1, straight);
        }
        let multiplied = |col: u32, row: u32| straight(col, row).to_vec();
        check(PLAIN, &[with(&[MULTIPLIED], 4, &multiplied)], 1, straight);
        // A fourth band of something else, such as infrared, and one of opaqueness behind it.
        check(PLAIN, &[with(&[UNKNOWN], 4, &rgba)], 0, |col, row| opaque(color(col, row)));
        let five = |col: u32, row: u32| [&color(col, row)[..], &[99, alpha(col)]].concat();
        check(PLAIN, &[with(&[UNKNOWN, ALPHA], 5, &five)], 1, straight);
        let grey = |col: u32, row: u32| vec![color(col, row)[0].into(), alpha(col).into()];
        let grey = Picture { extra: vec![ALPHA], is_planar, ..Picture::of(SIZE, 2, 1, grey) };
        check(PLAIN, &[grey], 1, |col, row| faded([color(col, row)[0]; 3], alpha(col)));
    }
    let deep = |col: u32, row: u32| {
        let [red, green, blue] = color(col, row).map(|part| 257 * u16::from(part));
        vec![red, green, blue, 257 * u16::from(alpha(col))]
    };
    let deep = Picture { bits: 16, extra: vec![ALPHA], ..Picture::of(SIZE, 4, 2, deep) };
    check(PLAIN, &[deep], 1, straight);
}

/// A mask of one bit a pixel: a disc.
fn mask(size: [u32; 2]) -> Picture {
    Picture { bits: 1, kind: 4, ..Picture::of(size, 1, 4, move |col, row| vec![is_in_disc(size, col, row).into()]) }
}

fn is_in_disc(size: [u32; 2], col: u32, row: u32) -> bool {
    let [x, y] = [(col, size[0]), (row, size[1])].map(|(at, of)| 2.0 * (f64::from(at) + 0.5) / f64::from(of) - 1.0);
    x * x + y * y < 0.8
}

#[test]
fn beyond_a_mask_there_is_nothing_whatever_the_layouts_of_both() {
    let expected = |col, row| if is_in_disc(SIZE, col, row) { opaque(color(col, row)) } else { NOTHING };
    for (layout, of_mask) in LAYOUTS.into_iter().flat_map(|layout| LAYOUTS.map(|of_mask| (layout, of_mask))) {
        let picture = Picture { layout, ..Picture::rgb(SIZE, color) };
        let deflate = Picture { layout: of_mask, packing: Packing::Deflate, ..mask(SIZE) };
        check(PLAIN, &[picture.clone(), deflate.clone()], 0, expected);
        let bytes = deflate.numbers.iter().map(|number| 255 * number).collect();
        let bytes = Picture { bits: 8, numbers: bytes, ..deflate };
        check(PLAIN, &[picture, bytes], 0, expected);
    }
    let packing = Packing::Jpeg { has_tables: false };
    let jpeg = Picture { packing, photometric: 6, layout: Layout::Tiles(32, 32), ..Picture::rgb(SIZE, patch) };
    let expected = |col, row| if is_in_disc(SIZE, col, row) { opaque(patch(col, row)) } else { NOTHING };
    check(PLAIN, &[jpeg, mask(SIZE)], 2, expected);
}

#[test]
fn nodata_is_where_all_parts_of_a_colour_have_it() {
    let is_nothing = |col: u32, row: u32| (col + row).is_multiple_of(3);
    for (is_planar, layout) in LAYOUTS.into_iter().flat_map(|layout| [(false, layout), (true, layout)]) {
        let pixel = |col: u32, row: u32| if is_nothing(col, row) { [9; 3] } else { [9, 9, 10] };
        let picture = Picture { is_planar, layout, ..Picture::rgb(SIZE, pixel) };
        let expected = |col, row| if is_nothing(col, row) { NOTHING } else { opaque([9, 9, 10]) };
        check(Form { nodata: Some("9"), ..PLAIN }, std::slice::from_ref(&picture), 0, expected);
        // What no pixel can have is passed over.
        for nodata in ["-9999", "nan", "0.5", "1e10"] {
            check(Form { nodata: Some(nodata), ..PLAIN }, std::slice::from_ref(&picture), 0, |col, row| {
                opaque(pixel(col, row))
            });
        }
    }
}

/// Half as fine as another, of one colour.
fn overview(of: [u32; 2], color: [u8; 3]) -> Picture {
    Picture { kind: 1, ..Picture::rgb(of.map(|side| side.div_ceil(2)), move |_, _| color) }
}

#[test]
fn from_afar_overviews_are_drawn_with_their_masks() {
    let [red, green, blue] = [[255, 0, 0], [0, 255, 0], [0, 0, 255]];
    let full = Picture::rgb(SIZE, |_, _| red);
    let half = overview(SIZE, green);
    let quarter = overview(half.size, blue);
    let masks = [SIZE, half.size, quarter.size].map(mask);
    let small = |mask: &Picture| Picture { kind: 5, ..mask.clone() };
    let middle_and_corner = |pictures: &[Picture], beside: &[Picture], times: u32| {
        let (_folder, path) = file("a.tif");
        write(&path, PLAIN, pictures);
        if !beside.is_empty() {
            write(&path.with_extension("tif.ovr"), PLAIN, beside);
        }
        let picture = Imagery::open(&path, 0).unwrap();
        assert_eq!(picture.sizes(), [full.size, half.size, quarter.size]);
        let pixels = drawn(&picture, times);
        let [col, row] = [SIZE[0] / 2 / times, SIZE[1] / 2 / times].map(|at| at as usize);
        [pixels[row * SIDE + col], pixels[0]]
    };
    for (times, color) in [(1, red), (2, green), (4, blue), (8, blue)] {
        let color = opaque(color);
        let all = [full.clone(), half.clone(), quarter.clone()];
        assert_eq!(middle_and_corner(&all, &[], times), [color; 2], "{times}");
        assert_eq!(middle_and_corner(&all[..1], &all[1..], times), [color; 2], "{times}");
        let masked = [&all[0], &masks[0], &all[1], &all[2], &small(&masks[1]), &small(&masks[2])].map(Clone::clone);
        let [middle, corner] = middle_and_corner(&masked, &[], times);
        assert!(middle == color && corner[3] < 160, "{middle:?} {corner:?} {times}");
    }
}

#[test]
fn sixteen_bits_are_stretched_by_what_is_there_and_not_by_what_is_masked_out() {
    // From 2000 to 4000 where the picture is, and 0 beyond it.
    let number = |col: u32, row: u32| if is_in_disc(SIZE, col, row) { 2000 + 40 * col as u16 } else { 0 };
    let deep = Picture { bits: 16, ..Picture::of(SIZE, 1, 1, |col, row| vec![number(col, row)]) };
    let transparent = |col: u32, row: u32| vec![number(col, row), if number(col, row) == 0 { 0 } else { u16::MAX }];
    let transparent = Picture { bits: 16, extra: vec![ALPHA], ..Picture::of(SIZE, 2, 1, transparent) };
    let tiled = Picture { layout: Layout::Tiles(128, 128), ..deep.clone() };
    for (form, pictures) in [
        (PLAIN, vec![deep.clone(), mask(SIZE)]),
        (PLAIN, vec![tiled, mask(SIZE)]),
        (PLAIN, vec![transparent]),
        (Form { nodata: Some("0"), ..PLAIN }, vec![deep]),
    ] {
        let (_folder, path) = file("a.tif");
        write(&path, form, &pictures);
        let pixels = drawn(&Imagery::open(&path, 0).unwrap(), 1);
        let middle = pixels[18 * SIDE..18 * SIDE + 50].to_vec();
        assert_eq!([middle[0], middle[49]], [NOTHING; 2]);
        let [dark, medium, bright] = [5, 25, 45].map(|col| middle[col][0]);
        assert!(dark < 40 && (110..145).contains(&medium) && 215 < bright, "{dark} {medium} {bright}");
    }
}
