//! The job: plain values, resolved and checked.

use std::path::{Path, PathBuf};

use terrain::{
    Effort, HeightFit, LastBatch, Lattice, LoadModule, MaterialName, ModuleGrid, QUANTA_PER_METRE, Resampling, Spacing,
    TileOrder,
};

use crate::{FeaturesSpec, GeoidSpec, ImportanceSpec, LodSpec, NamedFile, ObjectsSpec, Start, WaterSpec};

/// All a run needs, as the job file says it, defaults filled in.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// The job file.
    pub path: PathBuf,
    /// The gaming area and its working grid.
    pub area: Area,
    /// Where heights come from.
    pub dem: DemSpec,
    /// Where ground matters more.
    pub importance: ImportanceSpec,
    /// Roads, rivers and lakes that become parts of the ground; none where the job has no such section.
    pub features: Option<FeaturesSpec>,
    /// What stands on the ground; nothing where the job has no such section.
    pub objects: Option<ObjectsSpec>,
    /// How the work is cut.
    pub tiles: TilesSpec,
    /// What the product is cut into.
    pub modules: ModulesSpec,
    /// What the simulator cannot exceed.
    pub limits: LimitsSpec,
    /// How posts are chosen.
    pub tin: TinSpec,
    /// Coarser levels of load modules.
    pub lod: LodSpec,
    /// What exports call materials, sorted by what these are.
    pub materials: Vec<MaterialName>,
}

impl Job {
    /// Names of the classes of triangles, by number: those of the ground, then those of features.
    pub fn class_names(&self) -> Vec<String> {
        match &self.features {
            Some(features) => features.classes_after(&self.importance),
            None => self.importance.classes.clone(),
        }
    }

    /// Whether roads, rivers or lakes may have a class, by its index in [`Self::class_names`].
    pub fn is_of_features(&self, class: u8) -> bool {
        let is_of_lakes = self.dem.water.as_ref().is_some_and(|water| water.class == class);
        let name = self.class_names().into_iter().nth(class.into());
        let is_of = |features: &FeaturesSpec| name.is_some_and(|name| features.classes().contains(&name));
        is_of_lakes || self.features.as_ref().is_some_and(is_of)
    }
}

/// The gaming area and its working grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Area {
    /// Name of the area: letters, digits, `-`, `_` and `.`, fit for a file name.
    pub name: String,
    /// What stands above the report's page; the name where the job gives none.
    pub title: Option<String>,
    /// EPSG code of the projected coordinate system, in metres.
    pub epsg: u32,
    /// East and north of the south-west post, in metres.
    pub origin_m: [f64; 2],
    /// Distance between posts of the working grid.
    pub spacing: Spacing,
    /// Load modules that make up the area.
    pub grid: ModuleGrid,
}

/// Where heights come from.
#[derive(Clone, Debug, PartialEq)]
pub struct DemSpec {
    /// The built-in terrain or files.
    pub source: DemSource,
    /// What the heights of the product are measured from; sources that say something else are refused.
    pub vertical_datum: Option<String>,
    /// What to do about posts without a height.
    pub voids: Voids,
    /// Whether a void is first given the height of the next source that has one.
    pub next_source: bool,
    /// How a height between posts of a source comes about.
    pub resampling: Resampling,
    /// Over how many metres from its edge a source fades into those after it; 0 for a plain seam.
    pub feather_m: f64,
    /// Grids for converting between vertical datums.
    pub geoids: Vec<GeoidSpec>,
    /// Water that is to lie level.
    pub water: Option<WaterSpec>,
    /// Whether damage that could be warned about is an error. Asked for on the command line, not in the job's text.
    pub strict: bool,
}

/// The built-in terrain or files.
#[derive(Clone, Debug, PartialEq)]
pub enum DemSource {
    /// The built-in basin-and-range terrain.
    Sample {
        /// Seed of the terrain.
        seed: u64,
    },
    /// Rasters on disk.
    Files {
        /// Names and patterns as written in the job, with what it says about them.
        written: Vec<SourceEntry>,
        /// The files, in order of priority, none twice.
        files: Vec<SourceFile>,
    },
}

/// One entry of `dem.sources`.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceEntry {
    /// The name or pattern.
    pub name: String,
    /// What the job says about its files.
    pub said: SourceSaid,
}

/// A raster that the job names, or that a pattern of it found.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceFile {
    /// As in [`NamedFile`].
    pub written: String,
    /// As in [`NamedFile`].
    pub path: PathBuf,
    /// What the job says about it.
    pub said: SourceSaid,
}

/// What a job says about a raster, over what the raster says itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SourceSaid {
    /// Its coordinate system, as `EPSG:4326` or well-known text.
    pub crs: Option<String>,
    /// Latitude and longitude of the south-west post, in degrees, of an HGT tile whose name does not say.
    pub corner: Option<[f64; 2]>,
    /// Metres in a unit of height.
    pub height_unit_m: Option<f64>,
    /// The value that marks a void.
    pub nodata: Option<f64>,
    /// What its heights are measured from, as `EGM96`, `EGM2008`, `NAVD88` or `ellipsoid`.
    pub vertical_datum: Option<String>,
    /// Whom to thank, or the licence.
    pub attribution: Option<String>,
}

/// What to do about posts without a height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Voids {
    /// Any void inside the area is an error.
    Fail,
    /// Voids with a height within this many posts are filled from it; any other void is an error.
    FillWithinPosts(u32),
    /// Voids with a height within this many posts are filled from it; any other is a hole.
    FillThenHole(u32),
    /// Voids, and ground that no source reaches, have no weight and are in no statistic.
    Hole,
}

/// How the work is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TilesSpec {
    /// Rows of tiles; each is at least two load modules high, or there is one.
    pub rows: u32,
    /// Columns of tiles; each is at least two load modules wide, or there is one.
    pub columns: u32,
    /// What the rank of a tile is.
    pub order: TileOrder,
    /// What a tile finds on its sides.
    pub borders: Borders,
}

/// What a tile finds on its sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Borders {
    /// The points its neighbours of lower rank chose.
    Inherit,
    /// A point every border step, and no others.
    Regular,
}

/// What the product is cut into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModulesSpec {
    /// Side of a load module in metres; its cells are [`ModuleGrid::side_cells`].
    pub side_m: f64,
    /// Side in quanta of 1/128 m.
    pub side_quanta: u16,
    /// Distance between initial points on the outer border, in metres.
    pub border_step_m: f64,
    /// The same in cells of the working grid.
    pub border_step_cells: i32,
    /// Which points the outer border of the area has.
    pub outer_border: OuterBorder,
    /// How load modules get their sides.
    pub edges: Edges,
    /// The newest version that their files may have: 2 without lines of ways, 3 with them.
    pub format: u32,
}

/// Which points the outer border of the area has, beside the corners of load modules.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OuterBorder {
    /// Those that the ground asks for, within the limits.
    Refined,
    /// One every border step, and no others: areas that are built apart meet there.
    Fixed,
}

/// How load modules get their sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edges {
    /// Module lines are edges of the TIN from the start.
    Constrained,
    /// Triangles are cut at module lines after merging.
    Clip(ClipHeights),
}

/// Height of a vertex that clipping makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClipHeights {
    /// On the plane of the clipped triangle.
    Coplanar,
    /// Interpolated from the DEM.
    Dem,
}

/// What the simulator cannot exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitsSpec {
    /// What the limits count.
    pub count: Count,
    /// In one load module.
    pub per_load_module: u32,
    /// Above `per_load_module`, in the whole area together.
    pub pool: u64,
    /// Mean over all load modules.
    pub mean_per_load_module: f64,
    /// In every window of load modules.
    pub window: WindowLimit,
}

/// A limit for every window of load modules.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WindowLimit {
    /// In one window.
    pub limit: u32,
    /// Rows of load modules in a window: those that cover 4 km, cut to the area.
    pub rows: u32,
    /// Columns of load modules in a window: those that cover 4 km, cut to the area.
    pub cols: u32,
}

/// What the limits count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// Triangles, clipped pieces fanned.
    Triangles,
    /// Convex polygons, as clipping leaves them.
    Polygons,
}

impl Job {
    /// Whether objects count in the limits of the ground.
    pub fn counts_objects(&self) -> bool {
        self.objects.as_ref().is_some_and(|objects| objects.joint)
    }

    /// The words for what limits count.
    pub fn counted_words(&self) -> &'static str {
        match (self.limits.count, self.counts_objects()) {
            (Count::Triangles, false) => "triangles",
            (Count::Polygons, false) => "polygons",
            (Count::Triangles, true) => "triangles and objects",
            (Count::Polygons, true) => "polygons and objects",
        }
    }

    /// What a load module has of what limits count: decks too, and objects where they count together with the ground.
    pub fn counted(&self, module: &LoadModule) -> u32 {
        let counts = module.counts();
        let ground = match self.limits.count {
            Count::Triangles => counts.triangles,
            Count::Polygons => counts.polygons,
        };
        ground + if self.counts_objects() { module.objects.polygons() as u32 } else { 0 }
    }
}

/// How posts are chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct TinSpec {
    /// By which method.
    pub method: Method,
    /// What makes a post, or the triangle it lies in, worth a point.
    pub key: ErrorKey,
    /// What ends the choosing, apart from residuals.
    pub budget: Budget,
    /// How the budget is shared among tiles.
    pub allocation: Allocation,
    /// Residuals are rounded to this many quanta of 1/128 m before they are compared.
    pub residual_quantum: u32,
    /// The largest residual at which choosing may end, in metres.
    pub max_residual_m: Option<f64>,
    /// The RMS residual over the area at which choosing may end, in metres.
    pub target_rms_m: Option<f64>,
    /// What tiles start from beside corners and borders.
    pub start: Option<Start>,
    /// Points to add and to leave out, heights, and ground that matters more or less.
    pub pins: Option<NamedFile>,
}

/// By which method posts are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// The paper's: all posts of the largest residual at once, those too near a vertex left out.
    Paper {
        /// How near is too near; `None` leaves none out.
        proximity: Option<Proximity>,
        /// What becomes of a batch that exceeds the budget.
        last_batch: LastBatch,
    },
    /// One worst post at a time.
    Greedy,
    /// Lowest RMS residual under the limits.
    Optimised(Optimising),
}

/// The methods, without what each of them may be told besides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodName {
    /// [`Method::Optimised`].
    Optimised,
    /// [`Method::Paper`].
    Paper,
    /// [`Method::Greedy`].
    Greedy,
}

/// What the optimised method may do for a lower residual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Optimising {
    /// How much work it does.
    pub effort: Effort,
    /// Which vertices leave the height of the DEM.
    pub height_fit: HeightFit,
    /// Where vertices stand.
    pub lattice: Lattice,
    /// Whose lines of sight count, if any do.
    pub sight: Option<Sight>,
}

/// Lines of sight that are to be as they are on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sight {
    /// The lowest and the highest eye, and what they look at, above the ground in quanta of 1/128 m.
    pub eyes_quanta: [i32; 2],
    /// How far they look, in quanta.
    pub range_quanta: i32,
}

impl Sight {
    /// Whether lines of sight count where nothing says it: they would take a good part of a fast build.
    pub fn is_usual_with(effort: Effort) -> bool {
        effort != Effort::Fast
    }

    /// Of eyes between two heights, and a range, in metres.
    pub(crate) fn of_metres(eyes: [f64; 2], range: f64) -> Self {
        let quanta = |metres: f64| (metres * f64::from(QUANTA_PER_METRE)).round() as i32;
        Self { eyes_quanta: eyes.map(quanta), range_quanta: quanta(range) }
    }
}

/// A post this near a vertex both ways is left out of a batch. Both bounds are inclusive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proximity {
    /// Over the ground, in metres.
    pub horizontal_m: f64,
    /// In height, in metres.
    pub vertical_m: f64,
}

/// What makes a post worth a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKey {
    /// The largest weighted residual.
    Max,
    /// The sum of squared residuals in its triangle.
    Sse,
}

/// What ends the choosing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Budget {
    /// This many selected points in the whole area, pins included.
    Points(u64),
    /// As many triangles as the limits allow.
    Limits,
}

/// How the budget is shared among tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Allocation {
    /// The same for every tile.
    Equal,
    /// By what a survey of all tiles says they gain.
    Global,
}

impl Method {
    /// Its name.
    pub(crate) fn name(self) -> MethodName {
        match self {
            Method::Paper { .. } => MethodName::Paper,
            Method::Greedy => MethodName::Greedy,
            Method::Optimised(_) => MethodName::Optimised,
        }
    }
}

impl Job {
    /// Cells between the points that every build puts on the outer border; the side of a load module where there are
    /// only its corners.
    pub fn outer_step_cells(&self) -> i32 {
        match self.modules.outer_border {
            OuterBorder::Refined => self.area.grid.side_cells,
            OuterBorder::Fixed => self.modules.border_step_cells,
        }
    }

    /// The folder that paths in the job are relative to.
    pub(crate) fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }
}

impl Area {
    /// Width and height in metres, east then north.
    pub fn size_m(&self) -> [f64; 2] {
        let metres = |modules: u32| f64::from(modules) * f64::from(self.grid.side_cells) * self.spacing.metres();
        [metres(self.grid.cols), metres(self.grid.rows)]
    }
}

impl LimitsSpec {
    /// Triangles (or polygons) that `mean_per_load_module` allows the whole area, rounded down.
    pub fn area_budget(&self, grid: &ModuleGrid) -> u64 {
        (self.mean_per_load_module * grid.count() as f64).floor() as u64
    }
}
