//! What a job will do and take, before any work.

use crate::ground::{GamingArea, PlannedTile, planned_tiles};
use job::{Edges, Job, TileOrder};

use crate::CompileError;
use crate::forecast::{Forecast, forecast};
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
