//! The area's limits, and whether they leave room for the points every build starts from.

use terrain::limits::{Windows, start_triangles, start_triangles_of_area};
use terrain::{ModuleGrid, ModuleId, Post, PostRect, SeamSides, Side};

use crate::tiling::Tiling;

/// The limits of a whole area, in triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Budget {
    /// The area's load modules.
    pub grid: ModuleGrid,
    /// Cells between points on the outer border.
    pub border_step: i32,
    /// Most triangles of one load module, before the pool.
    pub per_module: u32,
    /// Triangles above `per_module` that the whole area may use.
    pub pool: u64,
    /// Most triangles of the whole area.
    pub area: u64,
    /// Most triangles of one window.
    pub per_window: u32,
    /// The windows.
    pub windows: Windows,
    /// Triangles of each load module that features take, row-major; empty where there are none.
    pub reserved: Vec<u32>,
}

/// A limit that the initial points alone exceed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BudgetFault {
    /// A load module starts with more triangles than it may have.
    Module {
        /// Which.
        module: ModuleId,
        /// Triangles it starts with.
        start: u32,
        /// Triangles it may have.
        limit: u32,
    },
    /// A window does.
    Window {
        /// Its south-west load module.
        origin: ModuleId,
        /// Triangles it starts with.
        start: u32,
        /// Triangles it may have.
        limit: u32,
    },
    /// The area does.
    Area {
        /// Triangles it starts with.
        start: u64,
        /// Triangles it may have.
        limit: u64,
    },
}

impl Budget {
    /// Triangles of each load module before any point is chosen, row-major.
    pub fn start(&self) -> Vec<u32> {
        self.grid.all().iter().map(|module| self.start_of(module)).collect()
    }

    /// Triangles of one load module before any point is chosen.
    pub fn start_of(&self, module: ModuleId) -> u32 {
        let reserved = self.reserved.get(self.grid.index(module)).copied().unwrap_or(0);
        start_triangles(self.grid, module, self.border_step) + reserved
    }

    /// Triangles of the area before any point is chosen.
    pub fn start_total(&self) -> u64 {
        let reserved = self.reserved.iter().map(|&count| u64::from(count));
        start_triangles_of_area(self.grid, self.border_step) + reserved.sum::<u64>()
    }

    /// Whether the initial points fit.
    ///
    /// # Errors
    /// The first limit they exceed.
    pub fn check(&self) -> Result<(), BudgetFault> {
        let start = self.start();
        let full = self.grid.all().iter().zip(&start).find(|&(_, &count)| self.per_module < count);
        if let Some((module, &count)) = full {
            return Err(BudgetFault::Module { module, start: count, limit: self.per_module });
        }
        let sums = self.windows.sums(self.grid, &start);
        let full = self.windows.origins.iter().zip(&sums).find(|&(_, &count)| self.per_window < count);
        if let Some((origin, &count)) = full {
            return Err(BudgetFault::Window { origin, start: count, limit: self.per_window });
        }
        match self.start_total() {
            start if self.area < start => Err(BudgetFault::Area { start, limit: self.area }),
            _ => Ok(()),
        }
    }

    /// Sides of `module` that its tile inherits: the neighbours choose the points there.
    pub(crate) fn inherited_sides(&self, tiling: &Tiling, module: ModuleId) -> u32 {
        let tile = tiling.tile_of_module(module, self.grid);
        let (rect, posts) = (tiling.rect(tile), self.grid.posts_of(module));
        let on_side = |side| crate::tiling::outer_sides(posts, rect).is_open(side);
        terrain::Side::ALL.into_iter().filter(|&side| on_side(side) && tiling.inherits(tile, side)).count() as u32
    }
}

/// The sides of `tile` that lie on the border of `area`.
pub fn outer_sides(tile: PostRect, area: PostRect) -> SeamSides {
    SeamSides::from_fn(|side| match side {
        Side::South => tile.south == area.south,
        Side::East => tile.east == area.east,
        Side::North => tile.north == area.north,
        Side::West => tile.west == area.west,
    })
}

/// Posts every `step` cells on the sides of `tile` for which `sides` is open, corners included, in row
/// order and each once.
pub fn outer_border_posts(tile: PostRect, sides: SeamSides, step: i32) -> Vec<Post> {
    let along_row = |row: i32| (tile.west..=tile.east).step_by(step as usize).map(move |col| Post::new(row, col));
    let along_col = |col: i32| (tile.south..=tile.north).step_by(step as usize).map(move |row| Post::new(row, col));
    let mut posts = Vec::new();
    for side in Side::ALL.into_iter().filter(|&side| sides.is_open(side)) {
        match side {
            Side::South => posts.extend(along_row(tile.south)),
            Side::North => posts.extend(along_row(tile.north)),
            Side::West => posts.extend(along_col(tile.west)),
            Side::East => posts.extend(along_col(tile.east)),
        }
    }
    posts.sort_unstable();
    posts.dedup();
    posts
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::TileOrder;

    fn budget(per_module: u32, area: u64, per_window: u32) -> Budget {
        let grid = ModuleGrid { rows: 10, cols: 10, side_cells: 20 };
        let windows = Windows::new(grid, 8);
        Budget { grid, border_step: 5, per_module, pool: 0, area, per_window, windows, reserved: Vec::new() }
    }

    #[test]
    fn limits_below_the_initial_points_are_told_apart() {
        // 100 modules of 2, 40 outer sides of 3 more: corner load modules have 8.
        assert_eq!(budget(100, 3200, 4096).start_total(), 320);
        for (rows, cols) in [(1, 1), (1, 7), (2, 1), (5, 3)] {
            let grid = ModuleGrid { rows, cols, side_cells: 20 };
            let reserved = (0..rows * cols).collect();
            let of = Budget { grid, windows: Windows::new(grid, 8), reserved, ..budget(100, 3200, 4096) };
            assert_eq!(of.start_total(), of.start().into_iter().map(u64::from).sum::<u64>(), "{rows} x {cols}");
        }
        assert_eq!(budget(100, 3200, 4096).check(), Ok(()));
        let module = ModuleId { row: 0, col: 0 };
        assert_eq!(budget(7, 3200, 4096).check(), Err(BudgetFault::Module { module, start: 8, limit: 7 }));
        assert_eq!(budget(100, 319, 4096).check(), Err(BudgetFault::Area { start: 320, limit: 319 }));
        assert!(matches!(budget(100, 3200, 150).check(), Err(BudgetFault::Window { .. })));
    }

    #[test]
    fn only_load_modules_at_inherited_sides_count_them() {
        let budget = budget(100, 3200, 4096);
        let tiling = Tiling::new(budget.grid.area(), 20, 2, 2, TileOrder::Color);
        let inherited = |row, col| budget.inherited_sides(&tiling, ModuleId { row, col });
        // Tile 0,0 ranks first and inherits nothing; tile 1,1 ranks last and inherits two sides.
        assert_eq!((inherited(4, 4), inherited(5, 5), inherited(9, 9), inherited(0, 5)), (0, 2, 0, 1));
    }

    #[test]
    fn the_paper_s_area_has_1600_border_points_of_which_400_are_load_module_corners() {
        let area = PostRect::of_size(2001, 2001);
        let posts = outer_border_posts(area, outer_sides(area, area), 5);
        assert_eq!(posts.len(), 1600);
        assert_eq!(posts.iter().filter(|post| post.row % 20 == 0 && post.col % 20 == 0).count(), 400);
    }

    #[test]
    fn an_inner_tile_has_no_border_points() {
        let area = PostRect::of_size(101, 101);
        let tile = PostRect::new(Post::new(20, 20), Post::new(40, 40));
        assert!(outer_border_posts(tile, outer_sides(tile, area), 5).is_empty());
    }
}
