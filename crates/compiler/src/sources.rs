//! The rasters of a job, opened and decoded: one on the area's own system as it is, any others as a mosaic.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use database::{Fingerprint, SourceRecord};
use job::{AreaShape, DemSource, Job, Resampling, SourceFile, SourceSaid, Voids};
use schedule::Workers;
use source_files::{
    Crs, DemFile, Mosaic, MosaicRules, MosaicVoids, Patch, Raster, Reading, SourceError, Standing, VoidPolicy,
    VoidSummary, window_under,
};
use terrain::{PostRect, TileId};

use crate::area::GamingArea;
use crate::{CompileError, Stage};

/// Where heights come from.
pub(crate) enum Source {
    /// The built-in terrain, by its seed.
    Sample(u64),
    /// One raster on the area's own system.
    Raster(Box<Raster>),
    /// Any number of rasters.
    Mosaic(Box<Mosaic>),
}

/// The rasters of a job.
pub(crate) struct Opened {
    pub source: Source,
    pub voids: VoidSummary,
    pub warnings: Vec<String>,
    pub accuracy_m: Option<f64>,
}

/// What was decoded of one file that is used, or of several.
struct Decoded<S> {
    source: S,
    warnings: Vec<String>,
    /// Vertical accuracy of the least accurate, in metres.
    accuracy_m: Option<f64>,
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
) -> Result<Opened, CompileError> {
    if let Some((decoded, voids)) = open_alone(job, area, files, workers, stop)? {
        let Decoded { source, warnings, accuracy_m } = decoded;
        return Ok(Opened { source: Source::Raster(Box::new(source)), voids, warnings, accuracy_m });
    }
    let Decoded { source, warnings, accuracy_m } = open_mosaic(job, area, files, workers, stop)?;
    let voids = VoidSummary::default();
    Ok(Opened { source: Source::Mosaic(Box::new(source)), voids, warnings, accuracy_m })
}

/// A datum's name without what people write differently: `EGM 96` is `egm96`.
fn plain_datum(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase()
}

/// Refuses heights above different datums in one product; tells of those that are above nobody knows what.
fn judge_datums(job: &Job, datums: &[(&SourceFile, Option<String>)]) -> Result<Vec<String>, CompileError> {
    let known = datums.iter().find_map(|(_, datum)| datum.clone());
    let Some(wanted) = job.dem.vertical_datum.clone().or(known) else { return Ok(Vec::new()) };
    let mut warnings = Vec::new();
    for (file, datum) in datums {
        match datum {
            Some(datum) if plain_datum(datum) != plain_datum(&wanted) => {
                return Err(CompileError::Impossible {
                    key: "dem.vertical_datum".into(),
                    found: format!("heights of {} above {datum}, where {wanted} is wanted", file.written),
                    expected: "heights above one datum, since no geoid grid is read yet".into(),
                    hint: "convert it first with a geoid grid (gdalwarp), or correct what the job says of it".into(),
                });
            }
            Some(_) => {}
            None => warnings.push(format!(
                "{}: it does not say what its heights are measured from; they are carried as they are",
                file.path.display()
            )),
        }
    }
    Ok(warnings)
}

/// What the heights of a file are measured from: as the job says, else as the file does.
fn datum_of(file: &SourceFile, opened: &DemFile) -> Option<String> {
    file.said.vertical_datum.clone().or_else(|| opened.vertical_datum().map(str::to_owned))
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
    let opened = DemFile::open(&file.path, &reading(file)?)?;
    if opened.frame().require_epsg(job.area.epsg).is_err() {
        return Ok(None);
    }
    let window = match window_under(opened.frame(), &area.frame, area.rect) {
        Err(SourceError::NotCovered { .. }) if policy == VoidPolicy::Hole => return Ok(None),
        window => window?,
    };
    let mut raster = decode(&opened, window, workers, stop)?;
    let voids = raster.settle_voids(policy)?;
    let mut warnings = judge_datums(job, &[(file, datum_of(file, &opened))])?;
    warnings.append(&mut raster_warnings(&raster));
    let accuracy_m = opened.accuracy_m();
    Ok(Some((Decoded { source: raster, warnings, accuracy_m }, voids)))
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
        let opened = DemFile::open(&file.path, &reading(file)?)?;
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
    warnings.append(&mut judge_datums(job, &datums)?);
    if let ([file], true) = (files, rasters.is_empty()) {
        return Err(SourceError::OutsideArea { path: file.path.clone() }.into());
    }
    if rasters.is_empty() {
        return Err(CompileError::Impossible {
            key: "dem.sources".into(),
            found: "no raster that reaches into the area".into(),
            expected: "one at least".into(),
            hint: "check area.crs and area.origin_m; `tiefort init FILES…` writes an area that fits".into(),
        });
    }
    let fill_within = match job.dem.voids {
        Voids::FillWithinPosts(posts) | Voids::FillThenHole(posts) => posts,
        Voids::Fail | Voids::Hole => 0,
    };
    let rules = MosaicRules {
        resampling: match job.dem.resampling {
            Resampling::Bilinear => source_files::Resampling::Bilinear,
            Resampling::Cubic => source_files::Resampling::Cubic,
        },
        feather_m: job.dem.feather_m,
        voids: MosaicVoids { next_source: job.dem.next_source, fill_within },
    };
    let source = Mosaic::new(rasters, rules, &crs, &area.frame, area.rect)?;
    Ok(Decoded { source, warnings, accuracy_m })
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
pub(crate) fn reading(file: &SourceFile) -> Result<Reading, CompileError> {
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
    Ok(Reading { crs: crs.transpose()?, corner, height_unit_m: *height_unit_m, nodata: *nodata, strict: false })
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
    let mut records = Vec::new();
    match &job.dem.source {
        DemSource::Sample { seed } => records.push(record(&format!("sample seed={seed}"), &seed.to_le_bytes())),
        DemSource::Files { files, .. } => {
            for file in files {
                let attribution = file.said.attribution.clone();
                records.push(SourceRecord { attribution, ..file_record(&file.written, &file.path)? });
            }
        }
    }
    for area in &job.importance.areas {
        match &area.shape {
            AreaShape::Polygons { file } | AreaShape::RasterValue { file, .. } => {
                records.push(file_record(&file.written, &file.path)?);
            }
            AreaShape::Sample(_) => {}
        }
    }
    Ok(records)
}

/// The record of a file that a build was made from.
fn file_record(written: &str, path: &Path) -> Result<SourceRecord, CompileError> {
    Ok(record(written, &source_files::content(path)?))
}

/// The record of some content.
fn record(path: &str, content: &[u8]) -> SourceRecord {
    SourceRecord { path: path.to_owned(), blake3: Fingerprint::of_bytes(content), attribution: None }
}

/// What a person should know about a raster: heights that look like a sentinel nobody declared, and more.
fn raster_warnings(raster: &Raster) -> Vec<String> {
    const LOWEST_LAND_M: f64 = -450.0;
    const HIGHEST_LAND_M: f64 = 8900.0;
    const NOTES_MAX: usize = 5;
    let (path, crs) = (raster.frame().path.display(), &raster.frame().crs);
    let mut warnings = Vec::new();
    if let Some((lowest, highest)) = raster.range_m()
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
    warnings.extend(raster.notes().iter().take(NOTES_MAX).cloned());
    if NOTES_MAX < raster.notes().len() {
        warnings.push(format!("{path}: {} more of the same kind", raster.notes().len() - NOTES_MAX));
    }
    warnings
}

/// How many posts of the area stand how, and where there is nothing.
#[derive(Clone)]
pub(crate) struct Census {
    pub filled: usize,
    pub void: usize,
    pub gap: usize,
    first_void: Option<terrain::Post>,
    /// Posts without a source and posts in all, by part of the area, the southern row first.
    parts: Vec<(usize, usize)>,
}

/// Columns and rows of the map of what is covered.
const MAP_COLS: usize = 48;
const MAP_ROWS: usize = 24;

impl Census {
    pub fn new() -> Self {
        Self { filled: 0, void: 0, gap: 0, first_void: None, parts: vec![(0, 0); MAP_COLS * MAP_ROWS] }
    }

    /// Of one tile; a post on a side that two tiles share counts in the southern or western one.
    pub fn of(patch: &Patch, area: PostRect) -> Self {
        let (mut census, rect) = (Self::new(), patch.rect);
        for row in rect.south + i32::from(area.south < rect.south)..=rect.north {
            for col in rect.west + i32::from(area.west < rect.west)..=rect.east {
                let index = (row - rect.south) as usize * rect.posts_wide() + (col - rect.west) as usize;
                let part = (row - area.south) as usize * MAP_ROWS / area.posts_high() * MAP_COLS
                    + (col - area.west) as usize * MAP_COLS / area.posts_wide();
                census.parts[part].1 += 1;
                match patch.standings[index] {
                    Standing::Height => {}
                    Standing::Filled => census.filled += 1,
                    Standing::Void => {
                        census.void += 1;
                        census.first_void = census.first_void.or(Some(terrain::Post::new(row, col)));
                    }
                    Standing::Gap => {
                        census.gap += 1;
                        census.parts[part].0 += 1;
                    }
                }
            }
        }
        census
    }

    pub fn add(&mut self, other: &Census) {
        self.filled += other.filled;
        self.void += other.void;
        self.gap += other.gap;
        self.first_void = self.first_void.or(other.first_void);
        for (sum, part) in self.parts.iter_mut().zip(&other.parts) {
            *sum = (sum.0 + part.0, sum.1 + part.1);
        }
    }

    /// What the job's voids make of it.
    ///
    /// # Errors
    /// When ground is missing and the job wants none to be.
    pub fn judge(&self, job: &Job, area: &GamingArea) -> Result<VoidSummary, CompileError> {
        let of = area.rect.post_count();
        if self.gap + self.void == of {
            return Err(CompileError::Impossible {
                key: "dem.sources".into(),
                found: "no height in the whole area".into(),
                expected: "heights in some of it at least".into(),
                hint: "check area.crs and area.origin_m, and the void markers of the files".into(),
            });
        }
        if !matches!(job.dem.voids, Voids::Hole | Voids::FillThenHole(_)) {
            if 0 < self.gap {
                return Err(SourceError::Gaps { found: self.gap, of, map: self.map() }.into());
            }
            if let Some(first) = self.first_void {
                let [east_m, north_m] = area.frame.place_m(first);
                let first = format!("{east_m:.1}, {north_m:.1} m");
                return Err(SourceError::MosaicVoids { found: self.void, of, first }.into());
            }
        }
        Ok(VoidSummary { filled: self.filled, left: self.void + self.gap })
    }

    /// What is covered, north up: `#` wholly, `+` in part, `.` not at all.
    pub fn map(&self) -> String {
        let mark = |&(gap, of): &(usize, usize)| match (gap, of) {
            (_, 0) => None,
            (0, _) => Some('#'),
            (gap, of) if gap < of => Some('+'),
            _ => Some('.'),
        };
        let lines = self.parts.chunks(MAP_COLS).rev().map(|line| line.iter().filter_map(mark).collect::<String>());
        lines.filter(|line| !line.is_empty()).map(|line| format!("    {line}")).collect::<Vec<_>>().join("\n")
    }
}
