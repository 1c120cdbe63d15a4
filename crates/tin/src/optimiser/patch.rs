//! Changing a mesh in one place: other triangles over the same outline.

use crate::optimiser::form::Form;
use crate::optimiser::moments::Sums;
use crate::optimiser::parts::NONE;
use crate::optimiser::tile_mesh::{TileMesh, Triangle};

/// A change in one place: triangles that go, triangles that come over the same outline, heights that move.
#[derive(Default)]
pub(crate) struct Patch {
    pub old: Vec<u32>,
    pub new: Vec<([u32; 3], Form)>,
    /// Vertices whose heights are fitted again, and by how much they rise.
    pub refit: Vec<u32>,
    pub rise: Vec<f64>,
    outline: Vec<Outer>,
    slots: Vec<u32>,
}

/// An edge of the outline of what is changed.
struct Outer {
    from: u32,
    to: u32,
    twin: u32,
    sums: Sums,
}

impl Patch {
    pub fn clear(&mut self) {
        self.old.clear();
        self.new.clear();
        self.refit.clear();
        self.rise.clear();
    }
}

impl TileMesh<'_> {
    /// Carries out a change and marks as changed everything it touches.
    pub fn apply(&mut self, patch: &mut Patch) {
        self.cut_out(patch);
        for (i, &(corners, form)) in patch.new.iter().enumerate() {
            let triangle = patch.slots[i];
            self.triangles[triangle as usize] = Triangle { corners, twins: [NONE; 3], squares: 0.0 };
            self.forms[triangle as usize] = form;
        }
        for (i, &(corners, _)) in patch.new.iter().enumerate() {
            for k in 0..3 {
                self.sew(patch, i, k, corners);
            }
        }
        self.triangle_count = self.triangle_count + patch.new.len() - patch.old.len();
        for (&vertex, &rise) in patch.refit.iter().zip(&patch.rise) {
            let record = &mut self.vertices[vertex as usize];
            // A rise that ends at a bound, added to the height again, may round to beside it.
            record.height = self.ground.bounded(record.at, record.height + rise);
            record.has_changed = true;
        }
        for &triangle in &patch.slots {
            self.settle(triangle);
        }
        for &vertex in &patch.refit {
            self.settle_around(vertex);
        }
    }

    /// Takes the old triangles out and remembers what lay beyond their outline.
    fn cut_out(&mut self, patch: &mut Patch) {
        patch.outline.clear();
        patch.slots.clear();
        for &triangle in &patch.old {
            for k in 0..3 {
                let edge = 4 * triangle + k;
                let twin = self.twin(edge);
                if twin == NONE || !patch.old.contains(&(twin >> 2)) {
                    let (from, to) = self.ends(edge);
                    patch.outline.push(Outer { from, to, twin, sums: self.sums_of(edge) });
                }
            }
        }
        for i in 0..patch.new.len().max(patch.old.len()) {
            match patch.old.get(i) {
                Some(&slot) if i < patch.new.len() => patch.slots.push(slot),
                Some(&slot) => {
                    self.triangles[slot as usize] = Triangle { corners: [NONE; 3], twins: [NONE; 3], squares: 0.0 };
                    self.free_triangles.push(slot);
                }
                None => patch.slots.push(self.fresh_triangle()),
            }
        }
    }

    fn fresh_triangle(&mut self) -> u32 {
        self.free_triangles.pop().unwrap_or_else(|| {
            self.triangles.push(Triangle { corners: [NONE; 3], twins: [NONE; 3], squares: 0.0 });
            self.forms.push(Form::default());
            self.sums.push([Sums::default(); 3]);
            self.triangles.len() as u32 - 1
        })
    }

    /// Joins one edge of a new triangle to the outline or to another new triangle.
    #[inline(always)]
    fn sew(&mut self, patch: &Patch, i: usize, k: usize, corners: [u32; 3]) {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        let edge = 4 * patch.slots[i] + k as u32;
        let vertex = &mut self.vertices[from as usize];
        vertex.edge = edge;
        vertex.has_changed = true;
        let outer = patch.outline.iter().find(|outer| outer.from == from && outer.to == to);
        let twin = match outer {
            Some(outer) => outer.twin,
            None => patch
                .new
                .iter()
                .zip(&patch.slots)
                .find_map(|((other, _), &slot)| {
                    (0..3).find(|&l| other[l] == to && other[(l + 1) % 3] == from).map(|l| 4 * slot + l as u32)
                })
                // An edge of a patch lies on its outline, between two of its triangles, or on the tile's border.
                .unwrap_or(NONE),
        };
        self.sums[patch.slots[i] as usize][k] = match outer {
            Some(outer) => outer.sums,
            // The triangle beyond has been sewn already.
            None if twin != NONE && self.twin(twin) == edge => -self.sums_of(twin),
            None => self.ground.moments.edge(self.at(from), self.at(to)),
        };
        debug_assert!(twin != NONE || self.is_constrained(from, to), "only border edges have no twin");
        self.triangles[(edge >> 2) as usize].twins[k] = twin;
        if twin != NONE {
            self.triangles[(twin >> 2) as usize].twins[(twin & 3) as usize] = edge;
        }
    }
}
