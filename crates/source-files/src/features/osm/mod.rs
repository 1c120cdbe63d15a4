//! OpenStreetMap data in protocol buffers (`.osm.pbf`).
//!
//! Ways name their nodes and relations their ways, so the file is gone through several times: all blocks for the nodes
//! near the area, blocks of relations for the multipolygons that are wanted, blocks of ways for those with a node near
//! the area, and, for what those need from farther away, the few blocks whose ids reach that far. What is kept is
//! bounded by what lies near the area, not by the file. A way that crosses the area without a node near it is not
//! seen: its segment would be longer than [`SEGMENT_M_MAX`], and segments that long are cut.

mod assemble;
mod block;
mod buildings;
pub(crate) mod frames;
mod kept;
mod nodes;
mod shapes;
mod wire;

use std::sync::Arc;

use terrain::Each;

use super::columns::Texts;
use super::model::{FeatureFile, Tags, Wanted};
use super::placing::{LEFT_OUT, Placing};
use super::raw::{Part, RawFeature, RawShape};
use crate::SourceError;
use crate::crs::Crs;
use crate::features::osm::assemble::Role;
use crate::features::osm::block::{Block, Contents, Demands, MemberKind, OFF_THE_EARTH, Way};
use crate::features::osm::buildings::{BuildingTexts, Buildings};
use crate::features::osm::frames::{Frame, FrameKind, Frames, Stop};
use crate::features::osm::kept::{KeptRelation, KeptWay, KnownTexts, SEGMENT_M_MAX, sort_ways, wanted_texts};
use crate::features::osm::nodes::{Nodes, degrees};
use crate::limits::Allowance;
use crate::store::Store;

/// Whom to name (Open Database License, section 4.3).
pub(super) const ATTRIBUTION: &str = "(c) OpenStreetMap contributors, ODbL 1.0";
/// Ways without a node near the area that are looked at for whether their nodes are in the file at all.
const LOST_MAX: usize = 100_000;

/// A file on its way to features.
struct Reader<'a> {
    frames: Frames<'a>,
    blocks: Vec<(Frame, Contents)>,
    keys: &'a [&'a str],
    nodes: Nodes,
    texts: Texts,
    ways: Vec<KeptWay>,
    /// Wanted ways that have no node near the area: their first nodes, as far as they are looked at.
    lost: Vec<(i64, i64)>,
    far_ways: u64,
    /// Buildings, where they are wanted.
    buildings: Option<Buildings>,
    /// What all of it may take.
    allowance: Arc<Allowance>,
}

pub(super) fn read(store: &Store, wanted: &Wanted, each: Each) -> Result<FeatureFile, SourceError> {
    let mut placing = Placing::new(store.path(), store.len(), wanted, Some(Crs::wgs84()))?;
    let mut reader = Reader {
        frames: Frames::open(store)?,
        blocks: Vec::new(),
        keys: wanted.keys,
        // Sines of latitudes are not computed where segments are measured, so some more is kept.
        nodes: Nodes::new(placing.within(1.25 * SEGMENT_M_MAX)),
        texts: Texts::default(),
        ways: Vec::new(),
        lost: Vec::new(),
        far_ways: 0,
        buildings: wanted.buildings.then(|| Buildings::new(placing.within(0.0))),
        allowance: placing.allowance().clone(),
    };
    reader.survey(store)?;
    let mut relations = reader.relations()?;
    let mut members = Members::of(&relations);
    reader.near_ways(&mut members, &mut placing)?;
    members.tell_absent(&mut relations, &mut placing);
    let all = relations.len();
    reader.keep_reached(&mut relations)?;
    reader.far_nodes()?;
    placing.lies_over(&reader.nodes.lies);
    placing.count_outside((all - relations.len()) as u64);
    reader.tell_lost(&mut placing);
    if wanted.points {
        reader.points(&mut placing)?;
    }
    let Reader { nodes, ways, buildings, .. } = reader;
    let buildings = buildings.map(|buildings| buildings.placed(&nodes, &placing, each)).unwrap_or_default();
    shapes::place(&nodes, ways, relations, &mut placing, is_area, each);
    Ok(FeatureFile { buildings, ..placing.finish(Some(ATTRIBUTION))? })
}

impl<'a> Reader<'a> {
    /// Goes through all blocks: what each holds, and where nodes near the area lie.
    fn survey(&mut self, store: &Store) -> Result<(), SourceError> {
        let mut way = Way::default();
        let mut has_places_on_ways = false;
        for frame in self.frames.list()? {
            match frame.kind {
                FrameKind::Other => {}
                FrameKind::Header => {
                    let demands = self.frames.with_bytes(&frame, Demands::read)?;
                    if let Some(name) = demands.required.iter().find(|name| !KNOWN.contains(&name.as_str())) {
                        let found = format!("OpenStreetMap data that asks its readers for `{name}`");
                        return Err(SourceError::NotFeatures { path: store.path().into(), found });
                    }
                    has_places_on_ways = demands.has_places_on_ways;
                }
                FrameKind::Data => {
                    let (nodes, allowance) = (&mut self.nodes, &self.allowance);
                    let contents = self.frames.with_bytes(&frame, |bytes| {
                        let block = Block::read(bytes)?;
                        if has_places_on_ways {
                            block.ways(&mut way, |way| {
                                let mut placed = way.nodes.iter().zip(&way.places);
                                Ok::<_, Stop>(placed.try_for_each(|(&id, &place)| nodes.see(id, place, allowance))?)
                            })?;
                        }
                        block.contents(|id, place| Ok::<_, Stop>(nodes.see(id, place, allowance)?))
                    })?;
                    self.allowance.take(size_of::<(Frame, Contents)>())?;
                    self.blocks.push((frame, contents));
                }
            }
        }
        self.nodes.sort();
        Ok(())
    }

    /// The multipolygon relations with a wanted key.
    fn relations(&mut self) -> Result<Vec<KeptRelation>, SourceError> {
        let Self { frames, blocks, keys, texts, buildings, allowance, .. } = self;
        let mut kept = Vec::new();
        for (frame, _) in blocks.iter().filter(|(_, contents)| contents.relations) {
            frames.with_bytes(frame, |bytes| {
                let block = Block::read(bytes)?;
                let is_wanted = wanted_texts(&block, keys);
                let of_buildings = BuildingTexts::of(&block);
                let mut known = KnownTexts::of(&block);
                block.relations(|relation| {
                    let is_multipolygon = relation
                        .tags
                        .iter()
                        .any(|&(key, value)| block.texts[key] == b"type" && block.texts[value] == b"multipolygon");
                    if let (true, Some(buildings)) = (is_multipolygon, &mut *buildings) {
                        buildings.see_relation(&block, relation, &of_buildings, (&mut known, texts), allowance)?;
                    }
                    if !is_multipolygon || !relation.tags.iter().any(|&(key, _)| is_wanted[key]) {
                        return Ok::<_, Stop>(());
                    }
                    let role = |text: &[u8]| if text == b"inner" { Role::Inner } else { Role::Outer };
                    let ways = relation.members.iter().filter(|(kind, ..)| *kind == MemberKind::Way);
                    let members = ways.map(|&(_, id, text)| (role(block.texts[text]), id)).collect();
                    let tags = known.tags(&block, &relation.tags, texts);
                    texts.count(allowance);
                    kept.push(KeptRelation { id: relation.id, tags, members }.counted(allowance)?);
                    Ok(())
                })
            })?;
        }
        buildings.iter_mut().for_each(Buildings::sort_relations);
        kept.sort_by_key(|relation: &KeptRelation| relation.id);
        kept.dedup_by_key(|relation| relation.id);
        Ok(kept)
    }

    /// Keeps ways with a node near the area that are wanted, by themselves or by a relation.
    fn near_ways(&mut self, members: &mut Members, placing: &mut Placing) -> Result<(), SourceError> {
        let Self { frames, blocks, keys, nodes, texts, ways, lost, far_ways, buildings, allowance } = self;
        let mut way = Way::default();
        for (frame, _) in blocks.iter().filter(|(_, contents)| contents.ways.is_some()) {
            frames.with_bytes(frame, |bytes| {
                let block = Block::read(bytes)?;
                let is_wanted_text = wanted_texts(&block, keys);
                let of_buildings = BuildingTexts::of(&block);
                let mut known = KnownTexts::of(&block);
                block.ways(&mut way, |way| {
                    if let Some(buildings) = buildings {
                        buildings.see_way(&block, way, &of_buildings, (&mut known, texts), nodes, allowance)?;
                    }
                    let is_wanted = way.tags.iter().any(|&(key, _)| is_wanted_text[key]);
                    let is_member = members.see(way.id);
                    if !is_wanted && !is_member {
                        return Ok::<_, Stop>(());
                    }
                    let near = way.nodes.iter().filter(|&&node| nodes.is_near(node)).count();
                    if 0 < near {
                        let tags = if is_wanted { known.tags(&block, &way.tags, texts) } else { Tags::new() };
                        let (reaches_out, nodes) = (near < way.nodes.len(), way.nodes.as_slice().into());
                        texts.count(allowance);
                        ways.push(KeptWay { id: way.id, tags, nodes, reaches_out, is_wanted }.counted(allowance)?);
                    } else if is_wanted {
                        *far_ways += 1;
                        match way.nodes.first() {
                            Some(&node) if lost.len() < LOST_MAX => lost.push((way.id, node)),
                            Some(_) => {}
                            None => placing.remark(&format!("way/{}", way.id), None, "no nodes".into(), LEFT_OUT),
                        }
                    }
                    Ok(())
                })
            })?;
        }
        sort_ways(ways);
        Ok(())
    }

    /// Lets go of relations without a way near the area, and fetches the other ways of those that have one.
    fn keep_reached(&mut self, relations: &mut Vec<KeptRelation>) -> Result<(), SourceError> {
        let Self { frames, blocks, ways, allowance, .. } = self;
        let is_kept = |id: i64| ways.binary_search_by_key(&id, |way| way.id).is_ok();
        relations.retain(|relation| relation.members.is_empty() || relation.members.iter().any(|(_, id)| is_kept(*id)));
        let mut missing = member_ids(relations);
        missing.retain(|&id| !is_kept(id));
        let mut way = Way::default();
        for (frame, contents) in blocks.iter() {
            if !contents.ways.is_some_and(|range| reaches(&missing, range)) {
                continue;
            }
            frames.with_bytes(frame, |bytes| {
                Block::read(bytes)?.ways(&mut way, |way| {
                    if missing.binary_search(&way.id).is_ok() {
                        let nodes = way.nodes.as_slice().into();
                        let tags = Tags::new();
                        let way = KeptWay { id: way.id, tags, nodes, reaches_out: true, is_wanted: false };
                        ways.push(way.counted(allowance)?);
                    }
                    Ok::<_, Stop>(())
                })
            })?;
        }
        sort_ways(ways);
        Ok(())
    }

    /// Finds the nodes of kept ways that are not near the area.
    fn far_nodes(&mut self) -> Result<(), SourceError> {
        let Self { frames, blocks, nodes, ways, lost, allowance, .. } = self;
        let of_ways = ways.iter().filter(|way| way.reaches_out).flat_map(|way| way.nodes.iter().copied());
        let of_ways = of_ways.filter(|&id| !nodes.is_near(id));
        let mut missing: Vec<i64> = of_ways.chain(lost.iter().map(|&(_, node)| node)).collect();
        missing.sort_unstable();
        missing.dedup();
        for (frame, contents) in blocks.iter() {
            if !contents.nodes.is_some_and(|range| reaches(&missing, range)) {
                continue;
            }
            frames.with_bytes(frame, |bytes| {
                Block::read(bytes)?.nodes(|id, place| match missing.binary_search(&id) {
                    Ok(_) => Ok::<_, Stop>(nodes.keep(id, place, allowance)?),
                    Err(_) => Ok(()),
                })
            })?;
        }
        nodes.sort();
        Ok(())
    }

    /// Places nodes that lie in the area and have a wanted key.
    fn points(&mut self, placing: &mut Placing) -> Result<(), SourceError> {
        let Self { frames, blocks, keys, texts, .. } = self;
        let inside = placing.within(0.0);
        for (frame, _) in blocks.iter().filter(|(_, contents)| contents.nodes.is_some()) {
            frames.with_bytes(frame, |bytes| {
                let block = Block::read(bytes)?;
                let is_wanted = wanted_texts(&block, keys);
                let mut known = KnownTexts::of(&block);
                block.tagged_nodes(|id, place, tags| {
                    let [east, north] = degrees(place);
                    if inside.holds([east, north]) && tags.iter().any(|&(key, _)| is_wanted[key]) {
                        let parts = vec![Part::Point([east, north, f64::NAN])];
                        let shape = RawShape { parts, ..RawShape::default() };
                        let tags = known.tags(&block, tags, texts);
                        texts.count(placing.allowance());
                        placing.place(RawFeature { id: format!("node/{id}"), tags, shape });
                    }
                    Ok::<_, Stop>(())
                })
            })?;
        }
        Ok(())
    }

    /// Tells ways that lie nowhere; others without a node near the area are only counted.
    fn tell_lost(&mut self, placing: &mut Placing) {
        for &(way, node) in &self.lost {
            let found = match self.nodes.place(node) {
                None => format!("its first node ({node}) is not in the file, and none of its others near the area"),
                Some(OFF_THE_EARTH) => format!("its node {node} is not on the Earth"),
                Some(_) => continue,
            };
            placing.remark(&format!("way/{way}"), None, found, LEFT_OUT);
        }
        placing.count_outside(self.far_ways);
    }
}

/// The ways that relations name, and which of them are in the file.
struct Members {
    /// In order, each once.
    ids: Vec<i64>,
    seen: Vec<bool>,
}

impl Members {
    fn of(relations: &[KeptRelation]) -> Self {
        let ids = member_ids(relations);
        Self { seen: vec![false; ids.len()], ids }
    }

    /// Takes note of a way of the file; whether a relation names it.
    fn see(&mut self, id: i64) -> bool {
        let found = self.ids.binary_search(&id);
        found.iter().for_each(|&index| self.seen[index] = true);
        found.is_ok()
    }

    /// Leaves out relations none of whose ways is in the file, which lie nowhere, and tells them.
    fn tell_absent(&self, relations: &mut Vec<KeptRelation>, placing: &mut Placing) {
        let is_there = |id: &i64| self.ids.binary_search(id).is_ok_and(|index| self.seen[index]);
        relations.retain(|relation| {
            let lies_somewhere = relation.members.is_empty() || relation.members.iter().any(|(_, id)| is_there(id));
            if !lies_somewhere {
                let count = relation.members.len();
                let found = format!("none of its {count} ways in the file");
                placing.remark(&format!("relation/{}", relation.id), None, found, LEFT_OUT);
                placing.count_left_out();
            }
            lies_somewhere
        });
    }
}

/// What a file may demand of its readers here.
const KNOWN: [&str; 2] = ["OsmSchema-V0.6", "DenseNodes"];

fn member_ids(relations: &[KeptRelation]) -> Vec<i64> {
    let mut ids: Vec<i64> = relations.iter().flat_map(|relation| relation.members.iter().map(|(_, id)| *id)).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

/// Whether some of the sorted ids lie in a range.
fn reaches(ids: &[i64], [least, most]: [i64; 2]) -> bool {
    ids.get(ids.partition_point(|&id| id < least)).is_some_and(|&id| id <= most)
}

/// What a closed way with a key stands for.
enum Closed {
    /// An area, but for some values.
    AreaUnless(&'static [&'static str]),
    /// A line, but for some values.
    LineUnless(&'static [&'static str]),
}

const KEYS: [(&str, Closed); 6] = [
    (
        "natural",
        Closed::AreaUnless(&["coastline", "cliff", "ridge", "arete", "tree_row", "valley", "gully", "earth_bank"]),
    ),
    ("landuse", Closed::AreaUnless(&[])),
    ("water", Closed::AreaUnless(&[])),
    ("waterway", Closed::LineUnless(&["riverbank", "dock", "boatyard", "dam"])),
    ("aeroway", Closed::LineUnless(&["apron", "runway", "aerodrome", "helipad", "heliport", "terminal"])),
    (
        "man_made",
        Closed::AreaUnless(&["embankment", "cutline", "dyke", "pipeline", "groyne", "breakwater", "goods_conveyor"]),
    ),
];

/// Whether a closed way with these tags is an area: where `area` says so, else where one of its keys does and it is
/// no road or railway, which may go round in circles.
fn is_area(tags: &Tags) -> bool {
    let value = |key: &str| tags.iter().find(|(other, _)| other.as_ref() == key).map(|(_, value)| value.as_ref());
    match value("area") {
        Some("yes") => return true,
        Some("no") => return false,
        _ => {}
    }
    if value("highway").is_some() || value("railway").is_some() {
        return false;
    }
    KEYS.iter().any(|(key, closed)| match (value(key), closed) {
        (None, _) => false,
        (Some(value), Closed::AreaUnless(lines)) => !lines.contains(&value),
        (Some(value), Closed::LineUnless(areas)) => areas.contains(&value),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(tags: &[(&str, &str)], expected: bool) {
        let tags: Tags = tags.iter().map(|&(key, value)| (key.into(), value.into())).collect();
        assert_eq!(is_area(&tags), expected, "{tags:?}");
    }

    #[test]
    fn closed_ways_are_areas_where_their_tags_say_so() {
        check(&[("highway", "primary")], false);
        check(&[("highway", "pedestrian"), ("area", "yes")], true);
        check(&[("highway", "track"), ("landuse", "forest")], false);
        check(&[("natural", "water")], true);
        check(&[("natural", "water"), ("area", "no")], false);
        check(&[("natural", "coastline")], false);
        check(&[("waterway", "canal")], false);
        check(&[("waterway", "riverbank")], true);
        check(&[("aeroway", "taxiway")], false);
        check(&[("aeroway", "apron")], true);
        check(&[("name", "x")], false);
    }
}
