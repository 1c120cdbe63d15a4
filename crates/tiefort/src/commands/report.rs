//! `tiefort report`: what a build found.

use std::path::{Path, PathBuf};

use build::product::{Product, Wanted, WantedGround};
use clap::{Args, ValueEnum};
use store::{Folder, Report};

use crate::arguments::{Workers, wanted_ground};
use crate::failure::{Failure, Outcome};
use crate::terminal;

const AFTER_HELP: &str = "\
Examples:
  tiefort report ntc.tdb
  tiefort report ntc.tdb --format json | jq '.breaches[].where'
  tiefort report ntc.tdb --format html > report.html    one file, with maps

Exit codes: 0 all limits met; 1 with breaches; 2 no report to read.";

/// Arguments of `report`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the terrain database
    #[arg(value_name = "DIR")]
    database: PathBuf,
    /// For a person, a program or a browser
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// A raster to take for the ground, or several; for html only [default: what the database was built from]
    #[arg(long, value_name = "DEM")]
    against: Vec<PathBuf>,
    #[command(flatten)]
    workers: Workers,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For a person
    Text,
    /// For a program
    Json,
    /// For a browser
    Html,
}

/// Prints the report.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if !arguments.against.is_empty() && arguments.format != Format::Html {
        let message = "found --against with a report that draws nothing, expected --format html";
        return Err(Failure::new(message, "leave --against out, or add --format html"));
    }
    let folder = Folder::new(&arguments.database);
    // A build that was ended just before its end may have left a report.
    folder.finished()?;
    let report = folder.report()?;
    let text = match arguments.format {
        Format::Json => {
            serde_json::to_string_pretty(&report).expect("a report that was read from JSON is JSON again") + "\n"
        }
        Format::Text => views::report_text(&report),
        Format::Html => page(&arguments.database, &report, &arguments.against, arguments.workers.count())?,
    };
    terminal::print(&text)?;
    Ok(if report.breaches.is_empty() { Outcome::Sound } else { Outcome::Breaches })
}

/// The page of a report; without the ground's part of it where the ground is not to be found and none was named.
///
/// # Errors
/// When the database or a raster of `against` cannot be read.
pub fn page(database: &Path, report: &Report, against: &[PathBuf], workers: usize) -> Result<String, Failure> {
    let wanted = Wanted { part: None, ground: wanted_ground(against), workers };
    let product = match Product::read(database, &wanted) {
        Err(error) if error.is_of_the_ground() && against.is_empty() => {
            terminal::tell(&format!("note: {error}; the page is drawn without it\nhint: --against DEM names it\n"));
            Product::read(database, &Wanted { ground: WantedGround::None, ..wanted })?
        }
        found => found?,
    };
    Ok(build::product::page(&product, report, workers))
}
