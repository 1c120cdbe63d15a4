//! A small file for the tests, put together byte by byte from `docs/FORMAT.md` alone.

use crate::{FIXED_DECKS_BYTES, FIXED_HEADER_BYTES, FIXED_MODULE_BYTES, MAGIC};

const CRS: &[u8] = b"EPSG:32611";
const DATUM: &[u8] = b"EGM96";

/// Vertices, triangles, side lists and classes of a load module.
type Shape<'a> = (&'a [(u16, u16, i32)], &'a [[u16; 3]], [[u16; 2]; 4], &'a [u8]);

/// Vertices, triangles and classes of the decks of a load module.
type DeckShape<'a> = (&'a [(u16, u16, i32)], &'a [[u16; 3]], &'a [u8]);

/// The western end of a bridge of class 7, level at 10 m, up to the line between both load modules.
const WEST_END: DeckShape = (
    &[(54_000, 20_000, 1280), (64_000, 20_000, 1280), (54_000, 24_000, 1280), (64_000, 24_000, 1280)],
    &[[0, 1, 3], [0, 3, 2]],
    &[7, 7],
);
/// The rest of it, rising from 10 m to 20 m, and a level one of class 8 that crosses it at 40 m.
const EAST_END: DeckShape = (
    &[
        (10_000, 10_000, 5120),
        (12_000, 10_000, 5120),
        (0, 20_000, 1280),
        (60_000, 20_000, 2560),
        (0, 24_000, 1280),
        (60_000, 24_000, 2560),
        (10_000, 40_000, 5120),
        (12_000, 40_000, 5120),
    ],
    &[[0, 1, 7], [0, 7, 6], [2, 3, 5], [2, 5, 4]],
    &[8, 8, 7, 7],
);

const FLAT: Shape = (
    &[(0, 0, 640), (64_000, 0, 640), (0, 64_000, 640), (64_000, 64_000, 640)],
    &[[0, 1, 3], [0, 3, 2]],
    [[0, 1], [1, 3], [2, 3], [0, 2]],
    &[0, 1],
);
const PIT: Shape = (
    &[(0, 0, 640), (64_000, 0, 640), (30_000, 20_000, -7), (0, 64_000, 640), (64_000, 64_000, 640)],
    &[[0, 1, 2], [0, 2, 3], [1, 4, 2], [2, 4, 3]],
    [[0, 1], [1, 4], [3, 4], [0, 3]],
    &[1, 0, 0, 2],
);

/// Load modules 2,3 and 2,4 of tile 0,1.
pub(crate) fn file() -> Vec<u8> {
    file_of(&[[FLAT, PIT]], Behind::Nothing)
}

/// The same, and a second level at which both are flat.
pub(crate) fn two_levels() -> Vec<u8> {
    file_of(&[[FLAT, PIT], [FLAT, FLAT]], Behind::Nothing)
}

/// The file of one level with bridges over both load modules.
pub(crate) fn with_decks() -> Vec<u8> {
    file_of(&[[FLAT, PIT]], Behind::Decks(&[Some(WEST_END), Some(EAST_END)]))
}

/// Lines of the eastern load module: kind, form and flags behind the class; width; vertices.
type LineShape<'a> = ([u8; 4], u16, &'a [(u16, u16, i32)]);

/// A street that is left out, a road, its bridge, and a stream.
const LINES: [LineShape; 4] = [
    ([7, 0, 0, 0], 640, &[(500, 0, 3), (500, 900, 4)]),
    ([7, 0, 2, 3], 896, &[(60_000, 22_000, 2560), (64_000, 22_000, 2600)]),
    ([7, 0, 2, 5], 896, &[(0, 22_000, 1280), (60_000, 22_000, 2560)]),
    ([9, 1, 1, 3], 128, &[(0, 64_000, 90), (300, 300, 80), (300, 0, 70)]),
];

/// The same bridges in a file of version 3, with lines and a part of an unknown kind behind those of the east.
pub(crate) fn with_parts() -> Vec<u8> {
    let lines = line_part(&LINES);
    let west = [(1, parted(WEST_END))];
    let east = [(1, parted(EAST_END)), (2, lines), (77, b"what is this".to_vec())];
    file_of(&[[FLAT, PIT]], Behind::Parts(&[&west, &east]))
}

/// A file of version 3 that should be of version 2.
pub(crate) fn with_decks_as_the_only_part() -> Vec<u8> {
    let [west, east] = [[(1, parted(WEST_END))], [(1, parted(EAST_END))]];
    file_of(&[[FLAT, PIT]], Behind::Parts(&[&west, &east]))
}

/// What follows the sections of a file, from the first on.
enum Behind<'a> {
    Nothing,
    Decks(&'a [Option<DeckShape<'a>>]),
    /// Kind and bytes of each part.
    Parts(&'a [&'a [(u32, Vec<u8>)]]),
}

/// The file of two levels with a bridge over the eastern load module at the finest alone.
pub(crate) fn with_one_deck_of_two_levels() -> Vec<u8> {
    file_of(&[[FLAT, PIT], [FLAT, FLAT]], Behind::Decks(&[None, Some(EAST_END)]))
}

/// The file of these levels, with something behind sections.
fn file_of(levels: &[[Shape; 2]], behind: Behind) -> Vec<u8> {
    let header_length = (FIXED_HEADER_BYTES + CRS.len() + DATUM.len()).next_multiple_of(4) + 4;
    let level = |(level, shapes): (u32, &[Shape; 2])| [module(3, level, shapes[0]), module(4, level, shapes[1])];
    let sections: Vec<Vec<u8>> = (0..).zip(levels).flat_map(level).collect();
    let place = |i: usize| (if i.is_multiple_of(2) { 3 } else { 4 }, (i / 2) as u32);
    let deck_of = |i: usize| if let Behind::Decks(decks) = &behind { decks.get(i).copied().flatten() } else { None };
    let part = |i: usize| match &behind {
        Behind::Nothing => Vec::new(),
        Behind::Decks(_) => deck_of(i).map_or(Vec::new(), |shape| deck_part(place(i), shape)),
        Behind::Parts(parts) => parts.get(i).map_or(Vec::new(), |parts| all_parts(place(i), parts)),
    };
    let parts: Vec<Vec<u8>> = (0..sections.len()).map(part).collect();
    let (version, entry) = match &behind {
        Behind::Nothing => (1, 32),
        Behind::Decks(_) => (2, 48),
        Behind::Parts(_) => (3, 36),
    };
    let index_length = sections.len() * entry + 4;
    let file_length = header_length + index_length + sections.iter().chain(&parts).map(Vec::len).sum::<usize>();
    let mut file = header([version, levels.len() as u8], header_length, file_length);
    let mut offset = header_length + index_length;
    for (i, (section, shape)) in sections.iter().zip(levels.iter().flatten()).enumerate() {
        let counts: [u32; 3] = if shape.0.len() == 5 { [5, 4, 4] } else { [4, 2, 1] };
        put(&mut file, &(offset as u64).to_le_bytes());
        put(&mut file, &(section.len() as u32).to_le_bytes());
        counts.iter().for_each(|count| put(&mut file, &count.to_le_bytes()));
        let low: i32 = if counts[0] == 5 { -7 } else { 640 };
        put(&mut file, &low.to_le_bytes());
        put(&mut file, &640i32.to_le_bytes());
        offset += section.len() + parts[i].len();
        match version {
            2 => {
                let (vertices, triangles, _) = deck_of(i).unwrap_or((&[], &[], &[]));
                let heights = || vertices.iter().map(|&(_, _, z)| z);
                let heights = [heights().min().unwrap_or(0), heights().max().unwrap_or(0)];
                [vertices.len(), triangles.len()].iter().for_each(|&n| put(&mut file, &(n as u32).to_le_bytes()));
                heights.iter().for_each(|height| put(&mut file, &height.to_le_bytes()));
            }
            3 => put(&mut file, &(parts[i].len() as u32).to_le_bytes()),
            _ => {}
        }
    }
    put(&mut file, &[0; 4]);
    sections.iter().zip(&parts).for_each(|(section, part)| put(&mut file, &[&section[..], part].concat()));
    mend_checksums(&mut file);
    file
}

/// A table of parts, and the parts.
fn all_parts((col, level): (u32, u32), parts: &[(u32, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    [2, col, level, parts.len() as u32].iter().for_each(|word| put(&mut bytes, &word.to_le_bytes()));
    for (kind, part) in parts {
        [*kind, part.len() as u32, 0].iter().for_each(|word| put(&mut bytes, &word.to_le_bytes()));
    }
    put(&mut bytes, &[0; 4]);
    parts.iter().for_each(|(_, part)| put(&mut bytes, part));
    bytes
}

/// Decks as a part of version 3.
fn parted((vertices, triangles, classes): DeckShape) -> Vec<u8> {
    let mut bytes = Vec::new();
    [vertices.len(), triangles.len()].iter().for_each(|&count| put(&mut bytes, &(count as u32).to_le_bytes()));
    put_vertices(&mut bytes, vertices);
    triangles.iter().flatten().for_each(|v| put(&mut bytes, &v.to_le_bytes()));
    put(&mut bytes, classes);
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

fn line_part(lines: &[LineShape]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let vertices: usize = lines.iter().map(|(_, _, vertices)| vertices.len()).sum();
    [lines.len(), vertices].iter().for_each(|&count| put(&mut bytes, &(count as u32).to_le_bytes()));
    for (class_kind_form_flags, width, vertices) in lines {
        put(&mut bytes, class_kind_form_flags);
        [*width, vertices.len() as u16].iter().for_each(|word| put(&mut bytes, &word.to_le_bytes()));
    }
    lines.iter().for_each(|(_, _, vertices)| put_vertices(&mut bytes, vertices));
    bytes
}

fn put_vertices(file: &mut Vec<u8>, vertices: &[(u16, u16, i32)]) {
    for &(x, y, z) in vertices {
        put(file, &x.to_le_bytes());
        put(file, &y.to_le_bytes());
        put(file, &z.to_le_bytes());
    }
}

fn put(file: &mut Vec<u8>, bytes: &[u8]) {
    file.extend_from_slice(bytes);
}

fn header([version, levels]: [u8; 2], header_length: usize, file_length: usize) -> Vec<u8> {
    let mut file = MAGIC.to_vec();
    put(&mut file, &[version, 0, levels, 0]);
    put(&mut file, &(header_length as u32).to_le_bytes());
    put(&mut file, &(file_length as u64).to_le_bytes());
    for value in [0, 1, 4, 5, 2, 3, 3, 5, 64_000u32, 20, 400, 128] {
        put(&mut file, &value.to_le_bytes());
    }
    put(&mut file, &500_000.0f64.to_le_bytes());
    put(&mut file, &3_875_000.25f64.to_le_bytes());
    put(&mut file, &[CRS.len() as u8, 0, DATUM.len() as u8, 0]);
    put(&mut file, &[0xab; 32]);
    put(&mut file, CRS);
    put(&mut file, DATUM);
    file.resize(header_length, 0);
    file
}

fn module(col: u32, level: u32, (vertices, triangles, sides, classes): Shape) -> Vec<u8> {
    let polygons = if vertices.len() == 4 { 1 } else { 4 };
    let mut bytes = Vec::new();
    for value in [2, col, level, vertices.len() as u32, triangles.len() as u32, polygons] {
        put(&mut bytes, &value.to_le_bytes());
    }
    put(&mut bytes, &[2, 0, 2, 0, 2, 0, 2, 0]);
    put(&mut bytes, &400u32.to_le_bytes());
    put(&mut bytes, &128u32.to_le_bytes());
    put(&mut bytes, &(400u64 * 128).to_le_bytes());
    put(&mut bytes, &(400u64 * 128 * 128).to_le_bytes());
    assert_eq!(bytes.len(), FIXED_MODULE_BYTES);
    put_vertices(&mut bytes, vertices);
    triangles.iter().flatten().for_each(|v| put(&mut bytes, &v.to_le_bytes()));
    sides.iter().flatten().for_each(|v| put(&mut bytes, &v.to_le_bytes()));
    put(&mut bytes, classes);
    bytes.resize(bytes.len().next_multiple_of(4) + 4, 0);
    bytes
}

fn deck_part((col, level): (u32, u32), (vertices, triangles, classes): DeckShape) -> Vec<u8> {
    let mut bytes = Vec::new();
    for value in [2, col, level, vertices.len() as u32, triangles.len() as u32] {
        put(&mut bytes, &value.to_le_bytes());
    }
    assert_eq!(bytes.len(), FIXED_DECKS_BYTES);
    put_vertices(&mut bytes, vertices);
    triangles.iter().flatten().for_each(|v| put(&mut bytes, &v.to_le_bytes()));
    put(&mut bytes, classes);
    bytes.resize(bytes.len().next_multiple_of(4) + 4, 0);
    bytes
}

/// Makes the checksums right again where the lengths still allow it.
pub(crate) fn mend_checksums(file: &mut [u8]) {
    let header_length = u32::from_le_bytes([file[12], file[13], file[14], file[15]]) as usize;
    mend(file, 0, header_length);
    let entries = 2 * usize::from(file[10]);
    let size = match file[8] {
        2 => 48,
        3 => 36,
        _ => 32,
    };
    for entry in 0..entries {
        let at = header_length.saturating_add(entry * size);
        let Some(bytes) = file.get(at..).and_then(|rest| rest.get(..size)) else { continue };
        let word = |i: usize| u32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]) as usize;
        let (offset, length) = (word(0), word(8));
        let decks = (size == 48 && word(36) != 0).then(|| (20 + 8 * word(32) + 7 * word(36)).next_multiple_of(4) + 4);
        mend(file, offset, length);
        mend(file, offset + length, decks.unwrap_or(0));
        if size == 36 {
            mend_parts(file, offset + length);
        }
    }
    mend(file, header_length, entries * size + 4);
}

/// Those of a table at `start` and of its parts.
fn mend_parts(file: &mut [u8], start: usize) {
    let word = |file: &[u8], at: usize| {
        let bytes = file.get(at..).and_then(|rest| rest.first_chunk::<4>());
        bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes) as usize)
    };
    let count = word(file, start + 12).min(9);
    let mut part = start + 16 + 12 * count + 4;
    for entry in (0..count).map(|number| start + 16 + 12 * number) {
        let length = word(file, entry + 4);
        let sum = file.get(part..).and_then(|rest| rest.get(..length)).map(crc32fast::hash);
        if let (Some(sum), Some(checksum)) = (sum, file.get_mut(entry + 8..).and_then(|rest| rest.first_chunk_mut())) {
            *checksum = sum.to_le_bytes();
        }
        part = part.saturating_add(length);
    }
    mend(file, start, 16 + 12 * count + 4);
}

fn mend(file: &mut [u8], start: usize, length: usize) {
    let Some(section) = file.get_mut(start..).and_then(|rest| rest.get_mut(..length)) else { return };
    if let Some((bytes, checksum)) = section.split_last_chunk_mut::<4>() {
        *checksum = crc32fast::hash(bytes).to_le_bytes();
    }
}
