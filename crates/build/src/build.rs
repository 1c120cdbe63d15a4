//! A whole gaming area, on one page.

use std::sync::OnceLock;

use crate::ground::{GamingArea, Ground};
use job::Job;
use schedule::Workers;
use store::{Area, Database, Folder, Manifest, ManifestState, Report, SourceRecord, TileState};

use crate::assemble::assemble;
use crate::enforce::enforce;
use crate::level::level;
use crate::outlines::decide_objects;
use crate::profile::profile;
use crate::publish::{beginning, database_area, prepare, publish};
use crate::refine::refine;
use crate::report::Findings;
use crate::run::{ALGORITHM_REVISION, Options, Run, Tins, changed};
use crate::survey::{allocate, survey};
use crate::{CompileError, Event, Progress, Stage, Stopwatch};

/// A finished build.
#[derive(Debug)]
pub struct Built {
    /// What was found, as `report.json` says it, with the times of the very end in addition; if nothing was done, it is
    /// the report of the build before.
    pub report: Report,
    /// Tiles that were published before and are still fresh.
    pub kept: usize,
    /// Tiles that were refined now.
    pub rebuilt: usize,
    /// Whether anything was done at all.
    pub is_unchanged: bool,
    /// The database, still locked.
    pub database: Database,
}

/// Builds the database of a job in `folder`, or brings the one there up to date: complete, with its report and page.
///
/// # Errors
/// When the job cannot be met by any build, a source cannot be used, or the database cannot be written; what
/// was published before stays as it is.
pub fn build(
    job: &Job,
    folder: impl Into<Folder>,
    options: &Options,
    progress: &mut dyn Progress,
) -> Result<Built, CompileError> {
    let (folder, progress) = (&folder.into(), &mut Stopwatch::start(options.clock, progress));
    if !options.fresh
        && let Some(built) = unchanged(job, folder, progress)?
    {
        return Ok(built);
    }
    let mut run = open(job, folder, options, progress)?;
    // Files of tiles of another size, or heights above something else, are of no use.
    let is_other = run.previous.as_ref().is_some_and(|previous| previous.area != database_area(job));
    if is_other {
        let note = "the database has other tiles or another vertical datum than the job: nothing of it is kept";
        progress.tell(Event::Note(note.into()));
    }
    if options.fresh || is_other {
        run.previous = None;
        run.database.begin_afresh(&beginning(&run))?;
    } else {
        run.database.begin(&beginning(&run))?;
    }
    finish(run, progress)
}

/// Every stage of a run that has begun; what is published and fresh is kept. A source that changed meanwhile ends it,
/// and the database stays incomplete.
pub(crate) fn finish(run: Run, progress: &mut Stopwatch) -> Result<Built, CompileError> {
    let states = run.states.clone();
    let finished = stages(run, progress);
    // What went wrong may come from it, and then it is the cause to tell.
    match finished {
        Err(error) if !error.is_stopped() => Err(changed(&states).err().unwrap_or(error)),
        finished => finished,
    }
}

fn stages(mut run: Run, progress: &mut Stopwatch) -> Result<Built, CompileError> {
    decide_features(&mut run, progress)?;
    decide_objects(&mut run, progress)?;
    let curves = survey(&run, progress)?;
    let mut shares = allocate(&run, curves.as_ref(), progress)?;
    drop(curves);
    let tins = refine(&run, &shares, progress)?;
    shares.forget_rooms();
    let (mut assembled, mut sums) = assemble(&run, &tins, progress)?;
    let enforced = enforce(&run, &tins, &mut assembled, &mut sums, progress)?;

    let findings = Findings { run: &run, tins: &tins, assembled: &assembled, sums: &sums, enforced: &enforced };
    let ready = prepare(&findings, &shares, &[], progress)?;
    let rebuilt = tins.iter().filter(|tile| tile.cause.is_some()).count();
    let kept = tins.len() - rebuilt;
    drop((shares, tins, assembled, sums, enforced));
    let (report, database) = publish(run, ready, progress)?;
    Ok(Built { report, kept, rebuilt, is_unchanged: false, database })
}

/// How high roads, rivers and lakes lie, where there are any: from here on they are part of the ground.
pub(crate) fn decide_features(run: &mut Run, progress: &mut dyn Progress) -> Result<(), CompileError> {
    if run.job.features.is_none() {
        return Ok(());
    }
    let profiles = profile(run, progress)?;
    let (file, level) = level(run, &profiles, progress)?;
    run.settle(file, level);
    Ok(())
}

/// Everything a run stands on: the plan, the sources, the locked database. Nothing is changed yet.
pub(crate) fn open<'a>(
    job: &'a Job,
    folder: &Folder,
    options: &Options<'a>,
    progress: &mut dyn Progress,
) -> Result<Run<'a>, CompileError> {
    open_with(job, options, progress, |area, _| Ok(Database::create_or_open(folder, area)?))
}

/// The same, with the database as `lock` takes it, and what `database.json` said.
pub(crate) fn open_with<'a>(
    job: &'a Job,
    options: &Options<'a>,
    progress: &mut dyn Progress,
    lock: impl FnOnce(&Area, &[SourceRecord]) -> Result<(Database, Option<Manifest>), CompileError>,
) -> Result<Run<'a>, CompileError> {
    let area = GamingArea::new(job)?;
    let workers = Workers::new(options.workers);
    progress.tell(Event::Enter(Stage::Read, 0));
    // Before anything is read, so that a change in between shows.
    let states = crate::ground::states(job)?;
    let records = crate::ground::records(job)?;
    let ground = Ground::open(job, &area, &workers, options.stop)?;
    progress.tell(Event::Leave(Stage::Read));
    for warning in &ground.warnings {
        progress.tell(Event::Note(warning.clone()));
    }
    let (database, previous) = lock(&database_area(job), &records)?;
    let Options { page, stop, .. } = *options;
    let mut run = Run {
        job,
        area,
        ground,
        workers,
        page,
        stop,
        database,
        records,
        states,
        tins: Tins::new(),
        previous,
        read: OnceLock::new(),
        level: None,
        outlines: None,
    };
    run.reserve();
    Ok(run)
}

/// The finished database in `folder`, if a build of `job` would change nothing in it: made from the same job and the
/// same sources by the same revision, every tile whole, every file with its bytes. Nothing is decoded for that.
fn unchanged(job: &Job, there: &Folder, progress: &mut dyn Progress) -> Result<Option<Built>, CompileError> {
    if !there.manifest().is_ok_and(|manifest| might_be_fresh(&manifest, job)) {
        return Ok(None);
    }
    GamingArea::new(job)?;
    progress.tell(Event::Enter(Stage::Read, 0));
    let records = crate::ground::records(job)?;
    let (database, _) = Database::create_or_open(there, &database_area(job))?;
    // Looked at again, now that no other process can change it.
    let manifest = there.manifest()?;
    let fresh = fresh(there, &manifest, job, &records)?;
    progress.tell(Event::Leave(Stage::Read));
    let built = |report| Built { report, kept: manifest.tiles.len(), rebuilt: 0, is_unchanged: true, database };
    Ok(fresh.map(built))
}

/// The report of a database in which a build of `job` from these sources would change nothing.
pub(crate) fn fresh(
    there: &Folder,
    manifest: &Manifest,
    job: &Job,
    records: &[SourceRecord],
) -> Result<Option<Report>, CompileError> {
    let is_fresh = might_be_fresh(manifest, job) && manifest.sources == records && there.verify_bytes(manifest)?;
    Ok(there.report().ok().filter(|report| is_fresh && !report.outdated))
}

/// Whether a manifest is of a finished build of `job` by this revision, as far as it says itself.
fn might_be_fresh(manifest: &Manifest, job: &Job) -> bool {
    manifest.state == ManifestState::Complete
        && manifest.algorithm_revision == ALGORITHM_REVISION
        && manifest.job == job.canonical_text()
        && manifest.tiles.iter().all(|record| record.state != TileState::Frozen)
}
