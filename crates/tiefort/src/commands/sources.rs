//! `tiefort sources`: what heights, lines and polygons of the Earth are known by name.

use std::path::PathBuf;

use clap::Args;
use views::{Align, Table};

use crate::catalogue::{self, Vectors};
use crate::failure::{Failure, Outcome};
use crate::terminal;

const AFTER_HELP: &str = "\
Examples:
  tiefort sources
  tiefort sources --toml > own.toml
  tiefort init --around 35.3,-116.6 --km 50 --dem glo90 --out mojave.toml

Nothing is asked of any network. Entries of your own are written in the same way
as the built-in ones.";

/// Arguments of `sources`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// A file with entries of your own, which go before the built-in ones
    #[arg(long, value_name = "FILE.toml")]
    catalogue: Option<PathBuf>,
    /// Print the built-in entries as they are written
    #[arg(long)]
    toml: bool,
}

/// Lists them.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if arguments.toml {
        terminal::print(catalogue::built_in())?;
        return Ok(Outcome::Sound);
    }
    let known = catalogue::catalogue(arguments.catalogue.as_deref())?;
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Left, Align::Left, Align::Left]);
    table.row(["name", "spacing", "model", "heights above", "what"]);
    for entry in &known.heights {
        let (spacing, datum) = (format!("{} m", entry.spacing_m), format!("{}, {}", entry.datum, entry.unit));
        table.row([&entry.name, &spacing, &entry.model, &datum, &entry.title]);
    }
    for vectors in &known.vectors {
        table.row([&vectors.name, "", "vectors", "", &vectors.title]);
    }
    let mut text = table.text(0);
    for entry in &known.heights {
        let from = entry.address.as_ref().unwrap_or(&entry.ask);
        text += &format!(
            "\n{}: {}\n  licence: {}\n  attribution: {}\n",
            entry.name, from, entry.licence, entry.attribution
        );
    }
    for Vectors { name, ask, features, objects, licence, attribution, .. } in &known.vectors {
        let addresses = features.iter().chain(objects).map(|address| format!("\n  {address}")).collect::<String>();
        text += &format!("\n{name}: {ask}{addresses}\n  licence: {licence}\n  attribution: {attribution}\n");
    }
    terminal::print(&text)?;
    Ok(Outcome::Sound)
}
