//! One load module, explained: what it holds, what was refused there and why, what one more point would buy.

use std::collections::BTreeMap;
use std::path::Path;

use build::CompileError;
use build::ground::GroundError;
use build::product::{Opened, Product, ProductError, Wanted, WantedGround};
use fidelity::{Split, best_split};
use job::HOLE_CLASS_NAME;
use serde_json::Value;
use store::{FeatureFarOff, FeatureLeftOut, FeatureRemark, Folder, ObjectLeftOut, TileState, files};
use terrain::limits::Windows;
use terrain::{
    HOLE_CLASS, LoadModule, ModuleGrid, ModuleId, ModuleRect, ModuleResidual, ObjectKind, QUANTA_PER_METRE, RefusedBy,
    Side, StopReason, TileId, TileTin, metres_of_quanta,
};

use crate::recount;

/// Everything there is to know about one load module.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// Which.
    pub module: ModuleId,
    /// West, south, east and north of it in metres of the area's system.
    pub extent_m: [f64; 4],
    /// The tile it belongs to, how that stands, and why it stopped selecting.
    pub tile: (TileId, TileState, StopReason),
    /// Triangles that the tile's points were charged, and the most it was allowed, where it was.
    pub tile_triangles: (u32, Option<u64>),
    /// What limits count, in words, as [`job::Job::counted_words`] has them.
    pub count_of: String,
    /// Triangles and convex polygons.
    pub triangles: u32,
    /// Convex polygons.
    pub polygons: u32,
    /// Vertices inside, and on the southern, eastern, northern and western side, its corners included.
    pub vertices_inside: u32,
    /// See there.
    pub vertices_on_sides: [u32; 4],
    /// What limits count here, and the limit of a load module.
    pub count: (u32, u32),
    /// Triangles granted above the limit, from the pool.
    pub granted: u64,
    /// The fullest window that holds it.
    pub window: ExplainedWindow,
    /// Triangles by class of the ground under them, classes without any left out.
    pub classes: Vec<(String, u32)>,
    /// RMS, mean absolute and largest residual in metres, and posts.
    pub residual_m: [f64; 3],
    /// Posts measured.
    pub posts: u32,
    /// Of every level, the finest first: triangles, RMS and largest residual in metres; none where there is only one.
    pub levels: Vec<(u32, f64, f64)>,
    /// Its place by RMS residual among the load modules that it is compared with, the worst being 1, and how many these
    /// are: all of the area, or some drawn evenly.
    pub place: (usize, usize),
    /// How many load modules the area has, where only some were drawn to be compared with.
    pub drawn_of: Option<usize>,
    /// Posts that were refused here, largest residual first.
    pub refused: Vec<ExplainedRefusal>,
    /// What one more point would buy; `None` without ground to look at, or where it would buy nothing.
    pub one_more: Option<OneMore>,
    /// Why there is no ground to look at.
    pub no_ground: Option<String>,
    /// Roads and water here, in jobs with some.
    pub features: Option<ExplainedFeatures>,
    /// What stands on it, in jobs with objects.
    pub objects: Option<ExplainedObjects>,
}

/// The fullest window around a load module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExplainedWindow {
    /// Its south-west load module.
    pub origin: ModuleId,
    /// Its rows and columns of load modules.
    pub size: [u32; 2],
    /// What is counted in it.
    pub count: u32,
    /// What is allowed.
    pub limit: u32,
}

/// A post that a limit kept out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExplainedRefusal {
    /// East and north, in metres.
    pub place_m: [f64; 2],
    /// How far the ground lay from the triangles when it was refused, in metres.
    pub residual_m: f64,
    /// Which limit.
    pub by: RefusedBy,
}

/// What one more point, two triangles, would buy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneMore {
    /// East and north of the best place for it, in metres.
    pub place_m: [f64; 2],
    /// How far it would stand above the triangle that is there, in metres.
    pub raised_m: f64,
    /// RMS residual of the load module on that ground, in metres.
    pub rms_before_m: f64,
    /// The same with that point.
    pub rms_after_m: f64,
    /// Place of this gain among those of the load modules that it is compared with, the largest being 1.
    pub place: usize,
}

/// The most load modules that are all compared with; what is there to see and the time it takes do not grow beyond.
const ALL_MAX: usize = 16_384;
/// Load modules that are drawn of more: a share of them is that of all within 3 %, 19 times in 20.
const DRAWN: u32 = 1024;

/// A load module that one is compared with.
struct Compared {
    mean_squares: f64,
    split: Option<Split>,
    /// Residuals as they were built, and, of the load module to explain, on the ground that it is split on.
    built: ModuleResidual,
    measured: Option<ModuleResidual>,
}

/// Why a point is not tried on the ground that a database names.
const OTHER_GROUND: &str =
    "the ground is no longer what the load module was made from; `tiefort build` makes its tile again";

/// Explains one load module of a finished database.
///
/// # Errors
/// When there is no such load module, or the database is missing, unfinished or damaged. Without the ground it was
/// built from it is explained without what only the ground can tell, unless the ground is a raster that was named.
pub fn explain(
    folder: &Path,
    module: ModuleId,
    ground: WantedGround,
    workers: usize,
) -> Result<Explanation, CompileError> {
    let opened = Opened::open(folder)?;
    check_inside(module, opened.area.grid)?;
    let (mut compared, mut no_ground) = match compared(&opened, module, ground, workers) {
        Err(error) if error.is_of_the_ground() && matches!(ground, WantedGround::Recorded) => {
            (self::compared(&opened, module, WantedGround::None, workers)?, Some(error.to_string()))
        }
        found => (found?, None),
    };
    let own = compared.last_mut().expect("a load module is there itself");
    if matches!(ground, WantedGround::Recorded) && own.measured.is_some_and(|measured| measured != own.built) {
        (own.split, no_ground) = (None, Some(OTHER_GROUND.into()));
    }
    let part = around(&opened, module);
    let product = Product::of(&opened, &Wanted { part: Some(part), ground: WantedGround::None, workers })?;
    let tile = opened.area.tiling.tile_of_module(module, opened.area.grid);
    let (_, tin) = opened.folder.read_tile(tile)?;
    let allocation = opened.folder.read_json(files::ALLOCATION)?;
    let levels = levels(&opened, tile, module)?;
    let found = explained(&product, module, &tin, &allocation, &compared);
    let own = module_of(&product, module);
    let objects = explained_objects(&opened.folder, &product, own, found.extent_m)?;
    Ok(Explanation { no_ground, levels, objects, ..found })
}

fn check_inside(module: ModuleId, ModuleGrid { rows, cols, .. }: ModuleGrid) -> Result<(), CompileError> {
    if module.row < rows && module.col < cols {
        return Ok(());
    }
    Err(GroundError::Impossible {
        key: "load module".into(),
        found: module.to_string(),
        expected: format!("a row from 0 to {} and a column from 0 to {}", rows - 1, cols - 1),
        hint: "rows come first and both count from the south-west".into(),
    }
    .into())
}

/// The load modules that one is compared with, with their best splits where there is ground to split on, and that one
/// at the end.
fn compared(
    opened: &Opened,
    id: ModuleId,
    ground: WantedGround,
    workers: usize,
) -> Result<Vec<Compared>, ProductError> {
    let area = &opened.area;
    let alone = |ModuleId { row, col }| ModuleRect { south: row, west: col, north: row + 1, east: col + 1 };
    let own = alone(id);
    let parts: Vec<ModuleRect> = match drawn(area.grid) {
        None => area.tiles.iter().map(|tile| area.tiling.modules(*tile, area.grid)).chain([own]).collect(),
        Some(drawn) => drawn.into_iter().map(alone).chain([own]).collect(),
    };
    let found = Product::each_part(opened, ground, &parts, workers, |modules, window| {
        let ground = window.map(|window| window.measured(area));
        let of = |module: &LoadModule| Compared {
            mean_squares: mean_squares(module.residual.sum_squared as f64, module),
            split: ground.as_ref().and_then(|ground| best_split(module, ground)),
            built: module.residual,
            measured: window
                .filter(|_| module.id == id)
                .map(|window| recount::residual(module, &window.dem, area.grid, area.frame.spacing)),
        };
        modules.iter().map(of).collect::<Vec<_>>()
    })?;
    Ok(found.into_iter().flatten().collect())
}

/// Those in the middle of equal parts of an area of many load modules; `None` where all are compared with.
fn drawn(grid: ModuleGrid) -> Option<Vec<ModuleId>> {
    if grid.count() <= ALL_MAX {
        return None;
    }
    let step = (grid.count() as f64 / f64::from(DRAWN)).sqrt();
    let middles = |all: u32| {
        let parts = ((f64::from(all) / step).round() as u64).clamp(1, u64::from(all));
        (0..parts).map(move |part| ((2 * part + 1) * u64::from(all) / (2 * parts)) as u32)
    };
    let places = middles(grid.rows).flat_map(|row| middles(grid.cols).map(move |col| ModuleId { row, col }));
    Some(places.collect())
}

/// The load modules of all windows that hold one.
fn around(opened: &Opened, ModuleId { row, col }: ModuleId) -> ModuleRect {
    let windows = &opened.area.budget.windows;
    let touching = windows.touching(ModuleRect { south: row, west: col, north: row + 1, east: col + 1 });
    ModuleRect { north: touching.north - 1 + windows.rows, east: touching.east - 1 + windows.cols, ..touching }
}

/// One of the load modules that were read.
fn module_of(product: &Product, id: ModuleId) -> &LoadModule {
    let ModuleRect { south, west, .. } = product.part;
    &product.modules[((id.row - south) * product.part.cols() + id.col - west) as usize]
}

fn explained(product: &Product, id: ModuleId, tin: &TileTin, allocation: &Value, compared: &[Compared]) -> Explanation {
    let module = module_of(product, id);
    let state = product.manifest.tile(tin.tile).map_or(TileState::Missing, |record| record.state);
    let on_sides = Side::ALL.map(|side| module.side_vertices(side).len() as u32);
    let (own, others) = compared.split_last().expect("a load module is there itself");
    let worse = others.iter().filter(|other| own.mean_squares < other.mean_squares).count();
    let residual = module.residual;
    let metre = f64::from(QUANTA_PER_METRE);
    let side_m = product.job.modules.side_m;
    let (west, south) = (
        product.frame.origin_east_m + f64::from(id.col) * side_m,
        product.frame.origin_north_m + f64::from(id.row) * side_m,
    );
    Explanation {
        module: id,
        extent_m: [west, south, west + side_m, south + side_m],
        tile: (tin.tile, state, tin.stop),
        tile_triangles: (tin.triangles_charged, allowed(allocation, tin.tile)),
        count_of: product.job.counted_words().into(),
        triangles: module.counts().triangles,
        polygons: module.counts().polygons,
        vertices_inside: (module.vertices.len() - module.border_vertex_count()) as u32,
        vertices_on_sides: on_sides,
        count: (product.job.counted(module), product.job.limits.per_load_module),
        granted: granted(allocation, id),
        window: fullest_window(product, id),
        classes: classes(product, module),
        residual_m: [
            own.mean_squares.sqrt() / metre,
            residual.sum_abs as f64 / f64::from(residual.posts.max(1)) / metre,
            f64::from(residual.largest) / metre,
        ],
        posts: residual.posts,
        place: (worse + 1, others.len()),
        drawn_of: (others.len() < product.grid.count()).then(|| product.grid.count()),
        refused: refused(product, tin, id),
        one_more: one_more(product, own, others),
        no_ground: None,
        levels: Vec::new(),
        features: explained_features(product, id, [west, south, west + side_m, south + side_m]),
        objects: None,
    }
}

/// Triangles, RMS and largest residual of every level of a load module, where there are several.
fn levels(
    Opened { folder, manifest, .. }: &Opened,
    tile: TileId,
    id: ModuleId,
) -> Result<Vec<(u32, f64, f64)>, CompileError> {
    let (_, levels) = folder.read_levels(manifest, tile)?;
    if levels.len() == 1 {
        return Ok(Vec::new());
    }
    let metre = f64::from(QUANTA_PER_METRE);
    let figures = |module: &LoadModule| {
        let rms = mean_squares(module.residual.sum_squared as f64, module).sqrt();
        (module.counts().triangles, rms / metre, f64::from(module.residual.largest) / metre)
    };
    Ok(levels.iter().flatten().filter(|module| module.id == id).map(figures).collect())
}

fn mean_squares(squares: f64, module: &LoadModule) -> f64 {
    squares / f64::from(module.residual.posts.max(1))
}

/// The triangles that a tile was allowed.
fn allowed(allocation: &Value, tile: TileId) -> Option<u64> {
    let tiles = allocation["tiles"].as_array()?;
    tiles.iter().find(|entry| entry["row"] == tile.row && entry["col"] == tile.col)?["triangles"].as_u64()
}

/// The triangles that a load module was granted above its limit.
fn granted(allocation: &Value, module: ModuleId) -> u64 {
    let entries = allocation["granted"].as_array().map_or(&[] as &[Value], |entries| entries);
    let entry = entries.iter().find(|entry| entry["row"] == module.row && entry["col"] == module.col);
    entry.and_then(|entry| entry["triangles"].as_u64()).unwrap_or(0)
}

fn fullest_window(product: &Product, module: ModuleId) -> ExplainedWindow {
    let limit = product.job.limits.window;
    let windows = Windows::of_size(product.grid, limit.rows, limit.cols);
    let ModuleId { row, col } = module;
    let origins = windows.touching(ModuleRect { south: row, west: col, north: row + 1, east: col + 1 });
    let count = |origin| windows.modules_of(origin).iter().map(|id| product.job.counted(module_of(product, id))).sum();
    let around = origins.iter().map(|origin| (origin, count(origin)));
    let (origin, count) =
        around.reduce(|fullest, next| if fullest.1 < next.1 { next } else { fullest }).expect("windows cover the area");
    ExplainedWindow { origin, size: [windows.rows, windows.cols], count, limit: limit.limit }
}

fn classes(product: &Product, module: &LoadModule) -> Vec<(String, u32)> {
    let all = product.job.class_names();
    let names = all.iter().map(String::as_str).enumerate();
    let names = names.chain([(usize::from(HOLE_CLASS), HOLE_CLASS_NAME)]);
    let count = |class: usize| module.classes.iter().filter(|&&found| usize::from(found) == class).count() as u32;
    names.map(|(class, name)| (name.to_owned(), count(class))).filter(|(_, count)| 0 < *count).collect()
}

fn refused(product: &Product, tin: &TileTin, module: ModuleId) -> Vec<ExplainedRefusal> {
    let here = tin.refused.iter().filter(|refusal| refusal.module == module);
    let mut refused: Vec<ExplainedRefusal> = here
        .map(|refusal| ExplainedRefusal {
            place_m: product.frame.place_m(refusal.post),
            residual_m: metres_of_quanta(refusal.residual as i32),
            by: refusal.by,
        })
        .collect();
    refused.sort_by(|a, b| b.residual_m.total_cmp(&a.residual_m));
    refused
}

fn one_more(product: &Product, own: &Compared, others: &[Compared]) -> Option<OneMore> {
    let (split, ModuleResidual { posts, sum_squared, .. }) = (own.split?, own.measured?);
    let gains = others.iter().filter_map(|other| other.split);
    let larger = gains.filter(|other| split.squares_saved < other.squares_saved).count();
    let metre = f64::from(QUANTA_PER_METRE);
    let rms_m = |squares: f64| (squares.max(0.0) / f64::from(posts.max(1))).sqrt() / metre;
    Some(OneMore {
        place_m: product.frame.place_m(split.post),
        raised_m: split.raised / metre,
        rms_before_m: rms_m(sum_squared as f64),
        rms_after_m: rms_m(sum_squared as f64 - split.squares_saved),
        place: larger + 1,
    })
}

/// Roads and water in a load module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExplainedFeatures {
    /// Triangles reserved for features, by class.
    pub cost: Vec<(String, u32)>,
    /// All of them as a share of the limit of a load module.
    pub share: f64,
    /// The most that features may take of it.
    pub share_max: f64,
    /// The most that they may take of it where one goes in that is no motorway, primary road, rail, river or large
    /// lake.
    pub share_others: f64,
    /// Cubic metres cut and filled in it, by class.
    pub moved_m3: Vec<(String, [f64; 2])>,
    /// Features that lie more than 3 m off the ground in it, each at its worst place, the farthest first.
    pub far_off: Vec<FeatureFarOff>,
    /// What was mended, degraded or left out in it.
    pub remarks: Vec<FeatureRemark>,
    /// Stretches from junction to junction, and bodies of water, that touch it and are not in the ground.
    pub left_out: Vec<FeatureLeftOut>,
}

/// Those of a load module; nothing of a job without features.
pub(crate) fn explained_features(product: &Product, id: ModuleId, extent_m: [f64; 4]) -> Option<ExplainedFeatures> {
    let ((level, remarks), spec) = (product.features.as_ref()?, product.job.features.as_ref()?);
    let (names, place) = (product.job.class_names(), product.grid.index(id) as u32);
    let name = |class: u8| names.get(usize::from(class)).cloned().unwrap_or_default();
    let here = level.cost.iter().filter(|(module, ..)| *module == place);
    let cost: Vec<(String, u32)> = here.map(|&(_, class, triangles)| (name(class), triangles)).collect();
    let total: u32 = cost.iter().map(|(_, triangles)| triangles).sum();
    let [west, south, east, north] = extent_m;
    let lies_here =
        |remark: &&FeatureRemark| remark.at_m.is_some_and(|[x, y]| west <= x && x <= east && south <= y && y <= north);
    let touches = |left: &&FeatureLeftOut| {
        left.lines.iter().flatten().any(|[x, y, _]| west <= *x && *x <= east && south <= *y && *y <= north)
    };
    Some(ExplainedFeatures {
        cost,
        share: f64::from(total) / f64::from(product.job.limits.per_load_module.max(1)),
        share_max: spec.share_main.max(spec.share_max),
        share_others: spec.share_max,
        moved_m3: level
            .moved
            .iter()
            .filter(|of| of.0 == place)
            .map(|&(_, class, moved)| (name(class), moved))
            .collect(),
        far_off: level.far_off.iter().filter(|far| far.module == place).cloned().collect(),
        remarks: remarks.iter().filter(lies_here).cloned().collect(),
        left_out: level.left_out.iter().filter(touches).cloned().collect(),
    })
}

/// What stands on a load module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExplainedObjects {
    /// By kind: pieces, and the polygons that they count.
    pub kinds: Vec<(&'static str, [u64; 2])>,
    /// The limit of a load module.
    pub limit: u32,
    /// What begins in it and had no room, what hides most first.
    pub left_out: Vec<ObjectLeftOut>,
    /// What was mended or left out in it.
    pub remarks: Vec<FeatureRemark>,
}

/// That of a load module; nothing of a job without objects.
fn explained_objects(
    folder: &Folder,
    product: &Product,
    module: &LoadModule,
    [west, south, east, north]: [f64; 4],
) -> Result<Option<ExplainedObjects>, CompileError> {
    let Some(spec) = &product.job.objects else { return Ok(None) };
    let (_, _, outlines) = folder.read_outlines()?;
    let mut kinds: BTreeMap<ObjectKind, [u64; 2]> = BTreeMap::new();
    let of_prisms = module.objects.prisms.iter().map(|prism| (prism.kind, prism.polygons()));
    let of_canopies = module.objects.canopies.iter().map(|canopy| (canopy.kind, canopy.triangles.len()));
    for (kind, polygons) in of_prisms.chain(of_canopies) {
        let [count, all] = kinds.entry(kind).or_default();
        (*count, *all) = (*count + 1, *all + polygons as u64);
    }
    let is_here = |[x, y]: [f64; 2]| west <= x && x <= east && south <= y && y <= north;
    Ok(Some(ExplainedObjects {
        kinds: kinds.into_iter().map(|(kind, counts)| (kind.name(), counts)).collect(),
        limit: spec.per_load_module,
        left_out: outlines.left_out.into_iter().filter(|left| is_here(left.at_m)).collect(),
        remarks: outlines.remarks.into_iter().filter(|remark| remark.at_m.is_some_and(is_here)).collect(),
    }))
}
