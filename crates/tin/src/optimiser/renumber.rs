//! Neighbours in space become neighbours in memory again.

use crate::optimiser::parts::{NONE, Vertex};
use crate::optimiser::place::Place;
use crate::optimiser::place::along_curve;
use crate::optimiser::tile_mesh::{TileMesh, Triangle};

impl TileMesh<'_> {
    /// Orders vertices and triangles along a curve again and forgets those that are gone. Nothing else changes.
    pub fn renumber(&mut self) {
        let live = (0..self.vertices.len() as u32).filter(|&vertex| self.is_vertex(vertex));
        let vertices = along_curve(live, |vertex| self.at(vertex));
        let middle = |triangle: u32| {
            let [a, b, c] = self.places(self.triangles[triangle as usize].corners);
            Place::new((a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3)
        };
        let live = (0..self.triangles.len() as u32).filter(|&triangle| self.is_live(triangle));
        let triangles = along_curve(live, middle);
        let number = numbers(&vertices, self.vertices.len());
        let slot = numbers(&triangles, self.triangles.len());
        let moved = |edge: u32| if edge == NONE { NONE } else { 4 * slot[(edge >> 2) as usize] + (edge & 3) };
        let triangle = |&old: &u32| {
            let Triangle { corners, twins, squares } = self.triangles[old as usize];
            Triangle { corners: corners.map(|corner| number[corner as usize]), twins: twins.map(moved), squares }
        };
        // Where a vertex is entered decides in which order sums around it are taken: as in a mesh that is made anew.
        let vertex = |&old: &u32| Vertex { edge: NONE, ..self.vertices[old as usize] };
        let of = |old: &u32| *old as usize;
        (self.vertices, self.triangles, self.forms, self.sums) = (
            vertices.iter().map(vertex).collect(),
            triangles.iter().map(triangle).collect(),
            triangles.iter().map(|old| self.forms[of(old)]).collect(),
            triangles.iter().map(|old| self.sums[of(old)]).collect(),
        );
        for (triangle, record) in self.triangles.iter().enumerate() {
            for (k, corner) in record.corners.into_iter().enumerate() {
                self.vertices[corner as usize].edge = 4 * triangle as u32 + k as u32;
            }
        }
        self.free_vertices.clear();
        self.free_triangles.clear();
        (self.vertex_count, self.triangle_count) = (self.vertices.len(), self.triangles.len());
    }
}

/// The place of each item in an order, of so many items.
fn numbers(order: &[u32], count: usize) -> Vec<u32> {
    let mut numbers = vec![NONE; count];
    order.iter().enumerate().for_each(|(number, &item)| numbers[item as usize] = number as u32);
    numbers
}
