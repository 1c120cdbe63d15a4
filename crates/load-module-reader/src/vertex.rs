//! What the ground and the decks of a load module have in common.

use std::cmp::Ordering;

/// A vertex, in quanta of 1/128 m from the load module's south-west corner. It lies in memory as C would have it.
/// Vertices are in order by y, then x, then z.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Vertex {
    /// East of the western side.
    pub x: u16,
    /// North of the southern side.
    pub y: u16,
    /// Above the vertical datum.
    pub z: i32,
}

impl Ord for Vertex {
    fn cmp(&self, other: &Self) -> Ordering {
        (self.y, self.x, self.z).cmp(&(other.y, other.x, other.z))
    }
}

impl PartialOrd for Vertex {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Doubled area of a triangle in squared quanta; positive when counter-clockwise. Zero for an index out of range.
pub(crate) fn doubled_area(vertices: &[Vertex], triangle: [u16; 3]) -> i64 {
    let corner = |v: u16| vertices.get(usize::from(v)).map(|v| (i64::from(v.x), i64::from(v.y)));
    match triangle.map(corner) {
        [Some(a), Some(b), Some(c)] => (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0),
        _ => 0,
    }
}
