//! Rings of a multipolygon relation, put together from its member ways at the nodes that these share.

use std::collections::{BTreeMap, HashMap};

/// What a relation says of a member.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// `outer`, or nothing at all, which is taken for it.
    Outer,
    Inner,
    /// Some ways of a ring are outer, some inner.
    Mixed,
}

/// A closed ring: the first node is the last.
#[derive(Debug, PartialEq)]
pub(super) struct NodeRing {
    pub nodes: Vec<i64>,
    pub role: Role,
    /// Which of the members it is made of.
    pub ways: Vec<usize>,
}

/// Rings of the members, and those members that are in none.
pub(super) fn rings(members: &[(Role, &[i64])]) -> (Vec<NodeRing>, Vec<usize>) {
    let (mut rings, mut open) = (Vec::new(), Vec::new());
    let mut ends: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
    let mut is_used = vec![false; members.len()];
    for (index, (_, nodes)) in members.iter().enumerate() {
        match *nodes {
            [] | [_] => (is_used[index], _) = (true, open.push(index)),
            [first, .., last] if first == last => {
                is_used[index] = true;
                rings.push(ring(members, &[(index, false)]));
            }
            [first, .., last] => {
                ends.entry(*first).or_default().push(index);
                ends.entry(*last).or_default().push(index);
            }
        }
    }
    for index in 0..members.len() {
        if !is_used[index] {
            is_used[index] = true;
            walk(index, members, &mut ends, &mut is_used, &mut rings, &mut open);
        }
    }
    open.sort_unstable();
    (rings, open)
}

/// Follows ways from one to the next. Whenever the walk comes back to a node, what lies between is a ring and is taken
/// off, so that rings which touch at a node come apart; a way that leads nowhere is taken off as well.
fn walk(
    start: usize,
    members: &[(Role, &[i64])],
    ends: &mut BTreeMap<i64, Vec<usize>>,
    is_used: &mut [bool],
    rings: &mut Vec<NodeRing>,
    open: &mut Vec<usize>,
) {
    let end_nodes = |way: usize| {
        let nodes = members[way].1;
        [nodes[0], nodes[nodes.len() - 1]]
    };
    let [first, second] = end_nodes(start);
    // Ways, each with whether it is walked backwards; the nodes between them; and where each node is among these.
    let (mut walked, mut nodes) = (vec![(start, false)], vec![first, second]);
    let mut places = HashMap::from([(first, 0), (second, 1)]);
    while let Some(&at) = nodes.last() {
        let candidates = ends.get_mut(&at);
        let next = candidates.and_then(|ways| {
            ways.retain(|&way| !is_used[way]);
            ways.first().copied()
        });
        let Some(way) = next else {
            let Some((spur, _)) = walked.pop() else { return };
            open.push(spur);
            places.remove(&at);
            nodes.pop();
            continue;
        };
        is_used[way] = true;
        let [first, last] = end_nodes(way);
        let is_backwards = first != at;
        let to = if is_backwards { first } else { last };
        walked.push((way, is_backwards));
        match places.get(&to).copied() {
            Some(place) => {
                rings.push(ring(members, &walked[place..]));
                walked.truncate(place);
                for node in nodes.drain(place + 1..) {
                    places.remove(&node);
                }
            }
            None => {
                places.insert(to, nodes.len());
                nodes.push(to);
            }
        }
    }
}

fn ring(members: &[(Role, &[i64])], ways: &[(usize, bool)]) -> NodeRing {
    let mut nodes: Vec<i64> = Vec::new();
    for &(way, is_backwards) in ways {
        nodes.pop();
        let of_way = members[way].1.iter().copied();
        if is_backwards { nodes.extend(of_way.rev()) } else { nodes.extend(of_way) }
    }
    let role = members[ways[0].0].0;
    let is_one = ways.iter().all(|&(way, _)| members[way].0 == role);
    let ways = ways.iter().map(|&(way, _)| way).collect();
    NodeRing { nodes, role: if is_one { role } else { Role::Mixed }, ways }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(ways: &[&[i64]], expected: &[&[i64]], expected_open: &[usize]) {
        let members: Vec<(Role, &[i64])> = ways.iter().map(|&way| (Role::Outer, way)).collect();
        let (rings, open) = rings(&members);
        let nodes: Vec<&[i64]> = rings.iter().map(|ring| ring.nodes.as_slice()).collect();
        assert_eq!((nodes.as_slice(), open.as_slice()), (expected, expected_open));
    }

    #[test]
    fn ways_are_joined_whichever_way_they_run() {
        check(&[&[1, 2, 3, 1]], &[&[1, 2, 3, 1]], &[]);
        check(&[&[1, 2, 3], &[1, 4, 3]], &[&[1, 2, 3, 4, 1]], &[]);
        check(&[&[1, 2], &[3, 1], &[2, 3], &[7, 8, 9, 7]], &[&[7, 8, 9, 7], &[1, 2, 3, 1]], &[]);
    }

    #[test]
    fn rings_that_touch_at_a_node_come_apart() {
        check(&[&[1, 2], &[2, 3, 4, 2], &[2, 5, 1]], &[&[2, 3, 4, 2], &[1, 2, 5, 1]], &[]);
        let ways: [&[i64]; 4] = [&[1, 2, 3], &[3, 4, 5], &[5, 6, 3], &[3, 7, 1]];
        check(&ways, &[&[3, 4, 5, 6, 3], &[1, 2, 3, 7, 1]], &[]);
    }

    #[test]
    fn ways_that_lead_nowhere_are_in_no_ring() {
        check(&[&[1, 2], &[2, 3]], &[], &[0, 1]);
        check(&[&[9, 1], &[1, 2], &[2, 3], &[3, 1], &[2, 8], &[], &[4]], &[&[1, 2, 3, 1]], &[0, 4, 5, 6]);
    }
}
