//! Lakes: the flat floors of playas as outlines.

use std::collections::BTreeMap;

use crate::playa::Playa;

use super::ground::Ground;
use super::lattice::{NODES, Node, SIDE, STEP_M, cells, place};
use super::line::{self, Place, between};

/// Square metres below which a playa is no lake.
const AREA_M2_MIN: f64 = 60_000.0;

/// The outline of a playa's floor, counter-clockwise, its first place repeated; `None` where it is too small.
pub(super) fn outline(ground: &mut Ground, playa: &Playa) -> Option<Vec<Place>> {
    let depths = Depths::of(ground, playa);
    let ring =
        depths.rings().into_iter().map(|ring| (doubled_area(&ring), ring)).reduce(|a, b| if a.0 < b.0 { b } else { a });
    let (_, ring) = ring.filter(|(doubled, _)| 2.0 * AREA_M2_MIN <= *doubled)?;
    // A ring is smoothed as a line that begins in the middle of a leg, and closed again.
    let start = between(ring[0], ring[1], 0.5);
    let mut open = vec![start];
    open.extend(ring[1..].iter().chain(&[ring[0], start]));
    open.dedup();
    let mut smooth = line::space_out(&line::round_corners(&line::relax(&open, 2), 60.0, 1), 50.0);
    // The closing leg would be taken for a loop.
    smooth.pop();
    smooth = line::without_loops(&smooth);
    smooth.push(smooth[0]);
    (4 <= smooth.len()).then_some(smooth)
}

/// How far the ground lies below a playa's level, at the nodes around it.
struct Depths {
    corner: Node,
    wide: usize,
    metres: Vec<f32>,
}

impl Depths {
    fn of(ground: &mut Ground, playa: &Playa) -> Self {
        let (east_m, north_m) = playa.middle;
        let reach_m = playa.flat_m() + 2.0 * STEP_M;
        let (easts, norths) =
            (cells(east_m - reach_m, east_m + reach_m, 1), cells(north_m - reach_m, north_m + reach_m, 1));
        let higher: Vec<Playa> = ground
            .playas((east_m - reach_m, north_m - reach_m), (2.0 * reach_m, 2.0 * reach_m))
            .into_iter()
            .filter(|other| (playa.level_m, playa.cell) < (other.level_m, other.cell))
            .collect();
        let wide = (easts.end() - easts.start()) as usize + 1;
        let mut squares = BTreeMap::new();
        let mut metres = Vec::new();
        for node in norths.clone().flat_map(|north| easts.clone().map(move |east| (east, north))) {
            let number = (node.0.div_euclid(SIDE), node.1.div_euclid(SIDE));
            let square = squares.entry(number).or_insert_with(|| ground.square(number));
            let raw_m = square.raw_m[node.1.rem_euclid(SIDE) as usize * NODES + node.0.rem_euclid(SIDE) as usize];
            let at = place(node);
            let is_lake =
                playa.is_near(at) && !higher.iter().any(|other| other.is_near(at) && raw_m < other.level_m as f32);
            let depth_m = playa.level_m as f32 - raw_m;
            metres.push(if is_lake { depth_m } else { depth_m.min(-0.5) });
        }
        Self { corner: (*easts.start(), *norths.start()), wide, metres }
    }

    /// All outlines of ground below the level, ground to the left.
    fn rings(&self) -> Vec<Vec<Place>> {
        // One leg in each cell, from the side where the line comes in to where it goes out (marching squares).
        let mut next: BTreeMap<(usize, usize), (usize, usize)> = BTreeMap::new();
        let high = self.metres.len() / self.wide;
        for low in (0..high - 1).flat_map(|row| (0..self.wide - 1).map(move |col| row * self.wide + col)) {
            let corners = [low, low + 1, low + 1 + self.wide, low + self.wide];
            let is_in = corners.map(|at| 0.0 < self.metres[at]);
            let side = |number: usize| {
                let (a, b) = (corners[number], corners[(number + 1) % 4]);
                (a.min(b), a.max(b))
            };
            // Walking round a cell counter-clockwise, the outline leaves where ground begins to be in.
            let begins: Vec<usize> = (0..4).filter(|&number| is_in[number] && !is_in[(number + 1) % 4]).collect();
            for &from in &begins {
                let to = (1..4).map(|by| (from + by) % 4).find(|&to| !is_in[to] && is_in[(to + 1) % 4]);
                // Where two corners across from each other are in, each is cut off alone.
                let to = if begins.len() == 2 { (from + 3) % 4 } else { to.unwrap_or(from) };
                next.insert(side(from), side(to));
            }
        }
        let mut rings = Vec::new();
        while let Some((&start, _)) = next.first_key_value() {
            let (mut ring, mut at) = (Vec::new(), start);
            while let Some(to) = next.remove(&at) {
                ring.push(self.crossing(at));
                at = to;
            }
            rings.push(ring);
        }
        rings
    }

    /// Where the shore crosses the side of a cell.
    fn crossing(&self, (a, b): (usize, usize)) -> Place {
        let node = |at: usize| (self.corner.0 + (at % self.wide) as i64, self.corner.1 + (at / self.wide) as i64);
        let (depth_a, depth_b) = (f64::from(self.metres[a]), f64::from(self.metres[b]));
        between(place(node(a)), place(node(b)), depth_a / (depth_a - depth_b))
    }
}

/// Twice the area of a ring, positive counter-clockwise.
fn doubled_area(ring: &[Place]) -> f64 {
    let legs = ring.iter().zip(ring.iter().cycle().skip(1));
    // Relative to the first place, so that far away no digits are lost.
    let from = |p: &Place| [p[0] - ring[0][0], p[1] - ring[0][1]];
    legs.map(|(a, b)| (from(a), from(b))).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}
