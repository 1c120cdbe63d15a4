//! What of the area's objects a tile is assembled with.

use std::collections::BTreeMap;

use store::AreaOutlines;

use crate::ground::GamingArea;

/// What stands on the load modules of a tile, and what of it stands in tiles beside it.
pub struct TileObjects {
    /// Of each load module of the tile, row by row.
    pub own: Vec<terrain::Objects>,
    /// By the place of another tile among all: pieces of the tile's own prisms that stand there.
    pub beside: BTreeMap<usize, Vec<(terrain::ModuleId, terrain::Prism)>>,
}

impl TileObjects {
    /// Those of a tile of an area.
    pub fn of(outlines: &AreaOutlines, area: &GamingArea, tile: terrain::TileId) -> Self {
        let modules = area.tiling.modules(tile, area.grid);
        let of = |row, col| outlines.of_module(row, col).cloned().unwrap_or_default();
        let own: Vec<terrain::Objects> = modules.iter().map(|id| of(id.row, id.col)).collect();
        let mut ids: Vec<u64> = own.iter().flat_map(|objects| &objects.prisms).map(|prism| prism.id).collect();
        ids.sort_unstable();
        let mut beside: BTreeMap<usize, Vec<_>> = BTreeMap::new();
        // A prism reaches over one line between load modules at most, either way.
        for row in modules.south.saturating_sub(1)..(modules.north + 1).min(area.grid.rows) {
            for col in modules.west.saturating_sub(1)..(modules.east + 1).min(area.grid.cols) {
                let id = terrain::ModuleId { row, col };
                let other = area.tiling.tile_of_module(id, area.grid);
                let Some(objects) = outlines.of_module(row, col).filter(|_| other != tile) else { continue };
                let shared = objects.prisms.iter().filter(|prism| ids.binary_search(&prism.id).is_ok());
                let shared: Vec<_> = shared.map(|prism| (id, prism.clone())).collect();
                if !shared.is_empty() {
                    beside.entry(area.tiling.index(other)).or_default().extend(shared);
                }
            }
        }
        Self { own, beside }
    }
}
