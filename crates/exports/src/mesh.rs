//! The load modules of a product as one mesh: vertices on shared sides are one vertex, those of decks their own.

use std::collections::HashMap;
use std::ops::Range;

use terrain::{HOLE_CLASS, LoadModule, ModuleId, ModuleRect, ModuleVertex, QUANTA_PER_METRE};

use crate::Product;

/// What coordinates are counted from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// From the south-west corner of what is exported: for Blender, MeshLab and the like.
    Local,
    /// Eastings and northings: 64-bit floats, for QGIS and other geographic programs.
    Map,
}

/// Triangles over common vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// East, north and up in quanta of 1/128 m; east and north from the mesh's south-west corner.
    pub vertices: Vec<[i32; 3]>,
    /// Corners, counter-clockwise seen from above: those of the ground, then those of decks.
    pub triangles: Vec<[u32; 3]>,
    /// Class of each triangle.
    pub classes: Vec<u8>,
    /// First triangle of each load module's ground, row by row from the south-west, and the end of the last.
    pub(crate) starts: Vec<usize>,
    /// The same of the decks of each load module; empty where no load module has any.
    pub(crate) deck_starts: Vec<usize>,
}

/// Some load modules of a mesh, over vertices of their own.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Part {
    /// Vertices of the mesh, in the order in which they are first used.
    pub vertices: Vec<u32>,
    /// Corners by place in `vertices`.
    pub triangles: Vec<[u32; 3]>,
    /// Class of each triangle.
    pub classes: Vec<u8>,
    /// Each load module, and its triangles among those of the part.
    pub modules: Vec<(ModuleId, Range<usize>)>,
}

/// Extent in quanta up to which every coordinate is exact as a 32-bit float.
const EXACT_QUANTA_MAX: i32 = 1 << 24;

impl Mesh {
    /// Ground and decks of a product: triangles over holes, where no source has a height, are left out.
    pub fn of(product: &Product) -> Self {
        Self::whole(product).without_holes().with_decks(product)
    }

    /// All ground of a product, triangles over holes too.
    pub(crate) fn whole(product: &Product) -> Self {
        let mut mesh = Self::default();
        let mut shared = HashMap::new();
        for module in &product.modules {
            mesh.starts.push(mesh.triangles.len());
            mesh.add(module, product.corner(module.id), &mut shared);
        }
        mesh.starts.push(mesh.triangles.len());
        mesh
    }

    /// The same without triangles over holes, and without the vertices that only these have.
    fn without_holes(self) -> Self {
        if !self.classes.contains(&HOLE_CLASS) {
            return self;
        }
        let mut left = Self::default();
        let mut place_of = vec![u32::MAX; self.vertices.len()];
        for range in self.starts.windows(2).map(|ends| ends[0]..ends[1]) {
            left.starts.push(left.triangles.len());
            for index in range.filter(|&index| self.classes[index] != HOLE_CLASS) {
                let placed = self.triangles[index].map(|v| {
                    let place = &mut place_of[v as usize];
                    if *place == u32::MAX {
                        *place = left.vertices.len() as u32;
                        left.vertices.push(self.vertices[v as usize]);
                    }
                    *place
                });
                left.triangles.push(placed);
                left.classes.push(self.classes[index]);
            }
        }
        left.starts.push(left.triangles.len());
        left
    }

    /// The same with the decks of its product: they share vertices with each other, and none with the ground.
    pub(crate) fn with_decks(mut self, product: &Product) -> Self {
        if product.deck_triangles() == 0 {
            return self;
        }
        let mut shared = HashMap::new();
        for module in &product.modules {
            self.deck_starts.push(self.triangles.len());
            let corner = product.corner(module.id);
            let mut place = |vertex: &ModuleVertex| {
                let place = [corner[0] + i32::from(vertex.x), corner[1] + i32::from(vertex.y), vertex.z];
                *shared.entry(place).or_insert_with(|| {
                    self.vertices.push(place);
                    self.vertices.len() as u32 - 1
                })
            };
            let index_of: Vec<u32> = module.decks.vertices.iter().map(&mut place).collect();
            let placed = module.decks.triangles.iter().map(|triangle| triangle.map(|v| index_of[usize::from(v)]));
            self.triangles.extend(placed);
            self.classes.extend_from_slice(&module.decks.classes);
        }
        self.deck_starts.push(self.triangles.len());
        self
    }

    /// The triangles of the ground.
    pub(crate) fn ground(&self) -> Range<usize> {
        0..self.starts.last().copied().unwrap_or(0)
    }

    /// The triangles of decks.
    pub(crate) fn decks(&self) -> Range<usize> {
        self.ground().end..self.triangles.len()
    }

    /// The ground of the load modules of `rect`, which `product`, of which this is the mesh, holds: without holes.
    pub(crate) fn part(&self, product: &Product, rect: ModuleRect) -> Part {
        self.part_of(&self.starts, product, rect)
    }

    /// The decks of the load modules of `rect`; without triangles where they have none.
    pub(crate) fn deck_part(&self, product: &Product, rect: ModuleRect) -> Part {
        if self.deck_starts.is_empty() { Part::default() } else { self.part_of(&self.deck_starts, product, rect) }
    }

    fn part_of(&self, starts: &[usize], product: &Product, rect: ModuleRect) -> Part {
        let mut part = Part::default();
        let mut place_of = HashMap::new();
        for id in rect.iter() {
            let (row, col) = (id.row - product.rect.south, id.col - product.rect.west);
            let index = (row * product.rect.cols() + col) as usize;
            let own = starts[index]..starts[index + 1];
            let start = part.triangles.len();
            for index in own.filter(|&index| self.classes[index] != HOLE_CLASS) {
                let placed = self.triangles[index].map(|v| {
                    *place_of.entry(v).or_insert_with(|| {
                        part.vertices.push(v);
                        part.vertices.len() as u32 - 1
                    })
                });
                part.triangles.push(placed);
                part.classes.push(self.classes[index]);
            }
            part.modules.push((id, start..part.triangles.len()));
        }
        part
    }

    fn add(&mut self, module: &LoadModule, corner: [i32; 2], shared: &mut HashMap<[i32; 2], u32>) {
        let on_side = |v: &ModuleVertex| v.x == 0 || v.y == 0 || v.x == module.side || v.y == module.side;
        let mut index_of = Vec::with_capacity(module.vertices.len());
        for vertex in &module.vertices {
            let (x, y) = (corner[0] + i32::from(vertex.x), corner[1] + i32::from(vertex.y));
            let next = self.vertices.len() as u32;
            let index = if on_side(vertex) { *shared.entry([x, y]).or_insert(next) } else { next };
            if index == next {
                self.vertices.push([x, y, vertex.z]);
            }
            index_of.push(index);
        }
        self.triangles.extend(module.triangles.iter().map(|triangle| triangle.map(|v| index_of[usize::from(v)])));
        self.classes.extend_from_slice(&module.classes);
    }

    /// East, north and up of each vertex in metres from the mesh's south-west corner.
    pub(crate) fn metres(&self) -> impl ExactSizeIterator<Item = [f64; 3]> {
        self.vertices.iter().map(|vertex| vertex.map(|quanta| f64::from(quanta) / f64::from(QUANTA_PER_METRE)))
    }

    /// Whether every coordinate, counted from the south-west corner, is exact as a 32-bit float.
    pub(crate) fn fits_floats(&self) -> bool {
        self.vertices.iter().flatten().all(|quanta| quanta.abs() <= EXACT_QUANTA_MAX)
    }

    /// The direction the ground faces at each vertex: that of the triangles around it, larger ones counting more.
    pub(crate) fn normals(&self) -> Vec<[f64; 3]> {
        let places: Vec<[f64; 3]> = self.metres().collect();
        normals(&places, &self.triangles)
    }
}

/// Triangles by class, in the order of classes.
pub(crate) fn class_groups(triangles: &[[u32; 3]], classes: &[u8]) -> Vec<(u8, Vec<[u32; 3]>)> {
    let mut by_class = vec![Vec::new(); 256];
    triangles.iter().zip(classes).for_each(|(&triangle, &class)| by_class[usize::from(class)].push(triangle));
    (0..=u8::MAX).zip(by_class).filter(|(_, triangles)| !triangles.is_empty()).collect()
}

/// Unit normals at vertices, of the triangles around each, by area.
pub(crate) fn normals(places: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<[f64; 3]> {
    let mut sums = vec![[0.0; 3]; places.len()];
    for &triangle in triangles {
        let [a, b, c] = triangle.map(|v| places[v as usize]);
        let normal = cross(minus(b, a), minus(c, a));
        for v in triangle {
            let sum = &mut sums[v as usize];
            (0..3).for_each(|axis| sum[axis] += normal[axis]);
        }
    }
    sums.into_iter().map(unit).collect()
}

pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A vector of length one; up, for a vector without a direction.
pub(crate) fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt();
    if length == 0.0 { [0.0, 0.0, 1.0] } else { v.map(|part| part / length) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn shared_sides_are_welded_and_nothing_else_is() {
        let product = samples::product();
        let mesh = Mesh::of(&product);
        // Two load modules of 4 and 5 vertices that share 2.
        assert_eq!((mesh.vertices.len(), mesh.triangles.len(), mesh.classes.len()), (7, 6, 6));
        let doubled: i64 = mesh
            .triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize].map(i64::from));
                (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            })
            .sum();
        assert_eq!(doubled, 2 * 2 * 64_000 * 64_000);
    }

    #[test]
    fn a_part_has_the_triangles_of_its_load_modules_over_its_own_vertices() {
        let product = samples::product();
        let mesh = Mesh::of(&product);
        let part = mesh.part(&product, samples::eastern().rect);
        assert_eq!((part.vertices.len(), part.triangles.len()), (5, 4));
        for (own, whole) in part.triangles.iter().zip(&mesh.triangles[2..]) {
            assert_eq!(own.map(|v| part.vertices[v as usize]), *whole);
        }
        assert_eq!(part.modules, [(ModuleId { row: 0, col: 1 }, 0..4)]);
    }

    #[test]
    fn triangles_over_holes_and_their_vertices_are_left_out() {
        let product = samples::with_hole();
        let whole = Mesh::whole(&product);
        assert_eq!((whole.vertices.len(), whole.triangles.len()), (7, 6));
        // The eastern load module, its two western triangles excepted, is a hole, and so is its north-eastern corner.
        let mesh = Mesh::of(&product);
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (6, 4));
        assert!(!mesh.classes.contains(&HOLE_CLASS) && mesh.starts == [0, 2, 4]);
        assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.vertices.len()));
        for part in [mesh.part(&product, product.rect), whole.part(&product, product.rect)] {
            assert_eq!((part.vertices.len(), part.triangles.len(), part.classes.len()), (6, 4, 4));
            assert_eq!(part.modules[1].1, 2..4);
        }
    }

    #[test]
    fn decks_follow_the_ground_over_vertices_of_their_own() {
        let product = samples::with_bridge();
        let (mesh, ground) = (Mesh::of(&product), Mesh::whole(&product));
        assert_eq!((mesh.ground(), mesh.decks()), (0..6, 6..12));
        assert_eq!((&mesh.vertices[..7], &mesh.triangles[..6]), (&ground.vertices[..], &ground.triangles[..]));
        // The lower bridge goes on over the line between the load modules: two vertices are shared.
        assert_eq!((mesh.vertices.len(), &mesh.classes[6..]), (7 + 6 + 4, &[1, 1, 1, 1, 2, 2][..]));
        let (both, east) = (mesh.deck_part(&product, product.rect), samples::eastern().rect);
        assert_eq!((both.vertices.len(), both.triangles.len()), (10, 6));
        assert_eq!(mesh.deck_part(&product, east).modules, [(ModuleId { row: 0, col: 1 }, 0..4)]);
        assert_eq!(mesh.part(&product, east).triangles.len(), 4);
        assert!(ground.deck_part(&product, east).triangles.is_empty());
    }

    #[test]
    fn level_ground_faces_up_and_a_slope_leans() {
        let places = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]];
        let flat = normals(&places, &[[0, 1, 2]]);
        assert_eq!(flat[0], [0.0, 0.0, 1.0]);
        let both = normals(&places, &[[0, 1, 2], [1, 3, 2]]);
        assert!(both[3][0] < 0.0 && both[3][1] < 0.0 && 0.0 < both[3][2]);
        assert!((dot(both[1], both[1]) - 1.0).abs() < 1e-12);
    }
}
