//! Pools of rivers become slopes: between two steps of a DEM of whole metres a river falls evenly.

use crate::{Kind, Network};

/// Tilts the pools of rivers and canals through their middles, chain by chain. The ends of chains and nodes that lie
/// level stay as they are.
pub(crate) fn tilt(network: &Network, heights: &mut [i64], is_level: &[bool]) {
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
    use super::*;

    #[test]
    fn steps_become_one_slope_and_what_is_straight_stays() {
        let along = [0, 10, 20, 30, 40, 50];
        assert_eq!(tilted(&along, &[50, 40, 30, 20, 10, 0]), [50, 40, 30, 20, 10, 0]);
        assert_eq!(tilted(&along, &[80, 60, 60, 20, 20, 0]), [80, 66, 50, 30, 13, 0]);
        assert_eq!(tilted(&along, &[7; 6]), [7; 6]);
    }
}
