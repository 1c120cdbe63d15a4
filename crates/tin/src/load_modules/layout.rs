//! Where the load modules of a tile lie, and how long they are in quanta.

use terrain::{LATTICE_PER_POST, ModuleGrid, ModuleId, ModuleRect, Spacing};

/// Which load modules are made, and where they lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// All load modules of the area.
    pub grid: ModuleGrid,
    /// The load modules of the tile.
    pub modules: ModuleRect,
    /// Metres between posts.
    pub spacing: Spacing,
}

impl Layout {
    /// Length of a side in quanta of 1/128 m.
    ///
    /// # Panics
    /// When it does not fit 16 bits, which a plan refuses.
    pub fn side(&self) -> u16 {
        let quanta = i64::from(self.grid.side_cells) * i64::from(self.spacing.quanta_per_post());
        u16::try_from(quanta).unwrap_or_else(|_| panic!("a load module side has at most 65535 quanta, not {quanta}"))
    }

    /// Length of a side in eighths of a post.
    pub fn side_lattice(&self) -> i32 {
        self.grid.side_cells * LATTICE_PER_POST
    }

    /// Place of a load module among those of the tile, row by row; `None` outside the tile.
    pub(crate) fn slot(&self, row: i32, col: i32) -> Option<usize> {
        let id = ModuleId { row: u32::try_from(row).ok()?, col: u32::try_from(col).ok()? };
        let within = |id: ModuleId| (id.row - self.modules.south) * self.modules.cols() + id.col - self.modules.west;
        self.modules.contains(id).then(|| within(id) as usize)
    }
}
