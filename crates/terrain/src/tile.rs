//! Tiles (units of work), load modules (units of product), and the grids they form.

use serde::{Deserialize, Serialize};

use crate::numbered::numbered;
use crate::{Post, PostRect};

/// A tile by (row, column); 0,0 is the south-west one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TileId {
    /// Tiles north of the southernmost row.
    pub row: u32,
    /// Tiles east of the westernmost column.
    pub col: u32,
}

impl std::fmt::Display for TileId {
    /// As in file names: `r02c03`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "r{:02}c{:02}", self.row, self.col)
    }
}

/// A load module by (row, column); 0,0 is the south-west one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ModuleId {
    /// Load modules north of the southernmost row.
    pub row: u32,
    /// Load modules east of the westernmost column.
    pub col: u32,
}

impl std::fmt::Display for ModuleId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{},{}", self.row, self.col)
    }
}

/// One of the four sides of a tile or of a load module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// The southern side, listed west to east.
    South,
    /// The eastern side, listed south to north.
    East,
    /// The northern side, listed west to east.
    North,
    /// The western side, listed south to north.
    West,
}

numbered!(Side);

impl Side {
    /// All four, by their numbers in files.
    pub const ALL: [Side; 4] = [Side::South, Side::East, Side::North, Side::West];

    /// The side of the neighbour that lies on this one.
    pub fn opposite(self) -> Side {
        match self {
            Side::South => Side::North,
            Side::East => Side::West,
            Side::North => Side::South,
            Side::West => Side::East,
        }
    }
}

/// The sides of a tile that are its own: it may select posts there; the others are masked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SeamSides {
    /// The southern side.
    pub south: bool,
    /// The eastern side.
    pub east: bool,
    /// The northern side.
    pub north: bool,
    /// The western side.
    pub west: bool,
}

impl SeamSides {
    /// All four sides are this tile's own.
    pub const OPEN: Self = Self { south: true, east: true, north: true, west: true };
    /// No side is.
    pub const CLOSED: Self = Self { south: false, east: false, north: false, west: false };

    /// Whether `side` is open.
    pub fn is_open(&self, side: Side) -> bool {
        match side {
            Side::South => self.south,
            Side::East => self.east,
            Side::North => self.north,
            Side::West => self.west,
        }
    }

    /// The sides for which `open` says so.
    pub fn from_fn(open: impl Fn(Side) -> bool) -> Self {
        Self { south: open(Side::South), east: open(Side::East), north: open(Side::North), west: open(Side::West) }
    }
}

/// A half-open rectangle of load modules: rows `south..north`, columns `west..east`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ModuleRect {
    /// First row.
    pub south: u32,
    /// First column.
    pub west: u32,
    /// One past the last row.
    pub north: u32,
    /// One past the last column.
    pub east: u32,
}

impl ModuleRect {
    /// Rows of load modules.
    pub fn rows(&self) -> u32 {
        self.north - self.south
    }

    /// Columns of load modules.
    pub fn cols(&self) -> u32 {
        self.east - self.west
    }

    /// The one in its south-west.
    pub fn south_west(&self) -> ModuleId {
        ModuleId { row: self.south, col: self.west }
    }

    /// All load modules inside.
    pub fn count(&self) -> usize {
        self.rows() as usize * self.cols() as usize
    }

    /// What two rectangles have in common; `None` where that is nothing.
    pub fn intersection(self, other: Self) -> Option<Self> {
        let both = Self {
            south: self.south.max(other.south),
            west: self.west.max(other.west),
            north: self.north.min(other.north),
            east: self.east.min(other.east),
        };
        (both.south < both.north && both.west < both.east).then_some(both)
    }

    /// Those of `tile`, where an area of so many rows and columns is divided into so many rows and columns of tiles:
    /// the lines between these lie at `ceil(k * rows / tile rows)`.
    ///
    /// # Panics
    /// When there are no tiles.
    pub fn of_tile(tile: TileId, [rows, cols]: [u32; 2], [tile_rows, tile_cols]: [u32; 2]) -> Self {
        let line = |k: u32, all: u32, tiles: u32| (u64::from(k) * u64::from(all)).div_ceil(u64::from(tiles)) as u32;
        let (south, north) = (line(tile.row, rows, tile_rows), line(tile.row + 1, rows, tile_rows));
        let (west, east) = (line(tile.col, cols, tile_cols), line(tile.col + 1, cols, tile_cols));
        Self { south, west, north, east }
    }

    /// Whether `module` lies inside.
    pub fn contains(&self, module: ModuleId) -> bool {
        self.south <= module.row && module.row < self.north && self.west <= module.col && module.col < self.east
    }

    /// Load modules inside, row by row from the south-west.
    pub fn iter(self) -> impl Iterator<Item = ModuleId> {
        (self.south..self.north).flat_map(move |row| (self.west..self.east).map(move |col| ModuleId { row, col }))
    }
}

/// The grid of load modules over the whole area, anchored at post (0, 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ModuleGrid {
    /// Rows of load modules.
    pub rows: u32,
    /// Columns of load modules.
    pub cols: u32,
    /// Cells along a side of a load module.
    pub side_cells: i32,
}

impl ModuleGrid {
    /// All load modules of the area.
    pub fn all(&self) -> ModuleRect {
        ModuleRect { south: 0, west: 0, north: self.rows, east: self.cols }
    }

    /// Number of load modules in the area.
    pub fn count(&self) -> usize {
        self.rows as usize * self.cols as usize
    }

    /// Place of `module` in row-major order.
    pub fn index(&self, module: ModuleId) -> usize {
        module.row as usize * self.cols as usize + module.col as usize
    }

    /// Posts of one load module, its four sides included.
    pub fn posts_of(&self, module: ModuleId) -> PostRect {
        self.posts_of_rect(ModuleRect {
            south: module.row,
            west: module.col,
            north: module.row + 1,
            east: module.col + 1,
        })
    }

    /// Posts of a rectangle of load modules, its border lines included.
    pub fn posts_of_rect(&self, modules: ModuleRect) -> PostRect {
        let line = |index: u32| index as i32 * self.side_cells;
        PostRect::new(
            Post::new(line(modules.south), line(modules.west)),
            Post::new(line(modules.north), line(modules.east)),
        )
    }

    /// Posts of the whole area.
    pub fn area(&self) -> PostRect {
        self.posts_of_rect(self.all())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_load_modules_share_a_line_of_posts() {
        let grid = ModuleGrid { rows: 3, cols: 4, side_cells: 20 };
        let west = grid.posts_of(ModuleId { row: 1, col: 1 });
        let east = grid.posts_of(ModuleId { row: 1, col: 2 });
        assert_eq!(west.east, east.west);
        assert_eq!((grid.area().posts_high(), grid.area().posts_wide()), (61, 81));
        assert_eq!(grid.all().iter().count(), grid.count());
    }

    #[test]
    fn tiles_are_named_row_first() {
        assert_eq!(TileId { row: 2, col: 3 }.to_string(), "r02c03");
    }
}
