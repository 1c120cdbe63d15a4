//! Maps of numbers as PNG: one colour a cell, north up.

use std::io::{Error, Write};

/// Most pixels a side: beyond, cells are drawn by the largest of a square of them.
const PIXELS_MAX: usize = 4096;

/// Writes a map of `rows` x `columns` numbers, given row by row from the south. `color` gives red, green and blue.
///
/// # Errors
/// When `out` cannot be written to.
pub fn write_map(
    out: impl Write,
    (rows, columns): (usize, usize),
    numbers: &[f32],
    color: impl Fn(f32) -> [u8; 3],
) -> Result<(), Error> {
    let step = rows.max(columns).div_ceil(PIXELS_MAX).max(1);
    let (high, wide) = (rows.div_ceil(step), columns.div_ceil(step));
    let mut pixels = Vec::with_capacity(3 * high * wide);
    for row in (0..high).rev() {
        for column in 0..wide {
            let square = (row * step..rows.min((row + 1) * step))
                .flat_map(|row| (column * step..columns.min((column + 1) * step)).map(move |column| (row, column)));
            let largest = square.map(|(row, column)| numbers[row * columns + column]).fold(f32::NEG_INFINITY, f32::max);
            pixels.extend(color(largest));
        }
    }
    let mut encoder = png::Encoder::new(out, wide as u32, high as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    Ok(writer.finish()?)
}

/// White at 0, through yellow and red to black at 1 and above.
pub fn heat(share: f32) -> [u8; 3] {
    const STOPS: [[f32; 3]; 5] =
        [[255.0, 255.0, 255.0], [255.0, 224.0, 120.0], [240.0, 120.0, 40.0], [180.0, 20.0, 30.0], [30.0, 0.0, 20.0]];
    let place = if share.is_finite() { share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32 } else { 0.0 };
    let low = (place as usize).min(STOPS.len() - 2);
    let part = place - low as f32;
    [0, 1, 2].map(|i| (STOPS[low][i] * (1.0 - part) + STOPS[low + 1][i] * part) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_has_north_up_and_its_colors_run_from_white_to_dark() {
        let mut bytes = Vec::new();
        write_map(&mut bytes, (2, 3), &[0.0, 0.0, 1.0, 0.5, 0.0, 0.0], heat).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!((reader.info().width, reader.info().height), (3, 2));
        assert_eq!(pixels[0..3], heat(0.5), "the north-western pixel is that of the second row");
        assert_eq!(pixels[15..18], heat(1.0));
        assert_eq!(heat(0.0), [255; 3]);
        assert_eq!(heat(f32::NAN), heat(0.0));
    }
}
