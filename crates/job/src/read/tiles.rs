//! `[tiles]`: how the work is cut.

use terrain::ModuleGrid;

use crate::bounds::{MODULES_PER_TILE_MIN, TILES_MAX};
use crate::entry::{Section, in_32_bits};
use crate::{JobError, TilesSpec};

pub(super) fn read(tiles: &Section, grid: &ModuleGrid) -> Result<TilesSpec, JobError> {
    let rows = along(tiles, "rows", grid.rows)?;
    let columns = along(tiles, "columns", grid.cols)?;
    if let Some(entry) = tiles.optional("rows").or_else(|| tiles.optional("columns"))
        && TILES_MAX < u64::from(rows) * u64::from(columns)
    {
        return Err(entry.out_of_range(format!("at most {TILES_MAX} tiles, rows times columns")));
    }
    match tiles.optional("borders") {
        Some(entry) if entry.text()? == "line" => {
            Err(entry.unsupported(&entry.expected(), "\"inherit\" is the usual one"))
        }
        _ => Ok(TilesSpec { rows, columns, order: tiles.word("order")?, borders: tiles.word("borders")? }),
    }
}

/// How many tiles there are along one side of the area: as the job says, or the usual number, fewer where they
/// would be too narrow.
fn along(tiles: &Section, key: &str, modules: u32) -> Result<u32, JobError> {
    let most = (modules / MODULES_PER_TILE_MIN).max(1);
    match tiles.optional(key) {
        Some(entry) => entry
            .whole_in(&(1..=most.into()), &format!("tiles of {modules} load modules, at least two each"))
            .map(in_32_bits),
        None => tiles.whole_u32(key).map(|usual| usual.min(most)),
    }
}
