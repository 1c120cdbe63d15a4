//! The index: where each load module lies, and what one needs to know before reading it.

use crate::bytes::{Cursor, check_section};
use crate::{
    DECK_ENTRY_BYTES, FIXED_DECKS_BYTES, FIXED_MODULE_BYTES, FIXED_TABLE_BYTES, Header, INDEX_ENTRY_BYTES,
    PARTS_ENTRY_BYTES, ReadError, Section, TABLE_ENTRY_BYTES, VERSION, VERSION_WITH_DECKS,
};

/// Where one level of a load module lies in the file, and its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndexEntry {
    /// First byte of its section.
    pub offset: u64,
    /// Bytes of its section, checksum included.
    pub length: u32,
    /// Vertices.
    pub vertex_count: u32,
    /// Triangles.
    pub triangle_count: u32,
    /// Convex polygons; at most as many as triangles.
    pub polygon_count: u32,
    /// Height of the lowest vertex in quanta of 1/128 m.
    pub z_low: i32,
    /// Height of the highest vertex in quanta of 1/128 m.
    pub z_high: i32,
    /// The part with decks that follows the section in a file of version 2. All of the above is about the ground alone.
    pub decks: DecksEntry,
    /// Bytes of the table of parts and of all its parts that follow the section in a file of version 3; 0 where the
    /// load module has none.
    pub parts_length: u32,
}

/// What the index says of the decks of one level of a load module; all zero where there are none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DecksEntry {
    /// Vertices.
    pub vertex_count: u32,
    /// Triangles.
    pub triangle_count: u32,
    /// Height of the lowest vertex in quanta of 1/128 m.
    pub z_low: i32,
    /// Height of the highest vertex in quanta of 1/128 m.
    pub z_high: i32,
}

impl DecksEntry {
    /// Bytes of the part, checksum included; 0 where there are no decks, and no part.
    pub fn length(&self) -> u32 {
        if self.triangle_count == 0 {
            return 0;
        }
        // At most 65,535 vertices and 131,070 triangles.
        (FIXED_DECKS_BYTES as u32 + 8 * self.vertex_count + 7 * self.triangle_count).next_multiple_of(4) + 4
    }
}

impl IndexEntry {
    /// One past the last byte of the section and of all parts that follow it.
    pub fn end(&self) -> u64 {
        self.offset + u64::from(self.length) + u64::from(self.decks.length()) + u64::from(self.parts_length)
    }
}

/// Bytes of one entry of the index in files of a version.
pub(crate) fn entry_bytes(version: u16) -> usize {
    INDEX_ENTRY_BYTES
        + match version {
            VERSION => PARTS_ENTRY_BYTES,
            VERSION_WITH_DECKS => DECK_ENTRY_BYTES,
            _ => 0,
        }
}

/// Bytes of the index that follows a header of `header_length` bytes, where a file of `file_bytes` bytes has room.
pub(crate) fn check_room(header: &Header, header_length: usize, file_bytes: u64) -> Result<u64, ReadError> {
    let (offset, count) = (header_length as u64, header.module_count().saturating_mul(u64::from(header.level_count)));
    let expected = count.saturating_mul(entry_bytes(header.version) as u64).saturating_add(4);
    let found = file_bytes.saturating_sub(offset);
    if found < expected {
        return Err(ReadError::Truncated { section: Section::Index, offset, found, expected });
    }
    Ok(expected)
}

/// The index that follows a header of `header_length` bytes: level by level, row by row from the south-west. `file` is
/// the beginning of a file of `file_bytes` bytes, and holds at least the index.
pub(crate) fn parse(
    file: &[u8],
    header: &Header,
    header_length: usize,
    file_bytes: u64,
) -> Result<Vec<IndexEntry>, ReadError> {
    let base = header_length as u64;
    let length = check_room(header, header_length, file.len() as u64)?;
    let (entry_bytes, rest) = (entry_bytes(header.version), &file[header_length..]);
    let count = (length - 4) / entry_bytes as u64;
    // The file is at least as long, so the length fits.
    let bytes = &rest[..length as usize];
    check_section(bytes, base, Section::Index)?;
    let mut cursor = Cursor::new(bytes, base, Section::Index);
    let mut next = base + length;
    let mut entries = Vec::with_capacity(bytes.len() / entry_bytes);
    for _ in 0..count {
        let mut entry = read_entry(&mut cursor, next, file_bytes)?;
        let rest = file_bytes - next - u64::from(entry.length);
        match header.version {
            VERSION => entry.parts_length = read_parts_length(&mut cursor, rest)?,
            VERSION_WITH_DECKS => entry.decks = read_decks(&mut cursor, rest)?,
            _ => {}
        }
        next = entry.end();
        entries.push(entry);
    }
    if next != file_bytes {
        return Err(ReadError::WrongLength { found: file_bytes, expected: next });
    }
    // The same load modules have one file only.
    let some = |has: fn(&IndexEntry) -> bool| i64::from(entries.iter().any(has));
    match header.version {
        VERSION => cursor.expect(base, "parts of some load module", some(|entry| 0 < entry.parts_length), 1)?,
        VERSION_WITH_DECKS => {
            cursor.expect(base, "decks in some load module", some(|entry| 0 < entry.decks.triangle_count), 1)?;
        }
        _ => {}
    }
    Ok(entries)
}

/// What an entry says of parts, which must fit into the `rest` of the file behind the section of the ground.
fn read_parts_length(cursor: &mut Cursor, rest: u64) -> Result<u32, ReadError> {
    /// A table of one part with one word.
    const LEAST: usize = FIXED_TABLE_BYTES + TABLE_ENTRY_BYTES + 4 + 4;
    let offset = cursor.offset();
    let length = cursor.u32()?;
    if length != 0 {
        cursor.within(offset, "length of parts", i64::from(length), (LEAST as i64, clamp(rest)))?;
        cursor.expect(offset, "length of parts, less whole words,", i64::from(length % 4), 0)?;
    }
    Ok(length)
}

/// One entry, whose section must begin at `next`: sections lie back to back.
fn read_entry(cursor: &mut Cursor, next: u64, file_length: u64) -> Result<IndexEntry, ReadError> {
    let at = cursor.offset();
    let entry = IndexEntry {
        offset: cursor.u64()?,
        length: cursor.u32()?,
        vertex_count: cursor.u32()?,
        triangle_count: cursor.u32()?,
        polygon_count: cursor.u32()?,
        z_low: cursor.i32()?,
        z_high: cursor.i32()?,
        decks: DecksEntry::default(),
        parts_length: 0,
    };
    cursor.expect(at, "offset", clamp(entry.offset), clamp(next))?;
    let rest = clamp(file_length - next.min(file_length));
    cursor.within(at + 12, "vertex count", i64::from(entry.vertex_count), (4, i64::from(u16::MAX)))?;
    cursor.within(at + 16, "triangle count", i64::from(entry.triangle_count), (2, 2 * i64::from(u16::MAX)))?;
    // A section that cannot be so long is refused before its bytes are read.
    cursor.within(
        at + 8,
        "length",
        i64::from(entry.length),
        (FIXED_MODULE_BYTES as i64 + 4, rest.min(longest(&entry))),
    )?;
    let triangles = i64::from(entry.triangle_count);
    cursor.within(at + 20, "polygon count", i64::from(entry.polygon_count), (1, triangles))?;
    cursor.within(at + 24, "lowest height", i64::from(entry.z_low), (i64::from(i32::MIN), i64::from(entry.z_high)))?;
    Ok(entry)
}

/// What an entry says of decks, whose part must fit into the `rest` of the file behind the section of the ground.
fn read_decks(cursor: &mut Cursor, rest: u64) -> Result<DecksEntry, ReadError> {
    let at = cursor.offset();
    let decks = DecksEntry {
        vertex_count: cursor.u32()?,
        triangle_count: cursor.u32()?,
        z_low: cursor.i32()?,
        z_high: cursor.i32()?,
    };
    let vertices = i64::from(decks.vertex_count);
    if vertices == 0 {
        cursor.expect(at + 4, "deck triangle count", i64::from(decks.triangle_count), 0)?;
        cursor.expect(at + 8, "lowest height of decks", i64::from(decks.z_low), 0)?;
        cursor.expect(at + 12, "highest height of decks", i64::from(decks.z_high), 0)?;
        return Ok(decks);
    }
    cursor.within(at, "deck vertex count", vertices, (3, i64::from(u16::MAX)))?;
    let triangles = (1, 2 * i64::from(u16::MAX));
    cursor.within(at + 4, "deck triangle count", i64::from(decks.triangle_count), triangles)?;
    let heights = (i64::from(i32::MIN), i64::from(decks.z_high));
    cursor.within(at + 8, "lowest height of decks", i64::from(decks.z_low), heights)?;
    // Decks that cannot be so long are refused before their bytes are read.
    cursor.within(at, "length of decks", i64::from(decks.length()), (0, clamp(rest)))?;
    Ok(decks)
}

/// Bytes of the longest section of so many vertices and triangles, all vertices on all sides.
fn longest(entry: &IndexEntry) -> i64 {
    let lists = 16 * i64::from(entry.vertex_count) + 7 * i64::from(entry.triangle_count);
    FIXED_MODULE_BYTES as i64 + lists + 3 + 4
}

/// For messages: an offset beyond any file is shown as the largest number.
fn clamp(value: u64) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}
