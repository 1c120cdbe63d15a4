//! Decks of bridges: one more part of a load module in files of versions 2 and 3, put in order, decoded and checked.

use crate::bytes::{Cursor, check_section};
use crate::vertex::doubled_area;
use crate::{HOLE_CLASS, Header, IndexEntry, ReadError, Section, Vertex};

/// The decks above the ground of a load module, as one mesh; without decks all lists are empty.
///
/// They cover what they cover: a place may lie under no deck, or under several. A deck that crosses the line between
/// two load modules is cut there, and both have the same vertices on it. Equal decks have equal lists.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Decks {
    /// Sorted by y, then x, then z; each a corner of some triangle.
    pub vertices: Vec<Vertex>,
    /// Corners in `vertices`, counter-clockwise seen from above, smallest index first; sorted.
    pub triangles: Vec<[u16; 3]>,
    /// Class of each triangle; never [`HOLE_CLASS`].
    pub classes: Vec<u8>,
}

impl Decks {
    /// Decks in canonical order from triangles in any, each with its corners and its class. Equal corners are joined,
    /// and of triangles with the same corners the one of the lowest class stays.
    ///
    /// # Panics
    /// When there are more vertices than 16 bits number.
    pub fn of_triangles(triangles: impl IntoIterator<Item = ([Vertex; 3], u8)>) -> Self {
        let soup: Vec<([Vertex; 3], u8)> = triangles.into_iter().collect();
        let mut vertices: Vec<Vertex> = soup.iter().flat_map(|(corners, _)| *corners).collect();
        vertices.sort_unstable();
        vertices.dedup();
        assert!(vertices.len() <= usize::from(u16::MAX), "the decks of a load module number vertices in 16 bits");
        let index = |corner: &Vertex| vertices.partition_point(|vertex| vertex < corner) as u16;
        let mut listed: Vec<([u16; 3], u8)> = Vec::with_capacity(soup.len());
        for (corners, class) in &soup {
            let mut triangle = [0, 1, 2].map(|corner| index(&corners[corner]));
            let smallest = (0..3).min_by_key(|&corner| triangle[corner]).unwrap_or(0);
            triangle.rotate_left(smallest);
            listed.push((triangle, *class));
        }
        listed.sort_unstable();
        listed.dedup_by_key(|(triangle, _)| *triangle);
        let (triangles, classes) = listed.into_iter().unzip();
        Self { vertices, triangles, classes }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Doubled area of a triangle in squared quanta; positive when counter-clockwise. Zero for an index out of range.
    pub fn doubled_area(&self, triangle: [u16; 3]) -> i64 {
        doubled_area(&self.vertices, triangle)
    }

    /// The part of a file of version 2 that follows the section `entry` names.
    pub(crate) fn parse(
        bytes: &[u8],
        header: &Header,
        entry: &IndexEntry,
        level: u16,
        (row, col): (u32, u32),
    ) -> Result<Self, ReadError> {
        if entry.decks.triangle_count == 0 {
            return Ok(Self::default());
        }
        let section = Section::Decks { row, col, level };
        let base = entry.offset + u64::from(entry.length);
        check_section(bytes, base, section)?;
        let mut cursor = Cursor::new(bytes, base, section);
        cursor.expect_u32("row", row)?;
        cursor.expect_u32("column", col)?;
        cursor.expect_u32("level", u32::from(level))?;
        cursor.expect_u32("deck vertex count", entry.decks.vertex_count)?;
        cursor.expect_u32("deck triangle count", entry.decks.triangle_count)?;
        let first = cursor.offset();
        let counts = [entry.decks.vertex_count, entry.decks.triangle_count];
        let (decks, [low, high]) = Self::read_lists(&mut cursor, header.side, counts)?;
        cursor.expect(first, "lowest height of decks", i64::from(low), i64::from(entry.decks.z_low))?;
        cursor.expect(first, "highest height of decks", i64::from(high), i64::from(entry.decks.z_high))?;
        cursor.padding()?;
        cursor.checksum()?;
        Ok(decks)
    }

    /// So many vertices and triangles, and their classes, in a square with sides of `side` quanta; with the lowest and
    /// the highest of the vertices.
    pub(crate) fn read_lists(
        cursor: &mut Cursor,
        side: u16,
        [vertex_count, triangle_count]: [u32; 2],
    ) -> Result<(Self, [i32; 2]), ReadError> {
        let vertices = read_vertices(cursor, side, vertex_count)?;
        let triangles = read_triangles(cursor, &vertices, side, triangle_count)?;
        let mut classes = Vec::with_capacity(triangles.len());
        for _ in 0..triangles.len() {
            let offset = cursor.offset();
            let [class] = cursor.array()?;
            cursor.within(offset, "class of a deck", i64::from(class), (0, i64::from(HOLE_CLASS) - 1))?;
            classes.push(class);
        }
        let heights = vertices.iter().map(|vertex| vertex.z);
        let heights = heights.fold([i32::MAX, i32::MIN], |[low, high], z| [low.min(z), high.max(z)]);
        Ok((Self { vertices, triangles, classes }, heights))
    }
}

fn read_vertices(cursor: &mut Cursor, side: u16, count: u32) -> Result<Vec<Vertex>, ReadError> {
    let mut vertices: Vec<Vertex> = Vec::with_capacity(count as usize);
    for _ in 0..count {
        let offset = cursor.offset();
        let vertex = cursor.vertex(side)?;
        let sorted = vertices.last().is_none_or(|last| (last.y, last.x, last.z) < (vertex.y, vertex.x, vertex.z));
        cursor.expect(offset, "order of vertices", i64::from(sorted), 1)?;
        vertices.push(vertex);
    }
    Ok(vertices)
}

/// Triangles in order, counter-clockwise, that together use every vertex.
fn read_triangles(cursor: &mut Cursor, vertices: &[Vertex], side: u16, count: u32) -> Result<Vec<[u16; 3]>, ReadError> {
    let last = vertices.len() as i64 - 1;
    let square = i64::from(side) * i64::from(side);
    let mut is_used = vec![false; vertices.len()];
    let mut triangles: Vec<[u16; 3]> = Vec::with_capacity(count as usize);
    for _ in 0..count {
        let offset = cursor.offset();
        let triangle = [cursor.u16()?, cursor.u16()?, cursor.u16()?];
        for (place, vertex) in triangle.into_iter().enumerate() {
            cursor.within(offset + 2 * place as u64, "vertex of a triangle", i64::from(vertex), (0, last))?;
            is_used[usize::from(vertex)] = true;
        }
        let smallest_first = triangle[0] < triangle[1] && triangle[0] < triangle[2];
        let sorted = triangles.last().is_none_or(|last| *last < triangle);
        cursor.expect(offset, "order of triangles", i64::from(smallest_first && sorted), 1)?;
        cursor.within(offset, "doubled area of a triangle", doubled_area(vertices, triangle), (1, square))?;
        triangles.push(triangle);
    }
    let unused = is_used.iter().filter(|&&is_used| !is_used).count() as i64;
    cursor.expect(cursor.offset(), "vertices of no triangle", unused, 0)?;
    Ok(triangles)
}
