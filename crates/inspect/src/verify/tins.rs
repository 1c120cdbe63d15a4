//! The TINs of the tiles against their load modules: places, heights, triangles, and with them the polygons.
//!
//! With constrained edges load modules are the TIN's own triangles, and every triangle is a polygon. Clipped ones are
//! cut once more from the points of the TINs around, because that rule alone says which triangles were one polygon:
//! heights are rounded, so no load module shows which of its pieces lay in one plane.

use std::collections::BTreeSet;
use std::collections::btree_map::{BTreeMap, Entry};

use job::{Borders, ClipHeights as JobClipHeights, Edges, Job, OuterBorder};
use store::{Folder, Manifest, Stamp};
use terrain::{
    Importance, LatticePoint, LoadModule, ModuleId, ModuleVertex, RefusedBy, StopReason, TileId, TileTin, Vertex,
};
use tin::load_modules::{ClipHeights, Layout, clip};

use build::CompileError;
use build::ground::GamingArea;

use super::modules::Modules;

/// What the TINs of an area add up to.
#[derive(Default)]
pub(crate) struct OfTins {
    /// What each tile's TIN says that it was made from.
    pub stamps: Vec<Stamp>,
    /// Points that were taken out of each tile.
    pub removed: Vec<Vec<LatticePoint>>,
    /// Points of each tile, those on a shared side in one of both.
    pub points: Vec<u64>,
    /// Those of them, in the whole area, that every build starts from; corners not counted.
    pub border: u64,
    /// Why tiles stopped.
    pub stops: Vec<StopReason>,
    /// Refused posts by the module's limit, by the window's, by a reservation.
    pub refused: [u64; 3],
    /// The largest residual of a refused post.
    pub refused_largest: u32,
    /// What does not agree.
    pub problems: Vec<String>,
}

/// Reads every TIN and holds it against the load modules.
///
/// # Errors
/// When a file cannot be read that was sound a moment ago.
pub(crate) fn check(
    folder: &Folder,
    manifest: &Manifest,
    job: &Job,
    area: &GamingArea,
    modules: &Modules,
) -> Result<OfTins, CompileError> {
    let mut all = OfTins::default();
    for record in &manifest.tiles {
        let tile = record.tile();
        let (stamp, tin) = match folder.read_tile(tile) {
            Ok(read) => read,
            Err(error) => {
                all.problems.push(error.to_string());
                continue;
            }
        };
        let removed = match record.removed.map(|_| folder.read_removals(tile)) {
            None => Vec::new(),
            Some(Ok((_, removals))) => removals.points,
            Some(Err(error)) => {
                all.problems.push(error.to_string());
                continue;
            }
        };
        if record.fingerprint != Some(stamp.fingerprint) {
            all.problems.push(format!("tiles/{tile}.tin: its fingerprint is not the one in database.json"));
        }
        if stamp.algorithm_revision != manifest.algorithm_revision {
            let (found, expected) = (stamp.algorithm_revision, manifest.algorithm_revision);
            all.problems
                .push(format!("tiles/{tile}.tin: made by algorithm revision {found}, database.json says {expected}"));
        }
        if tin.tin.rect != area.tiling.rect(tile) {
            all.problems.push(format!("tiles/{tile}.tin: does not cover the posts of its tile"));
            continue;
        }
        if job.modules.edges == Edges::Constrained {
            all.problems.extend(differing_parts(area, tile, &tin, modules));
        }
        all.add(job, area, &tin, stamp, removed);
    }
    if let (Edges::Clip(heights), true) = (job.modules.edges, all.problems.is_empty()) {
        // Of three rows of tiles at once.
        let mut points: BTreeMap<TileId, Vec<Vertex>> = BTreeMap::new();
        for &tile in &area.tiles {
            points.retain(|other, _| tile.row <= other.row + 1);
            for near in area.tiling.neighbours(tile).into_iter().chain([tile]) {
                if let Entry::Vacant(of) = points.entry(near) {
                    of.insert(folder.read_tile(near)?.1.tin.vertices);
                }
            }
            let problems = differing_cuts(area, tile, heights, (&points, &all.removed), modules);
            all.problems.extend(problems);
        }
    }
    Ok(all)
}

impl OfTins {
    fn add(&mut self, job: &Job, area: &GamingArea, tin: &TileTin, stamp: Stamp, removed: Vec<LatticePoint>) {
        let (points, border) = count_points(job, area, tin, &removed);
        self.stamps.push(stamp);
        self.removed.push(removed);
        self.points.push(points);
        self.border += border;
        self.stops.push(tin.stop);
        for refusal in &tin.refused {
            self.refused_largest = self.refused_largest.max(refusal.residual);
            self.refused[match refusal.by {
                RefusedBy::Module => 0,
                RefusedBy::Window => 1,
                RefusedBy::Reservation => 2,
            }] += 1;
        }
    }
}

/// Points that a tile counts as its own, and those of them on lines where every build starts with points.
fn count_points(job: &Job, area: &GamingArea, tin: &TileTin, removed: &[LatticePoint]) -> (u64, u64) {
    let gone: BTreeSet<LatticePoint> = removed.iter().copied().collect();
    let steps = tin.tin.steps_per_post;
    let line = |line: i32| line * steps;
    let (rect, whole) = (tin.tin.rect, area.rect);
    let side = area.grid.side_cells * steps;
    let (mut points, mut border) = (0, 0);
    for at in tin.tin.vertices.iter().map(|vertex| vertex.at).filter(|at| !gone.contains(at)) {
        let is_north = at.row == line(rect.north) && rect.north != whole.north;
        let is_east = at.col == line(rect.east) && rect.east != whole.east;
        if is_north || is_east {
            continue;
        }
        points += 1;
        let on = |rect: terrain::PostRect| {
            [rect.south, rect.north].map(line).contains(&at.row) || [rect.west, rect.east].map(line).contains(&at.col)
        };
        let starts_there = (job.modules.outer_border == OuterBorder::Fixed && on(whole))
            || (job.tiles.borders == Borders::Regular && on(rect));
        border += u64::from(starts_there && (at.row % side != 0 || at.col % side != 0));
    }
    (points, border)
}

/// Triangles by their corners, smallest corner first.
type Parts = BTreeMap<ModuleId, Vec<[ModuleVertex; 3]>>;

/// Load modules of a tile that are not their part of its TIN, with constrained edges.
fn differing_parts(area: &GamingArea, tile: TileId, tin: &TileTin, modules: &Modules) -> Vec<String> {
    let mut parts = match parts_of(area, tin) {
        Ok(parts) => parts,
        Err(what) => return vec![format!("tiles/{tile}.tin: {what}")],
    };
    let mut problems = Vec::new();
    for module in area.tiling.modules(tile, area.grid).iter().filter_map(|id| modules.get(&id)) {
        let mut part = parts.remove(&module.id).unwrap_or_default();
        part.sort_unstable();
        if !is_part(&module, &part) {
            problems.push(format!(
                "load module {}: its triangles are not those of its tile's TIN, tiles/{tile}.tin",
                module.id
            ));
        }
    }
    problems
}

/// Whether a load module has the triangles of its tile's TIN; in place of those that stand above a deck others may be,
/// with vertices on it, that have the same outline.
fn is_part(module: &LoadModule, part: &[[ModuleVertex; 3]]) -> bool {
    let corners = |triangle: &[u16; 3]| triangle.map(|corner| module.vertices[usize::from(corner)]);
    let own: Vec<[ModuleVertex; 3]> = module.triangles.iter().map(corners).collect();
    let without = |all: &[[ModuleVertex; 3]], others: &[[ModuleVertex; 3]]| -> Vec<[ModuleVertex; 3]> {
        all.iter().filter(|triangle| others.binary_search(triangle).is_err()).copied().collect()
    };
    let (gone, added) = (without(part, &own), without(&own, part));
    let decks: Vec<[ModuleVertex; 3]> = module
        .decks
        .triangles
        .iter()
        .map(|deck| deck.map(|corner| module.decks.vertices[usize::from(corner)]))
        .collect();
    let is_lowered = |vertex: &ModuleVertex| {
        let above =
            |of: &[ModuleVertex; 3]| height_at(of, *vertex).is_some_and(|height| f64::from(vertex.z) <= height + 1.0);
        gone.iter().any(above) && decks.iter().any(|deck| height_at(deck, *vertex).is_some())
    };
    let was_there = |vertex: &ModuleVertex| gone.iter().flatten().any(|other| other == vertex);
    outline(&gone) == outline(&added) && added.iter().flatten().all(|vertex| was_there(vertex) || is_lowered(vertex))
}

/// The edges that triangles have on one side only, from corner to corner.
fn outline(triangles: &[[ModuleVertex; 3]]) -> BTreeSet<[ModuleVertex; 2]> {
    let edges: BTreeSet<[ModuleVertex; 2]> = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    edges.iter().copied().filter(|&[from, to]| !edges.contains(&[to, from])).collect()
}

/// The height of a triangle at a place; `None` beside it.
pub(super) fn height_at(triangle: &[ModuleVertex; 3], place: ModuleVertex) -> Option<f64> {
    /// Quanta beside an edge at which a place that was rounded counts as on it.
    const ROUNDED: f64 = 1.5;
    let along = |from: ModuleVertex, to: ModuleVertex| {
        [[from.x, to.x], [from.y, to.y]].map(|[from, to]| f64::from(to) - f64::from(from))
    };
    let [a, b, c] = *triangle;
    let part = |[from, to]: [ModuleVertex; 2]| {
        let (edge, beside) = (along(from, to), along(from, place));
        let doubled = edge[0] * beside[1] - edge[1] * beside[0];
        (-ROUNDED * edge[0].hypot(edge[1]) <= doubled).then_some(doubled)
    };
    let [Some(of_a), Some(of_b), Some(of_c)] = [[b, c], [c, a], [a, b]].map(part) else { return None };
    let sum = of_a * f64::from(a.z) + of_b * f64::from(b.z) + of_c * f64::from(c.z);
    Some(sum / (of_a + of_b + of_c))
}

fn parts_of(area: &GamingArea, tin: &TileTin) -> Result<Parts, String> {
    let steps = tin.tin.steps_per_post;
    let side = area.grid.side_cells * steps;
    let step = i64::from(area.frame.spacing.quanta_per_post() / steps);
    let mut parts = Parts::new();
    for (number, triangle) in tin.tin.triangles.iter().enumerate() {
        let corners = triangle.map(|corner| tin.tin.vertices[corner as usize]);
        let module = |of: fn(LatticePoint) -> i32| {
            corners.iter().map(|corner| i64::from(of(corner.at))).sum::<i64>().div_euclid(3 * i64::from(side)) as i32
        };
        let (row, col) = (module(|at| at.row), module(|at| at.col));
        let local = |place: i32, module: i32| u16::try_from(i64::from(place - module * side) * step).ok();
        let vertex = |corner: Vertex| {
            let (y, x) = (local(corner.at.row, row)?, local(corner.at.col, col)?);
            let end = i64::from(side) * step;
            (i64::from(y) <= end && i64::from(x) <= end).then_some(ModuleVertex { y, x, z: corner.height })
        };
        let [Some(a), Some(b), Some(c)] = corners.map(vertex) else {
            return Err(format!("triangle {number} crosses a line between load modules"));
        };
        let first = if a < b && a < c {
            [a, b, c]
        } else if b < c {
            [b, c, a]
        } else {
            [c, a, b]
        };
        parts.entry(ModuleId { row: row as u32, col: col as u32 }).or_default().push(first);
    }
    Ok(parts)
}

/// Load modules of a tile that are not cut from the points of the TINs around.
fn differing_cuts(
    area: &GamingArea,
    tile: TileId,
    heights: JobClipHeights,
    (points, removed): (&BTreeMap<TileId, Vec<Vertex>>, &[Vec<LatticePoint>]),
    modules: &Modules,
) -> Vec<String> {
    let mut near = area.tiling.neighbours(tile);
    near.push(tile);
    let gone: BTreeSet<LatticePoint> =
        near.iter().flat_map(|&other| &removed[area.tiling.index(other)]).copied().collect();
    let all = near.iter().filter_map(|other| points.get(other)).flatten();
    let mut around: Vec<Vertex> = all.filter(|vertex| !gone.contains(&vertex.at)).copied().collect();
    around.sort_unstable();
    around.dedup();
    if let Some(what) = not_to_cut(area, &near, &around) {
        return vec![format!("tiles/{tile}.tin: {what}")];
    }
    let rect = area.tiling.modules(tile, area.grid);
    let layout = Layout { grid: area.grid, modules: rect, spacing: area.frame.spacing };
    // Classes are not compared, and neither are heights that came from the DEM.
    let mask = Importance::uniform(area.tiling.rect(tile), 1);
    let cut = clip(&around, &layout, ClipHeights::Coplanar, &mask);
    let known = cut.iter().filter_map(|expected| Some((modules.get(&expected.id)?, expected)));
    known.filter_map(|(found, expected)| differing_cut(&found, expected, heights)).collect()
}

fn differing_cut(found: &LoadModule, expected: &LoadModule, heights: JobClipHeights) -> Option<String> {
    let id = found.id;
    let is_inner = |v: &ModuleVertex| 0 < v.x && v.x < found.side && 0 < v.y && v.y < found.side;
    let is_same = |(found, expected): (&ModuleVertex, &ModuleVertex)| {
        let is_known = heights == JobClipHeights::Coplanar || is_inner(expected);
        (found.x, found.y) == (expected.x, expected.y) && (found.z == expected.z || !is_known)
    };
    let places =
        found.vertices.len() == expected.vertices.len() && found.vertices.iter().zip(&expected.vertices).all(is_same);
    if !places || found.triangles != expected.triangles {
        return Some(format!("load module {id}: its triangles are not those that the TINs of its tiles give"));
    }
    let (count, polygons) = (found.polygon_count, expected.polygon_count);
    (count != polygons).then(|| format!("load module {id}: {count} polygons, the TINs of its tiles give {polygons}"))
}

/// Why points cannot be cut: they are not such as a build leaves.
fn not_to_cut(area: &GamingArea, near: &[TileId], around: &[Vertex]) -> Option<String> {
    if around.iter().any(|vertex| vertex.at.post().is_none()) {
        return Some("a vertex lies between posts, and edges are clipped".into());
    }
    if around.windows(2).any(|pair| pair[0].at == pair[1].at) {
        return Some("a vertex has another height in a neighbour's TIN".into());
    }
    let known: BTreeSet<LatticePoint> = around.iter().map(|vertex| vertex.at).collect();
    let corners = near.iter().flat_map(|&tile| area.tiling.modules(tile, area.grid).iter());
    let corners = corners.flat_map(|module| area.grid.posts_of(module).corners());
    let is_missing = |corner: terrain::Post| !known.contains(&corner.into());
    corners.into_iter().any(is_missing).then(|| "a corner of a load module is missing".into())
}
