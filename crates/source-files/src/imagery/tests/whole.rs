//! Squares drawn from all of a picture, however large it is and however it is cut.

use super::writer::{Form, Layout, PIXEL_M, Packing, Picture, write};
use super::{CORNER, UTM, file};
use crate::crs::Crs;
use crate::imagery::level::PIXELS_MAX;
use crate::imagery::{Care, Imagery, Keep, Square};

/// Pixels along a side of the picture, which has more than a glimpse reads.
const SIDE: usize = 2080;

/// Differs from pixel to pixel, in no order.
fn grey(col: u32, row: u32) -> u8 {
    ((col.wrapping_mul(0x9e37_79b1) ^ row.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35) >> 24) as u8
}

/// What is drawn from a place on, with pixels so many times as large as those of the picture.
fn drawn(picture: &Imagery, [east, south]: [f64; 2], times: usize) -> Vec<u8> {
    let utm = Crs::named(UTM).unwrap();
    let side = (SIDE / times).next_multiple_of(16);
    let corner = [CORNER[0] + east * PIXEL_M, CORNER[1] - south * PIXEL_M];
    let square = Square { crs: &utm, corner, pixel_m: PIXEL_M * times as f64, side };
    let mut pixels = vec![0; 4 * side * side];
    assert!(picture.draw_with(Care::Whole, &square, &Keep::new(6 << 20), &mut pixels).unwrap());
    pixels.chunks(4).map(|pixel| pixel[0]).collect()
}

/// The mean of so many pixels each way.
fn mean([col, row]: [usize; 2], count: usize) -> f64 {
    let all = (0..count * count).map(|at| grey((col + at % count) as u32, (row + at / count) as u32));
    all.map(f64::from).sum::<f64>() / (count * count) as f64
}

#[test]
fn every_pixel_has_the_mean_of_those_below_it_however_a_picture_is_cut() {
    assert!(PIXELS_MAX < (SIDE * SIDE) as u64);
    let (_folder, path) = file("a.tif");
    let plain = Picture::of([SIDE as u32; 2], 1, 1, |col, row| vec![grey(col, row).into()]);
    for (layout, packing) in [
        (Layout::Tiles(256, 256), Packing::Deflate),
        (Layout::Strips(64), Packing::Deflate),
        (Layout::Strips(1), Packing::Deflate),
        (Layout::Strips(1), Packing::None),
        (Layout::Strips(SIDE as u32), Packing::None),
    ] {
        write(&path, Form::default(), &[Picture { layout, packing, ..plain.clone() }]);
        let picture = Imagery::open(&path, 0).unwrap();
        // On its pixels, and on the corners between them.
        let far = if packing == Packing::Deflate { 65 } else { 5 };
        for (times, shift) in [(1, 0), (far, 0), (1, 1)] {
            let pixels = drawn(&picture, [f64::from(shift) / 2.0; 2], times);
            let side = SIDE / times;
            let wide = side.next_multiple_of(16);
            for (row, col) in (0..side - 1).flat_map(|row| (0..side - 1).map(move |col| (row, col))) {
                let expected = if shift == 0 { mean([times * col, times * row], times) } else { mean([col, row], 2) };
                let off = (f64::from(pixels[row * wide + col]) - expected).abs();
                // From 64 places in 65 pixels.
                let off_max = if times <= 64 { 0.51 } else { 2.0 };
                assert!(off <= off_max, "{layout:?} {packing:?}, {times} times, {shift}: {off} at {col},{row}");
            }
        }
    }
}
