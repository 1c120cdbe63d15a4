//! `tiefort verify`: is the database sound?

use std::path::PathBuf;

use clap::Args;
use views::{fold, grouped};

use crate::failure::{Failure, Outcome};
use crate::terminal;

const AFTER_HELP: &str = "\
Examples:
  tiefort verify ntc.tdb
  tiefort verify desert.tdb --dem desert.tif    measure residuals against it, too

Exit codes: 0 sound; 2 damaged, each problem on a line of its own.";

/// Arguments of `verify`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the terrain database
    #[arg(value_name = "DIR")]
    database: PathBuf,
    /// A raster of heights to measure residuals against
    #[arg(long, value_name = "FILE")]
    dem: Option<PathBuf>,
}

/// Verifies.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let verdict = inspect::verify(&arguments.database, arguments.dem.as_deref())?;
    let mut text: String = verdict.problems.iter().map(|problem| format!("{problem}\n")).collect();
    text += &verdict.unchecked.iter().map(|what| format!("not checked: {what}\n")).collect::<String>();
    let checked = format!(
        "{} files and {} load modules checked",
        grouped(verdict.checked_files as u64),
        grouped(verdict.checked_modules as u64)
    );
    text += &match verdict.problems.len() {
        0 => format!("sound: {checked}\n"),
        1 => format!("damaged: 1 problem; {checked}\n"),
        problems => format!("damaged: {} problems; {checked}\n", grouped(problems as u64)),
    };
    if 0 < verdict.breaches {
        let exceeded =
            if verdict.breaches == 1 { "1 is".to_owned() } else { format!("{} are", grouped(verdict.breaches)) };
        text += &format!("limits: {exceeded} exceeded, as breaches.csv lists\n");
    }
    if let Some(residual) = &verdict.residual {
        let (rms_m, max_m, p99_m) = (residual.rms_m, residual.max_m, residual.p99_m);
        text += &format!("residual: RMS {rms_m:.3} m, 99 % within {p99_m:.2} m, largest {max_m:.2} m\n");
    }
    text += &verdict.network.as_ref().map(network).unwrap_or_default();
    text += &verdict.decks.as_ref().map(|decks| format!("decks: {decks}\n")).unwrap_or_default();
    text += &verdict.objects.as_ref().map(|objects| format!("objects: {objects}\n")).unwrap_or_default();
    if let Some(held) = verdict.held_vertices {
        text += &format!("{} vertices stand as far outside the posts around them as any may\n", grouped(held));
    }
    terminal::print(&fold(&text, 2))?;
    Ok(if verdict.problems.is_empty() { Outcome::Sound } else { Outcome::Damaged })
}

/// What the load modules hold of roads, rivers and lakes.
fn network(found: &inspect::NetworkFound) -> String {
    let inspect::NetworkFound { kept_m, pieces_missing, gaps, ends, lakes, lakes_off_level, lakes_without_shore } =
        *found;
    let without_shore = match lakes_without_shore {
        0 => String::new(),
        count => format!(", {} of them without room for their shore", grouped(count)),
    };
    format!(
        "network: {:.1} km kept, {} pieces missing, {} gaps of more than 30 m, {} ends where the source goes on, {} of \
         {} large lakes (a hectare) more than 0.5 m off their level{without_shore}\n",
        kept_m / 1000.0,
        grouped(pieces_missing),
        grouped(gaps),
        grouped(ends),
        grouped(lakes_off_level),
        grouped(lakes)
    )
}
