//! Flips: the other diagonal of two triangles where it fits the ground better.

use geometry::orient;

use super::posts::Posts;
use super::sheet::{Sheet, from_corner, place};

/// Passes at most; hardly any mesh needs more than four.
const PASSES_MAX: usize = 10;
/// A flip has to gain more than one part in so many of the two triangles' squares: below it lies rounding.
const LEAST_GAIN: u128 = 10_000;

/// Flips edges until none gains, in passes over the triangles; gives the flips. Sides stay.
pub(super) fn flip_all(sheet: &mut Sheet, posts: &Posts) -> usize {
    let mut total = 0;
    for _ in 0..PASSES_MAX {
        let mut flips = 0;
        for triangle in 0..sheet.triangles.len() as u32 {
            for k in 0..3 {
                flips += usize::from(flip(sheet, triangle, k, posts));
            }
        }
        total += flips;
        if flips == 0 {
            break;
        }
    }
    total
}

/// Flips the edge of triangle `t` from its corner `k` to the next, if that is valid and gains.
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
fn flip(sheet: &mut Sheet, t: u32, k: usize, posts: &Posts) -> bool {
    let triangle = sheet.triangles[t as usize];
    let (a, b, c) = (triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
    let Some(u) = sheet.beside(t, a, b) else { return false };
    if u < t {
        return false;
    }
    // Beside the edge seen from its end: b, a, d.
    let d = from_corner(sheet.triangles[u as usize], b)[2];
    let before = sheet.squares[t as usize] + sheet.squares[u as usize];
    let (first, second) = ([a, d, c], [d, b, c]);
    if before == 0 || !is_sound(sheet, first, posts) || !is_sound(sheet, second, posts) {
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
fn is_sound(sheet: &Sheet, triangle: [u16; 3], posts: &Posts) -> bool {
    let [a, b, c] = sheet.corners(triangle).map(place);
    let area = orient(a, b, c);
    0 < area && posts.step() * posts.step() <= 4 * area
}
