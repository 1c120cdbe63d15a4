//! What features may take of each limit, and what they have taken: load modules, windows of them, and the area.
//!
//! What formed features cost is counted before any tile is refined. A deck has as many triangles at most as it has
//! corners. On the ground, a point inside a load module adds two triangles and one on its side adds one, whatever else
//! the TIN holds, because triangles = 2 V + B - 2. So the count is exact for what features put there, and a lower bound
//! for their module.

use std::collections::BTreeMap;

use crate::forms::Formed;
use crate::strips::Face;
use crate::{Place, Site};

/// Triangles that features may take of one limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// All features together while one of the main kinds is granted.
    pub main: u64,
    /// All features together while one of the others is granted.
    pub others: u64,
}

impl Share {
    /// Whatever they ask for.
    pub const ALL: Self = Self { main: u64::MAX, others: u64::MAX };

    fn of(self, tier: Tier) -> i64 {
        let most = if tier == Tier::Others { self.others } else { self.main };
        i64::try_from(most).unwrap_or(i64::MAX)
    }
}

/// What features may take of every limit of an area.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shares {
    /// Load modules of the area: rows and columns.
    pub size: [i32; 2],
    /// Load modules of a window: rows and columns, no more than the area has.
    pub window: [i32; 2],
    /// Of each load module, row-major.
    pub modules: Vec<Share>,
    /// Of each window, by its south-west load module, row-major.
    pub windows: Vec<Share>,
    /// Of the area.
    pub area: Share,
}

impl Shares {
    /// As much as features ask for: an area without load modules.
    pub fn all() -> Self {
        Self { size: [0; 2], window: [0; 2], modules: Vec::new(), windows: Vec::new(), area: Share::ALL }
    }

    /// The same for every load module of an area, whatever they come to together.
    pub fn each([rows, cols]: [i32; 2], most: u64) -> Self {
        let share = Share { main: most, others: most };
        let count = (rows * cols) as usize;
        Self { size: [rows, cols], window: [rows, cols], modules: vec![share; count], ..Self::all() }.with_windows()
    }

    fn with_windows(mut self) -> Self {
        let [rows, cols] = self.origins();
        self.windows = vec![Share::ALL; (rows * cols) as usize];
        self
    }

    /// Rows and columns of windows.
    fn origins(&self) -> [i32; 2] {
        [0, 1].map(|axis| if self.size[axis] == 0 { 0 } else { self.size[axis] - self.window[axis] + 1 })
    }

    /// The number of a load module (row, column); none beyond the area.
    pub(crate) fn number(&self, (row, col): (i32, i32)) -> Option<u32> {
        let inside = (0..self.size[0]).contains(&row) && (0..self.size[1]).contains(&col);
        inside.then(|| (row * self.size[1] + col) as u32)
    }

    /// The load module (row, column) of a number.
    pub(crate) fn module(&self, number: u32) -> (i32, i32) {
        let number = number as i32;
        (number / self.size[1], number % self.size[1])
    }

    /// The load modules that a point adds triangles to, and how many.
    pub(crate) fn of_place(&self, place: Place, site: &Site) -> [Option<(u32, u8)>; 2] {
        let mut found = modules_of(place, site)
            .into_iter()
            .filter_map(|(module, triangles)| Some((self.number(module)?, triangles as u8)));
        [found.next(), found.next()]
    }
}

/// Which share of limits a grant may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tier {
    /// That of the main kinds.
    Main,
    /// That of the main kinds in load modules and windows, that of all others in the area: the ground has its half.
    Wide,
    /// That of all others.
    Others,
}

/// The limit that left no room.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Limit {
    /// That of a load module (row, column).
    Module(i32, i32),
    /// That of the window whose south-west load module this is (row, column).
    Window(i32, i32),
    /// That of the area.
    Area,
}

/// What features have taken of every limit.
#[derive(Clone, Debug)]
pub(crate) struct Ledger<'a> {
    pub shares: &'a Shares,
    modules: Vec<i64>,
    windows: Vec<i64>,
    area: i64,
}

impl<'a> Ledger<'a> {
    /// Nothing taken yet but `before`, of each load module.
    pub fn new(shares: &'a Shares, before: &[i64]) -> Self {
        let [rows, cols] = shares.origins();
        let windows = vec![0; (rows * cols) as usize];
        let mut ledger = Self { shares, modules: vec![0; shares.modules.len()], windows, area: 0 };
        ledger.add_to_each(before);
        ledger
    }

    /// Adds to all load modules.
    pub fn add_to_each(&mut self, by: &[i64]) {
        let changes = (0..).zip(by.iter().copied()).filter(|(_, by)| *by != 0).collect::<Vec<_>>();
        self.add(&changes);
    }

    /// Adds to load modules, each named once.
    pub fn add(&mut self, changes: &[(u32, i64)]) {
        for &(module, by) in changes {
            self.modules[module as usize] += by;
            self.area += by;
            let windows = &mut self.windows;
            each_window(self.shares, module, &mut |window| windows[window] += by);
        }
    }

    /// The first limit that is exceeded where changes added something, if there is one.
    pub fn exceeded(&self, changes: &[(u32, i64)], tier: Tier) -> Option<Limit> {
        let more = || changes.iter().filter(|(_, by)| 0 < *by);
        for &(module, _) in more() {
            if self.shares.modules[module as usize].of(tier) < self.modules[module as usize] {
                let (row, col) = self.shares.module(module);
                return Some(Limit::Module(row, col));
            }
        }
        let mut found = None;
        for &(module, _) in more() {
            each_window(self.shares, module, &mut |window| {
                if found.is_none() && self.shares.windows[window].of(tier) < self.windows[window] {
                    found = Some(window as i32);
                }
            });
        }
        let cols = self.shares.origins()[1];
        let of_window = found.map(|window| Limit::Window(window / cols, window % cols));
        let sum: i64 = changes.iter().map(|(_, by)| by).sum();
        let in_area = if tier == Tier::Wide { Tier::Others } else { tier };
        let of_area = (0 < sum && self.shares.area.of(in_area) < self.area).then_some(Limit::Area);
        of_window.or(of_area)
    }

    /// Triangles that are taken of each load module.
    pub fn modules(&self) -> &[i64] {
        &self.modules
    }

    /// Triangles by which a load module in which any are taken lies over its own limit, that of a window or the area's,
    /// whichever is most.
    pub fn surplus_of(&self, module: u32) -> i64 {
        let taken = self.modules[module as usize];
        if taken <= 0 {
            return 0;
        }
        let of_area = self.area - self.shares.area.of(Tier::Main);
        let mut most = (taken - self.shares.modules[module as usize].of(Tier::Main)).max(of_area);
        each_window(self.shares, module, &mut |window| {
            most = most.max(self.windows[window] - self.shares.windows[window].of(Tier::Main));
        });
        most.max(0)
    }

    /// The same of each load module.
    pub fn surplus(&self) -> Vec<i64> {
        (0..self.modules.len() as u32).map(|module| self.surplus_of(module)).collect()
    }
}

/// Triangles that features take of each load module of an area.
pub(crate) fn taken(cost: &Cost, shares: &Shares) -> Vec<i64> {
    let mut taken = vec![0; shares.modules.len()];
    for (module, classes) in cost {
        if let Some(number) = shares.number(*module) {
            taken[number as usize] = classes.values().map(|count| i64::from(*count)).sum();
        }
    }
    taken
}

fn each_window(shares: &Shares, module: u32, found: &mut impl FnMut(usize)) {
    let (row, col) = shares.module(module);
    let [rows, cols] = shares.origins();
    let span = |at: i32, side: i32, count: i32| (at - side + 1).max(0)..=at.min(count - 1);
    for south in span(row, shares.window[0], rows) {
        for west in span(col, shares.window[1], cols) {
            found((south * cols + west) as usize);
        }
    }
}

/// Triangles that features take, by load module (row, column) and class.
pub type Cost = BTreeMap<(i32, i32), BTreeMap<u16, u32>>;

/// What formed features cost.
pub fn cost(formed: &Formed, site: &Site) -> Cost {
    let mut class = vec![u16::MAX; formed.points.len()];
    for edge in &formed.edges {
        for point in [edge.a, edge.b] {
            class[point as usize] = class[point as usize].min(edge.class);
        }
    }
    let mut cost = Cost::new();
    for ((place, _), class) in formed.points.iter().zip(class) {
        for (module, triangles) in modules_of(*place, site) {
            *cost.entry(module).or_default().entry(class).or_insert(0) += triangles;
        }
    }
    for deck in &formed.decks {
        for module in modules_under(deck, site) {
            *cost.entry(module).or_default().entry(deck.class).or_insert(0) += deck.corners.len() as u32;
        }
    }
    cost
}

/// The load modules that a deck may lie over. In none of them it has more triangles than it has corners, also where a
/// corner of the load module cuts it.
fn modules_under(deck: &Face, site: &Site) -> Vec<(i32, i32)> {
    let modules: Vec<(i32, i32)> = deck.corners.iter().map(|(place, _)| site.module_of(*place)).collect();
    let span = |of: fn(&(i32, i32)) -> i32| {
        let all = modules.iter().map(of);
        all.clone().min().unwrap_or(0)..=all.max().unwrap_or(-1)
    };
    span(|module| module.0).flat_map(|row| span(|module| module.1).map(move |col| (row, col))).collect()
}

/// The load modules a point belongs to, with the triangles it adds to each.
pub(crate) fn modules_of(place: Place, site: &Site) -> Vec<((i32, i32), u32)> {
    let (row, col) = site.module_of(place);
    let steps = site.module_posts * site.lattice.steps_per_post();
    let (on_row, on_col) = (place.row % steps == 0, place.col % steps == 0);
    match (on_row, on_col) {
        (false, false) => vec![((row, col), 2)],
        (true, false) => vec![((row, col), 1), ((row - 1, col), 1)],
        (false, true) => vec![((row, col), 1), ((row, col - 1), 1)],
        // A corner of load modules is there anyway.
        (true, true) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ledger_names_the_limit_that_is_exceeded() {
        let mut shares = Shares { window: [1, 2], ..Shares::each([1, 3], 10) };
        shares.windows = vec![Share { main: 15, others: 12 }; 2];
        shares.area = Share { main: 20, others: 20 };
        let mut ledger = Ledger::new(&shares, &[0; 3]);
        let mut check = |changes: &[(u32, i64)], tier, expected| {
            ledger.add(changes);
            assert_eq!(ledger.exceeded(changes, tier), expected);
        };
        check(&[(0, 10)], Tier::Others, None);
        check(&[(0, 1)], Tier::Main, Some(Limit::Module(0, 0)));
        check(&[(0, -1)], Tier::Main, None);
        check(&[(1, 4)], Tier::Others, Some(Limit::Window(0, 0)));
        check(&[(1, 0)], Tier::Main, None);
        check(&[(2, 9)], Tier::Main, Some(Limit::Area));
        assert_eq!(ledger.surplus(), [3, 3, 3]);
    }
}
