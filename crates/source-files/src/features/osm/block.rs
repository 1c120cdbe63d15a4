//! The nodes, ways and relations of an unpacked block.

use super::wire::{Fault, Fields, Value, signed};
use crate::limits::OSM_STRINGS_MAX;

/// A place in ten-millionths of a degree, longitude first, which is what OpenStreetMap keeps.
pub(super) type Decimicro = [i32; 2];

/// The place of a node whose coordinates are not on the Earth.
pub(super) const OFF_THE_EARTH: Decimicro = [i32::MAX; 2];

/// What a block holds: the lowest and highest ids of its nodes and ways, and whether there are relations.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Contents {
    pub nodes: Option<[i64; 2]>,
    pub ways: Option<[i64; 2]>,
    pub relations: bool,
}

/// What a file demands of its readers.
#[derive(Debug, Default)]
pub(super) struct Demands {
    pub required: Vec<String>,
    pub has_places_on_ways: bool,
}

impl Demands {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, Fault> {
        let mut demands = Self::default();
        for field in Fields(bytes) {
            match field? {
                (4, value) => demands.required.push(String::from_utf8_lossy(value.bytes()?).into_owned()),
                (5, value) => demands.has_places_on_ways |= value.bytes()? == b"LocationsOnWays",
                _ => {}
            }
        }
        Ok(demands)
    }
}

/// A block whose texts and groups have been found.
pub(super) struct Block<'a> {
    pub texts: Vec<&'a [u8]>,
    groups: Vec<&'a [u8]>,
    granularity: i64,
    offset: [i64; 2],
}

/// A way as it lies in a block. One is used for all ways of a file, so that its lists are allocated once.
#[derive(Debug, Default)]
pub(super) struct Way {
    pub id: i64,
    /// Indices of keys and values in the texts of the block.
    pub tags: Vec<(usize, usize)>,
    pub nodes: Vec<i64>,
    /// Places of its nodes, where the file has them on ways.
    pub places: Vec<Decimicro>,
    lists: [Vec<usize>; 2],
    axes: [Vec<i64>; 2],
}

/// What a member of a relation is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MemberKind {
    Way,
    /// A node, a relation, or something that this reader does not know.
    Other,
}

/// A relation as it lies in a block.
#[derive(Debug, Default)]
pub(super) struct Relation {
    pub id: i64,
    pub tags: Vec<(usize, usize)>,
    /// Kind, id, and the index of its role in the texts of the block.
    pub members: Vec<(MemberKind, i64, usize)>,
}

impl<'a> Block<'a> {
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, Fault> {
        let mut block = Self { texts: Vec::new(), groups: Vec::new(), granularity: 100, offset: [0; 2] };
        for field in Fields(bytes) {
            match field? {
                (1, value) => {
                    for text in Fields(value.bytes()?) {
                        block.texts.push(text?.1.bytes()?);
                        if OSM_STRINGS_MAX < block.texts.len() {
                            return Err("more texts than any block of OpenStreetMap has");
                        }
                    }
                }
                (2, value) if block.groups.len() < OSM_STRINGS_MAX => block.groups.push(value.bytes()?),
                (2, _) => return Err("more groups than any block of OpenStreetMap has"),
                (17, value) => block.granularity = value.number()?.cast_signed(),
                (19, value) => block.offset[1] = value.number()?.cast_signed(),
                (20, value) => block.offset[0] = value.number()?.cast_signed(),
                _ => {}
            }
        }
        Ok(block)
    }

    /// The text at an index.
    pub(super) fn text(&self, index: usize) -> Result<&'a [u8], Fault> {
        self.texts.get(index).copied().ok_or("a text that is not in its table")
    }

    /// The place that a node's numbers stand for.
    fn place(&self, east: i64, north: i64) -> Decimicro {
        let axis = |offset: i64, number: i64, limit: i64| {
            let nano = self.granularity.checked_mul(number).and_then(|nano| nano.checked_add(offset))?;
            (nano.unsigned_abs() <= (limit * 1_000_000_000).unsigned_abs()).then_some((nano / 100) as i32)
        };
        match (axis(self.offset[0], east, 180), axis(self.offset[1], north, 90)) {
            (Some(longitude), Some(latitude)) => [longitude, latitude],
            _ => OFF_THE_EARTH,
        }
    }

    /// Tells `found` the id and place of every node.
    pub(super) fn nodes<E: From<Fault>>(
        &self,
        mut found: impl FnMut(i64, Decimicro) -> Result<(), E>,
    ) -> Result<(), E> {
        self.each_node(false, |id, place, _| found(id, place))
    }

    /// Tells `found` the id, place and tags of every node that has some: indices of keys and values in the texts.
    pub(super) fn tagged_nodes<E: From<Fault>>(
        &self,
        mut found: impl FnMut(i64, Decimicro, &[(usize, usize)]) -> Result<(), E>,
    ) -> Result<(), E> {
        self.each_node(true, |id, place, tags| if tags.is_empty() { Ok(()) } else { found(id, place, tags) })
    }

    /// All nodes, with their tags where they are asked for.
    fn each_node<E: From<Fault>>(
        &self,
        with_tags: bool,
        mut found: impl FnMut(i64, Decimicro, &[(usize, usize)]) -> Result<(), E>,
    ) -> Result<(), E> {
        let (mut keys, mut values, mut tags) = (Vec::new(), Vec::new(), Vec::new());
        for group in &self.groups {
            for field in Fields(group) {
                match field? {
                    (1, value) => {
                        let (mut id, mut at) = (0, [0; 2]);
                        _ = [&mut keys, &mut values].map(Vec::clear);
                        for field in Fields(value.bytes()?) {
                            match field? {
                                (1, value) => id = signed(value.number()?),
                                (2, value) if with_tags => value.append_to(&mut keys, |index| index as usize)?,
                                (3, value) if with_tags => value.append_to(&mut values, |index| index as usize)?,
                                (8, value) => at[1] = signed(value.number()?),
                                (9, value) => at[0] = signed(value.number()?),
                                _ => {}
                            }
                        }
                        self.tags(&keys, &values, &mut tags)?;
                        found(id, self.place(at[0], at[1]), &tags)?;
                    }
                    (2, value) => self.dense_nodes(value.bytes()?, with_tags, &mut found)?,
                    _ => {}
                }
            }
        }
        Ok(())
    }

    fn dense_nodes<E: From<Fault>>(
        &self,
        bytes: &[u8],
        with_tags: bool,
        found: &mut impl FnMut(i64, Decimicro, &[(usize, usize)]) -> Result<(), E>,
    ) -> Result<(), E> {
        let [mut ids, mut norths, mut easts] = [const { Vec::new() }; 3];
        // Keys and values by turns, a 0 after those of each node; nothing where no node has any.
        let (mut texts, mut tags): (Vec<usize>, Vec<(usize, usize)>) = (Vec::new(), Vec::new());
        for field in Fields(bytes) {
            match field? {
                (1, value) => value.append_to(&mut ids, signed)?,
                (8, value) => value.append_to(&mut norths, signed)?,
                (9, value) => value.append_to(&mut easts, signed)?,
                (10, value) if with_tags => value.append_to(&mut texts, |index| index as usize)?,
                _ => {}
            }
        }
        let mut texts = texts.into_iter();
        if ids.len() != norths.len() || ids.len() != easts.len() {
            return Err("nodes without one latitude and longitude each".into());
        }
        let (mut id, mut at) = (0_i64, [0_i64; 2]);
        for ((step, east), north) in ids.into_iter().zip(easts).zip(norths) {
            id = id.wrapping_add(step);
            at = [at[0].wrapping_add(east), at[1].wrapping_add(north)];
            tags.clear();
            while let Some(key) = texts.next().filter(|key| *key != 0) {
                let value = texts.next().ok_or("a node's key without a value")?;
                self.text(key)?;
                self.text(value)?;
                tags.push((key, value));
            }
            found(id, self.place(at[0], at[1]), &tags)?;
        }
        Ok(())
    }

    /// Tells `found` every way.
    pub(super) fn ways<E: From<Fault>>(
        &self,
        way: &mut Way,
        mut found: impl FnMut(&Way) -> Result<(), E>,
    ) -> Result<(), E> {
        for group in &self.groups {
            for field in Fields(group) {
                if let (3, value) = field? {
                    self.way(value.bytes()?, way)?;
                    found(way)?;
                }
            }
        }
        Ok(())
    }

    fn way(&self, bytes: &[u8], way: &mut Way) -> Result<(), Fault> {
        let Way { id, tags, nodes, places, lists: [keys, values], axes: [easts, norths] } = way;
        (*id, _) = (0, [&mut *keys, &mut *values].map(Vec::clear));
        nodes.clear();
        places.clear();
        _ = [&mut *easts, &mut *norths].map(Vec::clear);
        for field in Fields(bytes) {
            match field? {
                (1, value) => *id = value.number()?.cast_signed(),
                (2, value) => value.append_to(keys, |index| index as usize)?,
                (3, value) => value.append_to(values, |index| index as usize)?,
                (8, value) => value.append_to(nodes, signed)?,
                (9, value) => value.append_to(norths, signed)?,
                (10, value) => value.append_to(easts, signed)?,
                _ => {}
            }
        }
        self.tags(keys, values, tags)?;
        summed(nodes);
        if !easts.is_empty() {
            if easts.len() != nodes.len() || norths.len() != nodes.len() {
                return Err("a way without one latitude and longitude for each node");
            }
            summed(easts);
            summed(norths);
            places.extend(easts.iter().zip(&*norths).map(|(&east, &north)| self.place(east, north)));
        }
        Ok(())
    }

    /// Tells `found` every relation.
    pub(super) fn relations<E: From<Fault>>(&self, mut found: impl FnMut(&Relation) -> Result<(), E>) -> Result<(), E> {
        for group in &self.groups {
            for field in Fields(group) {
                if let (4, value) = field? {
                    found(&self.relation(value.bytes()?)?)?;
                }
            }
        }
        Ok(())
    }

    fn relation(&self, bytes: &[u8]) -> Result<Relation, Fault> {
        let mut relation = Relation::default();
        let [mut keys, mut values, mut roles] = [const { Vec::new() }; 3];
        let (mut ids, mut kinds) = (Vec::new(), Vec::new());
        for field in Fields(bytes) {
            match field? {
                (1, value) => relation.id = value.number()?.cast_signed(),
                (2, value) => value.append_to(&mut keys, |index| index as usize)?,
                (3, value) => value.append_to(&mut values, |index| index as usize)?,
                (8, value) => value.append_to(&mut roles, |index| index as usize)?,
                (9, value) => value.append_to(&mut ids, signed)?,
                (10, value) => value.append_to(&mut kinds, |kind| kind)?,
                _ => {}
            }
        }
        self.tags(&keys, &values, &mut relation.tags)?;
        if ids.len() != roles.len() || ids.len() != kinds.len() {
            return Err("a relation without one role and kind for each member");
        }
        summed(&mut ids);
        let kind = |kind| if kind == 1 { MemberKind::Way } else { MemberKind::Other };
        let members = kinds.into_iter().map(kind).zip(ids).zip(roles);
        relation.members = members.map(|((kind, id), role)| (kind, id, role)).collect();
        relation.members.iter().try_for_each(|&(_, _, role)| self.text(role).map(drop))?;
        Ok(relation)
    }

    fn tags(&self, keys: &[usize], values: &[usize], tags: &mut Vec<(usize, usize)>) -> Result<(), Fault> {
        tags.clear();
        if keys.len() != values.len() {
            return Err("keys without one value each");
        }
        for (&key, &value) in keys.iter().zip(values) {
            self.text(key)?;
            self.text(value)?;
            tags.push((key, value));
        }
        Ok(())
    }

    /// What the block holds; tells `node` the id and place of every node.
    pub(super) fn contents<E: From<Fault>>(
        &self,
        mut node: impl FnMut(i64, Decimicro) -> Result<(), E>,
    ) -> Result<Contents, E> {
        let mut contents = Contents::default();
        self.nodes(|id, place| {
            contents.nodes = Some(widened(contents.nodes, id));
            node(id, place)
        })?;
        for group in &self.groups {
            for field in Fields(group) {
                match field? {
                    (3, value) => {
                        // The id comes first in all files, but need not.
                        let id = Fields(value.bytes()?).find(|field| matches!(field, Ok((1, _)) | Err(_)));
                        let id = id.transpose()?.map_or(Ok(0), |(_, value)| Value::number(value))?;
                        contents.ways = Some(widened(contents.ways, id.cast_signed()));
                    }
                    (4, _) => contents.relations = true,
                    _ => {}
                }
            }
        }
        Ok(contents)
    }
}

/// Makes numbers of differences.
fn summed(differences: &mut [i64]) {
    let mut sum = 0_i64;
    for difference in differences {
        sum = sum.wrapping_add(*difference);
        *difference = sum;
    }
}

fn widened(range: Option<[i64; 2]>, id: i64) -> [i64; 2] {
    let [least, most] = range.unwrap_or([id; 2]);
    [least.min(id), most.max(id)]
}
