//! Onto the final lattice: every vertex finds a place there or goes.

use terrain::{LATTICE_PER_POST, Lattice};

use crate::optimiser::place::{PER_POST, Shape};
use crate::optimiser::tile_mesh::Star;
use crate::optimiser::work::Work;

impl Work<'_, '_> {
    /// The step of the final lattice.
    pub fn final_step(&self) -> i32 {
        match self.task.lattice {
            Lattice::Eighth => PER_POST / LATTICE_PER_POST,
            Lattice::Post => PER_POST,
        }
    }

    /// Puts every vertex on the final lattice; those without a place there go, and what they cost is spent again.
    pub fn snap(&mut self) {
        self.mover.step = self.final_step();
        let all = 0..self.sheet.vertices.len() as u32;
        let mut homeless: Vec<u32> = all.filter(|&vertex| !self.has_place(vertex, Shape::Sound)).collect();
        // Once its neighbours stand on the lattice, a vertex finds a place or can go; a place between triangles of any
        // shape comes next, then room made by a neighbour that goes; only features leave less than that.
        while !homeless.is_empty() {
            homeless.retain(|&vertex| !self.has_place(vertex, Shape::Sound) && !self.take_out(vertex));
            homeless.retain(|&vertex| !self.has_place(vertex, Shape::Upright) && !self.take_out(vertex));
            let has_room = homeless.iter().any(|&vertex| self.make_room(vertex));
            if !has_room && !homeless.iter().any(|&vertex| self.force_out(vertex)) {
                break;
            }
        }
        assert!(homeless.is_empty(), "{} vertices have no place on the lattice and cannot go", homeless.len());
        self.fill_up();
    }

    /// Whether a vertex stands on the final lattice now, or is gone.
    fn has_place(&mut self, vertex: u32, shape: Shape) -> bool {
        !self.sheet.is_vertex(vertex) || self.mover.snap(&mut self.sheet, vertex, shape)
    }

    /// Takes out one of the vertices around another, if one can go.
    fn make_room(&mut self, vertex: u32) -> bool {
        let mut star = Star::default();
        self.sheet.star(vertex, &mut star);
        star.ring.iter().any(|&beside| self.take_out(beside))
    }

    /// Takes a vertex out, if that leaves a valid mesh.
    pub fn take_out(&mut self, vertex: u32) -> bool {
        let can_go = self.removal.find(&self.sheet, vertex).is_some();
        can_go && self.let_go(vertex)
    }

    /// Takes a vertex out whatever the triangles look like that fill its place.
    pub fn force_out(&mut self, vertex: u32) -> bool {
        self.removal.find_by_force(&self.sheet, vertex) && self.let_go(vertex)
    }

    /// Takes a vertex out as the removal has found it.
    fn let_go(&mut self, vertex: u32) -> bool {
        self.account.refund(&self.sheet.vertices[vertex as usize]);
        self.sheet.apply(&mut self.removal.patch);
        self.sheet.drop_vertex(vertex);
        true
    }
}
