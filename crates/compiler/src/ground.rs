//! The ground of a job: windows of heights and weights on demand.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

use database::{Fingerprint, SourceRecord};
use fidelity::{SourcePosts, Tally, residuals_at_source};
use job::{AreaShape, DemSource, ImportanceArea, Job, Smooth, Voids};
use mask::{Mask, Shape, Smoothing};
use schedule::Workers;
use source_files::{ClassRaster, GeoTiff, Raster, VoidPolicy, VoidSummary, read_polygons, window_under};
use terrain::{Dem, GridFrame, Importance, PostRect, TileId};

use crate::area::GamingArea;
use crate::{CompileError, Stage};

/// Posts of an area up to which the windows of tiles are kept between stages (7 bytes a post).
const KEPT_POSTS_MAX: usize = 16 << 20;

/// Where heights and weights come from.
pub(crate) struct Ground {
    source: Source,
    mask: Mask<'static>,
    rect: PostRect,
    frame: GridFrame,
    kept: Option<Vec<OnceLock<Arc<Window>>>>,
    /// Voids of the source under the area.
    pub voids: VoidSummary,
    /// For the manifest.
    pub records: Vec<SourceRecord>,
    /// What a person should know about the sources.
    pub warnings: Vec<String>,
}

enum Source {
    Sample(u64),
    Raster(Box<Raster>),
}

/// The ground of a rectangle of posts.
pub(crate) struct Window {
    pub dem: Dem,
    pub importance: Importance,
}

impl Window {
    /// What load modules of this rectangle are measured against.
    pub fn measured(&self, area: &GamingArea) -> fidelity::Ground<'_> {
        let spacing = area.frame.spacing;
        fidelity::Ground { dem: &self.dem, mask: &self.importance, grid: area.grid, spacing }
    }
}

impl Ground {
    /// Opens and judges everything the job names.
    ///
    /// # Errors
    /// When a file cannot be used for this area.
    pub fn open(job: &Job, area: &GamingArea, workers: &Workers, stop: &AtomicBool) -> Result<Self, CompileError> {
        let mut records = Vec::new();
        let mut voids = VoidSummary::default();
        let source = match &job.dem.source {
            DemSource::Sample { seed } => {
                records.push(record(&format!("sample seed={seed}"), &seed.to_le_bytes()));
                Source::Sample(*seed)
            }
            DemSource::Files { files, written } => {
                let [file] = files.as_slice() else { return Err(several_sources(written, files.len())) };
                let mut raster = read_raster(job, area, &file.path, workers, stop)?;
                voids = raster.settle_voids(void_policy(job.dem.voids))?;
                records.push(file_record(&file.written, &file.path)?);
                Source::Raster(Box::new(raster))
            }
        };
        let mask = open_mask(job, area, &mut records)?;
        let keep = area.rect.post_count() <= KEPT_POSTS_MAX;
        let kept = keep.then(|| area.tiles.iter().map(|_| OnceLock::new()).collect());
        let warnings = warnings(&source);
        Ok(Self { source, mask, rect: area.rect, frame: area.frame, kept, voids, records, warnings })
    }

    /// The ground of one tile, made once where memory allows.
    ///
    /// # Errors
    /// When the source has no heights there.
    pub fn tile(&self, area: &GamingArea, tile: TileId) -> Result<Arc<Window>, CompileError> {
        let rect = area.tiling.rect(tile);
        let Some(kept) = &self.kept else { return self.window(rect).map(Arc::new) };
        let slot = &kept[area.tiling.index(tile)];
        if let Some(window) = slot.get() {
            return Ok(window.clone());
        }
        let window = Arc::new(self.window(rect)?);
        Ok(slot.get_or_init(|| window).clone())
    }

    /// The ground of a tile and of `halo` posts around it, put together from the windows of its neighbours, which
    /// are kept where memory allows.
    ///
    /// # Errors
    /// When the source has no heights there.
    pub fn around(&self, area: &GamingArea, tile: TileId, halo: i32) -> Result<Window, CompileError> {
        let wide = area.tiling.rect(tile).grown(halo);
        let rect = wide.intersection(&self.rect).expect("a tile lies inside the area");
        let mut near = area.tiling.neighbours(tile);
        near.push(tile);
        if self.kept.is_none() || !near.iter().all(|&other| reaches(area.tiling.rect(other), halo)) {
            return self.window(rect);
        }
        let parts = near.iter().map(|&other| self.tile(area, other)).collect::<Result<Vec<_>, _>>()?;
        let dem = Dem::from_row_fn(rect, |row, heights| {
            for (part, cols) in
                parts.iter().filter_map(|part| overlap(part.dem.rect(), rect, row).map(|cols| (part, cols)))
            {
                let (from, to) = (cols.start - part.dem.rect().west, cols.start - rect.west);
                let part = &part.dem.row(row)[from as usize..][..cols.len()];
                heights[to as usize..][..cols.len()].copy_from_slice(part);
            }
        });
        Ok(Window { dem, importance: join_importance(&parts, rect) })
    }

    /// Residuals of load modules at the source's own posts; `None` where those are the posts of the working grid.
    pub fn residuals_at_source(&self, modules: &[terrain::LoadModule], area: &GamingArea) -> Option<Tally> {
        let Source::Raster(raster) = &self.source else { return None };
        let frame = raster.frame();
        let quanta = |metres: f64| metres * f64::from(terrain::QUANTA_PER_METRE);
        let spacing = self.frame.spacing.metres();
        let off = [frame.south_west_m[0] - self.frame.origin_east_m, frame.south_west_m[1] - self.frame.origin_north_m];
        if frame.spacing_m == [spacing; 2] && off.iter().all(|metres| (metres / spacing).fract() == 0.0) {
            return None;
        }
        let source = SourcePosts {
            window: raster.window(),
            south_west: off.map(quanta),
            step: frame.spacing_m.map(quanta),
            height_m: &|post| raster.height_m(post),
        };
        Some(residuals_at_source(modules, area.grid, self.frame.spacing, &source))
    }

    /// The ground of any rectangle of the area.
    ///
    /// # Errors
    /// When the source has no heights there.
    pub fn window(&self, rect: PostRect) -> Result<Window, CompileError> {
        let dem = match &self.source {
            Source::Sample(seed) => sample_terrain::heights(*seed, rect, self.frame.spacing),
            Source::Raster(raster) => raster.resample(&self.frame, rect)?,
        };
        let importance = mask::importance(&self.mask, self.rect, &self.frame, rect);
        let importance = mask::without_voids(importance, &dem);
        Ok(Window { dem, importance })
    }
}

/// Whether a halo never reaches beyond a tile.
fn reaches(tile: PostRect, halo: i32) -> bool {
    halo <= tile.cells_wide().min(tile.cells_high()) as i32
}

/// The columns of a row that a part holds of a whole.
fn overlap(part: PostRect, whole: PostRect, row: i32) -> Option<std::ops::Range<i32>> {
    let cut = part.intersection(&whole)?;
    (cut.south <= row && row <= cut.north).then_some(cut.west..cut.east + 1)
}

fn join_importance(parts: &[Arc<Window>], rect: PostRect) -> Importance {
    let first = parts[0].importance.uniform_weight();
    let is_plain = |part: &Arc<Window>| {
        part.importance.uniform_weight() == first
            && part.importance.classes_of_row(part.importance.rect().south).is_none()
    };
    if let Some(weight) = first
        && parts.iter().all(is_plain)
    {
        return Importance::uniform(rect, weight);
    }
    let holder = |post| parts.iter().find(|part| part.importance.rect().contains(post)).expect("parts cover the whole");
    let posts = || {
        (rect.south..=rect.north)
            .flat_map(move |row| (rect.west..=rect.east).map(move |col| terrain::Post::new(row, col)))
    };
    let weights = posts().map(|post| holder(post).importance.weight(post)).collect();
    let classes = posts().map(|post| holder(post).importance.class(post)).collect();
    Importance::new(rect, weights, classes)
}

fn void_policy(voids: Voids) -> VoidPolicy {
    match voids {
        Voids::Fail => VoidPolicy::Fail,
        Voids::FillWithinPosts(posts) => VoidPolicy::FillWithin(posts),
    }
}

fn several_sources(written: &[String], found: usize) -> CompileError {
    CompileError::Impossible {
        key: "dem.sources".into(),
        found: format!("{found} files under {}", written.join(", ")),
        expected: "one file".into(),
        hint: "several sources side by side are not supported yet; merge them with gdalbuildvrt and gdal_translate"
            .into(),
    }
}

/// Decodes what lies under the area, chunks shared among the workers.
fn read_raster(
    job: &Job,
    area: &GamingArea,
    path: &std::path::Path,
    workers: &Workers,
    stop: &AtomicBool,
) -> Result<Raster, CompileError> {
    let file = GeoTiff::open(path, None)?;
    file.frame().require_epsg(job.area.epsg)?;
    let window = window_under(file.frame(), &area.frame, area.rect)?;
    decode(&file, window, workers, stop)
}

/// Decodes a window of a raster on all workers.
pub(crate) fn decode(
    file: &GeoTiff,
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

fn open_mask(job: &Job, area: &GamingArea, records: &mut Vec<SourceRecord>) -> Result<Mask<'static>, CompileError> {
    let mut areas = Vec::new();
    for spec in &job.importance.areas {
        areas.push(mask::Area {
            class: job.importance.classes[usize::from(spec.class)].clone(),
            weight: spec.weight,
            shape: open_shape(job, area, spec, records)?,
        });
    }
    let smoothing = match job.importance.smooth {
        Smooth::Binomial7 => Smoothing::Binomial7,
        Smooth::None => Smoothing::None,
    };
    Ok(Mask { default_weight: job.importance.default_weight, areas, smoothing })
}

fn open_shape(
    job: &Job,
    area: &GamingArea,
    spec: &ImportanceArea,
    records: &mut Vec<SourceRecord>,
) -> Result<Shape<'static>, CompileError> {
    let (epsg, frame) = (job.area.epsg, area.frame);
    Ok(match &spec.shape {
        AreaShape::Polygons { file } => {
            records.push(file_record(&file.written, &file.path)?);
            Shape::Polygons(read_polygons(&file.path, epsg)?)
        }
        AreaShape::RasterValue { file, value } => {
            records.push(file_record(&file.written, &file.path)?);
            let raster = ClassRaster::read(&file.path, epsg, &frame, area.rect)?;
            // A value beyond 32 bits is in no class raster.
            let value = i32::try_from(*value).ok();
            Shape::Members(Box::new(move |rect| match value {
                Some(value) => raster.members(&frame, rect, value),
                None => vec![false; rect.post_count()],
            }))
        }
        AreaShape::Sample(job::SampleClass::Mountains) => {
            let seed = match &job.dem.source {
                DemSource::Sample { seed } => *seed,
                DemSource::Files { .. } => sample_terrain::DEFAULT_SEED,
            };
            Shape::Members(Box::new(move |rect| {
                let classes = sample_terrain::classes(seed, rect, frame.spacing);
                classes.into_iter().map(|class| class == sample_terrain::MOUNTAIN).collect()
            }))
        }
    })
}

fn record(path: &str, content: &[u8]) -> SourceRecord {
    SourceRecord { path: path.to_owned(), blake3: Fingerprint::of_bytes(content), attribution: None }
}

fn file_record(written: &str, path: &std::path::Path) -> Result<SourceRecord, CompileError> {
    Ok(record(written, &source_files::content(path)?))
}

/// Heights that look like a sentinel nobody declared.
fn warnings(source: &Source) -> Vec<String> {
    const LOWEST_LAND_M: f64 = -450.0;
    const HIGHEST_LAND_M: f64 = 8900.0;
    let Source::Raster(raster) = source else { return Vec::new() };
    let Some((lowest, highest)) = raster.range_m() else { return Vec::new() };
    let path = raster.frame().path.display();
    let mut warnings = Vec::new();
    if lowest < LOWEST_LAND_M || HIGHEST_LAND_M < highest {
        warnings.push(format!(
            "{path}: heights run from {lowest} m to {highest} m, beyond any land on Earth; \
             a void marker without a nodata tag would look like that"
        ));
    }
    if raster.frame().epsg == 3857 {
        warnings.push(format!("{path}: EPSG:3857 metres are not ground metres away from the equator"));
    }
    warnings
}
