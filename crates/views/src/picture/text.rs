//! Letters on a picture.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use super::color::Color;
use super::image::Image;

/// How letters look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Font {
    /// For everything.
    Plain,
    /// For what a legend is about.
    Bold,
    /// For the title.
    Title,
}

impl Font {
    fn style(self) -> (FontWeight, RasterHeight) {
        match self {
            Font::Plain => (FontWeight::Regular, RasterHeight::Size20),
            Font::Bold => (FontWeight::Bold, RasterHeight::Size20),
            Font::Title => (FontWeight::Bold, RasterHeight::Size24),
        }
    }

    /// Pixels from line to line.
    pub fn line(self) -> i64 {
        self.style().1.val() as i64 + 2
    }

    /// Pixels that a text is wide.
    pub fn width(self, text: &str) -> i64 {
        let (weight, height) = self.style();
        (text.chars().count() * get_raster_width(weight, height)) as i64
    }
}

/// Where a text stands about its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    /// It begins there.
    Start,
    /// Its middle is there.
    Middle,
    /// It ends there.
    End,
}

/// Writes a line of text whose top is at `y`. A letter the font has not is a question mark.
pub(crate) fn write(image: &mut Image, [x, y]: [i64; 2], text: &str, font: Font, anchor: Anchor, color: Color) {
    let (weight, height) = font.style();
    let mut left = match anchor {
        Anchor::Start => x,
        Anchor::Middle => x - font.width(text) / 2,
        Anchor::End => x - font.width(text),
    };
    for letter in text.chars() {
        let raster = get_raster(letter, weight, height).or_else(|| get_raster('?', weight, height));
        let raster = raster.expect("the font has a question mark");
        for (row, pixels) in raster.rows().enumerate() {
            for (col, &cover) in pixels.iter().enumerate().filter(|(_, cover)| 0 < **cover) {
                image.blend(left + col as i64, y + row as i64, color, f64::from(cover) / 255.0);
            }
        }
        left += raster.width() as i64;
    }
}

/// A text cut to so many pixels, with dots where something is missing.
pub(crate) fn fitted(text: &str, font: Font, wide: i64) -> String {
    if font.width(text) <= wide {
        return text.to_owned();
    }
    let letters = (wide / font.width("x")) as usize;
    let kept: String = text.chars().take(letters.saturating_sub(2)).collect();
    format!("{}..", kept.trim_end())
}

/// A text in lines of at most so many pixels, broken between words.
pub(crate) fn wrapped(text: &str, font: Font, wide: i64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if font.width(line) + font.width(word) + font.width(" ") <= wide => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(fitted(word, font, wide)),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::color::WHITE;

    #[test]
    fn a_text_is_as_wide_as_it_says_and_stands_where_it_is_asked_to() {
        for (anchor, x) in [(Anchor::Start, 10), (Anchor::Middle, 130), (Anchor::End, 250)] {
            let mut image = Image::new(260, 30, WHITE);
            let text = "HHHHHHHHHHHHHH";
            write(&mut image, [x, 5], text, Font::Plain, anchor, [0, 0, 0]);
            let is_inked = |x: usize| (0..30).any(|y| image.pixel(x, y) != WHITE);
            let first = (0..260).find(|&x| is_inked(x)).unwrap() as i64;
            let last = (0..260).rfind(|&x| is_inked(x)).unwrap() as i64;
            let start = match anchor {
                Anchor::Start => x,
                Anchor::Middle => x - Font::Plain.width(text) / 2,
                Anchor::End => x - Font::Plain.width(text),
            };
            assert!(start <= first && first <= start + 2, "{anchor:?} begins at {first}");
            assert!(last < start + Font::Plain.width(text), "{anchor:?} ends at {last}");
        }
    }

    #[test]
    fn signs_of_measures_are_in_the_font() {
        for letter in "0123456789,.-+%°±×²<>=()/:".chars() {
            assert!(get_raster(letter, FontWeight::Regular, RasterHeight::Size20).is_some(), "{letter}");
        }
    }

    #[test]
    fn a_long_text_is_cut_or_broken_to_its_width() {
        let wide = Font::Plain.width("0123456789");
        assert_eq!(fitted("0123456789", Font::Plain, wide), "0123456789");
        assert_eq!(fitted("0123456789a", Font::Plain, wide), "01234567..");
        assert_eq!(wrapped("one two three four", Font::Plain, wide), ["one two", "three four"]);
        assert_eq!(wrapped("", Font::Plain, wide), Vec::<String>::new());
    }
}
