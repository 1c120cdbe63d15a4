//! `tiefort build`: a whole gaming area.

use std::path::PathBuf;

use clap::Args;
use job::Job;

use crate::arguments::RunArguments;
use crate::failure::{Failure, Outcome};
use crate::fit;
use crate::run::{Finished, Run};

const AFTER_HELP: &str = "\
Examples:
  tiefort build configs/ntc.toml
  tiefort build desert.toml --out /data/desert.tdb --workers 8 --strict
  tiefort build ntc.toml --json > events.jsonl

A build that was stopped goes on where it stopped when the same command is run
again.";

/// Arguments of `build`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// The job file
    #[arg(value_name = "JOB.toml")]
    pub(super) job: PathBuf,
    #[command(flatten)]
    run: RunArguments,
    /// Keep nothing of an earlier build
    #[arg(long)]
    fresh: bool,
    /// Build even where memory or disk are forecast not to suffice
    #[arg(long)]
    force: bool,
}

/// Builds.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let mut job = Job::load_with(&arguments.job, &build::ground::find_area)?;
    job.dem.strict = arguments.run.strict;
    if !arguments.force {
        let (workers, _) = arguments.run.workers.for_job(&job);
        fit::check(&job, &build::plan(&job)?.forecast, workers, &arguments.run.folder(&job))?;
    }
    let run = Run::announce(&job, &arguments.run, "building")?;
    run.finish(|listener| {
        let built = build::build(&job, run.folder(), &run.options(arguments.fresh), listener)?;
        Ok(Finished::from(built))
    })
}
