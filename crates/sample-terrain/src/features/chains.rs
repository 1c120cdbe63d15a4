//! Where exactly a road runs: the cheapest path on nodes 100 m apart in a strip of ground along its chain, smoothed.
//!
//! Every coarse node belongs to the nearest road, so that no two roads look for their way on the same ground and none
//! crosses another; around a junction the ground is shared out by direction.

use std::collections::BTreeMap;

use crate::noise::Stream;

use super::ground::Ground;
use super::lattice::{Cost, NODES, Node, SIDE, STEP_M, least_cost_path, place, step_cost};
use super::line::{self, Place};
use super::roads::{CELL, COARSE, Chain, Class, Roads, WIDE, node_of};

/// Coarse nodes on either side of a road on which it may run.
const STRIP: usize = 2;
/// Metres from its coarse nodes to which a road may come.
pub(super) const REACH_M: f64 = 1_500.0;
/// What it costs to go through a wash, in times of what it does beside it.
const WASH: f32 = 2.5;
/// Slope of the ground up to which a way may be straightened freely.
const EVEN: f64 = 0.05;
/// Coarse nodes ahead to which roads other than tracks point where they run through a junction.
const AHEAD: usize = 4;
/// Seed layer of what ground costs.
const LAYER: u64 = 63;
/// No road.
const NONE: u32 = u32::MAX;

/// The moves from a node: eight to its neighbours, eight between these, as a knight in chess moves.
const MOVES: [(i64, i64); 16] = [
    (1, 0),
    (2, 1),
    (1, 1),
    (1, 2),
    (0, 1),
    (-1, 2),
    (-1, 1),
    (-2, 1),
    (-1, 0),
    (-2, -1),
    (-1, -1),
    (-1, -2),
    (0, -1),
    (1, -2),
    (1, -1),
    (2, -1),
];

/// To which chain each coarse node of a cell belongs.
pub(super) struct Strips {
    cell: (i64, i64),
    owner: Vec<u32>,
    /// At the ends of chains: the chains and the nodes they go to first.
    arms: BTreeMap<usize, Vec<(u32, usize)>>,
}

impl Strips {
    pub(super) fn of(cell: (i64, i64), chains: &[Chain]) -> Self {
        let mut owner = vec![NONE; WIDE * WIDE];
        let mut arms: BTreeMap<usize, Vec<(u32, usize)>> = BTreeMap::new();
        for (number, Chain { nodes, .. }) in chains.iter().enumerate() {
            let last = nodes.len() - 1;
            nodes[1..last].iter().for_each(|&at| owner[at] = number as u32);
            arms.entry(nodes[0]).or_default().push((number as u32, nodes[1]));
            arms.entry(nodes[last]).or_default().push((number as u32, nodes[last - 1]));
        }
        for _ in 0..STRIP {
            let before = owner.clone();
            for at in (0..WIDE * WIDE).filter(|at| before[*at] == NONE && !arms.contains_key(at)) {
                let (col, row) = (at % WIDE, at / WIDE);
                let rows = row.saturating_sub(1)..=(row + 1).min(WIDE - 1);
                let near = rows
                    .flat_map(|row| (col.saturating_sub(1)..=(col + 1).min(WIDE - 1)).map(move |col| row * WIDE + col));
                owner[at] = near.map(|near| before[near]).min().unwrap_or(NONE);
            }
        }
        Self { cell, owner, arms }
    }

    /// The direction in which a chain leaves the node at one of its ends, as steps east and north, where the road runs
    /// on through it into another chain.
    ///
    /// Of all chains that meet there, the two of the highest classes that lie most nearly in line do so.
    fn heading(&self, chains: &[Chain], chain: u32, end: usize) -> Option<[f64; 2]> {
        let arms = self.arms.get(&end)?;
        let (east, north) = node_of(self.cell, end);
        let arm = |&(number, first): &(u32, usize)| {
            let Chain { class, nodes } = &chains[number as usize];
            let ahead = if *class == Class::Track { 1 } else { AHEAD.min(nodes.len() - 1) };
            let is_forward = nodes[0] == end && nodes[1] == first;
            let to = node_of(self.cell, if is_forward { nodes[ahead] } else { nodes[nodes.len() - 1 - ahead] });
            (to.0 - east, to.1 - north)
        };
        let pairs = arms.iter().enumerate().flat_map(|(number, a)| arms[number + 1..].iter().map(move |b| (a, b)));
        let (a, b) = pairs.max_by_key(|(a, b)| {
            let (one, other) = (chains[a.0 as usize].class, chains[b.0 as usize].class);
            let (to_a, to_b) = (arm(a), arm(b));
            let opposed = -(to_a.0 * to_b.0 + to_a.1 * to_b.1);
            (0 < opposed, one.min(other), one.max(other), opposed)
        })?;
        let (to_a, to_b) = (arm(a), arm(b));
        let through = [(to_a.0 - to_b.0) as f64, (to_a.1 - to_b.1) as f64];
        let is_straight = to_a.0 * to_b.0 + to_a.1 * to_b.1 < 0;
        // A chain may begin and end at one node.
        match (is_straight, a.0 == chain, b.0 == chain) {
            (true, true, false) => Some(through),
            (true, false, true) => Some(through.map(|axis| -axis)),
            _ => None,
        }
    }

    /// Whether a chain may use a node of the ground.
    fn may_use(&self, chain: u32, node: Node) -> bool {
        let inside = (node.0 - self.cell.0 * CELL, node.1 - self.cell.1 * CELL);
        if inside.0 <= 0 || inside.1 <= 0 || CELL <= inside.0 || CELL <= inside.1 {
            return false;
        }
        let half = COARSE / 2;
        let at = ((inside.1 + half) / COARSE) as usize * WIDE + ((inside.0 + half) / COARSE) as usize;
        let Some(arms) = self.arms.get(&at) else { return self.owner[at] == chain };
        // Around a junction: the arm that points most nearly to the node.
        let middle = node_of(self.cell, at);
        let (east, north) = (node.0 - middle.0, node.1 - middle.1);
        let nearest = arms.iter().max_by_key(|(number, to)| {
            let to = node_of(self.cell, *to);
            let arm = (to.0 - middle.0, to.1 - middle.1);
            let along = arm.0 * east + arm.1 * north;
            // Diagonal arms are longer by the root of two.
            let is_diagonal = arm.0 * arm.1 != 0;
            (along * if is_diagonal { 707 } else { 1000 }, std::cmp::Reverse(*number))
        });
        (east, north) == (0, 0) || nearest.is_some_and(|(number, _)| *number == chain)
    }
}

/// Ground that one chain may use, as a rectangle of nodes.
struct Strip {
    corner: Node,
    wide: usize,
    /// Metres; not a number where the chain may not go.
    height_m: Vec<f32>,
    /// What it costs there, in times of what it does elsewhere.
    times: Vec<f32>,
}

impl Strip {
    fn of(ground: &mut Ground, strips: &Strips, number: u32, chain: &Chain) -> Self {
        let nodes: Vec<Node> = chain.nodes.iter().map(|&at| node_of(strips.cell, at)).collect();
        let margin = COARSE * (STRIP as i64 + 1);
        let span = |axis: fn(&Node) -> i64| {
            let low = nodes.iter().map(axis).fold(i64::MAX, i64::min);
            low - margin..=nodes.iter().map(axis).fold(i64::MIN, i64::max) + margin
        };
        let (easts, norths) = (span(|node| node.0), span(|node| node.1));
        let wide = (easts.end() - easts.start() + 1) as usize;
        let count = wide * (norths.end() - norths.start() + 1) as usize;
        let (mut height_m, mut times) = (vec![f32::NAN; count], vec![1.0; count]);
        let (stream, uneven) = (Stream::new(ground.seed, LAYER), Style::of(chain.class).uneven);
        let mut squares = BTreeMap::new();
        let all = norths.clone().flat_map(|north| easts.clone().map(move |east| (east, north)));
        for (at, node) in all.enumerate().filter(|(_, node)| strips.may_use(number, *node)) {
            let of = (node.0.div_euclid(SIDE), node.1.div_euclid(SIDE));
            let (square, washes) = squares.entry(of).or_insert_with(|| (ground.square(of), ground.washes(of)));
            let inside = node.1.rem_euclid(SIDE) as usize * NODES + node.0.rem_euclid(SIDE) as usize;
            let is_end = nodes.first() == Some(&node) || nodes.last() == Some(&node);
            if !square.is_playa(inside) || is_end {
                height_m[at] = square.height_m[inside];
                let [east_m, north_m] = place(node);
                let chance = stream.noise(east_m / 1_100.0, north_m / 1_100.0) as f32;
                times[at] = (1.0 + uneven * chance).max(0.5) * if washes.drawn[inside] { WASH } else { 1.0 };
            }
        }
        Self { corner: (*easts.start(), *norths.start()), wide, height_m, times }
    }

    fn at(&self, node: Node) -> usize {
        (node.1 - self.corner.1) as usize * self.wide + (node.0 - self.corner.0) as usize
    }

    /// The cheapest way from one node to another.
    fn path(&self, from: Node, to: Node, style: Style) -> Option<Vec<Node>> {
        let goal = self.at(to);
        let rows = self.height_m.len() / self.wide;
        let path = least_cost_path(
            self.height_m.len(),
            self.at(from),
            |at| at == goal,
            |at, beside| {
                let (col, row) = ((at % self.wide) as i64, (at / self.wide) as i64);
                for (east, north) in MOVES {
                    let (col, row) = (col + east, row + north);
                    if col < 0 || row < 0 || self.wide as i64 <= col || rows as i64 <= row {
                        continue;
                    }
                    let next = row as usize * self.wide + col as usize;
                    if let Some(cost) = self.cost(at, next, (east, north), style) {
                        beside.push((next, cost));
                    }
                }
            },
        )?;
        let node = |at: usize| (self.corner.0 + (at % self.wide) as i64, self.corner.1 + (at / self.wide) as i64);
        Some(path.into_iter().map(node).collect())
    }

    /// Slope of the ground around a node, rise over run; 1 beside ground where the chain may not go.
    fn slope(&self, node: Node) -> f64 {
        let at = self.at(node);
        let rise_m = |by: usize, steps: usize| {
            let beside = [at.wrapping_sub(steps * by), at + steps * by];
            let rises =
                beside.map(|other| self.height_m.get(other).map_or(f32::NAN, |m| (m - self.height_m[at]).abs()));
            if rises.iter().any(|rise| rise.is_nan()) { STEP_M } else { f64::from(rises[0].max(rises[1])) }
        };
        let all = [1, self.wide].into_iter().flat_map(|by| [1, 2].map(|steps| rise_m(by, steps)));
        all.fold(0.0, f64::max) / STEP_M
    }

    fn cost(&self, at: usize, next: usize, (east, north): (i64, i64), style: Style) -> Option<Cost> {
        let (from_m, to_m) = (self.height_m[at], self.height_m[next]);
        if to_m.is_nan() {
            return None;
        }
        let length_m = STEP_M * ((east * east + north * north) as f64).sqrt();
        let mut rises = [f64::from(to_m - from_m), 0.0];
        let mut parts = 1;
        if east.abs() + north.abs() == 3 {
            // The middle of a knight's move lies between two nodes.
            let by = |east: i64, north: i64| at.wrapping_add_signed((north * self.wide as i64 + east) as isize);
            let (a, b) =
                if east.abs() == 2 { ((east / 2, 0), (east / 2, north)) } else { ((0, north / 2), (east, north / 2)) };
            let middle_m = 0.5 * (self.height_m[by(a.0, a.1)] + self.height_m[by(b.0, b.1)]);
            if middle_m.is_nan() {
                return None;
            }
            rises = [f64::from(middle_m - from_m), f64::from(to_m - middle_m)];
            parts = 2;
        }
        let part_m = length_m / parts as f64;
        let mut cost = 0.0;
        for &rise_m in &rises[..parts] {
            let over = (rise_m.abs() / part_m - style.grade_max).max(0.0);
            cost += step_cost(part_m, rise_m, style.grade) * (1.0 + 40.0 * over / style.grade_max);
        }
        Some((cost * f64::from(self.times[next])) as Cost)
    }
}

/// How closely a road follows the ground.
#[derive(Clone, Copy)]
struct Style {
    /// Grade that costs as much as the way itself.
    grade: f64,
    /// Grade above which every step is dear.
    grade_max: f64,
    /// How uneven the cost of open ground is, so that roads wind on plains.
    uneven: f32,
    /// Metres aside by which lattice lines are straightened.
    aside_m: f64,
    /// Metres that corners are cut.
    cut_m: f64,
    /// Metres that it runs straight on both sides of a node at which others join it.
    through_m: f64,
    /// Metres between vertices.
    apart_m: f64,
}

impl Style {
    fn of(class: Class) -> Self {
        match class {
            Class::Primary | Class::Secondary => Self {
                grade: 0.03,
                grade_max: 0.06,
                uneven: 0.2,
                aside_m: 110.0,
                cut_m: 500.0,
                through_m: 220.0,
                apart_m: 40.0,
            },
            Class::Minor => Self {
                grade: 0.05,
                grade_max: 0.10,
                uneven: 0.4,
                aside_m: 45.0,
                cut_m: 150.0,
                through_m: 120.0,
                apart_m: 30.0,
            },
            Class::Track => Self {
                grade: 0.10,
                grade_max: 0.13,
                uneven: 0.5,
                aside_m: 40.0,
                cut_m: 60.0,
                through_m: 60.0,
                apart_m: 15.0,
            },
        }
    }
}

/// The line of a chain, the first and last places at its end nodes.
pub(super) fn lay(ground: &mut Ground, strips: &Strips, chains: &[Chain], number: usize) -> Vec<Place> {
    let chain = &chains[number];
    let style = Style::of(chain.class);
    let strip = Strip::of(ground, strips, number as u32, chain);
    let ends = [chain.nodes[0], chain.nodes[chain.nodes.len() - 1]];
    // Through a gate the way runs straight.
    let is_long = 4 < chain.nodes.len();
    let [first, last] = ends.map(|end| usize::from(is_long && Roads::is_gate(end)));
    let inner = &chain.nodes[first..chain.nodes.len() - last];
    let nodes: Vec<Node> = inner.iter().map(|&at| node_of(strips.cell, at)).collect();
    let path = strip.path(nodes[0], nodes[nodes.len() - 1], style).unwrap_or(nodes);
    // On steep ground a way keeps closely to where it was found.
    let aside_m = |node: Node| style.aside_m * (EVEN / strip.slope(node).max(EVEN)).max(0.15);
    let mut line: Vec<(Place, f64)> = path.into_iter().map(|node| (place(node), aside_m(node))).collect();
    let mut tips = [None, None];
    for (tip, end) in tips.iter_mut().zip(ends) {
        line.reverse();
        let at = place(node_of(strips.cell, end));
        if let Some(heading) = strips.heading(chains, number as u32, end) {
            lead(&mut line, at, heading, style.through_m);
        }
        *tip = Some(at).filter(|at| line[line.len() - 1].0 != *at);
    }
    let mut whole: Vec<Place> = tips[0].into_iter().collect();
    let (line, aside_m): (Vec<Place>, Vec<f64>) = line.into_iter().unzip();
    whole.extend(line::thin(&line, &aside_m));
    whole.extend(tips[1]);
    let line = line::round_corners(&whole, style.cut_m, 3);
    line::without_loops(&line::space_out(&line, style.apart_m))
}

/// Leads the end of a line to a place `through_m` metres before `at`, from where it goes straight there.
fn lead(line: &mut Vec<(Place, f64)>, at: Place, heading: [f64; 2], through_m: f64) {
    let is_near = |place: Place| line::distance(place, at) < 1.5 * through_m;
    let Some(last) = line.iter().rposition(|(place, _)| !is_near(*place)) else { return };
    line.truncate(last + 1);
    let share = through_m / line::distance([0.0; 2], heading);
    line.push(([at[0] + share * heading[0], at[1] + share * heading[1]], f64::MAX));
}
