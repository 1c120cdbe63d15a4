//! A whole gaming area, on one page.

use std::path::Path;

use database::{Database, Previous, Report};
use job::Job;
use schedule::Workers;

use crate::area::GamingArea;
use crate::assemble::assemble;
use crate::enforce::enforce;
use crate::ground::Ground;
use crate::publish::{beginning, database_area, publish};
use crate::refine::refine;
use crate::report::Findings;
use crate::run::{Options, Run};
use crate::survey::{allocate, survey};
use crate::{CompileError, Event, Progress, Stage};

/// A finished build.
#[derive(Debug)]
pub struct Built {
    /// What was found; its stages are empty until whoever holds the clock fills them in.
    pub report: Report,
    /// Tiles that were published before and are still fresh.
    pub kept: usize,
    /// Tiles that were refined now.
    pub rebuilt: usize,
    /// The database, still locked.
    pub database: Database,
}

/// Builds the database of a job in `folder`, or brings the one there up to date.
///
/// # Errors
/// When the job cannot be met by any build, a source cannot be used, or the database cannot be written; what
/// was published before stays as it is.
pub fn build(job: &Job, folder: &Path, options: &Options, progress: &mut dyn Progress) -> Result<Built, CompileError> {
    let (run, _) = open(job, folder, options, progress)?;
    if options.fresh {
        run.database.clear()?;
    }
    run.database.begin(&beginning(&run))?;

    let curves = survey(&run, progress)?;
    let shares = allocate(&run, curves.as_deref(), progress);
    let tins = refine(&run, &shares, progress)?;
    let mut assembled = assemble(&run, &tins, progress)?;
    let enforced = enforce(&run, &tins, &mut assembled, progress)?;

    let findings = Findings { run: &run, tins: &tins, assembled: &assembled, enforced: &enforced };
    let report = publish(&findings, &shares, &[], progress)?;
    let rebuilt = tins.iter().filter(|tile| tile.is_new).count();
    Ok(Built { report, kept: tins.len() - rebuilt, rebuilt, database: run.database })
}

/// Everything a run stands on: the plan, the sources, the locked database. Nothing is changed yet.
pub(crate) fn open<'a>(
    job: &'a Job,
    folder: &Path,
    options: &Options<'a>,
    progress: &mut dyn Progress,
) -> Result<(Run<'a>, Previous), CompileError> {
    let area = GamingArea::new(job)?;
    let workers = Workers::new(options.workers);
    progress.tell(Event::Enter(Stage::Read, 0));
    let ground = Ground::open(job, &area, &workers, options.stop)?;
    progress.tell(Event::Leave(Stage::Read));
    for warning in &ground.warnings {
        progress.tell(Event::Note(warning.clone()));
    }
    let (database, previous) = Database::create_or_open(folder, &database_area(job))?;
    Ok((Run { job, area, ground, workers, stop: options.stop, database }, previous))
}
