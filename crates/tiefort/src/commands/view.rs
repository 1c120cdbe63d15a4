//! `tiefort view`: drive through a database, in a browser.

#[cfg(all(feature = "serve", not(feature = "viewer")))]
use std::path::Path;
use std::path::PathBuf;

use clap::Args;
#[cfg(all(feature = "serve", not(feature = "viewer")))]
use store::Folder;

use crate::failure::{Failure, Outcome};
#[cfg(all(feature = "serve", not(feature = "viewer")))]
use crate::{resources, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort view ntc.tdb
  tiefort view ntc.tdb --port 8380
  tiefort view ntc.tdb --imagery survey.tif --imagery harbour.tif

Prints the address to open in a browser on this machine; no other machine can
reach it. Ctrl-C ends it. W, A, S, D or arrows drive; F flies; the page lists
the rest. Beside the page it answers all that `tiefort serve DIR` does.

A tiefort that was built without the viewer shows the page of the report
there, with its maps, and says how to get the viewer.";

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

/// Serves the viewer's page until Ctrl-C.
#[cfg(feature = "viewer")]
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let page = crate::viewer::page(&arguments.database, &arguments.imagery)?;
    super::serve::run_with_page(&arguments.database, arguments.port, page)
}

/// Serves the page of the report until Ctrl-C, and says how to get the viewer.
#[cfg(all(feature = "serve", not(feature = "viewer")))]
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let how = crate::program::how_to_get_the_viewer();
    if !arguments.imagery.is_empty() {
        return Err(Failure::new("found --imagery, which the viewer lays over the ground, and no viewer in here", how));
    }
    Folder::new(&arguments.database).finished()?;
    terminal::tell(&format!(
        "note: this tiefort was built without the viewer: a browser shows the page of the report\nhint: {how}\n"
    ));
    let folder = arguments.database.clone();
    let page = crate::serve::report_page(&how, move || drawn(&folder));
    super::serve::run_with_page(&arguments.database, arguments.port, page)
}

/// The page that the last build wrote, or else one drawn now.
#[cfg(all(feature = "serve", not(feature = "viewer")))]
fn drawn(folder: &Path) -> Result<String, Failure> {
    let written = std::fs::read_to_string(folder.join("report.html"));
    written.or_else(|_| super::report::page(folder, &Folder::new(folder).report()?, &[], resources::cores()))
}

/// Says how to get a program that can.
#[cfg(not(feature = "serve"))]
pub fn run(_: &Arguments) -> Result<Outcome, Failure> {
    Err(Failure::new(
        "this tiefort was built without the service and the viewer",
        "build it with `--features serve`, which is the default; the page of the report lies in report.html",
    ))
}
