//! Fitting a few neighbouring heights at once, everything around them held.

use crate::optimiser::parts::NONE;
use crate::optimiser::patch::Patch;
use crate::optimiser::tile_mesh::{TileMesh, next, previous};

/// Heights fitted at once, at most.
pub(crate) const HEIGHTS_MAX: usize = 20;
/// Added to the diagonal, in posts: pulls towards the height a vertex has, so that triangles without posts leave it.
pub(crate) const DAMPING: f64 = 0.01;

/// The normal equations of one fit; kept, because clearing them would cost more than using them.
#[derive(Default)]
pub(crate) struct Fit {
    matrix: [[f64; HEIGHTS_MAX]; HEIGHTS_MAX],
    pull: [f64; HEIGHTS_MAX],
    /// The matrix's diagonal before it was factored.
    diagonal: [f64; HEIGHTS_MAX],
    /// For each vertex of the sheet its place among the unknowns, plus one.
    place: Vec<u8>,
}

impl Fit {
    /// Fits the heights of `patch.refit` as they will be after the patch; fills `patch.rise` and gives the squares
    /// gained. Too many heights are left alone.
    #[inline(always)]
    pub fn refit(&mut self, sheet: &TileMesh, patch: &mut Patch) -> f64 {
        patch.rise.clear();
        patch.rise.resize(patch.refit.len(), 0.0);
        if HEIGHTS_MAX < patch.refit.len() {
            return 0.0;
        }
        self.set_up(sheet, patch);
        self.factor(patch.refit.len());
        self.solve(&mut patch.rise);
        let stays = |(&vertex, &rise): (&u32, &f64)| bounded_rise(sheet, vertex, rise) == rise;
        if patch.refit.iter().zip(&patch.rise).all(stays) {
            return self.gain(&patch.rise, &[None; HEIGHTS_MAX]);
        }
        self.refit_bounded(sheet, patch)
    }

    /// Lets heights that would leave their bounds stop there, and fits the others anew, until none does.
    #[inline(never)]
    fn refit_bounded(&mut self, sheet: &TileMesh, patch: &mut Patch) -> f64 {
        let n = patch.refit.len();
        let mut stopped: [Option<f64>; HEIGHTS_MAX] = [None; HEIGHTS_MAX];
        let mut gain = 0.0;
        loop {
            let mut is_new = false;
            for (i, &vertex) in patch.refit.iter().enumerate() {
                let rise = bounded_rise(sheet, vertex, patch.rise[i]);
                if stopped[i].is_none() && rise != patch.rise[i] {
                    stopped[i] = Some(rise);
                    gain += self.substitute(i, n, rise);
                    is_new = true;
                }
            }
            if !is_new {
                return gain + self.gain(&patch.rise, &stopped);
            }
            self.restore(n);
            self.factor(n);
            self.solve(&mut patch.rise);
            let rises = patch.rise.iter_mut().zip(&stopped);
            rises.for_each(|(rise, stopped)| *rise = stopped.unwrap_or(*rise));
        }
    }

    /// Puts a rise that is known into the equations, so that solving them finds the others. Gives what it gains alone.
    fn substitute(&mut self, i: usize, n: usize, rise: f64) -> f64 {
        let gain = rise * (2.0 * self.pull[i] - (self.diagonal[i] - DAMPING) * rise);
        for j in 0..n {
            let coupling = &mut self.matrix[i.min(j)][i.max(j)];
            if j != i {
                self.pull[j] -= *coupling * rise;
                *coupling = 0.0;
            }
        }
        (self.diagonal[i], self.pull[i]) = (1.0, 0.0);
        gain
    }

    /// Undoes [`Fit::factor`], which leaves the upper half as it is.
    #[allow(clippy::needless_range_loop, reason = "the indices of a triangular system say more than iterators")]
    fn restore(&mut self, n: usize) {
        for i in 0..n {
            for j in 0..i {
                self.matrix[i][j] = self.matrix[j][i];
            }
            self.matrix[i][i] = self.diagonal[i];
        }
    }

    fn set_up(&mut self, sheet: &TileMesh, patch: &Patch) {
        let n = patch.refit.len();
        if self.place.len() < sheet.vertices.len() {
            self.place.resize(sheet.vertices.len(), 0);
        }
        for (i, &vertex) in patch.refit.iter().enumerate() {
            self.place[vertex as usize] = i as u8 + 1;
            self.matrix[i][..n].fill(0.0);
            self.matrix[i][i] = DAMPING;
            self.pull[i] = 0.0;
        }
        for (i, &vertex) in patch.refit.iter().enumerate() {
            self.add_around(sheet, patch, i, vertex);
        }
        for &(corners, ref form) in &patch.new {
            let heights = sheet.heights(corners);
            for k in 0..3 {
                if let Some(i) = self.place[corners[k] as usize].checked_sub(1) {
                    self.add(usize::from(i), k, corners, form, heights);
                }
            }
        }
        patch.refit.iter().for_each(|&vertex| self.place[vertex as usize] = 0);
    }

    /// Adds the triangles around unknown `i` that stay.
    #[inline(always)]
    fn add_around(&mut self, sheet: &TileMesh, patch: &Patch, i: usize, vertex: u32) {
        let entry = sheet.vertices[vertex as usize].edge;
        if entry == NONE {
            return;
        }
        let mut add = |edge: u32| {
            let triangle = edge >> 2;
            if !patch.old.contains(&triangle) {
                let corners = sheet.triangles[triangle as usize].corners;
                let form = &sheet.forms[triangle as usize];
                self.add(i, (edge & 3) as usize, corners, form, sheet.heights(corners));
            }
        };
        let mut edge = entry;
        loop {
            add(edge);
            let twin = sheet.twin(previous(edge));
            if twin == entry {
                return;
            }
            if twin == NONE {
                break;
            }
            edge = twin;
        }
        edge = entry;
        loop {
            let twin = sheet.twin(edge);
            if twin == NONE {
                return;
            }
            edge = next(twin);
            add(edge);
        }
    }

    /// Adds one triangle to the equation of unknown `i`, which is its corner `k`.
    #[inline(always)]
    fn add(&mut self, i: usize, k: usize, corners: [u32; 3], form: &crate::optimiser::form::Form, heights: [f64; 3]) {
        self.pull[i] += form.pull(k, heights);
        self.matrix[i][i] += form.aa[k];
        let (l, m) = ((k + 1) % 3, (k + 2) % 3);
        for (other, coupling) in [(l, form.ab[m]), (m, form.ab[l])] {
            if let Some(j) = self.place[corners[other] as usize].checked_sub(1) {
                self.matrix[i][usize::from(j)] += coupling;
            }
        }
    }

    /// Cholesky, in place, in the lower half.
    #[inline(always)]
    fn factor(&mut self, n: usize) {
        for j in 0..n {
            let mut pivot = self.matrix[j][j];
            self.diagonal[j] = pivot;
            for k in 0..j {
                pivot -= self.matrix[j][k] * self.matrix[j][k];
            }
            // Damping keeps it positive but for rounding.
            let pivot = pivot.max(1e-9).sqrt();
            self.matrix[j][j] = pivot;
            let reciprocal = 1.0 / pivot;
            for i in j + 1..n {
                let mut sum = self.matrix[i][j];
                for k in 0..j {
                    sum -= self.matrix[i][k] * self.matrix[j][k];
                }
                self.matrix[i][j] = sum * reciprocal;
            }
        }
    }

    /// Solves for the rises.
    #[allow(clippy::needless_range_loop, reason = "the indices of a triangular system say more than iterators")]
    #[inline(always)]
    fn solve(&self, rise: &mut [f64]) {
        let n = rise.len();
        for i in 0..n {
            let mut sum = self.pull[i];
            for k in 0..i {
                sum -= self.matrix[i][k] * rise[k];
            }
            rise[i] = sum / self.matrix[i][i];
        }
        for i in (0..n).rev() {
            let mut sum = rise[i];
            for k in i + 1..n {
                sum -= self.matrix[k][i] * rise[k];
            }
            rise[i] = sum / self.matrix[i][i];
        }
    }

    /// What solving has gained for those that did not stop.
    #[inline(always)]
    fn gain(&self, rise: &[f64], stopped: &[Option<f64>]) -> f64 {
        // h'(A + d)h = p'h at the solution, so the squares fall by p'h + d h'h.
        let gain = |i: usize| self.pull[i] * rise[i] + DAMPING * rise[i] * rise[i];
        (0..rise.len()).filter(|&i| stopped[i].is_none()).map(gain).sum()
    }
}

/// By how much a vertex may rise, of what it should.
#[inline(always)]
fn bounded_rise(sheet: &TileMesh, vertex: u32, rise: f64) -> f64 {
    let record = &sheet.vertices[vertex as usize];
    let wanted = record.height + rise;
    let bounded = sheet.ground.bounded(record.at, wanted);
    if bounded == wanted { rise } else { bounded - record.height }
}
