//! Heights of roads, railways and runways: one decision for the whole network.
//!
//! Heights lie closest to the ground, by the sum of their distances, while no edge is steeper than its grade. Where
//! that asks for a cut or a fill beyond its limits, the grade gives way up to its share, then the limits do, and pins
//! never do. A first fit tells noise from ground; what it lies far from is cut off, the rest is smoothed where it is
//! noisy, and a second fit has the last word.

use std::collections::BTreeMap;

use crate::decks::{Clearances, raise_sagging_ends, sink_tunnels, straighten};
use crate::fit::{Problem, Tie, fit};
use crate::forest::{Range, Sample};
use crate::passing::{Below, clear};
use crate::smooth::{filled, smooth};
use crate::sweep::{Pin, Swept, bounds, one_a_node, relax_between_pins, relax_within, remark_steep};
use crate::{Network, Remark, Way};

/// Rounds in which loops of roads are fitted.
const ROUNDS: u64 = 4;

/// Rounds of the fit that shows where grades have to give way.
const ROUNDS_HARD: u64 = 1;

/// How many times as much a quantum beyond a limit weighs.
const LIMIT_WEIGHT: i64 = 20;

/// What may be asked of the heights of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GradeOptions {
    /// What decks keep clear of.
    pub clearances: Clearances,
    /// Quanta back along the way in which the bank of a deck may sag.
    pub bank: i32,
    /// Quanta by which a way may cut into the ground before its grade gives way.
    pub cut_max: i32,
    /// Quanta by which a way may be filled before its grade gives way.
    pub fill_max: i32,
    /// Quanta beyond which a height of the DEM is taken for an error.
    pub clip: i32,
    /// Thousandths of a post along a way, either side, over which the ground is smoothed; `None` where its noise
    /// decides.
    pub smooth_milliposts: Option<u32>,
}

impl GradeOptions {
    /// The usual clearances, banks that sag up to 100 m back, limits of 10 m, heights clipped at 3 m, and smoothing by
    /// the noise.
    pub const USUAL: Self = Self {
        clearances: Clearances::USUAL,
        bank: 100 * 128,
        cut_max: 10 * 128,
        fill_max: 10 * 128,
        clip: 3 * 128,
        smooth_milliposts: None,
    };
}

/// A height in quanta for every node of a network of ways that are travelled.
///
/// `ground` is the DEM at every node and `middle` the middle of its heights around it, from which limits of cut and
/// fill are counted (`None` without one there); `pins` are hard, and decks keep clear of what lies `below`.
pub fn grade(
    network: &Network,
    [ground, middle]: [&[Option<i32>]; 2],
    pins: &[Pin],
    below: Below,
    options: GradeOptions,
    remarks: &mut Vec<Remark>,
) -> Vec<i32> {
    let count = network.nodes.len();
    assert_eq!([count; 2], [ground.len(), middle.len()], "every node has a height of the ground, or none");
    let mut resting: Vec<Option<i32>> =
        network.nodes.iter().zip(ground).map(|(node, ground)| ground.filter(|_| node.on_ground)).collect();
    // A bridge that no road leads to stands on the ground below it, a tunnel lies below all of the ground over it.
    let bored = bored(network, ground, options.clearances);
    network.give_heights(&mut resting, &|node| bored[node as usize]);
    raise_sagging_ends(network, &mut resting, options.bank);
    let pins = one_a_node(network, pins, remarks);
    let mut swept = lay(network, [&resting, middle], &pins, options);
    straighten(network, &swept.costs, &mut swept.heights);
    let mut held = vec![false; count];
    pins.iter().for_each(|pin| held[pin.node as usize] = true);
    let sink = |Swept { heights, costs, .. }: &mut Swept| {
        sink_tunnels(network, costs, (heights, ground), &held, options.clearances);
    };
    sink(&mut swept);
    hold_portals(network, &mut swept);
    clear(network, &mut swept, ground, below, options.clearances, remarks);
    sink(&mut swept);
    remark_steep(network, &swept.heights, &|edge| network.relaxed_max(edge), remarks);
    Remark::sort(remarks);
    swept.heights
}

/// Lets no bridge that runs on in a tunnel rise there: beside it is no way on which a slope could lead up.
fn hold_portals(network: &Network, swept: &mut Swept) {
    let is_ground = |node: u32| network.beside(node).iter().any(|(_, edge)| network.is_ground(*edge));
    let has = |node: u32, deck: bool| {
        network.beside(node).iter().any(|(_, edge)| network.traits(*edge).storey.is_deck() == deck)
    };
    let portals =
        (0..network.nodes.len() as u32).filter(|node| has(*node, true) && has(*node, false) && !is_ground(*node));
    let pins: Vec<Pin> = portals.map(|node| Pin { node, height: swept.heights[node as usize] }).collect();
    let (_, most) = bounds(network, &swept.costs, &pins);
    swept.most.iter_mut().zip(most).for_each(|(known, most)| *known = most.min(*known));
}

/// The ground at every node, inside tunnels the lowest of their part of the network, less what a railway needs.
fn bored(network: &Network, ground: &[Option<i32>], clearances: Clearances) -> Vec<Option<i32>> {
    let parts = network.parts();
    let mut lowest: BTreeMap<u32, i32> = BTreeMap::new();
    for (part, ground) in parts.iter().zip(ground) {
        if let Some(ground) = *ground {
            let lowest = lowest.entry(*part).or_insert(ground);
            *lowest = ground.min(*lowest);
        }
    }
    let height = |node: usize| match lowest.get(&parts[node]) {
        Some(lowest) if network.is_in_tunnel(node as u32) => Some(lowest - clearances.rail),
        _ => ground[node],
    };
    (0..ground.len()).map(height).collect()
}

/// Fits heights to the ground at nodes that rest on it, twice, within limits below the lower and above the higher of it
/// and the middle of its heights. Each node has at most one pin.
fn lay(network: &Network, [resting, middle]: [&[Option<i32>]; 2], pins: &[Pin], options: GradeOptions) -> Swept {
    let mut costs: Vec<i32> = network.edges.iter().map(|edge| edge.rise_max).collect();
    relax_between_pins(network, &mut costs, pins);
    let limit = |(resting, middle): (&Option<i32>, &Option<i32>)| {
        let (resting, middle) = ((*resting)?, middle.or(*resting)?);
        Some([resting.min(middle) - options.cut_max, resting.max(middle) + options.fill_max])
    };
    let mut limits: Vec<Option<[i32; 2]>> = resting.iter().zip(middle).map(limit).collect();
    pins.iter().for_each(|pin| limits[pin.node as usize] = Some([pin.height; 2]));
    // Where nothing of a network rests on the ground it lies at height 0: it has none to be true to.
    let mut wishes = filled(network, resting);
    straighten(network, &costs, &mut wishes);
    let fitted = |costs: &[i32], heights: &[Option<i32>], rounds: u64| -> Vec<i32> {
        let mut problem = problem(network, costs, &limits, pins);
        problem.samples.extend(samples_of(network, heights, 1, 1));
        let wishes = wishes.iter().zip(heights).map(|(wish, height)| i64::from(height.unwrap_or(*wish)));
        problem.wishes = wishes.collect();
        fit(&problem, rounds).into_iter().map(|height| height as i32).collect()
    };
    let hard = fitted(&costs, resting, ROUNDS_HARD);
    let beyond = |node: u32| {
        let height = hard[node as usize];
        limits[node as usize].is_some_and(|[least, most]| height < least || most < height)
    };
    relax_within(network, &mut costs, &limits, &|edge| network.relaxed_max(edge), &beyond);
    let first = fitted(&costs, resting, ROUNDS);
    let clipped = resting
        .iter()
        .zip(&first)
        .map(|(height, first)| height.map(|height| height.clamp(first - options.clip, first + options.clip)));
    let smoothed = smooth(network, &clipped.collect::<Vec<_>>(), resting, options.smooth_milliposts);
    let heights = fitted(&costs, &smoothed, ROUNDS);
    let (_, most) = bounds(network, &costs, pins);
    Swept { heights, costs, most }
}

/// A network with its limits, before the ground is asked.
fn problem(network: &Network, costs: &[i32], limits: &[Option<[i32; 2]>], pins: &[Pin]) -> Problem {
    let tie = |(edge, cost): (&crate::Edge, &i32)| {
        let most = i64::from(*cost);
        Tie { a: edge.a, b: edge.b, difference: Range { least: -most, most } }
    };
    let end = |end: usize| limits.iter().map(|limit| limit.map(|limit| limit[end])).collect::<Vec<_>>();
    let mut samples = samples_of(network, &end(0), LIMIT_WEIGHT, 0);
    samples.extend(samples_of(network, &end(1), 0, LIMIT_WEIGHT));
    let mut ranges = vec![Range::ALL; network.nodes.len()];
    for &Pin { node, height } in pins {
        ranges[node as usize] = Range { least: height.into(), most: height.into() };
    }
    Problem {
        places: network.nodes.iter().map(|node| node.place).collect(),
        ties: network.edges.iter().zip(costs).map(tie).collect(),
        samples,
        ranges,
        wishes: Vec::new(),
    }
}

/// Samples of heights at nodes that have one, weighted by the length of way that each stands for.
pub(crate) fn samples_of(network: &Network, heights: &[Option<i32>], below: i64, above: i64) -> Vec<Sample> {
    let sample = |(node, height): (u32, &Option<i32>)| {
        let (height, weight) = (i64::from((*height)?), network.decimetres_at(node));
        Some(Sample { node, height, below: below * weight, above: above * weight })
    };
    (0..).zip(heights).filter_map(sample).collect()
}

/// Pins of a network: heights that features give to vertices of ways whose rule says so.
pub fn pins(network: &Network, ways: &[Way]) -> Vec<Pin> {
    let mut pins = Vec::new();
    for (place, height) in ways.iter().filter(|way| way.traits.pins).flat_map(|way| &way.heights) {
        let first = network.nodes.partition_point(|node| node.place < *place);
        let here = network.nodes[first..].iter().take_while(|node| node.place == *place);
        pins.extend(here.enumerate().map(|(at, _)| Pin { node: (first + at) as u32, height: *height }));
    }
    pins.sort_unstable();
    pins.dedup();
    pins
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{network, way};
    use crate::{Flaw, Network, Source};

    fn metres(quanta: i32) -> f64 {
        terrain::metres_of_quanta(quanta)
    }

    /// The heights of a scene in metres, by place in posts (east, north), and its remarks.
    #[track_caller]
    fn heights(sources: Vec<Source>, ground: impl Fn(f64, f64) -> f64) -> (Network, Vec<i32>, Vec<Remark>) {
        let (network, ground, mut remarks) = network(sources, ground);
        let heights = grade(&network, [&ground; 2], &[], Below::WAYS, GradeOptions::USUAL, &mut remarks);
        for edge in &network.edges {
            let rise = (heights[edge.a as usize] - heights[edge.b as usize]).abs();
            assert!(rise <= edge.rise_max, "a grade is exceeded");
        }
        (network, heights, remarks)
    }

    fn at(network: &Network, heights: &[i32], east: f64, north: f64, on_ground: bool) -> f64 {
        let place = network.lattice.place_of([east, north]).unwrap();
        let node = network.nodes.iter().position(|node| node.place == place && node.on_ground == on_ground);
        metres(heights[node.expect("a station stands there")])
    }

    #[test]
    fn a_road_on_gentle_ground_lies_on_it() {
        let road = way(1, "highway=primary", &[(10.0, 10.0), (40.0, 10.0)]);
        let (network, found, _) = heights(vec![road], |east, _| east * 0.5);
        for node in [12.0, 20.0, 37.0] {
            assert_eq!(at(&network, &found, node, 10.0, true), node * 0.5);
        }
    }

    #[test]
    fn a_road_over_a_step_keeps_to_the_limits_of_cut_and_fill() {
        let road = way(1, "highway=primary", &[(10.0, 10.0), (90.0, 10.0)]);
        let (network, found, _) = heights(vec![road], |east, _| if east < 50.0 { 0.0 } else { 20.0 });
        let (low, high) = (at(&network, &found, 49.0, 10.0, true), at(&network, &found, 50.0, 10.0, true));
        assert!(low <= 10.0 && 10.0 <= high, "{low} {high}");
        assert!((high - low - 1.0).abs() < 0.05);
    }

    fn bridge(tags: &str) -> Vec<Source> {
        bridge_between(tags, 40.0, 60.0)
    }

    fn bridge_between(tags: &str, from: f64, to: f64) -> Vec<Source> {
        vec![
            way(1, "highway=primary", &[(10.0, 20.0), (from, 20.0)]),
            way(2, tags, &[(from, 20.0), (to, 20.0)]),
            way(3, "highway=primary", &[(to, 20.0), (90.0, 20.0)]),
        ]
    }

    /// A gorge between 40 and 60, 30 m deep, whose banks sag over four posts.
    fn gorge(east: f64, _: f64) -> f64 {
        let inside = 10.0 - (east - 50.0).abs();
        100.0 - ((inside + 4.0).max(0.0) / 4.0).min(1.0) * 30.0
    }

    #[test]
    fn a_bridge_over_a_gorge_rests_on_the_top_of_its_sagging_banks() {
        let (network, found, _) = heights(bridge("highway=primary bridge=yes"), gorge);
        for place in [40.0, 60.0] {
            assert!(99.0 < at(&network, &found, place, 20.0, true));
        }
        assert!(99.0 < at(&network, &found, 50.0, 20.0, false));
    }

    #[test]
    fn a_road_that_comes_down_to_its_bridge_stays_down() {
        let valley = |east: f64, _: f64| (east - 50.0).abs() * 0.8;
        let (network, found, _) = heights(bridge("highway=primary bridge=yes"), valley);
        assert!(at(&network, &found, 40.0, 20.0, true) < 8.6);
    }

    #[test]
    fn a_tunnel_joins_its_ends_inside_the_hill() {
        let hill = |east: f64, _: f64| if 41.0 < east && east < 59.0 { 300.0 } else { 50.0 };
        let (network, found, _) = heights(bridge("highway=primary tunnel=yes"), hill);
        assert_eq!(at(&network, &found, 40.0, 20.0, true), 50.0);
        let middle = at(&network, &found, 50.0, 20.0, false);
        assert!(47.0 < middle && middle < 50.0, "as far below its ends as the ground before the hill asks: {middle}");
    }

    #[test]
    fn no_tunnel_lies_above_the_ground_over_it() {
        let hollow = |east: f64, _: f64| 50.0 - (10.0 - (east - 50.0).abs()).clamp(0.0, 4.0) * 2.0;
        let (network, found, _) = heights(bridge("highway=primary tunnel=yes"), hollow);
        for (east, most) in [(40.0, 50.0), (44.0, 46.0), (50.0, 40.1), (56.0, 46.0)] {
            let height = at(&network, &found, east, 20.0, east == 40.0);
            assert!(height <= most, "{height} m at {east}");
        }
    }

    #[test]
    fn a_bridge_that_runs_on_in_a_tunnel_ends_on_the_ground() {
        let mut sources = bridge_between("highway=primary bridge=yes", 40.0, 48.0);
        sources[2] = way(3, "highway=primary tunnel=yes layer=-1", &[(48.0, 20.0), (80.0, 20.0)]);
        sources.push(way(4, "highway=primary", &[(80.0, 20.0), (90.0, 20.0)]));
        let (network, found, _) = heights(sources, |east, _| 10.0 + 2.0 * (16.0 - (east - 64.0).abs()).max(0.0));
        assert_eq!(at(&network, &found, 48.0, 20.0, true), 10.0);
    }

    #[test]
    fn a_tunnel_whose_ends_are_not_there_lies_below_the_lowest_ground_over_it() {
        let road = way(1, "railway=rail tunnel=yes", &[(10.0, 10.0), (90.0, 10.0)]);
        let (network, found, _) = heights(vec![road], |east, _| 20.0 + 3.0 * (50.0 - east).abs());
        for east in [10.0, 50.0, 90.0] {
            let height = at(&network, &found, east, 10.0, false);
            assert!(height <= 20.0 - 6.0, "{height} m at {east}");
        }
    }

    #[test]
    fn a_bridge_does_not_rise_over_a_tunnel_that_no_ground_covers() {
        let mut sources = bridge("highway=primary bridge=yes");
        // Its one end is high above the bridge's banks.
        sources.push(way(4, "highway=primary tunnel=yes", &[(50.0, 30.0), (50.0, 5.0)]));
        sources.push(way(5, "highway=primary", &[(50.0, 90.0), (50.0, 30.0)]));
        let (network, found, _) = heights(sources, |_, north| if north < 28.0 { 10.0 } else { 60.0 });
        assert!(at(&network, &found, 40.0, 20.0, true) < 20.0, "the bridge stays near its banks");
    }

    #[test]
    fn a_long_deck_arches_over_a_railway() {
        let mut sources = bridge("highway=primary bridge=yes");
        sources.push(way(4, "railway=rail", &[(50.0, 5.0), (50.0, 35.0)]));
        let (network, found, remarks) = heights(sources, |_, _| 10.0);
        assert_eq!(at(&network, &found, 40.0, 20.0, true), 10.0);
        assert!(16.0 <= at(&network, &found, 50.0, 20.0, false));
        assert!((at(&network, &found, 45.0, 20.0, false) - 13.0).abs() < 0.6, "it is straight up to there");
        assert!(remarks.is_empty());
    }

    #[test]
    fn a_deck_is_raised_clear_of_a_railway_and_the_approaches_with_it() {
        let mut sources = bridge_between("highway=primary bridge=yes", 46.0, 54.0);
        sources.push(way(4, "railway=rail", &[(50.0, 5.0), (50.0, 35.0)]));
        let (network, found, remarks) = heights(sources, |_, _| 10.0);
        assert!(16.0 <= at(&network, &found, 46.0, 20.0, true));
        assert_eq!(at(&network, &found, 50.0, 20.0, true), 10.0);
        assert!((at(&network, &found, 42.0, 20.0, true) - 12.0).abs() < 0.1, "the approach falls by its grade");
        assert!(remarks.is_empty());
    }

    #[test]
    fn clearance_that_pins_forbid_is_written_down() {
        let mut sources = bridge_between("highway=primary bridge=yes", 46.0, 54.0);
        sources.push(way(4, "highway=track", &[(50.0, 5.0), (50.0, 35.0)]));
        let (network, ground, mut remarks) = network(sources, |_, _| 10.0);
        let place = network.lattice.place_of([46.0, 20.0]).unwrap();
        let node = network.nodes.iter().position(|node| node.place == place).unwrap() as u32;
        let pins = [Pin { node, height: 1280 }, Pin { node: node + 1, height: 1280 }];
        let height =
            grade(&network, [&ground; 2], &pins[..1], Below::WAYS, GradeOptions::USUAL, &mut remarks)[node as usize];
        assert_eq!(height, 1280);
        // The other end went up alone, four times, so fifteen sixteenths of the clearance are there.
        assert!(
            matches!(remarks[0].flaw, Flaw::ClearanceLacks { quanta } if 20 < quanta && quanta < 90),
            "{remarks:?}"
        );
    }

    #[test]
    fn two_pins_on_one_junction_that_disagree_are_written_down() {
        let (network, ground, mut remarks) = network(bridge("highway=primary"), |_, _| 10.0);
        let pins = [Pin { node: 10, height: 1000 }, Pin { node: 10, height: 2000 }];
        let found = grade(&network, [&ground; 2], &pins, Below::WAYS, GradeOptions::USUAL, &mut remarks);
        assert_eq!(found[10], 1000);
        assert_eq!(remarks[0].flaw, Flaw::PinsDisagree);
    }

    #[test]
    fn pins_too_steep_for_the_grade_exceed_it_between_them_and_it_is_written_down() {
        let (network, ground, mut remarks) = network(bridge("highway=primary"), |_, _| 10.0);
        let pins = [Pin { node: 10, height: 0 }, Pin { node: 14, height: 2560 }];
        let found = grade(&network, [&ground; 2], &pins, Below::WAYS, GradeOptions::USUAL, &mut remarks);
        assert_eq!((found[10], found[14]), (0, 2560));
        assert!(matches!(remarks[0].flaw, Flaw::PinsTooSteep { grade_ppm } if 500_000 <= grade_ppm));
    }
}
