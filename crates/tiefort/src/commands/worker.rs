//! `tiefort worker`: one of any number of processes that build a database in a shared folder.

use std::path::PathBuf;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use build::{Clock, Sharing, WorkerEnd};
use clap::Args;
use job::Job;

use crate::arguments::RunArguments;
use crate::failure::{Failure, Outcome};
use crate::run::{Finished, Run};
use crate::terminal;

const AFTER_HELP: &str = "\
Examples:
  tiefort worker ntc.toml --out /share/ntc.tdb    on every host, one for each core

Start it any number of times, on any hosts that share the folder, at any time.
Each takes tiles that are ready and that no other is working on, until the
build is done; one of them publishes it. Any of them may be killed: what it was
working on is done by another once its lease is over. Clocks need not agree.

Every worker ends as the build does, whichever published it.

Exit codes: 0 done; 1 done, with breaches; 2 failed, or, with --strict, done with
breaches or warnings; 75 a build or another job is at work in the folder.";

/// What a worker waits for when nothing is ready.
const PAUSE: Duration = Duration::from_millis(200);

/// Arguments of `worker`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// The job file
    #[arg(value_name = "JOB.toml")]
    pub(super) job: PathBuf,
    #[command(flatten)]
    run: RunArguments,
    /// Seconds of silence after which a worker's work is done by another
    #[arg(long, value_name = "SECONDS", default_value_t = 60)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=86_400))]
    lease: u64,
}

/// Works.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let job = Job::load_with(&arguments.job, &build::ground::find_area)?;
    let run = Run::announce_briefly(&job, &arguments.run, "worker")?;
    let name = name();
    let lease = Duration::from_secs(arguments.lease);
    let sharing = Sharing { name: &name, lease, pause: PAUSE.min(lease / 4), holding: &|lease| run.hold(lease) };
    let end = run.listen(|listener| {
        loop {
            // Those that begin at once may find each other half-way; a build or another job stays longer.
            match build::work(&job, run.folder(), &run.options(false), &sharing, listener) {
                Err(error) if error.is_transient() && run.clock().wall() < lease => run.clock().wait(PAUSE),
                worked => return worked,
            }
        }
    })?;
    let WorkerEnd { units, built } = end;
    if built.is_unchanged {
        if !arguments.run.quiet {
            let (breaches, warnings) = (built.report.breaches.len(), built.report.warnings.len());
            let found = format!("{breaches} breaches, {warnings} warnings");
            terminal::tell(&format!("the build is done: {found}; this worker did {units} units of work"));
        }
        return Ok(run.judge(&built.report));
    }
    let tiles = format!("done by workers; this one did {units} units of work and published");
    Ok(run.conclude(&Finished { tiles, ..Finished::from(*built) }))
}

/// A name that no other worker has: the host's, the process's number, and when it began.
fn name() -> String {
    let host = std::fs::read_to_string("/etc/hostname").unwrap_or_default();
    let nanoseconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos());
    format!("{}-{}-{nanoseconds:x}", host.trim(), std::process::id())
}
