//! Whether triangles leave a gap: those that turn left and are together as large as the square cover it exactly once
//! if every edge inside it has as many triangles on its left as on its right.
//!
//! Such triangles bound nothing inside the square, so every place there lies under the same number of them, and the
//! area says that it is one. Without this a hole here and an overlap there, equally large, would be taken for ground.

use crate::Vertex;

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
