//! Heights of rivers and streams: they fall, and lie where most of the DEM along them says.
//!
//! OpenStreetMap draws them downhill, others anyhow, and a few the wrong way round: which way they flow is asked first.
//! Heights lie closest to the ground, by the sum of their distances, while no edge rises; what lies above the fit
//! weighs less than what lies below, since a DEM sees trees and banks rather than water. A lake is one more node, tied
//! to the stations inside it. Then the fit is carved down to its banks, as far as it may be, and pools become slopes:
//! between two steps of a DEM of whole metres a river falls evenly.

use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

use crate::clean::Notes;
use crate::fit::{Problem, Tie, fit, keep_ties};
use crate::flow::Flow;
use crate::forest::{Range, Sample, UNBOUNDED};
use crate::grade::samples_of;
use crate::smooth::filled;
use crate::sweep::Pin;
use crate::{FeatureId, Flaw, Kind, Network, Numbering, Place, Remark, Remedy};

/// Rounds in which loops of rivers are fitted.
const ROUNDS: u64 = 2;

/// What a quantum off the ground weighs, above and below together.
const WEIGHT: i64 = 1000;

/// What a quantum beyond the limits of cut and fill weighs.
const LIMIT_WEIGHT: i64 = 5 * WEIGHT;

/// Water above its lower bank, or a lake off its level, by more than this is told, in quanta: 3 m and 1 m.
const BANK_TOLD: i64 = 3 * 128;
const LAKE_TOLD: i64 = 128;

/// What may be asked of the heights of what flows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FallOptions {
    /// The share of the ground, in thousandths, that lies below a river.
    pub tau: u32,
    /// Quanta by which it is carved down to its banks.
    pub carve_max: i32,
    /// Whether pools of rivers and canals become slopes.
    pub tilt: bool,
    /// Quanta by which it may cut into the ground, beyond which that weighs more.
    pub cut_max: i32,
    /// Quanta by which it may be filled.
    pub fill_max: i32,
}

impl FallOptions {
    /// 35 % below, carved by 2 m, tilted, limits of 10 m.
    pub const USUAL: Self = Self { tau: 350, carve_max: 2 * 128, tilt: true, cut_max: 10 * 128, fill_max: 10 * 128 };
}

/// Heights of a network of ways that flow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fallen {
    /// A height for every node, in quanta.
    pub heights: Vec<i32>,
    /// For every edge, whether water flows from its `b` to its `a`.
    pub turned: Vec<bool>,
    /// The level of each body of still water, in quanta.
    pub levels: Vec<i32>,
    /// For every node, whether it lies level: in still water, or in a circle.
    pub is_level: Vec<bool>,
}

/// What is known of the ground along rivers: one of each for every node.
#[derive(Clone, Copy)]
pub struct Bed<'a> {
    /// The DEM at the node, in quanta.
    pub ground: &'a [Option<i32>],
    /// The middle of the DEM's heights around it.
    pub middle: &'a [Option<i32>],
    /// The lowest of the DEM at the node and one post either side.
    pub lower_bank: &'a [Option<i32>],
}

/// A body of level water in which or along which rivers may run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Still {
    /// The body of water: the number of its first lake.
    pub body: u32,
    /// The first place of its shore.
    pub place: Place,
    /// The feature that it is named by.
    pub id: FeatureId,
    /// Its level in quanta.
    pub level: i32,
    /// Whether its source says so.
    pub is_fixed: bool,
    /// Decimetres of its shore.
    pub shore: i64,
    /// Nodes of rivers in it or at its shore.
    pub nodes: Vec<u32>,
}

/// Lets a network fall: no edge rises by a quantum, a circle lies level, and all nodes of a lake have its level. Nodes
/// that lie in none have the heights of their `pins`, or that of a lower one upstream.
pub fn fall(
    network: &Network,
    bed: Bed,
    still: &[Still],
    pins: &[Pin],
    options: FallOptions,
    remarks: &mut Vec<Remark>,
) -> Fallen {
    let ground = filled(network, bed.ground);
    // Still water says nothing of which way a river runs: where one leaves a lake through a rim, only the rim would.
    let mut flowing = bed.ground.to_vec();
    still.iter().flat_map(|still| &still.nodes).for_each(|&node| flowing[node as usize] = None);
    let turned = orient(network, &flowing, remarks);
    let directed: Vec<(u32, u32)> = network
        .edges
        .iter()
        .zip(&turned)
        .map(|(edge, turned)| if *turned { (edge.b, edge.a) } else { (edge.a, edge.b) })
        .collect();
    let groups = Flow::of(network.nodes.len(), &directed).groups();
    remark_circles(network, &groups, remarks);
    let mut is_level = vec![false; network.nodes.len()];
    groups.iter().filter(|group| 1 < group.len()).flatten().for_each(|node| is_level[*node as usize] = true);
    still.iter().flat_map(|still| &still.nodes).for_each(|node| is_level[*node as usize] = true);

    let is_free = |pin: &&Pin| still.iter().all(|still| !still.nodes.contains(&pin.node));
    let pins: Vec<Pin> = pins.iter().filter(is_free).copied().collect();
    let mut falls = Falls::new(network, &directed, &groups, (still, &pins), bed);
    let fitted = falls.fit_to_ground(&ground, options);
    let carved = falls.carve(&fitted, options.carve_max);
    let mut stays = is_level.clone();
    pins.iter().for_each(|pin| stays[pin.node as usize] = true);
    let heights = if options.tilt { falls.tilt(carved, &stays) } else { carved };
    let (heights, levels) = heights.split_at(network.nodes.len());
    let whole = |heights: &[i64]| heights.iter().map(|height| *height as i32).collect::<Vec<i32>>();
    let fallen = Fallen { heights: whole(heights), turned, levels: whole(levels), is_level };
    remark_banks(network, bed, heights, remarks);
    remark_moved(network, still, levels, remarks);
    fallen
}

/// The problem of heights that fall: nodes of the network, then bodies of still water.
struct Falls<'a> {
    network: &'a Network,
    still: &'a [Still],
    pins: &'a [Pin],
    bed: Bed<'a>,
    problem: Problem,
    /// The ground at nodes whose height is not that of a lake, where it is known.
    own: Vec<Option<i32>>,
}

impl<'a> Falls<'a> {
    fn new(
        network: &'a Network,
        directed: &[(u32, u32)],
        groups: &[Vec<u32>],
        (still, pins): (&'a [Still], &'a [Pin]),
        bed: Bed<'a>,
    ) -> Self {
        let mut group_of = vec![0u32; network.nodes.len()];
        (0..).zip(groups).for_each(|(number, group)| group.iter().for_each(|node| group_of[*node as usize] = number));
        let tie = |&(a, b): &(u32, u32)| {
            let most = if group_of[a as usize] == group_of[b as usize] { 0 } else { UNBOUNDED };
            Tie { a, b, difference: Range { least: 0, most } }
        };
        let mut ties: Vec<Tie> = directed.iter().map(tie).collect();
        let mut own: Vec<Option<i32>> =
            network.nodes.iter().zip(bed.ground).map(|(node, ground)| ground.filter(|_| node.on_ground)).collect();
        for (number, still) in (network.nodes.len() as u32..).zip(still) {
            let level = Range { least: 0, most: 0 };
            ties.extend(still.nodes.iter().map(|&node| Tie { a: number, b: node, difference: level }));
            still.nodes.iter().for_each(|node| own[*node as usize] = None);
        }
        let places = network.nodes.iter().map(|node| node.place).chain(still.iter().map(|still| still.place)).collect();
        let ranges = vec![Range::ALL; network.nodes.len() + still.len()];
        let problem = Problem { places, ties, ranges, ..Problem::default() };
        Self { network, still, pins, bed, problem, own }
    }

    fn fit_to_ground(&mut self, ground: &[i32], options: FallOptions) -> Vec<i64> {
        let tau = i64::from(options.tau);
        let network = self.network;
        let mut samples = samples_of(network, &self.own, tau, WEIGHT - tau);
        let limit = |by: i32| -> Vec<Option<i32>> {
            let of = |(own, middle): (&Option<i32>, &Option<i32>)| own.and(*middle).map(|middle| middle + by);
            self.own.iter().zip(self.bed.middle).map(of).collect()
        };
        samples.extend(samples_of(network, &limit(-options.cut_max), LIMIT_WEIGHT, 0));
        samples.extend(samples_of(network, &limit(options.fill_max), 0, LIMIT_WEIGHT));
        for (node, still) in (network.nodes.len() as u32..).zip(self.still) {
            let (height, weight) = (i64::from(still.level), WEIGHT / 2 * still.shore);
            samples.push(Sample { node, height, below: weight, above: weight });
        }
        let levels = self.still.iter().map(|still| i64::from(still.level));
        self.problem.wishes = ground.iter().map(|height| i64::from(*height)).chain(levels).collect();
        self.problem.samples = samples;
        self.fix();
        fit(&self.problem, ROUNDS)
    }

    /// Holds levels that sources give, and pins. Where two contradict the fall, the upper one stays.
    fn fix(&mut self) {
        let levels = (self.network.nodes.len()..).zip(self.still).filter(|(_, still)| still.is_fixed);
        let levels = levels.map(|(node, still)| (node, i64::from(still.level)));
        let fixed = self.pins.iter().map(|pin| (pin.node as usize, i64::from(pin.height))).chain(levels);
        let mut most = Problem { ranges: vec![Range::ALL; self.problem.places.len()], ..self.problem.clone() };
        fixed.clone().for_each(|(node, height)| most.ranges[node].most = height.min(most.ranges[node].most));
        let most = crate::fit::most(&most);
        for (node, height) in fixed {
            let height = most[node].min(height);
            self.problem.ranges[node] = Range { least: height, most: height };
        }
    }

    /// Lowers heights to their lower banks, by so much at most; lakes stay.
    fn carve(&mut self, fitted: &[i64], carve_max: i32) -> Vec<i64> {
        let network = self.network;
        let key = |(node, own): (usize, &Option<i32>)| {
            let bank = i64::from(self.bed.lower_bank[node].or(*own)?);
            own.and(Some(bank.clamp(fitted[node] - i64::from(carve_max), fitted[node]) as i32))
        };
        let keys: Vec<Option<i32>> = self.own.iter().enumerate().map(key).collect();
        self.problem.samples = samples_of(network, &keys, 1, 1);
        for (node, height) in fitted.iter().enumerate() {
            let least = if node < network.nodes.len() { -UNBOUNDED } else { *height };
            self.problem.ranges[node] = Range { least, most: *height };
        }
        self.hold_pins(fitted);
        let wishes = keys.iter().zip(fitted).map(|(key, fitted)| key.map_or(*fitted, i64::from));
        self.problem.wishes = wishes.chain(fitted[network.nodes.len()..].iter().copied()).collect();
        fit(&self.problem, ROUNDS)
    }

    /// Keeps pinned nodes at their heights.
    fn hold_pins(&mut self, heights: &[i64]) {
        for node in self.pins.iter().map(|pin| pin.node as usize) {
            self.problem.ranges[node] = Range { least: heights[node], most: heights[node] };
        }
    }

    fn tilt(&mut self, mut heights: Vec<i64>, is_level: &[bool]) -> Vec<i64> {
        let count = self.network.nodes.len();
        tilt(self.network, &mut heights[..count], is_level);
        self.problem.ranges[..count].fill(Range::ALL);
        self.hold_pins(&heights);
        keep_ties(&self.problem, heights)
    }
}

fn remark_circles(network: &Network, groups: &[Vec<u32>], remarks: &mut Vec<Remark>) {
    let mut told: BTreeSet<FeatureId> = BTreeSet::new();
    for group in groups.iter().filter(|group| 1 < group.len()) {
        let node = group.iter().min().copied().unwrap_or(0);
        let (_, edge) = network.beside(node)[0];
        let id = network.ways[network.edges[edge as usize].way as usize].id;
        if told.insert(id) {
            let place = network.nodes[node as usize].place;
            Notes { id, lattice: network.lattice, remarks }.write_at(place, Flaw::FlowsInCircle, Remedy::Levelled);
        }
    }
}

/// Writes down, once for each feature, where water stands well above its lower bank.
fn remark_banks(network: &Network, bed: Bed, heights: &[i64], remarks: &mut Vec<Remark>) {
    let mut worst: BTreeMap<u32, (i64, u32)> = BTreeMap::new();
    for edge in (0..network.edges.len() as u32).filter(|edge| network.is_ground(*edge)) {
        let edge = &network.edges[edge as usize];
        let above = |node: u32| bed.lower_bank[node as usize].map(|bank| heights[node as usize] - i64::from(bank));
        let Some(above) = above(edge.a).filter(|above| BANK_TOLD < *above) else { continue };
        let of_way = worst.entry(edge.way).or_insert((above, edge.a));
        *of_way = if of_way.0 < above { (above, edge.a) } else { *of_way };
    }
    for (way, (quanta, node)) in worst {
        let (id, place) = (network.ways[way as usize].id, network.nodes[node as usize].place);
        let flaw = Flaw::BankBelowWater { quanta: quanta as i32 };
        Notes { id, lattice: network.lattice, remarks }.write_at(place, flaw, Remedy::Lifted);
    }
}

fn remark_moved(network: &Network, still: &[Still], levels: &[i64], remarks: &mut Vec<Remark>) {
    for (still, level) in still.iter().zip(levels) {
        let by = level - i64::from(still.level);
        if LAKE_TOLD < by.abs() {
            let (id, flaw) = (still.id, Flaw::RiversMoveLevel { quanta: by as i32 });
            Notes { id, lattice: network.lattice, remarks }.write_at(still.place, flaw, Remedy::RiversFollowed);
        }
    }
}

/// Quanta a station that turning a way has to save: 1 m. Less is noise.
const SAVED_MIN: i64 = terrain::QUANTA_PER_METRE as i64;

/// Which edges flow against the direction of their way. A way is turned round when the sum of distances between its
/// ground and the nearest profile that falls is halved by that, and well beyond noise; where the source is none that
/// draws rivers downstream, the lower end decides, unless that is as clearly wrong. Where there is no ground, as beyond
/// the area, nothing speaks for either.
fn orient(network: &Network, ground: &[Option<i32>], remarks: &mut Vec<Remark>) -> Vec<bool> {
    let mut ways = Vec::new();
    let mut first = 0;
    for edges in network.edges.chunk_by(|a, b| a.way == b.way) {
        let of_way = first..first + edges.len();
        first += edges.len();
        // A closed way has no lower end.
        let nodes = [edges[0].a].into_iter().chain(edges.iter().map(|edge| edge.b));
        let along: Vec<i32> = nodes.filter_map(|node| ground[node as usize]).collect();
        if edges[0].a != edges[edges.len() - 1].b && !along.is_empty() {
            ways.push((of_way, network.ways[edges[0].way as usize].id, Course::of(&along)));
        }
    }
    // OpenStreetMap's rivers are drawn downstream; so are those of a source most of which clearly fall so.
    let mut clear: BTreeMap<u32, [u32; 2]> = BTreeMap::new();
    for (_, id, course) in &ways {
        let [falls, rises] = clear.entry(id.source).or_default();
        *falls += u32::from(course.clearly_falls());
        *rises += u32::from(course.clearly_rises());
    }
    let drawn_downhill = |id: &FeatureId| {
        let [falls, rises] = clear[&id.source];
        id.numbering != Numbering::Row || 4 * rises < falls
    };
    let mut turned = vec![false; network.edges.len()];
    for (of_way, id, course) in ways {
        let drawn_downhill = drawn_downhill(&id);
        let turns = match drawn_downhill || !course.ends_higher {
            true => course.clearly_rises(),
            false => !course.clearly_falls(),
        };
        if !turns {
            continue;
        }
        if drawn_downhill {
            let place = network.nodes[network.edges[of_way.start].a as usize].place;
            Notes { id, lattice: network.lattice, remarks }.write_at(place, Flaw::FlowsUphill, Remedy::TurnedRound);
        }
        turned[of_way].fill(true);
    }
    turned
}

/// What the ground along a way says of its direction.
struct Course {
    stations: i64,
    ends_higher: bool,
    /// Distances between the ground and the nearest profile that falls as it is drawn, and the other way.
    costs: [i64; 2],
}

impl Course {
    fn of(along: &[i32]) -> Self {
        let costs = [cost_of_falling(along.iter().copied()), cost_of_falling(along.iter().rev().copied())];
        Self { stations: along.len() as i64, ends_higher: along.first() < along.last(), costs }
    }

    fn clearly_falls(&self) -> bool {
        self.saves(self.costs[1], self.costs[0])
    }

    fn clearly_rises(&self) -> bool {
        self.saves(self.costs[0], self.costs[1])
    }

    fn saves(&self, from: i64, to: i64) -> bool {
        2 * to < from && SAVED_MIN * self.stations < from - to
    }
}

/// The least sum of distances between values and a sequence that never rises: each value that rises above the lowest
/// so far throws that down, so far as it reaches (the slope trick).
fn cost_of_falling(values: impl Iterator<Item = i32>) -> i64 {
    let (mut lowest, mut cost): (BinaryHeap<std::cmp::Reverse<i64>>, i64) = (BinaryHeap::new(), 0);
    for value in values.map(i64::from) {
        lowest.push(std::cmp::Reverse(value));
        let low = lowest.peek().map_or(value, |low| low.0);
        if low < value {
            cost += value - low;
            lowest.pop();
            lowest.push(std::cmp::Reverse(value));
        }
    }
    cost
}

/// Tilts the pools of rivers and canals through their middles, chain by chain. The ends of chains and nodes that lie
/// level stay as they are.
fn tilt(network: &Network, heights: &mut [i64], is_level: &[bool]) {
    let picked = |edge: u32| network.traits(edge).kind == Kind::River;
    let follows = |node: u32| match network.beside(node) {
        [(_, one), (_, other)] => picked(*one) && picked(*other) && !is_level[node as usize],
        _ => false,
    };
    for (nodes, edges) in network.runs(&picked, &follows) {
        if nodes[0] == nodes[nodes.len() - 1] {
            continue;
        }
        let mut along = vec![0i64];
        for edge in edges {
            along.push(along[along.len() - 1] + i64::from(network.edges[edge as usize].length));
        }
        let values: Vec<i64> = nodes.iter().map(|node| heights[*node as usize]).collect();
        let tilted = tilted(&along, &values);
        for at in 1..nodes.len() - 1 {
            heights[nodes[at] as usize] = tilted[at];
        }
    }
}

/// The values on straight lines through the middles of their pools, and through their ends, rounded down.
fn tilted(along: &[i64], values: &[i64]) -> Vec<i64> {
    let last = values.len() - 1;
    // Twice the way to each knot, and its value.
    let mut knots = vec![(2 * along[0], values[0])];
    let mut from = 0;
    while from <= last {
        let mut to = from;
        while to < last && values[to + 1] == values[from] {
            to += 1;
        }
        if 0 < from && to < last {
            knots.push((along[from] + along[to], values[from]));
        }
        from = to + 1;
    }
    knots.push((2 * along[last], values[last]));
    let mut knot = 0;
    let at = |&place: &i64| {
        while knot + 2 < knots.len() && knots[knot + 1].0 <= 2 * place {
            knot += 1;
        }
        let ((from, value), (to, next)) = (knots[knot], knots[knot + 1]);
        let (run, rise) = (i128::from((to - from).max(1)), i128::from(next - value));
        value + (rise * i128::from(2 * place - from)).div_euclid(run) as i64
    };
    along.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::samples::{network, way};

    /// Lakes are nodes with a level: each level is one lake.
    #[track_caller]
    fn check(network: &Network, ground: &[Option<i32>], lake: &[Option<i32>]) -> (Fallen, Vec<Remark>) {
        check_bed(network, Bed { ground, middle: ground, lower_bank: ground }, lake)
    }

    #[track_caller]
    fn check_bed(network: &Network, bed: Bed, lake: &[Option<i32>]) -> (Fallen, Vec<Remark>) {
        let mut levels: BTreeMap<i32, Vec<u32>> = BTreeMap::new();
        for (node, level) in (0..).zip(lake).filter_map(|(node, level)| Some((node, (*level)?))) {
            levels.entry(level).or_default().push(node);
        }
        let still = |(body, (level, nodes)): (u32, (i32, Vec<u32>))| {
            let place = network.nodes[nodes[0] as usize].place;
            let id = network.ways[0].id;
            Still { body, place, id, level, is_fixed: level % 2 == 0, shore: 1000, nodes }
        };
        let still: Vec<Still> = (0..).zip(levels).map(still).collect();
        let mut remarks = Vec::new();
        let fallen = fall(network, bed, &still, &[], FallOptions::USUAL, &mut remarks);
        for (edge, turned) in network.edges.iter().zip(&fallen.turned) {
            let (from, to) = if *turned { (edge.b, edge.a) } else { (edge.a, edge.b) };
            assert!(fallen.heights[to as usize] <= fallen.heights[from as usize], "an edge rises");
        }
        for (still, level) in still.iter().zip(&fallen.levels) {
            assert!(still.nodes.iter().all(|node| fallen.heights[*node as usize] == *level), "a lake is not level");
        }
        (fallen, remarks)
    }

    fn stream(number: i64, positions: &[(f64, f64)]) -> crate::Source {
        way(number, "waterway=stream", positions)
    }

    #[test]
    fn a_noisy_river_falls_and_a_pit_does_not_drag_down_what_lies_below_it() {
        let noise = |east: f64, _: f64| 200.0 - east + (east * 7919.0 % 13.0) / 3.0;
        let (network, middle, _) = network(vec![stream(1, &[(10.0, 10.0), (90.0, 10.0)])], noise);
        // Two posts wide along the river and one across, so that the middle of nine heights does not have it.
        let in_pit = |place: Place| (30.0..32.0).contains(&network.lattice.posts_of(place)[0]);
        let pit = |(node, height): (&crate::Node, &Option<i32>)| {
            height.map(|height| height - if in_pit(node.place) { 60 * 128 } else { 0 })
        };
        let ground: Vec<Option<i32>> = network.nodes.iter().zip(&middle).map(pit).collect();
        let bed = Bed { ground: &ground, middle: &middle, lower_bank: &ground };
        let (fallen, remarks) = check_bed(&network, bed, &vec![None; ground.len()]);
        assert!(remarks.iter().all(|remark| matches!(remark.flaw, Flaw::BankBelowWater { .. })), "{remarks:?}");
        let far =
            fallen.heights.iter().zip(&ground).filter(|(height, ground)| 8 * 128 < (*height - ground.unwrap()).abs());
        assert_eq!(far.count(), 2, "only the pit is passed over");
    }

    #[test]
    fn pools_become_slopes_where_it_is_asked_for() {
        let steps = |east: f64, _: f64| 100.0 - (east / 10.0).floor();
        let (network, ground, _) = network(vec![way(1, "waterway=river", &[(10.0, 10.0), (60.0, 10.0)])], steps);
        let (fallen, _) = check(&network, &ground, &vec![None; ground.len()]);
        let inside = &fallen.heights[6..45];
        assert!(inside.windows(2).all(|pair| pair[1] < pair[0]), "{inside:?}");
        let level = FallOptions { tilt: false, ..FallOptions::USUAL };
        let bed = Bed { ground: &ground, middle: &ground, lower_bank: &ground };
        let fallen = fall(&network, bed, &[], &[], level, &mut Vec::new());
        assert_eq!(fallen.heights, ground.into_iter().flatten().collect::<Vec<_>>());
    }

    #[test]
    fn levels_that_contradict_the_fall_leave_the_upper_one_where_it_is_and_it_is_said() {
        let (network, ground, _) = network(vec![stream(1, &[(10.0, 10.0), (60.0, 10.0)])], |_, _| 50.0);
        let mut lake = vec![None; ground.len()];
        (lake[5], lake[40]) = (Some(40 * 128), Some(60 * 128));
        let (fallen, remarks) = check(&network, &ground, &lake);
        assert_eq!((fallen.heights[5], fallen.heights[40]), (40 * 128, 40 * 128));
        assert!(remarks.iter().any(|remark| remark.flaw == Flaw::RiversMoveLevel { quanta: -20 * 128 }));
    }

    #[test]
    fn a_river_drawn_uphill_is_turned_round_and_it_is_said() {
        let (network, ground, _) = network(vec![stream(1, &[(10.0, 10.0), (60.0, 10.0)])], |east, _| east);
        let (fallen, remarks) = check(&network, &ground, &vec![None; ground.len()]);
        assert!(fallen.turned.iter().all(|turned| *turned));
        assert_eq!(remarks[0].flaw, Flaw::FlowsUphill);
        assert!(fallen.heights.iter().zip(&ground).all(|(height, ground)| *height == ground.unwrap()));
    }

    #[test]
    fn a_river_that_leaves_a_lake_through_its_rim_leaves_it() {
        // A lake up to 40 m east at 60 m, a rim of 80 m, and a valley beyond; the first line ends on the rim.
        let mut sources = vec![stream(1, &[(10.0, 10.0), (43.0, 10.0)]), stream(2, &[(43.0, 10.0), (90.0, 10.0)])];
        sources.iter_mut().for_each(|source| source.id.numbering = Numbering::Row);
        let ground = |east: f64| match east {
            ..=40.0 => 60.0,
            ..46.0 => 80.0,
            _ => 55.0 - (east - 46.0) / 4.0,
        };
        let (network, ground, _) = network(sources, |east, _| ground(east));
        let east = |node: &crate::network::Node| network.lattice.posts_of(node.place)[0];
        let lake: Vec<Option<i32>> =
            network.nodes.iter().map(|node| (east(node) <= 40.0).then_some(60 * 128)).collect();
        let (fallen, _) = check(&network, &ground, &lake);
        assert!(fallen.turned.iter().all(|turned| !turned));
        assert!(fallen.heights.iter().all(|height| *height <= 60 * 128), "it climbs out of the lake");
    }

    #[test]
    fn a_confluence_has_one_height_below_both_of_its_arms() {
        let sources = vec![
            stream(1, &[(10.0, 10.0), (30.0, 20.0)]),
            stream(2, &[(10.0, 30.0), (30.0, 20.0)]),
            stream(3, &[(30.0, 20.0), (60.0, 20.0)]),
        ];
        let (network, ground, _) = network(sources, |east, north| 90.0 - east + (north - 20.0).abs());
        check(&network, &ground, &vec![None; ground.len()]);
    }

    #[test]
    fn water_in_a_circle_lies_level_and_it_is_said() {
        let ring = [(10.0, 10.0), (30.0, 10.0), (30.0, 30.0), (10.0, 10.0)];
        let (network, ground, _) = network(vec![stream(1, &ring)], |_, north| north);
        let (fallen, remarks) = check(&network, &ground, &vec![None; ground.len()]);
        assert!(fallen.heights.iter().all(|height| *height == fallen.heights[0]));
        assert_eq!(remarks[0].flaw, Flaw::FlowsInCircle);
    }

    #[test]
    fn a_river_enters_a_lake_at_its_level_and_leaves_at_or_below_it() {
        let (network, ground, _) = network(vec![stream(1, &[(10.0, 10.0), (60.0, 10.0)])], |east, _| 100.0 - east);
        let lake: Vec<Option<i32>> = network
            .nodes
            .iter()
            .map(|node| network.lattice.posts_of(node.place)[0])
            .map(|east| (30.0..=40.0).contains(&east).then_some(66 * 128))
            .collect();
        let (fallen, _) = check(&network, &ground, &lake);
        assert!(fallen.heights.iter().zip(&lake).all(|(height, lake)| lake.is_none_or(|level| level == *height)));
    }

    proptest! {
        #[test]
        fn whatever_the_network_no_edge_rises(
            lines in proptest::collection::vec(proptest::collection::vec((10..40i32, 10..40i32), 2..5), 1..8),
            heights in proptest::collection::vec(proptest::option::weighted(0.9, -900..900i32), 50),
            lakes in proptest::collection::vec(proptest::option::weighted(0.1, -900..900i32), 37),
        ) {
            let sources = lines.iter().enumerate().map(|(number, line)| {
                let line: Vec<(f64, f64)> = line.iter().map(|(x, y)| (f64::from(*x), f64::from(*y))).collect();
                stream(number as i64, &line)
            });
            let (network, _, _) = network(sources.collect(), |_, _| 0.0);
            let ground: Vec<_> = (0..network.nodes.len()).map(|node| heights[node % 50]).collect();
            let lake: Vec<_> = (0..network.nodes.len()).map(|node| lakes[node % 37]).collect();
            check(&network, &ground, &lake);
        }
    }

    fn least_cost(values: &[i32], most: i32) -> i64 {
        let Some((first, rest)) = values.split_first() else { return 0 };
        let with = |level: i32| i64::from((first - level).abs()) + least_cost(rest, level);
        (0..=most).map(with).min().unwrap_or(0)
    }

    proptest! {
        #[test]
        fn no_falling_sequence_costs_less(values in proptest::collection::vec(0..5i32, 0..6)) {
            prop_assert_eq!(cost_of_falling(values.iter().copied()), least_cost(&values, 4));
        }
    }

    #[test]
    fn steps_become_one_slope_and_what_is_straight_stays() {
        let along = [0, 10, 20, 30, 40, 50];
        assert_eq!(tilted(&along, &[50, 40, 30, 20, 10, 0]), [50, 40, 30, 20, 10, 0]);
        assert_eq!(tilted(&along, &[80, 60, 60, 20, 20, 0]), [80, 66, 50, 30, 13, 0]);
        assert_eq!(tilted(&along, &[7; 6]), [7; 6]);
    }
}
