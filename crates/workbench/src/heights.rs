//! The heights of one raster without a job: its own posts where they are square and in metres, else those of the grid
//! that `init` would choose for it.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use compiler::{CompileError, Event, Progress, Stage};
use ground::{decode, warnings_of};
use schedule::Workers;
use source_files::{DemFile, Mosaic, MosaicRules, MosaicVoids, Raster, RasterFrame, Reading, VoidPolicy};
use terrain::{Dem, Post, PostRect, Resampling, TileId};

use crate::suiting::{SuitingGrid, suiting_grid};

/// Rows that are resampled at once.
const BAND_ROWS: i32 = 256;

/// A raster's heights, and where they lie.
pub(crate) struct Heights {
    pub dem: Arc<Dem>,
    pub frame: RasterFrame,
    /// What a person should know about them, and what was done to have them.
    pub notes: Vec<String>,
}

impl Heights {
    /// Those of all of a raster; what was done to it is told.
    ///
    /// # Errors
    /// When it cannot be read, or no grid suits it.
    pub fn read(
        path: &Path,
        workers: usize,
        stop: &AtomicBool,
        progress: &mut dyn Progress,
    ) -> Result<Self, CompileError> {
        progress.tell(Event::Enter(Stage::Read, 0));
        let file = DemFile::open(path, &Reading::AS_IT_SAYS)?;
        let heights = Self::of(&file, &Workers::new(workers), stop)?;
        progress.tell(Event::Leave(Stage::Read));
        heights.notes.iter().for_each(|note| progress.tell(Event::Note(note.clone())));
        Ok(heights)
    }

    /// Those of a raster that is open.
    ///
    /// # Errors
    /// When it cannot be decoded, or no grid suits it.
    pub fn of(file: &DemFile, workers: &Workers, stop: &AtomicBool) -> Result<Self, CompileError> {
        if has_square_posts(file.frame()) {
            return Self::as_they_are(decode(file, file.rect(), workers, stop)?);
        }
        let suiting = suiting_grid(file.frame())?;
        let window = file.window_reaching(&suiting.crs, &suiting.grid, suiting.rect).unwrap_or(file.rect());
        resampled(decode(file, window, workers, stop)?, &suiting, workers, stop)
    }

    /// Those of a whole raster in memory.
    ///
    /// # Errors
    /// When they are all void, or no grid suits it.
    pub fn of_raster(raster: Raster, workers: &Workers, stop: &AtomicBool) -> Result<Self, CompileError> {
        if has_square_posts(raster.frame()) {
            return Self::as_they_are(raster);
        }
        let suiting = suiting_grid(raster.frame())?;
        resampled(raster, &suiting, workers, stop)
    }

    /// A raster's own posts.
    fn as_they_are(mut raster: Raster) -> Result<Self, CompileError> {
        let notes = warnings_of(raster.frame(), raster.range_m(), raster.notes());
        raster.settle_voids(VoidPolicy::Hole)?;
        Ok(Self { dem: Arc::new(raster.dem()), frame: raster.frame().clone(), notes })
    }
}

/// Whether the posts of a raster are as far apart to the east as to the north, in metres.
pub(crate) fn has_square_posts(frame: &RasterFrame) -> bool {
    let [east, north] = frame.spacing;
    frame.require_metres().is_ok() && (east - north).abs() <= 1e-6 * east
}

/// Heights on another grid, by the code that projects the sources of a job.
fn resampled(
    raster: Raster,
    suiting: &SuitingGrid,
    workers: &Workers,
    stop: &AtomicBool,
) -> Result<Heights, CompileError> {
    let SuitingGrid { crs, grid, rect } = suiting;
    let own = raster.frame().clone();
    let mut notes = warnings_of(&own, raster.range_m(), raster.notes());
    let voids = MosaicVoids { next_source: false, fill_within: 0 };
    let rules = MosaicRules { resampling: Resampling::Bilinear, feather_m: 0.0, voids };
    let mosaic = Mosaic::new(vec![raster], rules, crs, grid, *rect)?;
    let bands: Vec<PostRect> = (rect.south..=rect.north)
        .step_by(BAND_ROWS as usize)
        .map(|south| PostRect { south, north: (south + BAND_ROWS - 1).min(rect.north), ..*rect })
        .collect();
    let parts = schedule::for_each_independent(&bands, workers, stop, |_, &band| -> Result<Dem, CompileError> {
        Ok(mosaic.resample(band).dem())
    });
    let nowhere = vec![TileId { row: 0, col: 0 }; bands.len()];
    let parts = parts.map_err(|error| CompileError::from_schedule(Stage::Read, &nowhere, error))?;
    let part = |post: Post| &parts[((post.row - rect.south) / BAND_ROWS) as usize];
    let mut dem = Dem::from_fn(*rect, |post| (!part(post).is_void(post)).then(|| part(post).height(post)));
    dem.fill_voids(|post| part(post).height(post));
    let spacing = grid.spacing.metres();
    let frame = RasterFrame {
        path: own.path.clone(),
        crs: crs.clone(),
        south_west: [grid.origin_east_m, grid.origin_north_m],
        spacing: [spacing; 2],
        cols: rect.posts_wide() as u32,
        rows: rect.posts_high() as u32,
    };
    notes.push(format!(
        "{}: resampled from {} to {} x {} posts {spacing} m apart in {}",
        frame.path.display(),
        posts_text(&own),
        frame.cols,
        frame.rows,
        frame.crs.name(),
    ));
    Ok(Heights { dem: Arc::new(dem), frame, notes })
}

/// How far the posts of a raster are apart.
fn posts_text(frame: &RasterFrame) -> String {
    let of_degree = if frame.crs.is_geographic() { 3600.0 } else { frame.crs.unit_m().unwrap_or(1.0) };
    let [east, north] = frame.spacing.map(|step| (step * of_degree * 1000.0).round() / 1000.0);
    let unit = if frame.crs.is_geographic() { "seconds" } else { "m" };
    format!("posts {east} x {north} {unit} apart")
}
