//! The ground of a job: windows of heights and weights on demand.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

use database::SourceRecord;
use fidelity::{SourcePosts, Tally, residuals_at_source};
use job::{AreaShape, DemSource, ImportanceArea, Job, Smooth};
use mask::{Mask, Shape, Smoothing};
use schedule::Workers;
use source_files::{ClassRaster, Patch, VoidSummary, read_polygons};
use terrain::{Dem, GridFrame, Importance, PostRect, TileId};

use crate::area::GamingArea;
use crate::given::{GamingAreaFrame, Given, GivenPost};
use crate::sources::{Census, Opened, Source, file_record, record};
use crate::{CompileError, Stage, sources};

/// Posts of an area up to which the windows of tiles are kept between stages (7 bytes a post).
const KEPT_POSTS_MAX: usize = 16 << 20;

/// Where heights and weights come from.
pub(crate) struct Ground {
    source: Source,
    mask: Mask<'static>,
    rect: PostRect,
    frame: GridFrame,
    kept: Option<Vec<OnceLock<Arc<Window>>>>,
    /// Points that the job gives.
    pub given: Given,
    /// Voids of the source under the area.
    pub voids: VoidSummary,
    /// Vertical accuracy of the least accurate source that states one, in metres.
    pub accuracy_m: Option<f64>,
    /// For the manifest.
    pub records: Vec<SourceRecord>,
    /// What a person should know about the sources.
    pub warnings: Vec<String>,
}

/// The ground of a rectangle of posts.
pub(crate) struct Window {
    pub dem: Dem,
    pub importance: Importance,
    /// Posts that the job gives, of a tile's own window; none of any other.
    pub given: Vec<GivenPost>,
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
        let opened = match &job.dem.source {
            DemSource::Sample { seed } => Opened {
                source: Source::Sample(*seed),
                voids: VoidSummary::default(),
                records: vec![record(&format!("sample seed={seed}"), &seed.to_le_bytes())],
                warnings: Vec::new(),
                accuracy_m: None,
            },
            DemSource::Files { files, .. } => sources::open(job, area, files, workers, stop)?,
        };
        let Opened { source, voids, mut records, warnings, accuracy_m } = opened;
        let mask = open_mask(job, area, &mut records)?;
        let keep = area.rect.post_count() <= KEPT_POSTS_MAX;
        let kept = keep.then(|| area.tiles.iter().map(|_| OnceLock::new()).collect());
        let (rect, frame, given) = (area.rect, area.frame, Given::open(job, area, &mut records)?);
        let mut ground = Self { source, mask, rect, frame, kept, given, voids, records, warnings, accuracy_m };
        if let Source::Mosaic(_) = ground.source {
            ground.take_census(job, area, workers, stop)?;
        }
        Ok(ground)
    }

    /// Looks at every post of a mosaic once, and judges what is missing.
    fn take_census(
        &mut self,
        job: &Job,
        area: &GamingArea,
        workers: &Workers,
        stop: &AtomicBool,
    ) -> Result<(), CompileError> {
        let of_tile = |_: usize, &tile: &TileId| -> Result<Census, CompileError> {
            let Source::Mosaic(mosaic) = &self.source else { return Ok(Census::new()) };
            let patch = mosaic.resample(area.tiling.rect(tile));
            let census = Census::of(&patch, area.rect);
            if let Some(kept) = &self.kept {
                let window = Arc::new(self.with_given(area, tile, self.with_importance(patch))?);
                kept[area.tiling.index(tile)].get_or_init(|| window);
            }
            Ok(census)
        };
        let parts = schedule::for_each_independent(&area.tiles, workers, stop, of_tile)
            .map_err(|error| CompileError::from_schedule(Stage::Read, &area.tiles, error))?;
        let mut census = Census::new();
        parts.iter().for_each(|part| census.add(part));
        self.voids = census.judge(job, area)?;
        if 0 < census.gap {
            let (gap, of) = (census.gap, area.rect.post_count());
            let map = census.map();
            self.warnings.push(format!("no source reaches {gap} of {of} posts, which are holes (north is up):\n{map}"));
        }
        Ok(())
    }

    fn with_importance(&self, patch: Patch) -> Window {
        let dem = patch.dem();
        let importance = self.weights(&dem);
        Window { dem, importance, given: Vec::new() }
    }

    /// Weights and classes as the job and its pins have them.
    fn weights(&self, dem: &Dem) -> Importance {
        let importance = mask::importance(&self.mask, self.rect, &self.frame, dem.rect());
        let place = GamingAreaFrame { rect: self.rect, frame: self.frame };
        mask::without_voids(self.given.weigh(importance, &place), dem)
    }

    fn with_given(&self, area: &GamingArea, tile: TileId, window: Window) -> Result<Window, CompileError> {
        Ok(Window { given: self.given.of_tile(area, tile, &window.dem)?, ..window })
    }

    /// The ground of one tile, made once where memory allows.
    ///
    /// # Errors
    /// When the source has no heights there.
    pub fn tile(&self, area: &GamingArea, tile: TileId) -> Result<Arc<Window>, CompileError> {
        let rect = area.tiling.rect(tile);
        let fresh = || self.with_given(area, tile, self.window(rect)?).map(Arc::new);
        let Some(kept) = &self.kept else { return fresh() };
        let slot = &kept[area.tiling.index(tile)];
        if let Some(window) = slot.get() {
            return Ok(window.clone());
        }
        let window = fresh()?;
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
        Ok(Window { dem, importance: join_importance(&parts, rect), given: Vec::new() })
    }

    /// Whether the source has posts of its own to measure at: several sources have none in common.
    pub fn has_source_posts(&self) -> bool {
        !matches!(self.source, Source::Mosaic(_))
    }

    /// Residuals of load modules at the source's own posts; `None` where those are the posts of the working grid.
    pub fn residuals_at_source(&self, modules: &[terrain::LoadModule], area: &GamingArea) -> Option<Tally> {
        let Source::Raster(raster) = &self.source else { return None };
        let frame = raster.frame();
        let quanta = |metres: f64| metres * f64::from(terrain::QUANTA_PER_METRE);
        let spacing = self.frame.spacing.metres();
        let off = [frame.south_west[0] - self.frame.origin_east_m, frame.south_west[1] - self.frame.origin_north_m];
        if frame.spacing == [spacing; 2] && off.iter().all(|metres| (metres / spacing).fract() == 0.0) {
            return None;
        }
        let source = SourcePosts {
            window: raster.window(),
            south_west: off.map(quanta),
            step: frame.spacing.map(quanta),
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
            Source::Mosaic(mosaic) => return Ok(self.with_importance(mosaic.resample(rect))),
        };
        let importance = self.weights(&dem);
        Ok(Window { dem, importance, given: Vec::new() })
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
