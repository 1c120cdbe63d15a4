//! The lattice that features are laid out on: nodes every 100 m, in squares of 12.8 km; and least-cost paths between
//! nodes that are known by number.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

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

/// Hundredths of a metre on level, open ground.
pub(super) type Cost = u64;

/// Bits for the number of a node: costs keep 40, which are ten million kilometres.
const NODE_BITS: u32 = 24;

/// The cheapest path from `start` to a node that is a goal, both included; of equal ones, that through lower numbers.
///
/// `beside` pushes the neighbours of a node with what it costs to go there.
pub(super) fn least_cost_path(
    count: usize,
    start: usize,
    is_goal: impl Fn(usize) -> bool,
    beside: impl Fn(usize, &mut Vec<(usize, Cost)>),
) -> Option<Vec<usize>> {
    assert!(count <= 1 << NODE_BITS, "{count} nodes have numbers of {NODE_BITS} bits");
    let (mut costs, mut from) = (vec![Cost::MAX; count], vec![usize::MAX; count]);
    let (mut heap, mut neighbours) = (BinaryHeap::new(), Vec::new());
    // Cost and node in one number, which compares fast.
    let entry = |cost: Cost, at: usize| Reverse(cost << NODE_BITS | at as u64);
    costs[start] = 0;
    heap.push(entry(0, start));
    while let Some(Reverse(first)) = heap.pop() {
        let (cost, at) = (first >> NODE_BITS, (first & ((1 << NODE_BITS) - 1)) as usize);
        if costs[at] < cost {
            continue;
        }
        if is_goal(at) {
            let mut path = vec![at];
            while let Some(&before) = path.last().map(|&at| &from[at]).filter(|&&before| before != usize::MAX) {
                path.push(before);
            }
            path.reverse();
            return Some(path);
        }
        neighbours.clear();
        beside(at, &mut neighbours);
        for &(next, step) in &neighbours {
            let next_cost = cost + step;
            if next_cost < costs[next] {
                (costs[next], from[next]) = (next_cost, at);
                heap.push(entry(next_cost, next));
            }
        }
    }
    None
}

/// What a step of `length_m` metres that rises or falls by `rise_m` costs where a grade of `grade` costs as much again
/// as the way itself.
pub(super) fn step_cost(length_m: f64, rise_m: f64, grade: f64) -> f64 {
    let part = rise_m / (length_m * grade);
    100.0 * length_m * (1.0 + part * part)
}
