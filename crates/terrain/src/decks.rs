//! What holds of decks of bridges: triangles that hang above the ground of a load module and are no part of it.

use crate::{Decks, HOLE_CLASS, ModuleVertex};

/// Walks every invariant of decks in a square of `side` quanta: lengths, order, places, orientation, classes. They
/// need not cover the square, and may lie above each other.
///
/// # Errors
/// The first fault found, in words.
pub fn check_decks(decks: &Decks, side: u16) -> Result<(), String> {
    let most = usize::from(u16::MAX);
    let is_numbered = decks.vertices.len() <= most && decks.triangles.len() <= 2 * most;
    if decks.classes.len() != decks.triangles.len() || !is_numbered {
        return Err("lists that belong together differ in length, or are too long".into());
    }
    if let Some(vertex) = decks.vertices.iter().position(|v| side < v.x || side < v.y) {
        return Err(format!("vertex {vertex} lies beyond a side"));
    }
    let is_ascending = decks.vertices.is_sorted_by(|a, b| a < b) && decks.triangles.is_sorted_by(|a, b| a < b);
    if !is_ascending || !decks.triangles.iter().all(|t| t[0] < t[1] && t[0] < t[2]) {
        return Err("vertices or triangles are out of order, or listed twice".into());
    }
    let mut is_used = vec![false; decks.vertices.len()];
    for (index, &triangle) in decks.triangles.iter().enumerate() {
        if triangle.iter().any(|&v| decks.vertices.len() <= usize::from(v)) {
            return Err(format!("triangle {index} names a vertex that is not there"));
        }
        if doubled_area(&decks.vertices, triangle) <= 0 {
            return Err(format!("triangle {index} is clockwise or upright"));
        }
        triangle.iter().for_each(|&v| is_used[usize::from(v)] = true);
    }
    if let Some(vertex) = is_used.iter().position(|is_used| !is_used) {
        return Err(format!("vertex {vertex} is the corner of no triangle"));
    }
    let hole = decks.classes.iter().position(|&class| class == HOLE_CLASS);
    hole.map_or(Ok(()), |triangle| Err(format!("triangle {triangle} has the class of holes")))
}

/// Doubled area of a triangle seen from above, in squared quanta; positive when counter-clockwise.
pub(crate) fn doubled_area(vertices: &[ModuleVertex], triangle: [u16; 3]) -> i64 {
    let [a, b, c] = triangle.map(|v| vertices[usize::from(v)]);
    let (bx, by) = (i64::from(b.x) - i64::from(a.x), i64::from(b.y) - i64::from(a.y));
    let (cx, cy) = (i64::from(c.x) - i64::from(a.x), i64::from(c.y) - i64::from(a.y));
    bx * cy - by * cx
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: u16 = 64_000;

    fn vertex(x: u16, y: u16, z: i32) -> ModuleVertex {
        ModuleVertex { y, x, z }
    }

    /// Two bridges that cross, 5 m above each other, over the same four places.
    fn crossing() -> Decks {
        let square = |z| [vertex(0, 0, z), vertex(100, 0, z), vertex(100, 100, z), vertex(0, 100, z)];
        let halves = |[a, b, c, d]: [ModuleVertex; 4], class| [([c, a, b], class), ([d, a, c], class)];
        Decks::of_triangles(halves(square(640), 3).into_iter().chain(halves(square(0), 2)))
    }

    #[test]
    fn decks_from_triangles_in_any_order_are_sound_and_equal() {
        let decks = crossing();
        assert_eq!(check_decks(&decks, SIDE), Ok(()));
        assert_eq!((decks.vertices.len(), decks.classes.clone()), (8, vec![2, 2, 3, 3]));
        let corners = |triangle: &[u16; 3]| triangle.map(|v| decks.vertices[usize::from(v)]);
        let soup = decks.triangles.iter().map(corners).zip(decks.classes.iter().copied());
        let turned = soup.map(|([a, b, c], class)| ([b, c, a], class)).rev();
        let twice: Vec<_> = turned.clone().chain(turned).collect();
        assert_eq!(Decks::of_triangles(twice), decks);
        assert!(Decks::of_triangles([]).is_empty() && check_decks(&Decks::default(), SIDE) == Ok(()));
    }

    #[track_caller]
    fn check_fault(damage: impl FnOnce(&mut Decks), expected: &str) {
        let mut decks = crossing();
        damage(&mut decks);
        assert_eq!(check_decks(&decks, SIDE), Err(expected.into()));
    }

    #[test]
    fn faults_of_decks_are_told_apart() {
        let out_of_order = "vertices or triangles are out of order, or listed twice";
        check_fault(|decks| decks.classes.truncate(3), "lists that belong together differ in length, or are too long");
        check_fault(|decks| decks.vertices[7].y = SIDE + 1, "vertex 7 lies beyond a side");
        check_fault(|decks| decks.vertices.push(vertex(0, 101, 0)), "vertex 8 is the corner of no triangle");
        check_fault(|decks| decks.vertices[0].z = decks.vertices[1].z, out_of_order);
        check_fault(|decks| decks.triangles.swap(0, 1), out_of_order);
        check_fault(|decks| decks.triangles[0].rotate_left(1), out_of_order);
        check_fault(|decks| decks.triangles[3][2] = 8, "triangle 3 names a vertex that is not there");
        check_fault(|decks| decks.triangles[0].swap(1, 2), "triangle 0 is clockwise or upright");
        check_fault(|decks| decks.classes[2] = HOLE_CLASS, "triangle 2 has the class of holes");
    }

    #[test]
    fn an_upright_triangle_is_no_deck() {
        let wall = [vertex(0, 0, 0), vertex(9, 0, 0), vertex(9, 0, 5)];
        assert_eq!(
            check_decks(&Decks::of_triangles([(wall, 0)]), SIDE),
            Err("triangle 0 is clockwise or upright".into())
        );
    }
}
