//! Which way rivers flow: OpenStreetMap draws them downhill, others anyhow, and a few the wrong way round.

use std::collections::BinaryHeap;

use crate::clean::Notes;
use crate::{Flaw, Network, Numbering, Remark, Remedy};

/// Quanta a station that turning a way has to save: 1 m. Less is noise.
const SAVED_MIN: i64 = terrain::QUANTA_PER_METRE as i64;

/// Which edges flow against the direction of their way. A way is turned round when the sum of distances between its
/// ground and the nearest profile that falls is halved by that, and well beyond noise.
pub(crate) fn orient(network: &Network, ground: &[i32], remarks: &mut Vec<Remark>) -> Vec<bool> {
    let mut turned = vec![false; network.edges.len()];
    let mut first = 0;
    for edges in network.edges.chunk_by(|a, b| a.way == b.way) {
        let of_way = first..first + edges.len();
        first += edges.len();
        if edges[0].a == edges[edges.len() - 1].b {
            // A closed way has no lower end.
            continue;
        }
        let mut along: Vec<i32> = vec![ground[edges[0].a as usize]];
        along.extend(edges.iter().map(|edge| ground[edge.b as usize]));
        let id = network.ways[edges[0].way as usize].id;
        let uphill = along[0] < along[along.len() - 1];
        let drawn_downhill = id.numbering != Numbering::Row;
        let forth = cost_of_falling(along.iter().copied());
        let back = cost_of_falling(along.iter().rev().copied());
        let saves = |from: i64, to: i64| 2 * to < from && SAVED_MIN * (along.len() as i64) < from - to;
        let turn = if drawn_downhill || !uphill { saves(forth, back) } else { !saves(back, forth) };
        if turn {
            turned[of_way].fill(true);
        }
        if turn && drawn_downhill {
            let place = network.nodes[edges[0].a as usize].place;
            Notes { id, lattice: network.lattice, remarks }.write_at(place, Flaw::FlowsUphill, Remedy::TurnedRound);
        }
    }
    turned
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
}
