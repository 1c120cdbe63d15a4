//! What one tile may spend, and the ledger that never lets it spend more.

use terrain::{ModuleId, ModuleRect, POINT_COST, RefusedBy};

use crate::{ShortOf, Shortfall};

/// Triangles one tile may add to its start, by load module, by window and in all.
///
/// Tiles spend from their own allowances only; the allowances of all tiles together respect every limit,
/// so no tile needs to know what another spent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Allowance {
    /// Load modules the tile can touch: its own and the ring of neighbours beyond its sides.
    pub modules: ModuleRect,
    /// Triangles each of them may still gain from this tile, row-major.
    pub module_room: Vec<u32>,
    /// Windows that hold any of those load modules, by south-west load module.
    pub windows: ModuleRect,
    /// Height and width of a window, in load modules.
    pub window_size: (u32, u32),
    /// Triangles this tile may add to each window, row-major.
    pub window_room: Vec<u32>,
    /// Triangles this tile may add in all.
    pub triangles: u32,
}

/// A tile's allowance as it is spent. While nothing is refunded, room only shrinks and a refusal is final.
#[derive(Clone, Debug)]
pub struct Ledger {
    /// What may be spent in each load module, less what neighbours spent there.
    allowance: Allowance,
    modules: Vec<u32>,
    windows: Vec<u32>,
    spent: u32,
}

impl Ledger {
    /// A ledger from which nothing has been spent.
    pub fn new(allowance: Allowance) -> Self {
        assert_eq!(allowance.module_room.len(), allowance.modules.count(), "one room per load module");
        assert_eq!(allowance.window_room.len(), allowance.windows.count(), "one room per window");
        let (modules, windows) = (vec![0; allowance.module_room.len()], vec![0; allowance.window_room.len()]);
        Self { allowance, modules, windows, spent: 0 }
    }

    /// Triangles spent so far.
    pub fn spent(&self) -> u32 {
        self.spent
    }

    /// Triangles left for the whole tile; negative where a TIN was booked that exceeds them.
    pub fn left(&self) -> i64 {
        i64::from(self.allowance.triangles) - i64::from(self.spent)
    }

    /// Triangles `module` may still gain.
    pub fn room_of(&self, module: ModuleId) -> u32 {
        let index = self.module_index(module);
        self.allowance.module_room[index].saturating_sub(self.modules[index])
    }

    /// Whether `module`, or a window that holds it, has more than it may.
    pub fn is_over(&self, module: ModuleId) -> bool {
        let index = self.module_index(module);
        let over = |index: usize| self.allowance.window_room[index] < self.windows[index];
        self.allowance.module_room[index] < self.modules[index] || self.window_rows(module).any(|mut row| row.any(over))
    }

    /// Whether any load module or window has more than it may.
    pub fn is_any_over(&self) -> bool {
        let over = |room: &[u32], spent: &[u32]| room.iter().zip(spent).any(|(room, spent)| room < spent);
        over(&self.allowance.module_room, &self.modules) || over(&self.allowance.window_room, &self.windows)
    }

    /// Everything that has more than it may: the tile, load modules, windows.
    pub fn short(&self) -> Vec<Shortfall> {
        let short = |of: ShortOf, needed: u32, room: u32| (room < needed).then_some(Shortfall { of, needed, room });
        let allowance = &self.allowance;
        let modules = allowance.modules.iter().zip(&self.modules).zip(&allowance.module_room);
        let modules = modules.filter_map(|((module, &spent), &room)| short(ShortOf::Module(module), spent, room));
        let windows = allowance.windows.iter().zip(&self.windows).zip(&allowance.window_room);
        let windows = windows.filter_map(|((window, &spent), &room)| short(ShortOf::Window(window), spent, room));
        short(ShortOf::Tile, self.spent, allowance.triangles).into_iter().chain(modules).chain(windows).collect()
    }

    fn module_index(&self, module: ModuleId) -> usize {
        let modules = self.allowance.modules;
        debug_assert!(modules.contains(module), "load module {module} is beyond this tile's ring");
        (module.row - modules.south) as usize * modules.cols() as usize + (module.col - modules.west) as usize
    }

    /// Rows of window rooms that hold `module`, as index ranges.
    fn window_rows(&self, module: ModuleId) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let (windows, (rows, cols)) = (self.allowance.windows, self.allowance.window_size);
        let south = module.row.saturating_sub(rows - 1).max(windows.south);
        let west = module.col.saturating_sub(cols - 1).max(windows.west);
        let north = (module.row + 1).min(windows.north);
        let east = (module.col + 1).min(windows.east);
        (south..north).map(move |row| {
            let start = (row - windows.south) as usize * windows.cols() as usize;
            start + (west - windows.west) as usize..start + (east - windows.west) as usize
        })
    }

    /// Which limit refuses a point that adds `cost` triangles in `module`, if any does. The tile's total is
    /// not asked: running out of it ends the tile.
    ///
    /// A point costs two triangles wherever it lies, and a window may hold both load modules beside a side
    /// point, so windows are asked for two. One that has room for a single triangle stays as it is.
    pub fn refuses(&self, module: ModuleId, cost: u32, beyond_tile: bool) -> Option<RefusedBy> {
        if self.room_of(module) < cost {
            return Some(if beyond_tile { RefusedBy::Reservation } else { RefusedBy::Module });
        }
        let full = |index: usize| self.allowance.window_room[index] < self.windows[index] + POINT_COST;
        self.window_rows(module).any(|mut row| row.any(full)).then_some(RefusedBy::Window)
    }

    /// Spends `cost` triangles in `module`.
    ///
    /// # Panics
    /// When a limit refuses them: the caller asks first.
    pub fn charge(&mut self, module: ModuleId, cost: u32) {
        self.book(module, cost);
        assert!(!self.is_over(module), "the caller asked whether load module and windows have room");
        assert!(self.spent <= self.allowance.triangles, "a tile spends no more than its allowance");
    }

    /// Notes `cost` triangles that `module` has already, whether or not it may.
    pub fn book(&mut self, module: ModuleId, cost: u32) {
        self.each_count(module, |count| *count += cost);
    }

    /// Takes back `cost` triangles of `module`.
    ///
    /// # Panics
    /// When there are not so many.
    pub fn refund(&mut self, module: ModuleId, cost: u32) {
        self.each_count(module, |count| *count = count.checked_sub(cost).expect("only what was booked is refunded"));
    }

    /// Everything in which triangles of `module` count.
    fn each_count(&mut self, module: ModuleId, mut change: impl FnMut(&mut u32)) {
        let index = self.module_index(module);
        change(&mut self.modules[index]);
        for row in self.window_rows(module) {
            self.windows[row].iter_mut().for_each(&mut change);
        }
        change(&mut self.spent);
    }

    /// Takes room in `module` for points a neighbour has chosen and paid for.
    ///
    /// Reservations keep this room free; what they could not foresee (pins) ends at zero.
    pub fn inherit(&mut self, module: ModuleId, cost: u32) {
        let index = self.module_index(module);
        let room = &mut self.allowance.module_room[index];
        *room = room.saturating_sub(cost);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Windows;
    use terrain::ModuleGrid;

    fn ledger(module_room: u32, window_room: u32) -> Ledger {
        let grid = ModuleGrid { rows: 6, cols: 6, side_cells: 20 };
        let modules = ModuleRect { south: 1, west: 1, north: 4, east: 5 };
        let windows = Windows::new(grid, 3);
        let touching = windows.touching(modules);
        Ledger::new(Allowance {
            modules,
            module_room: vec![module_room; modules.count()],
            windows: touching,
            window_size: (windows.rows, windows.cols),
            window_room: vec![window_room; touching.count()],
            triangles: 1000,
        })
    }

    #[test]
    fn a_full_load_module_refuses_and_its_neighbour_does_not() {
        let mut ledger = ledger(4, 1000);
        let (full, free) = (ModuleId { row: 2, col: 2 }, ModuleId { row: 2, col: 3 });
        ledger.charge(full, 2);
        ledger.charge(full, 2);
        assert_eq!(ledger.refuses(full, 1, false), Some(RefusedBy::Module));
        assert_eq!(ledger.refuses(full, 1, true), Some(RefusedBy::Reservation));
        assert_eq!(ledger.refuses(free, 2, false), None);
        assert_eq!((ledger.spent(), ledger.left()), (4, 996));
    }

    #[test]
    fn a_full_window_refuses_every_load_module_it_holds_and_no_other() {
        let mut ledger = ledger(100, 6);
        ledger.charge(ModuleId { row: 1, col: 1 }, 6);
        // Windows at rows 0..=1, cols 0..=1 hold (1, 1); together they reach to row 3, column 3.
        assert_eq!(ledger.refuses(ModuleId { row: 3, col: 3 }, 1, false), Some(RefusedBy::Window));
        assert_eq!(ledger.refuses(ModuleId { row: 3, col: 4 }, 1, false), None);
    }

    #[test]
    fn inherited_points_take_room_without_being_paid() {
        let mut ledger = ledger(3, 1000);
        let module = ModuleId { row: 1, col: 1 };
        ledger.inherit(module, 2);
        assert_eq!((ledger.room_of(module), ledger.spent()), (1, 0));
        ledger.inherit(module, 5);
        assert_eq!(ledger.room_of(module), 0);
    }
}
