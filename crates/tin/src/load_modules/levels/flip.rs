//! Flips: the other diagonal of two triangles where it fits the ground better.

use terrain::geometry::orient;

use super::level_mesh::{LevelMesh, from_corner, place};
use super::posts::Posts;

/// Passes at most; hardly any mesh needs more than four.
const PASSES_MAX: usize = 10;
/// A flip has to gain more than one part in so many of the two triangles' squares: below it lies rounding.
const LEAST_GAIN: u128 = 10_000;

/// Flips edges until none gains, in passes over the triangles; returns the flips. Sides and edges of features stay.
pub(super) fn flip_all(sheet: &mut LevelMesh, posts: &Posts) -> usize {
    let mut total = 0;
    // Where neither triangle of an edge has changed since it was looked at, it would be found the same again.
    let mut active = vec![true; sheet.triangles.len()];
    for _ in 0..PASSES_MAX {
        let mut touched = vec![false; active.len()];
        let mut flips = 0;
        for t in 0..sheet.triangles.len() {
            for k in 0..3 {
                let Some(u) = beside(sheet, t, k) else { continue };
                let is_active = active[t] || active[u] || touched[t] || touched[u];
                if is_active && flip(sheet, (t as u32, k), u as u32, posts) {
                    (touched[t], touched[u]) = (true, true);
                    flips += 1;
                }
            }
        }
        total += flips;
        if flips == 0 {
            break;
        }
        active = touched;
    }
    total
}

/// The triangle beside the edge of triangle `t` from its corner `k` to the next, where its number is the higher one.
fn beside(sheet: &LevelMesh, t: usize, k: usize) -> Option<usize> {
    let triangle = sheet.triangles[t];
    let other = sheet.beside(t as u32, triangle[k], triangle[(k + 1) % 3]);
    other.map(|u| u as usize).filter(|&u| t < u)
}

/// Flips the edge of triangle `t` from its corner `k` to the next, beside which lies `u`, if that is valid and gains.
///
/// ```text
///        c                c
///       / \              /|\
///      / t \            / | \
///     a-----b    =>    a  |  b       t = a d c, u = d b c
///      \ u /            \ | /
///       \ /              \|/
///        d                d
/// ```
fn flip(sheet: &mut LevelMesh, (t, k): (u32, usize), u: u32, posts: &Posts) -> bool {
    let triangle = sheet.triangles[t as usize];
    let (a, b, c) = (triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
    // Beside the edge seen from its end: b, a, d.
    let d = from_corner(sheet.triangles[u as usize], b)[2];
    let before = sheet.squares[t as usize] + sheet.squares[u as usize];
    let (first, second) = ([a, d, c], [d, b, c]);
    if before == 0 || sheet.keeps(a, b) || !is_sound(sheet, first, posts) || !is_sound(sheet, second, posts) {
        return false;
    }
    let (of_first, of_second) = (posts.squares(sheet.corners(first)), posts.squares(sheet.corners(second)));
    let gains = (of_first + of_second) * LEAST_GAIN < before * (LEAST_GAIN - 1);
    if gains {
        sheet.replace(t, first, of_first);
        sheet.replace(u, second, of_second);
    }
    gains
}

/// Counter-clockwise, with a doubled area of a quarter of a square post.
fn is_sound(sheet: &LevelMesh, triangle: [u16; 3], posts: &Posts) -> bool {
    let [a, b, c] = sheet.corners(triangle).map(place);
    let area = orient(a, b, c);
    0 < area && posts.step() * posts.step() <= 4 * area
}
