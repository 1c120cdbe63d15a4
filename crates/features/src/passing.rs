//! What passes beneath decks, over their whole area: where the strip of a deck lies over another strip, over water, or
//! over a line of the ground, and how much of its clearance is missing there.

use std::collections::{BTreeMap, BTreeSet};

use crate::clean::Notes;
use crate::decks::{Clearances, Passage, Water, bend, between, passages};
use crate::exact::Segment;
use crate::pieces::strip_width;
use crate::sweep::{Swept, highest};
use crate::{Flaw, Kind, Network, Place, Remark, Remedy, Storey};

/// Quanta along ways from the ends of a deck within which others lie beside it rather than under it: 100 m.
const BESIDE: i32 = 100 * 128;

/// Rounds in which decks are raised: those of several storeys raise one another.
const CLEAR_ROUNDS: usize = 4;

/// Steps of the cells in which edges are looked up: about as long as an edge.
const CELL: i32 = 1 << 7;

/// A deck's edge over something: the passage, the edge, and what lies below, an edge or a piece of water counted on
/// from the edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Over {
    pub passage: u32,
    pub edge: u32,
    pub below: u32,
    /// Whether it passes beneath, and does not only lie beside.
    pub passes: bool,
}

/// Where clearance is missing: how much, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Lack {
    pub passage: u32,
    pub edge: u32,
    pub lack: i32,
    pub place: Place,
}

/// A corner of an area, in steps east and north.
type Corner = [f64; 2];

/// What decks keep clear of beside the ways of their own network.
#[derive(Clone, Copy)]
pub struct Below<'a> {
    /// Water, at its heights.
    pub water: &'a [Water],
    /// Whether there is ground at a place. Beyond the area ways keep the heights at which they leave it, however it
    /// goes on, so nothing is known there of what lies above what.
    pub is_known: &'a dyn Fn(Place) -> bool,
}

impl Below<'_> {
    /// Ways alone, with ground everywhere.
    pub const WAYS: Self = Self { water: &[], is_known: &|_| true };
}

/// Raises decks clear of what they cross as far as the grade allows; what is left is written down. A tunnel counts as
/// no higher than the `ground` over it, whatever its ends ask for.
pub(crate) fn clear(
    network: &Network,
    swept: &mut Swept,
    ground: &[Option<i32>],
    below: Below,
    clearances: Clearances,
    remarks: &mut Vec<Remark>,
) {
    let decks = passages(network);
    if !decks.iter().any(|passage| passage.is_deck) {
        return;
    }
    let mut overs = overs(network, &decks, below.water);
    // A round more for decks whose road below was raised with them.
    for _ in 0..CLEAR_ROUNDS {
        let lacks =
            lacks(network, [&swept.heights, &beneath(network, &swept.heights, ground)], &overs, below, clearances);
        if lacks.is_empty() {
            break;
        }
        let mut needed: Vec<i32> = vec![i32::MIN / 2; network.nodes.len()];
        for lack in &lacks {
            let passage = &decks[lack.passage as usize];
            // A long deck rises where that is missing, a short one as a whole.
            let ends = [passage.nodes[0], passage.nodes[passage.nodes.len() - 1]];
            let bearing = if passage.is_long(network) { network.ends(lack.edge) } else { ends };
            for end in bearing {
                let raised = (swept.heights[end as usize] + lack.lack).min(swept.most[end as usize]);
                needed[end as usize] = needed[end as usize].max(raised);
            }
        }
        let least = highest(network, &swept.costs, needed);
        for (height, least) in swept.heights.iter_mut().zip(least) {
            *height = (*height).max(least);
        }
        bend(network, &swept.costs, &mut swept.heights);
    }
    // The ground may be cut away, or bored through.
    let belows = Belows { network, water: below.water };
    overs.retain(|over| belows.kind(over.below) != Kind::Breakline);
    let heights = [&swept.heights[..], &beneath(network, &swept.heights, ground)];
    for Lack { edge, lack, place, .. } in lacks(network, heights, &overs, below, clearances) {
        let id = network.ways[network.edges[edge as usize].way as usize].id;
        let flaw = Flaw::ClearanceLacks { quanta: lack };
        Notes { id, lattice: network.lattice, remarks }.write_at(place, flaw, Remedy::LeftAsItIs);
    }
}

/// The longest bridge that is laid on the ground where it lies below a stream that it crosses, in quanta: 40 m.
const SHORT_MAX: i32 = 40 * 128;

/// Edges of short bridges that have come to lie below a stream that they cross, as where the DEM has the stream on its
/// bank: a deck there would stand as a wall across its own road, where the stream passes well in a culvert.
pub(crate) fn drowned(network: &Network, heights: &[i32], streams: &[Water], remarks: &mut [Remark]) -> BTreeSet<u32> {
    let length = |passage: &Passage| passage.edges.iter().map(|edge| network.edges[*edge as usize].length).sum::<i32>();
    let mut decks = passages(network);
    decks.retain(|passage| passage.is_deck && length(passage) <= SHORT_MAX);
    let belows = Belows { network, water: streams };
    let mut edges = BTreeSet::new();
    for over in overs(network, &decks, streams).into_iter().filter(|over| over.passes) {
        let crossing = network.segment(over.edge).crossing(&belows.segment(over.below));
        let is_below = |place| belows.height(heights, over.edge, place) < belows.height(heights, over.below, place);
        if belows.water(over.below).is_some() && crossing.is_some_and(is_below) {
            edges.extend(&decks[over.passage as usize].edges);
        }
    }
    let ids: BTreeSet<_> =
        edges.iter().map(|edge| network.ways[network.edges[*edge as usize].way as usize].id).collect();
    let too_low = |remark: &&mut Remark| ids.contains(&remark.id) && matches!(remark.flaw, Flaw::ClearanceLacks { .. });
    remarks.iter_mut().filter(too_low).for_each(|remark| remark.remedy = Remedy::Culvert);
    edges
}

/// All decks over all that they may have to clear.
fn overs(network: &Network, decks: &[Passage], water: &[Water]) -> Vec<Over> {
    let belows = Belows { network, water };
    let mut overs = Vec::new();
    let cells = belows.cells(decks);
    let beside: Vec<BTreeSet<u32>> = decks.iter().map(|passage| beside(network, passage)).collect();
    for below in 0..belows.count() {
        let mut near = BTreeSet::new();
        cells_of(belows.segment(below), belows.half(below), |cell| near.extend(cells.get(&cell).into_iter().flatten()));
        for &(passage, edge) in &near {
            if belows.layer(edge) <= belows.layer(below) || belows.meets(edge, below) || belows.are_apart(edge, below) {
                continue;
            }
            let passes = network.segment(edge).crossing(&belows.segment(below)).is_some();
            let is_other = passes || !beside[passage as usize].contains(&below);
            if is_other && 3 <= belows.common(edge, below).len() {
                overs.push(Over { passage, edge, below, passes });
            }
        }
    }
    overs.sort_unstable();
    belows.pass_beneath(&mut overs);
    overs
}

/// The heights of a network for what lies below decks: inside tunnels no more than the ground.
fn beneath(network: &Network, heights: &[i32], ground: &[Option<i32>]) -> Vec<i32> {
    let lower = |(node, (&height, ground)): (u32, (&i32, &Option<i32>))| match ground {
        Some(ground) if network.is_in_tunnel(node) => height.min(*ground),
        _ => height,
    };
    (0..).zip(heights.iter().zip(ground)).map(lower).collect()
}

/// Where clearance is missing over anything: of each deck over each feature the worst. Heights are those of decks, and
/// those of what lies below.
fn lacks(
    network: &Network,
    [heights, beneath]: [&[i32]; 2],
    overs: &[Over],
    below: Below,
    clearances: Clearances,
) -> Vec<Lack> {
    let belows = Belows { network, water: below.water };
    let mut worst: BTreeMap<(u32, u64), Lack> = BTreeMap::new();
    for over in overs {
        let clearance = if over.passes { clearances.over(belows.kind(over.below)) } else { 0 };
        let lack = |corner: &Corner| {
            let place = Place::new((corner[1] + 0.5).floor() as i32, (corner[0] + 0.5).floor() as i32);
            let deck = belows.height(heights, over.edge, place);
            let below = belows.height(beneath, over.below, place);
            Lack { passage: over.passage, edge: over.edge, lack: below + clearance - deck, place }
        };
        let common = belows.common(over.edge, over.below);
        let known = common.iter().map(lack).filter(|lack| (below.is_known)(lack.place));
        let Some(found) = known.max_by_key(|lack| (lack.lack, lack.place)) else { continue };
        if 0 < found.lack {
            let of = worst.entry((over.passage, belows.feature(over.below))).or_insert(found);
            *of = if of.lack < found.lack { found } else { *of };
        }
    }
    worst.into_values().collect()
}

/// Ground ways that leave the ends of a deck, as far as they lie beside it.
fn beside(network: &Network, passage: &Passage) -> BTreeSet<u32> {
    let mut found = BTreeSet::new();
    if !passage.is_deck {
        return found;
    }
    let mut reached: BTreeMap<u32, i32> = BTreeMap::new();
    let mut open: Vec<(u32, i32)> =
        [passage.nodes[0], passage.nodes[passage.nodes.len() - 1]].iter().map(|end| (*end, 0)).collect();
    while let Some((node, gone)) = open.pop() {
        if BESIDE < gone || reached.get(&node).is_some_and(|before| *before <= gone) {
            continue;
        }
        reached.insert(node, gone);
        for &(next, edge) in network.beside(node) {
            found.insert(edge);
            open.push((next, gone + network.edges[edge as usize].length.max(1)));
        }
    }
    found
}

fn cells_of(segment: Segment, reach: f64, mut each: impl FnMut((i32, i32))) {
    let reach = reach.ceil() as i32 + 1;
    let span = |a: i32, b: i32| (a.min(b) - reach).div_euclid(CELL)..=(a.max(b) + reach).div_euclid(CELL);
    for row in span(segment.a.row, segment.b.row) {
        span(segment.a.col, segment.b.col).for_each(|col| each((row, col)));
    }
}

/// Edges of a network, and pieces of water counted on from them.
struct Belows<'a> {
    network: &'a Network,
    water: &'a [Water],
}

impl Belows<'_> {
    fn edges(&self) -> u32 {
        self.network.edges.len() as u32
    }

    fn count(&self) -> u32 {
        self.edges() + self.water.len() as u32
    }

    /// Decks' edges with their passages, by the cells that they reach into.
    fn cells(&self, decks: &[Passage]) -> BTreeMap<(i32, i32), Vec<(u32, u32)>> {
        let mut cells: BTreeMap<(i32, i32), Vec<(u32, u32)>> = BTreeMap::new();
        for (number, passage) in decks.iter().enumerate().filter(|(_, passage)| passage.is_deck) {
            for &edge in &passage.edges {
                let segment = self.network.segment(edge);
                cells_of(segment, self.half(edge), |cell| cells.entry(cell).or_default().push((number as u32, edge)));
            }
        }
        cells
    }

    fn water(&self, number: u32) -> Option<&Water> {
        number.checked_sub(self.edges()).map(|number| &self.water[number as usize])
    }

    fn segment(&self, number: u32) -> Segment {
        self.water(number)
            .map_or_else(|| self.network.segment(number), |water| Segment { a: water.ends[0], b: water.ends[1] })
    }

    fn kind(&self, number: u32) -> Kind {
        self.water(number).map_or_else(|| self.network.traits(number).kind, |water| water.kind)
    }

    /// What stands for the feature of an edge or a piece of water.
    fn feature(&self, number: u32) -> u64 {
        let of_way = |number: u32| u64::from(self.network.edges[number as usize].way);
        self.water(number).map_or_else(|| of_way(number), |water| 1 << 32 | water.kind as u64)
    }

    /// Half its width, in steps; a line of water has none, its banks are lines of their own.
    fn half(&self, number: u32) -> f64 {
        let quanta = f64::from(2 * self.network.lattice.quanta_per_step());
        self.water(number)
            .map_or_else(|| f64::from(strip_width(self.network.traits(number), self.network.lattice)) / quanta, |_| 0.0)
    }

    fn layer(&self, number: u32) -> i32 {
        match self.water(number).is_none().then(|| self.network.traits(number).storey) {
            Some(Storey::Deck(layer)) => i32::from(layer.max(1)),
            Some(Storey::Tunnel(layer)) => i32::from(layer.min(-1)),
            _ => 0,
        }
    }

    fn meets(&self, edge: u32, below: u32) -> bool {
        let ends = |number: u32| {
            let edge = &self.network.edges[number as usize];
            [edge.a, edge.b]
        };
        self.water(below).is_none() && ends(edge).iter().any(|end| ends(below).contains(end))
    }

    fn height(&self, heights: &[i32], number: u32, place: Place) -> i32 {
        let Segment { a, b } = self.segment(number);
        let levels = self.water(number).map_or_else(
            || {
                let edge = &self.network.edges[number as usize];
                [edge.a, edge.b].map(|end| heights[end as usize])
            },
            |water| water.heights,
        );
        between([a, b], levels, place)
    }

    /// Whether the boxes of a deck's edge and of what lies below are apart, with their widths: they have nothing in
    /// common.
    fn are_apart(&self, edge: u32, below: u32) -> bool {
        let reach = (self.half(edge) + self.half(below)).ceil() as i32 + 2;
        let (one, other) = (self.segment(edge), self.segment(below));
        let are = |a: i32, b: i32, c: i32, d: i32| a.max(b) + reach < c.min(d) || c.max(d) + reach < a.min(b);
        are(one.a.col, one.b.col, other.a.col, other.b.col) || are(one.a.row, one.b.row, other.a.row, other.b.row)
    }

    /// The area that a deck's edge and what lies below have in common: none where that is less than a triangle. Of a
    /// line it is where the line runs inside.
    fn common(&self, edge: u32, below: u32) -> Vec<Corner> {
        let area = strip(self.network.segment(edge), self.half(edge));
        let own = strip(self.segment(below), self.half(below).max(0.5));
        let mut corners = own.to_vec();
        for at in 0..4 {
            corners = left_of(&corners, area[at], area[(at + 1) % 4]);
        }
        corners
    }

    /// What has the feature of one that passes beneath near by passes beneath, too.
    fn pass_beneath(&self, overs: &mut [Over]) {
        let mut crossed: BTreeMap<(u32, u64), Vec<Place>> = BTreeMap::new();
        for over in overs.iter().filter(|over| over.passes) {
            let place = self.network.segment(over.edge).crossing(&self.segment(over.below));
            crossed.entry((over.passage, self.feature(over.below))).or_default().extend(place);
        }
        for over in overs.iter_mut().filter(|over| !over.passes) {
            let Some(places) = crossed.get(&(over.passage, self.feature(over.below))) else { continue };
            let reach = 2.0 * (self.half(over.edge) + self.half(over.below));
            let is_near = |corner: &Corner| {
                places.iter().any(|place| {
                    let [east, north] = [corner[0] - f64::from(place.col), corner[1] - f64::from(place.row)];
                    east * east + north * north <= reach * reach
                })
            };
            over.passes = self.common(over.edge, over.below).iter().any(is_near);
        }
    }
}

/// The corners of a segment with a width, counter-clockwise.
fn strip(Segment { a, b }: Segment, half: f64) -> [Corner; 4] {
    let [east, north] = a.to(b).map(|steps| steps as f64);
    let length = (east * east + north * north).sqrt().max(1e-9);
    let aside = [-north * half / length, east * half / length];
    let corner =
        |place: Place, sign: f64| [f64::from(place.col) + sign * aside[0], f64::from(place.row) + sign * aside[1]];
    [corner(a, -1.0), corner(b, -1.0), corner(b, 1.0), corner(a, 1.0)]
}

/// What of a convex polygon lies to the left of a line.
fn left_of(polygon: &[Corner], from: Corner, to: Corner) -> Vec<Corner> {
    let side = |corner: Corner| (to[0] - from[0]) * (corner[1] - from[1]) - (to[1] - from[1]) * (corner[0] - from[0]);
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (at, &corner) in polygon.iter().enumerate() {
        let next = polygon[(at + 1) % polygon.len()];
        let (here, there) = (side(corner), side(next));
        if 0.0 <= here {
            kept.push(corner);
        }
        if (here < 0.0 && 0.0 < there) || (there < 0.0 && 0.0 < here) {
            let share = here / (here - there);
            kept.push([0, 1].map(|axis| corner[axis] + share * (next[axis] - corner[axis])));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{network, way};
    use crate::{GradeOptions, grade};

    #[test]
    fn a_deck_clears_a_railway_over_its_whole_area_and_not_on_its_middle_alone() {
        let sources = vec![
            way(1, "highway=motorway", &[(10.0, 20.0), (40.0, 20.0)]),
            way(2, "highway=motorway bridge=yes", &[(40.0, 20.0), (60.0, 20.0)]),
            way(3, "highway=motorway", &[(60.0, 20.0), (90.0, 20.0)]),
            // At an acute angle, rising by its grade.
            way(4, "railway=rail", &[(30.0, 16.0), (70.0, 24.0)]),
        ];
        let (network, ground, mut remarks) = network(sources, |east, _| 10.0 + east * 0.25);
        let heights = grade(&network, [&ground, &ground], &[], Below::WAYS, GradeOptions::USUAL, &mut remarks);
        let decks = passages(&network);
        let found = overs(&network, &decks, &[]);
        assert!(found.iter().any(|over| over.passes) && 2 < found.len());
        assert_eq!(lacks(&network, [&heights; 2], &found, Below::WAYS, Clearances::USUAL), []);
        let raised = Clearances { rail: Clearances::USUAL.rail + 16, ..Clearances::USUAL };
        assert_eq!(lacks(&network, [&heights; 2], &found, Below::WAYS, raised).len(), 1, "no higher than it has to be");
    }

    #[test]
    fn looking_near_by_finds_all_that_decks_lie_over() {
        let street = |at: i64| {
            let north = 10.0 + 7.0 * at as f64;
            way(at, "highway=residential", &[(10.0, north), (95.0, north + 2.0)])
        };
        let bridge = |at: i64| {
            let from = 15.0 + 6.0 * at as f64;
            way(100 + at, "highway=motorway bridge=yes", &[(from, 8.0), (3.0 * from - 90.0, 80.0)])
        };
        let sources = (0..10).map(street).chain((0..10).map(bridge)).collect();
        let (network, ..) = network(sources, |_, _| 10.0);
        let (decks, belows) = (passages(&network), Belows { network: &network, water: &[] });
        let mut all = Vec::new();
        for (passage, deck) in (0..).zip(&decks).filter(|(_, deck)| deck.is_deck) {
            let aside = beside(&network, deck);
            for (&edge, below) in deck.edges.iter().flat_map(|edge| (0..belows.count()).map(move |below| (edge, below)))
            {
                let is_below = belows.layer(below) < belows.layer(edge) && !belows.meets(edge, below);
                let passes = network.segment(edge).crossing(&network.segment(below)).is_some();
                if is_below && (passes || !aside.contains(&below)) && 3 <= belows.common(edge, below).len() {
                    all.push((passage, edge, below));
                }
            }
        }
        all.sort_unstable();
        let found = overs(&network, &decks, &[]);
        assert!(20 < found.len(), "{}", found.len());
        assert_eq!(found.iter().map(|over| (over.passage, over.edge, over.below)).collect::<Vec<_>>(), all);
    }

    #[test]
    fn what_two_strips_have_in_common_is_cut_to_both() {
        let square = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
        assert_eq!(left_of(&square, [5.0, 0.0], [5.0, 1.0]), [[0.0, 0.0], [5.0, 0.0], [5.0, 10.0], [0.0, 10.0]]);
        assert_eq!(left_of(&square, [-1.0, 0.0], [-1.0, 1.0]), [[0.0; 2]; 0]);
    }
}
