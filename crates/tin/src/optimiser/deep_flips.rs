//! Flips judged by what comes of them once the four vertices around have moved.
//!
//! A flip that raises the squares at first may still lead to a better mesh: on smooth ground most of what is lost sits
//! in the topology that greedy growth leaves, and plain flips cannot leave it.

use crate::optimiser::flips::{Flip, Scale, propose};
use crate::optimiser::patch::Patch;
use crate::optimiser::sweep::Mover;
use crate::optimiser::tile_mesh::{Star, TileMesh};
use crate::optimiser::undo::Saved;

/// How far a flip may raise the squares at first: in squares of the two triangles, and in mean squares of a triangle.
const RISE_MAX: f64 = 5.0;
/// What a flip has to gain in the end, in mean squares of a triangle.
const LEAST_GAIN: f64 = 0.01;
/// A flip is given up when a round of moves leaves more than this part of what was still to be gained.
const GIVE_UP: f64 = 0.5;

/// Looks once at every edge near a changed vertex; what it moves is changed afterwards.
pub(crate) fn deep_flips(sheet: &mut TileMesh, mover: &mut Mover, rounds: usize) {
    let mean = sheet.mean_squares();
    mover.aim(mean);
    let had_changed: Vec<bool> = sheet.vertices.iter().map(|vertex| vertex.has_changed).collect();
    sheet.vertices.iter_mut().for_each(|vertex| vertex.has_changed = false);
    let scale = Scale::of(sheet);
    let mut pass =
        Pass { mean, scale, rounds, patch: Patch::default(), saved: Saved::default(), star: Star::default() };
    for triangle in 0..sheet.triangles.len() as u32 {
        for k in 0..3 {
            if !sheet.is_live(triangle) {
                break;
            }
            let edge = 4 * triangle + k;
            if sheet.is_upper_side(edge) {
                continue;
            }
            let corners = sheet.around_edge(edge);
            let has_changed = |&v: &u32| had_changed[v as usize] || sheet.vertices[v as usize].has_changed;
            if corners.iter().any(has_changed) {
                pass.try_edge(sheet, mover, edge, corners);
            }
        }
    }
}

/// What a pass works with.
struct Pass {
    /// Mean squares of a triangle.
    mean: f64,
    scale: Scale,
    /// Rounds of moves after a flip, at most.
    rounds: usize,
    patch: Patch,
    saved: Saved,
    star: Star,
}

impl Pass {
    fn try_edge(&mut self, sheet: &mut TileMesh, mover: &mut Mover, edge: u32, [a, b, c, d]: [u32; 4]) {
        let rise = |old: f64| RISE_MAX * old.min(self.mean);
        let limit = |old: f64| old + rise(old);
        let Some(flip) = propose(sheet, edge, &self.scale, limit, &mut self.patch) else { return };
        if flip.is_gain() {
            sheet.apply(&mut self.patch);
            return;
        }
        self.saved.save(sheet, [c, d, a, b]);
        sheet.apply(&mut self.patch);
        if self.settles(sheet, mover, &flip, [c, d, a, b]) {
            for vertex in [a, b, c, d] {
                sheet.mark_around(vertex, &mut self.star);
            }
        } else {
            self.saved.restore(sheet);
        }
    }

    /// Moves the ends of the new edge, then those of the old one, until the flip has paid or is given up.
    fn settles(&self, sheet: &mut TileMesh, mover: &mut Mover, flip: &Flip, vertices: [u32; 4]) -> bool {
        // What squares have to fall by.
        let least = LEAST_GAIN * self.mean + flip.needles;
        let mut before = flip.new_squares - flip.old_squares + least;
        for _ in 0..self.rounds {
            for vertex in vertices {
                mover.relax(sheet, vertex);
            }
            let missing = self.saved.rise(sheet) + least;
            if missing < 0.0 {
                return true;
            }
            if GIVE_UP * before < missing {
                return false;
            }
            before = missing;
        }
        false
    }
}
