//! `tiefort view`: drive through a database, in a browser.

use std::path::PathBuf;

use clap::Args;

use crate::failure::{Failure, Outcome};

const AFTER_HELP: &str = "\
Examples:
  tiefort view ntc.tdb
  tiefort view ntc.tdb --port 8380
  tiefort view ntc.tdb --imagery survey.tif --imagery harbour.tif

Prints the address to open in a browser on this machine; no other machine can
reach it. Ctrl-C ends it. W, A, S, D or arrows drive; F flies; the page lists
the rest. Beside the page it answers all that `tiefort serve DIR` does.

The viewer is built in by
  scripts/build_viewer.sh
  cargo build --release --features viewer";

/// Arguments of `view`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the terrain database
    #[arg(value_name = "DIR")]
    pub database: PathBuf,
    /// Port on 127.0.0.1; 0 takes any that is free
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub port: u16,
    /// GeoTIFF to lay over the ground, in any coordinate system; may be given several times, later ones above
    #[arg(long, value_name = "FILE")]
    pub imagery: Vec<PathBuf>,
}

/// Serves the page until Ctrl-C.
#[cfg(feature = "viewer")]
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let page = crate::viewer::page(&arguments.database, &arguments.imagery)?;
    super::serve::run_with_page(&arguments.database, arguments.port, page)
}

/// Says how to get a program that can.
#[cfg(not(feature = "viewer"))]
pub fn run(_: &Arguments) -> Result<Outcome, Failure> {
    Err(Failure::new(
        "this tiefort was built without the viewer",
        "run scripts/build_viewer.sh (it needs Node), then `cargo build --release --features viewer`",
    ))
}
