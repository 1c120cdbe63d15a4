//! Flips: the other diagonal of two triangles, where it fits the ground better.

use crate::form::{Form, squares};
use crate::patch::Patch;
use crate::place::{Place, Shape};
use crate::tile_mesh::{TileMesh, next, previous};

/// Passes at most; hardly any mesh needs more than six.
const PASSES_MAX: usize = 10;
/// Part of the two triangles' squares that a flip has to gain: below it lies rounding.
const LEAST_GAIN: f64 = 1e-4;
/// Part of a triangle's mean squares below which two triangles are left as they are.
pub(crate) const LEAST_SHARE: f64 = 0.02;

/// Flips edges near changed vertices, until none gains; marks as changed what it touches.
pub(crate) fn flip_all(sheet: &mut TileMesh) {
    let mut patch = Patch::default();
    let least = LEAST_SHARE * sheet.mean_squares();
    let has_changed = |corner: u32| sheet.vertices.get(corner as usize).is_some_and(|vertex| vertex.has_changed);
    let mut active: Vec<bool> =
        sheet.triangles.iter().map(|triangle| triangle.corners.into_iter().any(has_changed)).collect();
    for _ in 0..PASSES_MAX {
        let mut touched = vec![false; active.len()];
        let mut has_flipped = false;
        for triangle in 0..sheet.triangles.len() as u32 {
            for k in 0..3 {
                let edge = 4 * triangle + k;
                let limit = |old: f64| old * (1.0 - LEAST_GAIN);
                if !sheet.is_live(triangle)
                    || !is_active(sheet, edge, &active)
                    || propose(sheet, edge, least, limit, &mut patch).is_none()
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

/// Whether squares have fallen by more than rounding.
pub(crate) fn is_gain(old: f64, new: f64) -> bool {
    new < old * (1.0 - LEAST_GAIN)
}

/// Whether an inner edge, looked at from its lower side only, has an active triangle beside it.
#[inline(always)]
fn is_active(sheet: &TileMesh, edge: u32, active: &[bool]) -> bool {
    let twin = sheet.twin(edge);
    !sheet.is_upper_side(edge) && (active[(edge >> 2) as usize] || active[(twin >> 2) as usize])
}

/// Fills `patch` with the flip of an inner edge, if that is valid and leaves less squares than `limit` says of those
/// before. Gives the squares of the two triangles before and after; two of `least` or less are left as they are.
#[inline(always)]
pub(crate) fn propose(
    sheet: &TileMesh,
    edge: u32,
    least: f64,
    limit: impl Fn(f64) -> f64,
    patch: &mut Patch,
) -> Option<(f64, f64)> {
    let twin = sheet.twin(edge);
    let old = sheet.triangles[(edge >> 2) as usize].squares + sheet.triangles[(twin >> 2) as usize].squares;
    if old <= least {
        return None;
    }
    let [a, b, c, d] = sheet.around_edge(edge);
    let (first, second) = ([a, d, c], [d, b, c]);
    let (at_first, at_second) = (sheet.places(first), sheet.places(second));
    let is_sound = |corners: [u32; 3], [a, b, c]: [Place; 3]| Shape::Sound.admits(a, b, c) || sheet.is_eased(corners);
    if !is_sound(first, at_first) || !is_sound(second, at_second) || sheet.is_constrained(a, b) {
        return None;
    }
    let moments = &sheet.ground.moments;
    let diagonal = moments.edge(at_first[1], at_first[2]);
    let sums = diagonal + sheet.sums_of(next(twin)) + sheet.sums_of(previous(edge));
    let squares_first = squares(&sums, at_first, sheet.heights(first));
    let bound = limit(old);
    if bound <= squares_first {
        return None;
    }
    let rest = sheet.sums_of(previous(twin)) + sheet.sums_of(next(edge)) - diagonal;
    let new = squares_first + squares(&rest, at_second, sheet.heights(second));
    if bound <= new {
        return None;
    }
    patch.clear();
    patch.old.extend([edge >> 2, twin >> 2]);
    patch.new.extend([(first, Form::new(&sums, at_first)), (second, Form::new(&rest, at_second))]);
    Some((old, new))
}
