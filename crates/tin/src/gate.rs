//! Which posts the limits still permit.

use geometry::LocalPost;
use limits::{Allowance, Ledger, POINT_COST};
use terrain::{ModuleId, RefusedBy};

/// The load modules a post adds triangles to: two in one, or one on either side of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Charged {
    Inside(ModuleId),
    Between(ModuleId, ModuleId),
}

/// The load-module lines of a tile, in its own posts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ModuleLines {
    pub side_cells: i32,
    pub south_west: ModuleId,
    /// Rows and columns of load modules in the tile.
    pub rows: u32,
    pub cols: u32,
}

impl ModuleLines {
    /// The load modules `post` is charged to; `None` for a load-module corner.
    pub fn charged(&self, post: LocalPost) -> Option<Charged> {
        let step = self.side_cells;
        let module = |row: i32, col: i32| ModuleId {
            row: self.south_west.row.wrapping_add_signed(row),
            col: self.south_west.col.wrapping_add_signed(col),
        };
        let (row, col) = (post.row() / step, post.col() / step);
        match (post.row() % step == 0, post.col() % step == 0) {
            (false, false) => Some(Charged::Inside(module(row, col))),
            (true, false) => Some(Charged::Between(module(row - 1, col), module(row, col))),
            (false, true) => Some(Charged::Between(module(row, col - 1), module(row, col))),
            (true, true) => None,
        }
    }

    /// Whether `module` lies in the tile itself.
    pub fn contain(&self, module: ModuleId) -> bool {
        let (row, col) = (module.row.wrapping_sub(self.south_west.row), module.col.wrapping_sub(self.south_west.col));
        row < self.rows && col < self.cols
    }
}

/// What stands between a post and the TIN.
pub(crate) enum Gate {
    /// Nothing.
    Open,
    /// The limits of load modules and windows.
    Limits { lines: ModuleLines, ledger: Ledger },
}

impl Gate {
    /// A gate that spends from `allowance`.
    pub fn limits(lines: ModuleLines, allowance: Allowance) -> Self {
        Gate::Limits { lines, ledger: Ledger::new(allowance) }
    }

    /// The load module and the limit that refuse `post`, if any do.
    pub fn refuses(&self, post: LocalPost) -> Option<(ModuleId, RefusedBy)> {
        let Gate::Limits { lines, ledger } = self else { return None };
        let ask = |module, cost| ledger.refuses(module, cost, !lines.contain(module)).map(|by| (module, by));
        match lines.charged(post)? {
            Charged::Inside(module) => ask(module, POINT_COST),
            Charged::Between(first, second) => ask(first, 1).or_else(|| ask(second, 1)),
        }
    }

    /// Spends what `post` costs.
    pub fn charge(&mut self, post: LocalPost) {
        let Gate::Limits { lines, ledger } = self else { return };
        match lines.charged(post) {
            Some(Charged::Inside(module)) => ledger.charge(module, POINT_COST),
            Some(Charged::Between(first, second)) => {
                ledger.charge(first, 1);
                ledger.charge(second, 1);
            }
            // Load-module corners are there from the start.
            None => {}
        }
    }

    /// Takes the room of a point that a neighbour chose on a shared side.
    pub fn inherit(&mut self, post: LocalPost) {
        let Gate::Limits { lines, ledger } = self else { return };
        if let Some(Charged::Between(first, second)) = lines.charged(post) {
            for module in [first, second] {
                if lines.contain(module) {
                    ledger.inherit(module, 1);
                }
            }
        }
    }

    /// Whether the tile cannot afford one more point.
    pub fn is_spent(&self) -> bool {
        matches!(self, Gate::Limits { ledger, .. } if ledger.left() < POINT_COST)
    }

    /// Triangles spent so far.
    pub fn spent(&self) -> u32 {
        match self {
            Gate::Open => 0,
            Gate::Limits { ledger, .. } => ledger.spent(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_post_is_charged_where_it_adds_triangles() {
        let lines = ModuleLines { side_cells: 20, south_west: ModuleId { row: 3, col: 5 }, rows: 2, cols: 2 };
        let module = |row, col| ModuleId { row, col };
        let charged = |row, col| lines.charged(LocalPost::new(row, col));
        assert_eq!(charged(7, 25), Some(Charged::Inside(module(3, 6))));
        assert_eq!(charged(20, 7), Some(Charged::Between(module(3, 5), module(4, 5))));
        assert_eq!(charged(5, 40), Some(Charged::Between(module(3, 6), module(3, 7))));
        assert_eq!(charged(0, 5), Some(Charged::Between(module(2, 5), module(3, 5))));
        assert_eq!(charged(20, 20), None);
        assert!(lines.contain(module(4, 6)) && !lines.contain(module(3, 7)) && !lines.contain(module(2, 5)));
    }
}
