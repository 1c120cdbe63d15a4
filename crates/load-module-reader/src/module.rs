//! One load module: its section decoded, and every promise of the format checked.
//!
//! Triangles that turn left and are together as large as the square cover it exactly once if every edge inside it has
//! as many triangles on its left as on its right. Such triangles bound nothing inside the square, so every place there
//! lies under the same number of them, and the area says that it is one. Without this a hole here and an overlap there,
//! equally large, would be taken for ground.

use crate::bytes::{Cursor, check_section};
use crate::parts::Parts;
use crate::vertex::doubled_area;
use crate::{
    Decks, FIXED_MODULE_BYTES, Header, IndexEntry, Line, Objects, QUANTA_PER_METRE, ReadError, Section, VERSION, Vertex,
};

/// Residuals over the posts that a load module owns, in quanta of 1/128 m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Residual {
    /// Posts counted: owned and not void.
    pub posts: u32,
    /// Largest absolute residual.
    pub largest: u32,
    /// Sum of absolute residuals.
    pub sum_abs: u64,
    /// Sum of squared residuals.
    pub sum_squared: u64,
}

impl Residual {
    /// Root mean square in metres; `None` when no post was counted.
    pub fn rms_m(&self) -> Option<f64> {
        let mean = self.sum_squared as f64 / f64::from(self.posts);
        (0 < self.posts).then(|| mean.sqrt() / f64::from(QUANTA_PER_METRE))
    }
}

/// One load module at one level. Its triangles cover its square exactly once; indices name `vertices`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Module {
    /// Row in the area; 0 is the southernmost.
    pub row: u32,
    /// Column in the area; 0 is the westernmost.
    pub col: u32,
    /// Level of detail; 0 is the finest.
    pub level: u16,
    /// Sorted by y, then x; no two at one place.
    pub vertices: Vec<Vertex>,
    /// Corners, counter-clockwise seen from above, smallest index first; sorted.
    pub triangles: Vec<[u16; 3]>,
    /// Class of the ground under each triangle.
    pub classes: Vec<u8>,
    /// Vertices on the southern and northern side from west to east, on the eastern and western side from south
    /// to north, in the order south, east, north, west. A corner is in two of them.
    pub sides: [Vec<u16>; 4],
    /// Convex polygons that the triangles were cut from.
    pub polygon_count: u32,
    /// How far the DEM's posts lie from the triangles.
    pub residual: Residual,
    /// Decks of bridges above the ground. All lists above are about the ground alone.
    pub decks: Decks,
    /// Middle lines of ways, in the ground or left out; sorted. The finest level alone has them.
    pub lines: Vec<Line>,
    /// What stands on the ground.
    pub objects: Objects,
    /// Kinds of parts that this reader does not know; it has passed over them.
    pub unknown_parts: Vec<u32>,
}

impl Module {
    /// Doubled area of a triangle in squared quanta; positive when counter-clockwise. Zero for an index out of range.
    pub fn doubled_area(&self, triangle: [u16; 3]) -> i64 {
        doubled_area(&self.vertices, triangle)
    }

    /// The section that `entry` names, of the load module at (`row`, `col`), and the parts that follow it.
    pub(crate) fn parse(
        bytes: &[u8],
        header: &Header,
        entry: &IndexEntry,
        level: u16,
        (row, col): (u32, u32),
    ) -> Result<Self, ReadError> {
        let section = Section::Module { row, col, level };
        // The index has been checked against the length of the file.
        let (bytes, behind) = bytes.split_at(entry.length as usize);
        check_section(bytes, entry.offset, section)?;
        let mut cursor = Cursor::new(bytes, entry.offset, section);
        let fixed = read_fixed(&mut cursor, entry, level, (row, col))?;
        check_length(&cursor, entry, &fixed.side_counts)?;
        let vertices = read_vertices(&mut cursor, header.side, entry)?;
        let triangles = read_triangles(&mut cursor, entry)?;
        let mut sides: [Vec<u16>; 4] = Default::default();
        for (which, side) in sides.iter_mut().enumerate() {
            *side = read_side(&mut cursor, &vertices, header.side, which, fixed.side_counts[which])?;
        }
        let classes = cursor.take(triangles.len())?.to_vec();
        cursor.padding()?;
        cursor.checksum()?;
        let mut module = Self {
            row,
            col,
            level,
            vertices,
            triangles,
            classes,
            sides,
            polygon_count: entry.polygon_count,
            residual: fixed.residual,
            decks: Decks::default(),
            lines: Vec::new(),
            objects: Objects::default(),
            unknown_parts: Vec::new(),
        };
        module.check_cover(header.side, entry, section)?;
        if header.version == VERSION {
            let parts = Parts::parse(behind, header, entry, level, (row, col))?;
            (module.decks, module.lines) = (parts.decks, parts.lines);
            (module.objects, module.unknown_parts) = (parts.objects, parts.unknown);
        } else {
            module.decks = Decks::parse(behind, header, entry, level, (row, col))?;
        }
        Ok(module)
    }

    /// Every triangle counter-clockwise, all of them together as large as the square, and none torn from another.
    fn check_cover(&self, side: u16, entry: &IndexEntry, section: Section) -> Result<(), ReadError> {
        let offset = triangles_offset(entry);
        let square = 2 * i64::from(side) * i64::from(side);
        let mut area = 0;
        for (index, &triangle) in self.triangles.iter().enumerate() {
            let doubled = self.doubled_area(triangle);
            if doubled <= 0 {
                let (offset, field) = (offset + 6 * index as u64, "doubled area of a triangle");
                return Err(ReadError::OutOfRange { section, offset, field, found: doubled, low: 1, high: square });
            }
            area += doubled;
        }
        let wrong = |field, found, expected| Err(ReadError::WrongValue { section, offset, field, found, expected });
        if area != square {
            return wrong("doubled area of all triangles", area, square);
        }
        match torn_edge_count(&self.vertices, &self.triangles, side) {
            0 => Ok(()),
            torn => wrong("torn edges", torn as i64, 0),
        }
    }
}

/// What stands before the vertices and is not in the index.
struct Fixed {
    side_counts: [u16; 4],
    residual: Residual,
}

fn read_fixed(cursor: &mut Cursor, entry: &IndexEntry, level: u16, (row, col): (u32, u32)) -> Result<Fixed, ReadError> {
    cursor.expect_u32("row", row)?;
    cursor.expect_u32("column", col)?;
    cursor.expect_u32("level", u32::from(level))?;
    cursor.expect_u32("vertex count", entry.vertex_count)?;
    cursor.expect_u32("triangle count", entry.triangle_count)?;
    cursor.expect_u32("polygon count", entry.polygon_count)?;
    let mut side_counts = [0; 4];
    for count in &mut side_counts {
        let offset = cursor.offset();
        *count = cursor.u16()?;
        cursor.within(offset, "side vertex count", i64::from(*count), (2, i64::from(entry.vertex_count)))?;
    }
    let residual =
        Residual { posts: cursor.u32()?, largest: cursor.u32()?, sum_abs: cursor.u64()?, sum_squared: cursor.u64()? };
    Ok(Fixed { side_counts, residual })
}

/// The section is exactly as long as its counts say; checked before any list is made room for.
fn check_length(cursor: &Cursor, entry: &IndexEntry, side_counts: &[u16; 4]) -> Result<(), ReadError> {
    let (vertices, triangles) = (u64::from(entry.vertex_count), u64::from(entry.triangle_count));
    let on_sides: u64 = side_counts.iter().map(|&count| u64::from(count)).sum();
    let lists = FIXED_MODULE_BYTES as u64 + 8 * vertices + 7 * triangles + 2 * on_sides;
    let expected = lists.next_multiple_of(4) + 4;
    cursor.expect(entry.offset, "length in the index", i64::from(entry.length), expected as i64)
}

fn triangles_offset(entry: &IndexEntry) -> u64 {
    entry.offset + FIXED_MODULE_BYTES as u64 + 8 * u64::from(entry.vertex_count)
}

fn read_vertices(cursor: &mut Cursor, side: u16, entry: &IndexEntry) -> Result<Vec<Vertex>, ReadError> {
    let mut vertices: Vec<Vertex> = Vec::with_capacity(entry.vertex_count as usize);
    let (mut low, mut high) = (i32::MAX, i32::MIN);
    for _ in 0..entry.vertex_count {
        let offset = cursor.offset();
        let vertex = cursor.vertex(side)?;
        let sorted = vertices.last().is_none_or(|last| (last.y, last.x) < (vertex.y, vertex.x));
        cursor.expect(offset, "order of vertices", i64::from(sorted), 1)?;
        (low, high) = (low.min(vertex.z), high.max(vertex.z));
        vertices.push(vertex);
    }
    let offset = entry.offset + FIXED_MODULE_BYTES as u64;
    cursor.expect(offset, "lowest height", i64::from(low), i64::from(entry.z_low))?;
    cursor.expect(offset, "highest height", i64::from(high), i64::from(entry.z_high))?;
    Ok(vertices)
}

fn read_triangles(cursor: &mut Cursor, entry: &IndexEntry) -> Result<Vec<[u16; 3]>, ReadError> {
    let last = i64::from(entry.vertex_count) - 1;
    let mut triangles: Vec<[u16; 3]> = Vec::with_capacity(entry.triangle_count as usize);
    for _ in 0..entry.triangle_count {
        let offset = cursor.offset();
        let triangle = [cursor.u16()?, cursor.u16()?, cursor.u16()?];
        for (place, vertex) in triangle.into_iter().enumerate() {
            cursor.within(offset + 2 * place as u64, "vertex of a triangle", i64::from(vertex), (0, last))?;
        }
        let smallest_first = triangle[0] < triangle[1] && triangle[0] < triangle[2];
        let sorted = triangles.last().is_none_or(|last| *last < triangle);
        cursor.expect(offset, "order of triangles", i64::from(smallest_first && sorted), 1)?;
        triangles.push(triangle);
    }
    Ok(triangles)
}

/// One side list, which must name every vertex on that side, in the order of the vertices.
fn read_side(
    cursor: &mut Cursor,
    vertices: &[Vertex],
    side: u16,
    which: usize,
    count: u16,
) -> Result<Vec<u16>, ReadError> {
    let on_side = |v: &Vertex| [v.y == 0, v.x == side, v.y == side, v.x == 0][which];
    let mut expected = (0u16..).zip(vertices).filter(|(_, vertex)| on_side(vertex)).map(|(index, _)| index);
    let mut list = Vec::with_capacity(usize::from(count));
    for _ in 0..count {
        let offset = cursor.offset();
        let found = cursor.u16()?;
        let wanted = expected.next().map_or(-1, i64::from);
        cursor.expect(offset, "vertex on a side", i64::from(found), wanted)?;
        list.push(found);
    }
    let missing = expected.count() as i64;
    cursor.expect(cursor.offset(), "vertices missing from a side", missing, 0)?;
    Ok(list)
}

/// An edge, from its vertex that comes first: the other one, doubled, and 1 where the triangle lies on its right.
type Edge = u32;

/// How many edges inside the square have more triangles on one side than on the other. All indices name vertices. It
/// takes time in proportion to the triangles where few of them meet at a vertex.
pub(crate) fn torn_edge_count(vertices: &[Vertex], triangles: &[[u16; 3]], side: u16) -> usize {
    let (mut edges, ends) = by_first_vertex(vertices.len(), triangles);
    let (mut start, mut count) = (0, 0);
    for (vertex, end) in ends.into_iter().enumerate() {
        let edges = &mut edges[start..end];
        start = end;
        edges.sort_unstable();
        for same in edges.chunk_by(|a, b| a >> 1 == b >> 1) {
            let on_right = same.iter().filter(|&edge| edge & 1 == 1).count();
            let other = &vertices[(same[0] >> 1) as usize];
            count += usize::from(2 * on_right != same.len() && !lie_on_a_side(&vertices[vertex], other, side));
        }
    }
    count
}

/// The edges of all triangles, by the vertex of each that comes first, and where those of each vertex end.
fn by_first_vertex(vertex_count: usize, triangles: &[[u16; 3]]) -> (Vec<Edge>, Vec<usize>) {
    let directed = || triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let mut ends = vec![0; vertex_count + 1];
    for (from, to) in directed() {
        ends[usize::from(from.min(to)) + 1] += 1;
    }
    for vertex in 1..=vertex_count {
        ends[vertex] += ends[vertex - 1];
    }
    let mut edges = vec![0; 3 * triangles.len()];
    for (from, to) in directed() {
        let next = &mut ends[usize::from(from.min(to))];
        edges[*next] = u32::from(from.max(to)) << 1 | u32::from(to < from);
        *next += 1;
    }
    // Each has become where the edges of its vertex end.
    ends.pop();
    (edges, ends)
}

fn lie_on_a_side(a: &Vertex, b: &Vertex, side: u16) -> bool {
    a.x == b.x && (a.x == 0 || a.x == side) || a.y == b.y && (a.y == 0 || a.y == side)
}
