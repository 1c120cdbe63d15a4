//! A load module: what the simulator loads at once.

use crate::decks::{check_decks, doubled_area};
use crate::{Decks, ModuleId, ModuleLine, ModuleResidual, ModuleVertex, Objects, module_line};

/// One finished load module.
///
/// Vertices are sorted by (y, x, z), triangles by their first corner, which is their smallest; so equal
/// ground gives equal bytes. Triangles are counter-clockwise seen from above. The default is empty, and not sound.
#[derive(Clone, Debug, Default, PartialEq)]
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

    /// Walks every invariant: indices, canonical order, orientation, area, cracks inside, T-junctions, decks, lines. It
    /// shares no code with `load-module-reader`, which holds the same of what it reads.
    ///
    /// # Errors
    /// The first fault found, in words.
    pub fn check(&self) -> Result<(), String> {
        if self.classes.len() != self.triangles.len() {
            return Err("lists that belong together differ in length".into());
        }
        if let Some(vertex) = self.vertices.iter().position(|v| self.side < v.x || self.side < v.y) {
            return Err(format!("vertex {vertex} lies beyond a side"));
        }
        let distinct = self.vertices.windows(2).all(|pair| (pair[0].y, pair[0].x) < (pair[1].y, pair[1].x));
        let smallest_first = self.triangles.iter().all(|t| t[0] < t[1] && t[0] < t[2]);
        if !distinct || !smallest_first || !self.triangles.is_sorted() {
            return Err("vertices or triangles are out of order, or listed twice".into());
        }
        self.check_area()?;
        self.check_edges()?;
        check_decks(&self.decks, self.side).map_err(|fault| format!("decks: {fault}"))?;
        module_line::check(&self.lines, self.side).map_err(|fault| format!("lines: {fault}"))
    }

    fn check_area(&self) -> Result<(), String> {
        let mut area = 0;
        for (index, &triangle) in self.triangles.iter().enumerate() {
            if triangle.iter().any(|&v| self.vertices.len() <= usize::from(v)) {
                return Err(format!("triangle {index} names a vertex that is not there"));
            }
            let doubled = self.doubled_area(triangle);
            if doubled <= 0 {
                return Err(format!("triangle {index} is clockwise or has no area"));
            }
            area += doubled;
        }
        let expected = 2 * i64::from(self.side) * i64::from(self.side);
        if area != expected {
            return Err(format!("triangles cover {area} half squares of a quantum, expected {expected}"));
        }
        Ok(())
    }

    fn check_edges(&self) -> Result<(), String> {
        let corners = |triangle: &[u16; 3]| [0, 1, 2].map(|corner| (triangle[corner], triangle[(corner + 1) % 3]));
        let mut edges: Vec<(u16, u16)> = self.triangles.iter().flat_map(corners).collect();
        edges.sort_unstable();
        let is_open =
            |&(from, to): &(u16, u16)| edges.binary_search(&(to, from)).is_err() && !self.on_one_side(from, to);
        let twice = edges.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0]);
        let open = || edges.iter().copied().find(is_open);
        let Some((from, to)) = twice.or_else(open) else { return Ok(()) };
        let [from, to] = [from, to].map(|v| self.vertices[usize::from(v)]).map(|v| format!("{},{}", v.x, v.y));
        Err(format!("the edge {from} to {to} (quanta east, north) is not shared by two triangles"))
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
            ..LoadModule::default()
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
        let told = "vertices or triangles are out of order, or listed twice";
        assert_eq!(module.check(), Err(told.into()));
        let mut module = square();
        module.triangles.pop();
        assert_eq!(module.check(), Err("lists that belong together differ in length".into()));
        module.classes.pop();
        let told = "triangles cover 4096000000 half squares of a quantum, expected 8192000000";
        assert_eq!(module.check(), Err(told.into()));
        let mut module = square();
        module.vertices[3].x += 1;
        assert_eq!(module.check(), Err("vertex 3 lies beyond a side".into()));
        let mut module = square();
        module.triangles[1][2] = 4;
        assert_eq!(module.check(), Err("triangle 1 names a vertex that is not there".into()));
        let mut module = square();
        module.triangles[1].swap(1, 2);
        assert_eq!(module.check(), Err("triangle 1 is clockwise or has no area".into()));
        // Two triangles over one half of the square, none over the other.
        let mut module = square();
        module.triangles[1] = [0, 1, 3];
        let told = "the edge 0,0 to 64000,0 (quanta east, north) is not shared by two triangles";
        assert_eq!(module.check(), Err(told.into()));
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
        assert_eq!(module.check(), Err("decks: triangle 0 is clockwise or upright".into()));
    }
}
