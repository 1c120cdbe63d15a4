//! The grid of tiles: lines, ranks, neighbours.

use terrain::{ModuleGrid, ModuleRect, Post, PostRect, SeamSides, Side, TileId, TileOrder};

/// A grid of tiles that share the lines of posts between them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tiling {
    row_lines: Vec<i32>,
    col_lines: Vec<i32>,
    order: TileOrder,
}

impl Tiling {
    /// `rows` x `cols` tiles over `area`, their lines at `ceil(k * cells / tiles)`, where a cell is `step`
    /// posts: a load module's side where there are load modules, 1 where there are none.
    ///
    /// # Panics
    /// When `step` does not divide the area or a tile would be empty.
    pub fn new(area: PostRect, step: i32, rows: u32, cols: u32, order: TileOrder) -> Self {
        let lines = |first: i32, cells: usize, tiles: u32| -> Vec<i32> {
            let steps = cells / step as usize;
            assert!(cells.is_multiple_of(step as usize), "tile lines lie on whole steps");
            assert!(0 < tiles && tiles as usize <= steps, "{tiles} tiles need at least as many steps, found {steps}");
            let line = |row| ModuleRect::of_tile(TileId { row, col: 0 }, [steps as u32; 2], [tiles; 2]).south;
            (0..=tiles).map(|k| first + line(k) as i32 * step).collect()
        };
        Self {
            row_lines: lines(area.south, area.cells_high(), rows),
            col_lines: lines(area.west, area.cells_wide(), cols),
            order,
        }
    }

    /// Rows of tiles.
    pub fn rows(&self) -> u32 {
        self.row_lines.len() as u32 - 1
    }

    /// Columns of tiles.
    pub fn cols(&self) -> u32 {
        self.col_lines.len() as u32 - 1
    }

    /// Number of tiles.
    pub(crate) fn count(&self) -> usize {
        self.rows() as usize * self.cols() as usize
    }

    /// All tiles, row by row from the south-west.
    pub fn tiles(&self) -> impl Iterator<Item = TileId> + use<> {
        let (rows, cols) = (self.rows(), self.cols());
        (0..rows).flat_map(move |row| (0..cols).map(move |col| TileId { row, col }))
    }

    /// Place of a tile in row-major order.
    pub fn index(&self, tile: TileId) -> usize {
        tile.row as usize * self.cols() as usize + tile.col as usize
    }

    /// Whether there is such a tile.
    pub fn contains(&self, tile: TileId) -> bool {
        tile.row < self.rows() && tile.col < self.cols()
    }

    /// Posts of a tile, seams included.
    pub fn rect(&self, tile: TileId) -> PostRect {
        let (row, col) = (tile.row as usize, tile.col as usize);
        PostRect::new(
            Post::new(self.row_lines[row], self.col_lines[col]),
            Post::new(self.row_lines[row + 1], self.col_lines[col + 1]),
        )
    }

    /// Load modules of a tile.
    pub fn modules(&self, tile: TileId, grid: ModuleGrid) -> ModuleRect {
        let rect = self.rect(tile);
        let line = |at: i32| (at / grid.side_cells) as u32;
        ModuleRect { south: line(rect.south), west: line(rect.west), north: line(rect.north), east: line(rect.east) }
    }

    /// Colour of a tile: tiles of one colour share neither side nor corner. 0 for all in raster order.
    pub fn color(&self, tile: TileId) -> u32 {
        match self.order {
            TileOrder::Color => 2 * (tile.row % 2) + tile.col % 2,
            TileOrder::Raster => 0,
        }
    }

    /// Rank of a tile: lower ones choose first.
    pub fn rank(&self, tile: TileId) -> (u32, u32, u32) {
        (self.color(tile), tile.row, tile.col)
    }

    /// Tiles that share a side or a corner with `tile`, row by row.
    pub fn neighbours(&self, tile: TileId) -> Vec<TileId> {
        let around = |at: u32| at.saturating_sub(1)..=at + 1;
        let all = around(tile.row).flat_map(|row| around(tile.col).map(move |col| TileId { row, col }));
        all.filter(|&other| other != tile && self.contains(other)).collect()
    }

    /// The tile beyond a side.
    pub fn beyond(&self, tile: TileId, side: Side) -> Option<TileId> {
        let (row, col) = match side {
            Side::South => (tile.row.checked_sub(1)?, tile.col),
            Side::West => (tile.row, tile.col.checked_sub(1)?),
            Side::North => (tile.row + 1, tile.col),
            Side::East => (tile.row, tile.col + 1),
        };
        let other = TileId { row, col };
        self.contains(other).then_some(other)
    }

    /// Whether `tile` inherits its `side` from a lower-ranked neighbour.
    pub fn inherits(&self, tile: TileId, side: Side) -> bool {
        self.beyond(tile, side).is_some_and(|other| self.rank(other) < self.rank(tile))
    }

    /// The sides on which `tile` chooses posts, for itself and for its higher-ranked neighbours.
    pub fn owned_sides(&self, tile: TileId) -> SeamSides {
        SeamSides::from_fn(|side| self.beyond(tile, side).is_some() && !self.inherits(tile, side))
    }

    /// The sides `tile` shares with any other.
    pub fn shared_sides(&self, tile: TileId) -> SeamSides {
        SeamSides::from_fn(|side| self.beyond(tile, side).is_some())
    }

    /// The tile that owns the ground of a load module.
    pub fn tile_of_module(&self, module: terrain::ModuleId, grid: ModuleGrid) -> TileId {
        let find = |lines: &[i32], at: u32| lines.partition_point(|&line| line <= at as i32 * grid.side_cells) - 1;
        TileId { row: find(&self.row_lines, module.row) as u32, col: find(&self.col_lines, module.col) as u32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper() -> (Tiling, ModuleGrid) {
        let grid = ModuleGrid { rows: 100, cols: 100, side_cells: 20 };
        (Tiling::new(grid.area(), 20, 6, 6, TileOrder::Color), grid)
    }

    #[test]
    fn a_hundred_load_modules_split_as_the_paper_s_six_tiles() {
        let (tiling, grid) = paper();
        let widths: Vec<u32> = (0..6).map(|col| tiling.modules(TileId { row: 0, col }, grid).cols()).collect();
        assert_eq!(widths, [17, 17, 16, 17, 17, 16]);
        let total: usize = tiling.tiles().map(|tile| tiling.modules(tile, grid).count()).sum();
        assert_eq!(total, grid.count());
    }

    #[test]
    fn tiles_of_one_colour_never_touch() {
        let (tiling, _) = paper();
        for tile in tiling.tiles() {
            assert!(tiling.neighbours(tile).iter().all(|&other| tiling.color(other) != tiling.color(tile)));
        }
    }

    #[test]
    fn every_seam_has_exactly_one_owner() {
        let grid = ModuleGrid { rows: 12, cols: 15, side_cells: 4 };
        for order in [TileOrder::Color, TileOrder::Raster] {
            let tiling = Tiling::new(grid.area(), 4, 3, 4, order);
            for tile in tiling.tiles() {
                for side in Side::ALL {
                    let owned = tiling.owned_sides(tile).is_open(side);
                    match tiling.beyond(tile, side) {
                        None => assert!(!owned && !tiling.inherits(tile, side)),
                        Some(other) => {
                            assert_ne!(owned, tiling.owned_sides(other).is_open(side.opposite()));
                            assert_eq!(owned, tiling.inherits(other, side.opposite()));
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn every_load_module_has_the_tile_that_holds_it() {
        let (tiling, grid) = paper();
        for module in grid.all().iter() {
            let tile = tiling.tile_of_module(module, grid);
            assert!(tiling.modules(tile, grid).contains(module));
        }
    }

    #[test]
    fn lines_of_tiles_without_load_modules_lie_on_posts() {
        let area = PostRect::of_size(1979, 1979);
        let tiling = Tiling::new(area, 1, 6, 6, TileOrder::Color);
        assert_eq!(tiling.rect(TileId { row: 5, col: 5 }).north_east(), area.north_east());
        assert_eq!(tiling.rect(TileId { row: 1, col: 0 }).south, 330);
    }
}
