//! What of a file an area needs: before it is fetched, its directory or footer says so.

use std::path::Path;

use job::{Job, SourceFile};
use source_files::DemFile;
#[cfg(feature = "geoparquet")]
use source_files::{Crs, GeoParquet, Wanted, groups_near};
use terrain::GridFrame;

use crate::ground::GroundError;
use crate::ground::source::{area_crs, reading};
#[cfg(feature = "geoparquet")]
use crate::ground::{area::GamingArea, vectors::bounds};

/// What of a raster an area needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Needed {
    /// Its strips or tiles that hold posts under the area or those that resampling reaches around it, in file order.
    pub chunks: Vec<u32>,
    /// Metres between its posts, about: the larger of both directions.
    pub spacing_m: f64,
}

/// What the area of a job needs of the source `file`, by the directory of the raster at `path`.
///
/// # Errors
/// When the raster or the system of the area cannot be used.
pub fn needed(job: &Job, file: &SourceFile, path: &Path) -> Result<Needed, GroundError> {
    /// Metres of a degree of latitude, about.
    const DEGREE_M: f64 = 111_320.0;
    let (opened, crs) = (DemFile::open(path, &reading(file, false)?)?, area_crs(job)?);
    let [east_m, north_m] = job.area.origin_m;
    let grid = GridFrame { origin_east_m: east_m, origin_north_m: north_m, spacing: job.area.spacing };
    let window = opened.window_reaching(&crs, &grid, job.area.grid.area());
    let chunks = window.map(|window| opened.chunks_of(window)).unwrap_or_default();
    let frame = opened.frame();
    let [east, north] = frame.spacing;
    let spacing_m = match frame.crs.unit_m() {
        Some(unit_m) => east.max(north) * unit_m,
        None => {
            let middle = frame.place(frame.rows / 2, 0)[1].to_radians();
            (east * middle.cos()).max(north) * DEGREE_M
        }
    };
    Ok(Needed { chunks, spacing_m })
}

/// The row groups of a GeoParquet file that the area of a job needs; `crs` is its system where the job says one.
///
/// # Errors
/// When the area cannot be planned, or coordinates of the file cannot be brought to its system.
#[cfg(feature = "geoparquet")]
pub fn groups_needed(job: &Job, file: &GeoParquet, crs: Option<&Crs>) -> Result<Vec<usize>, GroundError> {
    let area = GamingArea::new(job)?;
    let bounds = bounds(&area, [area.frame.origin_east_m, area.frame.origin_north_m]);
    let epsg = job.area.epsg;
    let wanted = Wanted { epsg, bounds, layer: None, crs, keys: &[], buildings: false, points: true };
    Ok(groups_near(file, &wanted)?)
}
