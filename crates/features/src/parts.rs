//! What each stage hands to the next: which ways are travelled, which flow, where lakes lie along rivers.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::decks::Water;
use crate::rings::encloses;
use crate::rivers::{Fallen, Still};
use crate::strand::{Role, Strand};
use crate::{Edge, Kind, Lake, Network, Outline, Place, Rounded, Site, Way};

/// Edges of a river with the heights of their ends.
pub type Line = Vec<([Place; 2], [i32; 2])>;

/// Ways whose heights obey grades, and the outlines of aprons as closed ways among them.
pub fn travelled(rounded: &Rounded) -> Vec<Way> {
    let mut ways: Vec<Way> = rounded.ways.iter().filter(|way| way.traits.kind.is_travelled()).cloned().collect();
    for outline in rounded.outlines.iter().filter(|outline| outline.traits.kind.is_travelled()) {
        for ring in &outline.rings {
            let places = ring.places.iter().chain(ring.places.first()).copied().collect();
            ways.push(Way { traits: outline.traits, places, heights: Vec::new(), id: outline.id });
        }
    }
    ways.sort_by(|a, b| (&a.traits, &a.places, &a.heights, a.id).cmp(&(&b.traits, &b.places, &b.heights, b.id)));
    ways
}

/// Ways that flow.
pub fn flowing(rounded: &Rounded) -> Vec<Way> {
    rounded.ways.iter().filter(|way| way.traits.kind.flows()).cloned().collect()
}

/// Places on dams and weirs, at which two bodies of water stay apart.
pub fn dams(rounded: &Rounded) -> HashSet<Place> {
    let lines = rounded.ways.iter().filter(|way| way.traits.kind == Kind::Dam).flat_map(|way| &way.places);
    let outlines = rounded.outlines.iter().filter(|outline| outline.traits.kind == Kind::Dam);
    let rings = outlines.flat_map(|outline| &outline.rings).flat_map(|ring| &ring.places);
    lines.chain(rings).copied().collect()
}

/// Breaklines with the heights of their source where a rule says so, else those of the ground at each place. Outlines
/// of breaklines that are polygons are closed ones.
pub fn breaklines(rounded: &Rounded, ground: &dyn Fn(Place) -> Option<i32>) -> Vec<Strand> {
    let mut strands = Vec::new();
    for way in rounded.ways.iter().filter(|way| way.traits.kind == Kind::Breakline) {
        let own = |place: &Place| {
            let first = way.heights.partition_point(|(other, _)| other < place);
            way.heights.get(first).filter(|(other, _)| other == place).map(|(_, height)| *height)
        };
        let stations = way.places.iter().map(|place| (*place, own(place).or_else(|| ground(*place)).unwrap_or(0)));
        let stations = stations.collect();
        strands.push(Strand { role: Role::Breakline, class: way.traits.class, id: way.id, stations });
    }
    for outline in rounded.outlines.iter().filter(|outline| outline.traits.kind == Kind::Breakline) {
        for ring in &outline.rings {
            let places = ring.places.iter().chain(ring.places.first());
            let stations = places.map(|place| (*place, ground(*place).unwrap_or(0))).collect();
            strands.push(Strand { role: Role::Breakline, class: outline.traits.class, id: outline.id, stations });
        }
    }
    strands
}

/// The middle lines of rivers and streams on the ground, reach by reach, each downstream: none goes on through a place
/// to which water flows from both sides, or from which it flows to both. What flows in a pipe is not in the ground.
pub fn channels(network: &Network, fallen: &Fallen) -> Vec<Strand> {
    let foot = |edge: u32| {
        let Edge { a, b, .. } = network.edges[edge as usize];
        if fallen.turned[edge as usize] { a } else { b }
    };
    let flows_through = |node: u32| match network.beside(node) {
        [(_, one), (_, other)] => {
            network.traits(*one) == network.traits(*other) && (foot(*one) == node) != (foot(*other) == node)
        }
        _ => false,
    };
    let strand = |(nodes, edges): (Vec<u32>, Vec<u32>)| {
        let station = |node: &u32| (network.nodes[*node as usize].place, fallen.heights[*node as usize]);
        let class = network.traits(edges[0]).class;
        let id = network.ways[network.edges[edges[0] as usize].way as usize].id;
        let mut stations: Vec<(Place, i32)> = nodes.iter().map(station).collect();
        if foot(edges[0]) == nodes[0] {
            stations.reverse();
        }
        Strand { role: Role::Channel, class, id, stations }
    };
    network.runs(&|edge| network.is_ground(edge), &flows_through).into_iter().map(strand).collect()
}

/// What decks cross: every piece of channels and shores, as its class says.
pub fn water<'a>(strands: impl IntoIterator<Item = &'a Strand>) -> Vec<Water> {
    let mut water = Vec::new();
    for strand in strands {
        let kind = match strand.role {
            Role::Channel | Role::Bank => Kind::River,
            Role::Shore => Kind::Lake,
            _ => continue,
        };
        let pieces = strand.stations.windows(2);
        water.extend(pieces.map(|pair| Water { ends: [pair[0].0, pair[1].0], heights: [pair[0].1, pair[1].1], kind }));
    }
    water
}

/// Edges of a network by cells of a load module, to find those inside an outline.
struct Cells<'a> {
    network: &'a Network,
    site: &'a Site,
    edges: HashMap<(i32, i32), Vec<u32>>,
}

impl<'a> Cells<'a> {
    fn of(network: &'a Network, site: &'a Site) -> Self {
        let mut edges: HashMap<(i32, i32), Vec<u32>> = HashMap::new();
        for edge in 0..network.edges.len() as u32 {
            edges.entry(site.module_of(network.segment(edge).a)).or_default().push(edge);
        }
        Self { network, site, edges }
    }

    /// Edges with their middle inside an outline.
    fn inside(&self, outline: &Outline) -> Vec<u32> {
        let places = || outline.rings.iter().flat_map(|ring| &ring.places);
        let modules: Vec<(i32, i32)> = places().map(|place| self.site.module_of(*place)).collect();
        let span = |of: fn(&(i32, i32)) -> i32| {
            let (low, high) = (modules.iter().map(of).min(), modules.iter().map(of).max());
            low.unwrap_or(0) - 1..=high.unwrap_or(-1) + 1
        };
        let mut inside = Vec::new();
        for row in span(|module| module.0) {
            for col in span(|module| module.1) {
                inside.extend(self.edges.get(&(row, col)).into_iter().flatten().copied());
            }
        }
        inside.retain(|edge| {
            let segment = self.network.segment(*edge);
            let middle = Place::new(segment.a.row + segment.b.row, segment.a.col + segment.b.col);
            encloses_doubled(outline, middle)
        });
        inside.sort_unstable();
        inside
    }
}

/// Whether a place in half steps lies inside an outline and in none of its holes.
fn encloses_doubled(outline: &Outline, middle: Place) -> bool {
    let around = outline.rings.iter().filter(|ring| {
        let doubled: Vec<Place> = ring.places.iter().map(|place| Place::new(2 * place.row, 2 * place.col)).collect();
        encloses(&doubled, middle)
    });
    around.count() % 2 == 1
}

/// In which outlines of rivers a line runs.
pub fn have_line(outlines: &[Outline], rivers: &Network, site: &Site) -> Vec<bool> {
    let cells = Cells::of(rivers, site);
    outlines.iter().map(|outline| outline.traits.kind == Kind::River && !cells.inside(outline).is_empty()).collect()
}

/// The lines inside some outlines, with their heights.
pub fn lines_inside(
    outlines: &[Outline],
    numbers: &[u32],
    rivers: &Network,
    fallen: &Fallen,
    site: &Site,
) -> Vec<Line> {
    let cells = Cells::of(rivers, site);
    let ends = |edge: u32| {
        let (edge, segment) = (&rivers.edges[edge as usize], rivers.segment(edge));
        ([segment.a, segment.b], [fallen.heights[edge.a as usize], fallen.heights[edge.b as usize]])
    };
    numbers.iter().map(|&number| cells.inside(&outlines[number as usize]).into_iter().map(ends).collect()).collect()
}

/// The bodies of water of an area with the nodes of a network that lie in them or at their shores, each node in the
/// lowest of several.
pub fn lakes_along(outlines: &[Outline], lakes: &[Lake], network: &Network, site: &Site) -> Vec<Still> {
    let mut lake_of: Vec<Option<(i32, u32)>> = vec![None; network.nodes.len()];
    let mut lower = |node: u32, lake: &Lake| {
        let of_node = &mut lake_of[node as usize];
        let of = (lake.level, lake.body);
        *of_node = Some(of_node.map_or(of, |other| other.min(of)));
    };
    let cells = Cells::of(network, site);
    for lake in lakes {
        let outline = &outlines[lake.outline as usize];
        for edge in cells.inside(outline).into_iter().filter(|edge| network.is_ground(*edge)) {
            lower(network.edges[edge as usize].a, lake);
            lower(network.edges[edge as usize].b, lake);
        }
        for place in outline.places() {
            let first = network.nodes.partition_point(|node| node.place < place);
            let here = network.nodes[first..].iter().take_while(|node| node.place == place);
            let on_ground = (first as u32..).zip(here).filter(|(_, node)| node.on_ground);
            on_ground.for_each(|(node, _)| lower(node, lake));
        }
    }
    let mut still: BTreeMap<u32, Still> = BTreeMap::new();
    for lake in lakes {
        let outline = &outlines[lake.outline as usize];
        let Some(place) = outline.rings.first().and_then(|ring| ring.places.first().copied()) else { continue };
        let Lake { level, is_fixed, body, .. } = *lake;
        let of = still.entry(body).or_insert(Still {
            body,
            place,
            id: outline.id,
            level,
            is_fixed,
            shore: 0,
            nodes: Vec::new(),
        });
        for ring in &outline.rings {
            let ends = ring.places.iter().zip(ring.places.iter().cycle().skip(1));
            let quanta: i64 = ends.map(|(a, b)| site.lattice.length(*a, *b)).sum();
            of.shore += (10 * quanta / i64::from(terrain::QUANTA_PER_METRE)).max(1);
        }
    }
    for (node, of) in (0..).zip(lake_of) {
        if let Some(still) = of.and_then(|(_, body)| still.get_mut(&body)) {
            still.nodes.push(node);
        }
    }
    still.into_values().collect()
}
