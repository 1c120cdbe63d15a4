//! Heights of vertices against the posts around them, at every level.

use std::collections::HashSet;

use build::ALGORITHM_REVISION;
use build::ground::{GamingArea, Ground, GroundError, Window};
use fidelity::Bodies;
use job::{Edges, Job};
use terrain::geometry::height_bounds;
use terrain::{
    Dem, LATTICE_PER_POST, LatticePoint, LoadModule, ModuleId, ModuleVertex, TileFeatures, metres_of_quanta,
};

use super::tins::height_at;

/// The first revision whose vertices keep within the bounds.
const BOUNDED_SINCE: u32 = 10;
/// Posts around a tile that bound its vertices.
const HALO: i32 = 2;
const _: () = assert!(BOUNDED_SINCE <= ALGORITHM_REVISION);

/// North and east of the area's corner, in quanta.
type Place = (i64, i64);

/// Vertices that stand higher or lower than the posts around them permit.
#[derive(Default)]
pub(super) struct Beyond {
    count: u64,
    worst: Option<Worst>,
    held: u64,
}

struct Worst {
    quanta: i64,
    level: usize,
    module: ModuleId,
}

impl Beyond {
    /// Judges the load modules that a level has in a tile.
    pub fn add(&mut self, level: usize, modules: &[LoadModule], around: &Around<'_>) {
        for module in modules {
            for vertex in module.vertices.iter().filter(|vertex| !around.is_exempt(module, vertex)) {
                let (low, high) = around.bounds(module, vertex);
                let quanta = i64::from(low - vertex.z).max(i64::from(vertex.z - high));
                self.held += u64::from(quanta == 0);
                self.count += u64::from(0 < quanta);
                if 0 < quanta && self.worst.as_ref().is_none_or(|worst| worst.quanta < quanta) {
                    self.worst = Some(Worst { quanta, level, module: module.id });
                }
            }
        }
    }

    /// Vertices, in each load module and level that has them, that stand exactly at a bound.
    pub fn held(&self) -> u64 {
        self.held
    }

    /// What is wrong, or cannot be asked of a database of such a revision.
    pub fn told(&self, revision: u32) -> (Option<String>, Option<String>) {
        let Some(Worst { quanta, level, module }) = self.worst else { return (None, None) };
        let (count, metres) = (self.count, metres_of_quanta(quanta as i32));
        let found = format!(
            "heights: {count} vertices stand outside the posts around them by more than 1 m and a tenth of their range,\
            \x20the worst by {metres:.2} m more, in load module {module} at level {level}"
        );
        if BOUNDED_SINCE <= revision {
            return (Some(found), None);
        }
        (None, Some(format!("{found}; algorithm revision {revision} did not keep them back, build again")))
    }
}

/// What bounds the vertices of a tile, and which of them it does not.
pub(super) struct Around<'a> {
    dem: Dem,
    side: i64,
    quanta_per_post: i64,
    /// Places of features, and of points whose heights the job gives.
    given: HashSet<Place>,
    bodies: Bodies<'a>,
    is_clipped: bool,
}

impl<'a> Around<'a> {
    /// Of a tile with this window and these features.
    pub fn of(
        ground: &Ground,
        (job, area): (&Job, &GamingArea),
        (window, features): (&Window, &'a TileFeatures),
    ) -> Result<Self, GroundError> {
        let quanta_per_post = i64::from(area.frame.spacing.quanta_per_post());
        let place = |row: i32, col: i32, steps: i32| {
            let quanta = |at: i32| i64::from(at) * quanta_per_post / i64::from(steps);
            (quanta(row), quanta(col))
        };
        let kept = &features.kept;
        let of_features = kept.vertices.iter().map(|vertex| place(vertex.at.row, vertex.at.col, kept.steps_per_post));
        let given = window.given.iter().filter(|given| given.height.is_some());
        Ok(Self {
            dem: ground.around(area, features.tile, HALO)?.dem,
            side: i64::from(area.grid.side_cells) * quanta_per_post,
            quanta_per_post,
            given: of_features.chain(given.map(|given| place(given.at.row, given.at.col, 1))).collect(),
            bodies: Bodies::of(features),
            is_clipped: job.modules.edges != Edges::Constrained,
        })
    }

    fn place(&self, module: &LoadModule, vertex: &ModuleVertex) -> Place {
        let at = |index: u32, along: u16| i64::from(index) * self.side + i64::from(along);
        (at(module.id.row, vertex.y), at(module.id.col, vertex.x))
    }

    fn bounds(&self, module: &LoadModule, vertex: &ModuleVertex) -> (i32, i32) {
        height_bounds(&self.dem, self.place(module, vertex), self.quanta_per_post)
    }

    /// Whether something else than the ground decided the height: a feature, water, the job, a deck that the ground was
    /// lowered onto, or the edge of a triangle that a side of the load module cuts.
    fn is_exempt(&self, module: &LoadModule, vertex: &ModuleVertex) -> bool {
        let is_on_side = [vertex.x, vertex.y].iter().any(|&at| at == 0 || at == module.side);
        let place = self.place(module, vertex);
        let step = self.quanta_per_post / i64::from(LATTICE_PER_POST);
        let at = LatticePoint::new((place.0 / step) as i32, (place.1 / step) as i32);
        // On the lattice it is one of the TIN, which no deck moved.
        let is_added = place.0 % step != 0 || place.1 % step != 0;
        let decks = &module.decks;
        let is_below = |deck: &[u16; 3]| {
            let deck = deck.map(|corner| decks.vertices[usize::from(corner)]);
            height_at(&deck, *vertex).is_some_and(|height| f64::from(vertex.z) <= height + 1.0)
        };
        (self.is_clipped && is_on_side)
            || is_added && decks.triangles.iter().any(is_below)
            || self.given.contains(&place)
            || self.bodies.lake_level_in(at, LATTICE_PER_POST).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{Post, PostRect};

    /// A load module of 4 x 4 cells of 8 m with one vertex 12 m east and 20 m north, over ground of 100 m with a step
    /// of 40 m at its eastern side.
    #[track_caller]
    fn check(height_m: i32, given: bool, is_clipped: bool, expected: (u64, u64)) {
        let vertex = ModuleVertex { y: 20 * 128, x: 12 * 128, z: height_m * 128 };
        let module = LoadModule {
            id: ModuleId { row: 0, col: 0 },
            side: 32 * 128,
            vertices: vec![vertex, ModuleVertex { y: 0, x: 12 * 128, z: 0 }],
            ..LoadModule::default()
        };
        let height = |post: Post| if post.col < 3 { 12_800 } else { 12_800 + 40 * 128 };
        let features = TileFeatures::none(terrain::TileId { row: 0, col: 0 });
        let around = Around {
            dem: Dem::from_fn(PostRect::of_size(5, 5), |post| Some(height(post))),
            side: 32 * 128,
            quanta_per_post: 8 * 128,
            given: if given { HashSet::from([(20 * 128, 12 * 128)]) } else { HashSet::new() },
            bodies: Bodies::of(&features),
            is_clipped,
        };
        let mut beyond = Beyond::default();
        beyond.add(0, &[module], &around);
        assert_eq!((beyond.count, beyond.held()), expected);
        assert_eq!(beyond.told(BOUNDED_SINCE).0.is_some(), 0 < expected.0);
        assert_eq!(beyond.told(BOUNDED_SINCE - 1).1.is_some(), 0 < expected.0);
    }

    #[test]
    fn a_vertex_beyond_the_bound_is_told_unless_something_else_gave_its_height() {
        // The vertex on the southern side lies far below.
        check(100, false, false, (1, 0));
        check(144, false, true, (0, 1));
        check(145, false, true, (1, 0));
        check(96, false, true, (0, 1));
        check(95, false, true, (1, 0));
        check(200, true, true, (0, 0));
    }
}
