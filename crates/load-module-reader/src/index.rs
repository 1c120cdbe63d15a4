//! The index: where each load module lies, and what one needs to know before reading it.

use crate::bytes::{Cursor, check_section};
use crate::{FIXED_MODULE_BYTES, Header, INDEX_ENTRY_BYTES, ReadError, Section};

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
    let count = header.module_count().saturating_mul(u64::from(header.level_count));
    let length = count.saturating_mul(INDEX_ENTRY_BYTES as u64).saturating_add(4);
    let rest = &file[header_length..];
    if (rest.len() as u64) < length {
        let found = rest.len() as u64;
        return Err(ReadError::Truncated { section: Section::Index, offset: base, found, expected: length });
    }
    // The file is at least as long, so the length fits.
    let bytes = &rest[..length as usize];
    check_section(bytes, base, Section::Index)?;
    let mut cursor = Cursor::new(bytes, base, Section::Index);
    let mut next = base + length;
    let mut entries = Vec::with_capacity(bytes.len() / INDEX_ENTRY_BYTES);
    for _ in 0..count {
        let entry = read_entry(&mut cursor, next, file_bytes)?;
        next += u64::from(entry.length);
        entries.push(entry);
    }
    if next == file_bytes {
        return Ok(entries);
    }
    Err(ReadError::WrongLength { found: file_bytes, expected: next })
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

/// Bytes of the longest section of so many vertices and triangles, all vertices on all sides.
fn longest(entry: &IndexEntry) -> i64 {
    let lists = 16 * i64::from(entry.vertex_count) + 7 * i64::from(entry.triangle_count);
    FIXED_MODULE_BYTES as i64 + lists + 3 + 4
}

/// For messages: an offset beyond any file is shown as the largest number.
fn clamp(value: u64) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}
