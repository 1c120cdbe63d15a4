//! Files of geoid grids: of NOAA's `.gtx` kind, or rasters in degrees.

use std::path::Path;

use terrain::PostRect;

use crate::chunk::Header;
use crate::crs::Crs;
use crate::directory::SampleKind;
use crate::frame::{Axes, SampleScale};
use crate::limits::POSTS_A_SIDE_MAX;
use crate::samples::Samples;
use crate::store::Store;
use crate::{DemFile, Geoid, Raster, RasterFrame, Reading, SourceError};

/// Bytes before the values of a `.gtx` grid: south, west, steps north and east; rows and columns.
const GTX_HEADER: u64 = 40;
/// What marks a post without a value there.
const GTX_VOID: f64 = -88.8888;
/// No geoid lies farther from the ellipsoid, in metres.
const GEOID_M_MAX: f64 = 200.0;

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
            Some((low, high)) if -GEOID_M_MAX <= low && high <= GEOID_M_MAX => {
                let Raster { frame, scale, window, samples, voids, .. } = raster;
                Ok(Self { frame, scale, window, samples, voids })
            }
            found => {
                let found = found.map_or("nothing".into(), |(low, high)| format!("{low} to {high} m"));
                Err(store.malformed("the geoid grid", found, "heights within 200 m of the ellipsoid"))
            }
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
