//! Fidelity of a finished database or of a plain mesh, always beside the regular grid of as many triangles.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use compiler::CompileError;
use database::{Fingerprint, Folder, Manifest, ManifestState, SourceRecord, Totals};
use fidelity::{DemGround, Measures, ResidualFigures, Triangles, regular_grid};
use ground::{GamingArea, Ground, Window};
use job::{AreaShape, DemSource, Job, NamedFile, SourceEntry, SourceFile, SourceSaid, Voids};
use schedule::Workers;
use terrain::{Dem, Importance, Metres, QUANTA_PER_METRE, Tin};

use crate::verify::{job_of, read_modules};

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
    /// What it is measured against: the terrain it was built from, or a raster.
    pub against: String,
    /// Residuals as the build measured them, against its own ground.
    pub residual: BuiltResidual,
    /// All measures, those of residuals too.
    pub measures: Fidelity,
    /// Why residuals are not told by class, where the job has classes: a file that says which ground is which is gone.
    pub no_classes: Option<String>,
}

/// Residuals that `database.json` keeps, in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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

/// Measures the load modules of a finished database against the ground it was built from, or against the raster
/// `against`. The heights of the whole area are held at once, 4 bytes a post.
///
/// # Errors
/// When the database is missing, unfinished or damaged, or the ground cannot be found or used.
pub fn fidelity(folder: &Path, against: Option<&Path>, sights: Sights) -> Result<DatabaseFidelity, CompileError> {
    let folder = Folder::new(folder);
    let manifest = folder.manifest()?;
    if manifest.state != ManifestState::Complete {
        return Err(CompileError::Unfinished { path: folder.dir().display().to_string() });
    }
    let (mut job, area) = job_of(&manifest, folder.dir())?;
    // No point that was given changes a figure, and weights do not; classes do.
    (job.tin.start, job.tin.pins) = (None, None);
    let against = choose_ground(&mut job, &manifest, folder.dir(), against)?;
    let no_classes = locate_weights(&mut job, &manifest, folder.dir()).err().map(|error| error.to_string());
    if no_classes.is_some() {
        job.importance.areas.clear();
    }
    let ground = Ground::open(&job, &area, &Workers::new(1), &AtomicBool::new(false))?;
    let Window { dem, importance, .. } = ground.window(area.rect)?;
    if dem.void_count() == area.rect.post_count() {
        return Err(CompileError::Impossible {
            key: against,
            found: "no height anywhere in the area of the database".into(),
            expected: "a raster that covers at least a part of it".into(),
            hint: "`tiefort status` says where the area lies".into(),
        });
    }
    let (triangles, polygons) = triangles_of(&folder, &area)?;
    let residual = built_residual(&manifest.totals);
    let spacing = Metres(area.frame.spacing.metres());
    let classes = (!job.importance.areas.is_empty()).then_some((&job.importance.classes[..], &importance));
    let subject = Subject { dem: &dem, triangles: &triangles, polygons, spacing, classes };
    let measures = compare(&subject, sights, Some(area.grid.side_cells));
    Ok(DatabaseFidelity { area: manifest.area.name, against, residual, measures, no_classes })
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

/// The triangles of all load modules, and how many polygons they count.
fn triangles_of(folder: &Folder, area: &GamingArea) -> Result<(Triangles, u64), CompileError> {
    let modules = read_modules(folder, area)?;
    let missing = area.grid.all().iter().find(|module| !modules.contains_key(module));
    if let Some(module) = missing {
        return Err(CompileError::Impossible {
            key: folder.dir().display().to_string(),
            found: format!("no load module {module} in its files"),
            expected: format!("all {} of the area", area.grid.count()),
            hint: "the database is damaged: `tiefort verify` says where, `tiefort build --fresh` makes it anew".into(),
        });
    }
    let polygons = modules.values().map(|module| u64::from(module.polygon_count)).sum();
    Ok((Triangles::of_modules(modules.values(), area.grid, area.frame.spacing), polygons))
}

/// Points the job at the ground to measure against, and gives its name. What is void in a raster of one's own choice
/// is left out.
pub(crate) fn choose_ground(
    job: &mut Job,
    manifest: &Manifest,
    folder: &Path,
    against: Option<&Path>,
) -> Result<String, CompileError> {
    let water = job.dem.water.as_mut().map(|water| &mut water.file);
    let shaping = job.dem.geoids.iter_mut().map(|geoid| &mut geoid.file).chain(water);
    locate(shaping, manifest, folder)?;
    if let Some(path) = against {
        let (written, said) = (path.display().to_string(), SourceSaid::default());
        let files = vec![SourceFile { written: written.clone(), path: path.into(), said: said.clone() }];
        job.dem.source = DemSource::Files { written: vec![SourceEntry { name: written.clone(), said }], files };
        job.dem.voids = Voids::Hole;
        return Ok(written);
    }
    match &mut job.dem.source {
        DemSource::Sample { seed } => Ok(format!("the sample terrain, seed {seed}")),
        DemSource::Files { files, .. } => {
            for (index, file) in files.iter_mut().enumerate() {
                file.path = find_source(manifest.sources.get(index), folder)?;
            }
            let names: Vec<String> = files.iter().map(|file| file.path.display().to_string()).collect();
            Ok(names.join(", "))
        }
    }
}

/// Points names at the files that a database was built from.
fn locate<'a>(
    files: impl Iterator<Item = &'a mut NamedFile>,
    manifest: &Manifest,
    folder: &Path,
) -> Result<(), CompileError> {
    for file in files {
        let record = manifest.sources.iter().find(|record| record.path == file.written);
        file.path = find_source(record, folder)?;
    }
    Ok(())
}

/// Points the job at the files that say what ground weighs; what tiles started from changes nothing any more.
pub(crate) fn locate_weights(job: &mut Job, manifest: &Manifest, folder: &Path) -> Result<(), CompileError> {
    job.tin.start = None;
    let named = job.importance.areas.iter_mut().filter_map(|area| match &mut area.shape {
        AreaShape::Polygons { file } | AreaShape::RasterValue { file, .. } => Some(file),
        AreaShape::Slope { .. } | AreaShape::Sample(_) => None,
    });
    locate(named.chain(job.tin.pins.as_mut()), manifest, folder)
}

/// A raster a database was built from. Its path is written as the job has it, and the job may have lain anywhere; but
/// its content is known, so any file with that content is the one.
fn find_source(record: Option<&SourceRecord>, folder: &Path) -> Result<PathBuf, CompileError> {
    let missing = |found: String| CompileError::Impossible {
        key: folder.join(database::files::DATABASE).display().to_string(),
        found,
        expected: "the raster the database was built from".into(),
        hint: "name the raster to measure against: --against FILE".into(),
    };
    let Some(record) = record else { return Err(missing("no source".into())) };
    let beside = std::path::absolute(folder).ok().and_then(|folder| folder.parent().map(Path::to_path_buf));
    let here = PathBuf::from(&record.path);
    let places: Vec<PathBuf> = beside.iter().map(|folder| folder.join(&record.path)).chain([here]).collect();
    let mut other = None;
    for place in &places {
        match source_files::content(place).map(Fingerprint::of_reader) {
            Ok(Ok(content)) if content == record.blake3 => return Ok(place.clone()),
            Ok(_) => other = Some(place),
            Err(_) => {}
        }
    }
    Err(missing(match other {
        Some(place) => format!("{}, whose content has changed since the build", place.display()),
        None => format!("the source {:?}, which is neither beside the database nor here", record.path),
    }))
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
