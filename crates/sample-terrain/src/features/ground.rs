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

use super::lattice::{NODES, Node, SIDE, STEP_M, Square, place};
use super::washes::Washes;

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
