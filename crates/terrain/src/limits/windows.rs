//! Square windows of load modules: every one of them is held to the 4 km limit, not only aligned ones.

use crate::{ModuleGrid, ModuleId, ModuleRect};

/// All windows of `rows` x `cols` load modules in an area, named by their south-west load module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Windows {
    /// Load modules high; cut to the area.
    pub rows: u32,
    /// Load modules wide; cut to the area.
    pub cols: u32,
    /// Windows there are, by their south-west load module.
    pub origins: ModuleRect,
}

impl Windows {
    /// The windows of `side` x `side` load modules in `grid`, cut to a smaller area.
    pub fn new(grid: ModuleGrid, side: u32) -> Self {
        Self::of_size(grid, side, side)
    }

    /// The windows of `rows` x `cols` load modules in `grid`, cut to a smaller area.
    pub fn of_size(grid: ModuleGrid, rows: u32, cols: u32) -> Self {
        let (rows, cols) = (rows.min(grid.rows), cols.min(grid.cols));
        let origins = ModuleRect { south: 0, west: 0, north: grid.rows - rows + 1, east: grid.cols - cols + 1 };
        Self { rows, cols, origins }
    }

    /// The windows that hold at least one load module of `modules`.
    pub fn touching(&self, modules: ModuleRect) -> ModuleRect {
        ModuleRect {
            south: modules.south.saturating_sub(self.rows - 1),
            west: modules.west.saturating_sub(self.cols - 1),
            north: modules.north.min(self.origins.north),
            east: modules.east.min(self.origins.east),
        }
    }

    /// The load modules of the window at `origin`.
    pub fn modules_of(&self, origin: ModuleId) -> ModuleRect {
        ModuleRect { south: origin.row, west: origin.col, north: origin.row + self.rows, east: origin.col + self.cols }
    }

    /// Sums of `counts` (one per load module, row-major over `grid`) over every window, row-major.
    pub fn sums(&self, grid: ModuleGrid, counts: &[u32]) -> Vec<u32> {
        assert_eq!(counts.len(), grid.count(), "one count per load module");
        let wide = grid.cols as usize + 1;
        let mut prefix = vec![0u64; wide * (grid.rows as usize + 1)];
        for (row, line) in counts.chunks(grid.cols as usize).enumerate() {
            let mut along = 0;
            for (col, &count) in line.iter().enumerate() {
                along += u64::from(count);
                prefix[(row + 1) * wide + col + 1] = prefix[row * wide + col + 1] + along;
            }
        }
        let corner = |row: u32, col: u32| prefix[row as usize * wide + col as usize];
        let sum = |origin: ModuleId| {
            let window = self.modules_of(origin);
            (corner(window.north, window.east) + corner(window.south, window.west)
                - corner(window.south, window.east)
                - corner(window.north, window.west)) as u32
        };
        self.origins.iter().map(sum).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: ModuleGrid = ModuleGrid { rows: 12, cols: 10, side_cells: 20 };

    #[test]
    fn window_sums_equal_the_sums_added_one_by_one() {
        let counts: Vec<u32> = (0..120).map(|i| i * 7 % 31).collect();
        let windows = Windows::new(GRID, 8);
        let slow: Vec<u32> = windows
            .origins
            .iter()
            .map(|origin| windows.modules_of(origin).iter().map(|module| counts[GRID.index(module)]).sum())
            .collect();
        assert_eq!(windows.sums(GRID, &counts), slow);
        assert_eq!(slow.len(), 5 * 3);
    }

    #[test]
    fn a_small_area_has_one_window_cut_to_it() {
        let grid = ModuleGrid { rows: 3, cols: 2, side_cells: 20 };
        let windows = Windows::new(grid, 8);
        assert_eq!((windows.rows, windows.cols, windows.origins.count()), (3, 2, 1));
    }

    #[test]
    fn touching_windows_are_exactly_those_that_hold_a_load_module() {
        let windows = Windows::new(GRID, 4);
        let modules = ModuleRect { south: 5, west: 2, north: 7, east: 3 };
        let touching = windows.touching(modules);
        for origin in windows.origins.iter() {
            let holds = windows.modules_of(origin).iter().any(|module| modules.contains(module));
            assert_eq!(touching.contains(origin), holds, "{origin}");
        }
    }
}
