//! `tiefort status`: how far a database is.

use std::path::PathBuf;

use clap::Args;
use compiler::Status;
use database::{Manifest, ManifestState, TileState};
use views::grouped;

use crate::board::Board;
use crate::failure::{Failure, Outcome};
use crate::terminal;

const AFTER_HELP: &str = "\
Examples:
  tiefort status ntc.tdb

Exit codes: 0 complete, all limits met; 1 complete, with breaches; 2 incomplete; 75 being built right now.";

/// Arguments of `status`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the terrain database
    #[arg(value_name = "DIR")]
    database: PathBuf,
}

/// Every state of a tile, its character and its name.
const STATES: [(TileState, char, &str); 5] = [
    (TileState::Done, '#', "done"),
    (TileState::OverLimit, '!', "over a limit"),
    (TileState::Frozen, 'f', "frozen"),
    (TileState::Failed, 'x', "failed"),
    (TileState::Missing, '.', "missing"),
];

/// Tells the status.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let status = compiler::status(&arguments.database)?;
    terminal::print(&status_text(&status))?;
    let complete = status.manifest.state == ManifestState::Complete;
    Ok(match (status.locked, complete, status.manifest.totals.breaches) {
        (true, ..) => Outcome::TryLater,
        (false, false, _) => Outcome::Damaged,
        (false, true, 0) => Outcome::Sound,
        (false, true, _) => Outcome::Breaches,
    })
}

fn status_text(status: &Status) -> String {
    let Manifest { area, state, tiles, totals, .. } = &status.manifest;
    let state = match (status.locked, state) {
        (true, _) => "being built right now",
        (false, ManifestState::Incomplete) => "incomplete: `tiefort build` goes on with it",
        (false, ManifestState::Complete) => "complete",
    };
    let mut text = format!("Gaming area {}: {state}\n\n", area.name);
    let mut board = Board::new(area.tile_rows, area.tile_cols);
    for record in tiles {
        board.mark(record.tile(), mark(record.state));
    }
    for line in board.lines() {
        text += &format!("  {line}\n");
    }
    text += "\n";
    for (state, mark, name) in STATES {
        let count = tiles.iter().filter(|record| record.state == state).count();
        if 0 < count {
            text += &format!("  {mark} {name}: {}\n", grouped(count as u64));
        }
    }
    if status.manifest.state == ManifestState::Complete {
        let (points, triangles) = (grouped(totals.points), grouped(totals.triangles));
        text += &format!("\n{triangles} triangles, {points} points, {} breaches\n", grouped(totals.breaches));
    }
    text
}

fn mark(state: TileState) -> char {
    let known = STATES.iter().find(|(known, ..)| *known == state);
    known.map(|(_, mark, _)| *mark).expect("every state is in the table")
}
