//! Bridges and tunnels: their ends, heights along them, and where they arch or sag between.

use crate::sweep::{highest, lowest};
use crate::{Kind, Network, Place};

/// Decks of at most so many quanta are straight whatever they cross: 100 m.
const STRAIGHT_MAX: i32 = 100 * 128;

/// What a deck keeps clear of, in quanta above it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clearances {
    /// Over roads and runways.
    pub road: i32,
    /// Over railways.
    pub rail: i32,
    /// Over rivers, streams and lakes.
    pub water: i32,
}

impl Clearances {
    /// 4.5 m over roads, 6 m over railways, 1 m over water.
    pub const USUAL: Self = Self { road: 4 * 128 + 64, rail: 6 * 128, water: 128 };

    pub(crate) fn over(&self, kind: Kind) -> i32 {
        match kind {
            Kind::Rail => self.rail,
            kind if kind.is_travelled() => self.road,
            Kind::River | Kind::Stream | Kind::Lake => self.water,
            _ => 0,
        }
    }
}

/// A piece of water that a deck may cross, with the heights of its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Water {
    /// Its ends.
    pub ends: [Place; 2],
    /// Heights of its ends, in quanta.
    pub heights: [i32; 2],
    /// River, stream or lake.
    pub kind: Kind,
}

/// A deck or a tunnel between two stations on the ground, or in the air where it forks.
pub(crate) struct Passage {
    pub nodes: Vec<u32>,
    pub edges: Vec<u32>,
    pub is_deck: bool,
}

/// All decks and tunnels of a network.
pub(crate) fn passages(network: &Network) -> Vec<Passage> {
    let picked = |edge: u32| !network.is_ground(edge);
    let is_deck = |edge: u32| network.traits(edge).storey.is_deck();
    let follows = |node: u32| match network.beside(node) {
        [(_, one), (_, other)] => !network.nodes[node as usize].on_ground && is_deck(*one) == is_deck(*other),
        _ => false,
    };
    let runs = network.runs(&picked, &follows).into_iter();
    runs.map(|(nodes, edges)| Passage { is_deck: is_deck(edges[0]), nodes, edges }).collect()
}

/// Raises the ends of decks to the top of banks that sag before them, and with them the stations between.
///
/// A DEM sags before the bridge begins where it falls more steeply than the way may even if its grade gives way: the
/// deck then rests on the highest station up to `back` quanta behind its end from which the ground falls so, if the
/// way runs on from there within its grade. A way that comes down a hillside within its grade, or a hillside without
/// end, is no such bank.
pub(crate) fn raise_sagging_ends(network: &Network, ground: &mut [Option<i32>], back: i32) {
    let mut raised: Vec<(u32, i32)> = Vec::new();
    for passage in passages(network).iter().filter(|passage| passage.is_deck) {
        let ends = [
            (&passage.nodes[0], &passage.nodes[1]),
            (&passage.nodes[passage.nodes.len() - 1], &passage.nodes[passage.nodes.len() - 2]),
        ];
        for (&end, &inside) in ends {
            if network.nodes[end as usize].on_ground {
                raise_bank(ground, &bank(network, end, inside, back), &mut raised);
            }
        }
    }
    for (node, height) in raised {
        let ground = &mut ground[node as usize];
        *ground = ground.map(|ground| ground.max(height));
    }
}

/// Stations back along the way from the end of a deck, each with what the way may rise from the one before, by its
/// grade, and where that gives way and nothing has to be level.
fn bank(network: &Network, end: u32, inside: u32, back: i32) -> Vec<(u32, [i32; 2])> {
    let (mut stations, mut gone, mut before, mut at) = (vec![(end, [0; 2])], 0, inside, end);
    loop {
        let came = network.nodes[before as usize].place.to(network.nodes[at as usize].place);
        let class = |edge: u32| network.traits(edge).class;
        let came_class = network.beside(at).iter().find(|(next, _)| *next == before).map(|(_, edge)| class(*edge));
        // Straight on, on a way of the same class if there is one.
        let onward = network.beside(at).iter().filter(|(next, edge)| *next != before && network.is_ground(*edge));
        let onward = onward.max_by_key(|(next, edge)| {
            let [east, north] = network.nodes[at as usize].place.to(network.nodes[*next as usize].place);
            let length = f64::from(network.edges[*edge as usize].length.max(1));
            let straight = (came[0] * east + came[1] * north) as f64 / length;
            (Some(class(*edge)) == came_class, (straight * 16.0) as i64, std::cmp::Reverse(*edge))
        });
        let Some(&(next, edge)) = onward else { return stations };
        gone += network.edges[edge as usize].length;
        if back < gone || stations.iter().any(|(node, _)| *node == next) {
            return stations;
        }
        stations.push((next, [network.edges[edge as usize].rise_max, network.steepest(edge)]));
        (before, at) = (at, next);
    }
}

fn raise_bank(ground: &[Option<i32>], stations: &[(u32, [i32; 2])], raised: &mut Vec<(u32, i32)>) {
    let height = |at: usize| ground[stations[at].0 as usize];
    let Some(end) = height(0) else { return };
    let (mut top, mut allowed) = (None, 0);
    for (at, station) in stations.iter().enumerate().skip(1) {
        allowed += station.1[1];
        let Some(here) = height(at) else { break };
        let falls = allowed < here - end;
        let runs_on = match stations.get(at + 1) {
            Some(next) => height(at + 1).is_some_and(|beyond| beyond - here <= next.1[0]),
            None => height(at - 1).is_some_and(|before| here - before <= station.1[0]),
        };
        if falls && runs_on && top.is_none_or(|(_, height)| height < here) {
            top = Some((at, here));
        }
    }
    if let Some((top, height)) = top {
        raised.extend(stations[..top].iter().map(|(node, _)| (*node, height)));
    }
}

/// Heights inside decks and tunnels: straight between their ends.
pub(crate) fn straighten(network: &Network, costs: &[i32], heights: &mut [i32]) {
    passages(network).iter().for_each(|passage| passage.lay(costs, heights, 0));
}

/// The same, but that long decks arch over what they have been raised for, and tunnels sag below what they have been
/// lowered for.
pub(crate) fn bend(network: &Network, costs: &[i32], heights: &mut [i32]) {
    for passage in passages(network) {
        let way = if !passage.is_deck { -1 } else { i64::from(passage.is_long(network)) };
        passage.lay(costs, heights, way);
    }
}

impl Passage {
    /// Whether it may arch.
    pub fn is_long(&self, network: &Network) -> bool {
        STRAIGHT_MAX < self.edges.iter().map(|edge| network.edges[*edge as usize].length).sum()
    }

    /// Lays it straight between its ends, or along the least line that nowhere sags and nowhere lies below its heights
    /// (`way` 1), or along the greatest that nowhere arches and nowhere lies above them (-1). Heights between go by
    /// shares of what its edges may rise, so that rounding never breaks the grade.
    fn lay(&self, costs: &[i32], heights: &mut [i32], way: i64) {
        let mut gone = vec![0];
        for edge in &self.edges {
            gone.push(gone[gone.len() - 1] + i64::from(costs[*edge as usize]));
        }
        let known: Vec<i64> = self.nodes.iter().map(|node| i64::from(heights[*node as usize])).collect();
        let height = |at: usize| known[at];
        let last = self.nodes.len() - 1;
        let mut corners = vec![0];
        for at in if way == 0 { last..=last } else { 1..=last } {
            // A corner stays as long as the line bends at it, and not back.
            while let [.., from, corner] = corners[..] {
                let [to_corner, to_here] = [corner, at].map(|end| height(end) - height(from));
                let [along_corner, along_here] = [corner, at].map(|end| gone[end] - gone[from]);
                if 0 < way * (to_corner * along_here - to_here * along_corner) {
                    break;
                }
                corners.pop();
            }
            corners.push(at);
        }
        for ends in corners.windows(2) {
            let ([from, to], [start, end]) = ([ends[0], ends[1]].map(height), [gone[ends[0]], gone[ends[1]]]);
            for at in ends[0] + 1..ends[1] {
                let share = ((to - from) * (gone[at] - start)).div_euclid((end - start).max(1));
                heights[self.nodes[at] as usize] = (from + share) as i32;
            }
        }
    }
}

/// Lowers tunnels below the ground over them by what has to pass through, as far as the grade allows from where they
/// come to light; `held` are nodes that stay as they are.
pub(crate) fn sink_tunnels(
    network: &Network,
    costs: &[i32],
    (heights, ground): (&mut [i32], &[Option<i32>]),
    held: &[bool],
    clearances: Clearances,
) {
    let nodes = 0..network.nodes.len() as u32;
    let is_free: Vec<bool> = nodes.map(|node| network.is_in_tunnel(node) && !held[node as usize]).collect();
    if !is_free.contains(&true) {
        return;
    }
    let fixed = |(height, is_free): (&i32, &bool)| if *is_free { i32::MIN / 2 } else { *height };
    let least = highest(network, costs, heights.iter().zip(&is_free).map(fixed).collect());
    let wanted = |node: usize| match (ground[node], network.beside(node as u32)) {
        (Some(ground), &[(_, edge), ..]) if is_free[node] => {
            heights[node].min(ground - clearances.over(network.traits(edge).kind))
        }
        _ => heights[node],
    };
    let most = lowest(network, costs, (0..heights.len()).map(wanted).collect());
    for node in (0..heights.len()).filter(|node| is_free[*node]) {
        heights[node] = most[node].max(least[node]);
    }
    bend(network, costs, heights);
}

/// The height at a place on or beside a segment, in quanta.
pub(crate) fn between(ends: [Place; 2], heights: [i32; 2], place: Place) -> i32 {
    let ([east, north], [to_east, to_north]) = (ends[0].to(ends[1]), ends[0].to(place));
    let whole = i128::from(ends[0].squared_to(ends[1])).max(1);
    let along = i128::from(east * to_east + north * to_north).clamp(0, whole);
    heights[0] + (i128::from(heights[1] - heights[0]) * along).div_euclid(whole) as i32
}
