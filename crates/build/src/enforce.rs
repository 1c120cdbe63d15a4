//! Clip mode: where clipped pieces exceed a limit, the least valuable points make room, in bounded rounds.
//!
//! A whole-area stage that sees counts and proposals only. Every round picks the cheapest removals that free
//! something needed, never two whose forecasts depend on each other, and assembles again what they reach.

use std::collections::BTreeSet;

use job::{Count, Edges};
use store::engine::Outcome;
use terrain::{LatticePoint, ModuleId, Post, TileId};
use tin::load_modules::{Layout, Removal, RemovalGround, halo_posts, propose_removals};

use crate::assemble::{assemble_tile, points_around};
use crate::refine::Published;
use crate::run::Run;
use crate::sums::{Assembled, ModuleNumbers, Sums};
use crate::{CompileError, Event, Progress, Stage};

/// Rounds of removal and assembly, at most; what is over its limit after them is a breach.
const ROUNDS_MAX: usize = 8;

/// What enforcing did.
#[derive(Default)]
pub(crate) struct Enforced {
    /// Points taken out, per tile.
    pub removed: Vec<Vec<LatticePoint>>,
    /// Residual of each load module before, where points were taken out anywhere.
    pub before: Option<Vec<ModuleNumbers>>,
}

/// Takes out points until no limit is exceeded, or for as many rounds as allowed.
pub(crate) fn enforce(
    run: &Run,
    tins: &[Published],
    assembled: &mut [Assembled],
    sums: &mut Sums,
    progress: &mut dyn Progress,
) -> Result<Enforced, CompileError> {
    let mut enforced = Enforced { removed: vec![Vec::new(); tins.len()], before: None };
    if run.job.modules.edges == Edges::Constrained {
        return Ok(enforced);
    }
    for _ in 0..ROUNDS_MAX {
        let mut need = Need::new(run, assembled);
        if need.is_met() {
            break;
        }
        progress.tell(Event::Enter(Stage::Enforce, 0));
        enforced.before.get_or_insert_with(|| ByModule { run, assembled }.iter().copied().collect());
        let proposals = propose(run, tins, &enforced.removed, &need)?;
        let picked = pick(&mut need, proposals);
        progress.tell(Event::Leave(Stage::Enforce));
        if picked.is_empty() {
            break;
        }
        progress.tell(Event::Note(format!("{} points make room for exceeded limits", picked.len())));
        let reached = take_out(run, &picked, &mut enforced.removed);
        let again = run.for_each_tile(Stage::Enforce, progress, |tile| {
            if !reached.contains(&tile) {
                return Ok(Outcome::Kept(None));
            }
            let again = assemble_tile(run, &|index| tins[index].stamp, &enforced.removed, tile)?;
            Ok(again.map(|(again, _)| Some(again)))
        })?;
        for (slot, fresh) in assembled.iter_mut().zip(again) {
            if let Some(fresh) = fresh.into_inner() {
                *slot = fresh;
            }
        }
    }
    if enforced.before.is_some() {
        *sums = Sums::published(run, assembled)?;
    }
    Ok(enforced)
}

/// The numbers of every load module of the area, found in its tile.
#[derive(Clone, Copy)]
pub(crate) struct ByModule<'a> {
    pub run: &'a Run<'a>,
    pub assembled: &'a [Assembled],
}

impl<'a> ByModule<'a> {
    /// Those of one load module.
    pub fn get(self, module: ModuleId) -> &'a ModuleNumbers {
        let area = &self.run.area;
        let tile = area.tiling.tile_of_module(module, area.grid);
        let modules = area.tiling.modules(tile, area.grid);
        let place =
            (module.row - modules.south) as usize * modules.cols() as usize + (module.col - modules.west) as usize;
        &self.assembled[area.tiling.index(tile)].modules[place]
    }

    /// Those of every load module, row-major.
    pub fn iter(self) -> impl Iterator<Item = &'a ModuleNumbers> {
        self.run.area.grid.all().iter().map(move |module| self.get(module))
    }
}

/// What is counted against limits.
pub(crate) fn counted(run: &Run, numbers: &ModuleNumbers) -> u32 {
    match run.job.limits.count {
        Count::Triangles => numbers.triangles,
        Count::Polygons => numbers.polygons,
    }
}

/// What still has to go, by load module, by window and in all.
struct Need<'a> {
    run: &'a Run<'a>,
    modules: Vec<i64>,
    windows: Vec<i64>,
    area: i64,
}

impl<'a> Need<'a> {
    fn new(run: &'a Run<'a>, assembled: &[Assembled]) -> Self {
        let budget = &run.area.budget;
        let counts: Vec<u32> = ByModule { run, assembled }.iter().map(|numbers| counted(run, numbers)).collect();
        let limit = i64::from(budget.per_module);
        let mut modules: Vec<i64> = counts.iter().map(|&count| i64::from(count) - limit).collect();
        grant_pool(&mut modules, budget.pool);
        let sums = budget.windows.sums(budget.grid, &counts);
        let windows = sums.iter().map(|&sum| i64::from(sum) - i64::from(budget.per_window)).collect();
        let area = counts.iter().map(|&count| i64::from(count)).sum::<i64>() - budget.area as i64;
        Self { run, modules, windows, area }
    }

    fn is_met(&self) -> bool {
        self.area <= 0 && self.modules.iter().chain(&self.windows).all(|&excess| excess <= 0)
    }

    /// Load modules in which something has to go, in ascending order.
    fn over(&self) -> Vec<ModuleId> {
        let grid = self.run.area.grid;
        grid.all().iter().filter(|&module| self.wants(module)).collect()
    }

    fn wants(&self, module: ModuleId) -> bool {
        0 < self.area
            || 0 < self.modules[self.run.area.grid.index(module)]
            || self.windows_of(module).any(|window| 0 < self.windows[window])
    }

    fn windows_of(&self, module: ModuleId) -> impl Iterator<Item = usize> + use<> {
        let windows = self.run.area.budget.windows;
        let wide = windows.origins.cols() as usize;
        let here =
            terrain::ModuleRect { south: module.row, west: module.col, north: module.row + 1, east: module.col + 1 };
        windows.touching(here).iter().map(move |origin| origin.row as usize * wide + origin.col as usize)
    }

    fn free(&mut self, module: ModuleId, count: i64) {
        self.modules[self.run.area.grid.index(module)] -= count;
        for window in self.windows_of(module) {
            self.windows[window] -= count;
        }
        self.area -= count;
    }
}

/// The pool covers the smallest excesses first: that spares the most load modules.
fn grant_pool(excess: &mut [i64], pool: u64) {
    let mut over: Vec<usize> = (0..excess.len()).filter(|&module| 0 < excess[module]).collect();
    over.sort_by_key(|&module| (excess[module], module));
    let mut left = pool as i64;
    for module in over {
        let granted = excess[module].min(left);
        excess[module] -= granted;
        left -= granted;
    }
}

/// Every tile's proposals, in tile order.
fn propose(
    run: &Run,
    tins: &[Published],
    removed: &[Vec<LatticePoint>],
    need: &Need,
) -> Result<Vec<Removal>, CompileError> {
    let over = need.over();
    let area = &run.area;
    let pins = run.ground.given.pinned();
    let proposals = schedule::for_each_independent(&area.tiles, &run.workers, run.stop, |_, &tile| {
        let modules = area.tiling.modules(tile, area.grid);
        let layout = Layout { grid: area.grid, modules, spacing: area.frame.spacing };
        // Most tiles have nothing over its limit anywhere near, and need no ground to say so.
        if !over.iter().any(|&module| is_near(modules, module)) {
            return Ok(Vec::new());
        }
        let window = run.ground.around(area, tile, halo_posts(area.grid.side_cells))?;
        let ground = RemovalGround { dem: &window.dem, mask: &window.importance, pins: &pins, over: &over };
        let points = points_around(run, &|index| tins[index].stamp, removed, tile)?;
        Ok(propose_removals(&points, &layout, &ground))
    });
    let proposals = proposals.map_err(|error| CompileError::from_schedule(Stage::Enforce, &area.tiles, error))?;
    Ok(proposals.into_iter().flatten().collect())
}

/// Whether removing a point of a tile could free something in `module`: a point reaches two load modules far.
fn is_near(modules: terrain::ModuleRect, module: ModuleId) -> bool {
    const REACH: u32 = 2;
    let within = |at: u32, low: u32, high: u32| low <= at + REACH && at < high + REACH;
    within(module.row, modules.south, modules.north) && within(module.col, modules.west, modules.east)
}

/// The cheapest proposals that free something needed.
fn pick(need: &mut Need, mut proposals: Vec<Removal>) -> Vec<Removal> {
    proposals.sort_by_key(|removal| (removal.sse_increase, removal.post));
    let count = need.run.job.limits.count;
    let mut touched: BTreeSet<Post> = BTreeSet::new();
    let mut picked = Vec::new();
    for removal in proposals {
        if need.is_met() {
            break;
        }
        let freed = |freed: &tin::load_modules::Freed| match count {
            Count::Triangles => i64::from(freed.triangles),
            Count::Polygons => i64::from(freed.polygons),
        };
        let useful = removal.freed.iter().any(|part| 0 < freed(part) && need.wants(part.module));
        if !useful || touched.contains(&removal.post) {
            continue;
        }
        removal.freed.iter().for_each(|part| need.free(part.module, freed(part)));
        touched.extend(removal.ring.iter().copied());
        touched.insert(removal.post);
        picked.push(removal);
    }
    picked
}

/// Notes removals with every tile that holds the point, and gives the tiles to assemble again.
fn take_out(run: &Run, picked: &[Removal], removed: &mut [Vec<LatticePoint>]) -> BTreeSet<TileId> {
    let halo = halo_posts(run.area.grid.side_cells);
    let mut reached = BTreeSet::new();
    for removal in picked {
        for &tile in &run.area.tiles {
            let rect = run.area.tiling.rect(tile);
            if rect.contains(removal.post) {
                removed[run.area.tiling.index(tile)].push(removal.post.into());
            }
            if rect.grown(halo).contains(removal.post) {
                reached.insert(tile);
            }
        }
    }
    reached
}
