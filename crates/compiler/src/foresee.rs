//! What a build would refuse, told from headers before any height is decoded.

use job::{DemSource, Job, Resampling, SourceFile, Voids};
use source_files::{DemFile, SourceError, window_under};

use crate::CompileError;
use crate::area::GamingArea;
use crate::datums::{datum_of, judge_datums};
use crate::given::Given;
use crate::sources::{area_crs, nothing_reaches, reading};

/// Opens what a job names and judges what headers tell: formats, systems, coverage, datums and the grids to convert
/// them, given points and pins. What a person should know, in words.
///
/// # Errors
/// What a build would say, where no height has to be decoded to know it.
pub fn foresee(job: &Job) -> Result<Vec<String>, CompileError> {
    let area = GamingArea::new(job)?;
    Given::open(job, &area)?;
    match &job.dem.source {
        DemSource::Files { files, .. } => of_files(job, &area, files),
        DemSource::Sample { .. } => Ok(Vec::new()),
    }
}

fn of_files(job: &Job, area: &GamingArea, files: &[SourceFile]) -> Result<Vec<String>, CompileError> {
    let opened = files.iter().map(|file| Ok(DemFile::open(&file.path, &reading(file, job.dem.strict)?)?));
    let opened: Vec<DemFile> = opened.collect::<Result<_, CompileError>>()?;
    if let [alone] = opened.as_slice()
        && job.dem.resampling != Resampling::Cubic
        && alone.frame().require_epsg(job.area.epsg).is_ok()
        && !matches!(job.dem.voids, Voids::Hole | Voids::FillThenHole(_))
    {
        window_under(alone.frame(), &area.frame, area.rect)?;
    }
    // A system that cannot be computed is enough for a raster in that very system.
    let Ok(crs) = area_crs(job) else { return Ok(Vec::new()) };
    let (mut datums, mut told) = (Vec::new(), Vec::new());
    for (file, opened) in files.iter().zip(&opened) {
        match opened.window_reaching(&crs, &area.frame, area.rect) {
            Some(_) => datums.push((file, datum_of(file, opened))),
            None => told.push(format!("{}: it lies outside the area and is not used", file.path.display())),
        }
    }
    match (files, datums.is_empty()) {
        ([file], true) => return Err(SourceError::OutsideArea { path: file.path.clone() }.into()),
        (_, true) => return Err(nothing_reaches()),
        _ => {}
    }
    told.append(&mut judge_datums(job, area, &datums)?.warnings);
    Ok(told)
}
