//! One definition of what counts against a limit, and the ledger a tile spends from.
//!
//! Identities per load module with `V` inner vertices, `B` vertices on its sides (corners included) and
//! `E` inner edges of its polygons: triangles = 2 V + B - 2, polygons = 1 + E - V.

mod windows;
pub use windows::Windows;
mod ledger;
mod lines;
pub use ledger::{Allowance, Ledger, ShortOf, Shortfall, TileLedger};
pub use lines::{Charged, ModuleLines};
mod features;
pub use features::{FeatureCost, feature_cost};

use super::{ModuleGrid, ModuleId};

/// Triangles of a load module with `inner` vertices inside and `border` on its sides, corners included.
pub fn triangles_of(inner: usize, border: usize) -> usize {
    2 * inner + border - 2
}

/// Polygons of a load module with `inner` vertices and `inner_edges` edges between its polygons.
pub fn polygons_of(inner: usize, inner_edges: usize) -> usize {
    1 + inner_edges - inner
}

/// Triangles of a load module before any point is chosen: two, and one more for each border point on a
/// side that lies on the area's outer border (every `border_step` cells).
pub fn start_triangles(grid: ModuleGrid, module: ModuleId, border_step: i32) -> u32 {
    let outer_sides = [module.row == 0, module.col == 0, module.row + 1 == grid.rows, module.col + 1 == grid.cols];
    let points_per_side = (grid.side_cells / border_step - 1) as u32;
    2 + points_per_side * outer_sides.into_iter().filter(|&outer| outer).count() as u32
}

/// Triangles of all load modules before any point is chosen, without asking each of them.
pub fn start_triangles_of_area(grid: ModuleGrid, border_step: i32) -> u64 {
    let points_per_side = (grid.side_cells / border_step - 1) as u64;
    2 * grid.count() as u64 + points_per_side * 2 * (u64::from(grid.rows) + u64::from(grid.cols))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_regular_125_m_load_module_has_32_triangles() {
        assert_eq!(triangles_of(9, 16), 32);
        // As 16 squares: 24 inner edges between 9 inner vertices.
        assert_eq!(polygons_of(9, 24), 16);
    }

    #[test]
    fn only_outer_sides_start_with_border_points() {
        let grid = ModuleGrid { rows: 3, cols: 3, side_cells: 20 };
        let start = |row, col| start_triangles(grid, ModuleId { row, col }, 5);
        assert_eq!((start(1, 1), start(0, 1), start(0, 0), start(2, 2)), (2, 5, 8, 8));
        let alone = ModuleGrid { rows: 1, cols: 1, side_cells: 20 };
        assert_eq!(start_triangles(alone, ModuleId { row: 0, col: 0 }, 5), 14);
    }
}
