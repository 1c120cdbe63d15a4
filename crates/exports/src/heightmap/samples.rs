//! The ground at samples that divide the area evenly from border to border.

use terrain::{HOLE_CLASS, QUANTA_PER_METRE};

use crate::triangle_index::TriangleIndex;
use crate::{ExportError, Product, Work};

/// Steps of height that 16 bits count.
const STEPS: f64 = 65_535.0;
/// Rows that are sampled at a time.
const BAND: usize = 64;

/// How heights become 16 bits: one scale for all tiles, from the lowest to the highest vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    pub low_m: f64,
    pub step_m: f64,
}

impl Scale {
    fn of(product: &Product) -> Self {
        let heights = || product.modules.iter().flat_map(|module| &module.vertices).map(|vertex| vertex.z);
        let [low_m, high_m] = [heights().min(), heights().max()]
            .map(|quanta| f64::from(quanta.unwrap_or(0)) / f64::from(QUANTA_PER_METRE));
        // Ground of one height has any scale.
        let step_m = if low_m < high_m { (high_m - low_m) / STEPS } else { 1.0 / f64::from(QUANTA_PER_METRE) };
        Self { low_m, step_m }
    }

    fn steps(self, height_m: f64) -> u16 {
        ((height_m - self.low_m) / self.step_m).round().clamp(0.0, STEPS) as u16
    }
}

/// How far the ground lies from the heightmap at the posts of the working grid, between samples along straight lines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Off {
    pub max_m: f64,
    pub rms_m: f64,
}

/// Heights and classes of the ground, row by row from the south.
pub(crate) struct Samples {
    pub scale: Scale,
    pub wide: usize,
    pub heights: Vec<u16>,
    pub classes: Vec<u8>,
}

impl Samples {
    /// So many of them, from west to east and from south to north.
    ///
    /// # Errors
    /// When the work was asked to stop.
    pub(crate) fn of(product: &Product, [wide, high]: [usize; 2], work: &Work) -> Result<Self, ExportError> {
        let scale = Scale::of(product);
        let starts: Vec<usize> = (0..high).step_by(BAND).collect();
        let bands = work.each("rows of samples", &starts, |&start| {
            let mut index = TriangleIndex::new(product);
            let places = (start..high.min(start + BAND)).flat_map(|row| (0..wide).map(move |col| [col, row]));
            let sample = |[col, row]: [usize; 2]| {
                let at = place_m(product, [share(col, wide), share(row, high)]);
                let ground = index.at(at).expect("samples lie on what is exported");
                (scale.steps(ground.height_m), ground.class)
            };
            Ok(places.map(sample).unzip::<u16, u8, Vec<u16>, Vec<u8>>())
        })?;
        let (heights, classes): (Vec<_>, Vec<_>) = bands.into_iter().unzip();
        Ok(Self { scale, wide, heights: heights.concat(), classes: classes.concat() })
    }

    pub(crate) fn high(&self) -> usize {
        self.heights.len() / self.wide
    }

    /// How many of them lie over holes.
    pub(crate) fn holes(&self) -> usize {
        self.classes.iter().filter(|class| **class == HOLE_CLASS).count()
    }

    /// How far the ground lies from them at posts.
    ///
    /// # Errors
    /// When the work was asked to stop.
    pub(crate) fn off(&self, product: &Product, work: &Work) -> Result<Off, ExportError> {
        let posts = product.grid.posts_of_rect(product.rect);
        let (cols, rows) = (posts.posts_wide(), posts.posts_high());
        let starts: Vec<usize> = (0..rows).step_by(BAND).collect();
        let bands = work.each("rows of posts", &starts, |&start| {
            let mut index = TriangleIndex::new(product);
            let (mut max_m, mut squares) = (0.0_f64, 0.0);
            for (row, col) in (start..rows.min(start + BAND)).flat_map(|row| (0..cols).map(move |col| (row, col))) {
                let shares = [share(col, cols), share(row, rows)];
                let ground = index.at(place_m(product, shares)).expect("posts lie on what is exported");
                let off_m = (self.between(shares) - ground.height_m).abs();
                (max_m, squares) = (max_m.max(off_m), squares + off_m * off_m);
            }
            Ok((max_m, squares))
        })?;
        let max_m = bands.iter().fold(0.0, |largest: f64, band| largest.max(band.0));
        let squares: f64 = bands.iter().map(|band| band.1).sum();
        Ok(Off { max_m, rms_m: (squares / (rows * cols) as f64).sqrt() })
    }

    /// The height in metres at shares of the way east and north.
    fn between(&self, [east, north]: [f64; 2]) -> f64 {
        let cell = |share: f64, count: usize| {
            let at = share * (count - 1) as f64;
            let cell = (at as usize).min(count - 2);
            (cell, at - cell as f64)
        };
        let ((col, x), (row, y)) = (cell(east, self.wide), cell(north, self.high()));
        let at = |row: usize, col: usize| f64::from(self.heights[row * self.wide + col]);
        let along = |row: usize| at(row, col) + x * (at(row, col + 1) - at(row, col));
        self.scale.low_m + (along(row) + y * (along(row + 1) - along(row))) * self.scale.step_m
    }
}

/// How far along a side one of `count` places lies.
fn share(index: usize, count: usize) -> f64 {
    index as f64 / (count - 1) as f64
}

/// The place at shares of the way east and north.
fn place_m(product: &Product, shares: [f64; 2]) -> [f64; 2] {
    let rect = product.rect;
    let (low, high) = (product.corner_m(rect.south, rect.west), product.corner_m(rect.north, rect.east));
    [0, 1].map(|axis| (low[axis] + (high[axis] - low[axis]) * shares[axis]).min(high[axis]))
}
