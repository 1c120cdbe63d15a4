//! A picture with a depth at every sample: what is nearer covers what is farther, in whatever order it is drawn.

use super::camera::{NEAREST_M, View};
use super::color::Color;
use super::image::Image;

/// Samples along a side of a pixel.
pub(crate) const SAMPLES: usize = 2;

/// A corner to be drawn: its place, and two numbers that are blended between corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    /// To the right, up and ahead of the observer, in metres.
    pub turned: [f64; 3],
    /// What a colour is made of, such as height and light.
    pub values: [f64; 2],
}

/// Samples with depths.
pub(crate) struct DepthImage {
    wide: usize,
    high: usize,
    /// 1 / metres ahead; 0 where nothing is drawn.
    nearness: Vec<f32>,
    colors: Vec<Color>,
}

/// A corner on the picture; its values are divided by its distance, because only those change evenly across it.
#[derive(Clone, Copy)]
struct Placed {
    x: f64,
    y: f64,
    near: f64,
    values: [f64; 2],
}

impl DepthImage {
    /// A picture of `pixels` with nothing on it but `backdrop(row)`, rows of pixels counted from the top.
    pub fn new(pixels: [usize; 2], backdrop: impl Fn(f64) -> Color) -> Self {
        let (wide, high) = (pixels[0] * SAMPLES, pixels[1] * SAMPLES);
        let row_color = |row: usize| backdrop((row as f64 + 0.5) / SAMPLES as f64);
        let colors = (0..high).flat_map(|row| std::iter::repeat_n(row_color(row), wide)).collect();
        Self { wide, high, nearness: vec![0.0; wide * high], colors }
    }

    /// The size that a [`View`] of this picture is made for.
    pub fn size(&self) -> [usize; 2] {
        [self.wide, self.high]
    }

    /// Draws a triangle; `color` gets the two values and the metres ahead.
    pub fn triangle(&mut self, view: &View, corners: [Corner; 3], color: &impl Fn([f64; 2], f64) -> Color) {
        if corners.iter().all(|corner| NEAREST_M <= corner.turned[2]) {
            self.fill(corners.map(|corner| placed(view, corner)), color);
            return;
        }
        let ahead = clipped(corners);
        for i in 2..ahead.len() {
            self.fill([ahead[0], ahead[i - 1], ahead[i]].map(|corner| placed(view, corner)), color);
        }
    }

    fn fill(&mut self, [mut a, mut b, mut c]: [Placed; 3], color: &impl Fn([f64; 2], f64) -> Color) {
        if b.y < a.y {
            std::mem::swap(&mut a, &mut b);
        }
        if c.y < b.y {
            std::mem::swap(&mut b, &mut c);
            if b.y < a.y {
                std::mem::swap(&mut a, &mut b);
            }
        }
        let doubled = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
        if doubled == 0.0 {
            return;
        }
        let slope = |of: fn(&Placed) -> f64| {
            let (to_b, to_c) = (of(&b) - of(&a), of(&c) - of(&a));
            let dx = (to_b * (c.y - a.y) - to_c * (b.y - a.y)) / doubled;
            let dy = (to_c * (b.x - a.x) - to_b * (c.x - a.x)) / doubled;
            [dx, dy]
        };
        let slopes = [slope(|p| p.near), slope(|p| p.values[0]), slope(|p| p.values[1])];
        let starts = [a.near, a.values[0], a.values[1]];
        let mut y = (a.y - 0.5).ceil().max(0.0);
        let last = (c.y - 0.5).min(self.high as f64 - 0.5);
        while y < last {
            // Samples lie in the middles.
            let at = y + 0.5;
            let long = crossing(&a, &c, at);
            let short = if at < b.y { crossing(&a, &b, at) } else { crossing(&b, &c, at) };
            let first = (long.min(short) - 0.5).ceil().max(0.0);
            let end = (long.max(short) - 0.5).ceil().min(self.wide as f64);
            if first < end {
                let along = |i: usize| starts[i] + slopes[i][0] * (first + 0.5 - a.x) + slopes[i][1] * (at - a.y);
                let steps = [slopes[0][0], slopes[1][0], slopes[2][0]];
                self.fill_row([first as usize, end as usize, y as usize], [along(0), along(1), along(2)], steps, color);
            }
            y += 1.0;
        }
    }

    #[inline]
    fn fill_row(
        &mut self,
        [first, end, row]: [usize; 3],
        mut at: [f64; 3],
        steps: [f64; 3],
        color: &impl Fn([f64; 2], f64) -> Color,
    ) {
        let start = row * self.wide;
        let nearness = &mut self.nearness[start + first..start + end];
        let colors = &mut self.colors[start + first..start + end];
        for (nearest, shown) in nearness.iter_mut().zip(colors) {
            if *nearest < at[0] as f32 {
                *nearest = at[0] as f32;
                let ahead = 1.0 / at[0];
                *shown = color([at[1] * ahead, at[2] * ahead], ahead);
            }
            (0..3).for_each(|i| at[i] += steps[i]);
        }
    }

    /// Draws a line over what lies behind it, `thick` samples wide.
    pub fn line(&mut self, view: &View, ends: [[f64; 3]; 2], thick: f64, color: Color) {
        let corners = ends.map(|turned| Corner { turned, values: [0.0; 2] });
        let Some([a, b]) = clipped_line(corners) else { return };
        let (a, b) = (placed(view, a), placed(view, b));
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        if dx == 0.0 && dy == 0.0 {
            return;
        }
        // Sample by sample along the longer way, and only over the picture.
        let is_flat = dy.abs() < dx.abs();
        let (start, change, most) = if is_flat { (a.x, dx, self.wide) } else { (a.y, dy, self.high) };
        let end = start + change;
        let first = (start.min(end) - 0.5).ceil().max(0.0) as i64;
        let last = (start.max(end) - 0.5).floor().min(most as f64 - 1.0) as i64;
        for along in first..=last {
            let share = (along as f64 + 0.5 - start) / change;
            let near = a.near + (b.near - a.near) * share;
            let across = if is_flat { a.y + dy * share } else { a.x + dx * share };
            let low = (across - thick / 2.0).round() as i64;
            for off in low..low + thick.round().max(1.0) as i64 {
                let [x, y] = if is_flat { [along, off] } else { [off, along] };
                self.dot(x, y, near, color);
            }
        }
    }

    /// Draws a sample of a line, unless the ground covers it. The line lies on the ground, and flat ground falls away
    /// from sample to sample faster than any lift would make up for; so it is enough that one next to it is farther.
    fn dot(&mut self, x: i64, y: i64, near: f64, color: Color) {
        /// How much nearer than itself a line counts.
        const LIFT: f64 = 1.002;
        let is_inside = |x: i64, y: i64| 0 <= x && x < self.wide as i64 && 0 <= y && y < self.high as i64;
        let is_farther = |(dx, dy): (i64, i64)| {
            let (x, y) = (x + dx, y + dy);
            is_inside(x, y) && f64::from(self.nearness[y as usize * self.wide + x as usize]) <= near * LIFT
        };
        if is_inside(x, y) && [(0, 0), (0, -1), (-1, 0), (1, 0), (0, 1)].into_iter().any(is_farther) {
            self.colors[y as usize * self.wide + x as usize] = color;
        }
    }

    /// Metres ahead of what is in the middle of the picture, where something is.
    pub fn middle_m(&self) -> Option<f64> {
        let near = self.nearness[self.high / 2 * self.wide + self.wide / 2];
        (0.0 < near).then(|| 1.0 / f64::from(near))
    }

    /// The picture: every pixel is the mean of its samples.
    pub fn image(&self) -> Image {
        let (wide, high) = (self.wide / SAMPLES, self.high / SAMPLES);
        let mut pixels = Vec::with_capacity(wide * high);
        for row in 0..high {
            for col in 0..wide {
                let mut sums = [0_u32; 3];
                for sample in 0..SAMPLES * SAMPLES {
                    let place = (row * SAMPLES + sample / SAMPLES) * self.wide + col * SAMPLES + sample % SAMPLES;
                    (0..3).for_each(|i| sums[i] += u32::from(self.colors[place][i]));
                }
                let count = (SAMPLES * SAMPLES) as u32;
                pixels.push(sums.map(|sum| ((sum + count / 2) / count) as u8));
            }
        }
        Image::of(wide, high, pixels)
    }
}

#[inline]
fn placed(view: &View, corner: Corner) -> Placed {
    let [x, y, ahead] = view.on_picture(corner.turned);
    let near = 1.0 / ahead;
    Placed { x, y, near, values: corner.values.map(|value| value * near) }
}

#[inline]
fn crossing(from: &Placed, to: &Placed, y: f64) -> f64 {
    if from.y == to.y { from.x } else { from.x + (y - from.y) * ((to.x - from.x) / (to.y - from.y)) }
}

/// The part of a triangle that lies ahead: three or four corners, or none.
fn clipped(corners: [Corner; 3]) -> Vec<Corner> {
    let mut ahead = Vec::with_capacity(4);
    for i in 0..3 {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        if NEAREST_M <= from.turned[2] {
            ahead.push(from);
        }
        if (from.turned[2] < NEAREST_M) != (to.turned[2] < NEAREST_M) {
            ahead.push(at_nearest(from, to));
        }
    }
    ahead
}

fn clipped_line([a, b]: [Corner; 2]) -> Option<[Corner; 2]> {
    match (NEAREST_M <= a.turned[2], NEAREST_M <= b.turned[2]) {
        (true, true) => Some([a, b]),
        (true, false) => Some([a, at_nearest(a, b)]),
        (false, true) => Some([at_nearest(a, b), b]),
        (false, false) => None,
    }
}

fn at_nearest(from: Corner, to: Corner) -> Corner {
    let share = (NEAREST_M - from.turned[2]) / (to.turned[2] - from.turned[2]);
    let between = |a: f64, b: f64| a + (b - a) * share;
    let mut turned: [f64; 3] = std::array::from_fn(|i| between(from.turned[i], to.turned[i]));
    turned[2] = NEAREST_M;
    Corner { turned, values: std::array::from_fn(|i| between(from.values[i], to.values[i])) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::camera::Camera;

    const CAMERA: Camera =
        Camera { eye_m: [0.0; 3], direction_degrees: 0.0, pitch_degrees: 0.0, field_of_view_degrees: 90.0 };

    fn corners(view: &View, places: [[f64; 3]; 3], value: f64) -> [Corner; 3] {
        places.map(|place| Corner { turned: view.turned(place), values: [value, 0.0] })
    }

    #[test]
    fn what_is_nearer_covers_what_is_farther_in_either_order() {
        let wall = |north: f64| [[-500.0, north, -500.0], [500.0, north, -500.0], [0.0, north, 900.0]];
        let mut pictures = Vec::new();
        for order in [[10.0, 20.0], [20.0, 10.0]] {
            let mut depth = DepthImage::new([20, 20], |_| [9, 9, 9]);
            let view = CAMERA.view(depth.size());
            for north in order {
                depth.triangle(&view, corners(&view, wall(north), north), &|[value, _]: [f64; 2], _| {
                    [value as u8, 0, 0]
                });
            }
            pictures.push(depth.image());
        }
        assert_eq!(pictures[0], pictures[1]);
        assert_eq!(pictures[0].pixel(10, 10), [10, 0, 0]);
    }

    #[test]
    fn values_change_evenly_over_the_ground_not_over_the_picture() {
        // A floor 10 m below; its value is how far north it is.
        let mut depth = DepthImage::new([40, 40], |_| [0, 0, 0]);
        let view = CAMERA.view(depth.size());
        let floor = [[-4000.0, -10.0, -10.0], [4000.0, -10.0, -10.0], [0.0, 4000.0, -10.0]];
        let corner = |place: [f64; 3]| Corner { turned: view.turned(place), values: [place[1], 0.0] };
        depth.triangle(&view, floor.map(corner), &|[north, _]: [f64; 2], ahead| {
            assert!((north - ahead).abs() < 1e-6 * ahead, "{north} {ahead}");
            [1, 1, 1]
        });
        assert_eq!((depth.image().pixel(20, 39), depth.image().pixel(20, 10)), ([1, 1, 1], [0, 0, 0]));
    }

    #[test]
    fn a_line_is_hidden_by_what_stands_before_it() {
        let mut depth = DepthImage::new([20, 20], |_| [0, 0, 0]);
        let view = CAMERA.view(depth.size());
        let wall = [[-500.0, 10.0, -500.0], [0.5, 10.0, -500.0], [0.5, 10.0, 9000.0]];
        depth.triangle(&view, corners(&view, wall, 0.0), &|_, _| [5, 5, 5]);
        let ends = [[-100.0, 20.0, 0.0], [100.0, 20.0, 0.0]].map(|place| view.turned(place));
        depth.line(&view, ends, 2.0, [200, 0, 0]);
        let image = depth.image();
        let reds = (0..20).map(|x| (8..12).any(|y| image.pixel(x, y)[0] > 90)).collect::<Vec<_>>();
        assert!(reds[12..].iter().all(|&red| red) && reds[..9].iter().all(|&red| !red), "{reds:?}");
    }
}
