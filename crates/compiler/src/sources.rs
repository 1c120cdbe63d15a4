//! The rasters of a job, opened and decoded: one on the area's own system as it is, any others as a mosaic.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use database::{Fingerprint, SourceRecord};
use job::{AreaShape, DemSource, Job, Resampling, SourceFile, SourceSaid, Start, Voids};
use schedule::Workers;
use source_files::{
    Crs, DatumShift, DemFile, FileState, Mosaic, MosaicRules, MosaicVoids, Raster, RasterFrame, Reading, SourceError,
    VoidPolicy, VoidSummary, WideMosaic, Windows, window_under,
};
use terrain::{PostRect, TileId};

use crate::area::GamingArea;
use crate::datums::{Datums, datum_of, judge_datums};
use crate::{CompileError, Stage, large};

/// Where heights come from.
pub(crate) enum Source {
    /// The built-in terrain, by its seed.
    Sample(u64),
    /// One raster on the area's own system.
    Raster(Box<Raster>),
    /// Any number of rasters.
    Mosaic(Box<Mosaic>),
    /// The same as [`Source::Raster`], read by window; it has no voids.
    Window(Box<Windows>),
    /// The same as [`Source::Mosaic`], read by window.
    Wide(Box<WideMosaic>),
}

/// The rasters of a job.
pub(crate) struct Opened {
    pub source: Source,
    pub voids: VoidSummary,
    pub warnings: Vec<String>,
    pub accuracy_m: Option<f64>,
    /// Between what the heights of the sources lie under the area, in metres above the job's datum.
    pub range_m: Option<(f64, f64)>,
}

/// What was decoded of one file that is used, or of several.
pub(crate) struct Decoded<S> {
    pub source: S,
    pub warnings: Vec<String>,
    /// Vertical accuracy of the least accurate, in metres.
    pub accuracy_m: Option<f64>,
    /// Lowest and highest height, in metres.
    pub range_m: Option<(f64, f64)>,
}

/// Opens, judges and decodes the files of a job.
///
/// # Errors
/// When one cannot be used for this area.
pub(crate) fn open(
    job: &Job,
    area: &GamingArea,
    files: &[SourceFile],
    workers: &Workers,
    stop: &AtomicBool,
    whole_bytes_max: u64,
) -> Result<Opened, CompileError> {
    let voids = VoidSummary::default();
    if let Some(Decoded { source, warnings, accuracy_m, range_m }) =
        large::open(job, area, files, (workers, stop), whole_bytes_max)?
    {
        return Ok(Opened { source, voids, warnings, accuracy_m, range_m });
    }
    if let Some((decoded, voids)) = open_alone(job, area, files, workers, stop)? {
        let Decoded { source, warnings, accuracy_m, range_m } = decoded;
        return Ok(Opened { source: Source::Raster(Box::new(source)), voids, warnings, accuracy_m, range_m });
    }
    let Decoded { source, warnings, accuracy_m, range_m } = open_mosaic(job, area, files, workers, stop)?;
    Ok(Opened { source: Source::Mosaic(Box::new(source)), voids, warnings, accuracy_m, range_m })
}

/// One raster on the area's own system whose posts need no projecting; `None` where that is not so.
fn open_alone(
    job: &Job,
    area: &GamingArea,
    files: &[SourceFile],
    workers: &Workers,
    stop: &AtomicBool,
) -> Result<Option<(Decoded<Raster>, VoidSummary)>, CompileError> {
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
    Ok(Some((Decoded { source: raster, warnings, accuracy_m, range_m }, voids)))
}

fn open_mosaic(
    job: &Job,
    area: &GamingArea,
    files: &[SourceFile],
    workers: &Workers,
    stop: &AtomicBool,
) -> Result<Decoded<Mosaic>, CompileError> {
    let crs = area_crs(job)?;
    let (mut rasters, mut warnings, mut accuracy_m) = (Vec::new(), Vec::new(), None);
    let mut datums = Vec::new();
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
        rasters.push(raster);
    }
    let mut judged = judge_datums(job, area, &datums)?;
    warnings.append(&mut judged.warnings);
    let ranges = rasters
        .iter()
        .zip(&judged.shifts)
        .filter_map(|(raster, shift)| Some(raised(raster.range_m()?, shift.as_ref(), area, &crs)));
    let range_m = ranges.reduce(union);
    rasters.iter_mut().zip(judged.shifts).for_each(|(raster, shift)| raster.set_shift(shift));
    if let ([file], true) = (files, rasters.is_empty()) {
        return Err(SourceError::OutsideArea { path: file.path.clone() }.into());
    }
    if rasters.is_empty() {
        return Err(nothing_reaches());
    }
    let source = Mosaic::new(rasters, mosaic_rules(job), &crs, &area.frame, area.rect)?;
    Ok(Decoded { source, warnings, accuracy_m, range_m })
}

/// A range of heights, once they are brought to another datum.
pub(crate) fn raised((low, high): (f64, f64), shift: Option<&DatumShift>, area: &GamingArea, crs: &Crs) -> (f64, f64) {
    let (least, most) = shift.map_or((0.0, 0.0), |shift| shift.range_m(crs, &area.frame, area.rect));
    (low + least, high + most)
}

/// The range of what lies in either of two.
pub(crate) fn union((low, high): (f64, f64), (lower, higher): (f64, f64)) -> (f64, f64) {
    (low.min(lower), high.max(higher))
}

pub(crate) fn nothing_reaches() -> CompileError {
    CompileError::Impossible {
        key: "dem.sources".into(),
        found: "no raster that reaches into the area".into(),
        expected: "one at least".into(),
        hint: "check area.crs and area.origin_m; `tiefort init FILES…` writes an area that fits".into(),
    }
}

/// What a job says of several sources.
pub(crate) fn mosaic_rules(job: &Job) -> MosaicRules {
    let fill_within = match job.dem.voids {
        Voids::FillWithinPosts(posts) | Voids::FillThenHole(posts) => posts,
        Voids::Fail | Voids::Hole => 0,
    };
    MosaicRules {
        resampling: match job.dem.resampling {
            Resampling::Bilinear => source_files::Resampling::Bilinear,
            Resampling::Cubic => source_files::Resampling::Cubic,
        },
        feather_m: job.dem.feather_m,
        voids: MosaicVoids { next_source: job.dem.next_source, fill_within },
    }
}

/// The system of the area.
///
/// # Errors
/// When it is not one that can be computed.
pub(crate) fn area_crs(job: &Job) -> Result<Crs, CompileError> {
    let impossible = |found: String| CompileError::Impossible {
        key: "area.crs".into(),
        found: format!("EPSG:{}: {found}", job.area.epsg),
        expected: "a projected system in metres that can be computed".into(),
        hint: "UTM zone 11 north on WGS 84 is EPSG:32611, zone 32 north EPSG:32632".into(),
    };
    let crs = Crs::from_epsg(job.area.epsg).map_err(impossible)?;
    match crs.unit_m() {
        Some(1.0) => Ok(crs),
        Some(unit_m) => Err(impossible(format!("its unit is {unit_m} m"))),
        None => Err(impossible("it is in degrees".into())),
    }
}

/// How a file is to be read, as the job says.
///
/// # Errors
/// When the job names a coordinate system that cannot be computed.
pub(crate) fn reading(file: &SourceFile, strict: bool) -> Result<Reading, CompileError> {
    let SourceSaid { crs, corner, height_unit_m, nodata, .. } = &file.said;
    let crs = crs.as_deref().map(|text| {
        Crs::named(text).map_err(|found| CompileError::Impossible {
            key: "dem.sources".into(),
            found: format!("crs of {}: {found}", file.written),
            expected: "a system that can be computed".into(),
            hint: "give a code, as crs = \"EPSG:4326\"".into(),
        })
    });
    let corner = corner.map(|[latitude, longitude]| [longitude, latitude]);
    Ok(Reading { crs: crs.transpose()?, corner, height_unit_m: *height_unit_m, nodata: *nodata, strict })
}

/// Decodes a window of a raster on all workers.
pub(crate) fn decode(
    file: &DemFile,
    window: PostRect,
    workers: &Workers,
    stop: &AtomicBool,
) -> Result<Raster, CompileError> {
    let chunks = file.chunks_of(window);
    let parts: Vec<&[u32]> = chunks.chunks(chunks.len().div_ceil(4 * workers.count()).max(1)).collect();
    let decoded =
        schedule::for_each_independent(&parts, workers, stop, |_, part| file.decode(part).map_err(CompileError::from));
    let nowhere = vec![TileId { row: 0, col: 0 }; parts.len()];
    let decoded = decoded.map_err(|error| CompileError::from_schedule(Stage::Read, &nowhere, error))?;
    Ok(file.assemble(window, decoded.into_iter().flatten().collect())?)
}

/// What a job's heights and weights are made from: the content of every file it names, hashed and not decoded.
///
/// # Errors
/// When a file cannot be read.
pub(crate) fn records(job: &Job) -> Result<Vec<SourceRecord>, CompileError> {
    let sample = match &job.dem.source {
        DemSource::Sample { seed } => Some(record(&format!("sample seed={seed}"), &seed.to_le_bytes())),
        DemSource::Files { .. } => None,
    };
    let files = named_files(job).into_iter().map(|file| {
        let attribution = file.attribution.map(str::to_owned);
        Ok(SourceRecord { attribution, ..file_record(file.written, file.path)? })
    });
    sample.into_iter().map(Ok).chain(files).collect()
}

/// What the files of a job are like now, so that one that changes during a build is noticed.
///
/// # Errors
/// When one is not there, or no file.
pub(crate) fn states(job: &Job) -> Result<Vec<FileState>, CompileError> {
    named_files(job).into_iter().map(|file| Ok(FileState::of(file.path)?)).collect()
}

/// A file that a job names.
struct Named<'a> {
    written: &'a str,
    path: &'a Path,
    attribution: Option<&'a str>,
}

/// Every file that a job names, in the order of their records.
fn named_files(job: &Job) -> Vec<Named<'_>> {
    let mut all = Vec::new();
    if let DemSource::Files { files, .. } = &job.dem.source {
        all.extend(files.iter().map(|file| Named {
            written: &file.written,
            path: &file.path,
            attribution: file.said.attribution.as_deref(),
        }));
    }
    let geoids = job.dem.geoids.iter().map(|geoid| &geoid.file);
    let water = job.dem.water.iter().map(|water| &water.file);
    let start = job.tin.start.iter().filter_map(|start| match start {
        Start::File(file) => Some(file),
        Start::Method { .. } => None,
    });
    let areas = job.importance.areas.iter().filter_map(|area| match &area.shape {
        AreaShape::Polygons { file } | AreaShape::RasterValue { file, .. } => Some(file),
        AreaShape::Slope { .. } | AreaShape::Sample(_) => None,
    });
    let others = geoids.chain(water).chain(start).chain(&job.tin.pins).chain(areas);
    all.extend(others.map(|file| Named { written: &file.written, path: &file.path, attribution: None }));
    all
}

/// The record of a file that a build was made from.
fn file_record(written: &str, path: &Path) -> Result<SourceRecord, CompileError> {
    let content = Fingerprint::of_reader(source_files::content(path)?);
    let blake3 = content.map_err(|source| SourceError::Read { path: path.into(), source })?;
    Ok(SourceRecord { path: written.to_owned(), blake3, attribution: None })
}

/// The record of some content.
fn record(path: &str, content: &[u8]) -> SourceRecord {
    SourceRecord { path: path.to_owned(), blake3: Fingerprint::of_bytes(content), attribution: None }
}

fn raster_warnings(raster: &Raster) -> Vec<String> {
    warnings_of(raster.frame(), raster.range_m(), raster.notes())
}

/// What a person should know about a raster: heights that look like a sentinel nobody declared, and more.
pub(crate) fn warnings_of(frame: &RasterFrame, range_m: Option<(f64, f64)>, notes: &[String]) -> Vec<String> {
    const LOWEST_LAND_M: f64 = -450.0;
    const HIGHEST_LAND_M: f64 = 8900.0;
    const NOTES_MAX: usize = 5;
    let (path, crs) = (frame.path.display(), &frame.crs);
    let mut warnings = Vec::new();
    if let Some((lowest, highest)) = range_m
        && (lowest < LOWEST_LAND_M || HIGHEST_LAND_M < highest)
    {
        warnings.push(format!(
            "{path}: heights run from {lowest} m to {highest} m, beyond any land on Earth; \
             a void marker without a nodata tag would look like that"
        ));
    }
    if crs.epsg() == Some(3857) {
        warnings.push(format!("{path}: EPSG:3857 metres are not ground metres away from the equator"));
    }
    warnings.extend(crs.remark().map(|remark| format!("{path}: {}: {remark}", crs.name())));
    warnings.extend(notes.iter().take(NOTES_MAX).cloned());
    if NOTES_MAX < notes.len() {
        warnings.push(format!("{path}: {} more of the same kind", notes.len() - NOTES_MAX));
    }
    warnings
}
