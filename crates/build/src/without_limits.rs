//! What load modules would be like without the limits that refused posts in them.
//!
//! Each is taken by itself, its sides as they are, and given as many points more as were refused. One that was
//! optimised keeps its vertices and gains others where they explain most; where posts were selected, they are selected
//! again.

use std::collections::BTreeMap;

use crate::ground::Window;
use terrain::{Features, ModuleGrid, ModuleId, ModuleRect, ModuleResidual, TileFeatures, Tin, Vertex};
use tin::load_modules::{Layout, concatenate};
use tin::{Stop, TileTask};

use crate::CompileError;
use crate::refine::Published;
use crate::refinement::{Most, Refinement, optimising};
use crate::run::Run;
use crate::sums::RefusedPosts;
use crate::tasks::{posts_of, rule};

/// The residuals of the load modules of a tile in which posts were refused, had it had that many more.
pub(crate) fn without_limits(
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
    let refinement = Refinement { task, optimising, most: Most::AsTask, features };
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
