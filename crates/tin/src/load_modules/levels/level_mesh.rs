//! A small mesh whose triangles know their squared residuals.

use terrain::{LatticePoint, ModuleVertex};

use super::posts::Posts;
use crate::load_modules::pieces::smallest_first;

/// The triangles of one load module, each vertex with those around it.
pub(super) struct LevelMesh {
    pub vertices: Vec<ModuleVertex>,
    /// Counter-clockwise; those that were replaced are in no star.
    pub triangles: Vec<[u16; 3]>,
    /// Of each triangle.
    pub squares: Vec<u128>,
    /// The triangles around each vertex, in ascending order.
    pub stars: Vec<Vec<u32>>,
    /// Edges of features, the lesser end first, in ascending order.
    kept: Vec<[u16; 2]>,
}

/// Whether a vertex lies on no side of a load module.
pub(super) fn is_inside(vertex: ModuleVertex, side: u16) -> bool {
    0 < vertex.x && vertex.x < side && 0 < vertex.y && vertex.y < side
}

/// Where a vertex lies, for exact questions.
pub(super) fn place(vertex: ModuleVertex) -> LatticePoint {
    LatticePoint::new(i32::from(vertex.y), i32::from(vertex.x))
}

impl LevelMesh {
    /// The canonical Delaunay triangulation of vertices in canonical order.
    pub fn delaunay(vertices: Vec<ModuleVertex>, posts: &Posts) -> Self {
        Self::keeping(vertices, &[], posts)
    }

    /// The same with edges that stay.
    ///
    /// # Panics
    /// When two of them cross.
    pub fn keeping(vertices: Vec<ModuleVertex>, edges: &[[u16; 2]], posts: &Posts) -> Self {
        let places: Vec<_> = vertices.iter().map(|&vertex| place(vertex)).collect();
        let mut kept: Vec<[u16; 2]> = edges.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
        kept.sort_unstable();
        let triangles = match edges.is_empty() {
            true => terrain::mesh::delaunay(&places),
            false => {
                let wanted: Vec<[u32; 2]> = kept.iter().map(|ends| ends.map(u32::from)).collect();
                let (triangles, found) = terrain::mesh::constrained_delaunay(&places, &wanted);
                assert!(!found.contains(&false), "edges of features do not cross");
                triangles
            }
        };
        let stars = vec![Vec::new(); vertices.len()];
        let mut sheet = Self { vertices, squares: Vec::new(), triangles: Vec::new(), stars, kept };
        triangles.into_iter().for_each(|triangle| sheet.add(triangle.map(|v| v as u16), posts));
        sheet
    }

    /// Whether the edge between two vertices stays.
    pub fn keeps(&self, a: u16, b: u16) -> bool {
        self.kept.binary_search(&[a.min(b), a.max(b)]).is_ok()
    }

    pub fn corners(&self, triangle: [u16; 3]) -> [ModuleVertex; 3] {
        triangle.map(|v| self.vertices[usize::from(v)])
    }

    /// Adds a triangle.
    pub fn add(&mut self, triangle: [u16; 3], posts: &Posts) {
        let index = self.triangles.len() as u32;
        self.squares.push(posts.squares(self.corners(triangle)));
        self.triangles.push(triangle);
        triangle.iter().for_each(|&v| self.stars[usize::from(v)].push(index));
    }

    /// Puts other corners in the place of a triangle's.
    pub fn replace(&mut self, index: u32, triangle: [u16; 3], squares: u128) {
        self.take(index);
        self.triangles[index as usize] = triangle;
        self.squares[index as usize] = squares;
        for v in triangle {
            let star = &mut self.stars[usize::from(v)];
            let at = star.partition_point(|&other| other < index);
            star.insert(at, index);
        }
    }

    /// Takes a triangle out of all stars.
    pub fn take(&mut self, index: u32) {
        for v in self.triangles[index as usize] {
            self.stars[usize::from(v)].retain(|&other| other != index);
        }
    }

    /// The triangle other than `index` that has the edge between `a` and `b`.
    pub fn beside(&self, index: u32, a: u16, b: u16) -> Option<u32> {
        let has = |&other: &u32| other != index && self.triangles[other as usize].contains(&b);
        self.stars[usize::from(a)].iter().copied().find(has)
    }

    /// The vertices around one inside, counter-clockwise.
    pub fn ring(&self, v: u16) -> Vec<u16> {
        let star = &self.stars[usize::from(v)];
        let sides: Vec<_> = star.iter().map(|&t| from_corner(self.triangles[t as usize], v)).collect();
        let mut ring = vec![sides[0][1]];
        while ring.len() < sides.len() {
            let last = ring[ring.len() - 1];
            let side = sides.iter().find(|side| side[1] == last);
            ring.push(side.expect("a vertex inside has triangles all around")[2]);
        }
        ring
    }

    /// Vertices and triangles in canonical order.
    pub fn into_lists(self) -> (Vec<ModuleVertex>, Vec<[u16; 3]>) {
        let mut triangles: Vec<_> = self.triangles.into_iter().map(smallest_first).collect();
        triangles.sort_unstable();
        (self.vertices, triangles)
    }
}

/// The triangle, turned so that `v` comes first.
pub(super) fn from_corner(mut triangle: [u16; 3], v: u16) -> [u16; 3] {
    let turn = triangle.iter().position(|&u| u == v).expect("the triangle has that corner");
    triangle.rotate_left(turn);
    triangle
}
