//! All features of one area, in the order in which things are decided: what they are and where they run, then, with the
//! heights of the DEM at every station, how high they lie and what they put into the ground.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap, HashSet};

use terrain::{Each, QUANTA_PER_METRE, SideSlope};

use crate::aground::{Beside, still_under, tell_of_hills, uncut, under_hills};
use crate::earthworks::{Laid, earthworks};
use crate::objects::{Plan, strips};
use crate::passing::drowned;
use crate::pieces::moved;
use crate::roadsides::roadsides;
use crate::rules::Sorted;
use crate::watersides::{Watersides, watersides};
use crate::{
    About, Bed, Below, Earthworks, FallOptions, FeatureId, Flaw, GradeOptions, Graded, Grants, Histogram, Kind, Lake,
    Network, Node, Outline, Pin, Place, Remark, Reserved, Role, Rule, Shares, Shores, Site, Source, Storey, Strand,
    Traits, Waters, Way, afloat, banks, breaklines, channels, dams, fall, flowing, grade, have_line, lakes_along,
    level, lift_shores, lines_inside, mend, outline_only, pins, reserve, round, shore, sides, sort_out, split_at_dams,
    travelled, water, with_water,
};

/// Features on the lattice of an area, before their heights are known.
#[derive(Clone, Debug)]
pub struct AreaFeatures {
    /// Where they lie.
    pub site: Site,
    /// What was mended or left out so far.
    pub remarks: Vec<Remark>,
    ways: Vec<Way>,
    lines: Vec<Strand>,
    outlines: Vec<Outline>,
    dams: HashSet<Place>,
    roads: Network,
    road_sides: Vec<[Place; 2]>,
    deck_sides: Beside,
    rivers: Network,
    river_banks: Vec<[Place; 2]>,
    /// What stands for the names of features that have one.
    names: BTreeMap<FeatureId, u64>,
    /// Sorted, each once.
    stations: Vec<Place>,
    /// Of each station whether a way runs through it.
    is_way: Vec<bool>,
}

/// What the DEM says along features.
#[derive(Clone, Copy)]
pub struct Sounded<'a> {
    /// Its height at each of the [`AreaFeatures::stations`], in quanta.
    pub heights: &'a [Option<i32>],
    /// The middle one of nine heights around each station that is a [`AreaFeatures::is_way`]; none over a hole of the
    /// DEM, where heights are made up.
    pub middles: &'a [Option<i32>],
    /// Heights of the posts inside each of the [`AreaFeatures::outlines`].
    pub inside: &'a [Histogram],
}

/// How high features lie, and what they put into the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Levelled {
    /// What they put into the ground, what it costs, and what was degraded for that.
    pub reserved: Reserved,
    /// All remarks: those of mending, too.
    pub remarks: Vec<Remark>,
    /// What they move.
    pub earthworks: Earthworks,
    /// Water that lies off the natural ground, in the TIN or not.
    pub watersides: Vec<SideSlope>,
    /// Edges of roads, in the TIN or not, with the ground that water leaves.
    pub roadsides: Vec<SideSlope>,
    /// Quanta of bridges that would run through hills, and became tunnels.
    pub through_hills: i64,
}

/// Water with its heights.
struct Watered {
    /// Channels, shores and banks.
    strands: Vec<Strand>,
    lakes: Vec<Lake>,
    /// Where rivers lie level.
    level: HashSet<Place>,
}

impl AreaFeatures {
    /// Returns all that they are made of, word by word: equal words, equal features.
    pub fn feed(&self, word: &mut dyn FnMut(i64)) {
        let place = |Place { row, col }: Place, word: &mut dyn FnMut(i64)| {
            word(row.into());
            word(col.into());
        };
        let Self { site, ways, outlines, .. } = self;
        word(site.lattice.steps_per_post().into());
        word(site.is_met.into());
        word(ways.len() as i64);
        for Way { traits, places, heights, id } in ways {
            traits.feed(word);
            word(self.names.get(id).copied().unwrap_or(0) as i64);
            word(places.len() as i64);
            places.iter().for_each(|&at| place(at, word));
            word(heights.len() as i64);
            for &(at, height) in heights {
                place(at, word);
                word(height.into());
            }
        }
        word(outlines.len() as i64);
        for Outline { traits, rings, id: _ } in outlines {
            traits.feed(word);
            word(rings.len() as i64);
            for ring in rings {
                word(ring.hole.into());
                word(ring.places.len() as i64);
                ring.places.iter().for_each(|&at| place(at, word));
            }
        }
    }

    /// What each feature on the lattice is.
    pub fn traits_by_id(&self) -> BTreeMap<FeatureId, Traits> {
        let ways = self.ways.iter().map(|way| (way.id, way.traits));
        ways.chain(self.outlines.iter().map(|outline| (outline.id, outline.traits))).collect()
    }

    /// Sorts out, mends and rounds features, and finds where the DEM has to be asked. `grade_give` is how many times
    /// its grade a road may be unless a rule says so; `each` runs what falls into pieces.
    pub fn of(sources: Vec<Source>, rules: &[Rule], grade_give: f64, site: Site, each: Each) -> Self {
        let names = names(&sources);
        let Sorted { features, mut remarks } = sort_out(sources, rules, grade_give);
        let mut rounded = round(mend(features, &site), &site, each);
        remarks.append(&mut rounded.remarks);
        let roads = Network::of(&travelled(&rounded), site.lattice, &mut remarks);
        let rivers = Network::of(&flowing(&rounded), site.lattice, &mut remarks);
        let (road_sides, river_banks) = (sides(&roads), a_post_aside(&rivers));
        let deck_sides = Beside::of(&roads);
        let (dams, lines) = (dams(&rounded), breaklines(&rounded, &|_| None));
        let outlines = split_at_dams(rounded.outlines, &rounded.ways);
        let ways = rounded.ways;
        let mut all = Self {
            site,
            remarks,
            ways,
            lines,
            outlines,
            dams,
            roads,
            road_sides,
            deck_sides,
            rivers,
            river_banks,
            names,
            stations: Vec::new(),
            is_way: Vec::new(),
        };
        all.stations = all.asked();
        let networks = [&all.roads, &all.rivers];
        let ways: HashSet<Place> = networks.into_iter().flat_map(|of| &of.nodes).map(|node| node.place).collect();
        all.is_way = all.stations.iter().map(|place| ways.contains(place)).collect();
        all
    }

    /// Where the DEM is asked for a height: every station of ways and shores, the edges of wide ways, the banks of
    /// rivers. In order of place, each once.
    pub fn stations(&self) -> &[Place] {
        &self.stations
    }

    /// Of each station whether a way runs through it, so that heights around it are asked for, too.
    pub fn is_way(&self) -> &[bool] {
        &self.is_way
    }

    /// All polygons; those of water are asked for the heights inside.
    pub fn outlines(&self) -> &[Outline] {
        &self.outlines
    }

    /// What roads, railways and water cover, two metres added on both sides of ways, as far as their strips may lie
    /// beside them, in quanta east and north of the place 0, 0: woods leave it free. Tunnels are not among it.
    pub fn covered(&self) -> Vec<Plan> {
        const ASIDE: i32 = 4 * QUANTA_PER_METRE;
        let quanta = self.site.lattice.quanta_per_step();
        let at = |place: &Place| [place.col, place.row].map(|step| step * quanta);
        let is_open = |way: &&Way| way.traits.kind.is_travelled() && !way.traits.storey.is_tunnel();
        let ways = self.ways.iter().filter(is_open);
        let ways = ways.flat_map(|way| {
            let line: Vec<[i32; 2]> = way.places.iter().map(at).collect();
            strips(&line, way.traits.width + ASIDE)
        });
        let water = self.outlines.iter().filter(|outline| matches!(outline.traits.kind, Kind::Lake | Kind::River));
        let water =
            water.map(|outline| outline.rings.iter().map(|ring| ring.places.iter().map(at).collect()).collect());
        ways.chain(water).collect()
    }

    fn asked(&self) -> Vec<Place> {
        let nodes = [&self.roads, &self.rivers].into_iter().flat_map(|network| &network.nodes).map(|node| node.place);
        let beside = [&self.road_sides, &self.river_banks].into_iter().flatten().flatten().copied();
        let beside = beside.chain(self.deck_sides.places());
        let shores = self.outlines.iter().flat_map(Outline::places);
        let lines = self.lines.iter().flat_map(|line| &line.stations).map(|(place, _)| *place);
        let border = nodes.clone().filter_map(|place| self.site.along_border(place)).flatten();
        let mut all: Vec<Place> = nodes.chain(border).chain(beside).chain(shores).chain(lines).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Decides all heights, and forms features so that they take no more triangles than there is room for. Beyond the
    /// area a height of the DEM is that of the nearest place inside, and only features without any place inside rest
    /// on it. `each` runs what falls into pieces.
    ///
    /// # Panics
    /// When there is not one height, or none, for each station, and one histogram for each outline.
    pub fn level(
        &self,
        sounded: Sounded,
        (options, falls): (GradeOptions, FallOptions),
        shares: &Shares,
        each: Each,
    ) -> Levelled {
        let Sounded { heights, middles, inside } = sounded;
        assert_eq!([heights.len(), middles.len()], [self.stations.len(); 2], "the DEM was asked at every station");
        assert_eq!(inside.len(), self.outlines.len(), "the DEM was asked inside every outline");
        let of = |place: Place, all: &[Option<i32>]| self.stations.binary_search(&place).ok().and_then(|at| all[at]);
        let near = |place: Place| of(place, heights);
        let at = |place: Place| near(place).filter(|_| self.site.holds(place));
        let middle = |place: Place| of(place, middles).filter(|_| self.site.holds(place));
        let mut remarks = self.remarks.clone();
        let Watered { mut strands, lakes, level } =
            self.waters(Soundings { at: &at, near: &near, middle: &middle, inside }, falls, &mut remarks);
        let watersides = watersides(&strands, &at);
        strands.extend(self.breaklines(&near));
        // Roads rest on the ground that water leaves.
        let drawn = Watersides::of(&watersides, self.site.lattice.metres_per_step());
        let natural = at;
        let beside_water = |place: Place, height: i32| drawn.ground(place.into(), height);
        let at = |place: Place| natural(place).map(|height| beside_water(place, height));
        let middle = |place: Place| middle(place).map(|height| beside_water(place, height));
        let resting = ground_of(&self.roads, &|place| middle(place).and(at(place)), &near);
        let mut hills = under_hills(&self.roads, &resting, options.cut_max);
        let roads = &*self.roads.with_tunnels(&hills);
        let (afloat, pins) = self.pinned(roads, &self.known(&lakes, inside), &natural, &mut remarks);
        let amid = middles_of(roads, &middle, &resting);
        let mut water = water(&strands);
        water.extend(uncut(roads, (&self.deck_sides, &at), options.cut_max));
        let below = Below { water: &water, is_known: &|place| self.site.holds(place) };
        let heights = grade(roads, [&resting, &amid], &pins, below, options, &mut remarks);
        let roads = &*with_culverts(roads, &heights, &strands, &mut remarks);
        let left = still_under(roads, &heights, (&self.deck_sides, &at), options.cut_max);
        let roads = &*roads.with_tunnels(&left);
        hills.extend(left);
        let through_hills = tell_of_hills(roads, &hills, &mut remarks);
        let beside = |(sides, height): (&[Place; 2], &i32)| sides.map(|place| at(place).unwrap_or(*height));
        let beside: Vec<[i32; 2]> = self.road_sides.iter().zip(&heights).map(beside).collect();
        let graded = Graded { network: roads, heights: &heights, beside: &beside, grants: &Grants::default() };
        let kinds = self.traits_by_id();
        let about = |id: FeatureId| {
            let name = self.names.get(&id).copied().unwrap_or(0);
            kinds.get(&id).map(|traits| About { kind: traits.kind, name })
        };
        let mut reserved = reserve(&graded, &strands, &self.site, shares, &about, each);
        remarks.append(&mut reserved.formed.remarks);
        // What lies beyond the area is counted, not listed.
        remarks.retain(|remark| remark.flaw != Flaw::Outside);
        Remark::sort(&mut remarks);
        let roadsides = roadsides(&reserved.formed, &graded, (&resting, &self.road_sides));
        let earthworks = earthworks(&Laid {
            ground: &natural,
            is_known: &|place| middle(place).is_some(),
            site: &self.site,
            roads: Graded { grants: &reserved.grants, ..graded },
            pins: &pins,
            afloat: &afloat,
            strands: &strands,
            width: &|id| kinds.get(&id).map_or(0, |traits| traits.width),
            level: &level,
            outlines: &self.outlines,
            lakes: &lakes,
            inside,
            limits: (options, falls),
        });
        Levelled { reserved, remarks, earthworks, watersides, roadsides, through_hills }
    }

    /// Rivers, lakes and what else polygons of water became, by the ground inside the area and that nearest to places
    /// beyond it; and the lakes.
    fn waters(&self, of: Soundings, falls: FallOptions, remarks: &mut Vec<Remark>) -> Watered {
        let Self { site, outlines, rivers, .. } = self;
        let Soundings { at, near, middle, inside } = of;
        let shore_by = |outline: &Outline, ground: Ground| outline.places().map(ground).collect::<Vec<Option<i32>>>();
        let shore_of = |outline: &Outline| match shore_by(outline, at) {
            unknown if unknown.iter().all(Option::is_none) => shore_by(outline, near),
            known => known,
        };
        let shores: Vec<Vec<Option<i32>>> = outlines.iter().map(shore_of).collect();
        let has_line = have_line(outlines, rivers, site);
        let known = |place: Place| middle(place).and(at(place));
        let is_dam = |place: Place| self.dams.contains(&place);
        let all = Shores { heights: &shores, inside, has_line: &has_line };
        let mut waters: Waters = level(outlines, all, &is_dam, falls, site.lattice, remarks);
        let ground = ground_of(rivers, &known, near);
        let lowest = |(banks, ground): (&[Place; 2], &Option<i32>)| {
            ground.and_then(|ground| banks.iter().filter_map(|place| at(*place)).chain([ground]).min())
        };
        let lower_bank: Vec<Option<i32>> = self.river_banks.iter().zip(&ground).map(lowest).collect();
        let middles = middles_of(rivers, middle, &ground);
        let still = lakes_along(outlines, &self.known(&waters.lakes, inside), rivers, site);
        let bed = Bed { ground: &ground, middle: &middles, lower_bank: &lower_bank };
        let lowest = |[here, before, after, ..]: [i32; 5]| here.min(before).min(after);
        let fallen = fall(rivers, bed, &still, &self.met(rivers, at, lowest), falls, remarks);
        let levels: HashMap<u32, i32> =
            still.iter().zip(&fallen.levels).map(|(still, level)| (still.body, *level)).collect();
        waters.lakes.iter_mut().for_each(|lake| lake.level = levels.get(&lake.body).copied().unwrap_or(lake.level));
        lift_shores(outlines, &shores, &mut waters.lakes, site.lattice, remarks);
        let mut strands = channels(rivers, &fallen);
        strands.extend(waters.lakes.iter().flat_map(|lake| shore(&outlines[lake.outline as usize], lake.level)));
        let inside = lines_inside(outlines, &waters.banks, rivers, &fallen, site);
        let of_bank = |(number, line): (&u32, &crate::parts::Line)| banks(&outlines[*number as usize], line, site);
        strands.extend(waters.banks.iter().zip(&inside).flat_map(of_bank));
        let only = |number: &u32| {
            let outline = &outlines[*number as usize];
            outline_only(outline, &shore_by(outline, near))
        };
        strands.extend(waters.outlines_only.iter().flat_map(only));
        let level = rivers.nodes.iter().zip(&fallen.is_level).filter(|(_, is_level)| **is_level);
        Watered { strands, lakes: waters.lakes, level: level.map(|(node, _)| node.place).collect() }
    }

    /// The nodes of roads that lie in lakes with the levels of these, and all nodes that have to keep a height.
    fn pinned(&self, roads: &Network, lakes: &[Lake], at: Ground, remarks: &mut Vec<Remark>) -> (Vec<Pin>, Vec<Pin>) {
        let afloat = afloat(&self.outlines, lakes, roads, &self.road_sides, &self.site);
        let pins = with_water(roads, pins(roads, &self.ways), &afloat, remarks);
        // One that cannot be kept is none to tell: no border has to be met.
        let pins = with_water(roads, pins, &self.met(roads, at, middle_of), &mut Vec::new());
        (afloat, pins)
    }

    /// The heights at which ways on the ground cross a border that others meet: of those of the ground along it.
    fn met(&self, network: &Network, at: Ground, of: impl Fn([i32; 5]) -> i32) -> Vec<Pin> {
        let on_ground = (0..).zip(&network.nodes).filter(|(_, node)| node.on_ground);
        let pin = |(node, of_node): (u32, &Node)| {
            let along = self.site.along_border(of_node.place)?;
            let here = at(of_node.place)?;
            Some(Pin { node, height: of(along.map(|place| at(place).unwrap_or(here))) })
        };
        on_ground.filter_map(pin).collect()
    }

    /// The lakes that lie in the area, if only in part, or whose level is given. How high others lie is a guess, which
    /// nothing has to follow.
    fn known(&self, lakes: &[Lake], inside: &[Histogram]) -> Vec<Lake> {
        let is_known = |lake: &&Lake| {
            let outline = lake.outline as usize;
            lake.is_fixed
                || !inside[outline].is_empty()
                || self.outlines[outline].places().any(|place| self.site.holds(place))
        };
        lakes.iter().filter(is_known).cloned().collect()
    }

    /// Breaklines at the heights of their source, else of the ground.
    fn breaklines(&self, at: Ground) -> Vec<Strand> {
        let ways = self.ways.iter().filter(|way| way.traits.kind == crate::Kind::Breakline).cloned().collect();
        let outlines = self.outlines.iter().filter(|outline| outline.traits.kind == crate::Kind::Breakline).cloned();
        breaklines(&crate::Rounded { ways, outlines: outlines.collect(), remarks: Vec::new() }, at)
    }
}

/// What stands for the names of features, or for their numbers where they have no name.
fn names(sources: &[Source]) -> BTreeMap<FeatureId, u64> {
    // FNV-1a, of the content alone.
    let hash = |text: &str| {
        text.bytes()
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
    };
    let named = |source: &Source| {
        let name = ["name", "ref"].iter().find_map(|key| source.tag(key)).filter(|name| !name.is_empty())?;
        Some((source.id, hash(name)))
    };
    sources.iter().filter_map(named).collect()
}

/// The height of the ground at a place, where there is one.
type Ground<'a> = &'a dyn Fn(Place) -> Option<i32>;

/// The ground as water asks for it.
#[derive(Clone, Copy)]
struct Soundings<'a> {
    /// At a place inside the area.
    at: Ground<'a>,
    /// At the nearest place inside.
    near: Ground<'a>,
    /// The middle one of nine around a place.
    middle: Ground<'a>,
    /// At the posts inside each outline.
    inside: &'a [Histogram],
}

/// The ground that is known at each node of a network; what has no part of it rests on the nearest ground there is.
fn ground_of(network: &Network, at: Ground, near: Ground) -> Vec<Option<i32>> {
    let place = |node: u32| network.nodes[node as usize].place;
    let mut ground: Vec<Option<i32>> = network.nodes.iter().map(|node| at(node.place)).collect();
    network.give_heights(&mut ground, &|node| near(place(node)));
    ground
}

/// The network with roads at the heights of short bridges that lie below streams, which pass there in culverts.
fn with_culverts<'a>(
    network: &'a Network,
    heights: &[i32],
    strands: &[Strand],
    remarks: &mut [Remark],
) -> Cow<'a, Network> {
    let streams = water(strands.iter().filter(|strand| strand.role == Role::Channel));
    network.with_storey(drowned(network, heights, &streams, remarks), Storey::Ground)
}

/// The middle one of heights.
fn middle_of(mut heights: [i32; 5]) -> i32 {
    heights.sort_unstable();
    heights[2]
}

/// The middle one of nine heights around each node of a network, else its ground.
fn middles_of(network: &Network, middle: Ground, ground: &[Option<i32>]) -> Vec<Option<i32>> {
    network.nodes.iter().zip(ground).map(|(node, ground)| middle(node.place).or(*ground)).collect()
}

/// Of each node of a network, the places a post to the left and to the right of its way.
fn a_post_aside(network: &Network) -> Vec<[Place; 2]> {
    let mut aside: Vec<[Place; 2]> = network.nodes.iter().map(|node| [node.place; 2]).collect();
    let post = f64::from(network.lattice.steps_per_post());
    for chain in network.chains() {
        let place = |at: usize| network.nodes[chain.nodes[at] as usize].place;
        for (at, &node) in chain.nodes.iter().enumerate() {
            let [east, north] = place(at.saturating_sub(1)).to(place((at + 1).min(chain.nodes.len() - 1)));
            let [east, north] = [east as f64, north as f64];
            let length = (east * east + north * north).sqrt().max(1.0);
            let by = |sign: f64| moved(place(at), -sign * post * north / length, sign * post * east / length);
            aside[node as usize] = [by(1.0), by(-1.0)];
        }
    }
    aside
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::in_turn;

    use crate::samples::{self, ground_at, level_usual, site, way};

    fn levelled(sources: Vec<Source>, metres: impl Fn(f64, f64) -> f64) -> Levelled {
        samples::levelled(sources, metres, &Shares::each([8, 8], 1000))
    }

    fn lake() -> Source {
        let ring = [(40.0, 10.0), (60.0, 10.0), (60.0, 30.0), (40.0, 30.0), (40.0, 10.0)];
        way(3, "natural=water", &ring)
    }

    #[test]
    fn a_road_a_river_and_a_lake_become_parts_of_the_ground_together() {
        let road = way(1, "highway=primary", &[(5.0, 40.0), (95.0, 42.0)]);
        let river = way(2, "waterway=river", &[(80.0, 95.0), (52.0, 45.0), (50.0, 20.0)]);
        let all = levelled(vec![road, river, lake()], |east, north| 100.0 + north * 0.5 + (east - 50.0).abs() * 0.3);
        let formed = &all.reserved.formed;
        let of = |role: Role| formed.edges.iter().filter(|edge| edge.role == role).count();
        assert!(0 < of(Role::Channel) && 0 < of(Role::Shore) && 0 < of(Role::Side) + of(Role::Centre));
        let shore = formed.surfaces.iter().find(|surface| surface.role == Role::Shore).unwrap();
        let level = shore.ring[0].1;
        assert!(shore.ring.iter().all(|(_, height)| *height == level), "a lake is level");
        assert!(all.remarks.iter().any(|remark| remark.flaw == Flaw::RoadOverRiver));
    }

    #[test]
    fn the_order_of_features_does_not_show() {
        let sources = || {
            vec![
                way(1, "highway=track", &[(5.0, 5.0), (30.0, 60.0), (95.0, 42.0)]),
                way(2, "highway=primary", &[(5.0, 60.0), (95.0, 20.0)]),
                lake(),
                way(4, "waterway=stream", &[(80.0, 95.0), (50.0, 20.0)]),
            ]
        };
        let hills = |east: f64, north: f64| 100.0 + (east * 0.3).sin() * 8.0 + north * 0.4;
        let mut other = sources();
        other.reverse();
        assert_eq!(levelled(sources(), hills), levelled(other, hills));
    }

    /// Heights in metres of what features put into the ground within a post of a place.
    fn around(levelled: &Levelled, [east, north]: [f64; 2]) -> Vec<f64> {
        let near = |place: Place| {
            let [x, y] = site().lattice.posts_of(place);
            (x - east).abs() <= 1.0 && (y - north).abs() <= 1.0
        };
        let points = &levelled.reserved.formed.points;
        points.iter().filter(|point| near(point.0)).map(|point| terrain::metres_of_quanta(point.1)).collect()
    }

    #[test]
    fn a_bridge_beyond_the_border_lifts_nothing_inside() {
        let sources = vec![
            way(1, "highway=primary", &[(300.0, 190.0), (404.0, 190.0), (404.0, 196.0)]),
            way(2, "highway=primary bridge=yes", &[(404.0, 196.0), (404.0, 204.0)]),
            way(3, "highway=primary", &[(404.0, 204.0), (404.0, 230.0)]),
            way(4, "highway=primary", &[(300.0, 200.0), (449.0, 200.0)]),
        ];
        let all = levelled(sources, |_, north| if north < 195.0 { 0.0 } else { 90.0 });
        let found = around(&all, [400.0, 190.0]);
        assert!(!found.is_empty() && found.iter().all(|height| height.abs() < 1.0), "{found:?}");
    }

    #[test]
    fn which_way_a_river_flows_is_asked_of_the_ground_there_is() {
        let sources = vec![
            way(1, "waterway=stream", &[(380.0, 100.0), (420.0, 100.0), (420.0, 140.0), (420.0, 240.0)]),
            way(2, "waterway=stream", &[(380.0, 140.0), (420.0, 140.0)]),
            way(3, "waterway=stream", &[(380.0, 200.0), (420.0, 200.0), (420.0, 240.0)]),
        ];
        let slope = |from: f64, east: f64| from - (east - 380.0) / 4.0;
        let all = levelled(sources, |east, north| match north as i32 {
            ..120 => slope(50.0, east),
            120..170 => slope(25.0, east),
            _ => slope(90.0, east),
        });
        let found = around(&all, [400.0, 140.0]);
        assert!(!found.is_empty() && found.iter().all(|height| *height < 26.0), "{found:?}");
    }

    #[test]
    fn features_cross_a_border_that_others_meet_at_heights_that_both_know() {
        let sources = || {
            vec![
                way(1, "highway=primary", &[(300.0, 100.0), (440.0, 100.0)]),
                way(2, "waterway=stream", &[(300.0, 200.0), (440.0, 200.0)]),
            ]
        };
        let ground = |east: f64, north: f64| 1000.0 - east + (east * 1.7).sin() * 4.0 + (north * 2.3).cos();
        let heights = |is_met: bool| {
            let all = AreaFeatures::of(sources(), &[], 1.5, Site { is_met, ..site() }, &in_turn);
            let heights: Vec<Option<i32>> = all.stations().iter().map(|place| ground_at(*place, &ground)).collect();
            let levelled = level_usual(&all, &heights, &Shares::each([8, 8], 1000));
            let on_border = |north: f64| {
                let place = site().lattice.place_of([400.0, north]).unwrap();
                let points = &levelled.reserved.formed.points;
                terrain::metres_of_quanta(points.iter().find(|point| point.0 == place).unwrap().1)
            };
            [100.0, 200.0].map(on_border)
        };
        let along = |north: f64, asides: &[f64]| -> Vec<f64> {
            let mut found: Vec<f64> = asides.iter().map(|aside| ground(400.0, north + aside)).collect();
            found.sort_by(f64::total_cmp);
            found
        };
        let expected = [along(100.0, &[-2.0, -1.0, 0.0, 1.0, 2.0])[2], along(200.0, &[-1.0, 0.0, 1.0])[0]];
        let is_near = |found: [f64; 2]| [0, 1].map(|at| (found[at] - expected[at]).abs() < 0.02);
        assert_eq!((is_near(heights(true)), is_near(heights(false))), ([true; 2], [false; 2]), "{expected:?}");
    }

    #[test]
    fn a_lake_of_a_hectare_has_room_that_tracks_have_not() {
        // The lake lies in two load modules; twenty tracks fill the northern one's corner.
        let ring = [(10.0, 20.0), (40.0, 20.0), (40.0, 60.0), (10.0, 60.0), (10.0, 20.0)];
        let track = |number: i64| {
            let north = 70.0 + number as f64;
            way(10 + number, "highway=track", &[(20.0, north), (25.0, north + 0.5)])
        };
        let sources = (0..20).map(track).chain([way(3, "natural=water", &ring)]);
        let all = AreaFeatures::of(sources.collect(), &[], 1.5, site(), &in_turn);
        let ground: Vec<Option<i32>> = all.stations().iter().map(|place| ground_at(*place, &|_, _| 5.0)).collect();
        let mut shares = Shares::each([8, 8], 40);
        shares.modules.iter_mut().for_each(|share| share.main = 64);
        let levelled = level_usual(&all, &ground, &shares);
        let of = |role: Role| levelled.reserved.formed.edges.iter().filter(|edge| edge.role == role).count();
        assert!(4 <= of(Role::Shore) && 0 < of(Role::Centre), "{} and {}", of(Role::Shore), of(Role::Centre));
        assert!(levelled.remarks.iter().any(|remark| remark.remedy.leaves_out()));
        assert!(levelled.reserved.left_out.iter().all(|left| matches!(left.why, crate::Why::Limit(_))));
    }

    #[test]
    fn a_road_that_is_a_line_for_want_of_room_leads_onto_a_bridge_as_a_strip() {
        let bends: Vec<(f64, f64)> = (0..12).map(|at| (60.0 + f64::from(at), 70.0 + f64::from(at % 2))).collect();
        let sources = || {
            vec![
                way(1, "highway=primary", &bends),
                way(2, "highway=primary bridge=yes", &[(71.0, 71.0), (74.0, 71.0)]),
                way(3, "highway=primary", &[(74.0, 71.0), (80.0, 71.0)]),
            ]
        };
        // Of all that there may be room for, some is enough for this and not for a strip over the whole.
        let is_both = |room: u64| {
            let formed = samples::levelled(sources(), |_, _| 5.0, &Shares::each([8, 8], room)).reserved.formed;
            let lines = formed.edges.iter().any(|edge| edge.id.number == 1 && edge.role == Role::Centre);
            let decks = || formed.decks.iter().flat_map(|deck| &deck.corners);
            let is_beside = |(place, _): &(Place, i32)| decks().any(|(corner, _)| corner == place);
            let onto = formed.faces.iter().any(|face| face.id.number == 1 && face.corners.iter().any(is_beside));
            lines && onto
        };
        assert!((20..80).any(is_both));
    }
}
