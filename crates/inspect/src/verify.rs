//! Re-reads a database and believes nothing it says: files, TINs, load modules, sides, identities, limits.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use compiler::{CompileError, residual_of};
use database::{Folder, Manifest, ManifestState, ReportResidual};
use fidelity::Residuals;
use ground::{Bounds, GamingArea, Ground, Window};
use job::{Count, DemSource, Edges, Job, LodBorder, SourceEntry, SourceFile, SourceSaid};
use limits::{polygons_of, triangles_of};
use schedule::Workers;
use terrain::{LoadModule, ModuleId, Side};

use crate::recount;

/// What a verification found.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    /// What is wrong, a sentence each; empty when the database is sound.
    pub problems: Vec<String>,
    /// Files whose content was checked against its checksums and stamps.
    pub checked_files: usize,
    /// Load modules whose triangles, sides and counts were checked.
    pub checked_modules: usize,
    /// Residuals recomputed against a DEM, when one was given.
    pub residual: Option<ReportResidual>,
}

/// Re-reads every file of a database and checks what a simulator relies on; with `dem`, recomputes residuals.
///
/// # Errors
/// When there is no database, or `dem` cannot be used for its area. Damage is not an error but a problem.
pub fn verify(folder: &Path, dem: Option<&Path>) -> Result<Verdict, CompileError> {
    let manifest = Folder::new(folder).manifest()?;
    let mut verdict = Verdict::default();
    if manifest.state != ManifestState::Complete {
        verdict.problems.push("database.json: incomplete: a build began and has not ended".into());
        return Ok(verdict);
    }
    let folder = Folder::new(folder);
    let damage = folder.verify(&manifest)?;
    verdict.checked_files = listed(&manifest);
    verdict.problems.extend(damage.iter().map(|damage| format!("{}: {}", damage.path.display(), damage.error)));
    if !verdict.problems.is_empty() {
        return Ok(verdict);
    }
    let (job, area) = job_of(&manifest, folder.dir())?;
    let levels = read_levels(&folder, &area, job.lod.level_count())?;
    let modules = &levels[0];
    verdict.checked_modules = modules.len();
    verdict.problems.extend(check_levels(&job, &area, &levels));
    // With constrained edges no limit is ever exceeded; with clipped ones only where a breach says so.
    if job.modules.edges == Edges::Constrained || manifest.totals.breaches == 0 {
        verdict.problems.extend(check_limits(&job, &area, modules));
    }
    verdict.problems.extend(check_totals(&manifest, modules));
    if let Some(dem) = dem {
        let residuals = recompute(job, &area, dem, &levels, &mut verdict.problems)?;
        verdict.residual = Some(residual_of(&residuals.total()));
    }
    Ok(verdict)
}

fn listed(manifest: &Manifest) -> usize {
    let of_tile = |tile: &database::TileRecord| {
        [&tile.tin, &tile.slm, &tile.measured, &tile.curve, &tile.removed]
            .map(Option::is_some)
            .iter()
            .filter(|&&there| there)
            .count()
    };
    manifest.tiles.iter().map(of_tile).sum::<usize>() + manifest.files.len()
}

/// The job a database was built from, as it says itself.
pub(crate) fn job_of(manifest: &Manifest, folder: &Path) -> Result<(Job, GamingArea), CompileError> {
    let job = Job::from_text(&manifest.job, folder).map_err(|error| CompileError::Impossible {
        key: "database.json: job".into(),
        found: error.to_string(),
        expected: "a job this version reads".into(),
        hint: "the database was written by another version; build it again".into(),
    })?;
    let area = GamingArea::new(&job)?;
    Ok((job, area))
}

/// Load modules by place.
type Modules = BTreeMap<ModuleId, LoadModule>;

/// All load modules by place, at their finest level, checked one by one as they are decoded.
pub(crate) fn read_modules(folder: &Folder, area: &GamingArea) -> Result<Modules, CompileError> {
    let mut all = BTreeMap::new();
    for &tile in &area.tiles {
        let (_, modules) = folder.read_modules(tile)?;
        all.extend(modules.into_iter().map(|module| (module.id, module)));
    }
    Ok(all)
}

/// The same at every level, the finest first; a level that is not in all files lacks load modules, and one that the job
/// does not want comes after the others.
fn read_levels(folder: &Folder, area: &GamingArea, level_count: usize) -> Result<Vec<Modules>, CompileError> {
    let mut all = vec![BTreeMap::new(); level_count];
    for &tile in &area.tiles {
        let (_, levels) = folder.read_levels(tile)?;
        all.resize_with(all.len().max(levels.len()), BTreeMap::new);
        for (own, modules) in all.iter_mut().zip(levels) {
            own.extend(modules.into_iter().map(|module| (module.id, module)));
        }
    }
    Ok(all)
}

/// Every level on its own, then how they fit together.
fn check_levels(job: &Job, area: &GamingArea, levels: &[Modules]) -> Vec<String> {
    let mut problems = Vec::new();
    let (found, expected) = (levels.len(), job.lod.level_count());
    if expected < found {
        problems.push(format!("load modules: {found} levels in a file, the job has {expected}"));
    }
    for (level, modules) in levels.iter().enumerate() {
        let own = [check_modules(area, modules), recount::problems(area.grid, modules)].concat();
        problems.extend(own.into_iter().map(|problem| at_level(level, problem)));
        if 0 < level {
            problems.extend(check_coarser(level, modules, &levels[level - 1]));
        }
    }
    if job.lod.border == LodBorder::Full && problems.is_empty() {
        problems.extend(recount::problems_between(area.grid, levels));
    }
    problems
}

fn at_level(level: usize, problem: String) -> String {
    if level == 0 { problem } else { format!("level {level}: {problem}") }
}

/// A coarser level holds no place that the finer one lacks.
fn check_coarser(level: usize, modules: &Modules, finer: &Modules) -> Vec<String> {
    let is_new = |module: &&LoadModule| {
        let known: BTreeSet<(u16, u16)> =
            finer.get(&module.id).into_iter().flat_map(|finer| &finer.vertices).map(|v| (v.y, v.x)).collect();
        module.vertices.iter().any(|v| !known.contains(&(v.y, v.x)))
    };
    let new = modules.values().filter(is_new);
    new.map(|module| format!("level {level}: load module {}: a vertex that the finer level has not", module.id))
        .collect()
}

fn check_modules(area: &GamingArea, modules: &Modules) -> Vec<String> {
    let mut problems = Vec::new();
    for module in area.grid.all().iter() {
        let Some(found) = modules.get(&module) else {
            problems.push(format!("load module {module}: missing"));
            continue;
        };
        if let Err(fault) = found.check() {
            problems.push(format!("load module {module}: {fault}"));
        }
        problems.extend(check_identities(found));
        let east = modules.get(&ModuleId { col: module.col + 1, ..module });
        let north = modules.get(&ModuleId { row: module.row + 1, ..module });
        for (other, side) in [(east, Side::East), (north, Side::North)] {
            if other.is_some_and(|other| side_of(found, side) != side_of(other, side.opposite())) {
                problems.push(format!("load module {module}: its {side:?} side differs from its neighbour's: a crack"));
            }
        }
    }
    problems
}

/// Both identities of every load module, from edges counted anew.
fn check_identities(module: &LoadModule) -> Option<String> {
    let border = module.border_vertex_count();
    let inner = module.vertices.len() - border;
    let triangles = module.triangles.len();
    let expected = triangles_of(inner, border);
    if triangles != expected {
        return Some(format!("load module {}: {triangles} triangles, expected {expected}", module.id));
    }
    // Every triangle has three edges; those inside the square are shared by two.
    let inner_edges = (3 * triangles - border) / 2;
    let polygons = polygons_of(inner, inner_edges);
    let count = module.polygon_count as usize;
    (polygons < count).then(|| format!("load module {}: {count} polygons, expected at most {polygons}", module.id))
}

/// What a load module holds on a side: place along it and height.
fn side_of(module: &LoadModule, side: Side) -> Vec<(u16, i32)> {
    let vertices = module.side_vertices(side).into_iter().map(|index| module.vertices[usize::from(index)]);
    let along = |vertex: terrain::ModuleVertex| match side {
        Side::South | Side::North => (vertex.x, vertex.z),
        Side::East | Side::West => (vertex.y, vertex.z),
    };
    vertices.map(along).collect()
}

/// Counts against every limit, from the load modules themselves.
fn check_limits(job: &Job, area: &GamingArea, modules: &Modules) -> Vec<String> {
    let count = |module: &LoadModule| match job.limits.count {
        Count::Triangles => module.triangles.len() as u32,
        Count::Polygons => module.polygon_count,
    };
    let counts: Vec<u32> = area.grid.all().iter().map(|module| modules.get(&module).map_or(0, count)).collect();
    let budget = &area.budget;
    let mut problems = Vec::new();
    let above: u64 = counts.iter().map(|&count| u64::from(count.saturating_sub(budget.per_module))).sum();
    if budget.pool < above {
        problems.push(format!("load modules: {above} triangles above the limit, the pool has {}", budget.pool));
    }
    let worst = recount::fullest_window(budget.grid, &counts, budget.windows.rows, budget.windows.cols);
    if u64::from(budget.per_window) < worst {
        problems.push(format!("windows: {worst} triangles in one, the limit is {}", budget.per_window));
    }
    let total: u64 = counts.iter().map(|&count| u64::from(count)).sum();
    if budget.area < total {
        problems.push(format!("area: {total} triangles, the limit is {}", budget.area));
    }
    problems
}

fn check_totals(manifest: &Manifest, modules: &Modules) -> Vec<String> {
    let sum = |of: fn(&LoadModule) -> u64| modules.values().map(of).sum::<u64>();
    let totals = &manifest.totals;
    let pairs = [
        ("triangles", sum(|module| module.triangles.len() as u64), totals.triangles),
        ("polygons", sum(|module| u64::from(module.polygon_count)), totals.polygons),
        ("posts", sum(|module| u64::from(module.residual.posts)), totals.residual_posts),
        ("sum of squared residuals", sum(|module| module.residual.sum_squared), totals.residual_sum_squared),
    ];
    let differing = pairs.iter().filter(|(_, found, listed)| found != listed);
    differing.map(|(what, found, listed)| format!("{what}: {found} in the files, {listed} in database.json")).collect()
}

/// Residuals against a DEM, load module by load module; those that disagree with the files are problems.
fn recompute(
    mut job: Job,
    area: &GamingArea,
    dem: &Path,
    levels: &[Modules],
    problems: &mut Vec<String>,
) -> Result<Residuals, CompileError> {
    let written = dem.display().to_string();
    let said = SourceSaid::default();
    let files = vec![SourceFile { written: written.clone(), path: dem.into(), said: said.clone() }];
    job.dem.source = DemSource::Files { written: vec![SourceEntry { name: written, said }], files };
    job.importance.areas.clear();
    let ground = Ground::open(&job, area, &Workers::new(1), &AtomicBool::new(false))?;
    let mut all = Residuals::default();
    let mut bounds = ground.relief.bounds;
    for &tile in &area.tiles {
        let window = ground.tile(area, tile)?;
        // Water may lie below any shore, and points may be given any height.
        let told =
            window.given.iter().filter_map(|given| given.height).chain([window.dem.range().0, window.dem.range().1]);
        bounds = bounds.map(|bounds| told.fold(bounds, Bounds::and));
        for (level, modules) in levels.iter().enumerate() {
            let ids = area.tiling.modules(tile, area.grid);
            let mut own: Vec<LoadModule> = ids.iter().filter_map(|module| modules.get(&module).cloned()).collect();
            let residuals = fidelity::measure(&mut own, &window.measured(area));
            if level == 0 {
                all.merge(&residuals);
            }
            let of_level = differing_residuals(&own, modules, &window, area);
            problems.extend(of_level.into_iter().map(|problem| at_level(level, problem)));
        }
    }
    if let Some(bounds) = bounds {
        problems.extend(outside(&levels[0], bounds, &all));
    }
    Ok(all)
}

/// Vertices that lie outside the heights of the sources by more than the surface misses any post: fitted heights
/// reach beyond by as much at most.
fn outside(modules: &Modules, bounds: Bounds, residuals: &Residuals) -> Option<String> {
    let largest_m = residual_of(&residuals.total()).max_m;
    let outside_m = |vertex: &terrain::ModuleVertex| bounds.metres_outside(vertex.z);
    let is_outside = |vertex: &&terrain::ModuleVertex| largest_m + 1.0 < outside_m(vertex);
    let outside =
        modules.values().flat_map(|module| module.vertices.iter().filter(is_outside).map(move |v| (module.id, v)));
    let (count, worst) = outside.fold((0, None), |(count, worst): (usize, Option<(ModuleId, f64)>), (id, vertex)| {
        let found = (id, outside_m(vertex));
        (count + 1, Some(worst.filter(|worst| found.1 <= worst.1).unwrap_or(found)))
    });
    let (low, high) = bounds.metres();
    worst.map(|(id, metres)| {
        format!(
            "heights: {count} vertices lie outside those of the DEM ({low:.2} m to {high:.2} m), the worst by \
            {metres:.2} m in load module {id}"
        )
    })
}

/// Load modules, measured just now, whose residuals are not those of a second opinion or of their files.
fn differing_residuals(own: &[LoadModule], listed: &Modules, window: &Window, area: &GamingArea) -> Vec<String> {
    let recounted =
        |module: &LoadModule| recount::residual(module, &window.dem, area.grid, area.frame.spacing) == module.residual;
    let doubtful = own.iter().filter(|module| !recounted(module)).map(|module| {
        format!("load module {}: two ways to measure its residuals against this DEM disagree", module.id)
    });
    let differs = |module: &&LoadModule| listed[&module.id].residual != module.residual;
    let wrong = own
        .iter()
        .filter(differs)
        .map(|module| format!("load module {}: its residuals against this DEM are not those in its file", module.id));
    doubtful.chain(wrong).collect()
}
