//! The order in which vertices inside a load module go.

use std::collections::BTreeSet;

use terrain::ModuleVertex;

use super::level_mesh::{LevelMesh, place};
use super::posts::Posts;
use crate::load_modules::hole::fill;

/// The first `count` of the `inner` vertices to go: each time the one whose removal adds least to the squared
/// residuals of the canonical Delaunay triangulation, the first by row and column where several do.
pub(super) fn removal_order(vertices: &[ModuleVertex], inner: &[u16], count: usize, posts: &Posts) -> Vec<u16> {
    if count == 0 {
        return Vec::new();
    }
    let mut sheet = LevelMesh::delaunay(vertices.to_vec(), posts);
    let mut costs: Vec<Option<i128>> = vec![None; vertices.len()];
    let mut queue = BTreeSet::new();
    for &v in inner {
        let cost = cost(&sheet, v, posts);
        costs[usize::from(v)] = Some(cost);
        queue.insert((cost, v));
    }
    let mut order = Vec::with_capacity(count);
    while order.len() < count {
        let Some((_, v)) = queue.pop_first() else { break };
        costs[usize::from(v)] = None;
        order.push(v);
        let ring = sheet.ring(v);
        let filling = filling(&sheet, &ring);
        sheet.stars[usize::from(v)].clone().into_iter().for_each(|triangle| sheet.take(triangle));
        filling.into_iter().for_each(|triangle| sheet.add(triangle, posts));
        for u in ring {
            let Some(before) = costs[usize::from(u)] else { continue };
            let now = cost(&sheet, u, posts);
            queue.remove(&(before, u));
            queue.insert((now, u));
            costs[usize::from(u)] = Some(now);
        }
    }
    order
}

/// What the squared residuals gain when an inner vertex goes; may be negative.
fn cost(sheet: &LevelMesh, v: u16, posts: &Posts) -> i128 {
    let before: u128 = sheet.stars[usize::from(v)].iter().map(|&triangle| sheet.squares[triangle as usize]).sum();
    let filling = filling(sheet, &sheet.ring(v));
    let after: u128 = filling.into_iter().map(|triangle| posts.squares(sheet.corners(triangle))).sum();
    after as i128 - before as i128
}

/// The triangles that Delaunay has inside a ring once its centre is gone.
fn filling(sheet: &LevelMesh, ring: &[u16]) -> Vec<[u16; 3]> {
    let places: Vec<_> = ring.iter().map(|&v| place(sheet.vertices[usize::from(v)])).collect();
    fill(&places).into_iter().map(|triangle| triangle.map(|i| ring[i])).collect()
}
