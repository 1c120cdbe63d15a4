//! Survey and allocation: what would each tile gain, and what may it therefore spend.

use database::{FingerprintBuilder, Stamp};
use job::{Budget as PointBudget, Edges};
use terrain::{GainCurve, TileId};
use tiling::{Allocation, Gains, allocate_equally, allocate_globally, points_equally, points_globally};
use tin::SurveyTask;

use crate::coarse::coarse;
use crate::refinement::{give, optimising};
use crate::run::{Run, Worked};
use crate::tasks::{TileBudget, is_surveyed, is_surveyed_in_haste, survey_task};
use crate::{CompileError, Event, Progress, Stage};

/// What the area's budget came to.
pub(crate) struct Shares {
    /// One budget per tile, row-major.
    pub tiles: Vec<TileBudget>,
    /// How triangles were shared out; absent in clip mode, where they are counted after the clip.
    pub triangles: Option<Allocation>,
}

/// Surveys every tile if the job asks for a global allocation.
pub(crate) fn survey(run: &Run, progress: &mut dyn Progress) -> Result<Option<Vec<GainCurve>>, CompileError> {
    if !is_surveyed(run.job) {
        return Ok(None);
    }
    let curves = run.for_each_tile(Stage::Survey, progress, |tile| Ok(survey_tile(run, tile)?.1))?;
    Ok(Some(curves.into_iter().map(Worked::into_inner).collect()))
}

/// Surveys a tile, or keeps what is published and fresh; with the stamp of what it is made from.
pub(crate) fn survey_tile(run: &Run, tile: TileId) -> Result<(Stamp, Worked<GainCurve>), CompileError> {
    let (window, mut task) = (run.window(tile)?, survey_task(run.job, &run.area, tile));
    let is_given = !window.given.is_empty();
    if is_given {
        give(&mut task.growth, &window.given, window.dem.rect());
    }
    let coarse = if is_surveyed_in_haste(run.job) && !is_given { coarse(&window, &task) } else { None };
    let (window, task) = match &coarse {
        Some((window, task)) => (window, task),
        None => (&*window, &task),
    };
    let stamp = run.stamp("survey", window, |builder| feed(builder, task));
    if run.database.folder().curve_stamp(tile).ok().flatten() == Some(stamp)
        && let Ok((_, curve)) = run.database.folder().read_curve(tile)
    {
        return Ok((stamp, Worked::Kept(curve)));
    }
    let curve = tin::survey(&window.dem, &window.importance, task, geometry::widest_level());
    run.database.write_curve(&stamp, &curve)?;
    Ok((stamp, Worked::Made(curve, None)))
}

fn feed(builder: FingerprintBuilder, task: &SurveyTask) -> FingerprintBuilder {
    let growth = &task.growth;
    builder
        .text(&format!("{:?} {:?} {:?} {:?}", growth.rule, growth.stop, task.owned, task.cost))
        .text(&format!("{:?}", growth.frame))
        .text(&format!("{:?}", growth.border))
}

/// Shares out points and triangles; without curves equally, with them by one threshold.
pub(crate) fn allocate(run: &Run, curves: Option<&[GainCurve]>, progress: &mut dyn Progress) -> Shares {
    progress.tell(Event::Enter(Stage::Allocate, 0));
    let shares = shares(run, curves);
    progress.tell(Event::Leave(Stage::Allocate));
    shares
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
    fn new(run: &Run, curves: &[GainCurve]) -> Option<Self> {
        let posts: Vec<f64> =
            run.area.tiles.iter().map(|&tile| run.area.tiling.rect(tile).post_count() as f64).collect();
        let rms = run.job.tin.target_rms_m? * f64::from(terrain::QUANTA_PER_METRE) * RMS_MARGIN;
        let floor = tiling::floor_for_rms(curves, rms * rms * posts.iter().sum::<f64>())?;
        let rms_quanta = curves.iter().zip(&posts).map(|(curve, posts)| (curve.squares_at(floor) / posts).sqrt());
        Some(Self { floor, rms_quanta: rms_quanta.collect() })
    }
}

fn shares(run: &Run, curves: Option<&[GainCurve]>) -> Shares {
    let area = &run.area;
    let by_rank = area.by_rank();
    let goal = curves.and_then(|curves| Goal::new(run, curves));
    let floor = goal.as_ref().map(|goal| goal.floor);
    // What is optimised needs fewer points for the same residual: each tile is to come down to its part of it.
    let goal = goal.filter(|_| optimising(run.job).is_some());
    let gains = |curves| Gains { curves, by_rank: &by_rank, floor };
    let points: Option<Vec<usize>> = match (run.job.tin.budget, curves) {
        (PointBudget::Points(points), None) => Some(points_equally(points, area.tiles.len())),
        (PointBudget::Points(points), Some(curves)) => Some(points_globally(points, gains(curves))),
        (PointBudget::Limits, _) => None,
    };
    let triangles = (run.job.modules.edges == Edges::Constrained).then(|| match (curves, &points) {
        (Some(curves), None) => allocate_globally(&area.budget, &area.tiling, gains(curves)),
        _ => allocate_equally(&area.budget, &area.tiling),
    });
    let tiles = (0..area.tiles.len()).map(|index| {
        let mut allowance = triangles.as_ref().map(|allocation| allocation.shares[index].allowance.clone());
        if let (Some(points), Some(allowance)) = (&points, &mut allowance) {
            // Every point costs the same; `plan` has made sure that all of them fit.
            allowance.triangles = points[index] as u32 * limits::POINT_COST;
        }
        TileBudget {
            points: points.as_ref().map(|points| points[index]),
            allowance,
            rms_quanta: goal.as_ref().map(|goal| goal.rms_quanta[index]),
        }
    });
    Shares { tiles: tiles.collect(), triangles }
}
