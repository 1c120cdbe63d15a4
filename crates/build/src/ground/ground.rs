//! The ground of a job: windows of heights and weights on demand.

use std::num::NonZeroUsize;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use job::{DemSource, Job, Sight};
use lru::LruCache;
use schedule::Workers;
use source_files::{VoidSummary, read_polygons};
use store::Folder;
use terrain::mask::{Mask, Surroundings};
use terrain::{Dem, GridFrame, HOLE_CLASS, Post, PostRect, Spacing, TileFeatures, TileId};

use crate::ground::area::{GamingArea, stretched};
use crate::ground::burn::burn;
use crate::ground::census::Census;
use crate::ground::excluded::GamingAreaFrame;
use crate::ground::given::{Given, GivenPost};
use crate::ground::large::WHOLE_BYTES_MAX;
use crate::ground::mask_of::{Fault, Opening};
use crate::ground::relief::{Bounds, Relief};
use crate::ground::source::Source;
use crate::ground::sources::Opened;
use crate::ground::water::{Soundings, Water};
use crate::ground::window::Window;
use crate::ground::{GroundError, sources, water};

/// Posts of an area up to which the windows of tiles are kept between stages (7 bytes a post).
pub const KEPT_POSTS_MAX: usize = 16 << 20;

/// Where heights and weights come from.
pub struct Ground {
    /// Heights before any weight.
    pub relief: Arc<Relief>,
    mask: Mask<'static>,
    /// What went wrong in a part of the mask that reads files or heights on demand.
    fault: Fault,
    rect: PostRect,
    frame: GridFrame,
    kept: Option<Vec<OnceLock<Arc<Window>>>>,
    lines: OnceLock<Lines>,
    /// What heights of the sources under the area lie within, as far as its own posts need them.
    under: Option<Bounds>,
    /// Points that the job gives.
    pub given: Given,
    /// Voids of the source under the area.
    pub voids: VoidSummary,
    /// Vertical accuracy of the least accurate source that states one, in metres.
    pub accuracy_m: Option<f64>,
    /// What a person should know about the sources.
    pub warnings: Vec<String>,
}

impl Ground {
    /// Opens and judges everything the job names.
    ///
    /// # Errors
    /// When a file cannot be used for this area.
    pub fn open(job: &Job, area: &GamingArea, workers: &Workers, stop: &AtomicBool) -> Result<Self, GroundError> {
        Self::open_within(job, area, (workers, stop), WHOLE_BYTES_MAX)
    }

    /// The ground of a finished database in `folder`, with the features that it has burned in.
    ///
    /// # Errors
    /// As [`Ground::open`].
    pub fn open_built(
        job: &Job,
        area: &GamingArea,
        (workers, stop): (&Workers, &AtomicBool),
        folder: &Folder,
    ) -> Result<Self, GroundError> {
        let ground = Self::open(job, area, workers, stop)?;
        if let Some(spec) = &job.features {
            ground.burn_in(folder, area, spec.left_out_weight);
        }
        Ok(ground)
    }

    /// The same, where rasters that take more than `whole_bytes_max` bytes are read by window.
    pub fn open_within(
        job: &Job,
        area: &GamingArea,
        (workers, stop): (&Workers, &AtomicBool),
        whole_bytes_max: u64,
    ) -> Result<Self, GroundError> {
        let opened = match &job.dem.source {
            DemSource::Sample { seed } => Opened {
                source: Source::Sample(*seed),
                voids: VoidSummary::default(),
                warnings: Vec::new(),
                accuracy_m: None,
                range_m: None,
                under_m: None,
            },
            DemSource::Files { files, .. } => sources::open(job, area, files, workers, stop, whole_bytes_max)?,
        };
        let Opened { source, voids, mut warnings, accuracy_m, range_m, under_m } = opened;
        let bounds = range_m.map(Bounds::of_metres);
        warnings.extend(stretched(job.area.epsg, area));
        let mut relief = Relief { source, frame: area.frame, water: None, bounds };
        let polygons = match &job.dem.water {
            None => Vec::new(),
            Some(water) => {
                let polygons = read_polygons(&water.file.path, job.area.epsg)?;
                relief.water = Some(Water::new(job, polygons.clone(), area.frame, area.rect));
                if !relief.water.as_ref().is_some_and(|water| water.reaches(area.rect)) {
                    let path = water.file.path.display();
                    warnings.push(format!("dem.water: {path}: none of its polygons reaches into the area"));
                }
                warnings.extend(find_levels(&mut relief, area, workers, stop)?);
                polygons
            }
        };
        let (relief, fault) = (Arc::new(relief), Fault::default());
        let mask = Opening { job, area, relief: &relief, fault: &fault }.mask(polygons)?;
        let keep = area.rect.post_count() <= KEPT_POSTS_MAX;
        let kept = keep.then(|| area.tiles.iter().map(|_| OnceLock::new()).collect());
        let (rect, frame, given) = (area.rect, area.frame, Given::open(job, area)?);
        warnings.extend(given.far_off(area, &relief)?);
        let lines = OnceLock::new();
        let under = under_m.map(Bounds::of_metres);
        let mut ground =
            Self { relief, mask, fault, rect, frame, kept, lines, under, given, voids, warnings, accuracy_m };
        // One raster knows of its own posts alone what is void.
        if !ground.relief.is_single() || 0 < ground.voids.left {
            ground.take_census(job, area, workers, stop)?;
        }
        Ok(ground)
    }

    /// Looks at every post of the area once, and judges what is missing.
    fn take_census(
        &mut self,
        job: &Job,
        area: &GamingArea,
        workers: &Workers,
        stop: &AtomicBool,
    ) -> Result<(), GroundError> {
        let of_tile = |_: usize, &tile: &TileId| -> Result<Census, GroundError> {
            let rect = area.tiling.rect(tile);
            let Some(patch) = self.relief.patch(rect)? else {
                return Ok(Census::of_dem(&self.relief.dem(rect)?, area.rect));
            };
            let census = Census::of(&patch, area.rect);
            if let Some(kept) = &self.kept {
                let window = Arc::new(self.with_given(area, tile, self.with_importance(patch.dem())?)?);
                kept[area.tiling.index(tile)].get_or_init(|| window);
            }
            Ok(census)
        };
        let mut census = Census::new();
        // A census is some kilobytes, so those of a large area are added up as they come.
        for tiles in area.tiles.chunks(1 << 10) {
            let parts = schedule::for_each_independent(tiles, workers, stop, of_tile)
                .map_err(|error| GroundError::from_schedule(tiles, error))?;
            parts.iter().for_each(|part| census.add(part));
        }
        self.voids = census.judge(job, area)?;
        if 0 < census.gap {
            let (gap, of) = (census.gap, area.rect.post_count());
            let map = census.map();
            self.warnings.push(format!("no source reaches {gap} of {of} posts, which are holes (north is up):\n{map}"));
        }
        Ok(())
    }

    /// Weights and classes as the job and its pins have them.
    fn with_importance(&self, dem: Dem) -> Result<Window, GroundError> {
        let importance = terrain::mask::importance(&self.mask, self.rect, &self.frame, dem.rect());
        self.fault.take()?;
        let place = GamingAreaFrame { rect: self.rect, frame: self.frame };
        let importance = terrain::mask::without_voids(self.given.weigh(importance, &place), &dem);
        Ok(Window::of(dem, importance))
    }

    fn with_given(&self, area: &GamingArea, tile: TileId, window: Window) -> Result<Window, GroundError> {
        let mut given = self.given.of_tile(area, tile, &window.dem)?;
        // An area meets its neighbour at its outer border, whatever crosses it.
        let is_decided = |post: &GivenPost| !post.outer && window.decided.binary_search(&post.at).is_ok();
        given.iter_mut().filter(|post| is_decided(post)).for_each(|post| post.height = None);
        let place = GamingAreaFrame { rect: self.rect, frame: self.frame };
        Ok(Window { given, forbidden: self.given.forbidden(&place, area.tiling.rect(tile)), ..window })
    }

    /// What a person should know of heights that a job gives on its roads and in its water, which are not taken; the
    /// classes of `names`.
    ///
    /// # Errors
    /// When the source has no heights there, or features cannot be read.
    pub fn given_on_features(&self, area: &GamingArea, names: &[String]) -> Result<Option<String>, GroundError> {
        let classes_at = |tile: TileId, posts: &[Post]| -> Result<Vec<Option<u8>>, GroundError> {
            let window = self.tile(area, tile)?;
            let is_decided = |post: &Post| window.decided.binary_search(post).is_ok();
            Ok(posts.iter().map(|post| is_decided(post).then(|| window.importance.class(*post))).collect())
        };
        if self.lines.get().is_none() { Ok(None) } else { self.given.on_features(area, names, classes_at) }
    }

    /// What heights lie within: those of the sources, and what the job says itself of water.
    pub fn bounds(&self) -> Option<Bounds> {
        let levels = self.relief.water.iter().flat_map(Water::levels_known);
        self.under.map(|bounds| levels.fold(bounds, Bounds::and))
    }

    /// Points that the job gives on a fixed outer border of the area.
    pub fn given_outer_posts(&self) -> impl Iterator<Item = Post> {
        self.given.outer_posts()
    }

    /// From now on, features are burned into every window but natural ones, as `folder` has them. Posts on those that
    /// had no room weigh `left_out_weight` times what they otherwise would.
    pub fn burn_in(&self, folder: &Folder, area: &GamingArea, left_out_weight: f64) {
        self.lines.get_or_init(|| Lines::new(folder, area, left_out_weight, self.kept.is_some()));
    }

    /// What features put into a tile; nothing before they are burned in.
    ///
    /// # Errors
    /// When the file that says it cannot be read.
    pub fn features(&self, tile: TileId) -> Result<Arc<TileFeatures>, GroundError> {
        self.lines.get().map_or_else(|| Ok(Arc::new(TileFeatures::none(tile))), |lines| lines.features(tile))
    }

    /// The ground of one tile, made once where memory allows: natural, with features burned in if there are any.
    ///
    /// # Errors
    /// When the source has no heights there, or features cannot be read.
    pub fn tile(&self, area: &GamingArea, tile: TileId) -> Result<Arc<Window>, GroundError> {
        let Some(lines) = self.lines.get() else { return self.natural_tile(area, tile) };
        kept_or(lines.kept(area.tiling.index(tile)), || {
            // Points that the job gives are looked up in what they are given for.
            let natural = Window::clone(&*self.natural_tile(area, tile)?);
            let window = lines.burn_tile(natural, tile)?;
            self.with_given(area, tile, window)
        })
    }

    /// The same without features.
    ///
    /// # Errors
    /// When the source has no heights there.
    pub fn natural_tile(&self, area: &GamingArea, tile: TileId) -> Result<Arc<Window>, GroundError> {
        let slot = self.kept.as_ref().map(|kept| &kept[area.tiling.index(tile)]);
        kept_or(slot, || self.with_given(area, tile, self.natural(area.tiling.rect(tile))?))
    }

    /// The ground of a tile, with features burned in if there are any, where a stage has made it and it is kept.
    pub fn made(&self, area: &GamingArea, tile: TileId) -> Option<Arc<Window>> {
        let index = area.tiling.index(tile);
        let natural = || self.kept.as_ref().map(|kept| &kept[index]);
        self.lines.get().map_or_else(natural, |lines| lines.kept(index))?.get().cloned()
    }

    /// Keeps windows without features no longer where there are such with them.
    pub fn forget_natural(&mut self) {
        if self.lines.get().is_some() {
            self.kept = None;
        }
    }

    /// The ground of a tile and of `halo` posts around it, put together from the windows of its neighbours, which
    /// are kept where memory allows.
    ///
    /// # Errors
    /// When the source has no heights there.
    pub fn around(&self, area: &GamingArea, tile: TileId, halo: i32) -> Result<Window, GroundError> {
        let wide = area.tiling.rect(tile).grown(halo);
        let rect = wide.intersection(&self.rect).expect("a tile lies inside the area");
        let mut near = area.tiling.neighbours(tile);
        near.push(tile);
        if self.kept.is_none() || !near.iter().all(|&other| reaches(area.tiling.rect(other), halo)) {
            return self.window(rect);
        }
        let parts = near.iter().map(|&other| self.tile(area, other)).collect::<Result<Vec<_>, _>>()?;
        Ok(Window::joined(rect, &parts.iter().map(|part| &**part).collect::<Vec<_>>()))
    }

    /// The ground of any rectangle of the area, with features burned in if there are any.
    ///
    /// # Errors
    /// When the source has no heights there, or features cannot be read.
    pub fn window(&self, rect: PostRect) -> Result<Window, GroundError> {
        let natural = self.natural(rect)?;
        match self.lines.get() {
            Some(lines) => lines.burn(&natural),
            None => Ok(natural),
        }
    }

    /// The ground of any rectangle of the area without features.
    ///
    /// # Errors
    /// When the source has no heights there.
    pub fn natural(&self, rect: PostRect) -> Result<Window, GroundError> {
        self.with_importance(self.relief.dem(rect)?)
    }
}

/// What a slot holds, made if it is empty; made each time where there is no slot.
pub(crate) fn kept_or(
    slot: Option<&OnceLock<Arc<Window>>>,
    make: impl FnOnce() -> Result<Window, GroundError>,
) -> Result<Arc<Window>, GroundError> {
    let Some(slot) = slot else { return make().map(Arc::new) };
    if let Some(window) = slot.get() {
        return Ok(window.clone());
    }
    let window = Arc::new(make()?);
    Ok(slot.get_or_init(|| window).clone())
}

/// Whether a halo never reaches beyond a tile.
fn reaches(tile: PostRect, halo: i32) -> bool {
    halo <= tile.cells_wide().min(tile.cells_high()) as i32
}

/// Finds the level of each body of water from the heights of all tiles; what a person should know about it.
fn find_levels(
    relief: &mut Relief,
    area: &GamingArea,
    workers: &Workers,
    stop: &AtomicBool,
) -> Result<Vec<String>, GroundError> {
    let Some(water) = &relief.water else { return Ok(Vec::new()) };
    let tiles: Vec<TileId> = area.tiles.iter().copied().filter(|&tile| water.reaches(area.tiling.rect(tile))).collect();
    let mut all = Soundings::new();
    for tiles in tiles.chunks(1 << 10) {
        let sound = |_: usize, &tile: &TileId| -> Result<Soundings, GroundError> {
            Ok(water.sound(&relief.dry(area.tiling.rect(tile))?, area.rect))
        };
        let parts = schedule::for_each_independent(tiles, workers, stop, sound)
            .map_err(|error| GroundError::from_schedule(tiles, error))?;
        parts.into_iter().for_each(|part| water::add(&mut all, part));
    }
    let Some(water) = &mut relief.water else { return Ok(Vec::new()) };
    let without = water.level(&all);
    let told = || format!("{without} bodies of water hold no post with a height and are left as they are");
    Ok((0 < without).then(told).into_iter().chain(water.misfit(&all)).collect())
}

/// Eyes and their range as the scan counts them.
pub fn scanned(sight: Sight, metres_per_post: f64) -> terrain::mask::Sight {
    let quanta_per_post = metres_per_post * f64::from(terrain::QUANTA_PER_METRE);
    terrain::mask::Sight::new(sight.eyes_quanta, f64::from(sight.range_quanta) / quanta_per_post, metres_per_post)
}

impl Ground {
    /// A tile's ground and what lies within sight of it.
    ///
    /// # Errors
    /// As [`Ground::around`].
    pub fn within_sight(
        &self,
        area: &GamingArea,
        tile: TileId,
        sight: &terrain::mask::Sight,
    ) -> Result<Surroundings, GroundError> {
        let wide = self.around(area, tile, sight.halo())?;
        // Voids are filled from whatever window they are read with.
        let height = |post| (wide.importance.class(post) != HOLE_CLASS).then(|| wide.dem.height(post));
        Ok(Surroundings::new(wide.dem.rect(), height))
    }
}

/// Tiles whose features are kept in memory at most.
const TILES_MAX: NonZeroUsize = NonZeroUsize::new(64).expect("64 is not 0");

/// Where what features put into tiles is read from.
struct Lines {
    folder: Folder,
    tiles: Vec<(TileId, PostRect)>,
    spacing: Spacing,
    /// Times that posts on features weigh which are not in the TIN.
    left_out_weight: f64,
    read: Mutex<LruCache<TileId, Arc<TileFeatures>>>,
    windows: Option<Vec<OnceLock<Arc<Window>>>>,
}

impl Lines {
    /// Of the tiles of `area`; `keeps` says whether windows of tiles are kept.
    pub fn new(folder: &Folder, area: &GamingArea, left_out_weight: f64, keeps: bool) -> Self {
        let tiles: Vec<_> = area.tiles.iter().map(|&tile| (tile, area.tiling.rect(tile))).collect();
        let windows = keeps.then(|| tiles.iter().map(|_| OnceLock::new()).collect());
        let (folder, spacing) = (folder.clone(), area.frame.spacing);
        Self { folder, tiles, spacing, left_out_weight, read: Mutex::new(LruCache::new(TILES_MAX)), windows }
    }

    /// Where the window of a tile is kept.
    pub fn kept(&self, index: usize) -> Option<&OnceLock<Arc<Window>>> {
        self.windows.as_ref().map(|windows| &windows[index])
    }

    /// What features put into a tile.
    pub fn features(&self, tile: TileId) -> Result<Arc<TileFeatures>, GroundError> {
        let known = || self.read.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(features) = known().get(&tile) {
            return Ok(features.clone());
        }
        let (_, read) = self.folder.read_lines(tile)?;
        let read = Arc::new(read);
        known().put(tile, read.clone());
        Ok(read)
    }

    /// The window of a tile with its features; its neighbours add nothing that it does not have.
    pub fn burn_tile(&self, window: Window, tile: TileId) -> Result<Window, GroundError> {
        Ok(burn(window, &*self.features(tile)?, (self.spacing, self.left_out_weight)))
    }

    /// A window with the features of all tiles that it touches. What lies on a line between tiles is burned from the
    /// natural ground by each, and the same by all.
    pub fn burn(&self, window: &Window) -> Result<Window, GroundError> {
        let rect = window.dem.rect();
        let touched = self.tiles.iter().filter_map(|(tile, of)| Some((*tile, of.intersection(&rect)?)));
        let part = |(tile, of)| self.burn_tile(Window::of(window.dem.window(of), window.importance.window(of)), tile);
        let parts = touched.map(part).collect::<Result<Vec<_>, _>>()?;
        Ok(Window::joined(rect, &parts.iter().collect::<Vec<_>>()))
    }
}

#[cfg(test)]
mod tests;
