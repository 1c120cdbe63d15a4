//! Cuts triangles on the lattice at the borders of tiles, and mends those that rounding turned flat or clockwise.
//!
//! A triangle is cut into columns first, each column's piece into rows. Where an edge crosses a border, the crossing is
//! computed from the edge's ends in one order and rounded to the lattice; so every piece that has the edge, on either
//! side of it and of the border, has the same crossing.
//!
//! Leaving out a triangle that rounding turned would open a hole: its middle corner would stand beside the long edge,
//! which a neighbour goes on having. So the long edge is turned instead: the neighbour takes the middle corner in.

use std::collections::{HashMap, HashSet};

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

/// What a triangle becomes that is none any more.
pub(crate) const GONE: [u32; 3] = [0; 3];

/// Makes the lowest of the nodes at one place the corner of all triangles there; those with two corners there are gone.
pub(crate) fn weld(nodes: &[Node], triangles: &mut [[u32; 3]]) {
    let mut lowest: HashMap<(i64, i64), u32> = HashMap::with_capacity(nodes.len());
    for (v, node) in (0..).zip(nodes) {
        let before = lowest.entry((node.x, node.y)).or_insert(v);
        if node.h < nodes[*before as usize].h {
            *before = v;
        }
    }
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| lowest[&(nodes[v as usize].x, nodes[v as usize].y)]);
        *triangle = if a == b || b == c || c == a { GONE } else { [a, b, c] };
    }
}

/// Turns edges until all triangles are counter-clockwise, so far as they can be; corners lie at different places. No
/// edge loses a triangle: what is left flat or clockwise stays, and two that cancel each other go together.
pub(crate) fn right(nodes: &[Node], triangles: &mut [[u32; 3]]) {
    /// More than slivers beside slivers need, one after the other.
    const ROUNDS: usize = 64;
    let node = |v: u32| &nodes[v as usize];
    let area = |&[a, b, c]: &[u32; 3]| doubled_area(node(a), node(b), node(c));
    let squared = |a: u32, b: u32| (node(a).x - node(b).x).pow(2) + (node(a).y - node(b).y).pow(2);
    let edges = |[a, b, c]: [u32; 3]| [[a, b, c], [b, c, a], [c, a, b]];
    // The long edge from c to a, and b.
    let long_of = |sliver: [u32; 3]| edges(sliver).into_iter().max_by_key(|&[c, a, _]| squared(c, a)).unwrap_or(sliver);
    for _ in 0..ROUNDS {
        let is_sliver = |triangle: &[u32; 3]| *triangle != GONE && area(triangle) <= 0;
        let slivers: Vec<usize> = (0..triangles.len()).filter(|&index| is_sliver(&triangles[index])).collect();
        let wanted: HashSet<[u32; 2]> =
            slivers.iter().map(|&index| long_of(triangles[index])).map(|[c, a, _]| [a, c]).collect();
        let mut beyond = HashMap::new();
        for (index, &triangle) in triangles.iter().enumerate().filter(|_| !wanted.is_empty()) {
            let found = edges(triangle).into_iter().filter(|&[a, c, _]| wanted.contains(&[a, c]));
            beyond.extend(found.map(|[a, c, _]| ([a, c], index)));
        }
        let mut is_changed = false;
        for index in slivers {
            let [c, a, b] = long_of(triangles[index]);
            let Some(&neighbour) = beyond.get(&[a, c]) else { continue };
            // Another may have turned it before, in this round.
            let Some([.., d]) = edges(triangles[neighbour]).into_iter().find(|edge| edge[..2] == [a, c]) else {
                continue;
            };
            let turned = if d == b { [GONE; 2] } else { [[a, b, d], [b, c, d]] };
            let least = |pair: [[u32; 3]; 2]| pair.iter().map(area).min();
            let (before, after) = (least([triangles[index], triangles[neighbour]]), least(turned));
            if is_sliver(&triangles[index]) && (before < after || before == after && squared(b, d) < squared(a, c)) {
                [triangles[index], triangles[neighbour]] = turned;
                is_changed = true;
            }
        }
        if !is_changed {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;
    use crate::quantized::Tile;
    use crate::quantized::lattice::STEPS;

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

    /// Triangles over two by two tiles and those around them, with edges along the lines between these, and many
    /// thinner than the lattice.
    fn slivers(draw: &mut Rng) -> (Vec<Node>, Vec<[u32; 3]>) {
        let square = |at: u32| [at % 5, at / 5].map(|index| (f64::from(index) - 1.0) * STEPS as f64);
        let mut places: Vec<[f64; 2]> = (0..25).map(square).collect();
        let corners = (0..20).filter(|at| at % 5 != 4);
        let mut triangles: Vec<[u32; 3]> =
            corners.flat_map(|at| [[at, at + 1, at + 6], [at, at + 6, at + 5]]).collect();
        for _ in 0..draw.usize(1..60) {
            let index = draw.usize(..triangles.len());
            let [a, b, c] = triangles[index];
            // Beside an edge, or anywhere inside.
            let thin = [1e-9, 1e-6, 1e-5, 1e-4, 0.5][draw.usize(..5)] * draw.f64();
            let along = draw.f64();
            let shares = [(1.0 - thin) * along, (1.0 - thin) * (1.0 - along), thin];
            let middle =
                |axis: usize| [a, b, c].iter().zip(shares).map(|(&v, share)| share * places[v as usize][axis]).sum();
            places.push([middle(0), middle(1)]);
            let new = places.len() as u32 - 1;
            triangles[index] = [a, b, new];
            triangles.extend([[b, c, new], [c, a, new]]);
        }
        let node = |[x, y]: [f64; 2]| Node {
            x: x.round() as i64,
            y: y.round() as i64,
            h: draw.i64(0..100_000),
            normal: [0.0, 0.0, 1.0],
        };
        (places.into_iter().map(node).collect(), triangles)
    }

    #[test]
    fn tiles_of_slivers_have_no_torn_edge_and_agree_on_their_borders() {
        let mut draw = Rng::with_seed(3);
        let (mut thin, mut left, mut agreed) = (0, 0, 0);
        for case in 0..500 {
            let (nodes, mut triangles) = slivers(&mut draw);
            let corners = |triangle: &[u32; 3]| triangle.map(|v| nodes[v as usize]);
            let is_thin = |[a, b, c]: &[Node; 3]| doubled_area(a, b, c) <= 0;
            thin += triangles.iter().map(corners).filter(is_thin).count();
            weld(&nodes, &mut triangles);
            right(&nodes, &mut triangles);
            let is_inside = |node: &Node| (0..2 * STEPS).contains(&node.x) && (0..2 * STEPS).contains(&node.y);
            let mut inside = triangles.iter().filter(|triangle| **triangle != GONE).map(corners);
            let is_right = !inside.any(|triangle| is_thin(&triangle) && triangle.iter().any(is_inside));
            let tiles = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[col, row]| {
                let mut tile = Tile::new(8, col, row);
                triangles.iter().for_each(|triangle| tile.add(&piece(corners(triangle), col, row)));
                tile.close();
                assert_eq!((tile.torn(), tile.covered()), (0, 1.0), "{case}: {col} {row}");
                left += tile.areas().filter(|&area| area <= 0).count();
                tile
            });
            // Slivers beside slivers beside slivers may stay, and a corner of theirs on one side of a line.
            if !is_right {
                continue;
            }
            agreed += 1;
            for (one, other, [mine, theirs]) in [(0, 1, [2, 0]), (2, 3, [2, 0]), (0, 2, [3, 1]), (1, 3, [3, 1])] {
                let [one, other] = [(one, mine), (other, theirs)].map(|(tile, side)| {
                    let placed = tiles[tile].placed();
                    let node = |&v: &u32| placed.nodes[v as usize];
                    tiles[tile].edges()[side].iter().map(|v| (node(v).x, node(v).y, node(v).h)).collect::<Vec<_>>()
                });
                assert_eq!(one, other, "{case}");
            }
        }
        assert!(3000 < thin && 10 * left < thin && 250 < agreed, "{left} of {thin}, {agreed}");
    }
}
