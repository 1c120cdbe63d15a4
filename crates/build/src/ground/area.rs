//! What follows from a job before any height is read: grids, tiles, ranks, the budget.

use job::{Borders, Budget as PointBudget, Edges, Job};
use schedule::RankedTasks;
use source_files::Crs;
use terrain::limits::Windows;
use terrain::{DEGREE_M, GridFrame, ModuleGrid, ModuleRect, PostRect, Side, TileId};
use tin::tiling::{Budget, BudgetFault, Tiling};

use crate::ground::GroundError;

/// The gaming area of a job, divided.
pub struct GamingArea {
    /// Its load modules.
    pub grid: ModuleGrid,
    /// Its posts.
    pub rect: PostRect,
    /// Where its posts lie.
    pub frame: GridFrame,
    /// Its tiles and their ranks.
    pub tiling: Tiling,
    /// Every tile, row-major; tasks are numbered by place in it.
    pub tiles: Vec<TileId>,
    /// What the limits leave it.
    pub budget: Budget,
}

impl GamingArea {
    /// Divides the area of a job.
    ///
    /// # Errors
    /// When the limits leave no room for the initial points, or keys contradict each other.
    pub fn new(job: &Job) -> Result<Self, GroundError> {
        let grid = job.area.grid;
        refuse_sizes(job)?;
        let job::TilesSpec { rows, columns, order, .. } = job.tiles;
        let tiling = Tiling::new(grid.area(), grid.side_cells, rows, columns, order);
        let frame = GridFrame {
            origin_east_m: job.area.origin_m[0],
            origin_north_m: job.area.origin_m[1],
            spacing: job.area.spacing,
        };
        let window = job.limits.window;
        let budget = Budget {
            grid,
            border_step: job.outer_step_cells(),
            per_module: job.limits.per_load_module,
            pool: job.limits.pool,
            area: job.limits.area_budget(&grid),
            per_window: window.limit,
            windows: Windows::of_size(grid, window.rows, window.cols),
            reserved: Vec::new(),
        };
        refuse_impossible(job, &budget)?;
        let tiles = tiling.tiles().collect();
        Ok(Self { grid, rect: grid.area(), frame, tiling, tiles, budget })
    }

    /// The tiles as tasks that wait for their lower-ranked neighbours.
    pub fn ranked_tasks(&self) -> RankedTasks {
        let ranks: Vec<_> = self.tiles.iter().map(|&tile| self.tiling.rank(tile)).collect();
        let around =
            |&tile: &TileId| self.tiling.neighbours(tile).into_iter().map(|other| self.tiling.index(other)).collect();
        RankedTasks::new(&ranks, &self.tiles.iter().map(around).collect::<Vec<Vec<usize>>>())
    }

    /// Places of the tiles from the lowest rank.
    pub fn by_rank(&self) -> Vec<usize> {
        let mut by_rank: Vec<usize> = (0..self.tiles.len()).collect();
        by_rank.sort_by_key(|&index| self.tiling.rank(self.tiles[index]));
        by_rank
    }
}

/// Sizes that no tile can be refined at.
fn refuse_sizes(job: &Job) -> Result<(), GroundError> {
    let grid = job.area.grid;
    if grid.side_cells < 2 {
        return Err(GroundError::Impossible {
            key: "area.spacing_m".into(),
            found: format!("{}, one cell to a load module", job.area.spacing.metres()),
            expected: "at least two cells along a side".into(),
            hint: "a load module needs posts inside; use a smaller spacing".into(),
        });
    }
    let longest = |modules: u32, tiles: u32| modules.div_ceil(tiles) as usize * grid.side_cells as usize;
    let cells = longest(grid.rows, job.tiles.rows).max(longest(grid.cols, job.tiles.columns));
    if terrain::geometry::WORKING_POSTS_MAX <= cells {
        return Err(GroundError::Impossible {
            key: "tiles".into(),
            found: format!("{} x {}, which makes tiles of {cells} cells a side", job.tiles.rows, job.tiles.columns),
            expected: format!("tiles below {} cells a side", terrain::geometry::WORKING_POSTS_MAX),
            hint: "ask for more tiles.rows and tiles.columns".into(),
        });
    }
    Ok(())
}

fn refuse_impossible(job: &Job, budget: &Budget) -> Result<(), GroundError> {
    if job.tiles.borders == Borders::Regular && job.modules.edges == Edges::Constrained {
        return Err(GroundError::Impossible {
            key: "tiles.borders".into(),
            found: "\"regular\" beside edges = \"constrained\"".into(),
            expected: "\"inherit\", or edges = \"clip\"".into(),
            hint: "regular borders are the paper's alternative, for comparison in clip mode only".into(),
        });
    }
    budget.check().map_err(|fault| {
        let (key, found, expected) = match fault {
            BudgetFault::Module { module, start, limit } => (
                "limits.per_load_module",
                format!("{limit}, below the {start} triangles that load module {module} starts with"),
                format!("at least {start}"),
            ),
            BudgetFault::Window { origin, start, limit } => (
                "limits.per_4km_square",
                format!("{limit}, below the {start} triangles that the window from load module {origin} starts with"),
                format!("at least {start}"),
            ),
            BudgetFault::Area { start, limit } => (
                "limits.mean_per_load_module",
                format!("{limit} triangles for the area, below the {start} that the initial points need"),
                format!("at least {:.2}", start as f64 / budget.grid.count() as f64),
            ),
        };
        GroundError::Impossible {
            key: key.into(),
            found,
            expected,
            hint: "every load module starts from its four corners and the fixed points of outer sides".into(),
        }
    })?;
    refuse_points(job, budget)
}

/// Points of constrained edges cost exactly two triangles each, so too many are known before any work.
fn refuse_points(job: &Job, budget: &Budget) -> Result<(), GroundError> {
    let (PointBudget::Points(points), Edges::Constrained) = (job.tin.budget, job.modules.edges) else { return Ok(()) };
    let room = (budget.area - budget.start_total()) / u64::from(terrain::POINT_COST);
    if points <= room {
        return Ok(());
    }
    Err(GroundError::Impossible {
        key: "tin.points".into(),
        found: format!("{points}, which need more triangles than mean_per_load_module leaves"),
        expected: format!("at most {room}"),
        hint: "each point adds two triangles; select fewer, or raise limits.mean_per_load_module".into(),
    })
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

/// Every tile of an area, row by row from the south-west.
pub fn planned_tiles(area: &GamingArea) -> Vec<PlannedTile> {
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

/// Parts by which metres of an area's system may differ from metres of its ground; those of a UTM zone do by 0.001.
const STRETCH_MAX: f64 = 0.01;

/// What a person should know of a system whose metres are other than those of the ground in the middle of the area.
pub fn stretched(epsg: u32, area: &GamingArea) -> Option<String> {
    const STEP_M: f64 = 1000.0;
    let (own, degrees) = (Crs::from_epsg(epsg).ok()?, Crs::from_epsg(4326).ok()?);
    let middle = |at: [f64; 2], posts: [usize; 2]| [0, 1].map(|axis| at[axis] + posts[axis] as f64 / 2.0);
    let (frame, rect) = (area.frame, area.rect);
    let [col, row] = middle([f64::from(rect.west), f64::from(rect.south)], [rect.cells_wide(), rect.cells_high()]);
    let spacing_m = frame.spacing.metres();
    let [east, north] = [frame.origin_east_m + col * spacing_m, frame.origin_north_m + row * spacing_m];
    let at = |east: f64, north: f64| own.to(&degrees, [east, north]);
    let from = at(east, north)?;
    let ground_m = |to: [f64; 2]| {
        let longitude = (to[0] - from[0]) * from[1].to_radians().cos();
        longitude.hypot(to[1] - from[1]) * DEGREE_M
    };
    let part = (ground_m(at(east + STEP_M, north)?) + ground_m(at(east, north + STEP_M)?)) / (2.0 * STEP_M);
    let metres = 100.0 * part;
    (STRETCH_MAX < (part - 1.0).abs()).then(|| {
        format!(
            "area.crs: 100 m of EPSG:{epsg} are {metres:.1} m of ground here, and load modules, widths and distances \
             are measured in its metres; in a UTM zone both are alike"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn an_area_is_told_of_where_its_metres_are_not_those_of_the_ground() {
        let told = |epsg: u32, [east, north]: [i32; 2]| {
            let text = format!(
                "[area]\nname = \"a\"\ncrs = \"EPSG:{epsg}\"\norigin_m = [{east}, {north}]\nsize_m = [1000, 1000]\n\
                 spacing_m = 25\n[dem]\nsource = \"sample\"\n"
            );
            let area = GamingArea::new(&Job::from_text(&text, Path::new("a.toml")).unwrap()).unwrap();
            stretched(epsg, &area)
        };
        assert_eq!(told(32611, [500_000, 3_900_000]), None);
        assert_eq!(told(3857, [1_000_000, 0]), None, "on the equator");
        let found = told(3857, [1_000_000, 6_446_000]).unwrap();
        assert!(found.starts_with("area.crs: 100 m of EPSG:3857 are 64."), "{found}");
    }
}
