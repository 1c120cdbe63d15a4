//! Decks of bridges, cut at the lines between load modules.

use std::collections::BTreeMap;

use terrain::{Decks, FeatureSurface, LatticePoint, ModuleVertex};

use crate::load_modules::Layout;

/// Triangles that lifting may add in a load module at most: six corners, each of two.
pub const SPARE_MAX: usize = 12;

/// Quanta north and east together from which an edge has a corner in its middle: 4 m.
const MIDDLE_MIN: i64 = 4 * 128;

/// A corner in quanta from the area's south-west post.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Corner {
    x: i64,
    y: i64,
    z: i64,
}

/// The decks in each load module of a tile, row by row: polygons above the ground, told apart into triangles and cut at
/// the squares' sides. What two load modules have on the line between them is the same.
///
/// Places of `decks` are in steps of a lattice of so many steps between posts. With the decks of each load module goes
/// how many triangles they may have when they are lifted: limits are held against one for each corner of polygons that
/// reach into it.
pub fn cut_decks(decks: &[FeatureSurface], steps_per_post: i32, layout: &Layout) -> Vec<(Decks, usize)> {
    let step = i64::from(layout.spacing.quanta_per_post() / steps_per_post);
    let side = layout.grid.side_cells * steps_per_post;
    let mut pieces = vec![Vec::new(); layout.modules.count()];
    let mut corners = vec![0; layout.modules.count()];
    for deck in decks {
        let span = |of: fn(&LatticePoint) -> i32| {
            let all = || deck.ring.iter().map(|vertex| of(&vertex.at).div_euclid(side));
            all().min().unwrap_or(0)..=all().max().unwrap_or(-1)
        };
        for row in span(|at| at.row) {
            let slots = span(|at| at.col).filter_map(|col| layout.slot(row, col));
            slots.for_each(|slot| corners[slot] += deck.ring.len());
        }
        let mut at_corners = BTreeMap::new();
        let places: Vec<LatticePoint> = deck.ring.iter().map(|vertex| vertex.at).collect();
        for triangle in ears(&places) {
            let corners = triangle.map(|corner| {
                let vertex = deck.ring[corner];
                Corner {
                    x: i64::from(vertex.at.col) * step,
                    y: i64::from(vertex.at.row) * step,
                    z: i64::from(vertex.height),
                }
            });
            cut(corners, deck.class, (layout, &mut at_corners), &mut pieces);
        }
    }
    let most = |(decks, corners): (Decks, usize)| {
        let most = decks.triangles.len().max(corners.min(decks.triangles.len() + SPARE_MAX));
        (decks, most)
    };
    pieces.into_iter().map(Decks::of_triangles).zip(corners).map(most).collect()
}

/// Triangles of a simple ring by places in it, counter-clockwise, whichever way it runs; an ear at a time. What is left
/// of a ring that is not simple is left out.
fn ears(ring: &[LatticePoint]) -> Vec<[usize; 3]> {
    let cross = |a: usize, b: usize, c: usize| terrain::geometry::orient(ring[a], ring[b], ring[c]);
    let area: i64 = (1..ring.len().saturating_sub(1)).map(|corner| cross(0, corner, corner + 1)).sum();
    let mut left: Vec<usize> = (0..ring.len()).collect();
    if area < 0 {
        left.reverse();
    }
    let mut triangles = Vec::with_capacity(ring.len().saturating_sub(2));
    while 3 <= left.len() {
        let at = |corner: usize| left[corner % left.len()];
        let is_ear = |corner: &usize| {
            let [a, b, c] = [at(corner + left.len() - 1), at(*corner), at(corner + 1)];
            let holds = |p: usize| 0 <= cross(a, b, p) && 0 <= cross(b, c, p) && 0 <= cross(c, a, p);
            let is_free = left.iter().all(|&p| [a, b, c].contains(&p) || !holds(p));
            cross(a, b, c) == 0 || (0 < cross(a, b, c) && is_free)
        };
        let Some(ear) = (0..left.len()).find(is_ear) else { break };
        let triangle = [at(ear + left.len() - 1), at(ear), at(ear + 1)];
        if cross(triangle[0], triangle[1], triangle[2]) != 0 {
            triangles.push(triangle);
        }
        left.remove(ear);
    }
    triangles
}

/// Cuts a triangle of a deck into the squares of load modules it lies in, those of other tiles with them: `at_corners`
/// has the height of the deck where four squares meet, which its first triangle there decides for all.
fn cut(
    corners: [Corner; 3],
    class: u8,
    (layout, at_corners): (&Layout, &mut BTreeMap<[i64; 2], i64>),
    pieces: &mut [Vec<([ModuleVertex; 3], u8)>],
) {
    let side = i64::from(layout.side());
    let span = |of: fn(&Corner) -> i64| {
        let low = corners.iter().map(of).min().unwrap_or(0).div_euclid(side);
        let high = corners.iter().map(of).max().unwrap_or(0);
        (low, high.div_euclid(side) - i64::from(high.rem_euclid(side) == 0))
    };
    let ((south, north), (west, east)) = (span(|corner| corner.y), span(|corner| corner.x));
    for row in south..=north {
        for col in west..=east {
            let slot = layout.slot(row as i32, col as i32);
            let [west, south] = [col * side, row * side];
            let mut polygon = corners.to_vec();
            let lines = [
                (Axis::X, west, true),
                (Axis::X, west + side, false),
                (Axis::Y, south, true),
                (Axis::Y, south + side, false),
            ];
            for (axis, line, keep_above) in lines {
                polygon = kept(&polygon, axis, line, keep_above);
            }
            let lines = lines.map(|(axis, line, _)| (axis, line));
            polygon.iter_mut().for_each(|corner| *corner = shared(*corner, corners, lines, at_corners));
            polygon.dedup();
            let on_sides = |corner: &Corner| {
                [corner.x == west, corner.x == west + side, corner.y == south, corner.y == south + side]
            };
            let polygon = with_middles(&polygon, &on_sides);
            let local = |corner: Corner| ModuleVertex {
                y: (corner.y - south) as u16,
                x: (corner.x - west) as u16,
                z: corner.z as i32,
            };
            for pair in polygon.windows(2).skip(1) {
                let triangle = [polygon[0], pair[0], pair[1]];
                let [a, b, c] = triangle;
                let is_turned = 0 < (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
                if let Some(slot) = slot.filter(|_| is_turned) {
                    pieces[slot].push((triangle.map(local), class));
                }
            }
        }
    }
}

/// A corner of a piece of a triangle as all pieces there have it: on a line from the edge that crosses it alone, since
/// one that was cut before crosses elsewhere by a rounding; where lines meet at one height.
fn shared(
    corner: Corner,
    triangle: [Corner; 3],
    lines: [(Axis, i64); 4],
    at_corners: &mut BTreeMap<[i64; 2], i64>,
) -> Corner {
    if triangle.contains(&corner) {
        return corner;
    }
    let on: Vec<(Axis, i64)> = lines.into_iter().filter(|(axis, line)| axis.of(corner) == *line).collect();
    match on[..] {
        [(axis, line)] => {
            let [a, b, c] = triangle;
            let crosses = |(a, b): &(Corner, Corner)| {
                let [a, b] = [*a, *b].map(|end| axis.of(end));
                a.min(b) < line && line < a.max(b)
            };
            let crossings = [(a, b), (b, c), (c, a)].into_iter().filter(crosses);
            let off = |at: &Corner| (at.x - corner.x).abs() + (at.y - corner.y).abs() + (at.z - corner.z).abs();
            crossings.map(|(a, b)| crossing(a, b, axis, line)).min_by_key(off).unwrap_or(corner)
        }
        [_, _] => {
            let z = *at_corners.entry([corner.x, corner.y]).or_insert_with(|| height_at(triangle, corner));
            Corner { z, ..corner }
        }
        _ => corner,
    }
}

/// The height of a triangle's plane at a place.
fn height_at([a, b, c]: [Corner; 3], place: Corner) -> i64 {
    let cross = |from: Corner, to: Corner, at: Corner| {
        i128::from((to.x - from.x) * (at.y - from.y)) - i128::from((to.y - from.y) * (at.x - from.x))
    };
    let (of_b, of_c, whole) = (cross(place, c, a), cross(a, b, place), cross(a, b, c));
    let rise = of_b * i128::from(b.z - a.z) + of_c * i128::from(c.z - a.z);
    a.z + (2 * rise + whole).div_euclid(2 * whole) as i64
}

/// A polygon with a corner in the middle of every long edge from one side of the load module to another, so that decks
/// can be raised between them; one of these comes first, if there are any.
fn with_middles(polygon: &[Corner], on_sides: &dyn Fn(&Corner) -> [bool; 4]) -> Vec<Corner> {
    let mut all = Vec::with_capacity(2 * polygon.len());
    let mut first = 0;
    for (at, corner) in polygon.iter().enumerate() {
        let next = &polygon[(at + 1) % polygon.len()];
        let [here, there] = [corner, next].map(on_sides);
        let is_across = here.contains(&true) && there.contains(&true) && (0..4).all(|side| !here[side] || !there[side]);
        all.push(*corner);
        if is_across && MIDDLE_MIN <= (corner.x - next.x).abs() + (corner.y - next.y).abs() {
            let middle = |of: fn(&Corner) -> i64| (of(corner) + of(next)).div_euclid(2);
            first = all.len();
            all.push(Corner { x: middle(|at| at.x), y: middle(|at| at.y), z: middle(|at| at.z) });
        }
    }
    all.rotate_left(first);
    all
}

#[derive(Clone, Copy)]
enum Axis {
    X,
    Y,
}

impl Axis {
    fn of(self, corner: Corner) -> i64 {
        match self {
            Axis::X => corner.x,
            Axis::Y => corner.y,
        }
    }
}

/// What of a convex polygon lies on one side of a line.
fn kept(polygon: &[Corner], axis: Axis, line: i64, keep_above: bool) -> Vec<Corner> {
    let is_kept = |corner: Corner| if keep_above { line <= axis.of(corner) } else { axis.of(corner) <= line };
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (at, &corner) in polygon.iter().enumerate() {
        let next = polygon[(at + 1) % polygon.len()];
        if is_kept(corner) {
            kept.push(corner);
        }
        let [here, there] = [axis.of(corner), axis.of(next)];
        if (here < line && line < there) || (there < line && line < here) {
            kept.push(crossing(corner, next, axis, line));
        }
    }
    kept
}

/// Where an edge crosses a line, from its ends alone, whichever way it runs.
fn crossing(a: Corner, b: Corner, axis: Axis, line: i64) -> Corner {
    let (a, b) = (a.min(b), a.max(b));
    let (along, whole) = (line - axis.of(a), axis.of(b) - axis.of(a));
    let between = |from: i64, to: i64| from + (2 * (to - from) * along + whole).div_euclid(2 * whole);
    let z = between(a.z, b.z);
    match axis {
        Axis::X => Corner { x: line, y: between(a.y, b.y), z },
        Axis::Y => Corner { x: between(a.x, b.x), y: line, z },
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use terrain::{ModuleGrid, Spacing, SurfaceGround, Vertex};

    fn layout() -> Layout {
        let grid = ModuleGrid { rows: 2, cols: 3, side_cells: 20 };
        Layout { grid, modules: grid.all(), spacing: Spacing::from_metres(25.0).unwrap() }
    }

    /// A ring of (row, column, height) in 64ths of a post.
    fn deck(ring: &[(i32, i32, i32)]) -> FeatureSurface {
        let ring = ring.iter().map(|&(row, col, height)| Vertex { at: LatticePoint::new(row, col), height }).collect();
        FeatureSurface { class: 5, ground: SurfaceGround::Road, body: 0, ring }
    }

    fn cut_alone(deck: FeatureSurface) -> Vec<Decks> {
        cut_decks(&[deck], 64, &layout()).into_iter().map(|(decks, _)| decks).collect()
    }

    #[test]
    fn where_four_load_modules_meet_a_deck_has_one_height_whatever_triangle_lies_there() {
        let (side, line) = (layout().side(), 20 * 64);
        for shift in 0..40 {
            // Its two triangles meet close to the corner, at heights that are no plane.
            let ring = [
                (line - 97, line - 301 + shift, 0),
                (line - 83, line + 299, 77),
                (line + 101, line + 303, 1),
                (line + 89, line - 298, 90),
            ];
            let cut = cut_alone(deck(&ring));
            let at = |index: usize, x: u16, y: u16| -> BTreeSet<i32> {
                cut[index].vertices.iter().filter(|v| (v.x, v.y) == (x, y)).map(|v| v.z).collect()
            };
            let heights = [at(0, side, side), at(1, 0, side), at(3, side, 0), at(4, 0, 0)];
            assert!(heights.iter().all(|of| of.len() == 1 && *of == heights[0]), "{shift}: {heights:?}");
            let along = |index: usize, line: u16| -> BTreeSet<(u16, i32)> {
                cut[index].vertices.iter().filter(|v| v.x == line).map(|v| (v.y, v.z)).collect()
            };
            assert_eq!([along(0, side), along(3, side)], [along(1, 0), along(4, 0)], "{shift}");
        }
    }

    fn area(decks: &[Decks]) -> i64 {
        decks.iter().flat_map(|decks| decks.triangles.iter().map(|&triangle| decks.doubled_area(triangle))).sum()
    }

    #[test]
    fn what_crosses_a_corner_of_a_load_module_can_be_raised_between_its_sides() {
        let side = 20 * 64;
        let deck = deck(&[(side, 0, 0), (2 * side, side, 0), (2 * side, side + 60, 0), (side, 60, 0)]);
        let decks = cut_alone(deck);
        let last = layout().side();
        let is_inside = |at: u16| 0 < at && at < last;
        for decks in &decks {
            for triangle in &decks.triangles {
                let corners = triangle.map(|corner| decks.vertices[usize::from(corner)]);
                assert!(corners.iter().any(|at| is_inside(at.x) && is_inside(at.y)), "{corners:?}");
            }
        }
    }

    #[test]
    fn a_deck_over_a_line_is_cut_there_and_both_load_modules_have_the_same_vertices() {
        let layout = layout();
        let line = 20 * 64;
        let ring = [(100, line - 333, 0), (117, line + 401, 900), (137, line + 400, 900), (120, line - 334, 0)];
        let cut = cut_alone(deck(&ring));
        cut.iter().for_each(|decks| assert_eq!(decks.check(layout.side()), Ok(())));
        let on = |index: usize, x: u16| -> Vec<(u16, i32)> {
            cut[index].vertices.iter().filter(|v| v.x == x).map(|v| (v.y, v.z)).collect()
        };
        let (west, east) = (on(0, layout.side()), on(1, 0));
        assert!(2 <= west.len() && west == east, "{west:?} {east:?}");
        let step = 25 * 128 / 64;
        let places: Vec<(i64, i64)> = ring.iter().map(|(row, col, _)| (i64::from(*row), i64::from(*col))).collect();
        let doubled: i64 = (0..4)
            .map(|at| {
                let ((y0, x0), (y1, x1)) = (places[at], places[(at + 1) % 4]);
                (x0 * y1 - x1 * y0) * step * step
            })
            .sum();
        assert!((area(&cut) - doubled).abs() < doubled / 1000, "{} {doubled}", area(&cut));
    }

    #[test]
    fn a_ring_may_run_either_way_and_turn_inwards_and_one_that_is_no_polygon_makes_nothing() {
        let inward = [(100, 100, 0), (100, 300, 0), (300, 300, 0), (150, 200, 0)];
        let mut back = inward;
        back.reverse();
        let (one, other) = (cut_alone(deck(&inward)), cut_alone(deck(&back)));
        assert_eq!((one[0].triangles.len(), area(&one)), (2, area(&other)));
        assert!(cut_alone(deck(&[(0, 0, 0), (5, 5, 0)])).iter().all(Decks::is_empty));
    }
}
