//! Pictures laid over an area: squares of colours in the area's own coordinate system, drawn when they are asked for.
//!
//! At level 0 a pixel of a square is about as large as one of the finest picture, at each level above it twice as
//! large. Rows and columns of squares count from the south-western corner of the area, at every level.

use std::path::PathBuf;

use crate::ground::GroundError;
use source_files::{Crs, FileState, Imagery, Keep, SourceError, Square};

use crate::product::ProductError;

/// Pixels along the side of a square.
pub const SQUARE_PIXELS: usize = 256;
/// Squares of the coarsest level along the longer side of the area, at most.
const COARSE_SQUARES: f64 = 2.0;
/// Pixels finer than this are those of no picture of an area; this bounds the number of levels.
const PIXEL_M_MIN: f64 = 1.0 / 64.0;
/// Bytes of decoded strips and tiles that are kept.
const KEPT_BYTES_MAX: usize = 96 << 20;

/// Where an area lies.
#[derive(Clone, Debug)]
pub struct DrapedArea<'a> {
    /// Its coordinate system, by code or as well-known text.
    pub crs: &'a str,
    /// Its south-western corner.
    pub origin_m: [f64; 2],
    /// Its size to the east and to the north.
    pub size_m: [f64; 2],
}

/// Pictures laid over an area.
pub struct Drape {
    pictures: Vec<Imagery>,
    paths: Vec<PathBuf>,
    states: Vec<FileState>,
    crs: Crs,
    origin_m: [f64; 2],
    size_m: [f64; 2],
    pixel_m: f64,
    levels: u32,
    keep: Keep,
}

impl Drape {
    /// Opens the pictures, later ones above earlier.
    ///
    /// # Errors
    /// When one is no picture of a kind that is drawn, lies nowhere, or nowhere in the area.
    pub fn open(paths: &[PathBuf], area: &DrapedArea) -> Result<Self, ProductError> {
        let crs = Crs::named(area.crs).map_err(|found| {
            let hint = "build the area in a system that can be computed; `tiefort view` shows it without --imagery";
            ProductError::impossible("the area's coordinate system", found, "one that pictures are brought to", hint)
        })?;
        let source = |error: SourceError| ProductError::from(GroundError::from(error));
        let states = paths.iter().map(|path| FileState::of(path)).collect::<Result<_, _>>().map_err(source)?;
        let opened = paths.iter().enumerate().map(|(id, path)| Imagery::open(path, id));
        let pictures: Vec<Imagery> = opened.collect::<Result<_, _>>().map_err(source)?;
        let mut drape = Self {
            pictures,
            paths: paths.to_vec(),
            states,
            crs,
            origin_m: area.origin_m,
            size_m: area.size_m,
            pixel_m: 1.0,
            levels: 1,
            keep: Keep::new(KEPT_BYTES_MAX),
        };
        drape.pictures.iter().try_for_each(|picture| drape.require_inside(picture))?;
        drape.pixel_m = drape.finest_m();
        let longest_m = area.size_m[0].max(area.size_m[1]);
        let squares = longest_m / (COARSE_SQUARES * SQUARE_PIXELS as f64 * drape.pixel_m);
        drape.levels = 1 + squares.log2().ceil().max(0.0) as u32;
        Ok(drape)
    }

    fn require_inside(&self, picture: &Imagery) -> Result<(), ProductError> {
        let [east, north] = self.origin_m;
        let far = [east + self.size_m[0], north + self.size_m[1]];
        if picture.reaches(&self.crs, self.origin_m, far) {
            return Ok(());
        }
        let frame = picture.frame();
        let digits = if frame.crs.is_geographic() { 4 } else { 0 };
        let [west, south] = frame.place(0, 0).map(|place| format!("{place:.digits$}"));
        let [right, top] = frame.place(frame.rows - 1, frame.cols - 1).map(|place| format!("{place:.digits$}"));
        let found = format!("a picture of {west}, {south} to {right}, {top} in {}", frame.crs.name());
        let expected = format!(
            "one that reaches into the area, {east:.0}, {north:.0} to {:.0}, {:.0} in {}",
            far[0],
            far[1],
            self.crs.name()
        );
        let hint = "check its coordinate system with gdalinfo, or name a picture of this area";
        Err(ProductError::impossible(frame.path.display().to_string(), found, expected, hint))
    }

    /// Metres of a pixel of the finest picture at the middle of the area, as a power of two.
    fn finest_m(&self) -> f64 {
        let middle = [0, 1].map(|axis| self.origin_m[axis] + self.size_m[axis] / 2.0);
        let found = self.pictures.iter().filter_map(|picture| picture.pixel_m(&self.crs, middle));
        let finest = found.fold(f64::INFINITY, f64::min);
        let most = self.size_m[0].max(self.size_m[1]) / (COARSE_SQUARES * SQUARE_PIXELS as f64);
        2f64.powf(finest.log2().round()).clamp(PIXEL_M_MIN, most.max(PIXEL_M_MIN))
    }

    /// Metres of a pixel at level 0.
    pub fn pixel_m(&self) -> f64 {
        self.pixel_m
    }

    /// Levels, each with pixels twice as large as the one before.
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// What a person should know about a picture before seeing it.
    pub fn remarks(&self) -> Vec<String> {
        let slow = self.pictures.iter().zip(&self.paths).filter(|(picture, _)| !picture.is_seen_from_afar());
        slow.map(|(_, path)| {
            let path = path.display();
            format!(
                "{path}: found no overviews; far away only parts of it are read, which is coarse and slow; \
                     `gdaladdo -r average {path}` adds them"
            )
        })
        .collect()
    }

    /// What decides the colours of all squares: the files as they are now.
    pub fn key(&self) -> String {
        format!("{:?} {:?} {} {:?} {:?}", self.states, self.crs, self.pixel_m, self.origin_m, self.size_m)
    }

    /// Whether there is such a square.
    pub fn holds(&self, level: u32, row: u32, col: u32) -> bool {
        let Some(side_m) = self.side_m(level) else { return false };
        f64::from(col) * side_m < self.size_m[0] && f64::from(row) * side_m < self.size_m[1]
    }

    fn side_m(&self, level: u32) -> Option<f64> {
        (level < self.levels).then(|| SQUARE_PIXELS as f64 * self.pixel_m * f64::from(1u32 << level))
    }

    /// The colours of a square, row by row from the south-west: red, green and blue multiplied with how opaque they
    /// are, and that. `None` where there is no such square, or none of the pictures.
    ///
    /// # Errors
    /// When a picture has changed since it was opened, or part of it cannot be decoded.
    pub fn square(&self, level: u32, row: u32, col: u32) -> Result<Option<Vec<u8>>, SourceError> {
        let Some(side_m) = self.side_m(level).filter(|_| self.holds(level, row, col)) else { return Ok(None) };
        let corner = [self.origin_m[0] + f64::from(col) * side_m, self.origin_m[1] + (f64::from(row) + 1.0) * side_m];
        let square = Square { crs: &self.crs, corner, pixel_m: side_m / SQUARE_PIXELS as f64, side: SQUARE_PIXELS };
        let mut pixels = vec![0; 4 * SQUARE_PIXELS * SQUARE_PIXELS];
        let mut is_any = false;
        for picture in &self.pictures {
            is_any |= picture.draw(&square, &self.keep, &mut pixels)?;
        }
        Ok(is_any.then(|| pixels.rchunks(4 * SQUARE_PIXELS).flatten().copied().collect()))
    }
}
