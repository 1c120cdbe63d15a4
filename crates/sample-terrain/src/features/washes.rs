//! Washes: where water would run, from the canyons to playas, to the floors of basins or on into the next square.
//!
//! Each square of ground is drained alone. Neighbouring squares agree on the gates, the places of their common border
//! through which a wash runs, because both find the same ones: valleys of the ground along the border, open to the
//! side to which the land falls.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::region::Region;

use super::ground::{NODES, Node, SIDE, Square, place};
use super::line::{self, Place};

/// Hundredths of a square kilometre that have to drain to a place before a wash is drawn there.
const DRAWN: u32 = 420;
/// What comes in through a gate: enough that the wash goes on.
const COMES_IN: u32 = 450;
/// Metres below the saddle around it from which on a basin keeps its water.
const BASIN_M: f32 = 7.0;
/// Slope of the land across a border from which on water crosses it.
const SLOPE_MIN: f32 = 0.004;
/// Steps on either side of a gate that are higher.
const VALLEY: usize = 5;
/// Metres by which a valley lies below what is beside it.
const VALLEY_M: f32 = 1.5;
/// No node.
const NONE: u32 = u32::MAX;

/// A stretch of wash between springs, confluences and mouths.
#[derive(Debug)]
pub(super) struct Reach {
    /// Downstream, in metres.
    pub(super) line: Vec<Place>,
    /// Hundredths of a square kilometre that drain to its end.
    pub(super) area: u32,
}

/// The washes of a square.
#[derive(Debug)]
pub(super) struct Washes {
    /// All reaches, in the order of their first nodes.
    pub(super) reaches: Vec<Reach>,
    /// Whether a wash runs through each node.
    pub(super) drawn: Vec<bool>,
}

impl Washes {
    pub(super) fn of(square: &Square, region: &Region, number: (i64, i64)) -> Self {
        let mut out: Vec<usize> = (0..NODES * NODES).filter(|&at| square.is_playa(at)).collect();
        let mut areas = vec![1; NODES * NODES];
        for (at, comes_in) in gates(square, region, number) {
            if comes_in {
                areas[at] = COMES_IN;
            } else {
                out.push(at);
            }
        }
        let lowest = (0..NODES * NODES).filter(|&at| is_inside(at)).reduce(|low, at| {
            if square.height_m[at] < square.height_m[low] { at } else { low }
        });
        out.extend(lowest.filter(|_| out.is_empty()));
        let first = Flow::to(&out, &square.height_m);
        out.extend(first.basins(&square.height_m));
        let flow = Flow::to(&out, &square.height_m);
        for &at in flow.order.iter().rev() {
            if flow.next[at as usize] != NONE {
                areas[flow.next[at as usize] as usize] += areas[at as usize];
            }
        }
        let drawn: Vec<bool> = areas.iter().map(|&area| DRAWN <= area).collect();
        Self { reaches: reaches(&flow, &areas, &drawn, number), drawn }
    }
}

/// The places of a square's border through which washes run, and whether they come in.
fn gates(square: &Square, region: &Region, number: (i64, i64)) -> Vec<(usize, bool)> {
    let last = NODES - 1;
    type Side = (fn(usize) -> usize, usize, f32);
    let sides: [Side; 4] = [
        (|step| step, 1, -1.0),
        (|step| (NODES - 1) * NODES + step, 1, 1.0),
        (|step| step * NODES, 0, -1.0),
        (|step| step * NODES + NODES - 1, 0, 1.0),
    ];
    let mut gates = Vec::new();
    for (at, axis, outward) in sides {
        let height_m = |step: usize| square.height_m[at(step)];
        for step in VALLEY + 1..last - VALLEY {
            let is_valley = (1..=VALLEY).all(|by| {
                height_m(step) <= height_m(step + by) && height_m(step) < height_m(step - by)
            });
            let rises = |by: fn(usize, usize) -> usize| {
                (1..=VALLEY).map(|steps| height_m(by(step, steps))).fold(f32::MIN, f32::max) - height_m(step)
            };
            if !is_valley || rises(|a, b| a + b) < VALLEY_M || rises(|a, b| a - b) < VALLEY_M {
                continue;
            }
            let [east_m, north_m] = place(node_of(at(step), number));
            let fall = -outward * region.slope(east_m, north_m, 800.0)[axis];
            if SLOPE_MIN < fall.abs() && !square.is_playa(at(step)) {
                gates.push((at(step), fall < 0.0));
            }
        }
    }
    gates
}

fn node_of(at: usize, number: (i64, i64)) -> Node {
    (number.0 * SIDE + (at % NODES) as i64, number.1 * SIDE + (at / NODES) as i64)
}

fn is_inside(at: usize) -> bool {
    (1..NODES - 1).contains(&(at % NODES)) && (1..NODES - 1).contains(&(at / NODES))
}

/// The up to eight nodes beside a node.
fn beside(at: usize) -> impl Iterator<Item = usize> {
    let (col, row) = (at % NODES, at / NODES);
    let rows = row.saturating_sub(1)..=(row + 1).min(NODES - 1);
    rows.flat_map(move |row| {
        (col.saturating_sub(1)..=(col + 1).min(NODES - 1)).map(move |col| row * NODES + col)
    })
    .filter(move |&other| other != at)
}

/// Where the water of every node goes: over the lowest saddles to one of the ways out.
struct Flow {
    /// The node each drains to.
    next: Vec<u32>,
    /// Each node after the one it drains to.
    order: Vec<u32>,
    /// Metres that water has to reach before it leaves a node.
    level_m: Vec<f32>,
}

impl Flow {
    /// Floods the ground from the ways out (Barnes, Lehman and Mulla: priority-flood).
    fn to(out: &[usize], height_m: &[f32]) -> Self {
        let count = height_m.len();
        let mut flow = Self { next: vec![NONE; count], order: Vec::with_capacity(count), level_m: vec![0.0; count] };
        let mut is_seen = vec![false; count];
        let mut heap = BinaryHeap::new();
        // Ground lies above 0, where the order of bits is that of heights.
        let key = |level_m: f32| level_m.to_bits();
        for &at in out {
            if !std::mem::replace(&mut is_seen[at], true) {
                flow.level_m[at] = height_m[at];
                heap.push(Reverse((key(height_m[at]), at as u32)));
            }
        }
        while let Some(Reverse((_, at))) = heap.pop() {
            flow.order.push(at);
            for other in beside(at as usize).filter(|&other| !std::mem::replace(&mut is_seen[other], true)) {
                let level_m = height_m[other].max(flow.level_m[at as usize]);
                (flow.next[other], flow.level_m[other]) = (at, level_m);
                heap.push(Reverse((key(level_m), other as u32)));
            }
        }
        flow
    }

    /// The lowest node of each hollow that is deep enough to keep its water.
    fn basins(&self, height_m: &[f32]) -> Vec<usize> {
        let mut is_seen = vec![false; height_m.len()];
        let mut basins = Vec::new();
        for start in self.order.iter().map(|&at| at as usize) {
            let is_under = |at: usize| height_m[at] < self.level_m[at];
            if is_seen[start] || !is_under(start) {
                continue;
            }
            is_seen[start] = true;
            let (mut lowest, mut rest) = (start, vec![start]);
            while let Some(at) = rest.pop() {
                if height_m[at] < height_m[lowest] {
                    lowest = at;
                }
                let more = beside(at).filter(|&other| is_under(other) && !std::mem::replace(&mut is_seen[other], true));
                rest.extend(more);
            }
            if BASIN_M < self.level_m[lowest] - height_m[lowest] {
                basins.push(lowest);
            }
        }
        basins
    }
}

/// The stretches between springs, confluences and mouths.
fn reaches(flow: &Flow, areas: &[u32], drawn: &[bool], number: (i64, i64)) -> Vec<Reach> {
    let next = |at: usize| (flow.next[at] != NONE).then_some(flow.next[at] as usize);
    let mut comes_in = vec![0_u8; drawn.len()];
    for at in (0..drawn.len()).filter(|&at| drawn[at]) {
        if let Some(next) = next(at) {
            comes_in[next] += 1;
        }
    }
    let mut reaches = Vec::new();
    for start in (0..drawn.len()).filter(|&at| drawn[at] && comes_in[at] != 1) {
        let (mut nodes, mut at) = (vec![start], start);
        while let Some(below) = next(at) {
            nodes.push(below);
            at = below;
            if 1 < comes_in[at] {
                break;
            }
        }
        if 2 <= nodes.len() {
            let line: Vec<Place> = nodes.iter().map(|&at| place(node_of(at, number))).collect();
            let line = line::space_out(&line::round_corners(&line::relax(&line, 3), 40.0, 1), 60.0);
            // What drains to a confluence comes from all that meet there.
            let area = areas[nodes[nodes.len() - 2]];
            reaches.push(Reach { line, area });
        }
    }
    reaches
}
