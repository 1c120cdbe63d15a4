//! Where a limit was met only by refusing posts, and what it cost: each such load module is refined once more by
//! itself, its sides as they are, with the refused posts let in.

use std::collections::{BTreeMap, BTreeSet};

use database::{ReportBound, ReportPlace};
use load_modules::{Layout, concatenate};
use terrain::{
    Dem, LATTICE_PER_POST, LatticePoint, ModuleId, ModuleRect, ModuleResidual, Post, PostRect, Refusal, RefusedBy,
    SeamSides, TileId, Vertex, metres_of_quanta,
};
use tin::{Frame, Stop, TileTask};

use crate::CompileError;
use crate::assemble::ModuleNumbers;
use crate::ground::Window;
use crate::refine::Published;
use crate::refinement::{Most, Refinement, optimising};
use crate::run::Run;
use crate::tasks::{posts_of, rule};

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

/// The residuals of the load modules of a tile in which posts were refused, had those been selected.
fn without_limits(
    run: &Run,
    own: &Published,
    refused: &BTreeMap<ModuleId, Vec<Refusal>>,
) -> Result<Vec<(ModuleId, ModuleResidual)>, CompileError> {
    let tile = run.area.tiling.modules(own.tin.tile, run.area.grid);
    let window = run.window(own.tin.tile)?;
    let mut vertices = own.tin.tin.vertices.clone();
    vertices.sort_unstable();
    let here = refused.iter().filter(|(module, _)| tile.contains(**module));
    Ok(here
        .map(|(&module, refusals)| (module, without_limit(run, &window, &vertices, module, refusals.len())))
        .collect())
}

/// The residual of a load module had it been given `extra` more points than it has. `vertices` are those of its tile
/// by row and column.
fn without_limit(run: &Run, window: &Window, vertices: &[Vertex], module: ModuleId, extra: usize) -> ModuleResidual {
    let area = &run.area;
    let rect = area.grid.posts_of(module);
    let (sides, inner) = sides_and_inner(vertices, rect);
    let sides = on_posts(&sides, &window.dem);
    let task = TileTask {
        tile: area.tiling.tile_of_module(module, area.grid),
        rect,
        frame: Frame::Plain,
        border: Vec::new(),
        inherited: posts_of(&sides),
        kept: Vec::new(),
        start: Vec::new(),
        seams: SeamSides::CLOSED,
        rule: rule(run.job, area),
        stop: Stop { points: Some(inner + extra), ..Stop::default() },
    };
    let (dem, importance) = (window.dem.window(rect), window.importance.window(rect));
    let window = Window { dem, importance, given: Vec::new() };
    let refinement = Refinement { task, optimising: optimising(run.job), most: Most::AsTask };
    let refined = refinement.run(&window, &sides);
    let here = ModuleRect { south: module.row, west: module.col, north: module.row + 1, east: module.col + 1 };
    let layout = Layout { grid: area.grid, modules: here, spacing: area.frame.spacing };
    let mut modules = concatenate(&refined.tin, &layout, &window.importance);
    fidelity::measure(&mut modules, &window.measured(area));
    modules[0].residual
}

/// The vertices on the sides of a load module, and how many lie inside it.
fn sides_and_inner(vertices: &[Vertex], rect: PostRect) -> (Vec<Vertex>, usize) {
    let (low, high) = (LatticePoint::from(rect.south_west()), LatticePoint::from(rect.north_east()));
    let first = vertices.partition_point(|vertex| vertex.at.row < low.row);
    let rows = vertices[first..].iter().take_while(|vertex| vertex.at.row <= high.row);
    let within = rows.filter(|vertex| low.col <= vertex.at.col && vertex.at.col <= high.col);
    let is_on_side =
        |at: LatticePoint| at.row == low.row || at.row == high.row || at.col == low.col || at.col == high.col;
    let (sides, inner): (Vec<Vertex>, Vec<Vertex>) = within.copied().partition(|vertex| is_on_side(vertex.at));
    (sides, inner.len())
}

/// Side vertices moved along their side to the nearest post, at the DEM's height there if they had to move: selection
/// starts from posts.
fn on_posts(sides: &[Vertex], dem: &Dem) -> Vec<Vertex> {
    let nearest = |at: i32| (at + LATTICE_PER_POST / 2).div_euclid(LATTICE_PER_POST);
    let moved = |vertex: &Vertex| {
        let post = Post::new(nearest(vertex.at.row), nearest(vertex.at.col));
        let at = LatticePoint::from(post);
        Vertex { at, height: if at == vertex.at { vertex.height } else { dem.height(post) } }
    };
    let mut moved: Vec<Vertex> = sides.iter().map(moved).collect();
    moved.sort_unstable();
    moved.dedup_by_key(|vertex| vertex.at);
    moved
}
