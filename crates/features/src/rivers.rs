//! Heights of rivers and streams: they fall, and lie no higher than their banks.

use std::collections::BTreeSet;

use crate::clean::Notes;
use crate::flow::Flow;
use crate::isotonic::{falling, squares};
use crate::smooth::filled;
use crate::{FeatureId, Flaw, Network, Numbering, Remark, Remedy};

/// Rounds in which reaches agree on the height of the confluences between them.
const ROUNDS: usize = 4;

/// Heights of a network of ways that flow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fallen {
    /// A height for every node, in quanta.
    pub heights: Vec<i32>,
    /// For every edge, whether water flows from its `b` to its `a`.
    pub turned: Vec<bool>,
}

/// What is known of the ground along rivers: one of each for every node.
#[derive(Clone, Copy)]
pub struct Bed<'a> {
    /// The DEM at the node, in quanta.
    pub ground: &'a [Option<i32>],
    /// The lowest of the DEM at the node and one post either side.
    pub lower_bank: &'a [Option<i32>],
    /// The level of the lake in which or at whose shore the node lies.
    pub lake: &'a [Option<i32>],
}

/// Lets a network fall: no edge rises by a quantum, no node stands above its banks, a circle lies level, and a river
/// enters a lake at its level and leaves at or below it.
pub fn fall(network: &Network, bed: Bed, remarks: &mut Vec<Remark>) -> Fallen {
    let ground = filled(network, bed.ground);
    let turned = orient(network, &ground, remarks);
    let directed: Vec<(u32, u32)> = network
        .edges
        .iter()
        .zip(&turned)
        .map(|(edge, turned)| if *turned { (edge.b, edge.a) } else { (edge.a, edge.b) })
        .collect();
    let flow = Flow::of(network.nodes.len(), &directed);
    let groups = flow.groups();
    remark_circles(network, &groups, remarks);
    let mut heights = fitted(network, &directed, &ground);
    for (height, bank) in heights.iter_mut().zip(bed.lower_bank) {
        *height = bank.map_or(*height, |bank| bank.min(*height));
    }
    run_down(&flow, &groups, bed.lake, &mut heights);
    Fallen { heights, turned }
}

/// Which edges flow against the direction of their way: OpenStreetMap draws rivers downhill, others anyhow. A way is
/// turned round when that halves its squares.
fn orient(network: &Network, ground: &[i32], remarks: &mut Vec<Remark>) -> Vec<bool> {
    let mut turned = vec![false; network.edges.len()];
    let mut first = 0;
    for edges in network.edges.chunk_by(|a, b| a.way == b.way) {
        let mut along: Vec<i32> = vec![ground[edges[0].a as usize]];
        along.extend(edges.iter().map(|edge| ground[edge.b as usize]));
        let id = network.ways[edges[0].way as usize].id;
        if edges[0].a == edges[edges.len() - 1].b {
            // A closed way has no lower end.
            first += edges.len();
            continue;
        }
        let uphill = along[0] < along[along.len() - 1];
        let drawn_downhill = id.numbering != Numbering::Row;
        let forth = squares(&along);
        along.reverse();
        let back = squares(&along);
        let turn = if drawn_downhill || !uphill { 2 * back < forth } else { back <= 2 * forth };
        if turn {
            turned[first..first + edges.len()].fill(true);
        }
        if turn && drawn_downhill {
            let place = network.nodes[edges[0].a as usize].place;
            Notes { id, lattice: network.lattice, remarks }.write_at(place, Flaw::FlowsUphill, Remedy::TurnedRound);
        }
        first += edges.len();
    }
    turned
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

/// Falling fits of all reaches. A confluence takes the mean of its reaches, in a bounded number of rounds.
fn fitted(network: &Network, directed: &[(u32, u32)], ground: &[i32]) -> Vec<i32> {
    let mut into = vec![0u8; network.nodes.len()];
    directed.iter().for_each(|(_, to)| into[*to as usize] = into[*to as usize].saturating_add(1));
    let passes = |node: u32| network.beside(node).len() == 2 && into[node as usize] == 1;
    let mut reaches = network.runs(&|_| true, &passes);
    for (nodes, edges) in &mut reaches {
        if directed[edges[0] as usize].0 != nodes[0] {
            nodes.reverse();
        }
    }
    let mut heights = ground.to_vec();
    for _ in 0..ROUNDS {
        let mut sums: Vec<(i64, i64)> = vec![(0, 0); heights.len()];
        let mut next = heights.clone();
        for (nodes, _) in &reaches {
            // Inside a reach the ground is asked again each round; its ends stand where the last round left them.
            let last = nodes.len() - 1;
            let value = |(at, node): (usize, &u32)| {
                if at == 0 || at == last { heights[*node as usize] } else { ground[*node as usize] }
            };
            let values: Vec<i32> = nodes.iter().enumerate().map(value).collect();
            for (at, (&node, fit)) in nodes.iter().zip(falling(&values)).enumerate() {
                if at == 0 || at == last {
                    let sum = &mut sums[node as usize];
                    *sum = (sum.0 + i64::from(fit), sum.1 + 1);
                } else {
                    next[node as usize] = fit;
                }
            }
        }
        for (height, (sum, count)) in next.iter_mut().zip(sums) {
            if 0 < count {
                *height = sum.div_euclid(count) as i32;
            }
        }
        heights = next;
    }
    heights
}

/// Makes heights fall, from source to mouth: none stands above what flows into it, a circle lies at its lowest, and
/// what flows into a lake stands at its level at least.
fn run_down(flow: &Flow, groups: &[Vec<u32>], lake: &[Option<i32>], heights: &mut [i32]) {
    let mut least = vec![i32::MIN; heights.len()];
    for group in groups.iter().rev() {
        let of = |node: &u32| {
            let below = flow.targets(*node).iter().map(|target| least[*target as usize]).max();
            below.unwrap_or(i32::MIN).max(lake[*node as usize].unwrap_or(i32::MIN))
        };
        let needed = group.iter().map(of).max().unwrap_or(i32::MIN);
        group.iter().for_each(|node| least[*node as usize] = needed);
    }
    let mut most = vec![i32::MAX; heights.len()];
    for group in groups {
        let level = group.iter().filter_map(|node| lake[*node as usize]).min();
        let lowest = group.iter().map(|node| heights[*node as usize]).min().unwrap_or(0);
        let needed = group.iter().map(|node| least[*node as usize]).max().unwrap_or(i32::MIN);
        let bound = group.iter().map(|node| most[*node as usize]).min().unwrap_or(i32::MAX);
        let height = level.unwrap_or(lowest.max(needed)).min(bound);
        for &node in group {
            heights[node as usize] = height;
            for &target in flow.targets(node) {
                most[target as usize] = most[target as usize].min(height);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{network, way};
    use proptest::prelude::*;

    #[track_caller]
    fn check(network: &Network, ground: &[Option<i32>], lake: &[Option<i32>]) -> (Fallen, Vec<Remark>) {
        let mut remarks = Vec::new();
        let fallen = fall(network, Bed { ground, lower_bank: ground, lake }, &mut remarks);
        for (edge, turned) in network.edges.iter().zip(&fallen.turned) {
            let (from, to) = if *turned { (edge.b, edge.a) } else { (edge.a, edge.b) };
            assert!(fallen.heights[to as usize] <= fallen.heights[from as usize], "an edge rises");
        }
        (fallen, remarks)
    }

    fn stream(number: i64, positions: &[(f64, f64)]) -> crate::Source {
        way(number, "waterway=stream", positions)
    }

    #[test]
    fn a_noisy_river_falls_and_stands_nowhere_above_its_banks() {
        let noise = |east: f64, _: f64| 100.0 - east + (east * 7919.0 % 13.0) / 3.0;
        let (network, ground, _) = network(vec![stream(1, &[(10.0, 10.0), (60.0, 10.0)])], noise);
        let none = vec![None; ground.len()];
        let (fallen, remarks) = check(&network, &ground, &none);
        assert!(remarks.is_empty());
        assert!(fallen.heights.iter().zip(&ground).all(|(height, ground)| *height <= ground.unwrap()));
    }

    #[test]
    fn a_river_drawn_uphill_is_turned_round_and_it_is_said() {
        let (network, ground, _) = network(vec![stream(1, &[(10.0, 10.0), (60.0, 10.0)])], |east, _| east);
        let (fallen, remarks) = check(&network, &ground, &vec![None; ground.len()]);
        assert!(fallen.turned.iter().all(|turned| *turned));
        assert_eq!(remarks[0].flaw, Flaw::FlowsUphill);
        assert_eq!(fallen.heights, ground.into_iter().flatten().collect::<Vec<_>>());
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
}
