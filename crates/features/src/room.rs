//! Who gets the room where strips overlap: the higher class; the other becomes narrower, then a line.

use std::collections::BTreeSet;

use crate::clean::Notes;
use crate::exact::Segment;
use crate::pieces::Piece;
use crate::quarters::segment_pairs;
use crate::strips::{Face, Room, Wide, faces};
use crate::{Flaw, Network, Place, Remark, Remedy};

/// Rounds of narrowing: each takes a strip that overlaps from whole to half or from half to none.
const ROUNDS: usize = 4;

/// The faces of all strips after overlaps are resolved, and what is left of each strip.
pub(crate) fn share_out(network: &Network, pieces: &[Piece], wide: &mut [Wide], heights: &[i32]) -> Vec<Face> {
    let mut found = faces(network, pieces, wide, heights);
    for _ in 0..ROUNDS {
        let losers = losers(network, pieces, wide, &found);
        if losers.is_empty() {
            break;
        }
        for &loser in &losers {
            let of = &mut wide[loser as usize];
            of.room = if of.room == Room::Whole { Room::Half } else { Room::None };
        }
        found = faces(network, pieces, wide, heights);
    }
    found
}

/// Writes down which strips others left less room than they ask for.
pub(crate) fn remark_rooms(network: &Network, pieces: &[Piece], wide: &[Wide], remarks: &mut Vec<Remark>) {
    let mut told = BTreeSet::new();
    for of in wide.iter().filter(|of| of.room != Room::Whole) {
        let id = pieces[of.piece as usize].id(network, of.segment as usize);
        let remedy = if of.room == Room::Half { Remedy::Narrowed } else { Remedy::BecameLine };
        if told.insert((id, remedy)) {
            let place = network.nodes[of.a as usize].place;
            Notes { id, lattice: network.lattice, remarks }.write_at(place, Flaw::Overlap, remedy);
        }
    }
}

/// The part a segment of an outline or of a line belongs to.
struct Part<'a> {
    /// What decides between two: the class, then what lies farther south-west.
    rank: (u16, Place),
    nodes: &'a [u32],
    /// The face; none for the centreline of a line, which nothing makes narrower.
    face: Option<u32>,
}

fn losers(network: &Network, pieces: &[Piece], wide: &[Wide], found: &[Face]) -> BTreeSet<u32> {
    let (mut segments, mut owners, mut parts): (Vec<Segment>, Vec<u32>, Vec<Part>) = Default::default();
    for (number, face) in found.iter().enumerate().filter(|(_, face)| !face.is_deck) {
        let places = face.places();
        let least = places.iter().min().copied().unwrap_or(Place::new(0, 0));
        for at in 0..places.len() {
            segments.push(Segment { a: places[at], b: places[(at + 1) % places.len()] });
            owners.push(parts.len() as u32);
        }
        parts.push(Part { rank: (face.class, least), nodes: &face.nodes, face: Some(number as u32) });
    }
    let is_wide: BTreeSet<(u32, u32)> =
        wide.iter().filter(|of| of.room != Room::None).map(|of| (of.piece, of.segment)).collect();
    for (number, piece) in pieces.iter().enumerate().filter(|(_, piece)| !piece.is_deck()) {
        for (segment, nodes) in piece.nodes.windows(2).enumerate() {
            if !is_wide.contains(&(number as u32, segment as u32)) {
                let [a, b] = [nodes[0], nodes[1]].map(|node| network.nodes[node as usize].place);
                segments.push(Segment { a, b });
                owners.push(parts.len() as u32);
                parts.push(Part { rank: (piece.traits.class, a.min(b)), nodes, face: None });
            }
        }
    }
    let (mut losers, at_nodes) = (BTreeSet::new(), AtNodes::of(wide));
    segment_pairs(&segments, &mut |one, other| {
        let (s, t) = (&segments[one as usize], &segments[other as usize]);
        let (p, q) = (&parts[owners[one as usize] as usize], &parts[owners[other as usize] as usize]);
        if p.nodes.iter().any(|node| q.nodes.contains(node)) || s.crossing(t).is_none() {
            return;
        }
        let (winner, loser) = if p.rank < q.rank { (p, q) } else { (q, p) };
        // A line of lower class is cut where it lies in a strip; that costs no other feature room.
        if let (Some(face), true) = (loser.face, winner.face.is_some() || winner.rank.0 < loser.rank.0) {
            losers.extend(at_nodes.wide_of(&found[face as usize], wide));
        }
    });
    losers
}

/// The strip segments that end at each node, in the order of nodes.
pub(crate) struct AtNodes(Vec<(u32, u32)>);

impl AtNodes {
    /// Those of all strip segments.
    pub fn of(wide: &[Wide]) -> Self {
        let mut all: Vec<(u32, u32)> =
            (0..).zip(wide).flat_map(|(number, of)| [(of.a, number), (of.b, number)]).collect();
        all.sort_unstable();
        Self(all)
    }

    /// The strip segments that make a face: its own, or those that meet in a junction.
    pub fn wide_of(&self, face: &Face, wide: &[Wide]) -> Vec<u32> {
        let Some(own) = face.wide else {
            let at = |node: &u32| {
                let (first, node) = (self.0.partition_point(|(other, _)| other < node), *node);
                self.0[first..].iter().take_while(move |(other, _)| *other == node).map(|(_, number)| *number)
            };
            let meets = face.nodes.iter().flat_map(at);
            let mut numbers: Vec<u32> = meets.filter(|number| wide[*number as usize].room != Room::None).collect();
            numbers.sort_unstable();
            numbers.dedup();
            return numbers;
        };
        vec![own]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_that_meet_in_a_junction_are_found_by_their_nodes() {
        let rooms = [Room::Whole, Room::Half, Room::None];
        let wide: Vec<Wide> = (0..60_u32)
            .map(|number| {
                let (a, b) = (number * 7 % 13, number * 5 % 11);
                Wide { piece: 0, segment: number, a, b, room: rooms[number as usize % 3] }
            })
            .collect();
        let at_nodes = AtNodes::of(&wide);
        let id = crate::FeatureId { source: 0, numbering: crate::Numbering::Way, number: 1 };
        let face = |nodes: Vec<u32>, own| Face {
            class: 1,
            id,
            corners: Vec::new(),
            is_deck: false,
            centreline: None,
            nodes,
            wide: own,
        };
        for nodes in [vec![0], vec![3, 1], vec![12, 2, 12], vec![99], Vec::new()] {
            let meets = |of: &Wide| of.room != Room::None && nodes.iter().any(|node| of.a == *node || of.b == *node);
            let all: Vec<u32> = (0..60).filter(|number| meets(&wide[*number as usize])).collect();
            assert_eq!(at_nodes.wide_of(&face(nodes.clone(), None), &wide), all, "{nodes:?}");
        }
        assert_eq!(at_nodes.wide_of(&face(vec![0], Some(4)), &wide), [4]);
    }
}
