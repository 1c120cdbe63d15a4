//! `tiefort fetch`: what a job names on other machines, brought here.

use std::path::PathBuf;

use clap::Args;

use crate::failure::{Failure, Outcome};

const AFTER_HELP: &str = "\
Examples:
  tiefort fetch irwin.toml --dry-run
  tiefort fetch irwin.toml && tiefort build irwin.toml

Addresses (https://, s3://) stand in a job in the place of paths. Of a GeoTIFF
come the tiles under the area and around it, of GeoParquet the row groups that
meet it, of everything else the whole file, into NAME.sources/ beside NAME.toml;
NAME.lock says what came. Where the posts of an overview are no farther apart
than the job's spacing, the overview comes. A * in the name of a bucket's files
stands for all GeoParquet that fits. A fetch that was cut goes on where it was.
A build touches no network.";

/// Arguments of `fetch`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// The job file
    #[arg(value_name = "JOB.toml")]
    job: PathBuf,
    /// Say what would come, and how many bytes; bring nothing
    #[arg(long)]
    dry_run: bool,
    /// Take what has changed on its server since it was fetched, and anew what came damaged
    #[arg(long)]
    update: bool,
    /// Gigabytes that may come at most
    #[arg(long, value_name = "N", default_value = "8", value_parser = crate::arguments::positive)]
    max_gb: f64,
    /// A file with sources of your own, for their licences
    #[arg(long, value_name = "FILE.toml")]
    catalogue: Option<PathBuf>,
    /// Show no progress
    #[arg(short, long)]
    quiet: bool,
}

/// Fetches.
#[cfg(feature = "fetch")]
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let Arguments { job, dry_run, update, max_gb, catalogue, quiet } = arguments;
    crate::fetch::fetch(&crate::fetch::Options {
        job: job.clone(),
        dry_run: *dry_run,
        update: *update,
        max_gb: *max_gb,
        catalogue: catalogue.clone(),
        quiet: *quiet,
    })
}

/// Says how to get a program that can.
#[cfg(not(feature = "fetch"))]
pub fn run(_: &Arguments) -> Result<Outcome, Failure> {
    crate::catalogue::without_fetch()
}
