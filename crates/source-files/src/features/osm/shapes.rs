//! Lines and polygons of the ways and relations that were kept.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use terrain::{Each, gather};

use super::assemble::{NodeRing, Role, rings};
use super::block::OFF_THE_EARTH;
use super::kept::{KeptRelation, KeptWay, SEGMENT_M_MAX};
use super::nodes::{Nodes, degrees};
use crate::features::clip::Vertex;
use crate::features::model::{Done, Tags};
use crate::features::nest::{Nested, nested};
use crate::features::placing::{LEFT_OUT, Placing};
use crate::features::raw::{Part, RawFeature, RawShape};
use crate::limits::RINGS_MAX;

/// Places relations, then ways; `is_area` says which closed ways are polygons.
pub(super) fn place(
    nodes: &Nodes,
    ways: Vec<KeptWay>,
    relations: Vec<KeptRelation>,
    placing: &mut Placing,
    is_area: fn(&Tags) -> bool,
    each: Each,
) {
    let mut drawer = Drawer { nodes, ways: &ways, placing, is_area, drawn: HashSet::new() };
    for relation in relations {
        drawer.relation(relation);
    }
    let drawn = drawer.drawn;
    let pieces: Vec<&[KeptWay]> = ways.chunks(WAYS_A_PIECE).collect();
    let placed = gather(each, pieces.len(), |number| {
        let mut placing = placing.of_part();
        let mut drawer = Drawer { nodes, ways: &[], placing: &mut placing, is_area, drawn: HashSet::new() };
        pieces[number].iter().filter(|way| way.is_wanted).for_each(|way| drawer.way(way, &drawn));
        placing
    });
    placed.into_iter().for_each(|part| placing.append(part));
}

/// Ways that are placed by one worker at a time.
const WAYS_A_PIECE: usize = 2048;

/// What is done with a ring that cannot be used.
const RING_LEFT_OUT: Done = Done::LeftOut("the ring left out");

struct Drawer<'a> {
    nodes: &'a Nodes,
    ways: &'a [KeptWay],
    placing: &'a mut Placing,
    /// Whether a closed way with these tags is a polygon.
    is_area: fn(&Tags) -> bool,
    /// Ways that are outlines of a relation with the same tags.
    drawn: HashSet<i64>,
}

/// The nodes of a way or ring, and what is wrong with them.
struct Run {
    /// A place for each node; none for those that are not in the file, or far from all others.
    places: Vec<Option<Vertex>>,
    missing: usize,
    /// A node far from its neighbours, and how many kilometres.
    astray: Option<(i64, u32)>,
}

impl Drawer<'_> {
    fn way(&mut self, way: &KeptWay, drawn: &HashSet<i64>) {
        let id = format!("way/{}", way.id);
        if drawn.contains(&way.id) {
            let found = "the outline of a relation with the same tags".into();
            return self.placing.remark(&id, None, found, Done::Kept("read once, with the relation"));
        }
        let is_closed = 4 <= way.nodes.len() && way.nodes.first() == way.nodes.last();
        let run = match self.run(&way.nodes) {
            Ok(run) => run,
            Err(node) => {
                let found = format!("its node {node} is not on the Earth");
                return self.left_out(&id, None, found);
            }
        };
        let first = run.places.iter().flatten().next().copied();
        let at = |placing: &Placing| first.and_then(|vertex| placing.at(&vertex));
        let fault = run.fault();
        let parts = if is_closed && (self.is_area)(&way.tags) {
            match closed(run) {
                Some(ring) => {
                    self.tell(&id, at(self.placing), fault, Done::Kept("joined across"));
                    vec![Part::Polygon(vec![ring])]
                }
                None => {
                    let found = fault.unwrap_or_else(|| "fewer than 3 places".into());
                    return self.left_out(&id, at(self.placing), found);
                }
            }
        } else {
            let lines = pieces(run);
            if lines.is_empty() {
                let found = fault.unwrap_or_else(|| "fewer than 2 nodes".into());
                return self.left_out(&id, at(self.placing), found);
            }
            self.tell(&id, at(self.placing), fault, Done::Kept("cut there"));
            lines.into_iter().map(Part::Line).collect()
        };
        self.feature(id, way.tags.clone(), parts);
    }

    fn left_out(&mut self, id: &str, at: Option<[f64; 2]>, found: String) {
        self.placing.remark(id, at, found, LEFT_OUT);
        self.placing.count_left_out();
    }

    fn tell(&mut self, id: &str, at: Option<[f64; 2]>, fault: Option<String>, done: Done) {
        if let Some(fault) = fault {
            self.placing.remark(id, at, fault, done);
        }
    }

    fn feature(&mut self, id: String, tags: Tags, parts: Vec<Part>) {
        let shape = RawShape { has_heights: false, parts, other: None };
        self.placing.place(RawFeature { id, tags, shape });
    }

    /// Where nodes lie, or the first that is not on the Earth.
    fn run(&self, nodes: &[i64]) -> Result<Run, i64> {
        let mut run = Run { places: Vec::with_capacity(nodes.len()), missing: 0, astray: None };
        for &node in nodes {
            let place = self.nodes.place(node);
            if place == Some(OFF_THE_EARTH) {
                return Err(node);
            }
            run.missing += usize::from(place.is_none());
            run.places.push(place.map(|place| {
                let [longitude, latitude] = degrees(place);
                [longitude, latitude, f64::NAN]
            }));
        }
        run.drop_astray(nodes);
        Ok(run)
    }

    fn relation(&mut self, relation: KeptRelation) {
        let id = format!("relation/{}", relation.id);
        let (mut members, mut absent) = (Vec::new(), 0);
        let mut seen = HashSet::new();
        for &(role, way) in &relation.members {
            match self.ways.binary_search_by_key(&way, |way| way.id) {
                // A way that is listed twice bounds nothing the second time.
                Ok(_) if !seen.insert(way) => {}
                Ok(index) => members.push((role, &*self.ways[index].nodes, index)),
                Err(_) => absent += 1,
            }
        }
        if !relation.members.iter().any(|(role, _)| *role == Role::Outer) {
            return self.left_out(&id, None, "a multipolygon without an outer ring".into());
        }
        // Many relations may name the same ways, and each draws all of them again.
        let nodes: usize = members.iter().map(|(_, nodes, _)| nodes.len()).sum();
        self.placing.allowance().count(8 * nodes);
        if self.placing.allowance().is_spent() {
            return;
        }
        let joined = self.joined_by_place(&members);
        let lines: Vec<(Role, &[i64])> =
            members.iter().zip(&joined).map(|(&(role, ..), nodes)| (role, nodes.as_ref())).collect();
        let (rings, open) = rings(&lines);
        let first = members.iter().flat_map(|&(_, nodes, _)| nodes).find_map(|&node| self.nodes.place(node));
        let at = first.filter(|&place| place != OFF_THE_EARTH).and_then(|place| {
            let [longitude, latitude] = degrees(place);
            self.placing.at(&[longitude, latitude, 0.0])
        });
        let fault = match (absent, open.len()) {
            (0, 0) => None,
            (0, open) => Some(format!("{open} of its {} ways in no closed ring", lines.len())),
            (absent, _) => Some(format!("{absent} of its {} ways not in the file", absent + lines.len())),
        };
        if RINGS_MAX < rings.len() {
            return self.left_out(
                &id,
                at,
                format!("{} rings, more than the {RINGS_MAX} that are put together", rings.len()),
            );
        }
        let outlines: Vec<i64> = rings
            .iter()
            .filter(|ring| ring.role == Role::Outer)
            .flat_map(|ring| ring.ways.iter().map(|&way| self.ways[members[way].2].id))
            .collect();
        match self.polygons(&id, at, rings) {
            polygons if polygons.is_empty() => {
                let found = fault.unwrap_or_else(|| "no outer ring that is closed".into());
                self.left_out(&id, at, found);
            }
            polygons => {
                self.tell(&id, at, fault, Done::LeftOut("its closed rings kept, the others left out"));
                self.note_drawn(&relation.tags, outlines);
                self.feature(id, relation.tags, polygons.into_iter().map(Part::Polygon).collect());
            }
        }
    }

    /// The nodes of members, in which ends that lie at one place are one node: files made from others have two there.
    fn joined_by_place<'b>(&self, members: &[(Role, &'b [i64], usize)]) -> Vec<Cow<'b, [i64]>> {
        let mut at_place = HashMap::new();
        let mut node_of =
            |node: i64| self.nodes.place(node).map_or(node, |place| *at_place.entry(place).or_insert(node));
        let joined = |&(_, nodes, _): &(Role, &'b [i64], usize)| {
            let &[first, .., last] = nodes else { return Cow::Borrowed(nodes) };
            let ends = [first, last].map(&mut node_of);
            if ends == [first, last] {
                return Cow::Borrowed(nodes);
            }
            let mut nodes = nodes.to_vec();
            let end = nodes.len() - 1;
            (nodes[0], nodes[end]) = (ends[0], ends[1]);
            Cow::Owned(nodes)
        };
        members.iter().map(joined).collect()
    }

    /// Ways of outlines that would be read a second time by their own tags.
    fn note_drawn(&mut self, tags: &Tags, outlines: Vec<i64>) {
        let is_said = |way: &KeptWay| {
            let mut said = tags.iter().filter(|(key, _)| !matches!(key.as_ref(), "type" | "name" | "source"));
            way.is_wanted && said.all(|tag| way.tags.contains(tag))
        };
        let is_drawn = |id: &i64| {
            let way = self.ways.binary_search_by_key(id, |way| way.id);
            way.is_ok_and(|index| is_said(&self.ways[index]))
        };
        let drawn: Vec<i64> = outlines.into_iter().filter(is_drawn).collect();
        self.drawn.extend(drawn);
    }

    /// Polygons of rings: which lies in which decides, and roles where a ring lies in none.
    fn polygons(&mut self, id: &str, at: Option<[f64; 2]>, rings: Vec<NodeRing>) -> Vec<Vec<Vec<Vertex>>> {
        let mut placed: Vec<(Role, Vec<Vertex>)> = Vec::new();
        for NodeRing { nodes, role, .. } in rings {
            match self.run(&nodes) {
                Ok(run) => {
                    let fault = run.fault();
                    match closed(run) {
                        Some(ring) => {
                            self.tell(id, at, fault, Done::Kept("joined across"));
                            placed.push((role, ring));
                        }
                        None => {
                            let found = fault.unwrap_or_else(|| "a ring of fewer than 3 places".into());
                            self.tell(id, at, Some(found), RING_LEFT_OUT);
                        }
                    }
                }
                Err(node) => {
                    self.tell(id, at, Some(format!("its node {node} is not on the Earth")), RING_LEFT_OUT);
                }
            }
        }
        let nested = nested(placed, |(_, ring)| ring);
        let mut polygons: Vec<(usize, Vec<Vec<Vertex>>)> = Vec::new();
        let mut holes = Vec::new();
        for (index, Nested { ring: (role, ring), inside, depth }) in nested.into_iter().enumerate() {
            match (depth % 2, inside) {
                (1, Some(outer)) => holes.push((outer, ring)),
                (0, _) if role == Role::Inner => {
                    self.tell(id, at, Some("an inner ring outside all outer rings".into()), RING_LEFT_OUT);
                }
                _ => polygons.push((index, vec![ring])),
            }
        }
        for (outer, hole) in holes {
            if let Ok(polygon) = polygons.binary_search_by_key(&outer, |(index, _)| *index) {
                polygons[polygon].1.push(hole);
            }
        }
        polygons.into_iter().map(|(_, rings)| rings).collect()
    }
}

impl Run {
    /// What is to be told of it.
    fn fault(&self) -> Option<String> {
        match (self.missing, self.astray) {
            (0, None) => None,
            (0, Some((node, kilometres))) => Some(format!("its node {node} lies {kilometres} km from the next")),
            (missing, _) => Some(format!("{missing} of its {} nodes not in the file", self.places.len())),
        }
    }

    /// Takes away nodes that are farther than any segment is long from both their neighbours.
    fn drop_astray(&mut self, nodes: &[i64]) {
        let count = self.places.len();
        let gap = |from: usize, to: usize| match (self.places.get(from)?, self.places.get(to)?) {
            (Some(a), Some(b)) => Some(metres_between(a, b)),
            _ => None,
        };
        let is_closed = 1 < count && nodes.first() == nodes.last();
        let gaps: Vec<Option<f64>> = (1..count).map(|to| gap(to - 1, to)).collect();
        let is_long = |gap: Option<&Option<f64>>| gap.is_some_and(|gap| gap.is_some_and(|gap| SEGMENT_M_MAX < gap));
        let is_short = |gap: Option<&Option<f64>>| gap.is_some_and(|gap| gap.is_some_and(|gap| gap <= SEGMENT_M_MAX));
        let before = |index: usize| match index {
            0 if is_closed => gaps.last(),
            0 => None,
            _ => gaps.get(index - 1),
        };
        let after = |index: usize| if is_closed && index + 1 == count { gaps.first() } else { gaps.get(index) };
        let is_astray = |index: &usize| {
            let around = [before(*index), after(*index)];
            around.into_iter().any(is_long) && !around.into_iter().any(is_short)
        };
        let astray: Vec<usize> = (0..count).filter(is_astray).collect();
        if let Some((node, metres)) = gaps
            .iter()
            .zip(nodes)
            .filter_map(|(gap, node)| gap.filter(|&gap| SEGMENT_M_MAX < gap).map(|gap| (*node, gap)))
            .next()
        {
            let node = astray.first().map_or(node, |&index| nodes[index]);
            self.astray = Some((node, (metres / 1000.0) as u32));
        }
        astray.into_iter().for_each(|index| self.places[index] = None);
    }
}

/// Metres between two places, roughly: whether a segment is far too long does not need a cosine.
fn metres_between(a: &Vertex, b: &Vertex) -> f64 {
    const METRES_A_DEGREE: f64 = 111_200.0;
    let narrowed = 1.0 - (a[1] / 90.0) * (a[1] / 90.0);
    let (east, north) = ((b[0] - a[0]) * narrowed, b[1] - a[1]);
    METRES_A_DEGREE * (east * east + north * north).sqrt()
}

/// The lines of a run, cut where a node is missing or a segment far too long.
fn pieces(run: Run) -> Vec<Vec<Vertex>> {
    let mut lines: Vec<Vec<Vertex>> = vec![Vec::new()];
    for place in run.places {
        let last = lines.last_mut().expect("there is one from the beginning");
        match place {
            None => lines.push(Vec::new()),
            Some(vertex) if last.last().is_some_and(|before| SEGMENT_M_MAX < metres_between(before, &vertex)) => {
                lines.push(vec![vertex]);
            }
            Some(vertex) => last.push(vertex),
        }
    }
    lines.retain(|line| 2 <= line.len());
    lines
}

/// The ring of a run, without the nodes that are missing; `None` where more than half are, or fewer than 3 are left.
fn closed(run: Run) -> Option<Vec<Vertex>> {
    let count = run.places.len() - 1;
    let mut ring: Vec<Vertex> = run.places.into_iter().take(count).flatten().collect();
    if ring.len() < 3 || 2 * ring.len() < count {
        return None;
    }
    ring.push(ring[0]);
    let is_long = |pair: &[Vertex]| SEGMENT_M_MAX < metres_between(&pair[0], &pair[1]);
    (!ring.windows(2).any(is_long)).then_some(ring)
}
