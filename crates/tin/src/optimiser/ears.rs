//! Filling a hole whatever its shape: for a vertex that has to go because a limit leaves no choice.

use crate::optimiser::form::Form;
use crate::optimiser::patch::Patch;
use crate::optimiser::place::Place;
use crate::optimiser::tile_mesh::TileMesh;

/// Appends triangles that fill a simple counter-clockwise polygon, the best formed first; `false` where the polygon is
/// not simple. Every simple polygon has two ears, so one is always found.
pub(crate) fn fill_by_ears(sheet: &TileMesh, polygon: &[u32], patch: &mut Patch) -> bool {
    let mut left = polygon.to_vec();
    while 3 <= left.len() {
        let ears = (0..left.len()).filter_map(|i| Some((form_of_ear(sheet, &left, i)?, i)));
        let Some((_, ear)) = ears.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))) else { return false };
        let corners = corners_of(&left, ear);
        let places = sheet.places(corners);
        let edge = |i: usize| sheet.ground.moments.edge(places[i], places[(i + 1) % 3]);
        patch.new.push((corners, Form::new(&(edge(0) + edge(1) + edge(2)), places)));
        left.remove(ear);
    }
    true
}

fn corners_of(polygon: &[u32], i: usize) -> [u32; 3] {
    let n = polygon.len();
    [polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]]
}

/// Area by the square of the longest side, where corner `i` with its neighbours is a triangle that holds no other
/// corner.
fn form_of_ear(sheet: &TileMesh, polygon: &[u32], i: usize) -> Option<f64> {
    let corners = corners_of(polygon, i);
    let [a, b, c] = sheet.places(corners);
    let area = Place::orient(a, b, c);
    let holds =
        |at: Place| 0 <= Place::orient(a, b, at) && 0 <= Place::orient(b, c, at) && 0 <= Place::orient(c, a, at);
    let is_free = || polygon.iter().filter(|v| !corners.contains(v)).all(|&v| !holds(sheet.at(v)));
    let longest = a.squared_distance(b).max(b.squared_distance(c)).max(c.squared_distance(a));
    (0 < area && is_free()).then_some(area as f64 / longest as f64)
}
