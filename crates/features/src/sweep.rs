//! The heights of a network that never exceed its grades and lie closest to the ground.
//!
//! With c the most a path may rise, A(t) = min over s of h(s) + c(s, t) and B(t) = max over s of h(s) - c(s, t) are
//! the greatest profile below the ground and the least one above it that obey the grades (E. J. McShane, Extension of
//! range of functions, and H. Whitney, Analytic extensions, both 1934). Their middle obeys them too, equals h where no
//! pair of heights within reach contradicts them, and is closest to h in its largest distance. Each is one sweep of a
//! priority queue over the whole network, in whole numbers.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::clean::Notes;
use crate::{Flaw, Network, Remark, Remedy};

/// A height for every node, the bound that no height reaches.
const NONE: i32 = i32::MAX / 2;

/// Steps in which the grade between contradicting pins is raised: by a quarter each.
const STEEPER_ROUNDS_MAX: usize = 200;

/// Least `start + c` at every node; [`NONE`] where no start is in reach.
pub(crate) fn lowest(network: &Network, costs: &[i32], mut heights: Vec<i32>) -> Vec<i32> {
    let mut queue: BinaryHeap<Reverse<(i32, u32)>> = BinaryHeap::new();
    // Most nodes bind no neighbour: only those that do begin.
    for node in 0..network.nodes.len() as u32 {
        let height = heights[node as usize];
        let binds = |(next, edge): &(u32, u32)| height + costs[*edge as usize] < heights[*next as usize];
        if height < NONE && network.beside(node).iter().any(binds) {
            queue.push(Reverse((height, node)));
        }
    }
    while let Some(Reverse((height, node))) = queue.pop() {
        if heights[node as usize] < height {
            continue;
        }
        for &(next, edge) in network.beside(node) {
            let reached = height + costs[edge as usize];
            if reached < heights[next as usize] {
                heights[next as usize] = reached;
                queue.push(Reverse((reached, next)));
            }
        }
    }
    heights
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

/// Heights of a network, and what its edges may rise: more than their grade only between contradicting pins.
pub(crate) struct Swept {
    pub heights: Vec<i32>,
    pub costs: Vec<i32>,
    /// The greatest heights that pins allow.
    pub most: Vec<i32>,
}

/// Sweeps the network: `ground` has a height for every node that rests on the ground. Pins are hard.
pub(crate) fn sweep(network: &Network, ground: &[Option<i32>], pins: &[Pin], remarks: &mut Vec<Remark>) -> Swept {
    let mut start: Vec<Option<i32>> = ground.to_vec();
    let pins = one_a_node(network, pins, remarks);
    for pin in &pins {
        start[pin.node as usize] = Some(pin.height);
    }
    let mut costs: Vec<i32> = network.edges.iter().map(|edge| edge.rise_max).collect();
    let (least, most) = between_pins(network, &mut costs, &pins);
    let bounded = |none: i32| -> Vec<i32> {
        let bounds = least.iter().zip(&most);
        start
            .iter()
            .zip(bounds)
            .map(|(start, (least, most))| start.map_or(none, |h| h.max(*least).min(*most)))
            .collect()
    };
    let above = lowest(network, &costs, bounded(NONE));
    let below = highest(network, &costs, bounded(-NONE));
    // Where nothing of a network rests on the ground it lies at height 0: it has none to be true to.
    let middle = |(above, below): (&i32, &i32)| if *above == NONE { 0 } else { (above + below) >> 1 };
    let heights = above.iter().zip(&below).map(middle).collect();
    Swept { heights, costs, most }
}

/// Two pins on one node: the lower one is kept, and it is written down.
fn one_a_node(network: &Network, pins: &[Pin], remarks: &mut Vec<Remark>) -> Vec<Pin> {
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

/// The least and the greatest height of each node that its pins allow; where two contradict one another, the grade
/// between them is raised, a quarter at a time, until they do not.
fn between_pins(network: &Network, costs: &mut [i32], pins: &[Pin]) -> (Vec<i32>, Vec<i32>) {
    let count = network.nodes.len();
    let start = |none: i32| {
        let mut start = vec![none; count];
        pins.iter().for_each(|pin| start[pin.node as usize] = pin.height);
        start
    };
    for _ in 0..STEEPER_ROUNDS_MAX {
        if pins.is_empty() {
            break;
        }
        let (least, most) = (highest(network, costs, start(-NONE)), lowest(network, costs, start(NONE)));
        let torn = |node: u32| most[node as usize] < least[node as usize];
        if !(0..count as u32).any(torn) {
            return (least, most);
        }
        for (edge, cost) in network.edges.iter().zip(costs.iter_mut()) {
            if torn(edge.a) && torn(edge.b) {
                *cost += (*cost / 4).max(1);
            }
        }
    }
    (vec![-NONE; count], vec![NONE; count])
}

/// Writes down where the greatest grade is exceeded, once for each feature.
pub(crate) fn remark_steep(network: &Network, heights: &[i32], remarks: &mut Vec<Remark>) {
    let mut worst: std::collections::BTreeMap<u32, (u32, u32)> = std::collections::BTreeMap::new();
    for edge in &network.edges {
        let rise = (heights[edge.a as usize] - heights[edge.b as usize]).abs();
        if edge.rise_max < rise {
            let grade = (i64::from(rise) * 1_000_000 / i64::from(edge.length.max(1))).min(i64::from(u32::MAX)) as u32;
            let entry = worst.entry(edge.way).or_insert((grade, edge.a));
            if entry.0 < grade {
                *entry = (grade, edge.a);
            }
        }
    }
    for (way, (grade_ppm, node)) in worst {
        let id = network.ways[way as usize].id;
        let place = network.nodes[node as usize].place;
        let flaw = Flaw::PinsTooSteep { grade_ppm };
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

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn the_sweeps_are_the_best_of_all_paths_and_their_middle_is_the_closest(
            heights in proptest::collection::vec(proptest::option::weighted(0.9, -2000..2000i32), 64)
        ) {
            let network = grid();
            let ground: Vec<Option<i32>> = (0..network.nodes.len()).map(|node| heights[node % 64]).collect();
            let swept = sweep(&network, &ground, &[], &mut Vec::new());
            let paths = all_paths(&network);
            let known: Vec<(usize, i64)> =
                ground.iter().enumerate().filter_map(|(node, h)| Some((node, i64::from((*h)?)))).collect();
            for (t, found) in swept.heights.iter().enumerate() {
                let above = known.iter().map(|(s, h)| h + paths[*s][t]).min().unwrap();
                let below = known.iter().map(|(s, h)| h - paths[*s][t]).max().unwrap();
                prop_assert_eq!(i64::from(*found), (above + below).div_euclid(2));
            }
            for edge in &network.edges {
                let rise = (swept.heights[edge.a as usize] - swept.heights[edge.b as usize]).abs();
                prop_assert!(rise <= edge.rise_max);
            }
            // No profile can be closer than half of the worst contradiction.
            let pairs = known.iter().flat_map(|one| known.iter().map(move |other| (one, other)));
            let worst = pairs.map(|((s, h), (t, g))| h - g - paths[*s][*t]).max().unwrap().max(0);
            let farthest = known.iter().map(|(t, h)| (i64::from(swept.heights[*t]) - h).abs()).max().unwrap();
            prop_assert!(farthest <= (worst + 1) / 2 + 1, "{} beyond {}", farthest, worst);
        }

        #[test]
        fn pins_are_kept_whatever_they_contradict(
            heights in proptest::collection::vec(-500..500i32, 64),
            pinned in proptest::collection::vec((0usize..60, -3000..3000i32), 1..4)
        ) {
            let network = grid();
            let count = network.nodes.len();
            let ground: Vec<Option<i32>> = (0..count).map(|node| Some(heights[node % 64])).collect();
            let mut pins: Vec<Pin> =
                pinned.iter().map(|(node, height)| Pin { node: (node % count) as u32, height: *height }).collect();
            pins.sort_unstable();
            let mut remarks = Vec::new();
            let swept = sweep(&network, &ground, &pins, &mut remarks);
            pins.dedup_by_key(|pin| pin.node);
            for pin in &pins {
                prop_assert_eq!(swept.heights[pin.node as usize], pin.height);
            }
            let exceeded = network.edges.iter().enumerate().filter(|(_, edge)| {
                edge.rise_max < (swept.heights[edge.a as usize] - swept.heights[edge.b as usize]).abs()
            });
            let paths = all_paths(&network);
            let torn = pins.iter().any(|one| pins.iter().any(|other| {
                paths[one.node as usize][other.node as usize] < i64::from(one.height - other.height)
            }));
            prop_assert_eq!(0 < exceeded.count(), torn, "the grade is exceeded where pins contradict it only");
        }
    }
}
