//! How far heights reach through a network whose edges may rise so much and no more.
//!
//! With c the most a path may rise, A(t) = min over s of h(s) + c(s, t) and B(t) = max over s of h(s) - c(s, t) are
//! the greatest profile below the ground and the least one above it that obey the grades (E. J. McShane, Extension of
//! range of functions, and H. Whitney, Analytic extensions, both 1934). Each is one sweep of a priority queue over the
//! whole network, in whole numbers. Where the one lies above the other, limits and grades contradict.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use crate::clean::Notes;
use crate::{Edge, Flaw, Network, Remark, Remedy, WayOf};

/// A height for every node, the bound that no height reaches.
const NONE: i32 = i32::MAX / 2;

/// Steps in which the grade between contradicting pins is raised: by a quarter each.
const STEEPER_ROUNDS_MAX: usize = 200;

/// So many metres may become steeper than their grade for each that would lie beyond limits of cut and fill otherwise.
const STEEPER_PER_BEYOND: i64 = 8;

/// Lowers heights to the least `start + c` at every node. `reach` names what a node bounds, and by how much more.
pub(crate) fn spread(heights: &mut [i64], reach: &impl Fn(u32, &mut dyn FnMut(u32, i64))) {
    let mut queue: BinaryHeap<Reverse<(i64, u32)>> = BinaryHeap::new();
    // Most nodes bind no neighbour: only those that do begin.
    for node in 0..heights.len() as u32 {
        let (height, mut binds) = (heights[node as usize], false);
        reach(node, &mut |next, more| binds |= height + more < heights[next as usize]);
        if binds {
            queue.push(Reverse((height, node)));
        }
    }
    while let Some(Reverse((height, node))) = queue.pop() {
        if heights[node as usize] < height {
            continue;
        }
        reach(node, &mut |next, more| {
            if height + more < heights[next as usize] {
                heights[next as usize] = height + more;
                queue.push(Reverse((height + more, next)));
            }
        });
    }
}

/// Least `start + c` at every node; [`NONE`] and more where no start is in reach.
pub(crate) fn lowest(network: &Network, costs: &[i32], heights: Vec<i32>) -> Vec<i32> {
    let mut heights: Vec<i64> = heights.into_iter().map(i64::from).collect();
    spread(&mut heights, &|node, reach| {
        let beside = network.beside(node).iter();
        beside.for_each(|&(next, edge)| reach(next, i64::from(costs[edge as usize])));
    });
    heights.into_iter().map(|height| height as i32).collect()
}

/// Greatest `start - c` at every node; minus [`NONE`] where no start is in reach.
pub(crate) fn highest(network: &Network, costs: &[i32], heights: Vec<i32>) -> Vec<i32> {
    let negated = lowest(network, costs, heights.into_iter().map(|height| -height).collect());
    negated.into_iter().map(|height| -height).collect()
}

/// A height that is hard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pin {
    /// The node.
    pub node: u32,
    /// Its height in quanta.
    pub height: i32,
}

/// Heights of a network, and what its edges may rise: more than their grade where limits or pins ask for it.
pub(crate) struct Swept {
    pub heights: Vec<i32>,
    pub costs: Vec<i32>,
    /// The greatest heights that pins allow.
    pub most: Vec<i32>,
}

/// Two pins on one node: the lower one is kept, and it is written down.
pub(crate) fn one_a_node(network: &Network, pins: &[Pin], remarks: &mut Vec<Remark>) -> Vec<Pin> {
    let mut pins = pins.to_vec();
    pins.sort_unstable();
    pins.dedup();
    for pair in pins.windows(2).filter(|pair| pair[0].node == pair[1].node) {
        let (_, edge) = network.beside(pair[0].node)[0];
        let id = network.ways[network.edges[edge as usize].way as usize].id;
        let place = network.nodes[pair[0].node as usize].place;
        Notes { id, lattice: network.lattice, remarks }.write_at(place, Flaw::PinsDisagree, Remedy::OneKept);
    }
    pins.dedup_by_key(|pin| pin.node);
    pins
}

/// The least and the greatest height of each node that pins allow.
pub(crate) fn bounds(network: &Network, costs: &[i32], pins: &[Pin]) -> (Vec<i32>, Vec<i32>) {
    let start = |none: i32| {
        let mut start = vec![none; network.nodes.len()];
        pins.iter().for_each(|pin| start[pin.node as usize] = pin.height);
        start
    };
    (highest(network, costs, start(-NONE)), lowest(network, costs, start(NONE)))
}

/// Raises the grade between pins that contradict one another, a quarter at a time, until they do not.
pub(crate) fn relax_between_pins(network: &Network, costs: &mut [i32], pins: &[Pin]) {
    if pins.is_empty() {
        return;
    }
    for _ in 0..STEEPER_ROUNDS_MAX {
        let (least, most) = bounds(network, costs, pins);
        if !raise_torn(network, costs, (&least, &most)) {
            break;
        }
    }
}

/// Raises the grade where limits of cut and fill contradict it, to `most` of an edge, on no more of a way than that
/// asks for and where the ground is steepest. `limits` are the least and the greatest height of nodes that have any.
///
/// `beyond` are the nodes that lie beyond their limits as long as no grade gives way: where little does for much that
/// would have to become steeper, it stays as it is.
pub(crate) fn relax_within(
    network: &Network,
    costs: &mut [i32],
    limits: &[Option<[i32; 2]>],
    most: &dyn Fn(u32) -> i32,
    beyond: &dyn Fn(u32) -> bool,
) {
    let start = |none: i32, end: usize| limits.iter().map(|limit| limit.map_or(none, |limit| limit[end])).collect();
    let (hard, mut asking) = (costs.to_vec(), None);
    for _ in 0..STEEPER_ROUNDS_MAX {
        let (above, below) = (highest(network, costs, start(-NONE, 0)), lowest(network, costs, start(NONE, 1)));
        let lacks: Vec<i32> = above.iter().zip(&below).map(|(above, below)| above - below).collect();
        let mut part = parts_that_lack(network, &lacks);
        if !raise_steepest(network, costs, (&lacks, &mut part), limits, most) {
            break;
        }
        asking.get_or_insert(part);
    }
    let Some(mut part) = asking else { return };
    let (mut steeper, mut off): (Vec<i64>, Vec<i64>) = (vec![0; part.len()], vec![0; part.len()]);
    for (edge, (cost, hard)) in network.edges.iter().zip(costs.iter().zip(&hard)) {
        steeper[root(&mut part, edge.a) as usize] += if hard < cost { i64::from(edge.length) } else { 0 };
    }
    for node in (0..part.len() as u32).filter(|node| beyond(*node)) {
        let decimetres = network.decimetres_at(node);
        off[root(&mut part, node) as usize] += decimetres * i64::from(terrain::QUANTA_PER_METRE) / 10;
    }
    for (edge, (cost, hard)) in network.edges.iter().zip(costs.iter_mut().zip(hard)) {
        let part = root(&mut part, edge.a) as usize;
        *cost = if steeper[part] <= STEEPER_PER_BEYOND * off[part] { *cost } else { hard };
    }
}

/// The part in which each node stands: what hangs together by edges both ends of which lack height.
fn parts_that_lack(network: &Network, lacks: &[i32]) -> Vec<u32> {
    let mut part: Vec<u32> = (0..lacks.len() as u32).collect();
    for edge in network.edges.iter().filter(|edge| 0 < lack(lacks, edge)) {
        let (a, b) = (root(&mut part, edge.a), root(&mut part, edge.b));
        part[a.max(b) as usize] = a.min(b);
    }
    part
}

/// What both ends of an edge lack at least.
fn lack(lacks: &[i32], edge: &Edge) -> i32 {
    lacks[edge.a as usize].min(lacks[edge.b as usize])
}

/// Raises what edges may rise in each part of a network that lacks height: among those that lack at least half of what
/// most does the steepest, until they make up for it. Whether it did.
fn raise_steepest(
    network: &Network,
    costs: &mut [i32],
    (lacks, part): (&[i32], &mut [u32]),
    limits: &[Option<[i32; 2]>],
    most: &dyn Fn(u32) -> i32,
) -> bool {
    let steepness = |edge: &Edge| {
        let middle = |node: u32| limits[node as usize].map(|[least, most]| i64::from(least) + i64::from(most));
        let rise = middle(edge.a).zip(middle(edge.b)).map_or(0, |(a, b)| (a - b).abs());
        rise * 1_000_000 / i64::from(edge.length.max(1))
    };
    let mut by_part: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (number, edge) in (0u32..).zip(&network.edges) {
        if 0 < lack(lacks, edge) && costs[number as usize] < most(number) {
            by_part.entry(root(part, edge.a)).or_default().push(number);
        }
    }
    let raised = !by_part.is_empty();
    for mut edges in by_part.into_values() {
        let of = |edge: &u32| &network.edges[*edge as usize];
        let deepest = edges.iter().map(|edge| lack(lacks, of(edge))).max().unwrap_or(0);
        edges.retain(|edge| deepest <= 2 * lack(lacks, of(edge)));
        edges.sort_by_key(|edge| (Reverse(steepness(of(edge))), *edge));
        let gains: Vec<i32> = edges.iter().map(|edge| most(*edge) - costs[*edge as usize]).collect();
        // An eighth at least, so that rounds are few where much lies beside what asks for it.
        let mut wanted = (2 * i64::from(deepest)).max(gains.iter().map(|gain| i64::from(*gain)).sum::<i64>() / 8);
        for (edge, gain) in edges.into_iter().zip(gains) {
            if wanted <= 0 {
                break;
            }
            costs[edge as usize] += gain;
            wanted -= i64::from(gain);
        }
    }
    raised
}

/// Raises by a quarter what edges may rise whose ends both have to lie above their greatest height; whether it did.
fn raise_torn(network: &Network, costs: &mut [i32], (least, most): (&[i32], &[i32])) -> bool {
    let torn = |node: u32| most[node as usize] < least[node as usize];
    let mut raised = false;
    let both = |edge: &Edge| torn(edge.a) && torn(edge.b);
    for (cost, _) in costs.iter_mut().zip(&network.edges).filter(|(_, edge)| both(edge)) {
        *cost += (*cost / 4).max(1);
        raised = true;
    }
    raised
}

/// The tree in which a node stands.
pub(crate) fn root(tree: &mut [u32], mut node: u32) -> u32 {
    while tree[node as usize] != node {
        tree[node as usize] = tree[tree[node as usize] as usize];
        node = tree[node as usize];
    }
    node
}

/// Writes down where the greatest grade is exceeded, once for each feature: the worst of it, and its length.
pub(crate) fn remark_steep(network: &Network, heights: &[i32], give: &dyn Fn(u32) -> i32, remarks: &mut Vec<Remark>) {
    // Of each way: the steepest grade with its node, and quanta that are steeper than they may be.
    let mut worst: BTreeMap<u32, (u32, u32, i64)> = BTreeMap::new();
    let mut beyond: std::collections::BTreeSet<u32> = std::collections::BTreeSet::new();
    for (number, edge) in network.edges.iter().enumerate() {
        let rise = (heights[edge.a as usize] - heights[edge.b as usize]).abs();
        if edge.rise_max < rise {
            let grade = (i64::from(rise) * 1_000_000 / i64::from(edge.length.max(1))).min(i64::from(u32::MAX)) as u32;
            let entry = worst.entry(edge.way).or_insert((grade, edge.a, 0));
            *entry = if entry.0 < grade { (grade, edge.a, entry.2) } else { *entry };
            entry.2 += i64::from(edge.length);
            if give(number as u32) < rise {
                beyond.insert(edge.way);
            }
        }
    }
    for (way, (grade_ppm, node, quanta)) in worst {
        let WayOf { id, .. } = network.ways[way as usize];
        let place = network.nodes[node as usize].place;
        let flaw = match beyond.contains(&way) {
            true => Flaw::PinsTooSteep { grade_ppm },
            false => Flaw::GradeRelaxed { grade_ppm, metres: (quanta / i64::from(terrain::QUANTA_PER_METRE)) as u32 },
        };
        Notes { id, lattice: network.lattice, remarks }.write_at(place, flaw, Remedy::GradeExceeded);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{network, way};
    use proptest::prelude::*;

    /// Least rise between any two nodes, by Floyd and Warshall: the slow reference.
    fn all_paths(network: &Network) -> Vec<Vec<i64>> {
        let count = network.nodes.len();
        let mut paths = vec![vec![i64::MAX / 4; count]; count];
        (0..count).for_each(|node| paths[node][node] = 0);
        for edge in &network.edges {
            let (a, b) = (edge.a as usize, edge.b as usize);
            (paths[a][b], paths[b][a]) = (i64::from(edge.rise_max), i64::from(edge.rise_max));
        }
        for by in 0..count {
            for from in 0..count {
                for to in 0..count {
                    paths[from][to] = paths[from][to].min(paths[from][by] + paths[by][to]);
                }
            }
        }
        paths
    }

    fn grid() -> Network {
        let streets = (0..3).map(|n| f64::from(n) * 3.0 + 1.0);
        let across = streets.clone().map(|at| way(at as i64, "highway=primary", &[(1.0, at), (7.0, at)]));
        let along = streets.map(|at| way(10 + at as i64, "highway=track", &[(at, 0.0), (at, 8.5)]));
        network(across.chain(along).collect(), |_, _| 0.0).0
    }

    fn costs(network: &Network) -> Vec<i32> {
        network.edges.iter().map(|edge| edge.rise_max).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn the_sweeps_are_the_best_of_all_paths(
            heights in proptest::collection::vec(proptest::option::weighted(0.9, -2000..2000i32), 64)
        ) {
            let network = grid();
            let known: Vec<(usize, i64)> = (0..network.nodes.len())
                .filter_map(|node| Some((node, i64::from(heights[node % 64]?))))
                .collect();
            let start = |none: i32| (0..network.nodes.len()).map(|node| heights[node % 64].unwrap_or(none)).collect();
            let costs = costs(&network);
            let (low, high) = (lowest(&network, &costs, start(NONE)), highest(&network, &costs, start(-NONE)));
            let paths = all_paths(&network);
            for t in 0..network.nodes.len() {
                let above = known.iter().map(|(s, h)| h + paths[*s][t]).min().unwrap();
                let below = known.iter().map(|(s, h)| h - paths[*s][t]).max().unwrap();
                prop_assert_eq!((i64::from(low[t]), i64::from(high[t])), (above, below));
            }
        }

        #[test]
        fn a_grade_is_raised_where_limits_contradict_it_and_no_more_than_it_gives(
            heights in proptest::collection::vec(-500..500i32, 64),
        ) {
            let network = grid();
            let limits: Vec<_> = (0..network.nodes.len())
                .map(|node| Some([heights[node % 64] - 200, heights[node % 64] + 200]))
                .collect();
            let most = |edge: u32| network.edges[edge as usize].rise_max * 3 / 2;
            let mut raised = costs(&network);
            relax_within(&network, &mut raised, &limits, &most, &|_| true);
            let paths = all_paths(&network);
            let torn = (0..limits.len()).any(|s| (0..limits.len()).any(|t| {
                paths[s][t] < i64::from(heights[s % 64]) - i64::from(heights[t % 64]) - 400
            }));
            prop_assert_eq!(torn, raised != costs(&network));
            prop_assert!((0..).zip(&raised).all(|(edge, cost)| *cost <= most(edge)));
        }
    }
}
