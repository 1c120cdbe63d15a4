//! `tiefort report`: what a build found.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use database::Folder;

use crate::failure::{Failure, Outcome};
use crate::terminal;

const AFTER_HELP: &str = "\
Examples:
  tiefort report ntc.tdb
  tiefort report ntc.tdb --format json | jq '.breaches[].where'

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
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For a person
    Text,
    /// For a program
    Json,
    /// For a browser (not supported yet)
    Html,
}

/// Prints the report.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if arguments.format == Format::Html {
        return Err(Failure::not_yet("--format html", "use --format text or json"));
    }
    let report = Folder::new(&arguments.database).report()?;
    let text = match arguments.format {
        Format::Json => {
            serde_json::to_string_pretty(&report).expect("a report that was read from JSON is JSON again") + "\n"
        }
        _ => views::report_text(&report),
    };
    terminal::print(&text)?;
    Ok(if report.breaches.is_empty() { Outcome::Sound } else { Outcome::Breaches })
}
