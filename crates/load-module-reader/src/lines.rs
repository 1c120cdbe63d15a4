//! Middle lines of ways: a part of a load module in a file of version 3, decoded and checked.

use crate::bytes::Cursor;
use crate::{FIXED_LINES_BYTES, HOLE_CLASS, LINE_BYTES, ReadError, Vertex};

/// What kind of way a line is the middle of.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LineKind {
    /// A road, a rail or a runway.
    Travelled,
    /// A river or a stream; its vertices run downstream.
    Channel,
    /// A line that a job names.
    Breakline,
}

/// What a line is in the ground, or as a deck.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LineForm {
    /// Nothing: it is left out, or runs in a tunnel.
    Nothing,
    /// Edges along its middle.
    Line,
    /// Edges on both sides.
    Strip,
    /// A strip with slopes beside it.
    Bench,
}

/// Where a line runs.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LineStorey {
    /// On the ground.
    Ground,
    /// On a bridge.
    Bridge,
    /// In a tunnel.
    Tunnel,
}

impl LineKind {
    /// All of them, by their numbers in a file.
    pub const ALL: [Self; 3] = [Self::Travelled, Self::Channel, Self::Breakline];
}

impl LineForm {
    /// All of them, by their numbers in a file.
    pub const ALL: [Self; 4] = [Self::Nothing, Self::Line, Self::Strip, Self::Bench];
}

impl LineStorey {
    /// All of them, by their numbers in a file.
    pub const ALL: [Self; 3] = [Self::Ground, Self::Bridge, Self::Tunnel];
}

/// The middle line of a way, or of a part of it in which nothing changes, in the square of one load module.
///
/// A way that goes on in the next load module has the same vertex there, at the same place and height. Lines are in
/// order by their fields.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Line {
    /// Class of its way; never [`HOLE_CLASS`].
    pub class: u8,
    /// What kind of way.
    pub kind: LineKind,
    /// What it is in the ground.
    pub form: LineForm,
    /// Where it runs.
    pub storey: LineStorey,
    /// Whether its way is kept: what is not is left out of the ground, and no bridge either.
    pub is_kept: bool,
    /// Whether the triangles of the ground have its edges.
    pub is_in_ground: bool,
    /// Width of its way in quanta of 1/128 m; 0 for a line without any.
    pub width: u16,
    /// Two or more; neighbours differ in place.
    pub vertices: Vec<Vertex>,
}

/// The lines of a part of `length` bytes, in the square of a load module with sides of `side` quanta.
pub(crate) fn parse(cursor: &mut Cursor, length: u32, side: u16) -> Result<Vec<Line>, ReadError> {
    let start = cursor.offset();
    let (line_count, vertex_count) = (cursor.u32()?, cursor.u32()?);
    let expected = FIXED_LINES_BYTES as i64
        + LINE_BYTES as i64 * i64::from(line_count)
        + size_of::<Vertex>() as i64 * i64::from(vertex_count);
    cursor.expect(start, "length of lines", i64::from(length), expected)?;
    cursor.within(start, "line count", i64::from(line_count), (1, i64::from(u32::MAX)))?;
    // The part is as long as its counts say, so that there is room for no more than it holds.
    let mut lines = Vec::with_capacity(line_count as usize);
    for _ in 0..line_count {
        lines.push(read_line(cursor)?);
    }
    let total: i64 = lines.iter().map(|(_, count)| i64::from(*count)).sum();
    cursor.expect(start + 4, "vertex count of lines", i64::from(vertex_count), total)?;
    let mut all: Vec<Line> = Vec::with_capacity(lines.len());
    for (mut line, count) in lines {
        let offset = cursor.offset();
        line.vertices = read_vertices(cursor, count, side)?;
        let sorted = all.last().is_none_or(|last| *last < line);
        cursor.expect(offset, "order of lines", i64::from(sorted), 1)?;
        all.push(line);
    }
    Ok(all)
}

/// A line without its vertices, and how many it has.
fn read_line(cursor: &mut Cursor) -> Result<(Line, u16), ReadError> {
    let offset = cursor.offset();
    let [class, kind, form, flags] = cursor.array()?;
    let (width, count) = (cursor.u16()?, cursor.u16()?);
    cursor.within(offset, "class of a line", i64::from(class), (0, i64::from(HOLE_CLASS) - 1))?;
    cursor.within(offset + 1, "kind of a line", i64::from(kind), (0, LineKind::ALL.len() as i64 - 1))?;
    cursor.within(offset + 2, "form of a line", i64::from(form), (0, LineForm::ALL.len() as i64 - 1))?;
    cursor.within(offset + 3, "flags of a line", i64::from(flags), (0, 11))?;
    cursor.within(offset + 6, "vertex count of a line", i64::from(count), (2, i64::from(u16::MAX)))?;
    let (kind, form) = (LineKind::ALL[usize::from(kind)], LineForm::ALL[usize::from(form)]);
    let storey = LineStorey::ALL[usize::from(flags >> 2)];
    let (is_kept, is_in_ground) = (flags & 1 != 0, flags & 2 != 0);
    let is_there = is_in_ground || (is_kept && storey == LineStorey::Bridge);
    let fit = (form == LineForm::Nothing || is_there) && (!is_in_ground || (is_kept && storey == LineStorey::Ground));
    cursor.expect(offset + 3, "agreement of form and flags", i64::from(fit), 1)?;
    Ok((Line { class, kind, form, storey, is_kept, is_in_ground, width, vertices: Vec::new() }, count))
}

fn read_vertices(cursor: &mut Cursor, count: u16, side: u16) -> Result<Vec<Vertex>, ReadError> {
    let mut vertices: Vec<Vertex> = Vec::with_capacity(usize::from(count));
    for _ in 0..count {
        let offset = cursor.offset();
        let vertex = cursor.vertex(side)?;
        let has_length = vertices.last().is_none_or(|last| (last.x, last.y) != (vertex.x, vertex.y));
        cursor.expect(offset, "length of a line's piece", i64::from(has_length), 1)?;
        vertices.push(vertex);
    }
    Ok(vertices)
}
