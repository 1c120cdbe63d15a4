//! Flips: the other diagonal of two triangles, where it fits the ground better, needles counted as a misfit.

use crate::optimiser::form::{Form, squares};
use crate::optimiser::patch::Patch;
use crate::optimiser::place::{Place, is_needle};
use crate::optimiser::tile_mesh::{TileMesh, next, previous};

/// Passes at most; hardly any mesh needs more than six.
const PASSES_MAX: usize = 10;
/// Part of the two triangles' squares that a flip has to gain: below it lies rounding.
const LEAST_GAIN: f64 = 1e-4;
/// Part of a triangle's mean squares below which two triangles are left as they are.
const LEAST_SHARE: f64 = 0.02;
/// What a needle counts beside the squares, in parts of what half of all triangles have.
const NEEDLE: f64 = 0.5;

/// What flips are judged by, beside squares.
pub(crate) struct Scale {
    /// Squares of two triangles that are left as they are.
    least: f64,
    /// What a needle counts.
    pub needle: f64,
}

impl Scale {
    /// By mean squares of a triangle, and by their median: beside cliffs a few triangles have most of the squares, and
    /// a needle must not count for as much as water that is off its level.
    pub fn of(sheet: &TileMesh) -> Self {
        Self { least: LEAST_SHARE * sheet.mean_squares(), needle: NEEDLE * sheet.median_squares() }
    }
}

/// Flips edges near changed vertices, until none gains; marks as changed what it touches.
pub(crate) fn flip_all(sheet: &mut TileMesh) {
    let scale = Scale::of(sheet);
    flip_all_by(sheet, &scale);
}

/// The same, judged by some scale.
pub(crate) fn flip_all_by(sheet: &mut TileMesh, scale: &Scale) {
    let mut patch = Patch::default();
    let has_changed = |corner: u32| sheet.vertices.get(corner as usize).is_some_and(|vertex| vertex.has_changed);
    let mut active: Vec<bool> =
        sheet.triangles.iter().map(|triangle| triangle.corners.into_iter().any(has_changed)).collect();
    for _ in 0..PASSES_MAX {
        let mut touched = vec![false; active.len()];
        let mut has_flipped = false;
        for triangle in 0..sheet.triangles.len() as u32 {
            for k in 0..3 {
                let edge = 4 * triangle + k;
                if !sheet.is_live(triangle)
                    || !is_active(sheet, edge, &active)
                    || propose(sheet, edge, scale, limit_of_gain, &mut patch).is_none()
                {
                    continue;
                }
                patch.old.iter().for_each(|&triangle| touched[triangle as usize] = true);
                sheet.apply(&mut patch);
                has_flipped = true;
            }
        }
        if !has_flipped {
            break;
        }
        active = touched;
    }
}

/// Whether an inner edge, looked at from its lower side only, has an active triangle beside it.
#[inline(always)]
fn is_active(sheet: &TileMesh, edge: u32, active: &[bool]) -> bool {
    let twin = sheet.twin(edge);
    !sheet.is_upper_side(edge) && (active[(edge >> 2) as usize] || active[(twin >> 2) as usize])
}

/// Two triangles before and after a flip.
pub(crate) struct Flip {
    pub old_squares: f64,
    pub new_squares: f64,
    /// What the needles count for that come, less those that go.
    pub needles: f64,
}

impl Flip {
    /// Whether squares and needles count for less afterwards.
    pub fn is_gain(&self) -> bool {
        self.new_squares + self.needles < limit_of_gain(self.old_squares)
    }
}

/// What is left has to count for less than this to be a gain and not rounding.
fn limit_of_gain(old_squares: f64) -> f64 {
    old_squares * (1.0 - LEAST_GAIN)
}

/// Fills `patch` with the flip of an inner edge, if that is valid and what it leaves, needles included, counts for less
/// than `limit` says of the squares before.
#[inline(always)]
pub(crate) fn propose(
    sheet: &TileMesh,
    edge: u32,
    scale: &Scale,
    limit: impl Fn(f64) -> f64,
    patch: &mut Patch,
) -> Option<Flip> {
    let twin = sheet.twin(edge);
    let old = sheet.triangles[(edge >> 2) as usize].squares + sheet.triangles[(twin >> 2) as usize].squares;
    if old <= scale.least {
        return None;
    }
    let [a, b, c, d] = sheet.around_edge(edge);
    let (first, second) = ([a, d, c], [d, b, c]);
    let (at_first, at_second) = (sheet.places(first), sheet.places(second));
    if !sheet.is_sound(first) || !sheet.is_sound(second) || sheet.is_constrained(a, b) {
        return None;
    }
    let moments = &sheet.ground.moments;
    let diagonal = moments.edge(at_first[1], at_first[2]);
    let sums = diagonal + sheet.sums_of(next(twin)) + sheet.sums_of(previous(edge));
    let squares_first = squares(&sums, at_first, sheet.heights(first));
    let bound = limit(old);
    // Two needles may go.
    let most = bound + 2.0 * scale.needle;
    if most <= squares_first {
        return None;
    }
    let rest = sheet.sums_of(previous(twin)) + sheet.sums_of(next(edge)) - diagonal;
    let new = squares_first + squares(&rest, at_second, sheet.heights(second));
    if most <= new {
        return None;
    }
    let count = |triangles: [[Place; 3]; 2]| triangles.iter().filter(|&&[a, b, c]| is_needle(a, b, c)).count() as f64;
    let of_old = [[a, b, c], [a, d, b]].map(|corners| sheet.places(corners));
    let needles = scale.needle * (count([at_first, at_second]) - count(of_old));
    if bound <= new + needles {
        return None;
    }
    patch.clear();
    patch.old.extend([edge >> 2, twin >> 2]);
    patch.new.extend([(first, Form::new(&sums, at_first)), (second, Form::new(&rest, at_second))]);
    Some(Flip { old_squares: old, new_squares: new, needles })
}
