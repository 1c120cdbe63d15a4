//! Cuts triangles on the lattice at the borders of tiles.
//!
//! A triangle is cut into columns first, each column's piece into rows. Where an edge crosses a border, the crossing is
//! computed from the edge's ends in one order and rounded to the lattice; so every piece that has the edge, on either
//! side of it and of the border, has the same crossing.

use super::lattice::{Node, STEPS};

#[derive(Clone, Copy)]
enum Axis {
    X,
    Y,
}

impl Axis {
    fn of(self, node: &Node) -> i64 {
        match self {
            Axis::X => node.x,
            Axis::Y => node.y,
        }
    }
}

/// The part of a triangle in the tile of a column and a row: a polygon, counter-clockwise; empty where it has none.
pub(crate) fn piece(triangle: [Node; 3], col: i64, row: i64) -> Vec<Node> {
    let mut polygon = triangle.to_vec();
    for (axis, index) in [(Axis::X, col), (Axis::Y, row)] {
        polygon = beyond(&polygon, axis, index * STEPS, 1);
        polygon = beyond(&polygon, axis, (index + 1) * STEPS, -1);
    }
    polygon
}

/// The part of a polygon on the far side of a line (`towards` 1) or on its near side (-1), the line included.
fn beyond(polygon: &[Node], axis: Axis, line: i64, towards: i64) -> Vec<Node> {
    let depth = |node: &Node| (axis.of(node) - line) * towards;
    if polygon.iter().all(|node| 0 <= depth(node)) {
        return polygon.to_vec();
    }
    let mut part = Vec::with_capacity(polygon.len() + 1);
    for (place, node) in polygon.iter().enumerate() {
        let next = &polygon[(place + 1) % polygon.len()];
        if 0 <= depth(node) {
            part.push(*node);
        }
        if (depth(node) < 0 && 0 < depth(next)) || (0 < depth(node) && depth(next) < 0) {
            part.push(crossing(node, next, axis, line));
        }
    }
    // What only touches the line has no inside.
    if part.iter().any(|node| 0 < depth(node)) { part } else { Vec::new() }
}

/// Where the edge between two nodes crosses a line.
fn crossing(a: &Node, b: &Node, axis: Axis, line: i64) -> Node {
    let (a, b) = if (a.x, a.y) <= (b.x, b.y) { (a, b) } else { (b, a) };
    let share = (line - axis.of(a)) as f64 / (axis.of(b) - axis.of(a)) as f64;
    let between = |from: i64, to: i64| (from as f64 + share * (to - from) as f64).round() as i64;
    let (mut x, mut y) = (between(a.x, b.x), between(a.y, b.y));
    match axis {
        Axis::X => x = line,
        Axis::Y => y = line,
    }
    let normal = [0, 1, 2].map(|part| a.normal[part] + share * (b.normal[part] - a.normal[part]));
    Node { x, y, h: between(a.h, b.h), normal: crate::mesh::unit(normal) }
}

/// Doubled area of the triangle of three nodes; positive when counter-clockwise.
pub(crate) fn doubled_area(a: &Node, b: &Node, c: &Node) -> i64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(x: i64, y: i64, h: i64) -> Node {
        Node { x, y, h, normal: [0.0, 0.0, 1.0] }
    }

    fn area(polygon: &[Node]) -> i64 {
        (1..polygon.len().saturating_sub(1)).map(|i| doubled_area(&polygon[0], &polygon[i], &polygon[i + 1])).sum()
    }

    #[test]
    fn pieces_cover_the_triangle_and_agree_on_their_borders() {
        let triangle = [node(-20_000, -9_001, 10), node(70_003, 5_007, 900), node(11, 66_000, 77)];
        let pieces: Vec<Vec<Node>> =
            (-1..=2).flat_map(|col| (-1..=2).map(move |row| piece(triangle, col, row))).collect();
        let whole = doubled_area(&triangle[0], &triangle[1], &triangle[2]);
        let sum: i64 = pieces.iter().map(|polygon| area(polygon)).sum();
        // Crossings are rounded, so a little moves across the triangle's own edges.
        assert!((sum - whole).abs() < 400_000, "{sum} {whole}");
        // Every place on a border is in the pieces on both sides of it, with one height.
        let on_border = |n: &Node| (n.x % STEPS == 0) != (n.y % STEPS == 0);
        for polygon in &pieces {
            for found in polygon.iter().filter(|n| on_border(n)) {
                let same = pieces.iter().flatten().filter(|n| (n.x, n.y) == (found.x, found.y));
                let heights: Vec<i64> = same.map(|n| n.h).collect();
                assert!(1 < heights.len() && heights.iter().all(|h| *h == found.h), "{found:?} {heights:?}");
            }
        }
        assert!(piece(triangle, 5, 5).is_empty());
    }
}
