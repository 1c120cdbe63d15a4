//! `[tiles]`: how the work is cut.

use terrain::ModuleGrid;

use crate::bounds::{TILES_DEFAULT, TILES_MAX};
use crate::entry::Section;
use crate::{Borders, JobError, TileOrder, TilesSpec};

/// Load modules a tile is at least wide, unless it spans the area.
const MODULES_PER_TILE_MIN: u32 = 2;

pub(super) fn read(tiles: &Section, grid: &ModuleGrid) -> Result<TilesSpec, JobError> {
    let rows = along(tiles, "rows", grid.rows)?;
    let columns = along(tiles, "columns", grid.cols)?;
    if let Some(entry) = tiles.optional("rows").or_else(|| tiles.optional("columns"))
        && TILES_MAX < u64::from(rows) * u64::from(columns)
    {
        return Err(entry.out_of_range(format!("at most {TILES_MAX} tiles, rows times columns")));
    }
    let order = match tiles.optional("order") {
        Some(entry) => entry.word(&[("colour", TileOrder::Color), ("raster", TileOrder::Raster)])?,
        None => TileOrder::Color,
    };
    let words = [("inherit", Some(Borders::Inherit)), ("regular", Some(Borders::Regular)), ("line", None)];
    let borders = match tiles.optional("borders") {
        Some(entry) => {
            let known = entry.word(&words)?;
            known.ok_or_else(|| entry.unsupported("\"inherit\" or \"regular\"", "\"inherit\" is the usual one"))?
        }
        None => Borders::Inherit,
    };
    Ok(TilesSpec { rows, columns, order, borders })
}

/// How many tiles there are along one side of the area: as the job says, or the usual number, fewer where they
/// would be too narrow.
fn along(tiles: &Section, key: &str, modules: u32) -> Result<u32, JobError> {
    let most = (modules / MODULES_PER_TILE_MIN).max(1);
    let Some(entry) = tiles.optional(key) else { return Ok(TILES_DEFAULT.min(most)) };
    entry.whole_u32(1..=most, &format!("tiles of {modules} load modules, at least two each"))
}
