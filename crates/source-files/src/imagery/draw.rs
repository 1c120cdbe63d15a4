//! A square of ground drawn from a picture in another coordinate system, and the strips and tiles decoded last.
//!
//! Every sixteenth pixel is projected, and what lies between is interpolated. Of the levels, the coarsest is taken that
//! is as fine as the square. Where it is still so fine that too many of its strips or tiles lie below the square, as
//! in a large picture without overviews, one of several stands for all of them if the square is a glimpse.
//! Pixels are drawn in blocks of 16 x 16, so that few strips and tiles are needed at a time.

use std::sync::Arc;

use super::level::{Level, PIXELS_MAX};
use super::picture::Imagery;
use super::unpack::{Colored, colored};
use crate::SourceError;
use crate::crs::Crs;
use crate::kept::Kept;

/// Pixels of a square between projected places.
const STEP: usize = 16;
/// A pixel of a square that is so little larger than one of the picture takes the colour at its middle alone.
const HAIR: f64 = 1.02;
/// Strips or tiles that a canvas holds along each axis: a colour is the mean of four pixels beside each other.
const HELD: usize = 2;

/// How much of a picture a square is drawn from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Care {
    /// At once: few strips or tiles, and few pixels of each.
    Glimpse,
    /// From all that lies below it.
    Whole,
}

impl Care {
    /// Places along a side of a pixel that it is the mean of.
    fn places_max(self) -> usize {
        match self {
            Self::Glimpse => 4,
            Self::Whole => 64,
        }
    }
}

/// A square of ground, its pixels row by row from the north-west.
#[derive(Clone, Debug)]
pub struct Square<'a> {
    /// The system of its coordinates, which are metres.
    pub crs: &'a Crs,
    /// Its north-western corner.
    pub corner: [f64; 2],
    /// Metres along a side of a pixel.
    pub pixel_m: f64,
    /// Pixels along its side, a multiple of 16.
    pub side: usize,
}

impl Square<'_> {
    fn place(&self, col: f64, row: f64) -> [f64; 2] {
        [self.corner[0] + col * self.pixel_m, self.corner[1] - row * self.pixel_m]
    }
}

/// Column and row in the picture, from the corner of its first stored pixel.
type Place = Option<[f64; 2]>;

impl Imagery {
    /// Draws the picture over what `pixels` hold: four bytes each, red, green and blue multiplied with how opaque they
    /// are, and that. Few strips or tiles are read for it. Returns whether any of it lies there.
    ///
    /// # Errors
    /// When the file is gone, or part of it cannot be decoded.
    pub fn draw(&self, square: &Square, keep: &Keep, pixels: &mut [u8]) -> Result<bool, SourceError> {
        self.draw_with(Care::Glimpse, square, keep, pixels)
    }

    /// The same with as much care as is asked for.
    ///
    /// # Errors
    /// When the file is gone, or part of it cannot be decoded.
    pub fn draw_with(&self, care: Care, square: &Square, keep: &Keep, pixels: &mut [u8]) -> Result<bool, SourceError> {
        assert!(pixels.len() == 4 * square.side * square.side, "a square of four bytes a pixel");
        let net = self.net(square);
        let Some((places, ratio)) = reach(&net, square.side) else { return Ok(false) };
        let mut canvas = Canvas::new(self, keep, care, (ratio, places));
        if canvas.is_outside(places) {
            return Ok(false);
        }
        let across = square.side / STEP + 1;
        let mut is_any = false;
        for cell in (0..across * (across - 1)).filter(|cell| cell % across + 1 < across) {
            let corners = [cell, cell + 1, cell + across, cell + across + 1].map(|corner| net[corner]);
            let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
            let first = cell / across * STEP * square.side + cell % across * STEP;
            for (row, col) in (0..STEP).flat_map(|row| (0..STEP).map(move |col| (row, col))) {
                let sum = canvas.mean([a, b, c, d], [col, row])?;
                let rest = 255.0 - sum[3];
                if 0.0 < sum[3] {
                    is_any = true;
                    let pixel = &mut pixels[4 * (first + row * square.side + col)..][..4];
                    for (part, sum) in pixel.iter_mut().zip(sum) {
                        *part = (sum + f32::from(*part) * rest / 255.0 + 0.5) as u8;
                    }
                }
            }
        }
        Ok(is_any)
    }

    /// Metres along a side of a pixel of the picture at a place of a system; `None` where it cannot be computed.
    pub fn pixel_m(&self, crs: &Crs, place: [f64; 2]) -> Option<f64> {
        const STRIDE_M: f64 = 100.0;
        let square = Square { crs, corner: place, pixel_m: STRIDE_M, side: 1 };
        let [a, b, c] =
            [self.projected(&square, 0, 0)?, self.projected(&square, 1, 0)?, self.projected(&square, 0, 1)?];
        let pixels = ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs().sqrt();
        (0.0 < pixels).then_some(STRIDE_M / pixels)
    }

    /// Whether any of the picture may lie in a rectangle of a system, from its south-west to its north-east corner.
    pub fn reaches(&self, crs: &Crs, low: [f64; 2], high: [f64; 2]) -> bool {
        let side = (high[0] - low[0]).max(high[1] - low[1]);
        let square = Square { crs, corner: [low[0], low[1] + side], pixel_m: side / 256.0, side: 256 };
        let level = &self.levels[0];
        reach(&self.net(&square), square.side).is_some_and(|([west, north, east, south], _)| {
            0.0 < east && 0.0 < south && west < f64::from(level.cols) && north < f64::from(level.rows)
        })
    }

    /// Projected places, one pixel in 16 each way, both ends included.
    fn net(&self, square: &Square) -> Vec<Place> {
        let across = square.side / STEP + 1;
        (0..across * across).map(|at| self.projected(square, at % across * STEP, at / across * STEP)).collect()
    }

    /// The place of a corner of pixels.
    fn projected(&self, square: &Square, col: usize, row: usize) -> Place {
        let frame = &self.frame;
        let place = square.crs.to(&frame.crs, square.place(col as f64, row as f64))?;
        let ([east, north], [west, south]) = (frame.nearest(place), frame.south_west);
        let up = (north - south) / frame.spacing[1] + 0.5;
        let down = if self.south_first { up } else { f64::from(frame.rows) - up };
        Some([(east - west) / frame.spacing[0] + 0.5, down])
    }
}

/// West, north, east and south of the places of a square, and pixels of the picture along one of its own.
fn reach(net: &[Place], side: usize) -> Option<([f64; 4], f64)> {
    let mut ends = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for [col, row] in net.iter().flatten() {
        ends = [ends[0].min(*col), ends[1].min(*row), ends[2].max(*col), ends[3].max(*row)];
    }
    // The finest of its pixels decide, so that no place is blurred.
    let across = side / STEP + 1;
    let cells = (0..net.len() - across).filter(|at| at % across + 1 < across);
    let areas = cells.filter_map(|at| {
        let ([a, b], [c, d], [e, f]) = (net[at]?, net[at + 1]?, net[at + across]?);
        Some(((c - a) * (f - b) - (d - b) * (e - a)).abs())
    });
    let least = areas.fold(f64::INFINITY, f64::min);
    least.is_finite().then(|| (ends, least.sqrt() / STEP as f64))
}

/// A level of a picture that is drawn from, with what of it was asked for.
struct Canvas<'a> {
    picture: &'a Imagery,
    keep: &'a Keep,
    index: usize,
    /// Pixels of this level along one of the picture, across and down.
    scale: [f64; 2],
    /// Places along a side of a pixel of the square.
    places: usize,
    is_smooth: bool,
    /// Strips or tiles that one of them stands for, across and down.
    stands_for: [u32; 2],
    /// By whether their column and row among all strips or tiles are odd.
    held: [Option<Held>; HELD * HELD],
    /// Which of these was asked for last.
    last: usize,
}

/// A strip or tile, and the pixels that it has the colours of.
struct Held {
    chunk: u32,
    west: u32,
    north: u32,
    east: u32,
    south: u32,
    colors: Arc<Colored>,
}

impl<'a> Canvas<'a> {
    fn new(picture: &'a Imagery, keep: &'a Keep, care: Care, (ratio, ends): (f64, [f64; 4])) -> Self {
        let full = &picture.levels[0];
        let scale = |level: &Level| {
            [f64::from(level.cols) / f64::from(full.cols), f64::from(level.rows) / f64::from(full.rows)]
        };
        // A hair of room, so that a level of just the same size is taken.
        let is_fine = |level: &&Level| 1.0 <= HAIR * ratio * scale(level)[0];
        let index = picture.levels.iter().take_while(is_fine).count().saturating_sub(1);
        let level = &picture.levels[index];
        let scale = scale(level);
        let own = ratio * scale[0];
        let places = ((own / HAIR).ceil() as usize).clamp(1, care.places_max());
        let stands_for = match care {
            Care::Whole => [1, 1],
            Care::Glimpse => {
                let [west, north, east, south] = ends;
                standing(level, [west * scale[0], north * scale[1], east * scale[0], south * scale[1]])
            }
        };
        let is_smooth = care == Care::Whole || own < 2.0 && stands_for == [1, 1];
        Self { picture, keep, index, scale, places, is_smooth, stands_for, held: [const { None }; _], last: 0 }
    }

    fn level(&self) -> &'a Level {
        &self.picture.levels[self.index]
    }

    fn is_outside(&self, [west, north, east, south]: [f64; 4]) -> bool {
        let full = &self.picture.levels[0];
        east <= 0.0 || south <= 0.0 || f64::from(full.cols) <= west || f64::from(full.rows) <= north
    }

    /// The mean colour of a pixel of a cell between four projected places, multiplied with how opaque it is.
    fn mean(&mut self, [a, b, c, d]: [[f64; 2]; 4], [col, row]: [usize; 2]) -> Result<[f32; 4], SourceError> {
        let (places, mut sum) = (self.places, [0.0; 4]);
        let part = |pixel: usize, at: usize| (pixel as f64 + (at as f64 + 0.5) / places as f64) / STEP as f64;
        for at in 0..places * places {
            let (right, down) = (part(col, at % places), part(row, at / places));
            let [x, y] = [0, 1].map(|axis| {
                let top = a[axis] + right * (b[axis] - a[axis]);
                let bottom = c[axis] + right * (d[axis] - c[axis]);
                (top + down * (bottom - top)) * self.scale[axis]
            });
            self.add(x, y, &mut sum)?;
        }
        Ok(sum.map(|part| part / (places * places) as f32))
    }

    /// Adds the colour at a place of the level.
    fn add(&mut self, x: f64, y: f64, sum: &mut [f32; 4]) -> Result<(), SourceError> {
        let (cols, rows) = (i64::from(self.level().cols), i64::from(self.level().rows));
        let (col, row) = (x.floor() as i64, y.floor() as i64);
        if !((0..cols).contains(&col) && (0..rows).contains(&row)) {
            return Ok(());
        }
        if !self.is_smooth {
            return self.add_pixel(col, row, 1.0, sum);
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (right, down) = ((x - x.floor()) as f32, (y - y.floor()) as f32);
        let (west, north) = (x.floor() as i64, y.floor() as i64);
        for (col, row, share) in [
            (west, north, (1.0 - right) * (1.0 - down)),
            (west + 1, north, right * (1.0 - down)),
            (west, north + 1, (1.0 - right) * down),
            (west + 1, north + 1, right * down),
        ] {
            // The picture's outermost pixels reach to its edge.
            self.add_pixel(col.clamp(0, cols - 1), row.clamp(0, rows - 1), share, sum)?;
        }
        Ok(())
    }

    fn add_pixel(&mut self, col: i64, row: i64, share: f32, sum: &mut [f32; 4]) -> Result<(), SourceError> {
        let [red, green, blue, alpha] = self.pixel(col as u32, row as u32)?.map(f32::from);
        let weight = share * alpha / 255.0;
        *sum = [sum[0] + weight * red, sum[1] + weight * green, sum[2] + weight * blue, sum[3] + share * alpha];
        Ok(())
    }

    fn pixel(&mut self, col: u32, row: u32) -> Result<[u8; 4], SourceError> {
        if let Some(held) = &self.held[self.last]
            && (held.west..held.east).contains(&col)
            && (held.north..held.south).contains(&row)
        {
            return Ok(held.colors.at(col - held.west, row - held.north));
        }
        let level = self.level();
        let (across, in_col) = shrunk(col, level.chunk_cols, level.chunks_across(), self.stands_for[0]);
        let (down, in_row) = shrunk(row, level.chunk_rows, level.chunks_down(), self.stands_for[1]);
        let chunk = down * level.chunks_across() + across;
        self.last = down as usize % HELD * HELD + across as usize % HELD;
        let held = match &mut self.held[self.last] {
            Some(held) if held.chunk == chunk => held,
            place => place.insert(self.keep.held((self.picture.id, self.index, chunk), level, self.stands_for)?),
        };
        // The last ones may be smaller than what they stand for.
        let [west, north] = level.corner_of(chunk);
        let in_col = in_col.min(level.cols - west - 1);
        let in_row = in_row.min(held.colors.rows - 1).min(level.rows - north - 1);
        Ok(held.colors.at(in_col, in_row))
    }
}

/// Which strip or tile stands for that of a pixel along one axis, and where in it the pixel lies.
fn shrunk(pixel: u32, side: u32, count: u32, stands_for: u32) -> (u32, u32) {
    let (chunk, inside) = (pixel / side, pixel % side);
    if stands_for == 1 {
        return (chunk, inside);
    }
    let first = chunk / stands_for * stands_for;
    let inside = u64::from(chunk - first) * u64::from(side) + u64::from(inside);
    ((first + stands_for / 2).min(count - 1), (inside / u64::from(stands_for)) as u32)
}

/// For how many strips or tiles one must stand, so that those between the `ends` of a square are not too many.
fn standing(level: &Level, [west, north, east, south]: [f64; 4]) -> [u32; 2] {
    let chunks = |low: f64, high: f64, side: u32, count: u32| {
        let last = f64::from(count - 1);
        let at = |place: f64| (place / f64::from(side)).floor().clamp(0.0, last);
        (at(high) - at(low)) as u64 + 1
    };
    let wide = chunks(west, east, level.chunk_cols, level.chunks_across());
    let high = chunks(north, south, level.chunk_rows, level.chunks_down());
    let most = (PIXELS_MAX / (u64::from(level.chunk_cols) * u64::from(level.chunk_rows))).max(1);
    let mut stands_for = [1, 1];
    let left = |stands_for: [u64; 2]| wide.div_ceil(stands_for[0]) * high.div_ceil(stands_for[1]);
    while most < left(stands_for) && 1 < left(stands_for) {
        // Along the axis where more of them are left.
        let axis = usize::from(wide.div_ceil(stands_for[0]) < high.div_ceil(stands_for[1]));
        stands_for[axis] += 1;
    }
    stands_for.map(|count| count as u32)
}

/// A picture, its level, and a strip or tile of that.
type Key = (usize, usize, u32);

/// Decoded strips and tiles of any number of pictures.
pub struct Keep(Kept<Key, Colored>);

impl Keep {
    /// With room for `bytes_max` bytes, and one strip or tile in any case.
    pub fn new(bytes_max: usize) -> Self {
        Self(Kept::new(bytes_max as u64))
    }

    /// How often a strip or tile was decoded.
    #[cfg(test)]
    pub(crate) fn decoded(&self) -> u64 {
        self.0.decoded()
    }

    /// A strip or tile of a level.
    fn held(&self, key: Key, level: &Level, stands_for: [u32; 2]) -> Result<Held, SourceError> {
        let (_, _, chunk) = key;
        let colors = self.get(key, || colored(level, chunk))?;
        let [west, north] = level.corner_of(chunk);
        // One that stands for others is looked up pixel by pixel.
        let [cols, rows] = if stands_for == [1, 1] { [colors.cols, colors.rows] } else { [0, 0] };
        Ok(Held { chunk, west, north, east: west + cols, south: north + rows, colors })
    }

    fn get(
        &self,
        key: Key,
        decode: impl FnOnce() -> Result<Colored, SourceError>,
    ) -> Result<Arc<Colored>, SourceError> {
        self.0.get(key, || {
            let decoded = decode()?;
            let bytes = decoded.bytes() as u64;
            Ok((decoded, bytes))
        })
    }
}
