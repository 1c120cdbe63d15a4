//! What a job will do and take, before any work.

use job::{Budget as PointBudget, DemSource, Edges, Effort, Job, TileOrder};
use terrain::{ModuleRect, PostRect, Side, TileId};

use crate::CompileError;
use crate::area::GamingArea;
use crate::ground::KEPT_POSTS_MAX;
use crate::large::CACHE_BYTES_MAX;
use crate::refinement::optimising;
use crate::tasks::is_surveyed;

/// A job, planned.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Every tile, row by row from the south-west.
    pub tiles: Vec<PlannedTile>,
    /// What it will take.
    pub forecast: Forecast,
    /// Triangles of the area, at most.
    pub budget: u64,
    /// Triangles before any point is selected.
    pub start: u64,
    /// Tiles that can be refined at once: more workers have nothing to do there.
    pub workers_useful: usize,
    /// Whether tiles are surveyed before they are refined.
    pub is_surveyed: bool,
    /// Whether the load modules of a tile are made from its neighbours' TINs too.
    pub is_clipped: bool,
}

/// One tile of a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedTile {
    /// Which.
    pub tile: TileId,
    /// Its place in the order of ranks.
    pub rank: usize,
    /// Its colour: tiles of one colour share neither side nor corner.
    pub color: u32,
    /// Its posts, seams included.
    pub rect: PostRect,
    /// Its load modules.
    pub modules: ModuleRect,
    /// The tiles whose border points seed it.
    pub inherits_from: Vec<TileId>,
    /// The tiles it waits for: those of lower rank that share a side or a corner with it.
    pub after: Vec<TileId>,
}

/// What a build is expected to take. Measured rates of one core at present; other machines differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Memory at most, with two workers.
    pub memory_bytes: u64,
    /// The part of it that is there however many workers there are.
    pub shared_bytes: u64,
    /// What each worker adds.
    pub worker_bytes: u64,
    /// Seconds on one worker.
    pub seconds: f64,
    /// Size of the database.
    pub disk_bytes: u64,
}

/// Seconds one core needs for a post of the area: heights, weights, residuals.
const SECONDS_PER_POST: f64 = 60e-9;
/// The same for a post of the sample terrain.
const SECONDS_PER_SAMPLE_POST: f64 = 260e-9;
/// Seconds for a selected point, survey included.
const SECONDS_PER_POINT: f64 = 3.5e-6;
/// Bytes of memory for a post of the area: working windows and the decoded source.
const MEMORY_PER_POST: u64 = 8;
/// The same for a post of a tile that is worked on, where windows are not kept.
const MEMORY_PER_POST_IN_WORK: u64 = 24;
/// Bytes of a raster for a post of the area, about.
const BYTES_PER_SOURCE_POST: u64 = 4;
/// Bytes of memory for a triangle, in TINs, load modules and curves.
const MEMORY_PER_TRIANGLE: u64 = 60;
/// Bytes of memory for a post and for a triangle of a tile that is being optimised.
const MEMORY_OPTIMISING: (u64, u64) = (40, 600);
/// The same for a tile that is only grown.
const MEMORY_GROWING: (u64, u64) = (2, 100);
/// Bytes of the program itself.
const MEMORY_BASE: u64 = 8 << 20;
/// Bytes on disk for a triangle: tile, load module and curve.
const DISK_PER_TRIANGLE: u64 = 60;

/// Plans a job; nothing is read but the job.
///
/// # Errors
/// When no build can meet it: limits below the initial points, keys that contradict each other.
pub fn plan(job: &Job) -> Result<Plan, CompileError> {
    let area = GamingArea::new(job)?;
    let tiles = planned_tiles(&area);
    let of_color = |color| tiles.iter().filter(|tile| tile.color == color).count();
    let workers_useful = match job.tiles.order {
        TileOrder::Color => (0..4).map(of_color).max().unwrap_or(1).max(1),
        // A wave front: each row of tiles two columns behind the row south of it.
        TileOrder::Raster => (job.tiles.rows as usize).min(job.tiles.columns.div_ceil(2) as usize),
    };
    let (budget, start) = (area.budget.area, area.budget.start_total());
    let is_clipped = matches!(job.modules.edges, Edges::Clip(_));
    let forecast = forecast(job, &area);
    Ok(Plan { forecast, tiles, budget, start, workers_useful, is_surveyed: is_surveyed(job), is_clipped })
}

/// Every tile of an area, row by row from the south-west.
pub(crate) fn planned_tiles(area: &GamingArea) -> Vec<PlannedTile> {
    let mut ranks = vec![0; area.tiles.len()];
    area.by_rank().into_iter().enumerate().for_each(|(rank, index)| ranks[index] = rank);
    area.tiles.iter().map(|&tile| planned(area, tile, &ranks)).collect()
}

fn planned(area: &GamingArea, tile: TileId, ranks: &[usize]) -> PlannedTile {
    let tiling = &area.tiling;
    let inherits = Side::ALL.into_iter().filter(|&side| tiling.inherits(tile, side));
    PlannedTile {
        tile,
        rank: ranks[tiling.index(tile)],
        color: tiling.color(tile),
        rect: tiling.rect(tile),
        modules: tiling.modules(tile, area.grid),
        inherits_from: inherits.filter_map(|side| tiling.beyond(tile, side)).collect(),
        after: tiling.neighbours(tile).into_iter().filter(|&other| tiling.rank(other) < tiling.rank(tile)).collect(),
    }
}

fn forecast(job: &Job, area: &GamingArea) -> Forecast {
    let posts = area.rect.post_count() as u64;
    let triangles = match (job.tin.budget, job.modules.edges) {
        (PointBudget::Points(points), _) => area.budget.start_total() + 2 * points,
        (PointBudget::Limits, Edges::Constrained | Edges::Clip(_)) => area.budget.area,
    };
    let per_post = match job.dem.source {
        DemSource::Sample { .. } => SECONDS_PER_SAMPLE_POST,
        DemSource::Files { .. } => SECONDS_PER_POST,
    };
    let points = triangles as f64 / 2.0;
    // Measured on the jobs in `configs`, one worker.
    let per_triangle = match optimising(job).map(|optimising| optimising.effort) {
        None => 0.0,
        Some(Effort::Fast) => 6e-6,
        Some(Effort::Normal) => 35e-6,
        Some(Effort::Best) => 200e-6,
    };
    let (of_post, of_triangle) = if optimising(job).is_some() { MEMORY_OPTIMISING } else { MEMORY_GROWING };
    let tiles = area.tiles.len() as u64;
    let heights = |at_once: u64| match job.dem.source {
        _ if posts <= KEPT_POSTS_MAX as u64 => posts * MEMORY_PER_POST,
        DemSource::Sample { .. } => posts / tiles * MEMORY_PER_POST_IN_WORK * at_once,
        // Rasters are held up to a bound and read by window beyond it; how many posts they have is in no job.
        DemSource::Files { .. } => {
            posts / tiles * MEMORY_PER_POST_IN_WORK * at_once
                + (posts * BYTES_PER_SOURCE_POST).min(CACHE_BYTES_MAX + CACHE_BYTES_MAX / 4)
        }
    };
    let worker_bytes = (posts * of_post + triangles * of_triangle) / tiles + heights(1) - heights(0);
    let shared_bytes = MEMORY_BASE + heights(0) + triangles * MEMORY_PER_TRIANGLE;
    Forecast {
        memory_bytes: shared_bytes + worker_bytes * tiles.min(2),
        shared_bytes,
        worker_bytes,
        seconds: posts as f64 * per_post + points * SECONDS_PER_POINT + triangles as f64 * per_triangle,
        disk_bytes: triangles * DISK_PER_TRIANGLE,
    }
}
