//! The fit of heights on a network: least weighted distances to samples, while neighbours keep to their bounds.
//!
//! A part of the network without loops is fitted exactly ([`fit_forest`]). Where the exact fit of a spanning forest
//! breaks the bounds that it does not know, it is made to keep them, and then improved in rounds: each fits a forest
//! of nodes exactly, while those that would close a loop stand still. No round costs more than the one before. Parts
//! that are not connected do not know of each other, and every choice goes by places, so that a feature more changes
//! heights of its own part only.

use std::cmp::Reverse;

use crate::Place;
use crate::forest::{Member, Range, Sample, UNBOUNDED, Wanted, fit_forest};
use crate::sweep::{root, spread};

/// Two nodes with the range of the height of `a` less that of `b`, 0 within it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tie {
    pub a: u32,
    pub b: u32,
    pub difference: Range,
}

/// Heights to fit. Nodes are in the order of their places.
#[derive(Clone, Debug, Default)]
pub(crate) struct Problem {
    pub places: Vec<Place>,
    pub ties: Vec<Tie>,
    pub samples: Vec<Sample>,
    /// What no sample outweighs. Ranges that contradict each other through ties are kept as far as the ties let them.
    pub ranges: Vec<Range>,
    /// Of several heights that cost equally little, the one nearest to this.
    pub wishes: Vec<i64>,
}

/// Fits a height to every node; loops in so many rounds.
pub(crate) fn fit(problem: &Problem, rounds: u64) -> Vec<i64> {
    by_parts(problem, &|part, _| part.solve(rounds))
}

/// What comes of each part by itself, whose nodes have these numbers.
fn by_parts(problem: &Problem, of: &dyn Fn(&Part, &[u32]) -> Vec<i64>) -> Vec<i64> {
    let graph = Graph::of(problem.places.len(), &problem.ties);
    let (sample_starts, samples) = by_node(problem);
    let mut heights = vec![0; problem.places.len()];
    let mut local = vec![u32::MAX; problem.places.len()];
    for nodes in graph.parts() {
        nodes.iter().zip(0..).for_each(|(&node, number)| local[node as usize] = number);
        let part = Part::of(problem, &graph, (&sample_starts, &samples), &nodes, &local);
        for (&node, height) in nodes.iter().zip(of(&part, &nodes)) {
            heights[node as usize] = height;
        }
    }
    heights
}

/// Heights that keep all ties, as near to some heights as the middle between the nearest from below and from above.
pub(crate) fn keep_ties(problem: &Problem, heights: Vec<i64>) -> Vec<i64> {
    by_parts(problem, &|part, nodes| {
        let mut of_part: Vec<i64> = nodes.iter().map(|node| heights[*node as usize]).collect();
        part.make_keep_ties(&mut of_part);
        of_part
    })
}

/// The greatest heights that ranges allow through ties.
pub(crate) fn most(problem: &Problem) -> Vec<i64> {
    by_parts(problem, &|part, _| part.lowest(part.ranges.iter().map(|range| range.most).collect()))
}

/// The samples in the order of their nodes, and where those of each node begin.
fn by_node(problem: &Problem) -> (Vec<u32>, Vec<Sample>) {
    let mut samples = problem.samples.clone();
    samples.sort_by_key(|sample| sample.node);
    let mut starts = vec![0u32; problem.places.len() + 1];
    samples.iter().for_each(|sample| starts[sample.node as usize + 1] += 1);
    (1..starts.len()).for_each(|node| starts[node] += starts[node - 1]);
    (starts, samples)
}

/// A tie, seen from one of its nodes.
#[derive(Clone, Copy, Debug)]
struct Arc {
    to: u32,
    /// The height of the node it is seen from, less that of `to`.
    difference: Range,
}

/// What each node is tied to, in order.
#[derive(Default)]
struct Graph {
    starts: Vec<u32>,
    arcs: Vec<Arc>,
}

impl Graph {
    fn of(nodes: usize, ties: &[Tie]) -> Self {
        let mut starts = vec![0u32; nodes + 1];
        for tie in ties {
            starts[tie.a as usize + 1] += 1;
            starts[tie.b as usize + 1] += 1;
        }
        (1..=nodes).for_each(|node| starts[node] += starts[node - 1]);
        let mut next = starts.clone();
        let mut arcs = vec![Arc { to: 0, difference: Range::ALL }; 2 * ties.len()];
        for &Tie { a, b, difference } in ties {
            debug_assert!(difference.least <= 0 && 0 <= difference.most, "a tie allows equal heights");
            for (from, to, difference) in [(a, b, difference), (b, a, difference.turned())] {
                arcs[next[from as usize] as usize] = Arc { to, difference };
                next[from as usize] += 1;
            }
        }
        for node in 0..nodes {
            let of_node = &mut arcs[starts[node] as usize..starts[node + 1] as usize];
            of_node.sort_unstable_by_key(|arc| (arc.to, arc.difference.least, arc.difference.most));
        }
        Self { starts, arcs }
    }

    fn count(&self) -> usize {
        self.starts.len() - 1
    }

    fn of_node(&self, node: u32) -> &[Arc] {
        &self.arcs[self.starts[node as usize] as usize..self.starts[node as usize + 1] as usize]
    }

    /// The nodes of each connected part, in order.
    fn parts(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.count()];
        let mut parts = Vec::new();
        for first in 0..self.count() as u32 {
            if std::mem::replace(&mut seen[first as usize], true) {
                continue;
            }
            let (mut part, mut at) = (vec![first], 0);
            while let Some(&node) = part.get(at) {
                let unseen = self.of_node(node).iter().map(|arc| arc.to);
                part.extend(unseen.filter(|to| !std::mem::replace(&mut seen[*to as usize], true)));
                at += 1;
            }
            part.sort_unstable();
            parts.push(part);
        }
        parts
    }
}

/// A connected part of a problem, its nodes numbered in the same order.
struct Part {
    places: Vec<Place>,
    graph: Graph,
    sample_starts: Vec<u32>,
    samples: Vec<Sample>,
    ranges: Vec<Range>,
    wishes: Vec<i64>,
    hard: i64,
}

impl Part {
    fn of(
        problem: &Problem,
        graph: &Graph,
        (starts, samples): (&[u32], &[Sample]),
        nodes: &[u32],
        local: &[u32],
    ) -> Self {
        let mut part = Self {
            places: nodes.iter().map(|&node| problem.places[node as usize]).collect(),
            graph: Graph { starts: vec![0], arcs: Vec::new() },
            sample_starts: vec![0],
            samples: Vec::new(),
            ranges: nodes.iter().map(|&node| problem.ranges[node as usize]).collect(),
            wishes: nodes.iter().map(|&node| problem.wishes[node as usize]).collect(),
            hard: 1,
        };
        for &node in nodes {
            let here = |arc: &Arc| Arc { to: local[arc.to as usize], ..*arc };
            part.graph.arcs.extend(graph.of_node(node).iter().map(here));
            part.graph.starts.push(part.graph.arcs.len() as u32);
            let of_node = starts[node as usize] as usize..starts[node as usize + 1] as usize;
            part.samples.extend(&samples[of_node]);
            part.sample_starts.push(part.samples.len() as u32);
        }
        part.hard += part.samples.iter().map(|sample| sample.below + sample.above).sum::<i64>();
        part
    }

    fn solve(&self, rounds: u64) -> Vec<i64> {
        let mut heights = self.wishes.clone();
        let nodes = 0..self.places.len() as u32;
        let mut turn: Vec<u32> = nodes.collect();
        turn.sort_by_key(|node| Reverse(self.graph.of_node(*node).len()));
        let forest = self.forest(&turn, &vec![true; turn.len()]);
        fit_forest(&forest, &self.wanted(&self.ranges), &mut heights);
        if self.keeps_ties(&heights) {
            return heights;
        }
        self.make_keep_ties(&mut heights);
        for round in 0..rounds {
            let mix = |node: u32| mixed(self.places[node as usize], round);
            let degree = |node: u32| if round % 2 == 0 { self.graph.of_node(node).len() } else { 0 };
            turn.sort_by_cached_key(|node| (Reverse(degree(*node)), mix(*node), *node));
            let moves = self.without_loops(&turn);
            let forest = self.forest(&turn, &moves);
            fit_forest(&forest, &self.wanted(&self.beside_still(&moves, &heights)), &mut heights);
        }
        heights
    }

    fn wanted<'a>(&'a self, ranges: &'a [Range]) -> Wanted<'a> {
        let Self { samples, sample_starts, hard, wishes, .. } = self;
        Wanted { samples, starts: sample_starts, ranges, hard: *hard, wishes }
    }

    /// A spanning forest, breadth first, of the nodes that move; roots in turn; children before parents.
    fn forest(&self, turn: &[u32], moves: &[bool]) -> Vec<Member> {
        let mut seen = vec![false; turn.len()];
        let mut forest: Vec<Member> = Vec::with_capacity(turn.len());
        for &root in turn.iter().filter(|node| moves[**node as usize]) {
            if std::mem::replace(&mut seen[root as usize], true) {
                continue;
            }
            let mut at = forest.len();
            forest.push(Member { node: root, parent: None });
            while let Some(&Member { node, .. }) = forest.get(at) {
                for arc in self.graph.of_node(node).iter().filter(|arc| moves[arc.to as usize]) {
                    if !std::mem::replace(&mut seen[arc.to as usize], true) {
                        forest.push(Member { node: arc.to, parent: Some((node, arc.difference)) });
                    }
                }
                at += 1;
            }
        }
        forest.reverse();
        forest
    }

    fn keeps_ties(&self, heights: &[i64]) -> bool {
        let keeps = |node: u32, arc: &Arc| {
            let difference = heights[node as usize] - heights[arc.to as usize];
            arc.difference.least <= difference && difference <= arc.difference.most
        };
        (0..heights.len() as u32).all(|node| self.graph.of_node(node).iter().all(|arc| keeps(node, arc)))
    }

    /// The middle between the greatest heights below these that keep all ties, and the least above.
    fn make_keep_ties(&self, heights: &mut [i64]) {
        let ranges = self.ranges.iter();
        let least = self.highest(ranges.clone().map(|range| range.least).collect());
        let most = self.lowest(ranges.map(|range| range.most).collect());
        for ((height, least), most) in heights.iter_mut().zip(least).zip(most) {
            *height = Range { least, most }.nearest(*height);
        }
        let (below, above) = (self.lowest(heights.to_vec()), self.highest(heights.to_vec()));
        for ((height, below), above) in heights.iter_mut().zip(below).zip(above) {
            *height = (below + above) >> 1;
        }
    }

    /// The greatest heights below these that keep all ties.
    fn lowest(&self, mut heights: Vec<i64>) -> Vec<i64> {
        spread(&mut heights, &|node, reach| {
            let bounding = self.graph.of_node(node).iter().filter(|arc| -UNBOUNDED < arc.difference.least);
            bounding.for_each(|arc| reach(arc.to, -arc.difference.least));
        });
        heights
    }

    /// The least heights above these that keep all ties.
    fn highest(&self, heights: Vec<i64>) -> Vec<i64> {
        let mut negated: Vec<i64> = heights.into_iter().map(|height| -height).collect();
        spread(&mut negated, &|node, reach| {
            let bounding = self.graph.of_node(node).iter().filter(|arc| arc.difference.most < UNBOUNDED);
            bounding.for_each(|arc| reach(arc.to, arc.difference.most));
        });
        negated.into_iter().map(|height| -height).collect()
    }

    /// Takes nodes in turn: one that would close a loop with those taken does not move.
    fn without_loops(&self, turn: &[u32]) -> Vec<bool> {
        let mut moves = vec![false; turn.len()];
        let mut tree: Vec<u32> = (0..turn.len() as u32).collect();
        let mut beside: Vec<u32> = Vec::new();
        for &node in turn {
            beside.clear();
            let taken = self.graph.of_node(node).iter().filter(|arc| moves[arc.to as usize]);
            beside.extend(taken.map(|arc| root(&mut tree, arc.to)));
            beside.sort_unstable();
            if beside.windows(2).all(|pair| pair[0] != pair[1]) {
                moves[node as usize] = true;
                beside.iter().for_each(|&root| tree[root as usize] = node);
            }
        }
        moves
    }

    /// The ranges of nodes that move, bounded by their neighbours that do not.
    fn beside_still(&self, moves: &[bool], heights: &[i64]) -> Vec<Range> {
        let mut ranges = self.ranges.clone();
        for (node, range) in ranges.iter_mut().enumerate().filter(|(node, _)| moves[*node]) {
            for arc in self.graph.of_node(node as u32).iter().filter(|arc| !moves[arc.to as usize]) {
                let still = heights[arc.to as usize];
                if -UNBOUNDED < arc.difference.least {
                    range.least = range.least.max(still + arc.difference.least);
                }
                if arc.difference.most < UNBOUNDED {
                    range.most = range.most.min(still + arc.difference.most);
                }
            }
        }
        ranges
    }
}

/// A number that looks drawn at random, of a place and a round (G. Steele and others' `splitmix`, 2014).
fn mixed(place: Place, round: u64) -> u64 {
    let seed = u64::from(place.row as u32) << 32 | u64::from(place.col as u32);
    let mut mixed = (seed ^ round.wrapping_mul(0xD1B5_4A32_D192_ED03)).wrapping_add(0x9E37_79B9_7F4A_7C15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    mixed ^ (mixed >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cost(problem: &Problem, heights: &[i64]) -> i64 {
        let of = |sample: &Sample| {
            let off = heights[sample.node as usize] - sample.height;
            if off < 0 { -off * sample.below } else { off * sample.above }
        };
        problem.samples.iter().map(of).sum()
    }

    fn keeps(problem: &Problem, heights: &[i64]) -> bool {
        let within = |range: &Range, height: i64| range.least <= height && height <= range.most;
        problem.ties.iter().all(|tie| within(&tie.difference, heights[tie.a as usize] - heights[tie.b as usize]))
            && problem.ranges.iter().zip(heights).all(|(range, height)| within(range, *height))
    }

    /// The least cost of all heights from `low` to `high` that keep to everything; `None` where none do.
    fn least_cost(problem: &Problem, low: i64, high: i64) -> Option<i64> {
        let mut heights = vec![low; problem.places.len()];
        let mut best = None;
        loop {
            if keeps(problem, &heights) {
                let cost = cost(problem, &heights);
                best = Some(best.map_or(cost, |best: i64| best.min(cost)));
            }
            let Some(next) = heights.iter().rposition(|height| *height < high) else { return best };
            heights[next] += 1;
            heights[next + 1..].fill(low);
        }
    }

    fn ties(ends: &[(u32, u32)], differences: &[(i64, i64)], nodes: u32) -> Vec<Tie> {
        let mut ties: Vec<Tie> = Vec::new();
        for (&(a, b), &(least, most)) in ends.iter().zip(differences) {
            let (a, b) = (a % nodes, b % nodes);
            let known = |tie: &Tie| (tie.a.min(tie.b), tie.a.max(tie.b)) == (a.min(b), a.max(b));
            if a != b && !ties.iter().any(known) {
                let most = if most == 3 { UNBOUNDED } else { most };
                ties.push(Tie { a, b, difference: Range { least: -least, most } });
            }
        }
        ties
    }

    fn problem(nodes: u32, ties: Vec<Tie>, samples: &[(u32, i64, i64, i64)], pins: &[(u32, i64)]) -> Problem {
        let sample =
            |&(node, height, below, above): &(u32, i64, i64, i64)| Sample { node: node % nodes, height, below, above };
        let mut ranges = vec![Range::ALL; nodes as usize];
        pins.iter().for_each(|&(node, height)| ranges[(node % nodes) as usize] = Range { least: height, most: height });
        Problem {
            places: (0..nodes as i32).map(|node| Place::new(node, 3 * node)).collect(),
            ties,
            samples: samples.iter().map(sample).collect(),
            ranges,
            wishes: vec![0; nodes as usize],
        }
    }

    /// What level ties in a loop hold together no round moves, so a single network may cost several times the least.
    #[test]
    fn heights_on_loops_cost_little_more_than_the_least_on_the_whole() {
        let mut drawn = 1u64;
        let mut below = |bound: u64| {
            drawn = drawn.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (drawn >> 33) % bound
        };
        let (mut found, mut least) = (0, 0);
        for _ in 0..400 {
            let ends: Vec<(u32, u32)> = (0..8).map(|_| (below(5) as u32, below(5) as u32)).collect();
            let differences: Vec<(i64, i64)> = (0..8).map(|_| (below(3) as i64, below(4) as i64)).collect();
            let mut sample = || (below(5) as u32, below(5) as i64, below(4) as i64, below(4) as i64);
            let samples: Vec<(u32, i64, i64, i64)> = (0..8).map(|_| sample()).collect();
            let problem = problem(5, ties(&ends, &differences, 5), &samples, &[]);
            found += cost(&problem, &fit(&problem, 4));
            least += least_cost(&problem, 0, 4).expect("equal heights keep to everything");
        }
        assert!(100 * found <= 110 * least, "{found} where {least} is the least");
    }

    proptest! {
        #[test]
        fn no_other_heights_on_a_tree_cost_less(
            parents in proptest::collection::vec(0..5u32, 4),
            differences in proptest::collection::vec((0..3i64, 0..4i64), 4),
            samples in proptest::collection::vec((0..5u32, 0..5i64, 0..4i64, 0..4i64), 0..9),
            pin in proptest::option::of((0..5u32, 0..5i64)),
        ) {
            let ends: Vec<(u32, u32)> = (1..5).zip(parents).map(|(node, parent)| (node, parent % node)).collect();
            let pins: Vec<(u32, i64)> = pin.into_iter().collect();
            let problem = problem(5, ties(&ends, &differences, 5), &samples, &pins);
            let heights = fit(&problem, 0);
            prop_assert!(keeps(&problem, &heights), "{heights:?}");
            prop_assert_eq!(Some(cost(&problem, &heights)), least_cost(&problem, 0, 4));
        }

        #[test]
        fn heights_on_loops_keep_to_everything_and_no_round_costs_more(
            ends in proptest::collection::vec((0..5u32, 0..5u32), 3..9),
            differences in proptest::collection::vec((0..3i64, 0..4i64), 9),
            samples in proptest::collection::vec((0..5u32, 0..5i64, 0..4i64, 0..4i64), 0..9),
            pin in proptest::option::of((0..5u32, 0..5i64)),
        ) {
            let pins: Vec<(u32, i64)> = pin.into_iter().collect();
            let problem = problem(5, ties(&ends, &differences, 5), &samples, &pins);
            let (none, some) = (fit(&problem, 0), fit(&problem, 4));
            prop_assert!(keeps(&problem, &none) && keeps(&problem, &some), "{none:?} {some:?}");
            let least = least_cost(&problem, 0, 4).expect("equal heights keep to everything");
            prop_assert!(cost(&problem, &some) <= cost(&problem, &none));
            prop_assert!(least <= cost(&problem, &some));
        }

        #[test]
        fn a_part_more_changes_no_height_of_the_others(
            ends in proptest::collection::vec((0..6u32, 0..6u32), 3..12),
            heights in proptest::collection::vec(0..99i64, 12),
        ) {
            // The same network alone, and with one more whose places lie between its own.
            let differences = vec![(2, 2); ends.len()];
            let ties = ties(&ends, &differences, 6);
            let samples: Vec<_> = (0..6).map(|node| (node, heights[node as usize], 1, 1)).collect();
            let alone = problem(6, ties.clone(), &samples, &[]);
            let mut both = problem(12, Vec::new(), &[], &[]);
            both.places = (0..12).map(|node| Place::new(node / 2, 3 * (node / 2) + node % 2)).collect();
            for of in 0..2 {
                let ties = ties.iter().map(|tie| Tie { a: 2 * tie.a + of, b: 2 * tie.b + of, ..*tie });
                both.ties.extend(ties);
                let shifted = |sample: &Sample| Sample { node: 2 * sample.node + of, ..*sample };
                both.samples.extend(alone.samples.iter().map(shifted));
            }
            let found: Vec<i64> = fit(&both, 4).into_iter().step_by(2).collect();
            prop_assert_eq!(found, fit(&alone, 4));
        }
    }

    #[test]
    fn a_loop_is_fitted_as_well_as_a_linear_program_would() {
        // A square with a spike: heights may differ by 1, so the spike is cut and its neighbours stay.
        let ends = [(0, 1), (1, 2), (2, 3), (3, 0)];
        let samples = [(0, 0, 1, 1), (1, 0, 1, 1), (2, 9, 1, 1), (3, 0, 1, 1)];
        let problem = problem(4, ties(&ends, &[(1, 1); 4], 4), &samples, &[]);
        assert_eq!(fit(&problem, 4), [0, 0, 1, 0]);
    }
}
