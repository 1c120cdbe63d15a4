//! `tiefort tile`: one tile again.

use std::path::PathBuf;

use clap::Args;
use job::Job;
use terrain::TileId;

use crate::arguments::{RunArguments, row_col};
use crate::failure::{Failure, Outcome};
use crate::run::{Finished, Run};

const AFTER_HELP: &str = "\
Examples:
  tiefort tile configs/ntc.toml 2,3
  tiefort tile configs/ntc.toml 2,3 --release-borders

0,0 is the south-west tile. When the tile's border points come out as they were,
nothing else changes. Otherwise its sides are held as the neighbours have them
and the tile is marked frozen, until a build makes it whole.";

/// Arguments of `tile`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// The job file
    #[arg(value_name = "JOB.toml")]
    pub(super) job: PathBuf,
    /// Row and column of the tile, counted from the south-west
    #[arg(value_name = "ROW,COL", value_parser = row_col, allow_hyphen_values = true)]
    tile: TileId,
    #[command(flatten)]
    run: RunArguments,
    /// Rebuild what a changed border reaches, too
    #[arg(long)]
    release_borders: bool,
}

/// Re-runs the tile.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let mut job = Job::load_with(&arguments.job, &build::ground::find_area)?;
    job.dem.strict = arguments.run.strict;
    check_tile(&job, arguments.tile)?;
    let what = format!("re-running tile {},{} of", arguments.tile.row, arguments.tile.col);
    let run = Run::announce(&job, &arguments.run, &what)?;
    let ended = run.finish(|listener| {
        let (tile, release, options) = (arguments.tile, arguments.release_borders, run.options(false));
        let rebuilt = build::rebuild_tile(&job, run.folder(), tile, release, &options, listener)?;
        let names: Vec<String> = rebuilt.rebuilt.iter().map(TileId::to_string).collect();
        let frozen = if rebuilt.frozen { "; frozen: a build makes it whole" } else { "" };
        let tiles = format!("{} built{frozen}", names.join(", "));
        Ok(Finished { report: rebuilt.report, tiles, is_unchanged: false })
    });
    // Where what stands on the ground or clips edges is not whole, a tile by itself is refused.
    ended.map_err(|failure| failure.hinted_where("stopped in stage", "`tiefort build` goes on from here"))
}

/// Refuses a tile that the job does not have.
///
/// # Errors
/// When there is no such tile.
pub fn check_tile(job: &Job, tile: TileId) -> Result<(), Failure> {
    let (rows, columns) = (job.tiles.rows, job.tiles.columns);
    if tile.row < rows && tile.col < columns {
        return Ok(());
    }
    let (path, row, col) = (job.path.display(), tile.row, tile.col);
    Err(Failure::new(
        format!(
            "{path}: found no tile {row},{col}, expected a row from 0 to {} and a column from 0 to {}",
            rows - 1,
            columns - 1
        ),
        "rows come first and both count from the south-west; `tiefort plan` lists the tiles",
    ))
}
