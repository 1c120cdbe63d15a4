//! Edges of triangles, by equal places: which two triangles share one, and where there is only one.

use crate::Triangles;

/// An edge that two triangles share.
pub(crate) struct SharedEdge {
    /// Its ends, by vertex of the first triangle.
    pub ends: [u32; 2],
    /// The triangles on either side.
    pub triangles: [u32; 2],
}

/// An edge with a triangle on its left side only.
pub(crate) struct OpenEdge {
    /// Its ends, by vertex.
    pub ends: [u32; 2],
}

/// All edges of a sheet of triangles.
pub(crate) struct Edges {
    pub shared: Vec<SharedEdge>,
    pub open: Vec<OpenEdge>,
    /// Places where vertices stand at different heights.
    pub torn: u64,
}

impl Edges {
    pub fn of(triangles: &Triangles) -> Self {
        let (welded, torn) = weld(triangles);
        // Both directions of an edge side by side, the one from the smaller place first.
        let mut halves: Vec<([u32; 2], bool, u32, [u32; 2])> = Vec::with_capacity(3 * triangles.count());
        for (triangle, corners) in triangles.corners().iter().enumerate() {
            for i in 0..3 {
                let ends = [corners[i], corners[(i + 1) % 3]];
                let [from, to] = ends.map(|v| welded[v as usize]);
                halves.push(([from.min(to), from.max(to)], to < from, triangle as u32, ends));
            }
        }
        halves.sort_unstable();
        let mut edges = Self { shared: Vec::new(), open: Vec::new(), torn };
        let mut at = 0;
        while let Some(&(edge, is_back, triangle, ends)) = halves.get(at) {
            match halves.get(at + 1) {
                Some(&(next, next_is_back, other, _)) if next == edge && next_is_back != is_back => {
                    edges.shared.push(SharedEdge { ends, triangles: [triangle, other] });
                    at += 2;
                }
                _ => {
                    edges.open.push(OpenEdge { ends });
                    at += 1;
                }
            }
        }
        edges
    }
}

/// The first vertex at each vertex's place, and how many places have vertices at more than one height.
fn weld(triangles: &Triangles) -> (Vec<u32>, u64) {
    let (places, _) = triangles.places();
    let height = |v: u32| triangles.vertices()[v as usize][2];
    let mut order: Vec<u32> = (0..places.len() as u32).collect();
    order.sort_unstable_by_key(|&v| (places[v as usize], v));
    let (mut welded, mut torn) = (vec![0; places.len()], 0);
    for group in order.chunk_by(|&a, &b| places[a as usize] == places[b as usize]) {
        group.iter().for_each(|&v| welded[v as usize] = group[0]);
        torn += u64::from(group.iter().any(|&v| height(v) != height(group[0])));
    }
    (welded, torn)
}
