//! The ground that features are laid out on: heights every 100 m, without the finest gullies, square by square.
//!
//! Each square is prepared once for all features that are asked for together; which squares are prepared decides
//! nothing but the time.

use std::collections::BTreeMap;
use std::rc::Rc;

use crate::drainage::Posts;
use crate::patch::Block;
use crate::playa::{Playa, RADIUS_M_MAX};
use crate::region::Region;

use super::washes::Washes;

/// Metres from the terrain's origin, east and north, to the corner of the lattice: a sample area at the origin then
/// lies well inside one cell of roads.
const CORNER_M: f64 = -6_400.0;
/// Metres between nodes.
pub(super) const STEP_M: f64 = 100.0;
/// Steps a side of a square.
pub(super) const SIDE: i64 = 128;
/// Nodes a side of a square, those of all four borders included.
pub(super) const NODES: usize = SIDE as usize + 1;

/// A node of the lattice: steps east and north of its corner.
pub(super) type Node = (i64, i64);

/// Where a node lies, in metres from the terrain's origin.
pub(super) fn place((east, north): Node) -> [f64; 2] {
    [CORNER_M + east as f64 * STEP_M, CORNER_M + north as f64 * STEP_M]
}

/// The numbers of the cells of `side` steps that a span of metres touches.
pub(super) fn cells(from_m: f64, to_m: f64, side: i64) -> std::ops::RangeInclusive<i64> {
    let cell = |place_m: f64| ((place_m - CORNER_M) / (STEP_M * side as f64)).floor() as i64;
    cell(from_m)..=cell(to_m)
}

/// A square of ground.
#[derive(Debug)]
pub(super) struct Square {
    /// Metres at its nodes before playas are filled, row-major from the south-west.
    pub(super) raw_m: Vec<f32>,
    /// Metres at its nodes.
    pub(super) height_m: Vec<f32>,
}

impl Square {
    /// Whether a node lies in a playa.
    pub(super) fn is_playa(&self, at: usize) -> bool {
        self.raw_m[at] < self.height_m[at]
    }
}

/// Ground and washes, prepared as they are asked for.
pub(super) struct Ground {
    pub(super) seed: u64,
    pub(super) region: Region,
    squares: BTreeMap<Node, Rc<Square>>,
    washes: BTreeMap<Node, Rc<Washes>>,
    playas: BTreeMap<Node, Option<Playa>>,
}

impl Ground {
    pub(super) fn new(seed: u64) -> Self {
        let (squares, washes, playas) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        Self { seed, region: Region::new(seed), squares, washes, playas }
    }

    /// The square with the given number, east and north.
    pub(super) fn square(&mut self, number: (i64, i64)) -> Rc<Square> {
        if let Some(square) = self.squares.get(&number) {
            return square.clone();
        }
        let [east_m, north_m] = place((number.0 * SIDE, number.1 * SIDE));
        let side_m = SIDE as f64 * STEP_M;
        let block = Block::rough(self.seed, &self.region, (east_m, north_m), side_m);
        let places: Vec<f32> = (0..NODES).map(|step| step as f32 * STEP_M as f32).collect();
        let raw_m = block.heights_m(Posts { east_m: &places, north_m: &places, spacing_m: STEP_M as f32 });
        let mut height_m = raw_m.clone();
        for playa in self.playas((east_m, north_m), (side_m, side_m)) {
            for (at, height_m) in height_m.iter_mut().enumerate() {
                let step = ((at % NODES) as i64, (at / NODES) as i64);
                if playa.is_near(place((number.0 * SIDE + step.0, number.1 * SIDE + step.1))) {
                    *height_m = height_m.max(playa.level_m as f32);
                }
            }
        }
        let square = Rc::new(Square { raw_m, height_m });
        self.squares.insert(number, square.clone());
        square
    }

    /// The washes of a square.
    pub(super) fn washes(&mut self, number: (i64, i64)) -> Rc<Washes> {
        if let Some(washes) = self.washes.get(&number) {
            return washes.clone();
        }
        let square = self.square(number);
        let washes = Rc::new(Washes::of(&square, &self.region, self.seed, number));
        self.washes.insert(number, washes.clone());
        washes
    }

    /// Playas that reach into a rectangle of ground, each once: those whose middle another, higher one covers are not
    /// seen.
    pub(super) fn playas(&mut self, corner_m: (f64, f64), size_m: (f64, f64)) -> Vec<Playa> {
        let stream = Playa::stream(self.seed);
        let found: Vec<Playa> = Playa::cells(corner_m, size_m, RADIUS_M_MAX)
            .filter_map(|cell| *self.playas.entry(cell).or_insert_with(|| Playa::find(&self.region, stream, cell)))
            .collect();
        let covers = |other: &Playa, playa: &Playa| {
            let rank = |playa: &Playa| (playa.level_m, playa.cell);
            rank(playa) < rank(other) && other.is_near([playa.middle.0, playa.middle.1])
        };
        let reaches = |playa: &Playa| {
            let beyond = |place: f64, from: f64, size: f64| (from - place).max(place - from - size).max(0.0);
            let beyond_m = (beyond(playa.middle.0, corner_m.0, size_m.0), beyond(playa.middle.1, corner_m.1, size_m.1));
            beyond_m.0.max(beyond_m.1) < playa.flat_m()
        };
        let seen = |playa: &&Playa| reaches(playa) && !found.iter().any(|other| covers(other, playa));
        found.iter().filter(seen).copied().collect()
    }
}
