//! The parts of a load module beside its ground, in a file of version 3: a table that says what there is, then one part
//! behind the other. Kinds that this reader does not know are passed over.

use crate::bytes::{Cursor, check_section};
use crate::{
    Decks, FIXED_DECKS_PART_BYTES, FIXED_TABLE_BYTES, Header, IndexEntry, Line, Objects, PART_DECKS, PART_LINES,
    PART_OBJECTS, ReadError, Section, TABLE_ENTRY_BYTES, lines, objects,
};

/// What the parts of a load module hold.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    pub decks: Decks,
    pub lines: Vec<Line>,
    pub objects: Objects,
    pub unknown: Vec<u32>,
}

/// An entry of the table.
struct Entry {
    kind: u32,
    length: u32,
    checksum: u32,
    /// Where the checksum stands.
    offset: u64,
}

impl Parts {
    /// Those that follow the section `entry` names; none where there is no table.
    pub(crate) fn parse(
        bytes: &[u8],
        header: &Header,
        entry: &IndexEntry,
        level: u16,
        (row, col): (u32, u32),
    ) -> Result<Self, ReadError> {
        let mut parts = Self::default();
        if bytes.is_empty() {
            return Ok(parts);
        }
        let base = entry.offset + u64::from(entry.length);
        let table = read_table(bytes, base, level, (row, col))?;
        let mut start = table_bytes(table.len() as u32) as usize;
        for part in &table {
            let section = match part.kind {
                PART_DECKS => Section::Decks { row, col, level },
                PART_LINES => Section::Lines { row, col, level },
                PART_OBJECTS => Section::Objects { row, col, level },
                _ => Section::Parts { row, col, level },
            };
            // The table has been checked against the length of all parts.
            let body = &bytes[start..start + part.length as usize];
            let found = crc32fast::hash(body);
            if found != part.checksum {
                let (offset, expected) = (part.offset, part.checksum);
                return Err(ReadError::WrongChecksum { section, offset, found, expected });
            }
            let mut cursor = Cursor::new(body, base + start as u64, section);
            match part.kind {
                PART_DECKS => parts.decks = read_decks(&mut cursor, part.length, header.side)?,
                PART_LINES => parts.lines = lines::parse(&mut cursor, part.length, header.side)?,
                PART_OBJECTS => parts.objects = objects::parse(&mut cursor, part.length, header.side)?,
                kind => parts.unknown.push(kind),
            }
            start += part.length as usize;
        }
        Ok(parts)
    }
}

/// Bytes of a table of so many parts, checksum included.
fn table_bytes(count: u32) -> u64 {
    FIXED_TABLE_BYTES as u64 + TABLE_ENTRY_BYTES as u64 * u64::from(count) + 4
}

/// The table at the start of `bytes`, which hold it and all of its parts, and nothing else.
fn read_table(bytes: &[u8], base: u64, level: u16, (row, col): (u32, u32)) -> Result<Vec<Entry>, ReadError> {
    let section = Section::Parts { row, col, level };
    let mut cursor = Cursor::new(bytes, base, section);
    cursor.take(FIXED_TABLE_BYTES - 4)?;
    let offset = cursor.offset();
    let count = cursor.u32()?;
    let most = (bytes.len() as u64).saturating_sub(FIXED_TABLE_BYTES as u64 + 4) / TABLE_ENTRY_BYTES as u64;
    cursor.within(offset, "part count", i64::from(count), (1, most as i64))?;
    let bytes_of_table = &bytes[..table_bytes(count) as usize];
    check_section(bytes_of_table, base, section)?;
    let mut cursor = Cursor::new(bytes_of_table, base, section);
    cursor.expect_u32("row", row)?;
    cursor.expect_u32("column", col)?;
    cursor.expect_u32("level", u32::from(level))?;
    cursor.take(4)?;
    let mut table: Vec<Entry> = Vec::with_capacity(count as usize);
    let mut rest = (bytes.len() - bytes_of_table.len()) as i64;
    for _ in 0..count {
        let offset = cursor.offset();
        let (kind, length) = (cursor.u32()?, cursor.u32()?);
        let checksum_offset = cursor.offset();
        let checksum = cursor.u32()?;
        let least = table.last().map_or(1, |last| i64::from(last.kind) + 1);
        cursor.within(offset, "kind of a part", i64::from(kind), (least, i64::from(u32::MAX)))?;
        cursor.within(offset + 4, "length of a part", i64::from(length), (4, rest))?;
        cursor.expect(offset + 4, "length of a part, less whole words,", i64::from(length % 4), 0)?;
        rest -= i64::from(length);
        table.push(Entry { kind, length, checksum, offset: checksum_offset });
    }
    cursor.expect(base, "bytes behind the last part", rest, 0)?;
    Ok(table)
}

/// The decks of a part of `length` bytes.
fn read_decks(cursor: &mut Cursor, length: u32, side: u16) -> Result<Decks, ReadError> {
    let start = cursor.offset();
    let (vertex_count, triangle_count) = (cursor.u32()?, cursor.u32()?);
    cursor.within(start, "deck vertex count", i64::from(vertex_count), (3, i64::from(u16::MAX)))?;
    cursor.within(start + 4, "deck triangle count", i64::from(triangle_count), (1, 2 * i64::from(u16::MAX)))?;
    let lists = FIXED_DECKS_PART_BYTES as u32 + 8 * vertex_count + 7 * triangle_count;
    cursor.expect(start, "length of decks", i64::from(length), i64::from(lists.next_multiple_of(4)))?;
    let (decks, _) = Decks::read_lists(cursor, side, [vertex_count, triangle_count])?;
    cursor.padding()?;
    Ok(decks)
}
