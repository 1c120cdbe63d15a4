//! What a job will do and take, before any work.

use job::{Budget as PointBudget, DemSource, Edges, Effort, Job, TileOrder};
use schedule::Simulation;
use terrain::{ModuleRect, PostRect, Side, TileId};

use crate::CompileError;
use crate::area::GamingArea;
use crate::ground::KEPT_POSTS_MAX;
use crate::large::CACHE_BYTES_MAX;
use crate::refinement::optimising;

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
}

/// What a build is expected to take. Measured rates of one core at present; other machines differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Memory at most, with two workers.
    pub memory_bytes: u64,
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
/// Bytes of memory for a post and for a triangle of a tile that is being optimised, and how many tiles are so at once.
const MEMORY_OPTIMISING: (u64, u64, u64) = (40, 600, 2);
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
    let mut ranks = vec![0; area.tiles.len()];
    area.by_rank().into_iter().enumerate().for_each(|(rank, index)| ranks[index] = rank);
    let tiles: Vec<PlannedTile> = area.tiles.iter().map(|&tile| planned(&area, tile, &ranks)).collect();
    let of_color = |color| tiles.iter().filter(|tile| tile.color == color).count();
    let workers_useful = match job.tiles.order {
        TileOrder::Color => (0..4).map(of_color).max().unwrap_or(1).max(1),
        // A wave front: each row of tiles two columns behind the row south of it.
        TileOrder::Raster => (job.tiles.rows as usize).min(job.tiles.columns.div_ceil(2) as usize),
    };
    let (budget, start) = (area.budget.area, area.budget.start_total());
    Ok(Plan { forecast: forecast(job, &area), tiles, budget, start, workers_useful })
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
    let (of_post, of_triangle, at_once) = MEMORY_OPTIMISING;
    let tiles = area.tiles.len() as u64;
    let in_work = (posts * of_post + triangles * of_triangle) / tiles * at_once.min(tiles);
    let in_work = if optimising(job).is_some() { in_work } else { 0 };
    let heights = match job.dem.source {
        _ if posts <= KEPT_POSTS_MAX as u64 => posts * MEMORY_PER_POST,
        DemSource::Sample { .. } => posts / tiles * MEMORY_PER_POST_IN_WORK * at_once.min(tiles),
        // Rasters are held up to a bound and read by window beyond it; how many posts they have is in no job.
        DemSource::Files { .. } => {
            posts / tiles * MEMORY_PER_POST_IN_WORK * at_once.min(tiles)
                + (posts * BYTES_PER_SOURCE_POST).min(CACHE_BYTES_MAX + CACHE_BYTES_MAX / 4)
        }
    };
    Forecast {
        memory_bytes: in_work + MEMORY_BASE + heights + triangles * MEMORY_PER_TRIANGLE,
        seconds: posts as f64 * per_post + points * SECONDS_PER_POINT + triangles as f64 * per_triangle,
        disk_bytes: triangles * DISK_PER_TRIANGLE,
    }
}

/// Plays the refinement of a plan with `workers` workers; a tile takes as long as it has posts, in posts.
///
/// # Panics
/// When there is no worker.
pub fn simulate(plan: &Plan, workers: usize) -> Simulation {
    let ranks: Vec<usize> = plan.tiles.iter().map(|tile| tile.rank).collect();
    let near = |a: TileId, b: TileId| a != b && a.row.abs_diff(b.row) <= 1 && a.col.abs_diff(b.col) <= 1;
    let around = |tile: &PlannedTile| -> Vec<usize> {
        (0..plan.tiles.len()).filter(|&other| near(tile.tile, plan.tiles[other].tile)).collect()
    };
    let neighbours: Vec<Vec<usize>> = plan.tiles.iter().map(around).collect();
    let durations: Vec<f64> = plan.tiles.iter().map(|tile| tile.rect.post_count() as f64).collect();
    schedule::simulate(&schedule::RankedTasks::new(&ranks, &neighbours), workers, &durations)
}
