//! A picture as pixels: rectangles, lines, other pictures laid into it; and as PNG.

use std::io::{Result, Write};

use super::color::{Color, WHITE, mix};

/// A rectangle of pixels, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    wide: usize,
    high: usize,
    pixels: Vec<Color>,
}

impl Image {
    /// A picture of one colour.
    ///
    /// # Panics
    /// When a side is 0.
    pub(crate) fn new(wide: usize, high: usize, color: Color) -> Self {
        assert!(0 < wide && 0 < high, "a picture has pixels");
        Self { wide, high, pixels: vec![color; wide * high] }
    }

    /// A picture of these pixels, row by row from the top left.
    ///
    /// # Panics
    /// When there are not as many as it has places.
    pub(crate) fn of(wide: usize, high: usize, pixels: Vec<Color>) -> Self {
        assert_eq!(pixels.len(), wide * high, "a picture has a colour at every place");
        Self { wide, high, pixels }
    }

    /// Pixels across.
    pub(crate) fn wide(&self) -> usize {
        self.wide
    }

    /// Pixels down.
    pub(crate) fn high(&self) -> usize {
        self.high
    }

    /// The colour at a place.
    pub(crate) fn pixel(&self, x: usize, y: usize) -> Color {
        self.pixels[y * self.wide + x]
    }

    /// Lays `share` of a colour over a pixel; nothing outside the picture.
    pub(crate) fn blend(&mut self, x: i64, y: i64, color: Color, share: f64) {
        if 0 <= x && x < self.wide as i64 && 0 <= y && y < self.high as i64 {
            let pixel = &mut self.pixels[y as usize * self.wide + x as usize];
            *pixel = mix(*pixel, color, share);
        }
    }

    /// Fills a rectangle: left, top, width, height; what lies outside is left out.
    pub(crate) fn fill(&mut self, [left, top, wide, high]: [i64; 4], color: Color) {
        let xs = left.clamp(0, self.wide as i64) as usize..(left + wide).clamp(0, self.wide as i64) as usize;
        for y in top.clamp(0, self.high as i64) as usize..(top + high).clamp(0, self.high as i64) as usize {
            self.pixels[y * self.wide..][xs.clone()].fill(color);
        }
    }

    /// Fills what rings enclose an odd number of times: pixels whose middles lie inside; a whole number is a middle.
    pub(crate) fn fill_rings(&mut self, rings: &[&[[f64; 2]]], color: Color) {
        let ends = |ring: &&[[f64; 2]]| -> Vec<([f64; 2], [f64; 2])> {
            ring.iter().copied().zip(ring.iter().copied().cycle().skip(1)).collect()
        };
        let edges: Vec<([f64; 2], [f64; 2])> = rings.iter().flat_map(ends).collect();
        let (low, high) = edges
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (a, _)| (low.min(a[1]), high.max(a[1])));
        let mut crossings = Vec::new();
        for y in low.ceil().max(0.0) as i64..=high.floor().min(self.high as f64 - 1.0) as i64 {
            let at = y as f64;
            let crossing = |(a, b): &([f64; 2], [f64; 2])| {
                ((a[1] <= at) != (b[1] <= at)).then(|| a[0] + (at - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
            };
            crossings.clear();
            crossings.extend(edges.iter().filter_map(crossing));
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.as_chunks::<2>().0 {
                for x in pair[0].ceil().max(0.0) as i64..pair[1].ceil().min(self.wide as f64) as i64 {
                    self.blend(x, y, color, 1.0);
                }
            }
        }
    }

    /// Draws the outline of a rectangle, `thick` pixels inwards.
    pub(crate) fn outline(&mut self, [left, top, wide, high]: [i64; 4], thick: i64, color: Color) {
        self.fill([left, top, wide, thick], color);
        self.fill([left, top + high - thick, wide, thick], color);
        self.fill([left, top, thick, high], color);
        self.fill([left + wide - thick, top, thick, high], color);
    }

    /// Draws a smooth straight line of `thick` pixels between two places (a whole number is a pixel's middle).
    pub(crate) fn line(&mut self, from: [f64; 2], to: [f64; 2], thick: f64, color: Color) {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = (dx * dx + dy * dy).sqrt();
        if length == 0.0 {
            return;
        }
        let reach = thick / 2.0 + 1.0;
        let low = [from[0].min(to[0]) - reach, from[1].min(to[1]) - reach];
        let high = [from[0].max(to[0]) + reach, from[1].max(to[1]) + reach];
        let inside = |at: f64, most: usize| at.clamp(0.0, most as f64 - 1.0) as i64;
        for y in inside(low[1], self.high)..=inside(high[1], self.high) {
            for x in inside(low[0], self.wide)..=inside(high[0], self.wide) {
                let (px, py) = (x as f64 - from[0], y as f64 - from[1]);
                let along = ((px * dx + py * dy) / length).clamp(0.0, length);
                let (ox, oy) = (px - along * dx / length, py - along * dy / length);
                let cover = thick / 2.0 + 0.5 - (ox * ox + oy * oy).sqrt();
                if 0.0 < cover {
                    self.blend(x, y, color, cover.min(1.0).min(thick));
                }
            }
        }
    }

    /// Lays another picture into this one; what lies outside is left out.
    pub(crate) fn paste(&mut self, other: &Image, left: usize, top: usize) {
        let wide = other.wide.min(self.wide.saturating_sub(left));
        for (row, pixels) in other.pixels.chunks(other.wide).enumerate().take(self.high.saturating_sub(top)) {
            self.pixels[(top + row) * self.wide + left..][..wide].copy_from_slice(&pixels[..wide]);
        }
    }

    /// Pictures beside each other, `gap` pixels apart, their tops in line.
    ///
    /// # Panics
    /// When there is none.
    pub(crate) fn beside(images: &[Image], gap: usize) -> Image {
        let wide = images.iter().map(|image| image.wide + gap).sum::<usize>() - gap;
        let high = images.iter().map(|image| image.high).max().expect("there is a picture");
        let mut whole = Image::new(wide, high, WHITE);
        let mut left = 0;
        for image in images {
            whole.paste(image, left, 0);
            left += image.wide + gap;
        }
        whole
    }

    /// Writes it as PNG. The same picture gives the same bytes.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_png(&self, out: impl Write) -> Result<()> {
        let mut encoder = png::Encoder::new(out, self.wide as u32, self.high as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        Ok(writer.finish()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_png_reads_back_as_the_picture_it_was() {
        let mut image = Image::new(5, 3, [10, 20, 30]);
        image.fill([1, 1, 2, 9], [200, 100, 0]);
        image.outline([0, 0, 5, 3], 1, [1, 2, 3]);
        let mut bytes = Vec::new();
        image.write_png(&mut bytes).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (5, 3));
        assert_eq!(pixels, image.pixels.as_flattened());
    }

    #[test]
    fn nothing_is_drawn_outside_a_picture() {
        let mut image = Image::new(4, 4, WHITE);
        image.fill([-3, -3, 100, 4], [0, 0, 0]);
        assert_eq!((image.pixel(3, 0), image.pixel(0, 1)), ([0, 0, 0], WHITE));
        image.line([-10.0, 2.0], [20.0, 2.0], 1.0, [9, 9, 9]);
        assert_eq!((0..4).map(|x| image.pixel(x, 2)).collect::<Vec<_>>(), [[9, 9, 9]; 4]);
        image.paste(&Image::new(10, 10, [7, 7, 7]), 3, 3);
        assert_eq!((image.pixel(3, 3), image.pixel(2, 3)), ([7, 7, 7], WHITE));
    }

    #[test]
    fn pictures_beside_each_other_keep_their_sizes() {
        let whole = Image::beside(&[Image::new(2, 3, [1, 1, 1]), Image::new(4, 1, [2, 2, 2])], 5);
        assert_eq!((whole.wide(), whole.high()), (11, 3));
        assert_eq!((whole.pixel(1, 2), whole.pixel(4, 0), whole.pixel(7, 0)), ([1, 1, 1], WHITE, [2, 2, 2]));
    }
}
