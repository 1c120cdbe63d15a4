//! Writes GeoTIFFs of every layout and packing that pictures have.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::CORNER;
use super::jpeg;

/// Numbers of a pixel that is not of the picture, but of a tile that reaches beyond it.
const PADDING: u16 = 77;
/// Metres along a side of a pixel.
pub const PIXEL_M: f64 = 2.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Packing {
    None,
    Lzw,
    Deflate,
    PackBits,
    Zstd,
    /// With or without tables of its own; otherwise they stand in the directory.
    Jpeg {
        has_tables: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// Columns and rows of a tile.
    Tiles(u32, u32),
    /// Rows of a strip.
    Strips(u32),
}

/// One directory of a file.
#[derive(Clone, Debug)]
pub struct Picture {
    pub size: [u32; 2],
    pub layout: Layout,
    pub packing: Packing,
    pub is_predicted: bool,
    pub is_planar: bool,
    pub bits: u32,
    pub bands: u32,
    pub photometric: u16,
    /// What bands beyond those of the colour are.
    pub extra: Vec<u16>,
    pub palette: Vec<u16>,
    /// Pixels of a JPEG that share a hue, each way.
    pub subsampling: u32,
    /// 1 for an overview, 4 for a mask.
    pub kind: u32,
    /// Numbers of all pixels, row by row.
    pub numbers: Vec<u16>,
}

/// What a file is beside its pictures.
#[derive(Clone, Copy, Debug, Default)]
pub struct Form {
    pub is_big_endian: bool,
    /// Whether it is a BigTIFF.
    pub is_big: bool,
    pub nodata: Option<&'static str>,
}

impl Picture {
    /// A picture of 8-bit red, green and blue in strips, not packed.
    pub fn rgb(size: [u32; 2], color: impl Fn(u32, u32) -> [u8; 3]) -> Self {
        Self::of(size, 3, 2, |col, row| color(col, row).map(u16::from).to_vec())
    }

    /// A picture of so many 8-bit bands, in strips, not packed.
    pub fn of(size: [u32; 2], bands: u32, photometric: u16, pixel: impl Fn(u32, u32) -> Vec<u16>) -> Self {
        let numbers: Vec<u16> = (0..size[0] * size[1]).flat_map(|at| pixel(at % size[0], at / size[0])).collect();
        assert_eq!(numbers.len(), (size[0] * size[1] * bands) as usize, "a number for each band of each pixel");
        Self {
            size,
            layout: Layout::Strips(7),
            packing: Packing::None,
            is_predicted: false,
            is_planar: false,
            bits: 8,
            bands,
            photometric,
            extra: Vec::new(),
            palette: Vec::new(),
            subsampling: 1,
            kind: 0,
            numbers,
        }
    }

    fn number(&self, col: u32, row: u32, band: u32) -> u16 {
        let is_inside = col < self.size[0] && row < self.size[1];
        if is_inside { self.numbers[((row * self.size[0] + col) * self.bands + band) as usize] } else { PADDING }
    }

    /// Strips or tiles as they stand in the file.
    fn chunks(&self, is_big_endian: bool) -> Vec<Vec<u8>> {
        let ([cols, rows], all) = (self.size, (0..self.bands).collect::<Vec<_>>());
        let (wide, high) = match self.layout {
            Layout::Tiles(wide, high) => (wide, high),
            Layout::Strips(high) => (cols, high),
        };
        let planes: Vec<&[u32]> = if self.is_planar { all.chunks(1).collect() } else { vec![&all[..]] };
        let mut chunks = Vec::new();
        for bands in planes {
            for north in (0..rows).step_by(high as usize) {
                for west in (0..cols).step_by(wide as usize) {
                    let is_tile = matches!(self.layout, Layout::Tiles(..));
                    let high = if is_tile { high } else { high.min(rows - north) };
                    chunks.push(self.chunk([west, north], [wide, high], bands, is_big_endian));
                }
            }
        }
        chunks
    }

    fn chunk(&self, [west, north]: [u32; 2], size: [u32; 2], bands: &[u32], is_big_endian: bool) -> Vec<u8> {
        if let Packing::Jpeg { has_tables } = self.packing {
            let pixel = |col: u32, row: u32| {
                // What lies beyond the picture is like its last row and column, as writers of JPEGs have it.
                let (col, row) = ((west + col).min(self.size[0] - 1), (north + row).min(self.size[1] - 1));
                let numbers: Vec<u8> = bands.iter().map(|&band| self.number(col, row, band) as u8).collect();
                if self.photometric == 6 { jpeg::brightness_and_hues([0, 1, 2].map(|at| numbers[at])) } else { numbers }
            };
            return jpeg::encoded(size, bands.len(), self.subsampling, has_tables, pixel);
        }
        let mut bytes = Vec::new();
        for row in north..north + size[1] {
            let cols = west..west + size[0];
            let line = cols.flat_map(|col| bands.iter().map(move |&band| self.number(col, row, band)));
            let mut line: Vec<u16> = line.collect();
            if self.is_predicted {
                for at in (bands.len()..line.len()).rev() {
                    line[at] = line[at].wrapping_sub(line[at - bands.len()]);
                }
            }
            put(&line, self.bits, is_big_endian, &mut bytes);
        }
        packed(self.packing, &bytes)
    }
}

fn put(line: &[u16], bits: u32, is_big_endian: bool, bytes: &mut Vec<u8>) {
    match bits {
        16 if is_big_endian => bytes.extend(line.iter().flat_map(|number| number.to_be_bytes())),
        16 => bytes.extend(line.iter().flat_map(|number| number.to_le_bytes())),
        bits => {
            let most = (1u16 << bits) - 1;
            bytes.extend(line.chunks(8 / bits as usize).map(|part| {
                let shifted = part.iter().zip(1..).map(|(number, at)| (number & most) << (8 - bits * at));
                shifted.sum::<u16>() as u8
            }));
        }
    }
}

fn packed(packing: Packing, bytes: &[u8]) -> Vec<u8> {
    match packing {
        Packing::None => bytes.to_vec(),
        Packing::Lzw => weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8).encode(bytes).unwrap(),
        Packing::Deflate => {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        }
        Packing::Zstd => zstd::encode_all(bytes, 1).unwrap(),
        // Equal bytes as runs, others as they are; -128 means nothing.
        Packing::PackBits => bytes
            .chunks(100)
            .flat_map(|part| match part.iter().all(|byte| *byte == part[0]) {
                true => vec![0x80, (1 - part.len() as i32) as u8, part[0]],
                false => [&[part.len() as u8 - 1], part].concat(),
            })
            .collect(),
        Packing::Jpeg { .. } => unreachable!("written pixel by pixel"),
    }
}

/// A value of a tag: its type, and its numbers.
enum Value {
    Bytes(Vec<u8>),
    Text(String),
    Shorts(Vec<u16>),
    Longs(Vec<u32>),
    Doubles(Vec<f64>),
}

impl Value {
    fn kind_and_count(&self) -> (u16, usize) {
        match self {
            Self::Bytes(list) => (7, list.len()),
            Self::Text(text) => (2, text.len() + 1),
            Self::Shorts(list) => (3, list.len()),
            Self::Longs(list) => (4, list.len()),
            Self::Doubles(list) => (12, list.len()),
        }
    }

    fn bytes(&self, file: &File) -> Vec<u8> {
        match self {
            Self::Bytes(list) => list.clone(),
            Self::Text(text) => [text.as_bytes(), b"\0"].concat(),
            Self::Shorts(list) => list.iter().flat_map(|&number| file.number(number.into(), 2)).collect(),
            Self::Longs(list) => list.iter().flat_map(|&number| file.number(number.into(), 4)).collect(),
            Self::Doubles(list) => list.iter().flat_map(|number| file.number(number.to_bits(), 8)).collect(),
        }
    }
}

struct File {
    form: Form,
    bytes: Vec<u8>,
}

impl File {
    /// A number of so many bytes.
    fn number(&self, number: u64, bytes: usize) -> Vec<u8> {
        if self.form.is_big_endian {
            number.to_be_bytes()[8 - bytes..].to_vec()
        } else {
            number.to_le_bytes()[..bytes].to_vec()
        }
    }

    fn append(&mut self, number: u64, bytes: usize) {
        let number = self.number(number, bytes);
        self.bytes.extend(number);
    }

    /// Bytes of an offset, of a number of entries, and before the first directory.
    fn sizes(&self) -> [usize; 2] {
        if self.form.is_big { [8, 8] } else { [4, 2] }
    }

    /// Appends a directory; `link` is where its place is told. Returns where the place of the next is to be told.
    fn directory(&mut self, tags: &BTreeMap<u16, Value>, link: usize) -> usize {
        let [offset, count] = self.sizes();
        let beyond: Vec<(u16, usize, Vec<u8>)> = tags
            .values()
            .map(|value| {
                let ((kind, count), mut bytes) = (value.kind_and_count(), value.bytes(self));
                if offset < bytes.len() {
                    self.bytes.resize(self.bytes.len().next_multiple_of(2), 0);
                    let place = self.bytes.len() as u64;
                    self.bytes.extend(bytes);
                    bytes = self.number(place, offset);
                }
                bytes.resize(offset, 0);
                (kind, count, bytes)
            })
            .collect();
        self.bytes.resize(self.bytes.len().next_multiple_of(2), 0);
        let place = self.number(self.bytes.len() as u64, offset);
        self.bytes[link..link + offset].copy_from_slice(&place);
        self.append(tags.len() as u64, count);
        for (tag, (kind, count, bytes)) in tags.keys().zip(beyond) {
            self.append((*tag).into(), 2);
            self.append(kind.into(), 2);
            self.append(count as u64, offset);
            self.bytes.extend(bytes);
        }
        let next = self.bytes.len();
        self.append(0, offset);
        next
    }

    fn picture(&mut self, picture: &Picture, link: usize) -> usize {
        let mut places = [Vec::new(), Vec::new()];
        for chunk in picture.chunks(self.form.is_big_endian) {
            self.bytes.resize(self.bytes.len().next_multiple_of(2), 0);
            places[0].push(self.bytes.len() as u32);
            places[1].push(chunk.len() as u32);
            self.bytes.extend(chunk);
        }
        let tags = tags(picture, places, link == self.first_link(), self.form.nodata);
        self.directory(&tags, link)
    }

    fn first_link(&self) -> usize {
        if self.form.is_big { 8 } else { 4 }
    }
}

fn tags(picture: &Picture, places: [Vec<u32>; 2], is_first: bool, nodata: Option<&str>) -> BTreeMap<u16, Value> {
    use Value::{Bytes, Doubles, Longs, Shorts, Text};
    let compression = match picture.packing {
        Packing::None => 1,
        Packing::Lzw => 5,
        Packing::Jpeg { .. } => 7,
        Packing::Deflate => 8,
        Packing::PackBits => 32773,
        Packing::Zstd => 50000,
    };
    let mut tags = BTreeMap::from([
        (254, Longs(vec![picture.kind])),
        (256, Longs(vec![picture.size[0]])),
        (257, Longs(vec![picture.size[1]])),
        (258, Shorts(vec![picture.bits as u16; picture.bands as usize])),
        (259, Shorts(vec![compression])),
        (262, Shorts(vec![picture.photometric])),
        (277, Shorts(vec![picture.bands as u16])),
        (284, Shorts(vec![if picture.is_planar { 2 } else { 1 }])),
    ]);
    let [offsets, sizes] = places.map(Longs);
    match picture.layout {
        Layout::Tiles(wide, high) => {
            tags.extend([(322, Longs(vec![wide])), (323, Longs(vec![high])), (324, offsets), (325, sizes)]);
        }
        Layout::Strips(high) => tags.extend([(278, Longs(vec![high])), (273, offsets), (279, sizes)]),
    }
    if picture.is_predicted {
        tags.insert(317, Shorts(vec![2]));
    }
    if !picture.extra.is_empty() {
        tags.insert(338, Shorts(picture.extra.clone()));
    }
    if !picture.palette.is_empty() {
        tags.insert(320, Shorts(picture.palette.clone()));
    }
    if picture.packing == (Packing::Jpeg { has_tables: false }) {
        tags.insert(347, Bytes(jpeg::tables()));
    }
    if picture.photometric == 6 {
        tags.insert(530, Shorts(vec![picture.subsampling as u16; 2]));
    }
    if is_first {
        let keys = vec![1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32611];
        let [east, north] = CORNER;
        tags.extend([
            (33550, Doubles(vec![PIXEL_M, PIXEL_M, 0.0])),
            (33922, Doubles(vec![0.0, 0.0, 0.0, east, north, 0.0])),
            (34735, Shorts(keys)),
        ]);
        tags.extend(nodata.map(|nodata| (42113, Text(nodata.to_owned()))));
    }
    tags
}

/// Writes a file of pictures, the first of them with its place.
pub fn write(path: &Path, form: Form, pictures: &[Picture]) {
    let mut file = File { form, bytes: if form.is_big_endian { b"MM".to_vec() } else { b"II".to_vec() } };
    if form.is_big {
        [43, 8, 0].into_iter().for_each(|number| file.append(number, 2));
        file.append(0, 8);
    } else {
        file.append(42, 2);
        file.append(0, 4);
    }
    let mut link = file.first_link();
    for picture in pictures {
        link = file.picture(picture, link);
    }
    std::fs::write(path, file.bytes).unwrap();
}
