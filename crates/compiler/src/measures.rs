//! Fidelity of a finished database or of a plain mesh, always beside the regular grid of as many triangles.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use database::{Fingerprint, Folder, Manifest, ManifestState, SourceRecord, Totals};
use fidelity::{DemGround, Measures, Triangles, regular_grid};
use job::{DemSource, Job, NamedFile, SourceEntry, SourceFile, SourceSaid, Voids};
use schedule::Workers;
use terrain::{Dem, Metres, QUANTA_PER_METRE};

use crate::area::GamingArea;
use crate::ground::Ground;
use crate::verify::{job_of, read_modules};
use crate::{CompileError, Mesh};

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

/// How true a surface is to a DEM, and the regular grid beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    // No weight and no point that was given changes a figure.
    job.importance.areas.clear();
    (job.tin.start, job.tin.pins) = (None, None);
    let against = choose_ground(&mut job, &manifest, folder.dir(), against)?;
    let ground = Ground::open(&job, &area, &Workers::new(1), &AtomicBool::new(false))?;
    let dem = ground.window(area.rect)?.dem;
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
    let measures = compare(&dem, &triangles, polygons, spacing, sights, Some(area.grid.side_cells));
    Ok(DatabaseFidelity { area: manifest.area.name, against, residual, measures })
}

/// Measures a mesh against the raster it was made from.
pub fn measure(mesh: &Mesh, sights: Sights) -> Fidelity {
    let triangles = Triangles::of_tin(&mesh.tin);
    compare(&mesh.dem, &triangles, triangles.count() as u64, Metres(mesh.spacing_m.0), sights, None)
}

fn compare(
    dem: &Dem,
    triangles: &Triangles,
    polygons: u64,
    spacing: Metres,
    sights: Sights,
    module_cells: Option<i32>,
) -> Fidelity {
    let rect = triangles.rect();
    let ground = DemGround::new(dem, rect, spacing);
    let measured = |triangles: &Triangles, cells| ground.measure(triangles, sights.pairs, sights.seed, cells);
    let regular = regular_grid(dem, rect, polygons);
    // Where its step does not divide a load module, the grid has no edges along lines between them.
    let grid_cells = module_cells.filter(|cells| cells % regular.step == 0);
    Fidelity {
        tin: measured(triangles, module_cells),
        grid: measured(&Triangles::of_tin(&regular.tin), grid_cells),
        grid_step: regular.step,
        spacing_m: spacing.0,
        polygons,
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
pub(crate) fn locate<'a>(
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
