//! `tiefort status`: how far a database is.

use std::path::PathBuf;

use clap::Args;
use inspect::{Status, TileProgress};
use store::Manifest;
use store::engine::Held;
use views::{fold, grouped};

use crate::board::Board;
use crate::failure::{Failure, OUTDATED, Outcome};
use crate::terminal;

const AFTER_HELP: &str = "\
Examples:
  tiefort status ntc.tdb

Files are not read: it looks whether each is there with its length, and whether
the report is of this build. `tiefort verify` reads them all.

Exit codes: 0 complete, all limits met; 1 complete, with breaches; 2 incomplete
or damaged; 75 being built right now.";

/// Arguments of `status`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the terrain database
    #[arg(value_name = "DIR")]
    database: PathBuf,
}

/// Tiles side by side that fit a terminal, two columns each.
const BOARD_COLUMNS_MAX: u32 = 38;
/// Damaged files that are told.
const DAMAGE_MAX: usize = 10;
/// Characters by how much they matter where one stands for several tiles.
const ORDER: [char; 5] = ['.', '!', 'f', 'o', '#'];

/// Every state of a tile, its character and its name.
const STATES: [(TileProgress, char, &str); 5] = [
    (TileProgress::Done, '#', "done"),
    (TileProgress::OverLimit, '!', "over a limit"),
    (TileProgress::Frozen, 'f', "frozen"),
    (TileProgress::Earlier, 'o', "of the build before, kept if still fresh"),
    (TileProgress::Missing, '.', "missing"),
];

/// Tells the status.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let status = inspect::status(&arguments.database)?;
    terminal::print(&status_text(&status))?;
    let complete = status.is_complete() && status.damage.is_empty();
    Ok(match (status.held, complete, status.manifest.totals.breaches) {
        (Held::Alone, ..) | (Held::Shared, false, _) => Outcome::TryLater,
        (_, false, _) => Outcome::Damaged,
        (_, true, 0) => Outcome::Sound,
        (_, true, _) => Outcome::Breaches,
    })
}

fn status_text(status: &Status) -> String {
    let Manifest { area, totals, .. } = &status.manifest;
    let tiles = &status.tiles;
    let state = match (status.held, status.is_complete()) {
        (Held::Alone, _) => "being built right now",
        (Held::Shared, false) => "being built right now by processes that share it",
        (Held::Free, false) => "incomplete: `tiefort build` goes on with it",
        (_, true) if !status.damage.is_empty() => "damaged: `tiefort build` makes these files again",
        (_, true) => "complete",
    };
    let mut text = format!("Gaming area {}: {state}\n", area.name);
    status.damage.iter().take(DAMAGE_MAX).for_each(|problem| text += &format!("  {problem}\n"));
    let more = status.damage.len().saturating_sub(DAMAGE_MAX);
    if 0 < more {
        text += &format!("  and {} more: `tiefort verify` tells all\n", grouped(more as u64));
    }
    if status.is_outdated {
        text += &format!("outdated: {OUTDATED}\n");
    }
    text += "\n";
    let mut board = Board::new(area.tile_rows, area.tile_cols);
    for &(tile, progress) in tiles {
        board.mark(tile, mark(progress));
    }
    let side = area.tile_cols.div_ceil(BOARD_COLUMNS_MAX).max(1);
    for line in board.coarser(side, &ORDER).lines() {
        text += &format!("  {line}\n");
    }
    text += "\n";
    if 1 < side {
        text += &format!("  each character is {side} x {side} tiles: the least done of them\n");
    }
    for (state, mark, name) in STATES {
        let count = tiles.iter().filter(|(_, progress)| *progress == state).count();
        if 0 < count {
            text += &format!("  {mark} {name}: {}\n", grouped(count as u64));
        }
    }
    if status.is_complete() {
        let (points, triangles) = (grouped(totals.points), grouped(totals.triangles));
        text += &format!("\n{triangles} triangles, {points} points, {} breaches\n", grouped(totals.breaches));
        if let Some(newest) = status.formats.last().filter(|newest| 1 < **newest) {
            let holds =
                if *newest == 2 { "decks of bridges" } else { "decks of bridges and lines of roads and rivers" };
            text += &format!("load modules of format version {newest}: with {holds}\n");
        }
    }
    fold(&text, 2)
}

fn mark(state: TileProgress) -> char {
    let known = STATES.iter().find(|(known, ..)| *known == state);
    known.map(|(_, mark, _)| *mark).expect("every state is in the table")
}
