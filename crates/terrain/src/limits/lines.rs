//! Which load modules a point adds triangles to.

use crate::{ModuleId, ModuleRect, POINT_COST};

/// The load modules a point adds triangles to: two in one, or one on either side of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Charged {
    /// Two triangles.
    Inside(ModuleId),
    /// One triangle each.
    Between(ModuleId, ModuleId),
    /// One triangle: on the outer border of the area, which has a load module on one side only.
    Beside(ModuleId),
}

/// The load-module lines of a tile, counted from its south-west corner in whatever steps its owner measures with.
#[derive(Clone, Copy, Debug)]
pub struct ModuleLines {
    /// Steps along a side of a load module.
    pub side: i32,
    /// The tile's south-west load module.
    pub south_west: ModuleId,
    /// Rows of load modules in the tile.
    pub rows: u32,
    /// Columns of load modules in the tile.
    pub cols: u32,
    /// Load modules that exist, as far as the tile reaches: beyond the outer border of the area there are none.
    pub reach: ModuleRect,
}

impl ModuleLines {
    /// The load modules that a point is charged to; `None` for a load-module corner.
    pub fn charged(&self, row: i32, col: i32) -> Option<Charged> {
        let step = self.side;
        let module = |row: i32, col: i32| ModuleId {
            row: self.south_west.row.wrapping_add_signed(row),
            col: self.south_west.col.wrapping_add_signed(col),
        };
        let (is_on_row, is_on_col) = (row % step == 0, col % step == 0);
        let (row, col) = (row / step, col / step);
        match (is_on_row, is_on_col) {
            (false, false) => Some(Charged::Inside(module(row, col))),
            (true, false) => Some(self.between(module(row - 1, col), module(row, col))),
            (false, true) => Some(self.between(module(row, col - 1), module(row, col))),
            (true, true) => None,
        }
    }

    /// Calls `each` with the load modules that a point is charged to, and with how many triangles.
    pub(crate) fn each_charge(&self, row: i32, col: i32, mut each: impl FnMut(ModuleId, u32)) {
        match self.charged(row, col) {
            Some(Charged::Inside(module)) => each(module, POINT_COST),
            Some(Charged::Between(first, second)) => {
                each(first, 1);
                each(second, 1);
            }
            Some(Charged::Beside(module)) => each(module, 1),
            // Load-module corners are there from the start.
            None => {}
        }
    }

    fn between(&self, first: ModuleId, second: ModuleId) -> Charged {
        match (self.reach.contains(first), self.reach.contains(second)) {
            (true, false) => Charged::Beside(first),
            (false, true) => Charged::Beside(second),
            _ => Charged::Between(first, second),
        }
    }

    /// Whether `module` lies in the tile itself.
    pub(crate) fn contain(&self, module: ModuleId) -> bool {
        let (row, col) = (module.row.wrapping_sub(self.south_west.row), module.col.wrapping_sub(self.south_west.col));
        row < self.rows && col < self.cols
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_charged_where_it_adds_triangles() {
        let reach = ModuleRect { south: 2, west: 4, north: 5, east: 8 };
        let lines = ModuleLines { side: 20, south_west: ModuleId { row: 3, col: 5 }, rows: 2, cols: 2, reach };
        let module = |row, col| ModuleId { row, col };
        assert_eq!(lines.charged(7, 25), Some(Charged::Inside(module(3, 6))));
        assert_eq!(lines.charged(20, 7), Some(Charged::Between(module(3, 5), module(4, 5))));
        assert_eq!(lines.charged(5, 40), Some(Charged::Between(module(3, 6), module(3, 7))));
        assert_eq!(lines.charged(0, 5), Some(Charged::Between(module(2, 5), module(3, 5))));
        assert_eq!(lines.charged(20, 20), None);
        // The area ends north of row 4.
        assert_eq!(lines.charged(40, 7), Some(Charged::Beside(module(4, 5))));
        assert!(lines.contain(module(4, 6)) && !lines.contain(module(3, 7)) && !lines.contain(module(2, 5)));
    }
}
