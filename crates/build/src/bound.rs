//! Where a limit was met only by refusing posts, and what it cost.

use std::collections::{BTreeMap, BTreeSet};

use store::{ReportBound, ReportPlace};
use terrain::{
    Features, ModuleGrid, ModuleId, ModuleRect, ModuleResidual, RefusedBy, TileFeatures, TileId, Tin, Vertex,
    metres_of_quanta,
};
use tin::load_modules::{Layout, concatenate};
use tin::{Stop, TileTask};

use crate::CompileError;
use crate::enforce::ByModule;
use crate::ground::Window;
use crate::refine::Published;
use crate::refinement::{Most, Refinement, optimising};
use crate::run::Run;
use crate::sums::RefusedPosts;
use crate::tasks::{posts_of, rule};

/// Refusals of the whole area by load module: a tile is refused posts on its sides by load modules of its neighbours.
pub(crate) fn of_area(tins: &[Published]) -> BTreeMap<ModuleId, RefusedPosts> {
    let mut modules: BTreeMap<ModuleId, RefusedPosts> = BTreeMap::new();
    for (module, posts) in tins.iter().flat_map(|tile| &tile.refused) {
        modules.entry(*module).or_default().merge(posts);
    }
    modules
}

/// The limits that refused posts, most posts first. `counts` are of every load module, row-major.
pub(crate) fn bound(
    run: &Run,
    tins: &[Published],
    refused: &BTreeMap<ModuleId, RefusedPosts>,
    counts: &[u32],
    numbers: &ByModule,
) -> Result<Vec<ReportBound>, CompileError> {
    let tiles: BTreeSet<TileId> =
        refused.keys().map(|&module| run.area.tiling.tile_of_module(module, run.area.grid)).collect();
    let tiles: Vec<TileId> = tiles.into_iter().collect();
    let freed = schedule::for_each_independent(&tiles, &run.workers, run.stop, |_, &tile| {
        without_limits(run, &tins[run.area.tiling.index(tile)], refused)
    });
    let freed = freed.map_err(|error| CompileError::from_schedule(crate::Stage::Publish, &tiles, error))?;
    let freed: BTreeMap<ModuleId, ModuleResidual> = freed.into_iter().flatten().collect();

    let sums = run.area.budget.windows.sums(run.area.grid, counts);
    let places = by_place(run, refused, &sums);
    let mut bound: Vec<ReportBound> = places
        .into_iter()
        .map(|(place, posts)| {
            let inside = modules_of(run, place);
            let with = inside.clone().map(|module| numbers.get(module).residual);
            let without = inside.map(|module| *freed.get(&module).unwrap_or(&numbers.get(module).residual));
            let (kind, count, limit) = counted(run, place, counts, &sums);
            ReportBound {
                kind: kind.into(),
                place,
                count,
                limit,
                refused: posts.count(),
                refused_largest_m: metres_of_quanta(posts.largest() as i32),
                rms_with_m: rms_m(with),
                rms_without_m: rms_m(without),
            }
        })
        .collect();
    bound.sort_by_key(|bound| std::cmp::Reverse(bound.refused));
    Ok(bound)
}

/// Refusals by the load module or window whose limit caused them. A refusal by a window is booked to the fullest
/// window that holds the load module.
fn by_place(
    run: &Run,
    refused: &BTreeMap<ModuleId, RefusedPosts>,
    sums: &[u32],
) -> impl Iterator<Item = (ReportPlace, RefusedPosts)> + use<> {
    let windows = &run.area.budget.windows;
    let mut modules: BTreeMap<ModuleId, RefusedPosts> = BTreeMap::new();
    let mut by_window: BTreeMap<ModuleId, RefusedPosts> = BTreeMap::new();
    for (&module, posts) in refused {
        let here = ModuleRect { south: module.row, west: module.col, north: module.row + 1, east: module.col + 1 };
        let sum = |origin: &ModuleId| sums[origin.row as usize * windows.origins.cols() as usize + origin.col as usize];
        let fullest = windows.touching(here).iter().max_by_key(|origin| (sum(origin), std::cmp::Reverse(*origin)));
        let is_of_window = |by| by == RefusedBy::Window && fullest.is_some();
        let (of_window, of_module) = (posts.part(is_of_window), posts.part(|by| !is_of_window(by)));
        if let Some(origin) = fullest.filter(|_| 0 < of_window.count()) {
            by_window.entry(origin).or_default().merge(&of_window);
        }
        if 0 < of_module.count() {
            modules.entry(module).or_default().merge(&of_module);
        }
    }
    let module = |(id, posts): (ModuleId, RefusedPosts)| (ReportPlace::Module([id.row, id.col]), posts);
    let window = |(id, posts): (ModuleId, RefusedPosts)| (ReportPlace::Window([id.row, id.col]), posts);
    modules.into_iter().map(module).chain(by_window.into_iter().map(window))
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

/// The residuals of the load modules of a tile in which posts were refused, had it had that many more.
///
/// Each is taken by itself, its sides as they are, and given as many points more as were refused. One that was
/// optimised keeps its vertices and gains others where they explain most; where posts were selected, they are selected
/// again.
fn without_limits(
    run: &Run,
    own: &Published,
    refused: &BTreeMap<ModuleId, RefusedPosts>,
) -> Result<Vec<(ModuleId, ModuleResidual)>, CompileError> {
    let tile = run.area.tiling.modules(own.tile, run.area.grid);
    let window = run.window(own.tile)?;
    let parts = parts(&run.tin(own.tile, &own.stamp)?.tin, run.area.grid, tile);
    let features = if run.level.is_some() { run.tile_features(own.tile)?.kept.clone() } else { Features::default() };
    let here = tile.iter().zip(&parts).filter_map(|(module, part)| Some((module, part, refused.get(&module)?)));
    Ok(here
        .map(|(module, part, posts)| {
            let extra = posts.count() as usize;
            (module, without_limit(run, (&window, &features), module, part, extra))
        })
        .collect())
}

fn without_limit(
    run: &Run,
    (window, features): (&Window, &Features),
    module: ModuleId,
    part: &Tin,
    extra: usize,
) -> ModuleResidual {
    let rect = part.rect;
    let (dem, importance) = (window.dem.window(rect), window.importance.window(rect));
    let window = Window::of(dem, importance);
    let optimising = optimising(run.job);
    // What is filled has its sides and features already and counts all vertices; what is selected starts from them.
    let (features, sides, points) = match optimising {
        Some(_) => (Features::default(), Vec::new(), part.vertices.len()),
        None => {
            let features = features.within(rect).canonical();
            let (sides, inner) = selected(part, &features);
            (Features { spans: Vec::new(), ..features }, sides, inner)
        }
    };
    let inherited = posts_of(&sides);
    let tile = run.area.tiling.tile_of_module(module, run.area.grid);
    let stop = Stop { points: Some(points + extra), ..Stop::default() };
    let task = TileTask { inherited, stop, ..TileTask::plain(tile, rect, rule(run.job, &run.area)) };
    let features = TileFeatures { kept: features, ..TileFeatures::none(tile) };
    let spacing = Some(run.area.frame.spacing);
    let refinement = Refinement { task, optimising, most: Most::AsTask, features, spacing };
    let tin = match optimising {
        Some(optimising) => refinement.fill(&window, optimising, part),
        None => refinement.run(&window, None, &sides).tin,
    };
    let here = ModuleRect { south: module.row, west: module.col, north: module.row + 1, east: module.col + 1 };
    let layout = Layout { grid: run.area.grid, modules: here, spacing: run.area.frame.spacing };
    let mut modules = concatenate(&tin, &layout, &window.importance, None);
    fidelity::measure(&mut modules, &window.measured(&run.area));
    modules[0].residual
}

/// The vertices on the sides of a TIN that are none of features, in eighths, and how many there are inside.
fn selected(part: &Tin, features: &Features) -> (Vec<Vertex>, usize) {
    let (mut sides, mut inner) = (Vec::new(), 0);
    for vertex in &part.vertices {
        // Selected vertices stand on posts.
        match part.post_at(vertex.at).filter(|&post| !features.has_post(post)) {
            Some(post) if is_on_side(part, vertex) => sides.push(Vertex { at: post.into(), height: vertex.height }),
            Some(_) => inner += 1,
            None => {}
        }
    }
    (sides, inner)
}

fn is_on_side(tin: &Tin, vertex: &Vertex) -> bool {
    let (rect, at) = (tin.rect, vertex.at);
    let step = |at: i32| at * tin.steps_per_post;
    [rect.south, rect.north].map(step).contains(&at.row) || [rect.west, rect.east].map(step).contains(&at.col)
}

/// The parts of a tile's TIN that are its load modules, row by row.
fn parts(tin: &Tin, grid: ModuleGrid, tile: ModuleRect) -> Vec<Tin> {
    let empty = |id| Tin { rect: grid.posts_of(id), vertices: Vec::new(), triangles: Vec::new(), ..*tin };
    let mut parts: Vec<Tin> = tile.iter().map(empty).collect();
    let side = i64::from(grid.side_cells * tin.steps_per_post);
    for triangle in &tin.triangles {
        let corners = triangle.map(|v| tin.vertices[v as usize]);
        let thirds = |v: [i32; 3]| (v.into_iter().map(i64::from).sum::<i64>() / (3 * side)) as u32;
        let (row, col) = (thirds(corners.map(|v| v.at.row)), thirds(corners.map(|v| v.at.col)));
        let part = &mut parts[((row - tile.south) * tile.cols() + col - tile.west) as usize];
        let first = part.vertices.len() as u32;
        part.vertices.extend(corners);
        part.triangles.push([first, first + 1, first + 2]);
    }
    parts.iter_mut().for_each(weld);
    parts
}

/// Names every vertex once.
fn weld(part: &mut Tin) {
    let corners = std::mem::take(&mut part.vertices);
    part.vertices = corners.clone();
    part.vertices.sort_unstable();
    part.vertices.dedup();
    let index = |corner: u32| {
        let found = part.vertices.binary_search(&corners[corner as usize]);
        found.expect("every corner is among the vertices") as u32
    };
    part.triangles.iter_mut().for_each(|triangle| *triangle = triangle.map(index));
}
