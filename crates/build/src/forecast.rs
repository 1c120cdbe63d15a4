//! What a build is expected to take, from its job alone and the sizes of the files of features that it names.
//!
//! The rates are those of one core of a server of 2023: the seconds of processor time of one stage, or the bytes at
//! its peak, divided by what it goes by. The builds they were measured on have 2501, 5001, 10,001 and 20,001 posts a
//! side of the sample terrain in tiles of 17 x 17 load modules (`scripts/bench.py size`); two GeoTIFFs of real terrain,
//! one in the area's own system and one in degrees; and `configs/paper.toml`. The forecast of each was within a factor
//! of 1.5 of what it took. Other machines differ in time, and jobs that end at a residual take less than their budget.

use job::{Budget as PointBudget, Choice, DemSource, Edges, Job, LodBorder, TileOrder};

use crate::CompileError;
use crate::curves::BAND_BYTES_MAX;
use crate::ground::{CACHE_BYTES_MAX, GamingArea, KEPT_POSTS_MAX, PlannedTile, planned_tiles};
use crate::product::DRAWN_AT_ONCE;
use crate::refinement::optimising;
use crate::run::KEPT_BYTES_MAX;
use crate::tasks::{is_surveyed, is_surveyed_in_haste};

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
    /// The same by stage.
    pub stages: StageSeconds,
    /// Size of the database.
    pub disk_bytes: u64,
}

/// Seconds of the stages that take any, on one worker.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageSeconds {
    /// Every tile alone.
    pub survey: f64,
    /// Every tile's TIN.
    pub refine: f64,
    /// Load modules.
    pub assemble: f64,
    /// The report.
    pub publish: f64,
    /// The page, after all stages.
    pub page: f64,
}

impl StageSeconds {
    fn sum(&self) -> f64 {
        self.survey + self.refine + self.assemble + self.publish + self.page
    }
}

/// Posts of an area up to which a build draws its page with the ground in it.
pub const PAGE_POSTS_MAX: usize = 16 << 20;
/// Load modules of an area up to which a build draws maps of them on its page.
pub const PAGE_MODULES_MAX: usize = 1 << 18;

/// Seconds to make the heights and weights of one post: of the sample terrain at 25 m, and from rasters.
const WINDOW_S: (f64, f64) = (130e-9, 30e-9);
/// Seconds for a square metre of sample terrain around a post: its forms are found by place, however few posts there
/// are to stand on them.
const SAMPLE_S: f64 = 0.07e-9;
/// Seconds for a triangle of the budget: to survey, closely and in haste.
const SURVEY_S: (f64, f64) = (2e-6, 0.8e-6);
/// To select its point.
const GROW_S: f64 = 0.75e-6;
/// To assemble, measure and report it: as it is, and merged, clipped and brought below limits.
const ASSEMBLE_S: (f64, f64) = (0.9e-6, 4e-6);
/// Seconds for a triangle of the finest level to make one coarser level of its load module.
const LEVEL_S: f64 = 3.6e-6;
/// Triangles of a coarser level with all vertices on its sides, of the finest level's: those that stay in any case, and
/// those that go by its share. Measured at shares of 0.5 and 0.2 with 32 triangles in a load module.
const LEVEL_TRIANGLES: (f64, f64) = (0.34, 0.66);
/// Seconds of a build of hardly anything: the page's pictures, mostly.
const START_S: f64 = 0.15;
/// Seconds for a post and for a load module on the page.
const PAGE_S: (f64, f64) = (100e-9, 5e-6);

/// Bytes on disk of a triangle: in its tile, in its load module, in a gain curve.
const DISK_TRIANGLE: (u64, u64, u64) = (22, 17, 16);
/// The same of a coarser level, in its load module.
const DISK_LEVEL_TRIANGLE: f64 = 21.0;
/// Bytes on disk of a tile: what was measured of it, its lines in `database.json` and `report.json`.
const DISK_TILE: u64 = 22 << 10;
/// Bytes on disk of a page with maps, and of one without.
const DISK_PAGE: (u64, u64) = (6 << 20, 128 << 10);

/// Bytes of the program itself, with the pictures of its page.
const MEMORY_BASE: u64 = 20 << 20;
/// Bytes for a map of the page that is drawn.
const MEMORY_DRAWING: u64 = 12 << 20;
/// Bytes of memory for a post whose windows are kept between stages, and for one on the page.
const MEMORY_POST: (u64, u64) = (7, 16);
/// Bytes of memory for a load module: while budgets are shared out, when the report is made, and on the page.
const MEMORY_MODULE: (u64, u64, u64) = (21, 80, 1150);
/// Bytes of memory for a triangle, as far as they are kept: in a TIN, in a gain curve.
const MEMORY_TRIANGLE: (u64, u64) = (20, 16);
/// Bytes of memory for a post of a tile that is worked on, where windows are not kept.
const MEMORY_POST_IN_WORK: u64 = 24;
/// Bytes of memory for a post and for a triangle of a tile that is being optimised.
const MEMORY_OPTIMISING: (u64, u64) = (40, 600);
/// The same for a tile that is only grown.
const MEMORY_GROWING: (u64, u64) = (2, 100);
/// Bytes of a raster for a post of the area, about.
const BYTES_PER_SOURCE_POST: u64 = 4;

/// Bytes of memory for a byte of a file of features, OpenStreetMap's or GeoJSON, and the bytes that a square kilometre
/// of area may have of them: larger files reach beyond it. Measured on six areas of towns and of deserts.
const MEMORY_FEATURES: (u64, f64) = (60, 10e3);
/// Bytes more for such a byte where the page draws objects.
const MEMORY_OBJECTS: u64 = 60;
/// Bytes on disk for such a byte: what tiles have of features, features.gpkg, features.geojson.
const DISK_FEATURES: u64 = 17;
/// Seconds for such a byte: to read it, and to decide heights and shapes of what it says.
const FEATURES_S: f64 = 2.5e-6;

/// What a build goes by.
struct Size {
    posts: u64,
    triangles: u64,
    modules: u64,
    tiles: u64,
    /// Whether windows are kept between stages.
    is_kept: bool,
    is_surveyed: bool,
}

/// What the build of a job is expected to take.
pub(crate) fn forecast(job: &Job, area: &GamingArea) -> Forecast {
    let cells = area.rect.cells_wide() as u64 * area.rect.cells_high() as u64;
    let budget = match job.tin.budget {
        PointBudget::Points(points) => area.budget.start_total() + 2 * points,
        PointBudget::Limits => area.budget.area,
    };
    let size = Size {
        posts: area.rect.post_count() as u64,
        // No TIN has more triangles than half cells, whatever limits allow.
        triangles: budget.min(2 * cells),
        modules: area.grid.count() as u64,
        tiles: area.tiles.len() as u64,
        is_kept: area.rect.post_count() <= KEPT_POSTS_MAX,
        is_surveyed: is_surveyed(job),
    };
    let (shared_bytes, worker_bytes) = (shared_bytes(job, &size), worker_bytes(job, &size));
    let stages = stage_seconds(job, &size);
    Forecast {
        memory_bytes: shared_bytes + worker_bytes * size.tiles.min(2),
        shared_bytes,
        worker_bytes,
        seconds: stages.sum(),
        stages,
        disk_bytes: disk_bytes(job, &size),
    }
}

impl Size {
    fn has_ground_on_page(&self) -> bool {
        self.posts <= PAGE_POSTS_MAX as u64
    }

    fn has_maps_on_page(&self) -> bool {
        self.modules <= PAGE_MODULES_MAX as u64
    }
}

fn stage_seconds(job: &Job, size: &Size) -> StageSeconds {
    let (posts, triangles) = (size.posts as f64, size.triangles as f64);
    let window = match job.dem.source {
        DemSource::Sample { .. } => WINDOW_S.0 + SAMPLE_S * (job.area.spacing.metres().powi(2) - 625.0),
        DemSource::Files { .. } => WINDOW_S.1,
    };
    // Kept, they are made once for all stages and once for the page; otherwise for each stage: most tiles also for the
    // report, which says what limits cost.
    let windows = posts * window;
    let (first, others) = if size.is_kept { (windows, 0.0) } else { (windows, windows) };
    let survey = match (size.is_surveyed, is_surveyed_in_haste(job)) {
        (false, _) => 0.0,
        (true, false) => SURVEY_S.0,
        (true, true) => SURVEY_S.1,
    };
    let optimise = optimising(job).map_or(0.0, |optimising| optimising.effort.word().cost.seconds() * 1e-6);
    let assemble = if matches!(job.modules.edges, Edges::Clip(_)) { ASSEMBLE_S.1 } else { ASSEMBLE_S.0 };
    let page = match (size.has_ground_on_page(), size.has_maps_on_page()) {
        (true, _) => posts * PAGE_S.0,
        (false, true) => size.modules as f64 * PAGE_S.1,
        (false, false) => 0.0,
    };
    let levels = job.lod.inner_shares.len() as f64 * LEVEL_S;
    let (surveyed, refined) = if size.is_surveyed { (first, others) } else { (0.0, first) };
    StageSeconds {
        survey: surveyed + triangles * survey + bytes_of_features(job, size) as f64 * FEATURES_S,
        refine: refined + triangles * (GROW_S + optimise),
        assemble: others + triangles * (assemble + levels),
        publish: others,
        page: START_S + page + if size.is_kept { windows } else { 0.0 },
    }
}

/// Triangles of all coarser levels together, for one of the finest.
fn triangles_of_levels(job: &Job) -> f64 {
    let (always, by_share) = LEVEL_TRIANGLES;
    let of_level = |&share: &f64| match job.lod.border {
        LodBorder::Full => always + by_share * share,
        LodBorder::Own => share,
    };
    job.lod.inner_shares.iter().map(of_level).sum()
}

fn disk_bytes(job: &Job, size: &Size) -> u64 {
    let (tile, module, curve) = DISK_TRIANGLE;
    let curve = if size.is_surveyed { curve } else { 0 };
    // Clipping cuts triangles in pieces.
    let module = if matches!(job.modules.edges, Edges::Clip(_)) { 2 * module } else { module };
    let page = if size.has_maps_on_page() { DISK_PAGE.0 } else { DISK_PAGE.1 };
    let levels = size.triangles as f64 * triangles_of_levels(job) * DISK_LEVEL_TRIANGLE;
    let features = DISK_FEATURES * bytes_of_features(job, size);
    size.triangles * (tile + module + curve) + levels as u64 + size.tiles * DISK_TILE + page + features
}

fn shared_bytes(job: &Job, size: &Size) -> u64 {
    let tins = (size.triangles * MEMORY_TRIANGLE.0).min(KEPT_BYTES_MAX as u64);
    let curves = match size.is_surveyed {
        true => (size.triangles * MEMORY_TRIANGLE.1).min(BAND_BYTES_MAX as u64),
        false => 0,
    };
    let reported = size.modules * MEMORY_MODULE.1 * job.lod.level_count() as u64;
    let counts = (curves + size.modules * MEMORY_MODULE.0).max(reported);
    let maps = if size.has_maps_on_page() {
        DRAWN_AT_ONCE as u64 * MEMORY_DRAWING + size.modules * MEMORY_MODULE.2
    } else {
        0
    };
    let page = maps + if size.has_ground_on_page() { size.posts * MEMORY_POST.1 } else { 0 };
    let kept = if size.is_kept { size.posts * MEMORY_POST.0 } else { 0 };
    let source = match job.dem.source {
        DemSource::Sample { .. } => 0,
        // Rasters are held up to a bound and read by window beyond it; how many posts they have is in no job.
        DemSource::Files { .. } => (size.posts * BYTES_PER_SOURCE_POST).min(CACHE_BYTES_MAX + CACHE_BYTES_MAX / 4),
    };
    // Windows that were kept are gone when the page is drawn.
    let objects = if job.objects.is_some() && size.has_maps_on_page() { MEMORY_OBJECTS } else { 0 };
    let features = (MEMORY_FEATURES.0 + objects) * bytes_of_features(job, size);
    MEMORY_BASE + tins + counts + (kept + source).max(page) + features
}

/// Bytes of the files of roads, rivers, lakes and what stands beside them, as far as they are of the area, about.
fn bytes_of_features(job: &Job, size: &Size) -> u64 {
    let on_disk = job.features.as_ref().map_or(0, |features| features.bytes_on_disk());
    let km2 = size.posts as f64 * (job.area.spacing.metres() / 1000.0).powi(2);
    on_disk.min((MEMORY_FEATURES.1 * km2) as u64)
}

fn worker_bytes(job: &Job, size: &Size) -> u64 {
    let (of_post, of_triangle) = if optimising(job).is_some() { MEMORY_OPTIMISING } else { MEMORY_GROWING };
    let window = if size.is_kept { 0 } else { MEMORY_POST_IN_WORK };
    (size.posts * (of_post + window) + size.triangles * of_triangle) / size.tiles
}

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
