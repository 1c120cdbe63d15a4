//! Shares must respect every limit whatever the tiles do with them.

use std::iter::once;

use super::*;
use terrain::limits::Windows;
use terrain::{GainRun, ModuleGrid, TileId, TileOrder};

const GRID: ModuleGrid = ModuleGrid { rows: 20, cols: 22, side_cells: 20 };

fn budget(per_module: u32, pool: u64, area: u64, per_window: u32) -> Budget {
    Budget {
        grid: GRID,
        border_step: 5,
        per_module,
        pool,
        area,
        per_window,
        windows: Windows::new(GRID, 8),
        reserved: Vec::new(),
    }
}

fn tiling(order: TileOrder) -> Tiling {
    Tiling::new(GRID.area(), 20, 3, 3, order)
}

fn ranks(tiling: &Tiling) -> Vec<usize> {
    let mut by_rank: Vec<TileId> = tiling.tiles().collect();
    by_rank.sort_by_key(|&tile| tiling.rank(tile));
    by_rank.into_iter().map(|tile| tiling.index(tile)).collect()
}

/// A rough south-west, flat elsewhere: gains differ by tile and crowd into some load modules.
fn curves(tiling: &Tiling) -> Vec<GainCurve> {
    let curve = |tile: TileId| {
        let modules = tiling.modules(tile, GRID);
        let mut runs: Vec<GainRun> = modules
            .iter()
            .flat_map(|module| {
                let steep = 900 - 20 * (module.row + module.col) as i32;
                (0..70).map(move |i| GainRun { module, bin: steep - 9 * i, cost: 2 })
            })
            .collect();
        runs.sort_by_key(|run| (std::cmp::Reverse(run.bin), run.module));
        GainCurve { tile, runs, squares: Vec::new() }
    };
    tiling.tiles().map(curve).collect()
}

/// Whatever tiles spend within their shares, no load module, window or total can go over its limit.
#[track_caller]
fn check(budget: &Budget, tiling: &Tiling, allocation: &Allocation) {
    let start = budget.start();
    let mut windows = vec![0u64; budget.windows.origins.count()];
    for (at, count) in budget.windows.sums(GRID, &start).into_iter().enumerate() {
        windows[at] = u64::from(count);
    }
    let mut inherited = vec![0u32; GRID.count()];
    let wide = budget.windows.origins.cols() as usize;
    for (tile, share) in tiling.tiles().zip(&allocation.shares) {
        let own = tiling.modules(tile, GRID);
        for (module, &room) in share.allowance.modules.iter().zip(&share.allowance.module_room) {
            let index = GRID.index(module);
            let granted = allocation.granted.iter().find(|&&(other, _)| other == module).map_or(0, |&(_, extra)| extra);
            if own.contains(module) {
                assert_eq!(start[index] + room, budget.per_module + granted);
            } else {
                inherited[index] += room;
                assert!(start[index] + inherited[index] <= budget.per_module + granted, "{module}");
            }
        }
        for (origin, &room) in share.allowance.windows.iter().zip(&share.allowance.window_room) {
            windows[origin.row as usize * wide + origin.col as usize] += u64::from(room);
        }
    }
    assert!(windows.iter().all(|&count| count <= u64::from(budget.per_window)), "{windows:?}");
    let total: u64 = allocation.shares.iter().map(|share| u64::from(share.allowance.triangles)).sum();
    assert!(budget.start_total() + total <= budget.area);
    let granted: u64 = allocation.granted.iter().map(|&(_, extra)| u64::from(extra)).sum();
    assert!(granted <= budget.pool);
}

fn gains<'a>(by_rank: &'a [usize], bands: &'a mut dyn Iterator<Item = Vec<GainCurve>>) -> Gains<'a> {
    Gains { bands, by_rank, floor: None }
}

#[test]
fn gains_in_bands_are_shared_out_like_gains_at_once() {
    let tiling = tiling(TileOrder::Color);
    let (by_rank, curves) = (ranks(&tiling), curves(&tiling));
    let mut steps: Vec<i32> = curves.iter().flat_map(|curve| curve.runs.iter().map(|run| run.bin)).collect();
    steps.sort_unstable_by(|a, b| b.cmp(a));
    steps.dedup();
    for (per_module, pool, mean, width) in [(100, 0, 32, 1), (40, 30, 32, 7), (40, 30, 90, 1000), (100, 0, 12, 3)] {
        let budget = budget(per_module, pool, mean * GRID.count() as u64, 4096);
        let whole = allocate_globally(&budget, &tiling, gains(&by_rank, &mut once(curves.clone())));
        let mut bands = steps.chunks(width).map(|steps| {
            let of = |curve: &GainCurve| curve.runs.iter().copied().filter(|run| steps.contains(&run.bin)).collect();
            curves.iter().map(|curve| GainCurve { runs: of(curve), ..curve.clone() }).collect()
        });
        assert_eq!(allocate_globally(&budget, &tiling, gains(&by_rank, &mut bands)), whole, "{width} steps a band");
    }
}

#[test]
fn shares_respect_every_limit() {
    for order in [TileOrder::Color, TileOrder::Raster] {
        let tiling = tiling(order);
        let (by_rank, curves) = (ranks(&tiling), curves(&tiling));
        for (per_module, pool, per_window) in
            [(100, 0, 4096), (40, 0, 4096), (100, 0, 1200), (40, 500, 2000), (9, 0, 320)]
        {
            let budget = budget(per_module, pool, 32 * GRID.count() as u64, per_window);
            assert_eq!(budget.check(), Ok(()));
            check(&budget, &tiling, &allocate_equally(&budget, &tiling));
            let gains = Gains { bands: &mut once(curves.clone()), by_rank: &by_rank, floor: None };
            check(&budget, &tiling, &allocate_globally(&budget, &tiling, gains));
        }
    }
}

#[test]
fn rough_ground_is_given_more_than_flat_ground() {
    let tiling = tiling(TileOrder::Color);
    let (by_rank, curves) = (ranks(&tiling), curves(&tiling));
    let budget = budget(100, 0, 32 * GRID.count() as u64, 4096);
    let allocation = allocate_globally(&budget, &tiling, gains(&by_rank, &mut once(curves)));
    let triangles = |row, col| allocation.shares[tiling.index(TileId { row, col })].allowance.triangles;
    assert!(2 * triangles(2, 2) < triangles(0, 0), "{} {}", triangles(2, 2), triangles(0, 0));
    let total: u64 = allocation.shares.iter().map(|share| u64::from(share.allowance.triangles)).sum();
    assert!(allocation.slack <= (budget.area - budget.start_total()) / SLACK_SHARE);
    assert_eq!(budget.start_total() + total + allocation.slack, budget.area);
}

#[test]
fn the_pool_goes_where_it_gains_most() {
    let tiling = tiling(TileOrder::Color);
    let (by_rank, curves) = (ranks(&tiling), curves(&tiling));
    let budget = budget(40, 30, 32 * GRID.count() as u64, 4096);
    let allocation = allocate_globally(&budget, &tiling, gains(&by_rank, &mut once(curves)));
    let granted: u32 = allocation.granted.iter().map(|&(_, extra)| extra).sum();
    assert_eq!(granted, 30);
    // The steepest load modules lie in the south-west corner.
    assert!(allocation.granted.iter().all(|(module, _)| module.row + module.col < 4), "{:?}", allocation.granted);
}

#[test]
fn without_any_gain_the_budget_is_still_there_to_spend() {
    let tiling = tiling(TileOrder::Color);
    let none: Vec<GainCurve> =
        tiling.tiles().map(|tile| GainCurve { tile, runs: Vec::new(), squares: Vec::new() }).collect();
    let budget = budget(100, 0, 32 * GRID.count() as u64, 4096);
    let by_rank = ranks(&tiling);
    let allocation = allocate_globally(&budget, &tiling, gains(&by_rank, &mut once(none)));
    check(&budget, &tiling, &allocation);
    assert!(allocation.shares.iter().all(|share| 1000 < share.allowance.triangles));
}
