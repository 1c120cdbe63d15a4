//! The tiles of an area as a plan lists them: places, ranks, and who waits for whom.

use terrain::{ModuleRect, PostRect, Side, TileId};

use crate::ground::GamingArea;

/// One tile of a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedTile {
    /// Which.
    pub tile: TileId,
    /// Its place in the order of ranks.
    pub rank: usize,
    /// Its colour: tiles of one colour share neither side nor corner.
    pub color: u32,
    /// Its posts, seams included.
    pub rect: PostRect,
    /// Its load modules.
    pub modules: ModuleRect,
    /// The tiles whose border points seed it.
    pub inherits_from: Vec<TileId>,
    /// The tiles it waits for: those of lower rank that share a side or a corner with it.
    pub after: Vec<TileId>,
}

/// Every tile of an area, row by row from the south-west.
pub fn planned_tiles(area: &GamingArea) -> Vec<PlannedTile> {
    let mut ranks = vec![0; area.tiles.len()];
    area.by_rank().into_iter().enumerate().for_each(|(rank, index)| ranks[index] = rank);
    area.tiles.iter().map(|&tile| planned(area, tile, &ranks)).collect()
}

fn planned(area: &GamingArea, tile: TileId, ranks: &[usize]) -> PlannedTile {
    let tiling = &area.tiling;
    let inherits = Side::ALL.into_iter().filter(|&side| tiling.inherits(tile, side));
    PlannedTile {
        tile,
        rank: ranks[tiling.index(tile)],
        color: tiling.color(tile),
        rect: tiling.rect(tile),
        modules: tiling.modules(tile, area.grid),
        inherits_from: inherits.filter_map(|side| tiling.beyond(tile, side)).collect(),
        after: tiling.neighbours(tile).into_iter().filter(|&other| tiling.rank(other) < tiling.rank(tile)).collect(),
    }
}
