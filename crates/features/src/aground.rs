//! Ground in the way of decks: they clear it as they clear a road, but for what may be cut away.
//!
//! The DEM is asked along both sides of every deck. Through a hill higher than ramps could reach no deck leads: a way
//! becomes a tunnel there, which is written down.

use std::collections::BTreeMap;

use crate::clean::Notes;
use crate::decks::{Passage, Water, between, passages};
use crate::pieces::{is_narrow, moved, strip_width};
use crate::{Edge, FeatureId, Flaw, Kind, Network, Place, Remark, Remedy};

/// Times of what it may be cut that ground may stand above a deck, which is then raised with its ramps.
const HILL_CUTS: i32 = 3;

/// Quanta that ground stays below a deck where it may: half a metre.
pub const DECK_GAP: i32 = 64;

/// The height of the ground at a place, where there is one.
type Ground<'a> = &'a dyn Fn(Place) -> Option<i32>;

/// Places on the edges of decks, by edge: along its left side and its right side, from its first end on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Beside(BTreeMap<u32, [Vec<Place>; 2]>);

impl Beside {
    /// Those of a network: at least three along every edge, half a post apart.
    pub fn of(network: &Network) -> Self {
        let mut beside = BTreeMap::new();
        for passage in passages(network).iter().filter(|passage| passage.is_deck) {
            let directions = directions(network, &passage.nodes);
            for (at, &edge) in passage.edges.iter().enumerate() {
                if is_narrow(network.traits(edge), network) {
                    continue;
                }
                let ends = [passage.nodes[at], passage.nodes[at + 1]];
                let along = [directions[at], directions[at + 1]];
                let mut lines = [1.0, -1.0].map(|sign| stations(network, edge, ends, along, sign));
                if network.edges[edge as usize].a != ends[0] {
                    lines.reverse();
                    lines.iter_mut().for_each(|places| places.reverse());
                }
                beside.insert(edge, lines);
            }
        }
        Self(beside)
    }

    /// All of them.
    pub fn places(&self) -> impl Iterator<Item = Place> + '_ {
        self.0.values().flatten().flatten().copied()
    }
}

/// Unit vectors along a run of nodes, at each from the one before to the next.
fn directions(network: &Network, nodes: &[u32]) -> Vec<[f64; 2]> {
    let place = |at: usize| network.nodes[nodes[at] as usize].place;
    let last = nodes.len() - 1;
    (0..nodes.len()).map(|at| unit(place(at.saturating_sub(1)), place((at + 1).min(last)))).collect()
}

fn unit(from: Place, to: Place) -> [f64; 2] {
    let [east, north] = from.to(to).map(|steps| steps as f64);
    let length = (east * east + north * north).sqrt().max(1.0);
    [east / length, north / length]
}

/// Places on one side of an edge, mitred at its ends.
fn stations(network: &Network, edge: u32, ends: [u32; 2], along: [[f64; 2]; 2], sign: f64) -> Vec<Place> {
    let lattice = network.lattice;
    let [from, to] = ends.map(|node| network.nodes[node as usize].place);
    let half = f64::from(strip_width(network.traits(edge), lattice)) / (2.0 * f64::from(lattice.quanta_per_step()));
    let own = unit(from, to);
    let aside = along.map(|[east, north]| {
        let reach = sign * half / (east * own[0] + north * own[1]).max(0.5);
        [-north * reach, east * reach]
    });
    let [east, north] = from.to(to).map(|steps| steps as f64);
    let parts = parts(network, edge);
    (0..=parts)
        .map(|at| {
            let share = f64::from(at) / f64::from(parts);
            let off = |axis: usize| aside[0][axis] + share * (aside[1][axis] - aside[0][axis]);
            moved(from, share * east + off(0), share * north + off(1))
        })
        .collect()
}

/// Parts of an edge between stations: no longer than half a post, and two at least.
fn parts(network: &Network, edge: u32) -> i32 {
    let post = network.lattice.quanta_per_step() * network.lattice.steps_per_post();
    (2 * network.edges[edge as usize].length / post + 1).max(2)
}

/// Edges of decks above which the ground stands so high that no cut and no ramp would do, each with how far.
pub(crate) fn under_hills(network: &Network, ground: &[Option<i32>], cut_max: i32) -> BTreeMap<u32, i32> {
    let mut edges = BTreeMap::new();
    for passage in passages(network).iter().filter(|passage| passage.is_deck) {
        let above = above_line(network, passage, ground);
        for (at, &edge) in passage.edges.iter().enumerate() {
            let highest = above[at].max(above[at + 1]);
            if HILL_CUTS * cut_max < highest {
                edges.insert(edge, highest);
            }
        }
    }
    edges
}

/// Edges of decks that have come to lie farther under the ground than it may be cut away, each with how far.
pub(crate) fn still_under(
    network: &Network,
    heights: &[i32],
    (beside, ground): (&Beside, Ground),
    cut_max: i32,
) -> BTreeMap<u32, i32> {
    let is_deck = |edge: u32| network.traits(edge).storey.is_deck();
    let above = |(&edge, sides): (&u32, &[Vec<Place>; 2])| {
        let ends = network.ends(edge);
        let levels = ends.map(|end| heights[end as usize]);
        let segment = network.segment(edge);
        let deck = |place: Place| between([segment.a, segment.b], levels, place);
        let highest = sides.iter().flatten().filter_map(|&place| Some(ground(place)? - deck(place))).max()?;
        (cut_max < highest).then_some((edge, highest))
    };
    beside.0.iter().filter(|(edge, _)| is_deck(**edge)).filter_map(above).collect()
}

/// Writes down of each feature which of its decks have become tunnels, and returns how many quanta these are long.
pub(crate) fn tell_of_hills(network: &Network, edges: &BTreeMap<u32, i32>, remarks: &mut Vec<Remark>) -> i64 {
    // Of each feature how far the ground stands above it at most, where, and quanta of length.
    let mut told: BTreeMap<FeatureId, (i32, Place, i64)> = BTreeMap::new();
    for (&edge, &highest) in edges {
        let Edge { a, way, length, .. } = network.edges[edge as usize];
        let place = network.nodes[a as usize].place;
        let of = told.entry(network.ways[way as usize].id).or_insert((highest, place, 0));
        let worst = (of.0, of.1).max((highest, place));
        *of = (worst.0, worst.1, of.2 + i64::from(length));
    }
    for (&id, &(quanta, place, length)) in &told {
        let metres = (length / i64::from(terrain::QUANTA_PER_METRE)) as u32;
        let mut notes = Notes { id, lattice: network.lattice, remarks };
        notes.write_at(place, Flaw::GroundAboveDeck { quanta, metres }, Remedy::Tunnel);
    }
    told.values().map(|(_, _, length)| length).sum()
}

/// How far the ground at each node of a deck stands above the straight line between its ends; where that is not known
/// it is as good as far below.
fn above_line(network: &Network, passage: &Passage, ground: &[Option<i32>]) -> Vec<i32> {
    let known = |node: &u32| ground[*node as usize];
    let (Some(from), Some(to)) = (known(&passage.nodes[0]), passage.nodes.last().and_then(known)) else {
        return vec![i32::MIN; passage.nodes.len()];
    };
    let length = |edge: &u32| i64::from(network.edges[*edge as usize].length);
    let all: i64 = passage.edges.iter().map(length).sum();
    let mut gone = 0;
    let mut above = vec![i32::MIN];
    for (node, edge) in passage.nodes[1..].iter().zip(&passage.edges) {
        gone += length(edge);
        let line = i64::from(from) + (i64::from(to) - i64::from(from)) * gone / all.max(1);
        above.push(known(node).map_or(i32::MIN, |ground| ground.saturating_sub(line as i32)));
    }
    above
}

/// Ground under decks as something they have to clear, as far as it may not be cut away: lines across them.
pub(crate) fn uncut(network: &Network, (beside, ground): (&Beside, Ground), cut_max: i32) -> Vec<Water> {
    let is_deck = |edge: u32| network.traits(edge).storey.is_deck();
    let mut lines = Vec::new();
    for (&edge, [left, right]) in beside.0.iter().filter(|(edge, _)| is_deck(**edge)) {
        let Edge { a, b, .. } = network.edges[edge as usize];
        for (at, (&one, &other)) in left.iter().zip(right).enumerate() {
            // At its ends a deck rests on the ground.
            let ends = [(0, a), (left.len() - 1, b)];
            let rests = ends.iter().any(|(end, node)| *end == at && network.nodes[*node as usize].on_ground);
            if let Some(top) = ground(one).max(ground(other)).filter(|_| !rests && one != other) {
                lines.push(Water { ends: [one, other], heights: [top - cut_max + DECK_GAP; 2], kind: Kind::Breakline });
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::Levelled;
    use crate::samples::{self, site, way};
    use crate::{Shares, Source};

    fn levelled(sources: Vec<Source>, metres: impl Fn(f64, f64) -> f64) -> Levelled {
        samples::levelled(sources, metres, &Shares::each([20, 20], 1000))
    }

    /// A road with a bridge between two posts east.
    fn bridge(from: f64, to: f64) -> Vec<Source> {
        vec![
            way(1, "highway=primary", &[(from - 15.0, 20.0), (from, 20.0)]),
            way(2, "highway=primary bridge=yes", &[(from, 20.0), (to, 20.0)]),
            way(3, "highway=primary", &[(to, 20.0), (to + 15.0, 20.0)]),
        ]
    }

    fn is_told(levelled: &Levelled) -> bool {
        let is_hill = |remark: &Remark| matches!(remark.flaw, Flaw::GroundAboveDeck { .. }) && remark.remedy.degrades();
        levelled.remarks.iter().any(is_hill)
    }

    /// The least and the greatest height of corners of decks, in metres.
    fn reach(levelled: &Levelled) -> (f64, f64) {
        let corners = levelled.reserved.formed.decks.iter().flat_map(|deck| &deck.corners);
        let heights = || corners.clone().map(|(_, height)| terrain::metres_of_quanta(*height));
        (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max))
    }

    #[test]
    fn a_bridge_over_a_gorge_stays_as_it_is() {
        let gorge = |east: f64, _: f64| 100.0 - 3.0 * (10.0 - (east - 50.0).abs()).clamp(0.0, 8.0);
        let levelled = levelled(bridge(40.0, 60.0), gorge);
        assert!(!is_told(&levelled) && (99.0..101.0).contains(&reach(&levelled).0));
    }

    #[test]
    fn a_deck_rises_over_ground_that_may_not_be_cut_away() {
        let hump = |east: f64, _: f64| if 45.0 < east && east < 55.0 { 24.0 } else { 10.0 };
        let levelled = levelled(bridge(40.0, 60.0), hump);
        assert!(!is_told(&levelled) && 14.0 < reach(&levelled).1, "{:?}", reach(&levelled));
    }

    #[test]
    fn no_deck_leads_through_a_hill_in_the_way_and_no_ramp_is_built_for_it() {
        let hill = |east: f64, _: f64| 100.0 + (147.0 - (east - 170.0).abs() * 4.0).max(0.0);
        let levelled = levelled(bridge(50.0, 290.0), hill);
        // Beside it ramps may reach three cuts up.
        assert!(is_told(&levelled) && reach(&levelled).1 < 130.0, "{:?}", reach(&levelled));
        let metres = levelled.through_hills / i64::from(terrain::QUANTA_PER_METRE);
        assert!((500..800).contains(&metres), "{metres}");
        let corners = levelled.reserved.formed.decks.iter().flat_map(|deck| &deck.corners);
        let east = |place: Place| site().lattice.posts_of(place)[0];
        assert!(corners.clone().all(|(place, _)| 10.0 < (east(*place) - 170.0).abs()), "through the middle");
        assert_eq!(levelled.reserved.loose_ends, [], "a portal is no end");
    }
}
