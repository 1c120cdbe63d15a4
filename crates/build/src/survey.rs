//! Survey and allocation: what would each tile gain, and what may it therefore spend.
//!
//! In haste a tile is seen on every second post: a quarter of the ground to look at, for a survey that only has to tell
//! how tiles compare.

use std::sync::{Mutex, PoisonError};

use job::{Budget as PointBudget, Edges};
use store::TileBudget;
use store::engine::{Artifact, Key, Outcome, Stamp, keep_or_make};
use terrain::{GainCurve, Importance, ModuleGrid, ModuleId, Post, PostRect, TileId};
use tin::tiling::{Gains, allocate_equally, allocate_globally, points_equally, points_globally};
use tin::{Frame, SurveyTask, TileTask};

use crate::curves::{Curves, Profile};
use crate::ground::Window;
use crate::refinement::{evened, give, optimising};
use crate::run::{ALGORITHM_REVISION, Run};
use crate::tasks::{is_surveyed, is_surveyed_in_haste, survey_task};
use crate::{CompileError, Event, Progress, Stage, keys};

/// What the area's budget came to.
pub(crate) struct Shares {
    /// One budget per tile, row-major.
    pub tiles: Vec<TileBudget>,
    /// Rung of the ladder down to which gains are taken, where triangles are shared out by them.
    pub threshold_bin: Option<i32>,
    /// Triangles that no tile was given: the next rung did not fit. In clip mode they are counted after the clip.
    pub slack: u64,
    /// Load modules that were granted more than the limit, with the triangles granted from the pool.
    pub granted: Vec<(ModuleId, u32)>,
}

impl Shares {
    /// Drops the room of every load module and window, some kilobytes a tile, once all tiles are refined.
    pub fn forget_rooms(&mut self) {
        for allowance in self.tiles.iter_mut().filter_map(|budget| budget.allowance.as_mut()) {
            (allowance.module_room, allowance.window_room) = (Vec::new(), Vec::new());
        }
    }
}

/// Surveys every tile if the job asks for a global allocation.
pub(crate) fn survey<'a>(run: &'a Run, progress: &mut dyn Progress) -> Result<Option<Curves<'a>>, CompileError> {
    if !is_surveyed(run.job) {
        return Ok(None);
    }
    let profile = Mutex::new(Profile::default());
    run.for_each_tile(Stage::Survey, progress, |tile| {
        Ok(survey_tile(run, tile)?.map(|(_, curve)| {
            profile.lock().unwrap_or_else(PoisonError::into_inner).add(&curve);
        }))
    })?;
    Ok(Some(Curves::new(run, profile.into_inner().unwrap_or_else(PoisonError::into_inner))))
}

/// Surveys a tile, or keeps what is published and fresh; with the stamp of what it is made from.
pub(crate) fn survey_tile(run: &Run, tile: TileId) -> Result<Outcome<(Stamp, GainCurve)>, CompileError> {
    let features = run.tile_features(tile)?;
    let (window, mut task) = (run.window(tile)?, survey_task(run.job, &run.area, tile, &features.kept));
    let is_given = !window.given.is_empty();
    if is_given {
        give(&mut task.growth, &window.given, window.dem.rect());
    }
    let coarse = if is_surveyed_in_haste(run.job) && !is_given { coarse(&window, &task) } else { None };
    let (window, task) = match &coarse {
        Some((window, task)) => (window, task),
        None => (&*window, &task),
    };
    keep_or_make(&Surveying { run, window, task }, ALGORITHM_REVISION)
}

/// A tile's gain curve, as the engine asks for it.
struct Surveying<'a> {
    run: &'a Run<'a>,
    window: &'a Window,
    task: &'a SurveyTask,
}

impl Artifact for Surveying<'_> {
    type Output = (Stamp, GainCurve);
    type Error = CompileError;

    fn key(&self) -> Key {
        keys::curve(self.window, self.task)
    }

    fn published(&self) -> Result<Option<Stamp>, CompileError> {
        Ok(self.run.database.folder().curve_stamp(self.task.growth.tile)?)
    }

    fn read(&self, _key: &Key) -> Option<(Stamp, (Stamp, GainCurve))> {
        let read = self.run.database.folder().read_curve(self.task.growth.tile).ok()?;
        Some((read.0, read))
    }

    fn make(&self, _key: &Key, stamp: &Stamp) -> Result<(Stamp, GainCurve), CompileError> {
        let Self { run, window, task } = *self;
        // A largest residual is asked of every post alike.
        let even = (task.growth.stop.value.and(optimising(run.job))).map(|_| evened(&window.importance));
        let importance = even.as_ref().unwrap_or(&window.importance);
        let curve = tin::survey(&window.dem, importance, task, terrain::geometry::widest_level());
        run.database.write_curve(stamp, &curve)?;
        Ok((*stamp, curve))
    }
}

/// Shares out points and triangles; without curves equally, with them by one threshold.
///
/// # Errors
/// When a curve cannot be read back.
pub(crate) fn allocate(
    run: &Run,
    curves: Option<&Curves>,
    progress: &mut dyn Progress,
) -> Result<Shares, CompileError> {
    progress.tell(Event::Enter(Stage::Allocate, 0));
    let shares = shares(run, curves)?;
    progress.tell(Event::Leave(Stage::Allocate));
    Ok(shares)
}

/// A survey lets every tile choose on all its sides and so predicts a little better than tiles will do.
const RMS_MARGIN: f64 = 0.99;

/// Where the gains of an area reach the RMS residual asked for.
struct Goal {
    /// The step of the ladder down to which they are taken.
    floor: i32,
    /// The RMS residual of each tile there, in quanta.
    rms_quanta: Vec<f64>,
}

impl Goal {
    /// Where selection alone is predicted to reach the RMS residual asked for, if the job asks for one.
    fn new(run: &Run, curves: &Curves) -> Result<Option<Self>, CompileError> {
        let Some(rms_m) = run.job.tin.target_rms_m else { return Ok(None) };
        let posts: Vec<f64> =
            run.area.tiles.iter().map(|&tile| run.area.tiling.rect(tile).post_count() as f64).collect();
        let rms = rms_m * f64::from(terrain::QUANTA_PER_METRE) * RMS_MARGIN;
        let Some(floor) = curves.squares()?.floor_for(rms * rms * posts.iter().sum::<f64>()) else { return Ok(None) };
        let of_tile = |(&tile, posts): (&TileId, &f64)| Ok((curves.read(tile)?.squares_at(floor) / posts).sqrt());
        let rms_quanta = run.area.tiles.iter().zip(&posts).map(of_tile).collect::<Result<_, CompileError>>()?;
        Ok(Some(Self { floor, rms_quanta }))
    }
}

fn shares(run: &Run, curves: Option<&Curves>) -> Result<Shares, CompileError> {
    let area = &run.area;
    let by_rank = area.by_rank();
    let goal = curves.map(|curves| Goal::new(run, curves)).transpose()?.flatten();
    let floor = goal.as_ref().map(|goal| goal.floor);
    // What is optimised needs fewer points for the same residual: each tile is to come down to its part of it.
    let goal = goal.filter(|_| optimising(run.job).is_some());
    let budget = match run.job.tin.budget {
        PointBudget::Points(points) => PointBudget::Points(run.points_beside_features(points)),
        PointBudget::Limits => PointBudget::Limits,
    };
    let points: Option<Vec<usize>> = match (budget, curves) {
        (PointBudget::Points(points), None) => Some(points_equally(points, area.tiles.len())),
        (PointBudget::Points(points), Some(curves)) => {
            let mut bands = curves.bands();
            let shared = points_globally(points, Gains { bands: &mut bands, by_rank: &by_rank, floor });
            Some(bands.vouch(shared)?)
        }
        (PointBudget::Limits, _) => None,
    };
    let triangles = match (run.job.modules.edges, curves, &points) {
        (Edges::Clip(_), ..) => None,
        (Edges::Constrained, Some(curves), None) => {
            let mut bands = curves.bands();
            let gains = Gains { bands: &mut bands, by_rank: &by_rank, floor };
            let allocation = allocate_globally(&area.budget, &area.tiling, gains);
            Some(bands.vouch(allocation)?)
        }
        (Edges::Constrained, ..) => Some(allocate_equally(&area.budget, &area.tiling)),
    };
    let (allowances, threshold_bin, slack, granted) = match triangles {
        None => (vec![None; area.tiles.len()], None, 0, Vec::new()),
        Some(of) => {
            let allowances = of.shares.into_iter().map(|share| Some(share.allowance)).collect();
            (allowances, of.threshold_bin, of.slack, of.granted)
        }
    };
    let tiles = allowances.into_iter().enumerate().map(|(index, mut allowance)| {
        if let (Some(points), Some(allowance)) = (&points, &mut allowance) {
            // Every point costs the same, and all of them fit.
            allowance.triangles = points[index] as u32 * terrain::POINT_COST;
        }
        TileBudget {
            points: points.as_ref().map(|points| points[index]),
            allowance,
            rms_quanta: goal.as_ref().map(|goal| goal.rms_quanta[index]),
        }
    });
    Ok(Shares { tiles: tiles.collect(), threshold_bin, slack, granted })
}

/// The window and the survey on every second post; `None` where load modules do not begin and end on such posts.
fn coarse(window: &Window, task: &SurveyTask) -> Option<(Window, SurveyTask)> {
    let growth = &task.growth;
    let Frame::Sides { side_cells, south_west, allowance } = &growth.frame else { return None };
    if side_cells % 2 != 0 {
        return None;
    }
    // Load modules begin on even posts, so a tile does.
    let rect = growth.rect.halved();
    let frame = Frame::Sides { side_cells: side_cells / 2, south_west: *south_west, allowance: allowance.clone() };
    let (border, barred) = (half_posts(&growth.border), half_posts(&growth.barred));
    let growth = TileTask { rect, frame, border, barred, ..growth.clone() };
    let grid = ModuleGrid { side_cells: side_cells / 2, ..task.grid };
    Some((half_window(window, task.growth.rect), SurveyTask { growth, grid, ..task.clone() }))
}

/// Border points between such posts move north or east along their side.
fn half_posts(posts: &[Post]) -> Vec<Post> {
    let mut half: Vec<Post> = posts.iter().map(|post| Post::new((post.row + 1) / 2, (post.col + 1) / 2)).collect();
    half.sort_unstable();
    half.dedup();
    half
}

fn half_window(window: &Window, rect: PostRect) -> Window {
    let dem = window.dem.every_second(rect);
    let importance = match window.importance.uniform_weight() {
        Some(weight) => Importance::uniform(dem.rect(), weight),
        None => {
            let weight = |post: Post| window.importance.weight(Post::new(2 * post.row, 2 * post.col));
            Importance::new(dem.rect(), dem.rect().posts().map(weight).collect(), vec![0; dem.rect().post_count()])
        }
    };
    Window::of(dem, importance)
}
