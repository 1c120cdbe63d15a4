//! Without load modules: just a mesh from a raster, on the raster's own posts or on those it is resampled to.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use crate::ground::{
    GivenPost, GroundError, Surroundings, TaskError, Window, chosen, posts_of_file, refused, scanned, start_posts,
};
use crate::{CompileError, Event, Most, Progress, Refinement, Stage, inherited, posts_of};
use fidelity::{Limit, Tally};
use job::{Effort, ErrorKey, Optimising};
use schedule::{Event as Scheduled, RankedTasks, Workers, in_rank_order_observed};
use source_files::Raster;
use store::ReportResidual;
use terrain::{
    Dem, Features, GainCurve, Importance, LastBatch, Metres, ModuleGrid, PostRect, SeamSides, StopReason, THOUSANDTHS,
    TileFeatures, TileId, TileOrder, TileTin, Tin, Vertex,
};
use tin::tiling::{Gains, Tiling, points_equally, points_globally};
use tin::{CostUnit, Proximity, Rule, Stop, SurveyTask, TileTask};

use crate::tasks::units_within;
use crate::workbench::heights::Heights;
use crate::workbench::request::{TinMethod, TinRequest, TinStart, refuse};
use crate::workbench::tally::{tally_of, tally_on_all, without_voids};
use crate::workbench::tiles::{continued, join, usual_tiles};

/// The paper's proximity test: metres across, metres in height.
const PROXIMITY_M: (f64, u32) = (300.0, 20);

/// A survey of a tile goes this many times further than an equal share, where that gains most.
const SURVEY_REACH: usize = 3;
/// A hasty survey needs so many posts for each point of an equal share.
const POSTS_PER_POINT: usize = 24;

/// A mesh and where it lies.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Vertices and triangles; rows and columns are those of the posts, from the south-west one.
    pub tin: Tin,
    /// The same with the triangles that lie over voids, to be measured; `None` where nothing is void.
    pub with_voids: Option<Tin>,
    /// The raster's heights, resampled where its own posts are not square ones in metres.
    pub dem: Arc<Dem>,
    /// Easting of post (0, 0), in metres.
    pub east_m: f64,
    /// Northing of post (0, 0), in metres.
    pub north_m: f64,
    /// Metres between posts, to the east and to the north.
    pub spacing_m: (f64, f64),
    /// EPSG code of its coordinate reference system.
    pub epsg: Option<u32>,
    /// Against every one of those posts.
    pub residual: ReportResidual,
    /// What so many triangles can reach on it at best; `None` where the ground is too small to say.
    pub limit: Option<Limit>,
    /// Vertices.
    pub points: usize,
    /// Rows and columns of the tiles that it was made in.
    pub tiles: (u32, u32),
    /// Why selection ended: that of the tile that stopped for want of posts, if any did.
    pub stop: StopReason,
}

/// Makes a mesh from a raster, untiled or in tiles with matching borders.
///
/// # Errors
/// When the raster cannot be used, or nothing says when to stop.
pub fn tin(request: &TinRequest, stop: &AtomicBool, progress: &mut dyn Progress) -> Result<Mesh, CompileError> {
    let fits = |rect| refuse(request, tiles_of(request, rect), rect);
    let heights = Heights::read((&request.dem, request.crs.as_deref()), &fits, request.workers, stop, progress)?;
    tin_over(&heights, request, stop, progress)
}

/// The same from a raster that is in memory already, instead of the one that `request` names.
///
/// # Errors
/// As [`tin()`].
pub fn tin_of_raster(
    raster: Raster,
    request: &TinRequest,
    stop: &AtomicBool,
    progress: &mut dyn Progress,
) -> Result<Mesh, CompileError> {
    progress.tell(Event::Enter(Stage::Read, 0));
    let heights = Heights::of_raster(raster, &Workers::new(request.workers), stop)?;
    progress.tell(Event::Leave(Stage::Read));
    heights.notes.iter().for_each(|note| progress.tell(Event::Note(note.clone())));
    tin_over(&heights, request, stop, progress)
}

fn tin_over(
    heights: &Heights,
    request: &TinRequest,
    stop: &AtomicBool,
    progress: &mut dyn Progress,
) -> Result<Mesh, CompileError> {
    let tiles = heights.refine(request, stop, progress)?;
    progress.tell(Event::Enter(Stage::Assemble, 0));
    let exhausted = tiles.iter().any(|tile| tile.stop == StopReason::Exhausted);
    let ended = if exhausted { StopReason::Exhausted } else { tiles[0].stop };
    let mesh = heights.mesh(join(heights.dem.rect(), &tiles), ended, request.workers, stop)?;
    progress.tell(Event::Leave(Stage::Assemble));
    let count = |of: fn(&TileTin) -> u32| tiles.iter().map(of).max().unwrap_or(0) + 1;
    Ok(Mesh { tiles: (count(|tile| tile.tile.row), count(|tile| tile.tile.col)), ..mesh })
}

impl Heights {
    /// The tiles of a request over these heights.
    pub fn refine(
        &self,
        request: &TinRequest,
        stop: &AtomicBool,
        progress: &mut dyn Progress,
    ) -> Result<Vec<TileTin>, CompileError> {
        let workers = Workers::new(request.workers);
        let tiles = tiles_of(request, self.dem.rect());
        let mut job = TinJob::new(request, tiles, &self.dem, self.frame.spacing)?;
        if let Some(TinStart::File(path)) = &request.start {
            job.given = posts_of_file(path, &self.frame, self.dem.rect())?;
            job.refuse_given()?;
        }
        let curves = job.survey(&self.dem, &workers, stop, progress)?;
        job.refine(&self.dem, curves, &workers, stop, progress)
    }

    /// A TIN over them as a mesh.
    ///
    /// # Errors
    /// When it is stopped.
    pub fn mesh(&self, tin: Tin, ended: StopReason, workers: usize, stop: &AtomicBool) -> Result<Mesh, CompileError> {
        let workers = Workers::new(workers);
        let tally = tally_on_all(&self.dem, &tin, &workers, stop)?;
        let limit = fidelity::limit(&self.dem, tin.triangles.len(), &workers.each());
        // Residuals are those of all that is known, also at the rims of voids.
        let with_voids = (0 < self.dem.void_count()).then(|| tin.clone());
        let tin = without_voids(tin, &self.dem);
        Ok(Mesh {
            with_voids,
            points: tin.vertices.len(),
            residual: crate::residual_of(&tally),
            limit,
            tin,
            dem: Arc::clone(&self.dem),
            east_m: self.frame.south_west[0],
            north_m: self.frame.south_west[1],
            spacing_m: (self.frame.spacing[0], self.frame.spacing[1]),
            epsg: self.frame.crs.epsg(),
            tiles: (1, 1),
            stop: ended,
        })
    }
}

/// The TIN of one tile without load modules, over all of `dem`.
///
/// # Errors
/// When the request does not fit the ground.
pub(crate) fn untiled(request: &TinRequest, dem: &Dem, spacing_m: [f64; 2]) -> Result<TileTin, CompileError> {
    let job = TinJob::new(request, (1, 1), dem, spacing_m)?;
    let tile = job.tiles[0];
    let task = job.task(tile, SeamSides::CLOSED, Vec::new(), job.points().map(|points| points as usize));
    job.refined(task, dem, &[])
}

/// The residuals of the optimised method on several grounds that share a number of triangles by one threshold of gain;
/// `None` where there are none.
///
/// # Errors
/// When the grounds are too small or too large.
pub(crate) fn untiled_together(
    grounds: &[Dem],
    triangles: usize,
    spacing_m: f64,
    stop: &AtomicBool,
) -> Result<Option<Tally>, CompileError> {
    let request = |triangles: usize| TinRequest {
        triangles: Some(triangles),
        ..TinRequest::plain(PathBuf::new(), TinMethod::Optimised(Optimising::default()))
    };
    // Two are there before any point, and a point makes two more.
    let points = triangles.saturating_sub(2 * grounds.len()) / 2;
    let reach = 4 * points / grounds.len().max(1) + 1;
    let survey = |dem: &Dem| {
        let request = request(triangles);
        let job = TinJob::new(&request, (1, 1), dem, [spacing_m; 2])?;
        Ok(job.curve(dem, job.tiles[0], reach))
    };
    let curves = grounds.iter().map(survey).collect::<Result<Vec<_>, CompileError>>()?;
    let by_rank: Vec<usize> = (0..grounds.len()).collect();
    let gains = Gains { bands: &mut std::iter::once(curves), by_rank: &by_rank, floor: None };
    let shares = points_globally(points as u64, gains);
    let mut all: Option<Tally> = None;
    for (dem, share) in grounds.iter().zip(shares) {
        if stop.load(Ordering::Relaxed) {
            return Err(TaskError::Stopped { stage: Stage::Survey.name(), done: 0, total: grounds.len() }.into());
        }
        let tin = untiled(&request(2 * share + 2), dem, [spacing_m; 2])?.tin;
        all.get_or_insert_default().merge(&tally_of(dem, &tin));
    }
    Ok(all)
}

/// A request, checked against its raster.
struct TinJob<'a> {
    request: &'a TinRequest,
    tiling: Tiling,
    tiles: Vec<TileId>,
    spacing: Metres,
    rule: Rule,
    value: Option<u64>,
    /// Points of a file to start from.
    given: Vec<GivenPost>,
}

impl<'a> TinJob<'a> {
    fn new(
        request: &'a TinRequest,
        (rows, cols): (u32, u32),
        dem: &Dem,
        spacing_m: [f64; 2],
    ) -> Result<Self, CompileError> {
        let rect = dem.rect();
        refuse(request, (rows, cols), rect)?;
        let tiling = Tiling::new(rect, 1, rows, cols, TileOrder::Color);
        let quantum = if request.method == TinMethod::Paper { terrain::QUANTA_PER_METRE as u32 } else { 1 };
        let value = request.max_residual_m.map(|metres| u64::from(THOUSANDTHS) * units_within(metres, quantum));
        let rule = match request.method {
            TinMethod::Greedy { key: ErrorKey::Max } => Rule::WorstFirst,
            // A residual to reach is reached by worst posts; sums of squares alone would go past it.
            TinMethod::Optimised(_) | TinMethod::Greedy { key: ErrorKey::Sse }
                if value.is_some() && request.points.is_none() && request.triangles.is_none() =>
            {
                Rule::WorstFirst
            }
            TinMethod::Optimised(_) | TinMethod::Greedy { key: ErrorKey::Sse } => Rule::LargestSquares { guard: value },
            TinMethod::Paper => Rule::Batches {
                residual_quantum: quantum,
                proximity: Some(Proximity {
                    posts: PROXIMITY_M.0 / spacing_m[0],
                    quanta: PROXIMITY_M.1 * terrain::QUANTA_PER_METRE as u32,
                }),
                last_batch: LastBatch::Truncate,
            },
        };
        let tiles = tiling.tiles().collect();
        Ok(Self { request, tiling, tiles, spacing: Metres(spacing_m[0]), rule, value, given: Vec::new() })
    }

    /// Refuses more points to start from than there may be.
    fn refuse_given(&self) -> Result<(), CompileError> {
        match self.points() {
            Some(points) if (points as usize) < self.given.len() => Err(GroundError::Impossible {
                key: "--start".into(),
                found: format!("{} points", self.given.len()),
                expected: format!("at most {points}, those asked for but for the corners of tiles"),
                hint: "ask for more --points, or start from fewer".into(),
            }
            .into()),
            _ => Ok(()),
        }
    }

    /// Points to select in all: those asked for less the corners of tiles.
    fn points(&self) -> Option<u64> {
        let corners = u64::from(self.tiling.rows() + 1) * u64::from(self.tiling.cols() + 1);
        let start = 2 * self.tiles.len();
        // No point makes more than two triangles, in its tile or on both sides of a line.
        let triangles = self.request.triangles.map(|triangles| (triangles.saturating_sub(start) / 2) as u64);
        self.request.points.map(|points| (points as u64).saturating_sub(corners)).or(triangles)
    }

    /// What is to be done for a tile; optimised where it is grown by squares and the method says so.
    fn refinement(&self, task: TileTask) -> Refinement {
        let optimising = match (self.request.method, &task.rule) {
            (TinMethod::Optimised(optimising), Rule::LargestSquares { .. }) => Some(optimising),
            _ => None,
        };
        // Alone, a tile's border makes one triangle a point, and the number asked for is met exactly.
        let most = match self.request.triangles {
            Some(triangles) if self.tiles.len() == 1 => Most::Triangles(triangles),
            _ => Most::AsTask,
        };
        Refinement { task, optimising, most, features: TileFeatures::none(TileId { row: 0, col: 0 }), spacing: None }
    }

    fn task(&self, tile: TileId, seams: SeamSides, inherited: Vec<terrain::Post>, points: Option<usize>) -> TileTask {
        let by_squares = matches!(self.rule, Rule::LargestSquares { .. });
        let rect = self.tiling.rect(tile);
        // The raster's own border is no seam: its posts are ordinary candidates.
        let outer = tin::tiling::outer_sides(rect, self.area());
        TileTask {
            inherited,
            seams: SeamSides::from_fn(|side| seams.is_open(side) || outer.is_open(side)),
            stop: Stop {
                points,
                value: if by_squares { None } else { self.value },
                rms_quanta: self.request.rms_m.map(|rms| rms * f64::from(terrain::QUANTA_PER_METRE)),
            },
            ..TileTask::plain(tile, rect, self.rule.clone())
        }
    }

    fn area(&self) -> PostRect {
        let last = self.tiles[self.tiles.len() - 1];
        PostRect::new(self.tiling.rect(self.tiles[0]).south_west(), self.tiling.rect(last).north_east())
    }

    /// With several tiles and a number of points, what each would gain.
    fn survey(
        &self,
        dem: &Dem,
        workers: &Workers,
        stop: &AtomicBool,
        progress: &mut dyn Progress,
    ) -> Result<Option<Vec<GainCurve>>, CompileError> {
        let Some(points) = self.points().filter(|_| 1 < self.tiles.len()) else { return Ok(None) };
        progress.tell(Event::Enter(Stage::Survey, self.tiles.len()));
        let curve = |_, &tile: &TileId| Ok(self.curve_of_share(dem, tile, points as usize));
        let curves = schedule::for_each_independent(&self.tiles, workers, stop, curve);
        let curves = curves.map_err(|error| CompileError::from_schedule(Stage::Survey, &self.tiles, error))?;
        progress.tell(Event::Leave(Stage::Survey));
        Ok(Some(curves))
    }

    /// What a tile would gain by a few times its equal share of `points`.
    ///
    /// Only how tiles compare matters. So where points are few among posts, every second post is surveyed for the share
    /// alone, and the curve goes on as it came. Optimising with more than the least effort takes so long that a whole
    /// survey costs nothing beside it.
    fn curve_of_share(&self, dem: &Dem, tile: TileId, points: usize) -> GainCurve {
        let (rect, share) = (self.tiling.rect(tile), points / self.tiles.len() + 1);
        let is_fast = match self.request.method {
            TinMethod::Optimised(optimising) => optimising.effort == Effort::Fast,
            TinMethod::Greedy { .. } | TinMethod::Paper => true,
        };
        if is_fast && POSTS_PER_POINT * share <= rect.post_count() {
            return continued(self.curve(&dem.every_second(rect), tile, share), share, SURVEY_REACH);
        }
        self.curve(&dem.window(rect), tile, SURVEY_REACH * points / self.tiles.len() + 1)
    }

    /// What a tile would gain by so many points on a window of it.
    fn curve(&self, window: &Dem, tile: TileId, reach: usize) -> GainCurve {
        let mut growth = self.task(tile, self.tiling.shared_sides(tile), Vec::new(), Some(reach));
        growth.stop = Stop { points: Some(reach), ..Stop::default() };
        if let Rule::Batches { .. } = growth.rule {
            growth.rule = Rule::WorstFirst;
        }
        let outer = tin::tiling::outer_sides(growth.rect, self.area());
        let owned = self.tiling.owned_sides(tile);
        let owned = SeamSides::from_fn(|side| owned.is_open(side) || outer.is_open(side));
        growth.rect = window.rect();
        let importance = weights(window);
        // One load module as large as the raster: costs are points, and all are booked to it.
        let grid = ModuleGrid { rows: 1, cols: 1, side_cells: i32::from(u16::MAX) };
        let task = SurveyTask { growth, owned, grid, cost: CostUnit::Points, counts_left: true };
        tin::survey(window, &importance, &task, terrain::geometry::widest_level())
    }

    /// What a tile starts from beside its corners.
    fn start(&self, dem: &Dem) -> Result<Vec<GivenPost>, CompileError> {
        let &Some(TinStart::Method(method, points)) = &self.request.start else {
            let is_here = |post: &&GivenPost| dem.rect().contains(post.at);
            return Ok(self.given.iter().filter(is_here).copied().collect());
        };
        let ground = tin::methods::DemWindow { dem, spacing: self.spacing };
        let share = points.div_ceil(self.tiles.len());
        let posts = chosen(&ground, method, share).map_err(|why| refused("--start", method, why))?;
        Ok(posts.into_iter().map(|at| GivenPost { at, pinned: false, outer: false, height: None }).collect())
    }

    /// A tile's TIN, from what it starts from. All vertices count, so it starts from no more than its share, and that
    /// leaves fewer to select; fixed points are in whatever the share is.
    fn refined(&self, mut task: TileTask, whole: &Dem, seeds: &[Vertex]) -> Result<TileTin, CompileError> {
        let dem = whole.window(task.rect);
        let mut given = self.start(&dem)?;
        let fixed = given.iter().filter(|post| post.pinned).count();
        let mut left = task.stop.points.unwrap_or(usize::MAX).saturating_sub(fixed);
        given.retain(|post| {
            let has_room = post.pinned || 0 < left;
            left -= usize::from(!post.pinned && has_room);
            has_room
        });
        let started = start_posts(&given, task.rect, task.seams).iter().filter(|start| !start.pinned).count();
        task.stop.points = task.stop.points.map(|points| points.saturating_sub(started));
        let importance = weights(&dem);
        let window = Window { given, ..Window::of(dem, importance) };
        let refinement = self.refinement(task);
        let sight = refinement.optimising.and_then(|optimising| optimising.sight);
        let in_squares = sight.map(|sight| {
            let sight = scanned(sight, self.spacing.0);
            let wide = window.dem.rect().grown(sight.halo()).intersection(&whole.rect()).expect("a tile is a part");
            let around = Surroundings::new(wide, |post| (!whole.is_void(post)).then(|| whole.height(post)));
            sight.weigh(&window.importance, &around)
        });
        Ok(refinement.run(&window, in_squares.as_ref(), seeds))
    }

    fn refine(
        &self,
        dem: &Dem,
        curves: Option<Vec<GainCurve>>,
        workers: &Workers,
        stop: &AtomicBool,
        progress: &mut dyn Progress,
    ) -> Result<Vec<TileTin>, CompileError> {
        let ranks: Vec<_> = self.tiles.iter().map(|&tile| self.tiling.rank(tile)).collect();
        let around =
            |&tile: &TileId| self.tiling.neighbours(tile).iter().map(|&other| self.tiling.index(other)).collect();
        let plan = RankedTasks::new(&ranks, &self.tiles.iter().map(around).collect::<Vec<Vec<usize>>>());
        let mut by_rank: Vec<usize> = (0..self.tiles.len()).collect();
        by_rank.sort_by_key(|&index| ranks[index]);
        let shares = self.points().map(|points| match curves {
            Some(curves) => {
                points_globally(points, Gains { bands: &mut std::iter::once(curves), by_rank: &by_rank, floor: None })
            }
            None => points_equally(points, self.tiles.len()),
        });
        let slots: Vec<OnceLock<TileTin>> = self.tiles.iter().map(|_| OnceLock::new()).collect();
        progress.tell(Event::Enter(Stage::Refine, self.tiles.len()));
        let task = |index: usize| {
            let tile = self.tiles[index];
            let published = |other: TileId| {
                Ok(slots[self.tiling.index(other)].get().expect("lower-ranked neighbours are published first"))
            };
            let seeds = inherited(&self.tiling, tile, &Features::default(), published)?;
            let points = shares.as_ref().map(|shares| shares[index]);
            let task = self.task(tile, self.tiling.owned_sides(tile), posts_of(&seeds), points);
            let done = self.refined(task, dem, &seeds)?;
            assert!(slots[index].set(done).is_ok(), "each tile is refined once");
            Ok(())
        };
        let observe = |event: Scheduled<()>| match event {
            Scheduled::Started(index) => progress.tell(Event::Started(Stage::Refine, self.tiles[index])),
            Scheduled::Done(index, ()) => progress.tell(Event::Done(Stage::Refine, self.tiles[index])),
        };
        in_rank_order_observed(&plan, workers, stop, task, observe)
            .map_err(|error| CompileError::from_schedule(Stage::Refine, &self.tiles, error))?;
        progress.tell(Event::Leave(Stage::Refine));
        Ok(slots.into_iter().map(|slot| slot.into_inner().expect("every tile was refined")).collect())
    }
}

/// Rows and columns of tiles where none are asked for. Where a residual ends the mesh or it starts from given points,
/// tiles would make another mesh, and so would the paper's passes.
fn tiles_of(request: &TinRequest, rect: PostRect) -> (u32, u32) {
    request.tiles.unwrap_or_else(|| suiting_tiles(request, rect))
}

fn suiting_tiles(request: &TinRequest, rect: PostRect) -> (u32, u32) {
    let points = request.points.or(request.triangles.map(|triangles| triangles / 2));
    let is_cut = request.method != TinMethod::Paper && request.start.is_none();
    let by_count = request.max_residual_m.is_none() && request.rms_m.is_none();
    points.filter(|_| is_cut && by_count).map_or((1, 1), |points| usual_tiles(rect, points))
}

/// Voids are never selected.
fn weights(dem: &Dem) -> Importance {
    terrain::mask::without_voids(Importance::uniform(dem.rect(), THOUSANDTHS), dem)
}
