//! Who gets the room where strips overlap: the higher class; the other becomes narrower, then a line.

use std::cmp::Ordering;
use std::collections::{BTreeSet, HashSet};

use terrain::QUANTA_PER_METRE;

use crate::clean::Notes;
use crate::exact::Segment;
use crate::pieces::Piece;
use crate::quarters::SegmentPairs;
use crate::strips::{Arm, Face, Room, Wide, arms, faces, has_room, wide_segments};
use crate::{FeatureLattice, Flaw, Network, Place, Remark, Remedy};

/// Rounds of narrowing: each takes a strip that overlaps from whole to half or from half to none.
const ROUNDS: usize = 4;

/// Strips of a network while they share out the room where they overlap.
pub(crate) struct Sharing<'a> {
    network: &'a Network,
    pieces: &'a [Piece],
    heights: &'a [i32],
    /// All strip segments.
    pub wide: Vec<Wide>,
    /// Those that end at each node.
    pub at_nodes: AtNodes,
    arms: Vec<Arm>,
    /// Of each node whether a segment that ends there has less room than when overlaps were last looked for: what has
    /// no such node lies as it did.
    is_new: Vec<bool>,
}

impl<'a> Sharing<'a> {
    /// All strips with the room they ask for.
    pub fn of(network: &'a Network, pieces: &'a [Piece], heights: &'a [i32]) -> Self {
        let wide = wide_segments(pieces);
        let (at_nodes, arms) = (AtNodes::of(&wide), arms(network, pieces, &wide));
        Self { network, pieces, heights, wide, at_nodes, arms, is_new: vec![true; network.nodes.len()] }
    }

    /// Leaves a strip segment less room.
    pub fn narrow(&mut self, number: u32, room: Room) {
        let of = &mut self.wide[number as usize];
        of.room = room;
        [of.a, of.b].into_iter().for_each(|node| self.is_new[node as usize] = true);
    }

    /// The faces of all strips in the room that they have.
    pub fn faces(&self) -> Vec<Face> {
        faces(self.network, self.pieces, (&self.wide, &self.arms), self.heights)
    }

    /// What is left of a strip between the lines that the rest of its way became: short, and it meets no other.
    pub fn alone(&self) -> Vec<u32> {
        let Self { network, wide, at_nodes, .. } = self;
        let numbered: Vec<(u32, &Wide)> = (0..).zip(wide).collect();
        let mut alone = Vec::new();
        for of_piece in numbered.chunk_by(|(_, a), (_, b)| a.piece == b.piece) {
            if of_piece.iter().all(|(_, of)| of.room != Room::None) {
                continue;
            }
            let goes_on = |(_, a): &(u32, &Wide), (_, b): &(u32, &Wide)| {
                a.segment + 1 == b.segment && (a.room == Room::None) == (b.room == Room::None)
            };
            for run in of_piece.chunk_by(goes_on).filter(|run| run[0].1.room != Room::None) {
                let places = |of: &Wide| [of.a, of.b].map(|node| network.nodes[node as usize].place);
                let length = |(_, of): &(u32, &Wide)| network.lattice.length(places(of)[0], places(of)[1]);
                let (first, last) = (run[0], run[run.len() - 1]);
                let meets = |node: u32, own: u32| {
                    at_nodes.at(node).any(|number| number != own && wide[number as usize].room != Room::None)
                };
                if run.iter().map(length).sum::<i64>() <= ALONE_MAX
                    && !meets(first.1.a, first.0)
                    && !meets(last.1.b, last.0)
                {
                    alone.extend(run.iter().map(|(number, _)| *number));
                }
            }
        }
        alone
    }

    /// The faces of all strips after overlaps are resolved.
    pub fn share_out(&mut self) -> Vec<Face> {
        let mut found = self.faces();
        for _ in 0..ROUNDS {
            let losers = self.losers(&found);
            self.is_new.fill(false);
            if losers.is_empty() {
                break;
            }
            for loser in losers {
                let had = self.wide[loser as usize].room;
                self.narrow(loser, had.less());
            }
            found = self.faces();
        }
        found
    }
}

/// A strip of no more quanta that meets no other, on a way that is a line elsewhere, is a line there too: 50 m.
const ALONE_MAX: i64 = 50 * QUANTA_PER_METRE as i64;

/// The order of faces: by class, then by corners with their heights.
pub(crate) fn by_corners(a: &Face, b: &Face) -> Ordering {
    (a.class, &a.corners).cmp(&(b.class, &b.corners))
}

/// Squares of the plane that some boxes touch.
pub(crate) struct Squares {
    /// Steps of a square's side.
    side: i32,
    touched: HashSet<[i32; 2]>,
}

impl Squares {
    /// Metres of a square's side: farther than rounding and heights at shared places reach.
    const SIDE_M: f64 = 64.0;

    /// The squares that the boxes of `corners` touch, and those next to them.
    pub fn around<'a>(boxes: impl Iterator<Item = &'a [(Place, i32)]>, lattice: FeatureLattice) -> Self {
        let side = lattice.steps_in(Self::SIDE_M).max(1) as i32;
        Self { side, touched: boxes.flat_map(|corners| squares(corners, side, 1)).collect() }
    }

    /// Where faces differ from those before, all in the order of [`by_corners`].
    pub fn of_changed(before: &[Face], after: &[Face], lattice: FeatureLattice) -> Self {
        let changed = [(before, after), (after, before)].into_iter().flat_map(|(faces, others)| {
            faces.iter().filter(|face| others.binary_search_by(|other| by_corners(other, face)).is_err())
        });
        Self::around(changed.map(|face| &face.corners[..]), lattice)
    }

    /// Whether the box of some places touches one of them.
    pub fn have(&self, places: &[(Place, i32)]) -> bool {
        squares(places, self.side, 0).any(|square| self.touched.contains(&square))
    }
}

/// The squares of the box of some places, and `more` on each side.
fn squares(places: &[(Place, i32)], side: i32, more: i32) -> impl Iterator<Item = [i32; 2]> + use<> {
    let span = |of: fn(&(Place, i32)) -> i32| {
        let low = places.iter().map(of).min().map_or(0, |low| low.div_euclid(side) - more);
        low..places.iter().map(of).max().map_or(low, |high| high.div_euclid(side) + more + 1)
    };
    let (rows, cols) = (span(|(place, _)| place.row), span(|(place, _)| place.col));
    rows.flat_map(move |row| cols.clone().map(move |col| [row, col]))
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

impl Sharing<'_> {
    /// The strip segments that lose room to others, by pairs of which one is new: of all other pairs the loser has lost
    /// it, and is new by that.
    fn losers(&self, faces: &[Face]) -> BTreeSet<u32> {
        let Self { network, pieces, wide, .. } = self;
        let (mut segments, mut owners, mut parts): (Vec<Segment>, Vec<u32>, Vec<Part>) = Default::default();
        for (number, face) in faces.iter().enumerate().filter(|(_, face)| !face.is_deck) {
            let places = face.places();
            let least = places.iter().min().copied().unwrap_or(Place::new(0, 0));
            for at in 0..places.len() {
                segments.push(Segment { a: places[at], b: places[(at + 1) % places.len()] });
                owners.push(parts.len() as u32);
            }
            parts.push(Part { rank: (face.class, least), nodes: &face.nodes, face: Some(number as u32) });
        }
        for (number, piece) in pieces.iter().enumerate().filter(|(_, piece)| !piece.is_deck()) {
            for (segment, nodes) in piece.nodes.windows(2).enumerate() {
                if !has_room(wide, number as u32, segment as u32) {
                    let [a, b] = [nodes[0], nodes[1]].map(|node| network.nodes[node as usize].place);
                    segments.push(Segment { a, b });
                    owners.push(parts.len() as u32);
                    parts.push(Part { rank: (piece.traits.class, a.min(b)), nodes, face: None });
                }
            }
        }
        let mut losers = BTreeSet::new();
        let of_new: Vec<bool> =
            parts.iter().map(|part| part.nodes.iter().any(|node| self.is_new[*node as usize])).collect();
        let is_new = |segment: u32| of_new[owners[segment as usize] as usize];
        let mut found = |one: u32, other: u32| {
            let (s, t) = (&segments[one as usize], &segments[other as usize]);
            let (p, q) = (&parts[owners[one as usize] as usize], &parts[owners[other as usize] as usize]);
            if p.nodes.iter().any(|node| q.nodes.contains(node)) || s.crossing(t).is_none() {
                return;
            }
            let (winner, loser) = if p.rank < q.rank { (p, q) } else { (q, p) };
            // A line of lower class is cut where it lies in a strip; that costs no other feature room.
            if let (Some(face), true) = (loser.face, winner.face.is_some() || winner.rank.0 < loser.rank.0) {
                losers.extend(self.at_nodes.wide_of(&faces[face as usize], wide));
            }
        };
        let pairs = SegmentPairs::of(&segments);
        (0..pairs.rows()).for_each(|row| pairs.in_row(row, &is_new, &mut found));
        losers
    }
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

    /// The strip segments that end at a node.
    fn at(&self, node: u32) -> impl Iterator<Item = u32> {
        let first = self.0.partition_point(|(other, _)| *other < node);
        self.0[first..].iter().take_while(move |(other, _)| *other == node).map(|(_, number)| *number)
    }

    /// The strip segments that make a face: its own, or those that meet in a junction.
    pub fn wide_of(&self, face: &Face, wide: &[Wide]) -> Vec<u32> {
        let Some(own) = face.wide else {
            let meets = face.nodes.iter().flat_map(|node| self.at(*node));
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
    use crate::Grants;
    use crate::pieces::pieces;
    use crate::samples::{network, site, way};

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

    #[test]
    fn what_is_left_of_a_strip_between_lines_is_alone_where_it_is_short_and_meets_no_other() {
        let bends = [(10.0, 10.0), (20.0, 12.0), (23.0, 10.0), (33.0, 12.0), (36.0, 10.0)];
        let check = |more: Option<crate::Source>, lines: &[u32], alone: &[u32]| {
            let sources = [way(1, "highway=primary", &bends)].into_iter().chain(more).collect();
            let (network, _, _) = network(sources, |_, _| 10.0);
            let heights = vec![1280; network.nodes.len()];
            let pieces = pieces(&network, &heights, &site(), &|_| false, &Grants::default());
            let mut sharing = Sharing::of(&network, &pieces, &heights);
            // Segments by their westernmost end.
            let by_place = |number: &u32| {
                let of = &sharing.wide[*number as usize];
                [of.a, of.b].map(|node| network.nodes[node as usize].place.col).into_iter().min()
            };
            let mut numbers: Vec<u32> = (0..sharing.wide.len() as u32).collect();
            numbers.sort_by_key(by_place);
            lines.iter().for_each(|line| sharing.narrow(numbers[*line as usize], Room::None));
            let found: Vec<u32> = alone.iter().map(|line| numbers[*line as usize]).collect();
            assert_eq!(sharing.alone(), found, "{lines:?}");
        };
        check(None, &[], &[]);
        check(None, &[0, 2], &[1, 3]);
        check(None, &[0], &[]);
        check(None, &[2], &[3]);
        // Where the last one ends another strip begins.
        check(Some(way(2, "highway=primary", &[(36.0, 10.0), (36.0, 40.0), (45.0, 45.0)])), &[2], &[]);
    }

    #[test]
    fn what_is_looked_at_again_is_all_that_can_have_changed() {
        // Roads side by side and across, which overlap in every round.
        let tags = ["highway=motorway", "highway=primary", "highway=primary width=40"];
        let road = |at: i64| {
            let (tags, from, by) = (tags[at as usize % 3], 10.0 + 1.3 * at as f64, 0.6 * (at * at % 7) as f64);
            let line = if at % 4 == 0 { [(from, 8.0), (from + by, 90.0)] } else { [(8.0, from), (90.0, from + by)] };
            way(at, tags, &line)
        };
        let (network, ground, _) = network((0..40).map(road).collect(), |_, _| 10.0);
        let heights: Vec<i32> = ground.into_iter().map(|height| height.unwrap_or(0)).collect();
        let pieces = pieces(&network, &heights, &site(), &|_| false, &Grants::default());
        let mut sharing = Sharing::of(&network, &pieces, &heights);
        let mut reference = Sharing::of(&network, &pieces, &heights);
        for round in 0..3 {
            let found = sharing.share_out();
            let mut expected = reference.faces();
            for _ in 0..ROUNDS {
                reference.is_new.fill(true);
                for loser in reference.losers(&expected) {
                    let had = reference.wide[loser as usize].room;
                    reference.narrow(loser, if had == Room::Whole { Room::Half } else { Room::None });
                }
                expected = reference.faces();
            }
            assert_eq!(found, expected, "in round {round}");
            // As where a strip is tilted.
            for number in (round..sharing.wide.len() as u32).step_by(9) {
                sharing.narrow(number, Room::None);
                reference.narrow(number, Room::None);
            }
        }
        let rooms: BTreeSet<Room> = sharing.wide.iter().map(|of| of.room).collect();
        assert_eq!(rooms.len(), 3);
    }
}
