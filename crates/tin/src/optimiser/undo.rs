//! A part of the mesh as it was, for changes that are carried out before it is known whether they pay.

use crate::optimiser::form::Form;
use crate::optimiser::moments::Sums;
use crate::optimiser::parts::Vertex;
use crate::optimiser::tile_mesh::{Star, TileMesh, Triangle};

/// Some vertices and all triangles around them.
#[derive(Default)]
pub(crate) struct Saved {
    vertices: Vec<(u32, Vertex)>,
    triangles: Vec<(u32, Triangle, Form, [Sums; 3])>,
    squares: f64,
    triangle_count: usize,
    free_triangles: usize,
    star: Star,
    /// For each triangle the last call that saved it: searching the list would take longer.
    seen: Vec<u32>,
    call: u32,
}

impl Saved {
    /// Saves some vertices and all triangles around them, in place of what was saved before.
    pub fn save(&mut self, sheet: &TileMesh, vertices: impl IntoIterator<Item = u32>) {
        self.vertices.clear();
        self.triangles.clear();
        self.call += 1;
        self.seen.resize(sheet.triangles.len(), 0);
        for vertex in vertices {
            self.vertices.push((vertex, sheet.vertices[vertex as usize]));
            sheet.star(vertex, &mut self.star);
            for triangle in self.star.edges.iter().map(|edge| edge >> 2) {
                let index = triangle as usize;
                if std::mem::replace(&mut self.seen[index], self.call) != self.call {
                    let record = (triangle, sheet.triangles[index], sheet.forms[index], sheet.sums[index]);
                    self.triangles.push(record);
                }
            }
        }
        self.squares = self.triangles.iter().map(|(_, record, ..)| record.squares).sum();
        (self.triangle_count, self.free_triangles) = (sheet.triangle_count, sheet.free_triangles.len());
    }

    /// By how much the squares have grown since.
    pub fn rise(&self, sheet: &TileMesh) -> f64 {
        // Those of a triangle that is gone are zero.
        let now: f64 = self.triangles.iter().map(|&(triangle, ..)| sheet.triangles[triangle as usize].squares).sum();
        now - self.squares
    }

    /// Puts everything back, provided that only what was saved has changed and no triangle was added.
    pub fn restore(&self, sheet: &mut TileMesh) {
        for &(vertex, record) in &self.vertices {
            sheet.vertices[vertex as usize] = record;
        }
        for &(triangle, record, form, sums) in &self.triangles {
            let index = triangle as usize;
            (sheet.triangles[index], sheet.forms[index], sheet.sums[index]) = (record, form, sums);
        }
        sheet.free_triangles.truncate(self.free_triangles);
        sheet.triangle_count = self.triangle_count;
    }
}
