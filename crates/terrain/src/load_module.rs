//! A load module: what the simulator loads at once.

use crate::decks::doubled_area;
use crate::{DeckFault, Decks, LineFault, ModuleId, ModuleLine, ModuleResidual, ModuleVertex, Objects, module_line};

/// One finished load module.
///
/// Vertices are sorted by (y, x, z), triangles by their first corner, which is their smallest; so equal
/// ground gives equal bytes. Triangles are counter-clockwise seen from above.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadModule {
    /// Which load module.
    pub id: ModuleId,
    /// Length of a side in quanta of 1/128 m; at most 65,535.
    pub side: u16,
    /// Vertices in canonical order.
    pub vertices: Vec<ModuleVertex>,
    /// Corners of each triangle, counter-clockwise, smallest index first.
    pub triangles: Vec<[u16; 3]>,
    /// Class of the ground under each triangle.
    pub classes: Vec<u8>,
    /// Convex polygons: equal to the triangles unless clipped edges left larger pieces.
    pub polygon_count: u32,
    /// Residual of the DEM's posts that this load module owns.
    pub residual: ModuleResidual,
    /// Decks of bridges above the ground. Of the fields above all but `id` and `side` are about the ground alone.
    pub decks: Decks,
    /// Middle lines of ways, in order; they count against no limit.
    pub lines: Vec<ModuleLine>,
    /// What stands on the ground; it counts against limits of its own.
    pub objects: Objects,
}

/// What of a load module counts against limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ModuleCounts {
    /// Triangles of the ground and of decks.
    pub triangles: u32,
    /// Convex polygons of the ground, and triangles of decks.
    pub polygons: u32,
}

/// What is wrong with a load module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LoadModuleFault {
    /// This triangle names a vertex that does not exist.
    NoSuchVertex(usize),
    /// This vertex lies beyond a side.
    VertexOutside(usize),
    /// This triangle is clockwise or has no area.
    NotCounterClockwise(usize),
    /// Vertices or triangles are not in canonical order, or a vertex is listed twice.
    NotCanonical,
    /// Lists that belong together differ in length.
    Inconsistent,
    /// The doubled areas of the triangles add up to the first number, that of the square is the second.
    AreaMissing(i64, i64),
    /// This edge inside the square has a triangle on one side only, or is used twice in one direction.
    Crack([ModuleVertex; 2]),
    /// Decks are not as they must be.
    InDecks(DeckFault),
    /// Lines are not as they must be.
    InLines(LineFault),
}

impl std::fmt::Display for LoadModuleFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoSuchVertex(triangle) => write!(f, "triangle {triangle} names a vertex that is not there"),
            Self::VertexOutside(vertex) => write!(f, "vertex {vertex} lies beyond a side"),
            Self::NotCounterClockwise(triangle) => write!(f, "triangle {triangle} is clockwise or has no area"),
            Self::NotCanonical => f.write_str("vertices or triangles are out of order, or listed twice"),
            Self::Inconsistent => f.write_str("lists that belong together differ in length"),
            Self::AreaMissing(found, expected) => {
                write!(f, "triangles cover {found} half squares of a quantum, expected {expected}")
            }
            Self::Crack([a, b]) => {
                let (from, to) = (format!("{},{}", a.x, a.y), format!("{},{}", b.x, b.y));
                write!(f, "the edge {from} to {to} (quanta east, north) is not shared by two triangles")
            }
            Self::InDecks(fault) => write!(f, "decks: {fault}"),
            Self::InLines(fault) => write!(f, "lines: {fault}"),
        }
    }
}

impl LoadModule {
    /// Doubled area of a triangle in squared quanta; positive when counter-clockwise.
    pub fn doubled_area(&self, triangle: [u16; 3]) -> i64 {
        doubled_area(&self.vertices, triangle)
    }

    /// What counts against limits: a simulator draws decks as it draws the ground, so each of their triangles counts as
    /// one triangle and as one polygon.
    pub fn counts(&self) -> ModuleCounts {
        let of_decks = self.decks.triangles.len() as u32;
        ModuleCounts { triangles: self.triangles.len() as u32 + of_decks, polygons: self.polygon_count + of_decks }
    }

    /// Indices of the vertices on one side, west to east or south to north.
    pub fn side_vertices(&self, side: crate::Side) -> Vec<u16> {
        use crate::Side;
        let on_side = |v: &ModuleVertex| match side {
            Side::South => v.y == 0,
            Side::North => v.y == self.side,
            Side::West => v.x == 0,
            Side::East => v.x == self.side,
        };
        // Canonical order is south to north, then west to east: both lists come out in order.
        (0..self.vertices.len()).filter(|&i| on_side(&self.vertices[i])).map(|i| i as u16).collect()
    }

    /// Vertices on any of the four sides, corners counted once.
    pub fn border_vertex_count(&self) -> usize {
        let on_border = |v: &&ModuleVertex| v.x == 0 || v.y == 0 || v.x == self.side || v.y == self.side;
        self.vertices.iter().filter(on_border).count()
    }

    /// Walks every invariant: indices, canonical order, orientation, area, cracks inside, T-junctions, decks, lines.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check(&self) -> Result<(), LoadModuleFault> {
        if self.classes.len() != self.triangles.len() {
            return Err(LoadModuleFault::Inconsistent);
        }
        if let Some(vertex) = self.vertices.iter().position(|v| self.side < v.x || self.side < v.y) {
            return Err(LoadModuleFault::VertexOutside(vertex));
        }
        let distinct = self.vertices.windows(2).all(|pair| (pair[0].y, pair[0].x) < (pair[1].y, pair[1].x));
        let smallest_first = self.triangles.iter().all(|t| t[0] < t[1] && t[0] < t[2]);
        if !distinct || !smallest_first || !self.triangles.is_sorted() {
            return Err(LoadModuleFault::NotCanonical);
        }
        self.check_area()?;
        self.check_edges()?;
        self.decks.check(self.side).map_err(LoadModuleFault::InDecks)?;
        module_line::check(&self.lines, self.side).map_err(LoadModuleFault::InLines)
    }

    fn check_area(&self) -> Result<(), LoadModuleFault> {
        let mut area = 0;
        for (index, &triangle) in self.triangles.iter().enumerate() {
            if triangle.iter().any(|&v| self.vertices.len() <= usize::from(v)) {
                return Err(LoadModuleFault::NoSuchVertex(index));
            }
            let doubled = self.doubled_area(triangle);
            if doubled <= 0 {
                return Err(LoadModuleFault::NotCounterClockwise(index));
            }
            area += doubled;
        }
        let expected = 2 * i64::from(self.side) * i64::from(self.side);
        if area != expected {
            return Err(LoadModuleFault::AreaMissing(area, expected));
        }
        Ok(())
    }

    fn check_edges(&self) -> Result<(), LoadModuleFault> {
        let corners = |triangle: &[u16; 3]| [0, 1, 2].map(|corner| (triangle[corner], triangle[(corner + 1) % 3]));
        let mut edges: Vec<(u16, u16)> = self.triangles.iter().flat_map(corners).collect();
        edges.sort_unstable();
        let is_open =
            |&(from, to): &(u16, u16)| edges.binary_search(&(to, from)).is_err() && !self.on_one_side(from, to);
        let twice = edges.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0]);
        let open = || edges.iter().copied().find(is_open);
        twice.or_else(open).map_or(Ok(()), |(from, to)| Err(self.crack(from, to)))
    }

    fn crack(&self, from: u16, to: u16) -> LoadModuleFault {
        LoadModuleFault::Crack([self.vertices[usize::from(from)], self.vertices[usize::from(to)]])
    }

    fn on_one_side(&self, from: u16, to: u16) -> bool {
        let (a, b) = (self.vertices[usize::from(from)], self.vertices[usize::from(to)]);
        let same_row = a.y == b.y && (a.y == 0 || a.y == self.side);
        let same_col = a.x == b.x && (a.x == 0 || a.x == self.side);
        same_row || same_col
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Side;

    fn square() -> LoadModule {
        let vertex = |y, x| ModuleVertex { y, x, z: 0 };
        LoadModule {
            id: ModuleId { row: 0, col: 0 },
            side: 64_000,
            vertices: vec![vertex(0, 0), vertex(0, 64_000), vertex(64_000, 0), vertex(64_000, 64_000)],
            triangles: vec![[0, 1, 3], [0, 3, 2]],
            classes: vec![0, 0],
            polygon_count: 2,
            residual: ModuleResidual::default(),
            decks: Decks::default(),
            lines: Vec::new(),
            objects: Objects::default(),
        }
    }

    #[test]
    fn a_square_of_two_triangles_is_sound() {
        assert_eq!(square().check(), Ok(()));
        assert_eq!(square().side_vertices(Side::North), [2, 3]);
        assert_eq!(square().side_vertices(Side::East), [1, 3]);
        assert_eq!(square().border_vertex_count(), 4);
    }

    #[test]
    fn faults_are_told_apart() {
        let mut module = square();
        module.triangles.swap(0, 1);
        assert_eq!(module.check(), Err(LoadModuleFault::NotCanonical));
        let mut module = square();
        module.triangles.pop();
        assert_eq!(module.check(), Err(LoadModuleFault::Inconsistent));
        module.classes.pop();
        assert!(matches!(module.check(), Err(LoadModuleFault::AreaMissing(..))));
    }

    #[test]
    fn triangles_of_decks_count_against_limits_and_are_checked() {
        let mut module = square();
        assert_eq!(module.counts(), ModuleCounts { triangles: 2, polygons: 2 });
        let corners = [(0, 0), (0, 9), (9, 9)].map(|(y, x)| ModuleVertex { y, x, z: 640 });
        module.decks = Decks::of_triangles([(corners, 1)]);
        module.polygon_count = 1;
        assert_eq!((module.counts(), module.check()), (ModuleCounts { triangles: 3, polygons: 2 }, Ok(())));
        module.decks.triangles[0] = [0, 2, 1];
        assert_eq!(module.check(), Err(LoadModuleFault::InDecks(DeckFault::NotCounterClockwise(0))));
    }
}
