//! What stands around a map: title, frame with coordinates, scale bar, north, legends, notes.
//!
//! ```text
//!   title
//!   subtitle
//!        +--------------+   N
//!  north |              |   legend
//!        |     map      |   legend
//!        +--------------+   0 ---- 5 km
//!          east
//!   notes
//! ```

use super::color::{Color, GREY, INK, NOTHING, Ramp, WHITE};
use super::image::Image;
use super::map_extent::MapExtent;
use super::text::{Anchor, Font, fitted, wrapped, write};

/// Pixels between things.
const GAP: i64 = 16;
/// Pixels of the column that legends stand in.
const LEGEND_WIDE: i64 = 250;
/// Pixels left of a map, for northings.
const LEFT: i64 = 92;

/// What a colour on the map means.
#[derive(Clone, Debug)]
pub(crate) enum Legend {
    /// Colours in steps between numbers, and what the numbers are.
    Ramp {
        title: String,
        ramp: Ramp,
        /// Share of the scale from 0, its foot, to 1, and what stands there.
        marks: Vec<(f64, String)>,
    },
    /// A colour, and what it is.
    Keys { title: String, keys: Vec<(Key, String)> },
    /// Numbers.
    Lines { title: String, lines: Vec<String> },
}

/// Pixels from one line of a hatched face to the next.
pub(crate) const HATCH_PIXELS: usize = 7;

/// How a thing looks on the map.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Key {
    /// Filled with a colour.
    Filled(Color),
    /// Framed in a colour.
    Framed(Color),
    /// Filled, with a cross over it.
    Crossed(Color),
    /// Hatched, as holes are.
    Hatched,
    /// A line.
    Line(Color),
}

/// Where the ground lies and what its coordinates are called.
#[derive(Clone, Debug)]
pub(crate) struct Coordinates {
    /// East and north of the area's south-west post, in metres.
    pub origin_m: [f64; 2],
    /// Name of the system; empty when it is not known.
    pub crs: String,
}

/// All that stands around a map.
#[derive(Clone, Debug)]
pub(crate) struct Sheet {
    pub title: String,
    pub subtitle: String,
    pub coordinates: Coordinates,
    pub legends: Vec<Legend>,
    pub notes: String,
}

/// A map and what stands around it.
#[derive(Clone, Debug)]
pub(crate) struct Drawing {
    pub sheet: Sheet,
    pub map: Image,
    pub map_extent: MapExtent,
}

impl Drawing {
    /// All of it as one picture.
    pub fn image(&self) -> Image {
        self.sheet.around(&self.map, &self.map_extent)
    }
}

impl Sheet {
    /// The map with all that stands around it.
    pub fn around(&self, map: &Image, map_extent: &MapExtent) -> Image {
        let (map_wide, map_high) = (map.wide() as i64, map.high() as i64);
        let wide = LEFT + map_wide + GAP + LEGEND_WIDE;
        let top = GAP + Font::Title.line() + Font::Plain.line() + GAP;
        let notes = wrapped(&self.notes, Font::Plain, wide - 2 * GAP);
        let legends: i64 = 90 + self.legends.iter().map(|legend| legend.high() + GAP).sum::<i64>() + 50;
        let map_and_axis = (map_high + 2 * Font::Plain.line() + GAP).max(legends);
        let high = top + map_and_axis + notes.len() as i64 * Font::Plain.line() + GAP;
        let mut image = Image::new(wide as usize, high as usize, WHITE);
        let inside = wide - 2 * GAP;
        let title = fitted(&self.title, Font::Title, inside);
        write(&mut image, [GAP, GAP], &title, Font::Title, Anchor::Start, INK);
        let subtitle = fitted(&self.subtitle, Font::Plain, inside);
        write(&mut image, [GAP, GAP + Font::Title.line()], &subtitle, Font::Plain, Anchor::Start, GREY);
        image.paste(map, LEFT as usize, top as usize);
        image.outline([LEFT - 1, top - 1, map_wide + 2, map_high + 2], 1, INK);
        draw_axes(&mut image, [LEFT, top], map_extent, &self.coordinates);
        let left = LEFT + map_wide + GAP;
        draw_north(&mut image, [left + 14, top]);
        draw_scale(&mut image, [left + 60, top + 24], map_extent.metres_per_pixel(), 170);
        let mut y = top + 90;
        for legend in &self.legends {
            legend.draw(&mut image, [left, y]);
            y += legend.high() + GAP;
        }
        for (index, line) in notes.iter().enumerate() {
            let y = top + map_and_axis + index as i64 * Font::Plain.line();
            write(&mut image, [GAP, y], line, Font::Plain, Anchor::Start, GREY);
        }
        image
    }
}

impl Legend {
    pub fn high(&self) -> i64 {
        Font::Bold.line() * self.title_lines().len() as i64
            + match self {
                Legend::Ramp { .. } => RAMP_HIGH + Font::Plain.line(),
                Legend::Keys { keys, .. } => keys.len() as i64 * KEY_LINE,
                Legend::Lines { lines, .. } => lines.len() as i64 * Font::Plain.line(),
            }
    }

    fn title_lines(&self) -> Vec<String> {
        let (Legend::Ramp { title, .. } | Legend::Keys { title, .. } | Legend::Lines { title, .. }) = self;
        wrapped(title, Font::Bold, LEGEND_WIDE - 4)
    }

    pub fn draw(&self, image: &mut Image, [left, mut top]: [i64; 2]) {
        for line in self.title_lines() {
            write(image, [left, top], &line, Font::Bold, Anchor::Start, INK);
            top += Font::Bold.line();
        }
        match self {
            Legend::Ramp { ramp, marks, .. } => draw_ramp(image, [left, top], ramp, marks),
            Legend::Keys { keys, .. } => {
                for (index, (key, text)) in keys.iter().enumerate() {
                    let y = top + index as i64 * KEY_LINE;
                    key.draw(image, [left, y + 2, 30, KEY_LINE - 6]);
                    let text = fitted(text, Font::Plain, LEGEND_WIDE - 42);
                    write(image, [left + 40, y + 2], &text, Font::Plain, Anchor::Start, INK);
                }
            }
            Legend::Lines { lines, .. } => {
                for (index, line) in lines.iter().enumerate() {
                    let place = [left, top + index as i64 * Font::Plain.line()];
                    let line = fitted(line, Font::Plain, LEGEND_WIDE - 4);
                    write(image, place, &line, Font::Plain, Anchor::Start, INK);
                }
            }
        }
    }
}

const RAMP_HIGH: i64 = 200;
const KEY_LINE: i64 = 26;

fn draw_ramp(image: &mut Image, [left, top]: [i64; 2], ramp: &Ramp, marks: &[(f64, String)]) {
    let (wide, top) = (30, top + Font::Plain.line() / 2);
    for y in 0..RAMP_HIGH {
        let share = 1.0 - (y as f64 + 0.5) / RAMP_HIGH as f64;
        image.fill([left, top + y, wide, 1], ramp.at(share));
    }
    image.outline([left, top, wide, RAMP_HIGH], 1, INK);
    for (share, text) in marks {
        let y = top + ((1.0 - share) * (RAMP_HIGH - 1) as f64).round() as i64;
        image.fill([left + wide, y, 6, 1], INK);
        let text = fitted(text, Font::Plain, LEGEND_WIDE - wide - 14);
        write(image, [left + wide + 10, y - Font::Plain.line() / 2 + 1], &text, Font::Plain, Anchor::Start, INK);
    }
}

impl Key {
    fn draw(self, image: &mut Image, rect @ [left, top, wide, high]: [i64; 4]) {
        let middle = (top + high / 2) as f64;
        match self {
            Key::Filled(color) => {
                image.fill(rect, color);
                image.outline(rect, 1, GREY);
            }
            Key::Framed(color) => image.outline(rect, 3, color),
            Key::Crossed(color) => draw_crossed(image, rect, color),
            Key::Hatched => {
                image.fill(rect, NOTHING);
                for at in (0..wide + high).step_by(HATCH_PIXELS) {
                    let (from, to) = ((at - high).max(0), at.min(wide));
                    let end = |across: i64| [(left + across) as f64, (top + at - across) as f64];
                    image.line(end(from), end(to), 2.0, GREY);
                }
                image.outline(rect, 1, GREY);
            }
            Key::Line(color) => image.line([left as f64, middle], [(left + wide) as f64, middle], 2.0, color),
        }
    }
}

/// A rectangle of a colour with a cross over it.
pub(crate) fn draw_crossed(image: &mut Image, rect @ [left, top, wide, high]: [i64; 4], color: Color) {
    image.fill(rect, color);
    image.outline(rect, 1, INK);
    let (left, top) = (left as f64, top as f64);
    let (right, bottom) = (left + wide as f64 - 1.0, top + high as f64 - 1.0);
    image.line([left, top], [right, bottom], 1.5, INK);
    image.line([left, bottom], [right, top], 1.5, INK);
}

fn draw_north(image: &mut Image, [x, y]: [i64; 2]) {
    let (middle, top) = (x as f64, y as f64 + 22.0);
    write(image, [x, y - 4], "N", Font::Bold, Anchor::Middle, INK);
    for step in 0..=40 {
        // A slim triangle, row by row.
        let half = f64::from(step) * 0.24;
        image.line([middle - half, top + f64::from(step)], [middle + half + 0.01, top + f64::from(step)], 1.0, INK);
    }
    for step in 0..=12 {
        let half = f64::from(step) * 0.5;
        let y = top + 40.0 - 12.0 + f64::from(step);
        image.line([middle - half, y], [middle + half + 0.01, y], 1.0, WHITE);
    }
}

/// Marks of a legend from `low` to `high` at round numbers, three to eight of them: the share of the scale that each
/// stands at, and the number.
pub(crate) fn round_marks(low: f64, high: f64) -> Vec<(f64, f64)> {
    /// Spaces between marks, at most.
    const SPACES: f64 = 7.0;
    let length = (high - low).max(1e-3);
    // Steps in thousandths, so that they are whole numbers and their multiples are exact.
    let steps = (0..9).flat_map(|power| [1, 2, 5].map(|digit| digit * 10_i64.pow(power)));
    let step = steps.into_iter().find(|&step| length * 1000.0 <= SPACES * step as f64).unwrap_or(1_000_000_000);
    let first = (low * 1000.0 / step as f64 - 1e-9).ceil() as i64;
    let last = (high * 1000.0 / step as f64 + 1e-9).floor() as i64;
    let value = |index: i64| (index * step) as f64 / 1000.0;
    (first..=last).map(|index| ((value(index) - low) / length, value(index))).collect()
}

/// Lengths a scale bar may have, and coordinates may stand apart: 1, 2 or 5 times a power of ten.
pub(crate) fn round_length(at_most_m: f64) -> f64 {
    let mut best = 1.0;
    for power in 0..7 {
        for digit in [1.0, 2.0, 5.0] {
            let length = digit * f64::from(10_i32.pow(power));
            if length <= at_most_m {
                best = length;
            }
        }
    }
    best
}

/// A length as people say it.
pub(crate) fn length_text(metres: f64) -> String {
    if metres < 1000.0 { format!("{metres} m") } else { format!("{} km", metres / 1000.0) }
}

/// A bar of a round length, at most so many pixels long.
pub(crate) fn draw_scale(image: &mut Image, [left, top]: [i64; 2], metres_per_pixel: f64, pixels_max: i64) {
    let metres = round_length(pixels_max as f64 * metres_per_pixel);
    let pixels = metres / metres_per_pixel;
    let half = (pixels / 2.0).round() as i64;
    let whole = pixels.round() as i64;
    image.fill([left, top + 22, whole, 8], WHITE);
    image.fill([left, top + 22, half, 8], INK);
    image.outline([left, top + 22, whole, 8], 1, INK);
    write(image, [left, top], "0", Font::Plain, Anchor::Start, INK);
    write(image, [left + whole, top], &length_text(metres), Font::Plain, Anchor::End, INK);
}

/// Ticks with eastings below and northings left of the map, in kilometres.
fn draw_axes(image: &mut Image, [left, top]: [i64; 2], map_extent: &MapExtent, coordinates: &Coordinates) {
    let step = round_length(260.0 * map_extent.metres_per_pixel()).max(1.0);
    let [east_0, north_0] = coordinates.origin_m;
    let [west, south, east, north] = map_extent.extent_m;
    let decimals = if step < 10.0 {
        3
    } else if step < 100.0 {
        2
    } else if step < 1000.0 {
        1
    } else {
        0
    };
    let bottom = top + map_extent.pixels[1] as i64;
    for east_m in ticks(east_0 + west, east_0 + east, step) {
        let x = left + map_extent.at([east_m - east_0, south])[0].round() as i64;
        image.fill([x, bottom, 1, 7], INK);
        let text = format!("{:.decimals$}", east_m / 1000.0);
        let half = Font::Plain.width(&text) / 2;
        let x = x.clamp(left + half - 30, left + map_extent.pixels[0] as i64 - half + 30);
        write(image, [x, bottom + 8], &text, Font::Plain, Anchor::Middle, INK);
    }
    for north_m in ticks(north_0 + south, north_0 + north, step) {
        let y = top + map_extent.at([west, north_m - north_0])[1].round() as i64;
        image.fill([left - 8, y, 7, 1], INK);
        let text = format!("{:.decimals$}", north_m / 1000.0);
        write(image, [left - 11, y - Font::Plain.line() / 2], &text, Font::Plain, Anchor::End, INK);
    }
    let unit = if coordinates.crs.is_empty() { "km".into() } else { format!("km, {}", coordinates.crs) };
    let place = [left + map_extent.pixels[0] as i64, bottom + 8 + Font::Plain.line()];
    write(image, place, &fitted(&unit, Font::Plain, map_extent.pixels[0] as i64), Font::Plain, Anchor::End, GREY);
}

/// The multiples of `step` from `low` to `high`.
fn ticks(low: f64, high: f64, step: f64) -> impl Iterator<Item = f64> {
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last).map(move |index| index as f64 * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_bar_has_a_round_length_that_fits() {
        for (most, expected) in [(1.5, 1.0), (999.0, 500.0), (4999.0, 2000.0), (5000.0, 5000.0), (123_456.0, 100_000.0)]
        {
            assert_eq!(round_length(most), expected);
        }
        assert_eq!(length_text(500.0), "500 m");
        assert_eq!(length_text(20_000.0), "20 km");
    }

    #[test]
    fn marks_of_a_legend_are_round_numbers_inside_it() {
        let values = |low, high| round_marks(low, high).into_iter().map(|(_, value)| value).collect::<Vec<_>>();
        assert_eq!(values(612.3, 1587.0), [800.0, 1000.0, 1200.0, 1400.0]);
        assert_eq!(values(0.0, 7.0), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        assert_eq!(values(-3.2, 0.4), [-3.0, -2.0, -1.0, 0.0]);
        assert_eq!(values(0.0, 0.6), [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
        assert_eq!(round_marks(0.0, 50.0).last(), Some(&(1.0, 50.0)));
        for high in 1..2000 {
            let marks = round_marks(0.0, f64::from(high) * 0.37);
            assert!((3..=8).contains(&marks.len()) && marks.iter().all(|(share, _)| (0.0..=1.0001).contains(share)));
        }
    }

    #[test]
    fn ticks_stand_at_round_coordinates_inside() {
        assert_eq!(ticks(505_000.0, 525_000.0, 10_000.0).collect::<Vec<_>>(), [510_000.0, 520_000.0]);
        assert_eq!(ticks(-250.0, 250.0, 200.0).collect::<Vec<_>>(), [-200.0, 0.0, 200.0]);
    }
}
