//! The polygons of one load module, welded into shared vertices and fanned into triangles.
//!
//! Corners that fall on the same quantum become one vertex. Rounding moves only crossings, only along the
//! side they lie on, and never past each other, so the corners of a side are decided by that side alone, and
//! alike in both load modules that share it: a vertex of the TIN wins over a crossing, a lower crossing
//! over a higher one. A polygon that welding leaves with two corners is a spike without area; its neighbours
//! then share the edge that is left. Where welding turns a polygon over (it takes posts closer than
//! 0.4 m and a needle of a triangle), the load module's own vertices are triangulated afresh: the sides stay,
//! the square stays covered once, and only the coplanarity of that load module's pieces is given up.

use terrain::limits::{polygons_of, triangles_of};
use terrain::{Importance, LoadModule, ModuleId, ModuleVertex, Post};

use crate::load_modules::{Faces, Layout, classes};

/// A corner of a piece: its place, then what it is, then its height, in an order that decides who wins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Corner(u64);

/// Added to heights so that they sort as unsigned numbers of 31 bits.
const HEIGHT_BIAS: i64 = 1 << 30;

impl Corner {
    /// A corner at (y, x) quanta from the load module's south-west corner.
    ///
    /// # Panics
    /// When it lies outside 16 bits, or its height beyond 30.
    #[inline]
    pub(crate) fn new(y: i64, x: i64, z: i32, is_crossing: bool) -> Self {
        let inside = |v: i64| u16::try_from(v).expect("a piece lies inside its load module");
        let height = i64::from(z) + HEIGHT_BIAS;
        assert!((0..2 * HEIGHT_BIAS).contains(&height), "heights have 24 bits, so {z} is not one");
        let place = u64::from(inside(y)) << 48 | u64::from(inside(x)) << 32;
        Self(place | u64::from(is_crossing) << 31 | height as u64)
    }

    fn place(self) -> u32 {
        (self.0 >> 32) as u32
    }

    fn vertex(self) -> ModuleVertex {
        let z = (self.0 & 0x7fff_ffff) as i64 - HEIGHT_BIAS;
        ModuleVertex { y: (self.0 >> 48) as u16, x: (self.0 >> 32) as u16, z: z as i32 }
    }
}

/// Convex polygons that cover one load module, counter-clockwise.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pieces {
    corners: Vec<Corner>,
    ends: Vec<u32>,
}

impl Pieces {
    /// Adds one polygon.
    #[inline]
    pub(crate) fn push(&mut self, polygon: impl IntoIterator<Item = Corner>) {
        self.corners.extend(polygon);
        self.ends.push(self.corners.len() as u32);
    }

    fn polygons(&self) -> impl Iterator<Item = &[Corner]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.corners[start as usize..end as usize])
    }

    /// The load module these polygons make; `faces` give classes before `mask` does.
    ///
    /// # Panics
    /// When they do not cover its square exactly once.
    pub(crate) fn load_module(
        &self,
        id: ModuleId,
        layout: &Layout,
        mask: &Importance,
        faces: Option<&Faces>,
    ) -> LoadModule {
        let mut corners = self.corners.clone();
        corners.sort_unstable();
        corners.dedup_by_key(|corner| corner.place());
        assert!(corners.len() <= usize::from(u16::MAX), "a load module numbers its vertices in 16 bits");
        let mut module = LoadModule {
            id,
            side: layout.side(),
            vertices: corners.iter().map(|corner| corner.vertex()).collect(),
            triangles: Vec::with_capacity(self.ends.len()),
            ..LoadModule::default()
        };
        let sides = self.fan(&corners, &mut module).unwrap_or_else(|| triangulate_afresh(&mut module));
        module.triangles.sort_unstable();
        module.classes = classes::of_triangles(&module, layout, mask, faces);
        assert_sound(&module, sides);
        module
    }

    /// Cuts every polygon into triangles and gives the number of polygon sides, or `None` where a polygon has
    /// turned over.
    fn fan(&self, corners: &[Corner], module: &mut LoadModule) -> Option<usize> {
        let mut sides = 0;
        let mut polygon = Vec::with_capacity(8);
        for piece in self.polygons() {
            polygon.clear();
            polygon.extend(piece.iter().map(|corner| {
                let index = corners.binary_search_by_key(&corner.place(), |other| other.place());
                index.expect("every corner is among the load module's vertices") as u16
            }));
            polygon.dedup();
            if 1 < polygon.len() && polygon.first() == polygon.last() {
                polygon.pop();
            }
            if polygon.len() < 3 {
                continue;
            }
            turn_to_fan(&mut polygon, module)?;
            sides += polygon.len();
            module.polygon_count += 1;
            module.triangles.extend(polygon[1..].windows(2).map(|pair| smallest_first([polygon[0], pair[0], pair[1]])));
        }
        Some(sides)
    }
}

/// Turns `polygon` to start at the smallest of its corners from which all triangles of the fan have area.
fn turn_to_fan(polygon: &mut [u16], module: &LoadModule) -> Option<()> {
    let fans = |polygon: &[u16]| polygon[1..].windows(2).all(|p| 0 < module.doubled_area([polygon[0], p[0], p[1]]));
    let first = (0..polygon.len()).min_by_key(|&i| polygon[i]).expect("a polygon has corners");
    polygon.rotate_left(first);
    if fans(polygon) {
        return Some(());
    }
    let mut starts = polygon.to_vec();
    starts.sort_unstable();
    starts.into_iter().find_map(|start| {
        let turn = polygon.iter().position(|&corner| corner == start)?;
        polygon.rotate_left(turn);
        fans(polygon).then_some(())
    })
}

/// Replaces the triangles by the Delaunay triangulation of the vertices; every triangle is a polygon.
fn triangulate_afresh(module: &mut LoadModule) -> usize {
    let places: Vec<_> = module.vertices.iter().map(|v| Post::new(i32::from(v.y), i32::from(v.x))).collect();
    module.triangles = terrain::mesh::delaunay(&places).into_iter().map(|t| t.map(|v| v as u16)).collect();
    module.polygon_count = module.triangles.len() as u32;
    3 * module.triangles.len()
}

pub(crate) fn smallest_first([a, b, c]: [u16; 3]) -> [u16; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Both identities, and the square covered by positive areas; `check` walks the rest where assertions are on.
pub(crate) fn assert_sound(module: &LoadModule, sides: usize) {
    let id = module.id;
    let areas = || module.triangles.iter().map(|&triangle| module.doubled_area(triangle));
    assert!(areas().all(|area| 0 < area), "triangles of load module {id} have area");
    let side = i64::from(module.side);
    assert_eq!(areas().sum::<i64>(), 2 * side * side, "triangles cover load module {id}");
    let border = module.border_vertex_count();
    let inner = module.vertices.len() - border;
    assert_eq!(module.triangles.len(), triangles_of(inner, border), "load module {id} has 2 V + B - 2 triangles");
    // Each inner edge is a side of two polygons, each border edge of one.
    let polygons = polygons_of(inner, (sides - border) / 2);
    assert_eq!(module.polygon_count as usize, polygons, "load module {id} has 1 + E - V polygons");
    debug_assert_eq!(module.check(), Ok(()), "load module {id} is sound");
}

#[cfg(test)]
mod tests {
    use terrain::{ModuleGrid, Spacing};

    use super::*;

    /// Builds a load module of 8 x 8 quanta from polygons whose corners are (y, x, z, is crossing).
    fn module_of(polygons: &[&[(i64, i64, i32, bool)]]) -> LoadModule {
        let grid = ModuleGrid { rows: 1, cols: 1, side_cells: 1 };
        let layout = Layout { grid, modules: grid.all(), spacing: Spacing::from_sixteenths(1).unwrap() };
        let mut pieces = Pieces::default();
        for polygon in polygons {
            pieces.push(polygon.iter().map(|&(y, x, z, is_crossing)| Corner::new(y, x, z, is_crossing)));
        }
        let mask = Importance::uniform(grid.area(), 1000);
        let module = pieces.load_module(ModuleId { row: 0, col: 0 }, &layout, &mask, None);
        assert_eq!(module.check(), Ok(()));
        module
    }

    const SW: (i64, i64, i32, bool) = (0, 0, 10, false);
    const SE: (i64, i64, i32, bool) = (0, 8, 20, false);
    const NE: (i64, i64, i32, bool) = (8, 8, 30, false);
    const NW: (i64, i64, i32, bool) = (8, 0, -40, false);

    #[test]
    fn a_polygon_is_counted_once_and_fanned_from_its_smallest_corner() {
        let module = module_of(&[&[NE, NW, SW, SE]]);
        assert_eq!((module.polygon_count, module.triangles.as_slice()), (1, [[0, 1, 3], [0, 3, 2]].as_slice()));
        assert_eq!(module.vertices[2].z, -40);
    }

    #[test]
    fn a_polygon_with_a_straight_corner_is_fanned_so_that_all_triangles_have_area() {
        // From the south-west corner the first triangle would be flat.
        let middle = (0, 4, 0, true);
        assert_eq!(module_of(&[&[SW, middle, SE, NE, NW]]).triangles, [[0, 1, 3], [1, 2, 4], [1, 4, 3]]);
    }

    #[test]
    fn of_two_crossings_on_one_quantum_the_lower_stays_and_the_spike_between_them_goes() {
        let (low, high, inner) = ((3, 8, 5, true), (3, 8, 9, true), (4, 4, 7, false));
        let polygons: [&[_]; 6] = [
            &[SW, SE, inner],
            &[SE, high, inner],
            &[high, low, inner],
            &[low, NE, inner],
            &[NE, NW, inner],
            &[NW, SW, inner],
        ];
        let module = module_of(&polygons);
        assert_eq!((module.polygon_count, module.triangles.len()), (5, 5));
        assert!(module.vertices.contains(&ModuleVertex { y: 3, x: 8, z: 5 }));
    }

    #[test]
    fn a_vertex_wins_over_a_crossing_on_its_quantum() {
        let (vertex, crossing) = ((0, 4, 5, false), (0, 4, -9, true));
        let module = module_of(&[&[SW, vertex, NW], &[crossing, SE, NE], &[vertex, crossing, NE, NW]]);
        assert_eq!((module.polygon_count, module.vertices[1].z), (3, 5));
    }

    #[test]
    fn a_polygon_turned_over_by_rounding_has_its_load_module_triangulated_afresh() {
        // The inner vertices lie on the wrong side of the edge between the two crossings.
        let (south, north, inner) = ((0, 4, 0, true), (8, 4, 0, true), (4, 5, 0, false));
        let module = module_of(&[
            &[SW, south, north, NW],
            &[south, inner, north],
            &[south, SE, inner],
            &[inner, NE, north],
            &[SE, NE, inner],
        ]);
        assert_eq!(module.triangles.len(), 6);
        let turned = (4, 3, 0, false);
        let module = module_of(&[
            &[SW, south, north, NW],
            &[south, turned, north],
            &[south, SE, turned],
            &[turned, NE, north],
            &[SE, NE, turned],
        ]);
        assert_eq!((module.triangles.len(), module.polygon_count), (6, 6));
    }
}
