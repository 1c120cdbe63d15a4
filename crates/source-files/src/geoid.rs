//! Geoid grids: how far the zero of a vertical datum lies above the ellipsoid, by longitude and latitude.
//!
//! A grid of NOAA's `.gtx` kind, or a raster in degrees. Heights change from one datum to another by the difference
//! of two grids; heights above the ellipsoid need one.

use std::path::Path;
use std::sync::Arc;

use terrain::{GridFrame, Post, PostRect, QUANTA_PER_METRE};

use crate::chunk::Header;
use crate::crs::Crs;
use crate::directory::SampleKind;
use crate::frame::{Axes, SampleScale};
use crate::join::union;
use crate::limits::POSTS_A_SIDE_MAX;
use crate::samples::Samples;
use crate::store::Store;
use crate::{DemFile, Raster, RasterFrame, Reading, SourceError};

/// Bytes before the values of a `.gtx` grid: south, west, steps north and east; rows and columns.
const GTX_HEADER: u64 = 40;
/// What marks a post without a value there.
const GTX_VOID: f64 = -88.8888;
/// No geoid lies farther from the ellipsoid, in metres.
const GEOID_M_MAX: f64 = 200.0;

/// Heights of a datum's zero above the ellipsoid, as far as they were read.
#[derive(Debug)]
pub struct Geoid {
    raster: Raster,
}

impl Geoid {
    /// Reads the rows of the grid at `path` between two latitudes.
    ///
    /// # Errors
    /// When it is no such grid, or has no row there.
    pub fn read(path: &Path, south: f64, north: f64) -> Result<Self, SourceError> {
        let store = Store::open(path)?;
        let start = store.start(GTX_HEADER)?;
        let raster = match Gtx::judged(&store, &start) {
            Some(gtx) => gtx.read(&store, south, north)?,
            None => {
                let reading = Reading { crs: Some(Crs::wgs84()), ..Reading::AS_IT_SAYS };
                let file = DemFile::open(path, &reading)?;
                file.read(rows_between(file.frame(), south, north)?)?
            }
        };
        match raster.range_m() {
            Some((low, high)) if -GEOID_M_MAX <= low && high <= GEOID_M_MAX => Ok(Self { raster }),
            found => {
                let found = found.map_or("nothing".into(), |(low, high)| format!("{low} to {high} m"));
                Err(store.malformed("the geoid grid", found, "heights within 200 m of the ellipsoid"))
            }
        }
    }

    /// The height of the datum's zero above the ellipsoid, in metres; `None` where the grid has none.
    pub fn height_m(&self, [east, north]: [f64; 2]) -> Option<f64> {
        let frame = self.raster.frame();
        let cols = i64::from(frame.cols);
        let around = 360.0 / frame.spacing[0];
        let is_global = around - 1.5 <= cols as f64;
        let mut x = (east - frame.south_west[0]) / frame.spacing[0];
        x -= around * (x / around).floor();
        let y = (north - frame.south_west[1]) / frame.spacing[1];
        let (col, row) = (x.floor() as i64, y.floor() as i64);
        let corner = |up: i64, right: i64| {
            let col = if is_global { (col + right) % (around.round() as i64).min(cols) } else { col + right };
            let post = Post::new(i32::try_from(row + up).ok()?, i32::try_from(col).ok()?);
            if self.raster.window().contains(post) { self.raster.height_m(post) } else { None }
        };
        let (right, up) = (x - x.floor(), y - y.floor());
        // A post without weight is not looked at: it may lie beyond the grid.
        let row_at = |north: i64| match 0.0 < right {
            true => Some(corner(north, 0)? * (1.0 - right) + corner(north, 1)? * right),
            false => corner(north, 0),
        };
        match 0.0 < up {
            true => Some(row_at(0)? * (1.0 - up) + row_at(1)? * up),
            false => row_at(0),
        }
    }
}

/// The rows of a raster in degrees from one latitude to another, with two around them.
fn rows_between(frame: &RasterFrame, south: f64, north: f64) -> Result<PostRect, SourceError> {
    let row = |latitude: f64| (latitude - frame.south_west[1]) / frame.spacing[1];
    let (first, last) = (row(south).floor() - 2.0, row(north).ceil() + 2.0);
    let (first, last) = (first.max(0.0), last.min(f64::from(frame.rows - 1)));
    if last < first {
        return Err(SourceError::OutsideArea { path: frame.path.clone() });
    }
    Ok(PostRect { south: first as i32, west: 0, north: last as i32, east: frame.cols as i32 - 1 })
}

/// The header of a `.gtx` grid.
struct Gtx {
    south_west: [f64; 2],
    step: [f64; 2],
    cols: u32,
    rows: u32,
}

impl Gtx {
    /// The header, if the numbers are those of such a grid and the file is as long as they say: it has no mark.
    fn judged(store: &Store, start: &[u8]) -> Option<Self> {
        let number = |at: usize| Some(f64::from_be_bytes(start.get(at..at + 8)?.try_into().ok()?));
        let count = |at: usize| Some(u32::from_be_bytes(start.get(at..at + 4)?.try_into().ok()?));
        let (south_west, step) = ([number(8)?, number(0)?], [number(24)?, number(16)?]);
        let (rows, cols) = (count(32)?, count(36)?);
        let sides = [rows, cols].iter().all(|&side| 2 <= side && u64::from(side) <= POSTS_A_SIDE_MAX);
        let posts = u64::from(rows) * u64::from(cols);
        let bytes = posts.checked_mul(4).and_then(|bytes| bytes.checked_add(GTX_HEADER));
        let place = south_west[1].abs() <= 90.0 && south_west[0].abs() <= 360.0;
        let steps = step.iter().all(|&step| 0.0 < step && step <= 10.0);
        (sides && bytes == Some(store.len()) && place && steps).then_some(Self { south_west, step, cols, rows })
    }

    fn read(&self, store: &Store, south: f64, north: f64) -> Result<Raster, SourceError> {
        let axes = Axes { first: self.south_west, step: self.step };
        let (frame, _) = RasterFrame::new(store.path(), Crs::wgs84(), &axes, self.cols, self.rows)?;
        let window = rows_between(&frame, south, north)?;
        let (at, row_bytes) = (GTX_HEADER + window.south as u64 * u64::from(self.cols) * 4, self.cols as usize * 4);
        let bytes = store.bytes_at(&mut store.handle()?, at, row_bytes * window.posts_high())?;
        let samples = Samples::from_bytes(SampleKind::F32, true, &bytes);
        let (scale, kind, nodata) = (SampleScale::METRES, SampleKind::F32, Some(GTX_VOID));
        Raster::of_samples(&Header { frame, scale, kind, nodata, shift: None }, window, samples, Vec::new())
    }
}

/// How heights above one datum become heights above another.
#[derive(Clone, Debug)]
pub struct DatumShift {
    /// The datums' names, for comparing.
    pub from: String,
    /// As `from`.
    pub to: String,
    /// The grid of the datum that heights come in; `None` for the ellipsoid itself.
    pub from_grid: Option<Arc<Geoid>>,
    /// The grid of the datum that heights are wanted in.
    pub to_grid: Option<Arc<Geoid>>,
}

impl PartialEq for DatumShift {
    fn eq(&self, other: &Self) -> bool {
        (&self.from, &self.to) == (&other.from, &other.to)
    }
}

impl DatumShift {
    /// What is to be added to heights at a place in degrees, in metres; `None` where a grid has no value.
    pub fn metres(&self, place: [f64; 2]) -> Option<f64> {
        let height = |grid: &Option<Arc<Geoid>>| grid.as_ref().map_or(Some(0.0), |grid| grid.height_m(place));
        Some(height(&self.from_grid)? - height(&self.to_grid)?)
    }

    /// Whether its grids have values in all of an area.
    pub fn covers(&self, area: &Crs, grid: &GridFrame, rect: PostRect) -> bool {
        self.sampled(area, grid, rect).all(|metres| metres.is_some())
    }

    /// Between what the metres to be added lie in an area, a metre wider than looked at: geoids bend over kilometres.
    pub fn range_m(&self, area: &Crs, grid: &GridFrame, rect: PostRect) -> (f64, f64) {
        let found = self.sampled(area, grid, rect).flatten().map(|metres| (metres - 1.0, metres + 1.0));
        // Where a grid has no value nothing is added.
        found.fold((-1.0, 1.0), union)
    }

    /// What is to be added at places all over an area.
    fn sampled<'a>(
        &'a self,
        area: &'a Crs,
        grid: &'a GridFrame,
        rect: PostRect,
    ) -> impl Iterator<Item = Option<f64>> + 'a {
        const STEPS: i32 = 16;
        let wgs84 = Crs::wgs84();
        let along =
            |low: i32, high: i32, step: i32| low + ((high - low) as i64 * i64::from(step) / i64::from(STEPS)) as i32;
        (0..=STEPS).flat_map(|row| (0..=STEPS).map(move |col| (row, col))).map(move |(row, col)| {
            let (row, col) = (along(rect.south, rect.north, row), along(rect.west, rect.east, col));
            area.to(&wgs84, [grid.east_m(col), grid.north_m(row)]).and_then(|place| self.metres(place))
        })
    }

    /// What is to be added at the posts of a rectangle.
    pub(crate) fn over(&self, area: &Crs, grid: &GridFrame, rect: PostRect) -> Shifts {
        let near = |post: i32| post.div_euclid(STEP_POSTS);
        let far = |post: i32| near(post) + 1;
        let net =
            PostRect { south: near(rect.south), west: near(rect.west), north: far(rect.north), east: far(rect.east) };
        let wgs84 = Crs::wgs84();
        let quanta = |row: i32, col: i32| {
            let place = area.to(&wgs84, [grid.east_m(col * STEP_POSTS), grid.north_m(row * STEP_POSTS)]);
            let metres = place.and_then(|place| self.metres(place)).unwrap_or(0.0);
            // Rounded, so that the last digits of sines, which differ from machine to machine, do not decide.
            (metres * f64::from(QUANTA_PER_METRE) * ROUNDED).round() / ROUNDED
        };
        let nodes = (net.south..=net.north).flat_map(|row| (net.west..=net.east).map(move |col| (row, col)));
        Shifts { net, quanta: nodes.map(|(row, col)| quanta(row, col)).collect() }
    }
}

/// Posts between places where grids are asked; geoids bend over kilometres.
const STEP_POSTS: i32 = 16;
/// Steps of a quantum that differences are rounded to.
const ROUNDED: f64 = 1024.0;

/// What is to be added to heights, every sixteenth post; in between it is interpolated.
pub(crate) struct Shifts {
    net: PostRect,
    quanta: Vec<f64>,
}

impl Shifts {
    pub(crate) fn quanta_at(&self, row: i32, col: i32) -> f64 {
        let (south, west) = (row.div_euclid(STEP_POSTS), col.div_euclid(STEP_POSTS));
        let share = |post: i32| f64::from(post.rem_euclid(STEP_POSTS)) / f64::from(STEP_POSTS);
        let (up, right) = (share(row), share(col));
        let at = (south - self.net.south) as usize * self.net.posts_wide() + (west - self.net.west) as usize;
        let far = at + self.net.posts_wide();
        let near = self.quanta[at] * (1.0 - right) + self.quanta[at + 1] * right;
        near * (1.0 - up) + (self.quanta[far] * (1.0 - right) + self.quanta[far + 1] * right) * up
    }
}
