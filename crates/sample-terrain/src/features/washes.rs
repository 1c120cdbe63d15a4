//! Washes: where water would run, from the canyons to playas, to the floors of basins or on into the next square.
//!
//! Each square of ground is drained alone. Neighbouring squares agree on the gates, the places of their common border
//! through which a wash runs, because both find the same ones: valleys of the ground along the border, open to the
//! side to which the land falls.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::noise::Stream;
use crate::region::Region;

use super::lattice::{NODES, Node, SIDE, Square, place};
use super::line::{self, Place};

/// Hundredths of a square kilometre that have to drain to a place before a wash is drawn there.
const DRAWN: u32 = 200;
/// What comes in through a gate that lies in a valley: enough that the wash goes on.
const COMES_IN: u32 = 220;
/// What comes in through another one.
const SEEPS_IN: u32 = 60;
/// Metres below the saddle around it from which on a basin keeps its water.
const BASIN_M: f32 = 8.0;
/// Slope of the land across a border from which on water crosses it.
const SLOPE_MIN: f32 = 0.003;
/// Steps of the border in which there is one gate at most.
const STRETCH: usize = 17;
/// Steps on either side of a valley that are higher.
const VALLEY: usize = 5;
/// Metres by which a valley lies below what is beside it.
const VALLEY_M: f32 = 1.5;
/// How much is added to and taken from heights to make plains uneven, in metres.
const UNEVEN_M: f64 = 2.5;
/// Steps inside the border over which the rim falls, and metres a step.
const RIM: usize = 4;
const RIM_M: f32 = 6.0;
/// Seed layer of uneven ground.
const LAYER: u64 = 62;
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
    pub(super) fn of(square: &Square, region: &Region, seed: u64, number: (i64, i64)) -> Self {
        let gates = gates(square, region, number);
        let height_m = bed_m(square, &gates, seed, number);
        let mut out: Vec<usize> = (0..NODES * NODES).filter(|&at| square.is_playa(at)).collect();
        let mut areas = vec![1; NODES * NODES];
        for gate in &gates {
            match gate.comes_in {
                Some(area) => areas[gate.at] = area,
                None => out.push(gate.at),
            }
        }
        if out.is_empty() {
            let inside = (0..NODES * NODES).filter(|&at| 0 < steps_inside(at));
            out.extend(inside.reduce(|low, at| if height_m[at] < height_m[low] { at } else { low }));
        }
        let mut flow = Flow::to(&out, &height_m);
        let basins = flow.basins(&height_m);
        if !basins.is_empty() {
            out.extend(basins);
            flow = Flow::to(&out, &height_m);
        }
        for &at in flow.order.iter().rev() {
            if flow.next[at as usize] != NONE {
                areas[flow.next[at as usize] as usize] += areas[at as usize];
            }
        }
        let drawn: Vec<bool> = areas.iter().map(|&area| DRAWN <= area).collect();
        Self { reaches: reaches(square, &flow, &areas, &drawn, number), drawn }
    }
}

/// A place of a square's border through which water runs.
struct Gate {
    at: usize,
    /// What comes in; nothing where it goes out.
    comes_in: Option<u32>,
}

/// The gates of a square: in each stretch of its border its lowest place; a wash runs in where that is a valley.
fn gates(square: &Square, region: &Region, number: (i64, i64)) -> Vec<Gate> {
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
        let lowest = |from: usize, to: usize| {
            (from..to).reduce(|low, step| if height_m(step) < height_m(low) { step } else { low }).unwrap_or(from)
        };
        let mut before = 0;
        for from in (STRETCH / 2..NODES - STRETCH).step_by(STRETCH) {
            let step = lowest(from, (from + STRETCH).min(NODES - 1 - VALLEY));
            let [east_m, north_m] = place(node_of(at(step), number));
            let fall = -outward * region.slope(east_m, north_m, 800.0)[axis];
            if fall.abs() < SLOPE_MIN || square.is_playa(at(step)) || step < before + VALLEY {
                continue;
            }
            let rises = |to: usize| height_m(to) - height_m(step);
            // On plains what drains to a stretch of border is a wash; in mountains only a valley has one.
            let is_plain = region.lie(east_m, north_m).bedrock_m() < 0.0;
            let is_valley = lowest(step - VALLEY, step + VALLEY + 1) == step
                && VALLEY_M < (1..=VALLEY).map(|by| rises(step + by)).fold(0.0, f32::max)
                && VALLEY_M < (1..=VALLEY).map(|by| rises(step - by)).fold(0.0, f32::max);
            let comes_in = if is_plain || is_valley { COMES_IN } else { SEEPS_IN };
            gates.push(Gate { at: at(step), comes_in: (fall < 0.0).then_some(comes_in) });
            before = step;
        }
    }
    gates
}

/// The ground as water finds it: a little uneven, so that washes wind on plains, and with a rim along the border
/// between gates, so that they do not run along it.
fn bed_m(square: &Square, gates: &[Gate], seed: u64, number: (i64, i64)) -> Vec<f32> {
    let stream = Stream::new(seed, LAYER);
    let mut bed_m = square.height_m.clone();
    for (at, bed_m) in bed_m.iter_mut().enumerate().filter(|&(at, _)| !square.is_playa(at)) {
        let [east_m, north_m] = place(node_of(at, number));
        *bed_m += (UNEVEN_M * stream.noise(east_m / 610.0, north_m / 610.0)) as f32;
        let near_gate = |gate: &Gate| {
            let (cols, rows) = ((gate.at % NODES).abs_diff(at % NODES), (gate.at / NODES).abs_diff(at / NODES));
            cols.max(rows) <= RIM
        };
        let steps = steps_inside(at);
        if steps < RIM && !gates.iter().any(near_gate) {
            *bed_m += RIM_M * (RIM - steps) as f32;
        }
    }
    bed_m
}

fn node_of(at: usize, number: (i64, i64)) -> Node {
    (number.0 * SIDE + (at % NODES) as i64, number.1 * SIDE + (at / NODES) as i64)
}

/// Steps from a node to the nearest border of its square.
fn steps_inside(at: usize) -> usize {
    let (col, row) = (at % NODES, at / NODES);
    col.min(row).min(NODES - 1 - col).min(NODES - 1 - row)
}

/// The up to eight nodes beside a node.
fn beside(at: usize) -> impl Iterator<Item = usize> {
    let (col, row) = (at % NODES, at / NODES);
    let rows = row.saturating_sub(1)..=(row + 1).min(NODES - 1);
    rows.flat_map(move |row| (col.saturating_sub(1)..=(col + 1).min(NODES - 1)).map(move |col| row * NODES + col))
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
        let entry = |level_m: f32, at: usize| Reverse(u64::from(level_m.to_bits()) << 32 | at as u64);
        for &at in out {
            if !std::mem::replace(&mut is_seen[at], true) {
                flow.level_m[at] = height_m[at];
                heap.push(entry(height_m[at], at));
            }
        }
        while let Some(Reverse(first)) = heap.pop() {
            let at = first as u32;
            flow.order.push(at);
            for other in beside(at as usize).filter(|&other| !std::mem::replace(&mut is_seen[other], true)) {
                let level_m = height_m[other].max(flow.level_m[at as usize]);
                (flow.next[other], flow.level_m[other]) = (at, level_m);
                heap.push(entry(level_m, other));
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
fn reaches(square: &Square, flow: &Flow, areas: &[u32], drawn: &[bool], number: (i64, i64)) -> Vec<Reach> {
    // A wash ends well inside its playa, because the shore is smoothed.
    let deeper = |at: usize| {
        let is_deeper = |&other: &usize| square.is_playa(other) && square.raw_m[other] < square.raw_m[at];
        let deeper = beside(at).filter(is_deeper).filter(|_| drawn[at] && square.is_playa(at));
        deeper.reduce(|low, other| if square.raw_m[other] < square.raw_m[low] { other } else { low })
    };
    let next = |at: usize| if flow.next[at] == NONE { deeper(at) } else { Some(flow.next[at] as usize) };
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
