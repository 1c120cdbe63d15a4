//! What one tile may spend, and the ledger that never lets it spend more.

use serde::{Deserialize, Serialize};

use crate::limits::{Charged, ModuleLines};
use crate::{ModuleId, ModuleRect, POINT_COST, RefusedBy};

/// Triangles one tile may add to its start, by load module, by window and in all.
///
/// Tiles spend from their own allowances only; the allowances of all tiles together respect every limit,
/// so no tile needs to know what another spent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
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
    modules: Vec<Account>,
    /// What each window has left, negative where it has more than it may.
    left: Vec<i32>,
    spent: u32,
    /// What was ever booked; refunds are not taken off.
    booked: i64,
}

/// What is known of a load module.
#[derive(Clone, Copy, Debug, Default)]
struct Account {
    spent: u32,
    /// What the windows that hold it had left, the least of them, when they were looked at: by it most points are
    /// judged without a look at every window.
    left: i32,
    /// What was booked by then.
    booked: i64,
}

impl Ledger {
    /// A ledger from which nothing has been spent.
    pub(crate) fn new(allowance: Allowance) -> Self {
        assert_eq!(allowance.module_room.len(), allowance.modules.count(), "one room per load module");
        assert_eq!(allowance.window_room.len(), allowance.windows.count(), "one room per window");
        let count = allowance.module_room.len();
        let left = allowance.window_room.iter().map(|&room| i32::try_from(room).unwrap_or(i32::MAX)).collect();
        Self { allowance, modules: vec![Account::default(); count], left, spent: 0, booked: 0 }
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
    pub(crate) fn room_of(&self, module: ModuleId) -> u32 {
        let index = self.module_index(module);
        self.allowance.module_room[index].saturating_sub(self.modules[index].spent)
    }

    /// Whether `module`, or a window that holds it, has more than it may.
    pub(crate) fn is_over(&self, module: ModuleId) -> bool {
        let index = self.module_index(module);
        self.allowance.module_room[index] < self.modules[index].spent || self.least_left(module) < 0
    }

    /// Whether any load module or window has more than it may.
    pub fn is_any_over(&self) -> bool {
        let mut modules = self.allowance.module_room.iter().zip(&self.modules);
        modules.any(|(&room, module)| room < module.spent) || self.left.iter().any(|&left| left < 0)
    }

    /// Everything that has more than it may: the tile, load modules, windows.
    pub fn short(&self) -> Vec<Shortfall> {
        let short = |of: ShortOf, needed: u32, room: u32| (room < needed).then_some(Shortfall { of, needed, room });
        let allowance = &self.allowance;
        let modules = allowance.modules.iter().zip(&self.modules).zip(&allowance.module_room);
        let modules = modules.filter_map(|((id, module), &room)| short(ShortOf::Module(id), module.spent, room));
        let windows = allowance.windows.iter().zip(&self.left).zip(&allowance.window_room);
        let spent = |room: u32, left: i32| (i64::from(room) - i64::from(left)) as u32;
        let windows =
            windows.filter_map(|((window, &left), &room)| short(ShortOf::Window(window), spent(room, left), room));
        short(ShortOf::Tile, self.spent, allowance.triangles).into_iter().chain(modules).chain(windows).collect()
    }

    /// A count of 0 for every load module, by [`Ledger::module_index`].
    pub(crate) fn no_counts(&self) -> Vec<u32> {
        vec![0; self.modules.len()]
    }

    /// The place of a load module among those of the allowance.
    pub(crate) fn module_index(&self, module: ModuleId) -> usize {
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
    pub(crate) fn refuses(&self, module: ModuleId, cost: u32, beyond_tile: bool) -> Option<RefusedBy> {
        if self.room_of(module) < cost {
            return Some(if beyond_tile { RefusedBy::Reservation } else { RefusedBy::Module });
        }
        let (seen, cost) = (self.modules[self.module_index(module)], POINT_COST as i32);
        let has_room = i64::from(cost) <= i64::from(seen.left) - (self.booked - seen.booked);
        (!has_room && self.least_left(module) < cost).then_some(RefusedBy::Window)
    }

    /// What the windows that hold `module` have left, the least of them; as much as can be where none does.
    fn least_left(&self, module: ModuleId) -> i32 {
        let least = |row: std::ops::Range<usize>| self.left[row].iter().fold(i32::MAX, |least, &left| least.min(left));
        self.window_rows(module).map(least).fold(i32::MAX, i32::min)
    }

    /// Looks at the windows of every load module again, so that many points are judged fast.
    pub(crate) fn look_again(&mut self) {
        for (index, module) in self.allowance.modules.iter().enumerate() {
            let (left, booked) = (self.least_left(module), self.booked);
            self.modules[index] = Account { left, booked, ..self.modules[index] };
        }
    }

    /// Spends `cost` triangles in `module`.
    ///
    /// # Panics
    /// When a limit refuses them: the caller asks first.
    pub(crate) fn charge(&mut self, module: ModuleId, cost: u32) {
        self.book(module, cost);
        let index = self.module_index(module);
        let Account { spent, left, .. } = self.modules[index];
        let fits = spent <= self.allowance.module_room[index] && 0 <= left;
        assert!(fits, "the caller asked whether load module and windows have room");
        assert!(self.spent <= self.allowance.triangles, "a tile spends no more than its allowance");
    }

    /// Notes `cost` triangles that `module` has already, whether or not it may.
    pub(crate) fn book(&mut self, module: ModuleId, cost: u32) {
        let mut least = i32::MAX;
        for row in self.window_rows(module) {
            for left in &mut self.left[row] {
                *left -= cost as i32;
                least = least.min(*left);
            }
        }
        self.spent += cost;
        self.booked += i64::from(cost);
        let index = self.module_index(module);
        self.modules[index] = Account { spent: self.modules[index].spent + cost, left: least, booked: self.booked };
    }

    /// Notes what load modules have already, whether or not they may.
    pub(crate) fn book_counts(&mut self, counts: &[u32]) {
        for (module, &cost) in self.allowance.modules.iter().zip(counts).filter(|&(_, &cost)| 0 < cost) {
            self.book(module, cost);
        }
    }

    /// Takes back `cost` triangles of `module`.
    ///
    /// # Panics
    /// When there are not so many.
    pub(crate) fn refund(&mut self, module: ModuleId, cost: u32) {
        let take = |count: &mut u32| *count = count.checked_sub(cost).expect("only what was booked is refunded");
        let index = self.module_index(module);
        take(&mut self.modules[index].spent);
        for row in self.window_rows(module) {
            self.left[row].iter_mut().for_each(|left| *left += cost as i32);
        }
        take(&mut self.spent);
    }

    /// Takes room in `module` for points a neighbour has chosen and paid for.
    ///
    /// Reservations keep this room free; what they could not foresee (pins) ends at zero.
    pub(crate) fn inherit(&mut self, module: ModuleId, cost: u32) {
        let index = self.module_index(module);
        let room = &mut self.allowance.module_room[index];
        *room = room.saturating_sub(cost);
    }
}

/// An allowance that is exceeded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shortfall {
    /// Whose allowance.
    pub of: ShortOf,
    /// Triangles that are needed there.
    pub needed: u32,
    /// Triangles that there are.
    pub room: u32,
}

/// Whose allowance falls short.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ShortOf {
    /// A load module's.
    Module(ModuleId),
    /// That of the window with this south-west load module.
    Window(ModuleId),
    /// That of the whole tile.
    Tile,
}

/// What a tile spends on points, by where they stand.
#[derive(Clone, Debug)]
pub struct TileLedger {
    lines: ModuleLines,
    ledger: Ledger,
}

impl TileLedger {
    /// A ledger from which nothing has been spent.
    pub fn new(lines: ModuleLines, allowance: Allowance) -> Self {
        Self { lines, ledger: Ledger::new(allowance) }
    }

    /// The same ledger for places measured in steps of which `per_step` make one of today's.
    pub fn in_finer_steps(mut self, per_step: i32) -> Self {
        self.lines.side *= per_step;
        self
    }

    /// The load module and the limit that refuse a point, if any do. The tile's total is not asked.
    pub fn refuses(&self, row: i32, col: i32) -> Option<(ModuleId, RefusedBy)> {
        let ask = |module, cost| {
            let by = self.ledger.refuses(module, cost, !self.lines.contain(module));
            by.map(|by| (module, by))
        };
        match self.lines.charged(row, col)? {
            Charged::Inside(module) => ask(module, POINT_COST),
            Charged::Between(first, second) => ask(first, 1).or_else(|| ask(second, 1)),
            Charged::Beside(module) => ask(module, 1),
        }
    }

    /// Makes ready to judge many points fast.
    pub fn look_again(&mut self) {
        self.ledger.look_again();
    }

    /// Spends what a point costs.
    ///
    /// # Panics
    /// When a limit refuses it: the caller asks first.
    pub fn charge(&mut self, row: i32, col: i32) {
        self.each_charge(row, col, Ledger::charge);
    }

    /// Notes a point that is there already, whether or not it may be.
    pub fn book(&mut self, row: i32, col: i32) {
        self.each_charge(row, col, Ledger::book);
    }

    /// Notes all points that are there already, by row and column, whether or not they may be.
    pub fn book_all(&mut self, points: impl IntoIterator<Item = (i32, i32)>) {
        let Self { lines, ledger } = self;
        let mut counts = ledger.no_counts();
        for (row, col) in points {
            lines.each_charge(row, col, |module, cost| counts[ledger.module_index(module)] += cost);
        }
        ledger.book_counts(&counts);
    }

    /// Takes back what a point cost.
    ///
    /// # Panics
    /// When it was not booked.
    pub fn refund(&mut self, row: i32, col: i32) {
        self.each_charge(row, col, Ledger::refund);
    }

    fn each_charge(&mut self, row: i32, col: i32, book: impl Fn(&mut Ledger, ModuleId, u32)) {
        let Self { lines, ledger } = self;
        lines.each_charge(row, col, |module, cost| book(ledger, module, cost));
    }

    /// Takes the room of a point that a neighbour chose on a shared side.
    pub fn inherit(&mut self, row: i32, col: i32) {
        if let Some(Charged::Between(first, second)) = self.lines.charged(row, col) {
            for module in [first, second].into_iter().filter(|&module| self.lines.contain(module)) {
                self.ledger.inherit(module, 1);
            }
        }
    }

    /// Whether a point there counts in a load module or window that has more than it may.
    pub fn is_over(&self, row: i32, col: i32) -> bool {
        match self.lines.charged(row, col) {
            Some(Charged::Inside(module) | Charged::Beside(module)) => self.ledger.is_over(module),
            Some(Charged::Between(first, second)) => self.ledger.is_over(first) || self.ledger.is_over(second),
            None => false,
        }
    }

    /// What a point there is charged to; `None` for a load-module corner.
    pub fn charged(&self, row: i32, col: i32) -> Option<Charged> {
        self.lines.charged(row, col)
    }

    /// The counts behind it.
    pub fn counts(&self) -> &Ledger {
        &self.ledger
    }
}

#[cfg(test)]
mod tests {
    use crate::ModuleGrid;
    use crate::limits::Windows;

    use super::*;

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
    fn what_was_seen_of_windows_refuses_as_a_look_at_all_of_them_does() {
        let mut draw = fastrand::Rng::with_seed(11);
        let mut ledger = ledger(1000, 60);
        let modules: Vec<ModuleId> = ledger.allowance.modules.iter().collect();
        let mut booked = Vec::new();
        let (mut refused, mut free) = (0, 0);
        for _ in 0..4000 {
            let module = modules[draw.usize(..modules.len())];
            let is_full = |index: usize| ledger.left[index] < POINT_COST as i32;
            let expected = ledger.window_rows(module).any(|mut row| row.any(is_full));
            assert_eq!(ledger.refuses(module, 2, false), expected.then_some(RefusedBy::Window));
            *(if expected { &mut refused } else { &mut free }) += 1;
            if !expected {
                ledger.charge(module, 2);
                booked.push(module);
            } else if let Some(module) = booked.pop() {
                ledger.refund(module, 2);
            }
        }
        assert!(100 < refused && 100 < free, "{refused} refused, {free} free");
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
