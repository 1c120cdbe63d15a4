//! Ground seen from straight above: which metres are which pixel, and what lies under each of them.
//!
//! Every pixel is the mean of `SAMPLES` x `SAMPLES` places inside it. So a post or a triangle smaller than a pixel
//! counts with its share, and no pattern of pixels beats against the pattern of posts.

use terrain::PostRect;

use super::color::Color;
use super::image::Image;

/// Places along a side of a pixel.
pub(crate) const SAMPLES: usize = 3;

/// A rectangle of ground and the pixels it is drawn on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MapExtent {
    /// West, south, east and north, in metres from the area's south-west post.
    pub extent_m: [f64; 4],
    /// Pixels across and down.
    pub pixels: [usize; 2],
}

impl MapExtent {
    /// The extent whose longer side is `longest` pixels.
    pub fn of(extent_m: [f64; 4], longest: usize) -> Self {
        let (wide_m, high_m) = (extent_m[2] - extent_m[0], extent_m[3] - extent_m[1]);
        let per_metre = longest as f64 / wide_m.max(high_m);
        let pixels = [wide_m, high_m].map(|metres| ((metres * per_metre).round() as usize).max(1));
        Self { extent_m, pixels }
    }

    pub fn metres_per_pixel(&self) -> f64 {
        (self.extent_m[2] - self.extent_m[0]) / self.pixels[0] as f64
    }

    /// Where a place lies on the picture: a whole number is the left or upper border of a pixel.
    pub fn at(&self, [east_m, north_m]: [f64; 2]) -> [f64; 2] {
        let across = (east_m - self.extent_m[0]) / (self.extent_m[2] - self.extent_m[0]);
        let down = (self.extent_m[3] - north_m) / (self.extent_m[3] - self.extent_m[1]);
        [across * self.pixels[0] as f64, down * self.pixels[1] as f64]
    }

    /// Left, top, width and height of a rectangle of ground, in pixels that meet those of its neighbours.
    pub fn rect(&self, [west, south, east, north]: [f64; 4]) -> [i64; 4] {
        let ([left, bottom], [right, top]) = (self.at([west, south]), self.at([east, north]));
        let whole = |at: f64| at.round() as i64;
        [whole(left), whole(top), whole(right) - whole(left), whole(bottom) - whole(top)]
    }

    /// Calls `visit` with each sample that a triangle covers: row and column of samples from the top left, and the
    /// height there. A sample on an edge is in one of the two triangles.
    pub fn cover(&self, corners: [[f64; 3]; 3], mut visit: impl FnMut(usize, usize, f64)) {
        let [wide, high] = self.pixels.map(|pixels| (pixels * SAMPLES) as f64);
        let scaled = corners.map(|[x, y, z]| {
            let [x, y] = self.at([x, y]);
            [x * SAMPLES as f64 - 0.5, y * SAMPLES as f64 - 0.5, z]
        });
        let [dx, dy] = slope(scaled);
        let [low, middle, top] = by_row(scaled);
        let [lowest, highest] =
            [f64::min, f64::max].map(|pick| pick(pick(corners[0][2], corners[1][2]), corners[2][2]));
        let (first, last) = (low[1].max(-0.5).ceil(), top[1].min(high - 0.5));
        let mut row = first;
        while row < last {
            let long = crossing(low, top, row);
            let short = if row < middle[1] { crossing(low, middle, row) } else { crossing(middle, top, row) };
            let (left, right) = (long.min(short).max(-0.5).ceil(), long.max(short).min(wide - 0.5));
            let mut col = left;
            let mut height = low[2] + dx * (left - low[0]) + dy * (row - low[1]);
            while col < right {
                // On a sliver the plane is too steep for sums.
                visit(row as usize, col as usize, height.clamp(lowest, highest));
                col += 1.0;
                height += dx;
            }
            row += 1.0;
        }
    }
}

/// How much the plane through three corners rises per metre to the east and to the north; 0 without an area.
pub(crate) fn slope([a, b, c]: [[f64; 3]; 3]) -> [f64; 2] {
    let to = |p: [f64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
    let (b, c) = (to(b), to(c));
    let doubled = b[0] * c[1] - c[0] * b[1];
    if doubled == 0.0 {
        return [0.0, 0.0];
    }
    [(b[2] * c[1] - c[2] * b[1]) / doubled, (b[0] * c[2] - c[0] * b[2]) / doubled]
}

/// Corners from the topmost row to the lowest.
fn by_row([mut a, mut b, mut c]: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    if b[1] < a[1] {
        std::mem::swap(&mut a, &mut b);
    }
    if c[1] < b[1] {
        std::mem::swap(&mut b, &mut c);
        if b[1] < a[1] {
            std::mem::swap(&mut a, &mut b);
        }
    }
    [a, b, c]
}

/// Where an edge crosses a row. Both triangles of an edge ask with its ends in one order, so they get one answer.
fn crossing(from: [f64; 3], to: [f64; 3], row: f64) -> f64 {
    if from[1] == to[1] { from[0] } else { from[0] + (row - from[1]) * ((to[0] - from[0]) / (to[1] - from[1])) }
}

/// Sums of colours at the samples of a map.
pub(crate) struct Samples {
    pixels: [usize; 2],
    sums: Vec<[u16; 3]>,
    counts: Vec<u16>,
}

impl Samples {
    pub fn new(map_extent: &MapExtent) -> Self {
        let count = map_extent.pixels[0] * map_extent.pixels[1];
        Self { pixels: map_extent.pixels, sums: vec![[0; 3]; count], counts: vec![0; count] }
    }

    /// Adds the colour of a sample.
    #[inline]
    pub fn add(&mut self, row: usize, col: usize, color: Color) {
        let pixel = row / SAMPLES * self.pixels[0] + col / SAMPLES;
        let sums = &mut self.sums[pixel];
        (0..3).for_each(|i| sums[i] += u16::from(color[i]));
        self.counts[pixel] += 1;
    }

    /// The mean of every pixel; `nothing` where there is no sample.
    pub fn image(&self, nothing: Color) -> Image {
        let mean = |(sums, &count): (&[u16; 3], &u16)| match count {
            0 => nothing,
            _ => sums.map(|sum| ((u32::from(sum) + u32::from(count) / 2) / u32::from(count)) as u8),
        };
        let pixels = self.sums.iter().zip(&self.counts).map(mean).collect();
        Image::of(self.pixels[0], self.pixels[1], pixels)
    }
}

/// Posts of a rectangle, looked at between posts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Posts {
    pub rect: PostRect,
    /// Metres between posts, west to east and south to north.
    pub spacing_m: [f64; 2],
}

/// A sample between four posts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Between {
    /// Row and column of the sample from the top left.
    pub sample: [usize; 2],
    /// The south-western post, counted row by row from the south-west.
    pub post: usize,
    /// How far it lies to the next post east and north, from 0 to 1.
    pub share: [f32; 2],
}

impl Between {
    /// The value between four posts, each of which `at` gives, `wide` posts to a row.
    #[inline]
    pub fn blend(&self, wide: usize, at: impl Fn(usize) -> f32) -> f32 {
        let [x, y] = self.share;
        let south = at(self.post) * (1.0 - x) + at(self.post + 1) * x;
        let north = at(self.post + wide) * (1.0 - x) + at(self.post + wide + 1) * x;
        south * (1.0 - y) + north * y
    }
}

impl Posts {
    /// Calls `visit` with every sample of a map that lies between posts.
    pub fn sample(&self, map_extent: &MapExtent, mut visit: impl FnMut(Between)) {
        let [west, south, east, north] = map_extent.extent_m;
        let [across, down] = map_extent.pixels.map(|pixels| pixels * SAMPLES);
        let middle = |index: usize, count: usize| (index as f64 + 0.5) / count as f64;
        let columns: Vec<Option<(usize, f32)>> = (0..across)
            .map(|col| {
                let east_m = west + (east - west) * middle(col, across);
                place(east_m / self.spacing_m[0], self.rect.west, self.rect.east)
            })
            .collect();
        for row in 0..down {
            let north_m = north - (north - south) * middle(row, down);
            let found = place(north_m / self.spacing_m[1], self.rect.south, self.rect.north);
            let Some((post_row, y)) = found else { continue };
            let first = post_row * self.rect.posts_wide();
            for (col, found) in columns.iter().enumerate() {
                if let &Some((post_col, x)) = found {
                    visit(Between { sample: [row, col], post: first + post_col, share: [x, y] });
                }
            }
        }
    }
}

/// The last post at or before a place, and how far it is to the next.
fn place(at: f64, first: i32, last: i32) -> Option<(usize, f32)> {
    let from_first = at - f64::from(first);
    let cells = f64::from(last - first);
    let inside = 0.0 <= from_first && from_first <= cells;
    let before = (from_first as usize).min((last - first - 1).max(0) as usize);
    inside.then_some((before, (from_first - before as f64) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map_extent() -> MapExtent {
        MapExtent::of([0.0, 0.0, 40.0, 20.0], 40)
    }

    #[test]
    fn triangles_share_the_samples_out_exactly_once() {
        // A fan around a point off every sample, over the whole map.
        let corners = [[0.0, 0.0], [13.7, 0.0], [40.0, 0.0], [40.0, 20.0], [21.1, 20.0], [0.0, 20.0], [0.0, 9.9]];
        let middle = [17.3, 11.1, 5.0];
        let mut counts = vec![0; 40 * 20 * SAMPLES * SAMPLES];
        for (i, &[x, y]) in corners.iter().enumerate() {
            let [next_x, next_y] = corners[(i + 1) % corners.len()];
            map_extent().cover([middle, [x, y, 1.0], [next_x, next_y, 2.0]], |row, col, height| {
                counts[row * 40 * SAMPLES + col] += 1;
                assert!((1.0..=5.0).contains(&height));
            });
        }
        assert!(counts.iter().all(|&count| count == 1));
    }

    #[test]
    fn a_triangle_beyond_the_plan_is_cut_to_it() {
        let mut count = 0;
        map_extent().cover([[-1e6, -1e6, 0.0], [1e6, -1e6, 0.0], [0.0, 1e6, 0.0]], |row, col, _| {
            assert!(row < 20 * SAMPLES && col < 40 * SAMPLES);
            count += 1;
        });
        assert_eq!(count, 40 * 20 * SAMPLES * SAMPLES);
    }

    #[test]
    fn a_value_between_posts_is_that_of_the_plane_through_them() {
        let rect = PostRect { south: 2, west: 1, north: 12, east: 21 };
        let posts = Posts { rect, spacing_m: [2.0, 2.0] };
        let value = |post: usize| (post % 21) as f32 * 3.0 + (post / 21) as f32 * 5.0;
        let mut count = 0;
        posts.sample(&map_extent(), |between| {
            let [row, col] = between.sample;
            let (east_m, north_m) = ((col as f64 + 0.5) / 3.0, 20.0 - (row as f64 + 0.5) / 3.0);
            let expected = (east_m / 2.0 - 1.0) * 3.0 + (north_m / 2.0 - 2.0) * 5.0;
            assert!((f64::from(between.blend(21, value)) - expected).abs() < 1e-3);
            count += 1;
        });
        // 38 of 40 columns and 16 of 20 rows of pixels lie between posts.
        assert_eq!(count, 38 * 16 * SAMPLES * SAMPLES);
    }
}
