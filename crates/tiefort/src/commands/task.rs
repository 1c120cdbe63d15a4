//! `tiefort task`: one unit of a build's work, for engines that run the rest.

use std::path::PathBuf;

use build::{ORDER, Stage, Unit, UnitEnd, is_of_tiles};
use clap::Args;
use job::Job;
use terrain::TileId;

use crate::arguments::{RunArguments, one_of, row_col};
use crate::commands::tile::check_tile;
use crate::failure::{Failure, Outcome};
use crate::run::{Finished, Run};

const AFTER_HELP: &str = "\
Examples:
  tiefort task configs/ntc.toml survey 2,3 --out /share/ntc.tdb
  tiefort task configs/ntc.toml refine 0,0 0,2 0,4 --out /share/ntc.tdb
  tiefort task configs/ntc.toml publish --out /share/ntc.tdb

Stages come in the order in which they are listed above, those of tiles for
every tile: refine after that of its lower-ranked neighbours, assemble after
refine of the tiles around it, too. A unit may be run any number of times,
anywhere that shares the folder; one that finds its result published and fresh
ends at once, and a stage that the job has no use for does nothing. publish makes
whatever is missing or damaged, so it always ends with the result of a build,
also where that is published already.

Exit codes: 0 done; 1 published, with breaches; 2 failed, or, with --strict,
published with breaches or warnings; 75 what it needs is not done yet: try again.";

/// Arguments of `task`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// The job file
    #[arg(value_name = "JOB.toml")]
    pub(super) job: PathBuf,
    /// What to do
    #[arg(value_name = "STAGE", value_parser = one_of(ORDER.map(|stage| (stage.name(), stage, stage.meaning()))))]
    stage: Stage,
    /// Row and column of each tile, counted from the south-west
    #[arg(value_name = "ROW,COL", value_parser = row_col)]
    tiles: Vec<TileId>,
    #[command(flatten)]
    run: RunArguments,
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let job = Job::load_with(&arguments.job, &build::ground::find_area)?;
    let units = units(&job, arguments)?;
    let names: Vec<String> = units.iter().map(Unit::to_string).collect();
    let run = Run::announce_briefly(&job, &arguments.run, &names.join(" "))?;
    let end = run.listen(|listener| build::perform(&job, run.folder(), &units, &run.options(false), listener))?;
    match end {
        UnitEnd::Published(built) => Ok(run.conclude(&Finished::from(*built))),
        UnitEnd::Finished(built) if arguments.stage == Stage::Publish => Ok(run.conclude(&Finished::from(*built))),
        UnitEnd::Done | UnitEnd::Finished(_) => Ok(Outcome::Sound),
    }
}

fn units(job: &Job, arguments: &Arguments) -> Result<Vec<Unit>, Failure> {
    let (stage, tiles) = (arguments.stage, &arguments.tiles);
    match (is_of_tiles(stage), tiles.is_empty()) {
        (true, false) => tiles.iter().map(|&tile| check_tile(job, tile).map(|()| Unit::of(stage, tile))).collect(),
        (true, true) => {
            let message = format!("{}: found no tile, expected ROW,COL at least once", stage.name());
            Err(Failure::new(message, "`tiefort plan` lists the tiles in the order of their ranks"))
        }
        (false, true) => Ok(vec![Unit::whole(stage)]),
        (false, false) => {
            let message = format!("{}: found a tile, expected none", stage.name());
            Err(Failure::new(message, "allocate and publish are of the whole area"))
        }
    }
}
