//! Decks of bridges: triangles that hang above the ground of a load module and are no part of it.

use crate::{HOLE_CLASS, ModuleVertex};

/// The decks in the square of one load module, as one mesh; most load modules have none, and then all lists are empty.
///
/// Unlike the ground, decks cover what they cover: places may lie under no deck, or under several that cross above each
/// other. A deck that crosses the line between two load modules is cut there, and both have the same vertices on it.
/// Vertices are sorted by (y, x, z), triangles by their corners, smallest first; so equal decks give equal bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Decks {
    /// Vertices in canonical order, each a corner of some triangle.
    pub vertices: Vec<ModuleVertex>,
    /// Corners of each triangle in `vertices`, counter-clockwise seen from above, smallest index first.
    pub triangles: Vec<[u16; 3]>,
    /// Class of each triangle; never [`HOLE_CLASS`].
    pub classes: Vec<u8>,
}

/// What is wrong with decks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeckFault {
    /// Lists that belong together differ in length, or are longer than 16 bits number.
    Inconsistent,
    /// This vertex lies beyond a side.
    VertexOutside(usize),
    /// This vertex is the corner of no triangle.
    VertexUnused(usize),
    /// Vertices or triangles are not in canonical order, or one is listed twice.
    NotCanonical,
    /// This triangle names a vertex that does not exist.
    NoSuchVertex(usize),
    /// This triangle is clockwise or upright.
    NotCounterClockwise(usize),
    /// This triangle has the class of holes.
    HoleClass(usize),
}

impl std::fmt::Display for DeckFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Inconsistent => f.write_str("lists that belong together differ in length, or are too long"),
            Self::VertexOutside(vertex) => write!(f, "vertex {vertex} lies beyond a side"),
            Self::VertexUnused(vertex) => write!(f, "vertex {vertex} is the corner of no triangle"),
            Self::NotCanonical => f.write_str("vertices or triangles are out of order, or listed twice"),
            Self::NoSuchVertex(triangle) => write!(f, "triangle {triangle} names a vertex that is not there"),
            Self::NotCounterClockwise(triangle) => write!(f, "triangle {triangle} is clockwise or upright"),
            Self::HoleClass(triangle) => write!(f, "triangle {triangle} has the class of holes"),
        }
    }
}

impl Decks {
    /// Decks in canonical order from triangles in any, each with its corners and its class. Equal corners are joined,
    /// and of triangles with the same corners the one of the lowest class stays.
    ///
    /// # Panics
    /// When there are more vertices than 16 bits number.
    pub fn of_triangles(triangles: impl IntoIterator<Item = ([ModuleVertex; 3], u8)>) -> Self {
        let soup: Vec<([ModuleVertex; 3], u8)> = triangles.into_iter().collect();
        let mut vertices: Vec<ModuleVertex> = soup.iter().flat_map(|(corners, _)| *corners).collect();
        vertices.sort_unstable();
        vertices.dedup();
        assert!(vertices.len() <= usize::from(u16::MAX), "the decks of a load module number vertices in 16 bits");
        let index = |corner: &ModuleVertex| vertices.partition_point(|vertex| vertex < corner) as u16;
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
        self.triangles.is_empty() && self.vertices.is_empty()
    }

    /// Doubled area of a triangle seen from above, in squared quanta; positive when counter-clockwise.
    pub fn doubled_area(&self, triangle: [u16; 3]) -> i64 {
        doubled_area(&self.vertices, triangle)
    }

    /// Walks every invariant of decks in a square of `side` quanta: lengths, order, places, orientation, classes. They
    /// need not cover the square, and may lie above each other.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check(&self, side: u16) -> Result<(), DeckFault> {
        let most = usize::from(u16::MAX);
        let is_numbered = self.vertices.len() <= most && self.triangles.len() <= 2 * most;
        if self.classes.len() != self.triangles.len() || !is_numbered {
            return Err(DeckFault::Inconsistent);
        }
        if let Some(vertex) = self.vertices.iter().position(|v| side < v.x || side < v.y) {
            return Err(DeckFault::VertexOutside(vertex));
        }
        let is_ascending = self.vertices.is_sorted_by(|a, b| a < b) && self.triangles.is_sorted_by(|a, b| a < b);
        if !is_ascending || !self.triangles.iter().all(|t| t[0] < t[1] && t[0] < t[2]) {
            return Err(DeckFault::NotCanonical);
        }
        let mut is_used = vec![false; self.vertices.len()];
        for (index, &triangle) in self.triangles.iter().enumerate() {
            if triangle.iter().any(|&v| self.vertices.len() <= usize::from(v)) {
                return Err(DeckFault::NoSuchVertex(index));
            }
            if self.doubled_area(triangle) <= 0 {
                return Err(DeckFault::NotCounterClockwise(index));
            }
            triangle.iter().for_each(|&v| is_used[usize::from(v)] = true);
        }
        if let Some(vertex) = is_used.iter().position(|is_used| !is_used) {
            return Err(DeckFault::VertexUnused(vertex));
        }
        let hole = self.classes.iter().position(|&class| class == HOLE_CLASS);
        hole.map_or(Ok(()), |triangle| Err(DeckFault::HoleClass(triangle)))
    }
}

/// Doubled area of a triangle seen from above, in squared quanta; positive when counter-clockwise.
pub(crate) fn doubled_area(vertices: &[ModuleVertex], triangle: [u16; 3]) -> i64 {
    let [a, b, c] = triangle.map(|v| vertices[usize::from(v)]);
    let (bx, by) = (i64::from(b.x) - i64::from(a.x), i64::from(b.y) - i64::from(a.y));
    let (cx, cy) = (i64::from(c.x) - i64::from(a.x), i64::from(c.y) - i64::from(a.y));
    bx * cy - by * cx
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: u16 = 64_000;

    fn vertex(x: u16, y: u16, z: i32) -> ModuleVertex {
        ModuleVertex { y, x, z }
    }

    /// Two bridges that cross, 5 m above each other, over the same four places.
    fn crossing() -> Decks {
        let square = |z| [vertex(0, 0, z), vertex(100, 0, z), vertex(100, 100, z), vertex(0, 100, z)];
        let halves = |[a, b, c, d]: [ModuleVertex; 4], class| [([c, a, b], class), ([d, a, c], class)];
        Decks::of_triangles(halves(square(640), 3).into_iter().chain(halves(square(0), 2)))
    }

    #[test]
    fn decks_from_triangles_in_any_order_are_sound_and_equal() {
        let decks = crossing();
        assert_eq!(decks.check(SIDE), Ok(()));
        assert_eq!((decks.vertices.len(), decks.classes.clone()), (8, vec![2, 2, 3, 3]));
        let corners = |triangle: &[u16; 3]| triangle.map(|v| decks.vertices[usize::from(v)]);
        let soup = decks.triangles.iter().map(corners).zip(decks.classes.iter().copied());
        let turned = soup.map(|([a, b, c], class)| ([b, c, a], class)).rev();
        let twice: Vec<_> = turned.clone().chain(turned).collect();
        assert_eq!(Decks::of_triangles(twice), decks);
        assert!(Decks::of_triangles([]).is_empty() && Decks::default().check(SIDE) == Ok(()));
    }

    #[track_caller]
    fn check_fault(damage: impl FnOnce(&mut Decks), expected: DeckFault) {
        let mut decks = crossing();
        damage(&mut decks);
        assert_eq!(decks.check(SIDE), Err(expected));
    }

    #[test]
    fn faults_of_decks_are_told_apart() {
        check_fault(|decks| decks.classes.truncate(3), DeckFault::Inconsistent);
        check_fault(|decks| decks.vertices[7].y = SIDE + 1, DeckFault::VertexOutside(7));
        check_fault(|decks| decks.vertices.push(vertex(0, 101, 0)), DeckFault::VertexUnused(8));
        check_fault(|decks| decks.vertices[0].z = decks.vertices[1].z, DeckFault::NotCanonical);
        check_fault(|decks| decks.triangles.swap(0, 1), DeckFault::NotCanonical);
        check_fault(|decks| decks.triangles[0].rotate_left(1), DeckFault::NotCanonical);
        check_fault(|decks| decks.triangles[3][2] = 8, DeckFault::NoSuchVertex(3));
        check_fault(|decks| decks.triangles[0].swap(1, 2), DeckFault::NotCounterClockwise(0));
        check_fault(|decks| decks.classes[2] = HOLE_CLASS, DeckFault::HoleClass(2));
    }

    #[test]
    fn an_upright_triangle_is_no_deck() {
        let wall = [vertex(0, 0, 0), vertex(9, 0, 0), vertex(9, 0, 5)];
        assert_eq!(Decks::of_triangles([(wall, 0)]).check(SIDE), Err(DeckFault::NotCounterClockwise(0)));
    }
}
