//! Fidelity of a finished database or of a plain mesh, always beside the regular grid of as many triangles.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use build::CompileError;
use build::ground::{GamingArea, Ground, GroundError, Window};
use build::product::{Opened, choose_ground, locate_weights};
use fidelity::{DemGround, Measures, ResidualFigures, Triangles, regular_grid};
use schedule::Workers;
use serde::Serialize;
use store::{Folder, Manifest, Totals};
use terrain::{Dem, Importance, LoadModule, Metres, ModuleId, QUANTA_PER_METRE, Tin};

use crate::status::is_outdated;

/// Which pairs of places a line of sight is tried between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sights {
    /// How many.
    pub pairs: u32,
    /// What they are drawn from; the same seed gives the same pairs.
    pub seed: u64,
}

impl Sights {
    /// Enough for a half width of about 0.35 % of agreement.
    pub const USUAL: Self = Self { pairs: 20_000, seed: 1 };
}

/// Residuals on the ground of one class.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassResidual {
    /// Its name.
    pub name: String,
    /// Those of the surface.
    pub tin: ResidualFigures,
    /// Those of the regular grid.
    pub grid: ResidualFigures,
}

/// How true a surface is to a DEM, and the regular grid beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Fidelity {
    /// The surface.
    pub tin: Measures,
    /// The regular grid over the same DEM with about as many triangles as the surface has polygons.
    pub grid: Measures,
    /// Posts between the vertices of that grid.
    pub grid_step: i32,
    /// Metres between posts.
    pub spacing_m: f64,
    /// Polygons of the surface, by the count its limits use.
    pub polygons: u64,
    /// The classes of the ground that have posts, where there are several.
    pub classes: Vec<ClassResidual>,
}

/// How true a database is.
#[derive(Clone, Debug, PartialEq)]
pub struct DatabaseFidelity {
    /// Name of the area.
    pub area: String,
    /// What it is measured against: the terrain it was built from, or rasters.
    pub against: String,
    /// Share of the posts of the area at which that has a height.
    pub covered: f64,
    /// Whether that has features or water burned into it: never a raster that was named.
    pub is_burned: bool,
    /// Whether some of its tiles were made from other ground than the rest, as `report.json` says.
    pub is_outdated: bool,
    /// Residuals as the build measured them, against its own ground.
    pub residual: BuiltResidual,
    /// Residuals at the posts of the raster itself, where those are others than the posts of the working grid.
    pub at_own_posts: Option<ResidualFigures>,
    /// All measures, those of residuals too.
    pub measures: Fidelity,
    /// What objects hide, in databases with some.
    pub past_objects: Option<PastObjectsFound>,
    /// Why residuals are not told by class, where the job has classes: a file that says which ground is which is gone.
    pub no_classes: Option<String>,
}

/// How many of the pairs of the line-of-sight test are seen over the load modules, and past what stands on them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PastObjectsFound {
    /// Pairs of places.
    pub pairs: u64,
    /// Seen over the ground and decks alone.
    pub over_ground: u64,
    /// Past buildings and walls, too.
    pub past_buildings: u64,
    /// Past woods, too, with half of the light or more.
    pub past_all: u64,
}

/// What objects of a database hide of the pairs that lines of sight are tested with.
fn past_objects(folder: &Folder, area: &GamingArea, sights: Sights) -> Result<PastObjectsFound, CompileError> {
    use load_module_reader::{Area, Curvature, Keep, PastObjects, Sight, Standing};
    let damaged = |error| {
        let (path, fault) = (folder.dir().join("modules"), Box::new(error));
        CompileError::from(store::DatabaseError::Modules { path, fault })
    };
    let opened = Area::open(folder.dir(), Keep::OnDisk).map_err(damaged)?;
    let ground = opened.load(opened.whole()).map_err(damaged)?;
    let spacing = Metres(area.frame.spacing.metres());
    let origin = [area.frame.origin_east_m, area.frame.origin_north_m];
    let mut found = PastObjectsFound::default();
    for pair in fidelity::drawn_pairs(area.rect, spacing, sights.pairs, sights.seed).flatten() {
        let ends = pair.map(|place| {
            let [east, north] = [0, 1].map(|axis| origin[axis] + place[axis] * spacing.0);
            ground.height_m([east, north]).map(|height_m| [east, north, height_m + fidelity::EYE_M])
        });
        let [Some(from), Some(to)] = ends else { continue };
        let sees = |standing| {
            let past = PastObjects { standing, ..PastObjects::all(Curvature::NONE) };
            ground.sight_past(from, to, &past).sight == Sight::Free
        };
        found.pairs += 1;
        if sees(Standing::None) {
            found.over_ground += 1;
            found.past_buildings += u64::from(sees(Standing::Buildings));
            found.past_all += u64::from(sees(Standing::All));
        }
    }
    Ok(found)
}

/// Residuals that `database.json` keeps, in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BuiltResidual {
    /// Posts measured.
    pub posts: u64,
    /// Root mean square.
    pub rms_m: f64,
    /// Mean absolute one.
    pub mean_abs_m: f64,
    /// Largest absolute one.
    pub max_m: f64,
}

/// Measures the load modules of a finished database against the ground it was built from, or against the rasters
/// `against` where there are some. The heights of the whole area are held at once, 4 bytes a post.
///
/// # Errors
/// When the database is missing, unfinished or damaged, or the ground cannot be found or used.
pub fn fidelity(folder: &Path, against: &[PathBuf], sights: Sights) -> Result<DatabaseFidelity, CompileError> {
    let Opened { folder, manifest, mut job, area } = Opened::open(folder)?;
    // No point that was given changes a figure, and weights do not; classes do.
    (job.tin.start, job.tin.pins) = (None, None);
    let against = choose_ground(&mut job, &manifest, folder.dir(), against)?;
    let no_classes = locate_weights(&mut job, &manifest, folder.dir()).err().map(|error| error.to_string());
    if no_classes.is_some() {
        job.importance.areas.clear();
    }
    let ground = Ground::open_built(&job, &area, (&Workers::new(1), &AtomicBool::new(false)), &folder)?;
    let Window { dem, importance, .. } = ground.window(area.rect)?;
    if dem.void_count() == area.rect.post_count() {
        return Err(GroundError::Impossible {
            key: against,
            found: "no height anywhere in the area of the database".into(),
            expected: "a raster that covers at least a part of it".into(),
            hint: "`tiefort status` says where the area lies".into(),
        }
        .into());
    }
    let covered = covered(&dem);
    let (modules, polygons) = modules_of(&folder, &manifest, &area)?;
    let at_own_posts = at_own_posts(&ground, &area, &modules)?;
    let triangles = Triangles::of_modules(modules.iter(), area.grid, area.frame.spacing);
    drop(modules);
    let residual = built_residual(&manifest.totals);
    let spacing = Metres(area.frame.spacing.metres());
    let classes = (!job.importance.areas.is_empty()).then_some((&job.importance.classes[..], &importance));
    let subject = Subject { dem: &dem, triangles: &triangles, polygons, spacing, classes };
    let measures = compare(&subject, sights, Some(area.grid.side_cells));
    let past_objects = job.objects.is_some().then(|| past_objects(&folder, &area, sights)).transpose()?;
    let is_burned = job.features.is_some() || job.dem.water.is_some();
    let (area, is_outdated) = (manifest.area.name, is_outdated(&folder));
    Ok(DatabaseFidelity {
        area,
        against,
        covered,
        is_burned,
        is_outdated,
        residual,
        at_own_posts,
        measures,
        past_objects,
        no_classes,
    })
}

/// The share of posts at which a DEM has a height.
pub(crate) fn covered(dem: &Dem) -> f64 {
    1.0 - dem.void_count() as f64 / dem.rect().post_count() as f64
}

/// Measures a mesh against the raster it was made from, whose posts are so far apart.
pub fn measure(tin: &Tin, dem: &Dem, spacing: Metres, sights: Sights) -> Fidelity {
    let triangles = &Triangles::of_tin(tin);
    let polygons = triangles.count() as u64;
    compare(&Subject { dem, triangles, polygons, spacing, classes: None }, sights, None)
}

/// What is measured.
struct Subject<'a> {
    dem: &'a Dem,
    triangles: &'a Triangles,
    polygons: u64,
    spacing: Metres,
    /// Names of classes, and which ground is which.
    classes: Option<(&'a [String], &'a Importance)>,
}

fn compare(subject: &Subject, sights: Sights, module_cells: Option<i32>) -> Fidelity {
    let &Subject { dem, triangles, polygons, spacing, classes } = subject;
    let rect = triangles.rect();
    let ground = DemGround::new(dem, rect, spacing);
    let measured = |triangles: &Triangles, cells| ground.measure(triangles, sights.pairs, sights.seed, cells);
    let regular = regular_grid(dem, rect, polygons);
    let grid = Triangles::of_tin(&regular.tin);
    // Where its step does not divide a load module, the grid has no edges along lines between them.
    let grid_cells = module_cells.filter(|cells| cells % regular.step == 0);
    let by_class = |(names, importance): (&[String], &Importance)| -> Vec<ClassResidual> {
        let of = |triangles| ground.residuals_by_class(triangles, |post| importance.class(post));
        let all = names.iter().zip(of(triangles).into_iter().zip(of(&grid)));
        let classes = all.map(|(name, (tin, grid))| ClassResidual { name: name.clone(), tin, grid });
        let mut classes: Vec<_> = classes.filter(|class| 0 < class.tin.posts).collect();
        if classes.len() == 1 {
            classes.clear();
        }
        classes
    };
    Fidelity {
        tin: measured(triangles, module_cells),
        grid: measured(&grid, grid_cells),
        grid_step: regular.step,
        spacing_m: spacing.0,
        polygons,
        classes: classes.map(by_class).unwrap_or_default(),
    }
}

/// Residuals at the posts of the raster that is measured against; `None` where those are the working grid's.
fn at_own_posts(
    ground: &Ground,
    area: &GamingArea,
    modules: &[LoadModule],
) -> Result<Option<ResidualFigures>, CompileError> {
    let found = ground.relief.residuals_at_source(modules, area, area.rect)?;
    Ok(found.as_ref().map(ResidualFigures::from))
}

/// All load modules, and how many polygons they count.
fn modules_of(folder: &Folder, manifest: &Manifest, area: &GamingArea) -> Result<(Vec<LoadModule>, u64), CompileError> {
    let modules = read_modules(folder, manifest)?;
    let missing = area.grid.all().iter().find(|module| !modules.contains_key(module));
    if let Some(module) = missing {
        return Err(GroundError::Impossible {
            key: folder.dir().display().to_string(),
            found: format!("no load module {module} in its files"),
            expected: format!("all {} of the area", area.grid.count()),
            hint: "the database is damaged: `tiefort verify` says where, `tiefort build --fresh` makes it anew".into(),
        }
        .into());
    }
    let polygons = modules.values().map(|module| u64::from(module.polygon_count)).sum();
    Ok((modules.into_values().collect(), polygons))
}

fn built_residual(totals: &Totals) -> BuiltResidual {
    if totals.residual_posts == 0 {
        return BuiltResidual::default();
    }
    let (posts, metre) = (totals.residual_posts as f64, f64::from(QUANTA_PER_METRE));
    BuiltResidual {
        posts: totals.residual_posts,
        rms_m: (totals.residual_sum_squared as f64 / posts).sqrt() / metre,
        mean_abs_m: totals.residual_sum_abs as f64 / posts / metre,
        max_m: totals.residual_largest as f64 / metre,
    }
}

/// All load modules by place, at their finest level, checked one by one as they are decoded.
pub(crate) fn read_modules(
    folder: &Folder,
    manifest: &Manifest,
) -> Result<BTreeMap<ModuleId, LoadModule>, CompileError> {
    let mut all = BTreeMap::new();
    for record in &manifest.tiles {
        let (_, modules) = folder.read_modules(manifest, record.tile())?;
        all.extend(modules.into_iter().map(|module| (module.id, module)));
    }
    Ok(all)
}
