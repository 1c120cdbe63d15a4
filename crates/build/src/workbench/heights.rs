//! The heights of one raster without a job: its own posts where they are square and in metres, else those of the grid
//! that `init` would choose for it.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::ground::{GroundError, decode, warnings_of};
use crate::{CompileError, Event, Progress, Stage};
use schedule::Workers;
use source_files::{
    Crs, DemFile, Mosaic, MosaicRules, MosaicVoids, Raster, RasterFrame, Reading, SourceError, VoidPolicy,
};
use terrain::{Dem, Post, PostRect, Resampling};

use crate::workbench::suiting::{SuitingGrid, suiting_grid};

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
    /// Those of all of a raster, in the system `crs` where it names none; what was done to it is told. `fits` is asked
    /// for its posts before the first of them is read: a raster of a few kilobytes may have thousands of millions.
    ///
    /// # Errors
    /// When it cannot be read, no grid suits it, or it does not fit.
    pub fn read(
        (path, crs): (&Path, Option<&str>),
        fits: &dyn Fn(PostRect) -> Result<(), CompileError>,
        workers: usize,
        stop: &AtomicBool,
        progress: &mut dyn Progress,
    ) -> Result<Self, CompileError> {
        progress.tell(Event::Enter(Stage::Read, 0));
        let (file, note) = open_alone(path, crs)?;
        fits(rect_of(&file)?)?;
        let mut heights = Self::of(&file, &Workers::new(workers), stop)?;
        progress.tell(Event::Leave(Stage::Read));
        heights.notes.splice(0..0, note);
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

/// The posts that a mesh of a raster stands on.
fn rect_of(file: &DemFile) -> Result<PostRect, CompileError> {
    match has_square_posts(file.frame()) {
        true => Ok(file.rect()),
        false => Ok(suiting_grid(file.frame())?.rect),
    }
}

/// Opens a raster without a job, in the system `given` where it names none that can be computed. Where nothing names
/// one, its posts are taken to lie in a plane of metres, which a note tells.
///
/// # Errors
/// When it cannot be read, or `given` is no system; also when nothing names a system and places look like degrees.
pub(crate) fn open_alone(path: &Path, given: Option<&str>) -> Result<(DemFile, Option<String>), CompileError> {
    match (DemFile::open(path, &Reading::AS_IT_SAYS), given) {
        (Ok(file), _) => Ok((file, None)),
        (Err(SourceError::NoCrs { .. } | SourceError::UnnamedCrs { .. }), Some(given)) => {
            Ok((DemFile::open(path, &in_system(crs_named(given)?))?, None))
        }
        (Err(error @ SourceError::NoCrs { .. }), None) => {
            let file = DemFile::open(path, &in_system(Crs::plane()))?;
            if might_be_degrees(file.frame()) {
                return Err(error.into());
            }
            let text = "no coordinate system: its posts are taken as metres in a plane; --crs names one";
            Ok((file, Some(format!("{}: {text}", path.display()))))
        }
        (Err(error), _) => Err(error.into()),
    }
}

fn in_system(crs: Crs) -> Reading {
    Reading { crs: Some(crs), ..Reading::AS_IT_SAYS }
}

/// The system of an argument `--crs`.
///
/// # Errors
/// When it cannot be computed.
pub(crate) fn crs_named(given: &str) -> Result<Crs, CompileError> {
    let impossible = |found| GroundError::Impossible {
        key: "--crs".into(),
        found: format!("{given}: {found}"),
        expected: "a system that can be computed".into(),
        hint: "for example --crs EPSG:32611".into(),
    };
    Crs::named(given).map_err(|found| impossible(found).into())
}

/// Whether every post lies within the degrees of the Earth, and others no farther than a tenth of one.
fn might_be_degrees(frame: &RasterFrame) -> bool {
    let ([west, south], [east, north]) = (frame.south_west, frame.place(frame.rows - 1, frame.cols - 1));
    let is_near = frame.spacing.iter().all(|step| *step <= 0.1);
    is_near && -360.0 <= west && east <= 360.0 && -90.0 <= south && north <= 90.0
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
    let parts = parts.map_err(|error| CompileError::from_schedule(Stage::Read, &[], error))?;
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
