//! What headers tell before any height is decoded: what a build would refuse, and what of a file an area needs.

use std::path::Path;
use std::sync::Arc;

use job::{DemSource, Job, Resampling, SourceFile, Voids};
#[cfg(feature = "geoparquet")]
use source_files::{Crs, GeoParquet, Wanted, groups_near};
use source_files::{DemFile, SourceError, WideMosaic, Windows, read_polygons, window_under};
use terrain::{DEGREE_M, GridFrame};

use crate::ground::GroundError;
use crate::ground::area::GamingArea;
use crate::ground::census::Census;
use crate::ground::datums::{datum_of, judge_datums};
use crate::ground::given::Given;
use crate::ground::mask_of::{Fault, Opening};
use crate::ground::relief::Relief;
use crate::ground::source::{Source, area_crs, mosaic_rules, nothing_reaches, reading};
#[cfg(feature = "geoparquet")]
use crate::ground::vectors::bounds;

/// Posts of an area up to which each of them is looked for in the sources: some seconds of one core.
const REACHED_POSTS_MAX: usize = 1 << 29;

/// Opens what a job names and judges what headers tell, in the order of a build: formats, systems, datums and the
/// grids to convert them, water, areas of importance, given points and pins, and last coverage. What a person should
/// know, in words.
///
/// # Errors
/// What a build would say, where no height has to be decoded to know it.
pub fn foresee(job: &Job, area: &GamingArea) -> Result<Vec<String>, GroundError> {
    let foreseen = match &job.dem.source {
        DemSource::Files { files, .. } => of_files(job, area, files)?,
        DemSource::Sample { .. } => Foreseen::default(),
    };
    let water = job.dem.water.as_ref().map(|water| read_polygons(&water.file.path, job.area.epsg)).transpose()?;
    // Slopes are made from heights on demand, so any ground will do to open a mask.
    let relief = Relief { source: Source::Sample(0), frame: area.frame, water: None, bounds: None };
    let (relief, fault) = (Arc::new(relief), Fault::default());
    Opening { job, area, relief: &relief, fault: &fault }.mask(water.unwrap_or_default())?;
    Given::open(job, area)?;
    if let Some(mosaic) = &foreseen.mosaic {
        refuse_gaps(job, area, mosaic)?;
    }
    Ok(foreseen.told)
}

/// What headers tell of the sources.
#[derive(Default)]
struct Foreseen {
    told: Vec<String>,
    /// They as one ground, where several may be missing together, and that is no hole.
    mosaic: Option<WideMosaic>,
}

fn of_files(job: &Job, area: &GamingArea, files: &[SourceFile]) -> Result<Foreseen, GroundError> {
    let opened = files.iter().map(|file| Ok(DemFile::open(&file.path, &reading(file, job.dem.strict)?)?));
    let mut opened: Vec<DemFile> = opened.collect::<Result<_, GroundError>>()?;
    let has_holes = matches!(job.dem.voids, Voids::Hole | Voids::FillThenHole(_));
    if let ([file], [alone]) = (files, opened.as_slice())
        && job.dem.resampling != Resampling::Cubic
        && !has_holes
        && alone.frame().require_epsg(job.area.epsg).is_ok()
    {
        window_under(alone.frame(), &area.frame, area.rect)?;
        // Its system need not be one that can be computed.
        let told = judge_datums(job, area, &[(file, datum_of(file, alone))])?.warnings;
        return Ok(Foreseen { told, mosaic: None });
    }
    let crs = area_crs(job)?;
    let (mut reaching, mut told) = (Vec::new(), Vec::new());
    for (index, (file, opened)) in files.iter().zip(&opened).enumerate() {
        match opened.window_reaching(&crs, &area.frame, area.rect) {
            Some(_) => reaching.push(index),
            None => told.push(format!("{}: it lies outside the area and is not used", file.path.display())),
        }
    }
    match (files, reaching.is_empty()) {
        ([file], true) => return Err(SourceError::OutsideArea { path: file.path.clone() }.into()),
        (_, true) => return Err(nothing_reaches()),
        _ => {}
    }
    let datums: Vec<_> =
        reaching.iter().map(|&index| (&files[index], datum_of(&files[index], &opened[index]))).collect();
    let mut judged = judge_datums(job, area, &datums)?;
    told.append(&mut judged.warnings);
    if has_holes {
        return Ok(Foreseen { told, mosaic: None });
    }
    reaching.iter().zip(judged.shifts).for_each(|(&index, shift)| opened[index].set_shift(shift));
    let used: Vec<(usize, f64)> = reaching.into_iter().map(|index| (index, 0.0)).collect();
    let place = (&crs, &area.frame, area.rect);
    let mosaic = WideMosaic::new(Windows::new(opened, 0), &used, mosaic_rules(job), place)?;
    Ok(Foreseen { told, mosaic: Some(mosaic) })
}

/// Refuses an area that the sources do not cover; one of very many posts is left to the build.
fn refuse_gaps(job: &Job, area: &GamingArea, mosaic: &WideMosaic) -> Result<(), GroundError> {
    if REACHED_POSTS_MAX < area.rect.post_count() {
        return Ok(());
    }
    let mut census = Census::new();
    for &tile in &area.tiles {
        census.add(&Census::of(&mosaic.reached(area.tiling.rect(tile)), area.rect));
    }
    census.judge(job, area).map(|_| ())
}

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
