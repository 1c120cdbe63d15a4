//! Where a limit was met only by refusing posts, and what it cost.

use std::collections::{BTreeMap, BTreeSet};

use database::{ReportBound, ReportPlace};
use terrain::{ModuleId, ModuleRect, ModuleResidual, Refusal, RefusedBy, TileId, metres_of_quanta};

use crate::CompileError;
use crate::assemble::ModuleNumbers;
use crate::refine::Published;
use crate::run::Run;
use crate::without_limits::without_limits;

/// The limits that refused posts, most posts first. `counts` and `numbers` are of every load module, row-major.
pub(crate) fn bound(
    run: &Run,
    tins: &[Published],
    counts: &[u32],
    numbers: &[&ModuleNumbers],
) -> Result<Vec<ReportBound>, CompileError> {
    let refused = refused_by_module(tins);
    let tiles: BTreeSet<TileId> =
        refused.keys().map(|&module| run.area.tiling.tile_of_module(module, run.area.grid)).collect();
    let tiles: Vec<TileId> = tiles.into_iter().collect();
    let freed = schedule::for_each_independent(&tiles, &run.workers, run.stop, |_, &tile| {
        without_limits(run, &tins[run.area.tiling.index(tile)], &refused)
    });
    let freed = freed.map_err(|error| CompileError::from_schedule(crate::Stage::Publish, &tiles, error))?;
    let freed: BTreeMap<ModuleId, ModuleResidual> = freed.into_iter().flatten().collect();

    let sums = run.area.budget.windows.sums(run.area.grid, counts);
    let places = by_place(run, &refused, &sums);
    let mut bound: Vec<ReportBound> = places
        .into_iter()
        .map(|(place, refusals)| {
            let inside = modules_of(run, place);
            let with = inside.clone().map(|module| numbers[run.area.grid.index(module)].residual);
            let without =
                inside.map(|module| *freed.get(&module).unwrap_or(&numbers[run.area.grid.index(module)].residual));
            let largest = refusals.iter().map(|refusal| refusal.residual).max().unwrap_or(0);
            let (kind, count, limit) = counted(run, place, counts, &sums);
            ReportBound {
                kind: kind.into(),
                place,
                count,
                limit,
                refused: refusals.len() as u32,
                refused_largest_m: metres_of_quanta(largest as i32),
                rms_with_m: rms_m(with),
                rms_without_m: rms_m(without),
            }
        })
        .collect();
    bound.sort_by_key(|bound| std::cmp::Reverse(bound.refused));
    Ok(bound)
}

fn refused_by_module(tins: &[Published]) -> BTreeMap<ModuleId, Vec<Refusal>> {
    let mut refused: BTreeMap<ModuleId, Vec<Refusal>> = BTreeMap::new();
    for refusal in tins.iter().flat_map(|tile| &tile.tin.refused) {
        refused.entry(refusal.module).or_default().push(*refusal);
    }
    refused
}

/// Refusals by the load module or window whose limit caused them. A refusal by a window is booked to the fullest
/// window that holds the load module.
fn by_place(run: &Run, refused: &BTreeMap<ModuleId, Vec<Refusal>>, sums: &[u32]) -> Vec<(ReportPlace, Vec<Refusal>)> {
    let windows = &run.area.budget.windows;
    let mut modules: BTreeMap<ModuleId, Vec<Refusal>> = BTreeMap::new();
    let mut by_window: BTreeMap<ModuleId, Vec<Refusal>> = BTreeMap::new();
    for (&module, refusals) in refused {
        let here = ModuleRect { south: module.row, west: module.col, north: module.row + 1, east: module.col + 1 };
        let sum = |origin: &ModuleId| sums[origin.row as usize * windows.origins.cols() as usize + origin.col as usize];
        let fullest = windows.touching(here).iter().max_by_key(|origin| (sum(origin), std::cmp::Reverse(*origin)));
        for refusal in refusals {
            match (refusal.by, fullest) {
                (RefusedBy::Window, Some(origin)) => by_window.entry(origin).or_default().push(*refusal),
                _ => modules.entry(module).or_default().push(*refusal),
            }
        }
    }
    let module = |(id, refusals): (ModuleId, Vec<Refusal>)| (ReportPlace::Module([id.row, id.col]), refusals);
    let window = |(id, refusals): (ModuleId, Vec<Refusal>)| (ReportPlace::Window([id.row, id.col]), refusals);
    modules.into_iter().map(module).chain(by_window.into_iter().map(window)).collect()
}

fn modules_of(run: &Run, place: ReportPlace) -> impl Iterator<Item = ModuleId> + Clone + use<> {
    let modules = match place {
        ReportPlace::Module([row, col]) => ModuleRect { south: row, west: col, north: row + 1, east: col + 1 },
        ReportPlace::Window([row, col]) => run.area.budget.windows.modules_of(ModuleId { row, col }),
        ReportPlace::Area => run.area.grid.all(),
    };
    (modules.south..modules.north)
        .flat_map(move |row| (modules.west..modules.east).map(move |col| ModuleId { row, col }))
}

fn counted(run: &Run, place: ReportPlace, counts: &[u32], sums: &[u32]) -> (&'static str, u64, u64) {
    let budget = &run.area.budget;
    match place {
        ReportPlace::Module([row, col]) => {
            let count = counts[budget.grid.index(ModuleId { row, col })];
            ("per_load_module", u64::from(count), u64::from(budget.per_module))
        }
        ReportPlace::Window([row, col]) => {
            let count = sums[row as usize * budget.windows.origins.cols() as usize + col as usize];
            ("per_4km_square", u64::from(count), u64::from(budget.per_window))
        }
        ReportPlace::Area => {
            let count = counts.iter().map(|&count| u64::from(count)).sum();
            ("mean_per_load_module", count, budget.area)
        }
    }
}

fn rms_m(parts: impl Iterator<Item = ModuleResidual>) -> f64 {
    let (squares, posts) =
        parts.fold((0u64, 0u64), |(squares, posts), part| (squares + part.sum_squared, posts + u64::from(part.posts)));
    if posts == 0 { 0.0 } else { (squares as f64 / posts as f64).sqrt() / f64::from(terrain::QUANTA_PER_METRE) }
}
