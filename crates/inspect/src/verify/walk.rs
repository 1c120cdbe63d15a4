//! Every load module on its own and beside its neighbours, at every level, and what they add up to: one walk over the
//! area from the south, row by row, each row against the next.

use std::collections::{BTreeMap, BTreeSet};

use build::ground::GamingArea;
use fidelity::DeckFigures;
use job::{Edges, Job, LodBorder};
use terrain::limits::{polygons_of, triangles_of};
use terrain::{LoadModule, ModuleId, Side, TileId};

use super::figures::impossible;
use super::modules::{Modules, at_level, unknown_class};
use super::total::LevelSums;
use crate::recount::{RowSides, cracks, cracks_between};

/// What a walk found.
pub(crate) struct Walked {
    /// What is wrong with load modules and between them, level by level.
    pub problems: Vec<String>,
    /// Classes that the job does not have, tile by tile.
    pub unknown: Vec<Vec<String>>,
    /// Statistics that no residuals have, and then polygons that cannot be, level by level.
    pub figures: Vec<String>,
    /// What limits count, for each load module of the area.
    pub counts: Vec<u32>,
    /// Triangles of decks of each load module that has some.
    pub decks: BTreeMap<ModuleId, u32>,
    /// Sums of each level.
    pub sums: Vec<LevelSums>,
}

/// What is found at one level.
#[derive(Default)]
struct OfLevel {
    own: Vec<String>,
    unsound: Vec<String>,
    cracks: Vec<String>,
    coarser: Vec<String>,
    impossible: Vec<String>,
    polygons: Vec<String>,
    sums: LevelSums,
}

/// Walks over all levels of an area.
pub(crate) fn walk(job: &Job, area: &GamingArea, levels: &[Modules]) -> Walked {
    let (grid, classes) = (area.grid, job.class_names().len());
    let mut found: Vec<OfLevel> = levels.iter().map(|_| OfLevel::default()).collect();
    let (mut counts, mut decks, mut unknown) = (Vec::with_capacity(grid.count()), BTreeMap::new(), Vec::new());
    let mut between: BTreeMap<[usize; 2], Vec<String>> = BTreeMap::new();
    let mut sides = sides_of(levels, area, 0, &mut found);
    for tiles in area.tiles.chunk_by(|one, other| one.row == other.row) {
        unknown.extend(tiles.iter().map(|&tile| unknown_in(levels, tile, classes)));
        let rows = area.tiling.modules(tiles[0], grid);
        for row in rows.south..rows.north {
            for id in (0..grid.cols).map(|col| ModuleId { row, col }) {
                let finest = levels[0].get(&id);
                counts.push(finest.as_ref().map_or(0, |module| job.counted(module)));
                decks.extend(
                    finest.filter(|module| !module.decks.is_empty()).map(|of| (id, of.decks.triangles.len() as u32)),
                );
                (0..levels.len()).for_each(|level| found[level].look((job, area), levels, (level, id)));
            }
            let above = sides_of(levels, area, row + 1, &mut found);
            for (here, of) in found.iter_mut().enumerate() {
                of.cracks.extend(cracks(row, &sides[here], &above[here]));
                let others = (0..levels.len()).filter(|&there| there != here && job.lod.border == LodBorder::Full);
                for there in others {
                    let told = cracks_between(row, (here, &sides[here]), (there, [&sides[there], &above[there]]));
                    between.entry([here, there]).or_default().extend(told);
                }
            }
            sides = above;
        }
    }
    let mut problems = Vec::new();
    let (found_count, expected) = (levels.len(), job.lod.level_count());
    if expected < found_count {
        problems.push(format!("load modules: {found_count} levels in a file, the job has {expected}"));
    }
    let mut figures: [Vec<String>; 2] = Default::default();
    let mut sums = Vec::new();
    for (level, of) in found.into_iter().enumerate() {
        let own = of.own.into_iter().chain(of.unsound).chain(of.cracks);
        problems.extend(own.map(|problem| at_level(level, problem)).chain(of.coarser));
        figures[0].extend(of.impossible);
        figures[1].extend(of.polygons);
        sums.push(of.sums);
    }
    if problems.is_empty() {
        problems.extend(between.into_values().flatten());
    }
    Walked { problems, unknown, figures: figures.concat(), counts, decks, sums }
}

/// The edges on the sides of a row of all levels; what is unsound is told.
fn sides_of(levels: &[Modules], area: &GamingArea, row: u32, found: &mut [OfLevel]) -> Vec<RowSides> {
    let of_level =
        |(modules, of): (&Modules, &mut OfLevel)| RowSides::of(area.grid, row, |id| modules.get(id), &mut of.unsound);
    levels.iter().zip(found).map(of_level).collect()
}

fn unknown_in(levels: &[Modules], tile: TileId, classes: usize) -> Vec<String> {
    let of_level = |(level, modules): (usize, &Modules)| {
        let told = modules.of_tile(tile).into_iter().filter_map(move |module| unknown_class(level, &module, classes));
        told.collect::<Vec<_>>()
    };
    levels.iter().enumerate().flat_map(of_level).collect()
}

impl OfLevel {
    /// Looks at a load module, and at the sides that it shares with those in the east and in the north.
    fn look(&mut self, (job, area): (&Job, &GamingArea), levels: &[Modules], (level, id): (usize, ModuleId)) {
        let modules = &levels[level];
        let Some(module) = modules.get(&id) else {
            self.own.push(format!("load module {id}: missing"));
            return;
        };
        // The reader has passed it; this opinion shares no code with it.
        let fault = module.check().err();
        if fault.is_none() {
            self.sums.decks.merge(&DeckFigures::of(&module));
        }
        self.own.extend(fault.map(|fault| format!("load module {id}: {fault}")));
        self.own.extend(check_identities(&module));
        let east = modules.get(&ModuleId { col: id.col + 1, ..id });
        let north = modules.get(&ModuleId { row: id.row + 1, ..id });
        for (other, side) in [(east, Side::East), (north, Side::North)] {
            if other.is_some_and(|other| side_of(&module, side) != side_of(&other, side.opposite())) {
                self.own.push(format!(
                    "load module {id}: its {} side differs from its neighbour's: a crack",
                    if side == Side::East { "eastern" } else { "northern" }
                ));
            }
        }
        let finer = level.checked_sub(1).map(|finer| levels[finer].get(&id));
        self.coarser.extend(finer.and_then(|finer| has_new_place(level, &module, finer.as_deref())));
        self.impossible.extend(impossible(area, &module));
        self.polygons.extend(check_polygons(job, level, &module));
        self.sums.add(area.grid, &module);
    }
}

/// A place of a coarser level that the finer one lacks.
fn has_new_place(level: usize, module: &LoadModule, finer: Option<&LoadModule>) -> Option<String> {
    let known: BTreeSet<(u16, u16)> = finer.into_iter().flat_map(|finer| &finer.vertices).map(|v| (v.y, v.x)).collect();
    let is_new = module.vertices.iter().any(|v| !known.contains(&(v.y, v.x)));
    is_new.then(|| format!("level {level}: load module {}: a vertex that the finer level has not", module.id))
}

/// Polygons of a load module that nothing cut: every triangle is one.
fn check_polygons(job: &Job, level: usize, module: &LoadModule) -> Option<String> {
    let (id, polygons, triangles) = (module.id, module.polygon_count, module.triangles.len());
    let is_cut = level == 0 && job.modules.edges != Edges::Constrained;
    let text = || format!("load module {id}: {polygons} polygons, and each of its {triangles} triangles is one");
    (!is_cut && polygons as usize != triangles).then(|| at_level(level, text()))
}

/// Both identities of every load module, from edges counted anew.
fn check_identities(module: &LoadModule) -> Option<String> {
    let border = module.border_vertex_count();
    let inner = module.vertices.len() - border;
    let triangles = module.triangles.len();
    let expected = triangles_of(inner, border);
    if triangles != expected {
        return Some(format!("load module {}: {triangles} triangles, expected {expected}", module.id));
    }
    // Every triangle has three edges; those inside the square are shared by two.
    let inner_edges = (3 * triangles - border) / 2;
    let polygons = polygons_of(inner, inner_edges);
    let count = module.polygon_count as usize;
    (polygons < count).then(|| format!("load module {}: {count} polygons, expected at most {polygons}", module.id))
}

/// What a load module holds on a side: place along it and height.
fn side_of(module: &LoadModule, side: Side) -> Vec<(u16, i32)> {
    let vertices = module.side_vertices(side).into_iter().map(|index| module.vertices[usize::from(index)]);
    let along = |vertex: terrain::ModuleVertex| match side {
        Side::South | Side::North => (vertex.x, vertex.z),
        Side::East | Side::West => (vertex.y, vertex.z),
    };
    vertices.map(along).collect()
}
