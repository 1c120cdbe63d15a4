//! Makes small files of OpenStreetMap data, block by block, so that any of them can be wrong.

use std::collections::BTreeMap;
use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;

fn varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while 127 < number {
        bytes.push(number as u8 | 128);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

pub fn number(field: u64, number: u64) -> Vec<u8> {
    [varint(field << 3), varint(number)].concat()
}

pub fn bytes(field: u64, bytes: &[u8]) -> Vec<u8> {
    [&varint(field << 3 | 2), &varint(bytes.len() as u64), bytes].concat()
}

fn zigzag(number: i64) -> u64 {
    (number << 1 ^ number >> 63).cast_unsigned()
}

fn packed(numbers: impl IntoIterator<Item = u64>) -> Vec<u8> {
    numbers.into_iter().flat_map(varint).collect()
}

fn differences(numbers: impl IntoIterator<Item = i64>) -> Vec<u8> {
    let mut last = 0_i64;
    let step = |number: i64| zigzag(number.wrapping_sub(std::mem::replace(&mut last, number)));
    packed(numbers.into_iter().map(step).collect::<Vec<_>>())
}

/// How a block is packed.
#[derive(Clone, Copy)]
pub enum Packing {
    None,
    Zlib,
    Zstd,
}

/// A block with its head.
pub fn frame(kind: &str, message: &[u8], packing: Packing) -> Vec<u8> {
    let packed = match packing {
        Packing::None => bytes(1, message),
        Packing::Zlib => {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
            encoder.write_all(message).unwrap();
            bytes(3, &encoder.finish().unwrap())
        }
        Packing::Zstd => bytes(7, &zstd::encode_all(message, 1).unwrap()),
    };
    with_head(kind, &[number(2, message.len() as u64), packed].concat())
}

pub fn with_head(kind: &str, blob: &[u8]) -> Vec<u8> {
    let head = [bytes(1, kind.as_bytes()), number(3, blob.len() as u64)].concat();
    [&(head.len() as u32).to_be_bytes()[..], &head, blob].concat()
}

pub fn header(required: &[&str]) -> Vec<u8> {
    let message: Vec<u8> = required.iter().flat_map(|name| bytes(4, name.as_bytes())).collect();
    frame("OSMHeader", &message, Packing::Zlib)
}

pub type Tags<'a> = &'a [(&'a str, &'a str)];

/// A file with a block of nodes, one of ways and one of relations.
#[derive(Clone, Default)]
pub struct Osm {
    pub nodes: Vec<(i64, [f64; 2])>,
    /// Texts of keys and values of each node, by its number.
    node_tags: BTreeMap<i64, Vec<(u64, u64)>>,
    ways: Vec<Vec<u8>>,
    relations: Vec<Vec<u8>>,
    texts: Vec<Vec<u8>>,
}

impl Osm {
    pub fn new(nodes: &[(i64, [f64; 2])]) -> Self {
        Self { nodes: nodes.to_vec(), texts: vec![Vec::new()], ..Self::default() }
    }

    fn text(&mut self, text: &str) -> u64 {
        self.texts.push(text.as_bytes().to_vec());
        self.texts.len() as u64 - 1
    }

    fn pairs(&mut self, tags: Tags) -> Vec<(u64, u64)> {
        tags.iter().map(|(key, value)| (self.text(key), self.text(value))).collect()
    }

    fn tags(&mut self, tags: Tags) -> Vec<u8> {
        let pairs = self.pairs(tags);
        let keys = bytes(2, &packed(pairs.iter().map(|pair| pair.0)));
        [keys, bytes(3, &packed(pairs.iter().map(|pair| pair.1)))].concat()
    }

    /// Gives a node tags.
    pub fn tagged(mut self, id: i64, tags: Tags) -> Self {
        let pairs = self.pairs(tags);
        self.node_tags.insert(id, pairs);
        self
    }

    pub fn way(mut self, id: i64, tags: Tags, nodes: &[i64]) -> Self {
        let tags = self.tags(tags);
        let nodes = bytes(8, &differences(nodes.iter().copied()));
        self.ways.push(bytes(3, &[number(1, id.cast_unsigned()), tags, nodes].concat()));
        self
    }

    /// Members are ways with their roles; a kind other than 1 is no way.
    pub fn relation(mut self, id: i64, tags: Tags, members: &[(u64, i64, &str)]) -> Self {
        let tags = self.tags(tags);
        let roles: Vec<u64> = members.iter().map(|(_, _, role)| self.text(role)).collect();
        let message = [
            number(1, id.cast_unsigned()),
            tags,
            bytes(8, &packed(roles)),
            bytes(9, &differences(members.iter().map(|(_, id, _)| *id))),
            bytes(10, &packed(members.iter().map(|(kind, ..)| *kind))),
        ];
        self.relations.push(bytes(4, &message.concat()));
        self
    }

    pub fn blocks(&self, packing: Packing) -> [Vec<u8>; 3] {
        let axis = |axis: usize| differences(self.nodes.iter().map(|node| (node.1[axis] * 1.0e7).round() as i64));
        let ids = differences(self.nodes.iter().map(|node| node.0));
        let texts_of = |(id, _): &(i64, [f64; 2])| {
            let pairs = self.node_tags.get(id).into_iter().flatten();
            pairs.flat_map(|&(key, value)| [key, value]).chain([0]).collect::<Vec<u64>>()
        };
        // Files without a tag on any node have no such field.
        let tags = if self.node_tags.is_empty() { vec![] } else { self.nodes.iter().flat_map(texts_of).collect() };
        let dense = [bytes(1, &ids), bytes(8, &axis(1)), bytes(9, &axis(0)), bytes(10, &packed(tags))].concat();
        let texts: Vec<u8> = self.texts.iter().flat_map(|text| bytes(1, text)).collect();
        let block = |group: &[u8]| frame("OSMData", &[bytes(1, &texts), bytes(2, group)].concat(), packing);
        [block(&bytes(2, &dense)), block(&self.ways.concat()), block(&self.relations.concat())]
    }

    pub fn bytes(&self) -> Vec<u8> {
        [header(&["OsmSchema-V0.6", "DenseNodes"]), self.blocks(Packing::Zlib).concat()].concat()
    }
}
