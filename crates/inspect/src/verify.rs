//! Re-reads a database and believes nothing it says: files, TINs, load modules, sides, identities, limits.

mod beyond;
mod classes;
mod decided;
mod deck;
mod entries;
mod exceeded;
mod features;
mod figures;
mod laid;
mod made_from;
mod modules;
mod square;
mod standing;
mod tins;
mod total;
mod walk;
mod waters;
mod ways;

use std::path::Path;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use build::ground::{Bounds, GamingArea, Ground, Window};
use build::product::Opened;
use build::{CompileError, residual_of};
use fidelity::Residuals;
use job::{DemSource, Job, SourceEntry, SourceFile, SourceSaid};
use schedule::Workers;
use store::{Folder, Manifest, ManifestState, Report, ReportResidual, files};
use terrain::{LoadModule, ModuleId};

use crate::recount;
use beyond::{Around, Beyond};
use classes::Classes;
pub use features::NetworkFound;
use modules::{Modules, at_level};
use walk::Walked;

/// What a verification found.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    /// What is wrong, a sentence each; empty when the database is sound.
    pub problems: Vec<String>,
    /// What could not be checked, and why, a sentence each.
    pub unchecked: Vec<String>,
    /// Files whose content was checked against its checksums and stamps.
    pub checked_files: usize,
    /// Load modules whose triangles, sides and counts were checked.
    pub checked_modules: usize,
    /// Residuals recomputed against a DEM, when one was given.
    pub residual: Option<ReportResidual>,
    /// With such a DEM, vertices that stand as far outside the posts around them as any may, counted in each load
    /// module and at each level that has them.
    pub held_vertices: Option<u64>,
    /// What of roads, rivers and lakes was counted in the load modules; nothing of a job without any.
    pub network: Option<NetworkFound>,
    /// Square metres of decks, those under the ground at any level, and how far decks are above each class at least, in
    /// words; nothing where there are no decks.
    pub decks: Option<String>,
    /// What stands on the ground, in words; nothing of a job without objects.
    pub objects: Option<String>,
    /// Limits that are exceeded, as the build told: no damage.
    pub breaches: u64,
}

/// Re-reads every file of a database and checks what a simulator relies on; with `dem`, recomputes residuals.
///
/// # Errors
/// When there is no database, or `dem` cannot be used for its area. Damage is not an error but a problem.
pub fn verify(folder: &Path, dem: Option<&Path>) -> Result<Verdict, CompileError> {
    let manifest = Folder::new(folder).manifest()?;
    let mut verdict = Verdict { breaches: manifest.totals.breaches, ..Verdict::default() };
    if manifest.state != ManifestState::Complete {
        verdict.problems.push("database.json: incomplete: a build began and has not ended".into());
        return Ok(verdict);
    }
    let folder = Folder::new(folder);
    verdict.problems = entries::leading_out(&manifest);
    if !verdict.problems.is_empty() {
        return Ok(verdict);
    }
    let damage = folder.verify(&manifest)?;
    verdict.checked_files = listed(&manifest);
    verdict.problems.extend(damage.iter().map(|damage| format!("{}: {}", damage.path.display(), damage.error)));
    if !verdict.problems.is_empty() {
        return Ok(verdict);
    }
    let Opened { folder, manifest, job, area } = Opened::of(folder, manifest)?;
    verdict.problems = entries::problems(&manifest, &job, &area);
    if !verdict.problems.is_empty() {
        return Ok(verdict);
    }
    let opened = modules::open_as_simulators(&folder, &job, &area)?;
    let levels = &Modules::levels(&folder, &area, opened.level_count);
    let mut walked = walk::walk(&job, &area, levels);
    levels[0].fault()?;
    verdict.checked_modules = walked.sums[0].modules;
    verdict.problems.append(&mut walked.problems);
    verdict
        .problems
        .extend(opened.problems.into_iter().zip(&walked.unknown).flat_map(|(of, more)| [of, more.clone()].concat()));
    // Only load modules that are sound in themselves are held against anything else.
    if verdict.problems.is_empty() {
        check_sums(
            &Whole { folder: &folder, manifest: &manifest, job: &job, area: &area },
            (levels, walked),
            &mut verdict,
            |tins| made_from::problems(&folder, &manifest, &job, &area, tins, &opened.fingerprints),
        )?;
    }
    if let Some(dem) = dem {
        let report = folder.report().ok();
        let built = Built { area: &area, folder: &folder, revision: manifest.algorithm_revision };
        let residuals = recompute(job, &built, dem, levels, report.as_ref(), &mut verdict)?;
        verdict.residual = Some(residual_of(&residuals.total()));
    }
    levels[0].fault()?;
    Ok(verdict)
}

/// A database and its job.
struct Whole<'a> {
    folder: &'a Folder,
    manifest: &'a Manifest,
    job: &'a Job,
    area: &'a GamingArea,
}

/// Everything that is counted over many load modules: TINs, limits, totals, the report.
fn check_sums(
    whole: &Whole,
    (levels, walked): (&[Modules], Walked),
    verdict: &mut Verdict,
    made_from: impl FnOnce(&tins::OfTins) -> (Vec<String>, Vec<String>),
) -> Result<(), CompileError> {
    let &Whole { folder, manifest, job, area } = whole;
    let modules = &levels[0];
    let tins = tins::check(folder, manifest, job, area, modules)?;
    verdict.problems.extend(tins.problems.iter().cloned());
    verdict.problems.extend(walked.figures);
    if !verdict.problems.is_empty() {
        return Ok(());
    }
    let (problems, unchecked) = made_from(&tins);
    verdict.problems.extend(problems);
    verdict.unchecked.extend(unchecked);
    let report = if folder.path(files::REPORT).exists() { Some(folder.report()?) } else { None };
    let features = features::check(folder, manifest, job, area, (modules, &walked.decks), report.as_ref())?;
    verdict.problems.extend(features.problems);
    verdict.unchecked.extend(features.unchecked);
    verdict.network = features.network;
    verdict.decks = deck::told(&walked.sums, job);
    if let Some(spec) = &job.objects {
        let (_, _, outlines) = folder.read_outlines()?;
        let of_report = report.as_ref().and_then(|report| report.objects.as_ref());
        let standing = standing::check(area, spec, levels, &outlines, of_report);
        verdict.problems.extend(standing.problems);
        verdict.objects = Some(standing.told);
    }
    let (counts, sums) = (walked.counts, &walked.sums);
    let mut exceeded = exceeded::of_counts(area, &counts);
    verdict.problems.extend(exceeded::wrong_states(manifest, area, &exceeded));
    let total = sums[0].residual;
    exceeded.extend(exceeded::of_residuals(job, &total));
    let (problems, unchecked) = exceeded::check(folder, job, report.as_ref(), &exceeded);
    verdict.problems.extend(problems);
    verdict.unchecked.extend(unchecked);
    verdict.problems.extend(figures::differing_totals(manifest, area, &sums[0], (&counts, &exceeded), &tins));
    let measured = figures::measured(folder, manifest, area, levels, &tins);
    verdict.problems.extend(measured.problems);
    if let Some(report) = &report {
        let of_files = (&counts[..], &tins, measured.sums.as_ref());
        verdict.problems.extend(figures::differing_report(report, job, area, sums, of_files));
        verdict.unchecked.extend(unchecked_figures(report));
    }
    Ok(())
}

/// What a report says that no file of the database shows.
fn unchecked_figures(report: &Report) -> Option<String> {
    let told = figures::is_of_other_ground(report);
    told.then(|| "residuals in report.json: it says that tiles were made from other ground".to_owned())
}

fn listed(manifest: &Manifest) -> usize {
    let of_tile = |tile: &store::TileRecord| {
        [&tile.tin, &tile.slm, &tile.measured, &tile.curve, &tile.removed]
            .map(Option::is_some)
            .iter()
            .filter(|&&there| there)
            .count()
    };
    manifest.tiles.iter().map(of_tile).sum::<usize>() + manifest.files.len()
}

/// What was built, where, and by which algorithms.
struct Built<'a> {
    area: &'a GamingArea,
    folder: &'a Folder,
    revision: u32,
}

/// Residuals against a DEM, load module by load module; those that disagree with the files are problems, and so are
/// vertices that stand outside the posts around them.
fn recompute(
    mut job: Job,
    &Built { area, folder, revision }: &Built,
    dem: &Path,
    levels: &[Modules],
    report: Option<&Report>,
    verdict: &mut Verdict,
) -> Result<Residuals, CompileError> {
    let written = dem.display().to_string();
    let said = SourceSaid::default();
    let files = vec![SourceFile { written: written.clone(), path: dem.into(), said: said.clone() }];
    job.dem.source = DemSource::Files { written: vec![SourceEntry { name: written, said }], files };
    let open = |job: &Job| Ground::open_built(job, area, (&Workers::new(1), &AtomicBool::new(false)), folder);
    // The files of areas of importance may be gone, and then nothing is known of classes.
    let (ground, has_classes) = match open(&job) {
        Ok(ground) => (ground, true),
        Err(_) => {
            job.importance.areas.clear();
            verdict.unchecked.push("classes: the files that importance.areas names cannot be read".into());
            (open(&job)?, false)
        }
    };
    let problems = &mut verdict.problems;
    let mut all = Residuals::default();
    let mut bounds = ground.relief.bounds;
    let mut beyond = Beyond::default();
    for &tile in &area.tiles {
        let window = ground.tile(area, tile)?;
        // Water may lie below any shore, and points may be given any height.
        let told =
            window.given.iter().filter_map(|given| given.height).chain([window.dem.range().0, window.dem.range().1]);
        bounds = bounds.map(|bounds| told.fold(bounds, Bounds::and));
        let features = ground.features(tile)?;
        let natural = ground.natural_tile(area, tile)?;
        let around = Around::of(&ground, (&job, area), (&window, &features))?;
        for (level, modules) in levels.iter().enumerate() {
            let listed = modules.of_tile(tile);
            let mut own: Vec<LoadModule> = listed.iter().map(|module| LoadModule::clone(module)).collect();
            let residuals = fidelity::measure(&mut own, &window.measured(area));
            beyond.add(level, &own, &around);
            if level == 0 {
                all.merge(&residuals);
            }
            let mut of_level = differing_residuals(&own, &listed, &window, area);
            if has_classes {
                let (grid, spacing) = (area.grid, area.frame.spacing);
                let classes = Classes::new(&job, &features, level, spacing);
                of_level.extend(own.iter().filter_map(|own| classes.problem(own, &natural.importance, grid, spacing)));
            }
            problems.extend(of_level.into_iter().map(|problem| at_level(level, problem)));
        }
    }
    let (problem, unchecked) = beyond.told(revision);
    problems.extend(problem);
    verdict.unchecked.extend(unchecked);
    verdict.held_vertices = Some(beyond.held());
    if let Some(bounds) = bounds {
        problems.extend(outside(&levels[0], bounds, &all));
    }
    if let Some(report) = report {
        let classes = if has_classes { &job.importance.classes[..] } else { &[] };
        problems.extend(figures::differing_residuals(report, &all, classes));
    }
    Ok(all)
}

/// Vertices that lie outside the heights of the sources by more than the surface misses any post and more than a tenth
/// of the range of these heights: fitted heights reach beyond by as much at most.
fn outside(modules: &Modules, bounds: Bounds, residuals: &Residuals) -> Option<String> {
    let largest_m = residual_of(&residuals.total()).max_m;
    let outside_m = |vertex: &terrain::ModuleVertex| bounds.metres_outside(vertex.z);
    let (low, high) = bounds.metres();
    let permitted_m = (largest_m + 1.0).max((high - low) / 10.0);
    let is_outside = |vertex: &&terrain::ModuleVertex| permitted_m < outside_m(vertex);
    let of_module =
        |module: &LoadModule| module.vertices.iter().filter(is_outside).map(|v| (module.id, *v)).collect::<Vec<_>>();
    let outside = modules.values().flat_map(|module| of_module(&module));
    let (count, worst) = outside.fold((0, None), |(count, worst): (usize, Option<(ModuleId, f64)>), (id, vertex)| {
        let found = (id, outside_m(&vertex));
        (count + 1, Some(worst.filter(|worst| found.1 <= worst.1).unwrap_or(found)))
    });
    worst.map(|(id, metres)| {
        format!(
            "heights: {count} vertices lie outside those of the DEM ({low:.2} m to {high:.2} m), the worst by \
            {metres:.2} m in load module {id}"
        )
    })
}

/// Load modules, measured just now, whose residuals are not those of a second opinion or of their files.
fn differing_residuals(
    own: &[LoadModule],
    listed: &[Rc<LoadModule>],
    window: &Window,
    area: &GamingArea,
) -> Vec<String> {
    let recounted =
        |module: &LoadModule| recount::residual(module, &window.dem, area.grid, area.frame.spacing) == module.residual;
    let doubtful = own.iter().filter(|module| !recounted(module)).map(|module| {
        format!("load module {}: two ways to measure its residuals against this DEM disagree", module.id)
    });
    let differs = own.iter().zip(listed).filter(|(module, listed)| listed.residual != module.residual);
    let wrong = differs.map(|(module, _)| {
        format!("load module {}: its residuals against this DEM are not those in its file", module.id)
    });
    doubtful.chain(wrong).collect()
}
