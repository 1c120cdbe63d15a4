//! What each tile may spend in triangles: in all, in each load module, in each window.
//!
//! A seam point is charged to the tile that chooses it, one triangle in each of the two load modules
//! beside it, so a tile's allowance reaches one load module beyond the sides it owns. Those load modules
//! keep an equal part of their room free for each side they inherit; windows that several tiles can reach
//! are divided into quotas. Every sum over tiles then respects every limit.

use terrain::limits::Allowance;
use terrain::{GainCurve, ModuleId, ModuleRect, POINT_COST, Side};

use crate::tiling::points::{Gains, highest_rung};
use crate::tiling::{Budget, Tiling};

/// How the area's budget was shared out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Allocation {
    /// One share per tile, row-major.
    pub shares: Vec<Share>,
    /// Rung of the ladder down to which gains are taken; absent without a survey, or where the budget
    /// reaches below everything a survey saw.
    pub threshold_bin: Option<i32>,
    /// Triangles of the budget that no tile was given: the next rung did not fit.
    pub slack: u64,
    /// Load modules that were granted more than the limit, with the triangles granted from the pool.
    pub granted: Vec<(ModuleId, u32)>,
}

/// One tile's share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Share {
    /// What it may spend.
    pub allowance: Allowance,
    /// What the survey expects it to spend; equal to the whole share without one.
    pub expected: u32,
}

/// Part of the budget that may be left over rather than cut a rung in two.
const SLACK_SHARE: u64 = 100;
/// In a window, a load module of a tile's own counts this much against one beyond its sides, which can only
/// gain the points of one side.
const OWN_WEIGHT: u64 = 16;

/// Shares by load-module count, as the paper did; no survey.
pub fn allocate_equally(budget: &Budget, tiling: &Tiling) -> Allocation {
    let state = State::new(budget, tiling);
    let room = budget.area - budget.start_total();
    let modules = budget.grid.count() as u64;
    let share_of = |tile: &Reach| room * tile.own.count() as u64 / modules;
    let totals: Vec<u32> = state.tiles.iter().map(|tile| share_of(tile) as u32 / POINT_COST * POINT_COST).collect();
    let slack = room - totals.iter().map(|&total| u64::from(total)).sum::<u64>();
    let granted = vec![0; modules as usize];
    state.into_allocation(totals, None, &granted, None, slack)
}

/// Shares by one common threshold of gain under all limits, the pool going where it gains most.
pub fn allocate_globally(budget: &Budget, tiling: &Tiling, gains: Gains) -> Allocation {
    let mut state = State::new(budget, tiling);
    let taken = state.take(gains, budget.area - budget.start_total());
    let expected = std::mem::take(&mut state.expected);
    let mut totals: Vec<u32> = expected.iter().map(|used| used.iter().sum()).collect();
    if taken.threshold.is_none() {
        // The survey saw no use for the rest; it may be spent anywhere.
        for (total, extra) in totals.iter_mut().zip(crate::tiling::points_equally(taken.left, tiling.count())) {
            *total += extra as u32;
        }
    }
    let slack = if taken.threshold.is_some() { taken.left } else { 0 };
    let granted = std::mem::take(&mut state.granted);
    state.into_allocation(totals, taken.threshold, &granted, Some(&expected), slack)
}

/// The load modules and windows a tile can reach.
struct Reach {
    /// Its own load modules.
    own: ModuleRect,
    /// Its own and the ring around them, cut to the area.
    ring: ModuleRect,
    /// Windows that hold any load module it can add triangles to.
    windows: ModuleRect,
    owned: terrain::SeamSides,
}

impl Reach {
    fn new(budget: &Budget, tiling: &Tiling, tile: terrain::TileId) -> Self {
        let own = tiling.modules(tile, budget.grid);
        let owned = tiling.owned_sides(tile);
        let ring = ModuleRect {
            south: own.south.saturating_sub(1),
            west: own.west.saturating_sub(1),
            north: (own.north + 1).min(budget.grid.rows),
            east: (own.east + 1).min(budget.grid.cols),
        };
        Self { own, ring, windows: budget.windows.touching(ring), owned }
    }

    /// The side of the tile beyond which `module` lies, if it is one that the tile owns.
    fn owned_side_of(&self, module: ModuleId) -> Option<Side> {
        let in_rows = self.own.south <= module.row && module.row < self.own.north;
        let in_cols = self.own.west <= module.col && module.col < self.own.east;
        let side = match (in_rows, in_cols) {
            (true, false) if module.col < self.own.west => Side::West,
            (true, false) => Side::East,
            (false, true) if module.row < self.own.south => Side::South,
            (false, true) => Side::North,
            _ => return None,
        };
        self.owned.is_open(side).then_some(side)
    }

    fn place(&self, module: ModuleId) -> usize {
        (module.row - self.ring.south) as usize * self.ring.cols() as usize + (module.col - self.ring.west) as usize
    }
}

/// Counts of the whole area while gains are taken.
struct State<'a> {
    budget: &'a Budget,
    tiling: &'a Tiling,
    start: Vec<u32>,
    tiles: Vec<Reach>,
    /// Triangles of each load module so far, row-major.
    counts: Vec<u32>,
    /// Triangles of each window so far, row-major.
    windows: Vec<u32>,
    /// What each tile is expected to add to each load module of its ring.
    expected: Vec<Vec<u32>>,
    /// Triangles granted to each load module from the pool.
    granted: Vec<u32>,
    pool: u64,
}

/// How far the budget reached.
struct Taken {
    threshold: Option<i32>,
    left: u64,
}

impl<'a> State<'a> {
    fn new(budget: &'a Budget, tiling: &'a Tiling) -> Self {
        let start = budget.start();
        let tiles: Vec<Reach> = tiling.tiles().map(|tile| Reach::new(budget, tiling, tile)).collect();
        Self {
            budget,
            tiling,
            counts: start.clone(),
            windows: budget.windows.sums(budget.grid, &start),
            expected: tiles.iter().map(|tile| vec![0; tile.ring.count()]).collect(),
            granted: vec![0; start.len()],
            pool: budget.pool,
            start,
            tiles,
        }
    }

    /// Takes gains from the highest rung down while whole rungs fit into `room`.
    fn take(&mut self, gains: Gains, room: u64) -> Taken {
        let (mut left, mut threshold) = (room, None);
        for curves in gains.bands {
            let mut next = vec![0usize; curves.len()];
            while let Some(rung) = highest_rung(&curves, &next) {
                if gains.floor.is_some_and(|floor| rung < floor) {
                    return Taken { threshold: gains.floor, left };
                }
                let sum = rung_sum(&curves, &next, rung);
                if left < sum && left <= room / SLACK_SHARE {
                    return Taken { threshold: threshold.or(Some(rung)), left };
                }
                for &tile in gains.by_rank {
                    let runs = &curves[tile].runs;
                    while let Some(run) = runs.get(next[tile]).filter(|run| run.bin == rung) {
                        next[tile] += 1;
                        left -= self.accept_while_permitted(tile, run.module, run.cost, left);
                    }
                }
                threshold = Some(rung);
            }
        }
        Taken { threshold: None, left }
    }

    /// Books as much of a run as limits and what is `left` permit, a point at a time. Returns what was booked.
    fn accept_while_permitted(&mut self, tile: usize, module: ModuleId, cost: u32, left: u64) -> u64 {
        let mut booked = 0;
        while booked < cost {
            let step = POINT_COST.min(cost - booked);
            if left < u64::from(booked + step) || !self.accept(tile, module, step) {
                break;
            }
            booked += step;
        }
        u64::from(booked)
    }

    /// Books triangles in a load module where every limit permits them.
    fn accept(&mut self, tile: usize, module: ModuleId, cost: u32) -> bool {
        let index = self.budget.grid.index(module);
        let over = (self.counts[index] + cost).saturating_sub(self.budget.per_module + self.granted[index]);
        if self.pool < u64::from(over) {
            return false;
        }
        let rows = self.window_rows(module);
        let limit = self.budget.per_window;
        // Looks at all windows, which in lanes is quicker than stopping at the first full one.
        let is_full = |row: std::ops::Range<usize>| {
            self.windows[row].iter().fold(false, |full, &count| full | (limit < count + cost))
        };
        if rows.clone().fold(false, |full, row| full | is_full(row)) {
            return false;
        }
        rows.for_each(|row| self.windows[row].iter_mut().for_each(|count| *count += cost));
        self.counts[index] += cost;
        self.granted[index] += over;
        self.pool -= u64::from(over);
        let place = self.tiles[tile].place(module);
        self.expected[tile][place] += cost;
        true
    }

    /// The windows that hold `module`, as ranges of row-major places.
    fn window_rows(&self, module: ModuleId) -> impl Iterator<Item = std::ops::Range<usize>> + Clone + use<> {
        let (row, col) = (module.row, module.col);
        let touching =
            self.budget.windows.touching(ModuleRect { south: row, west: col, north: row + 1, east: col + 1 });
        let wide = self.budget.windows.origins.cols() as usize;
        (touching.south..touching.north).map(move |row| {
            let start = row as usize * wide;
            start + touching.west as usize..start + touching.east as usize
        })
    }

    /// Most triangles of a load module, with what the pool grants it.
    fn cap(&self, module: ModuleId, granted: &[u32]) -> u32 {
        self.budget.per_module + granted[self.budget.grid.index(module)]
    }

    fn into_allocation(
        mut self,
        totals: Vec<u32>,
        threshold_bin: Option<i32>,
        granted: &[u32],
        expected: Option<&[Vec<u32>]>,
        slack: u64,
    ) -> Allocation {
        // What was booked is in `expected`; sharing windows out takes as much memory again.
        (self.counts, self.windows) = (Vec::new(), Vec::new());
        let quotas = self.window_quotas(expected);
        let shares = self.tiles.iter().zip(quotas).enumerate().map(|(tile, (reach, window_room))| {
            let allowance = Allowance {
                modules: reach.ring,
                module_room: reach.ring.iter().map(|module| self.module_room(reach, module, granted)).collect(),
                windows: reach.windows,
                window_size: (self.budget.windows.rows, self.budget.windows.cols),
                window_room,
                triangles: totals[tile],
            };
            let expected = expected.map_or(totals[tile], |expected| expected[tile].iter().sum());
            Share { allowance, expected }
        });
        let shares = shares.collect();
        let granted = self.budget.grid.all().iter().zip(granted).filter(|&(_, &extra)| 0 < extra);
        let granted = granted.map(|(module, &extra)| (module, extra)).collect();
        Allocation { shares, threshold_bin, slack, granted }
    }

    /// Triangles a tile may add to one load module of its ring.
    fn module_room(&self, reach: &Reach, module: ModuleId, granted: &[u32]) -> u32 {
        let room = self.cap(module, granted) - self.start[self.budget.grid.index(module)];
        if reach.own.contains(module) {
            return room;
        }
        match reach.owned_side_of(module) {
            Some(_) => room / self.budget.inherited_sides(self.tiling, module),
            None => 0,
        }
    }

    /// Each tile's part of each window it can reach: what it is expected to need, and of the rest a part
    /// by load modules.
    fn window_quotas(&self, expected: Option<&[Vec<u32>]>) -> Vec<Vec<u32>> {
        let windows = &self.budget.windows;
        let start = windows.sums(self.budget.grid, &self.start);
        let mut quotas: Vec<Vec<u32>> = match expected {
            Some(expected) => (0..self.tiles.len()).map(|tile| self.window_needs(tile, &expected[tile])).collect(),
            None => self.tiles.iter().map(|tile| vec![0; tile.windows.count()]).collect(),
        };
        let mut needed = vec![0u32; start.len()];
        let mut weights = vec![0u32; start.len()];
        self.for_each_reach(|tile, local, window, origin| {
            needed[window] += quotas[tile][local];
            weights[window] += self.weight(tile, origin) as u32;
        });
        self.for_each_reach(|tile, local, window, origin| {
            let rest = u64::from(self.budget.per_window - start[window] - needed[window]);
            let part = (rest * self.weight(tile, origin)).checked_div(u64::from(weights[window])).unwrap_or(0);
            quotas[tile][local] += part as u32;
        });
        quotas
    }

    /// Visits (tile, window of its reach, window of the area, origin) for every tile and window it reaches.
    fn for_each_reach(&self, mut visit: impl FnMut(usize, usize, usize, ModuleId)) {
        let wide = self.budget.windows.origins.cols() as usize;
        for (tile, reach) in self.tiles.iter().enumerate() {
            for (local, origin) in reach.windows.iter().enumerate() {
                visit(tile, local, origin.row as usize * wide + origin.col as usize, origin);
            }
        }
    }

    /// A tile's claim on a window beyond what it needs.
    fn weight(&self, tile: usize, origin: ModuleId) -> u64 {
        let reach = &self.tiles[tile];
        let window = self.budget.windows.modules_of(origin);
        let shared = |modules: ModuleRect| {
            let rows = window.north.min(modules.north).saturating_sub(window.south.max(modules.south));
            let cols = window.east.min(modules.east).saturating_sub(window.west.max(modules.west));
            u64::from(rows) * u64::from(cols)
        };
        let own = shared(reach.own);
        let beyond = |side: Side, strip: ModuleRect| if reach.owned.is_open(side) { shared(strip) } else { 0 };
        let ring = beyond(Side::South, ModuleRect { south: reach.ring.south, north: reach.own.south, ..reach.own })
            + beyond(Side::North, ModuleRect { south: reach.own.north, north: reach.ring.north, ..reach.own })
            + beyond(Side::West, ModuleRect { west: reach.ring.west, east: reach.own.west, ..reach.own })
            + beyond(Side::East, ModuleRect { west: reach.own.east, east: reach.ring.east, ..reach.own });
        OWN_WEIGHT * own + ring
    }

    /// What a tile is expected to add to each window it reaches.
    fn window_needs(&self, tile: usize, expected: &[u32]) -> Vec<u32> {
        let reach = &self.tiles[tile];
        let windows = &self.budget.windows;
        let mut needs = vec![0; reach.windows.count()];
        for (module, &count) in reach.ring.iter().zip(expected).filter(|&(_, &count)| 0 < count) {
            let (row, col) = (module.row, module.col);
            let touching = windows.touching(ModuleRect { south: row, west: col, north: row + 1, east: col + 1 });
            for origin in touching.iter() {
                let (row, col) = (origin.row - reach.windows.south, origin.col - reach.windows.west);
                needs[row as usize * reach.windows.cols() as usize + col as usize] += count;
            }
        }
        needs
    }
}

/// Cost of all next runs on one rung.
fn rung_sum(curves: &[GainCurve], next: &[usize], rung: i32) -> u64 {
    let on_rung = |curve: &GainCurve, at: usize| -> u64 {
        curve.runs[at..].iter().take_while(|run| run.bin == rung).map(|run| u64::from(run.cost)).sum()
    };
    curves.iter().zip(next).map(|(curve, &at)| on_rung(curve, at)).sum()
}

#[cfg(test)]
mod tests;
