//! The rasters of a job, opened and decoded: one on the area's own system as it is, any others as a mosaic.

use std::sync::atomic::AtomicBool;

use job::{Job, Resampling, SourceFile, Voids};
use schedule::Workers;
use source_files::{DemFile, Mosaic, Raster, SourceError, VoidPolicy, VoidSummary, edge_steps, window_under};

use crate::ground::area::GamingArea;
use crate::ground::datums::{Datums, datum_of, judge_datums};
use crate::ground::source::{
    Decoded, Source, area_crs, decode, mosaic_rules, nothing_reaches, raised, reading, told, warnings_of,
};
use crate::ground::{GroundError, large};

/// The rasters of a job.
pub struct Opened {
    pub source: Source,
    pub voids: VoidSummary,
    pub warnings: Vec<String>,
    pub accuracy_m: Option<f64>,
    /// Between what the heights lie that were read of the sources, in metres above the job's datum.
    pub range_m: Option<(f64, f64)>,
    /// The same of posts that the area's own lie among.
    pub under_m: Option<(f64, f64)>,
}

/// Opens, judges and decodes the files of a job.
///
/// # Errors
/// When one cannot be used for this area.
pub fn open(
    job: &Job,
    area: &GamingArea,
    files: &[SourceFile],
    workers: &Workers,
    stop: &AtomicBool,
    whole_bytes_max: u64,
) -> Result<Opened, GroundError> {
    let voids = VoidSummary::default();
    if let Some(decoded) = large::open(job, area, files, (workers, stop), whole_bytes_max)? {
        return Ok(opened(decoded, |source| source, voids));
    }
    if let Some((decoded, voids)) = open_alone(job, area, files, workers, stop)? {
        return Ok(opened(decoded, |source| Source::Raster(Box::new(source)), voids));
    }
    let decoded = open_mosaic(job, area, files, workers, stop)?;
    Ok(opened(decoded, |source| Source::Mosaic(Box::new(source)), voids))
}

fn opened<S>(decoded: Decoded<S>, source: impl FnOnce(S) -> Source, voids: VoidSummary) -> Opened {
    let Decoded { source: of, warnings, accuracy_m, range_m, under_m } = decoded;
    Opened { source: source(of), voids, warnings, accuracy_m, range_m, under_m }
}

/// One raster on the area's own system whose posts need no projecting; `None` where that is not so.
fn open_alone(
    job: &Job,
    area: &GamingArea,
    files: &[SourceFile],
    workers: &Workers,
    stop: &AtomicBool,
) -> Result<Option<(Decoded<Raster>, VoidSummary)>, GroundError> {
    let policy = match job.dem.voids {
        Voids::Fail => VoidPolicy::Fail,
        Voids::FillWithinPosts(posts) => VoidPolicy::FillWithin(posts),
        Voids::Hole => VoidPolicy::Hole,
        Voids::FillThenHole(_) => return Ok(None),
    };
    let [file] = files else { return Ok(None) };
    if job.dem.resampling == Resampling::Cubic {
        return Ok(None);
    }
    let opened = DemFile::open(&file.path, &reading(file, job.dem.strict)?)?;
    if opened.frame().require_epsg(job.area.epsg).is_err() {
        return Ok(None);
    }
    let window = match window_under(opened.frame(), &area.frame, area.rect) {
        Err(SourceError::NotCovered { .. }) if policy == VoidPolicy::Hole => return Ok(None),
        window => window?,
    };
    let mut raster = decode(&opened, window, workers, stop)?;
    // Voids may lie in water, which is level and so is ground: only a mosaic asks that of each post.
    if job.dem.water.is_some() && 0 < raster.void_count() {
        return Ok(None);
    }
    let voids = raster.settle_voids(policy)?;
    let Datums { shifts, mut warnings } = judge_datums(job, area, &[(file, datum_of(file, &opened))])?;
    if shifts[0].is_some() {
        return Ok(None);
    }
    warnings.append(&mut raster_warnings(&raster));
    let (accuracy_m, range_m) = (opened.accuracy_m(), raster.range_m());
    // It was read as far as the area's posts need it.
    Ok(Some((Decoded { source: raster, warnings, accuracy_m, range_m, under_m: range_m }, voids)))
}

fn open_mosaic(
    job: &Job,
    area: &GamingArea,
    files: &[SourceFile],
    workers: &Workers,
    stop: &AtomicBool,
) -> Result<Decoded<Mosaic>, GroundError> {
    let crs = area_crs(job)?;
    let (mut rasters, mut warnings, mut accuracy_m) = (Vec::new(), Vec::new(), None);
    let (mut datums, mut reached_m) = (Vec::new(), Vec::new());
    for file in files {
        let opened = DemFile::open(&file.path, &reading(file, job.dem.strict)?)?;
        let path = file.path.display();
        let Some(window) = opened.window_reaching(&crs, &area.frame, area.rect) else {
            warnings.push(format!("{path}: it lies outside the area and is not used"));
            continue;
        };
        let raster = decode(&opened, window, workers, stop)?;
        if raster.void_count() == window.post_count() {
            if files.len() == 1 {
                return Err(SourceError::AllVoid { path: file.path.clone(), found: window.post_count() }.into());
            }
            warnings.push(format!("{path}: all its posts in the area are void, so it is not used"));
            continue;
        }
        warnings.extend(raster_warnings(&raster));
        accuracy_m = [accuracy_m, opened.accuracy_m()].into_iter().flatten().reduce(f64::max);
        datums.push((file, datum_of(file, &opened)));
        reached_m.push(raster.range_within_m(&opened.reach(&crs, &area.frame, area.rect)));
        rasters.push(raster);
    }
    let mut judged = judge_datums(job, area, &datums)?;
    warnings.append(&mut judged.warnings);
    let range_m = raised(rasters.iter().map(Raster::range_m), &judged.shifts, (area, &crs));
    let under_m = raised(reached_m, &judged.shifts, (area, &crs));
    rasters.iter_mut().zip(judged.shifts).for_each(|(raster, shift)| raster.set_shift(shift));
    if let ([file], true) = (files, rasters.is_empty()) {
        return Err(SourceError::OutsideArea { path: file.path.clone() }.into());
    }
    if rasters.is_empty() {
        return Err(nothing_reaches());
    }
    let steps = edge_steps(&rasters, (&crs, &area.frame, area.rect), 0.0 < job.dem.feather_m);
    warnings.extend(steps.iter().filter_map(|step| told(step, |place| rasters[place].frame())));
    let source = Mosaic::new(rasters, mosaic_rules(job), &crs, &area.frame, area.rect)?;
    Ok(Decoded { source, warnings, accuracy_m, range_m, under_m })
}

fn raster_warnings(raster: &Raster) -> Vec<String> {
    warnings_of(raster.frame(), raster.range_m(), raster.notes())
}
