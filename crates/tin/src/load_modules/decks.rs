//! Decks of bridges, cut at the lines between load modules.

use terrain::geometry::orient;
use terrain::mesh::constrained_delaunay;
use terrain::{Decks, FeatureSurface, LatticePoint, ModuleVertex, Vertex};

use crate::load_modules::Layout;
use crate::load_modules::stand::is_inside;

/// Triangles that lifting, and lowering the ground, may add in a load module at most: twelve corners, each of two.
pub const SPARE_MAX: usize = 24;

/// Quanta north and east together from which an edge has a corner in its middle: 4 m.
const MIDDLE_MIN: i64 = 4 * 128;

/// A corner in quanta from the area's south-west post.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Corner {
    x: i64,
    y: i64,
    z: i64,
}

impl Corner {
    fn place(&self) -> LatticePoint {
        LatticePoint::new(self.y as i32, self.x as i32)
    }

    /// Quanta north and east together to another.
    fn apart(&self, other: &Corner) -> i64 {
        (self.x - other.x).abs() + (self.y - other.y).abs()
    }
}

/// The decks in each load module of a tile, row by row: polygons above the ground, cut at the squares' sides and told
/// apart into triangles there. What two load modules have on the line between them is the same.
///
/// Places of `decks` are in steps of a lattice of so many steps between posts. With the decks of each load module goes
/// how many triangles they may have when they are lifted: limits are held against one for each corner of polygons that
/// reach into it.
pub fn cut_decks(decks: &[FeatureSurface], steps_per_post: i32, layout: &Layout) -> Vec<(Decks, usize)> {
    let step = i64::from(layout.spacing.quanta_per_post() / steps_per_post);
    let side = i64::from(layout.side());
    let mut pieces = vec![Vec::new(); layout.modules.count()];
    let mut corners = vec![0; layout.modules.count()];
    for deck in decks {
        let corner = |vertex: &Vertex| Corner {
            x: i64::from(vertex.at.col) * step,
            y: i64::from(vertex.at.row) * step,
            z: i64::from(vertex.height),
        };
        let ring: Vec<Corner> = deck.ring.iter().map(corner).collect();
        let crossed = crossed(&ring, side);
        let span = |of: fn(&Corner) -> i64| {
            let all = || ring.iter().map(|corner| of(corner).div_euclid(side));
            all().min().unwrap_or(0)..=all().max().unwrap_or(-1)
        };
        for (row, col) in span(|at| at.y).flat_map(|row| span(|at| at.x).map(move |col| (row, col))) {
            let Some(slot) = layout.slot(row as i32, col as i32) else { continue };
            corners[slot] += ring.len();
            let [west, south] = [col * side, row * side];
            let local = |corner: Corner| ModuleVertex {
                y: (corner.y - south) as u16,
                x: (corner.x - west) as u16,
                z: corner.z as i32,
            };
            let is_in = |at: &Corner| (west..=west + side).contains(&at.x) && (south..=south + side).contains(&at.y);
            let meet = [[west, south], [west + side, south], [west, south + side], [west + side, south + side]];
            let inside: Vec<Corner> = meet.into_iter().filter_map(|place| corner_inside(&ring, place)).collect();
            let within = triangles(&crossed, is_in, &inside);
            pieces[slot].extend(within.into_iter().map(|triangle| (triangle.map(local), deck.class)));
        }
    }
    let most = |(decks, corners): (Decks, usize)| {
        let most = decks.triangles.len().max(corners.min(decks.triangles.len() + SPARE_MAX));
        (decks, most)
    };
    pieces.into_iter().map(Decks::of_triangles).zip(corners).map(most).collect()
}

/// A ring with corners where its edges cross lines between load modules, and in the middle of every long edge from one
/// line to another, so that decks can be raised between them.
fn crossed(ring: &[Corner], side: i64) -> Vec<Corner> {
    let mut all = Vec::with_capacity(2 * ring.len());
    for (&from, &to) in ring.iter().zip(ring.iter().cycle().skip(1)) {
        let mut edge = vec![from, to];
        for axis in [Axis::X, Axis::Y] {
            let (low, high) = (axis.of(from).min(axis.of(to)), axis.of(from).max(axis.of(to)));
            let lines = low.div_euclid(side) + 1..=(high - 1).div_euclid(side);
            edge.extend(lines.map(|line| crossing(from, to, axis, line * side)));
        }
        edge.sort_by_key(|at| (from.apart(at), at.z));
        edge.dedup_by_key(|at| from.apart(at));
        for pair in edge.windows(2) {
            all.push(pair[0]);
            let on = |at: &Corner, axis: Axis| axis.of(*at) % side == 0;
            let are_on = |at: &Corner| on(at, Axis::X) || on(at, Axis::Y);
            let is_along = |axis: Axis| on(&pair[0], axis) && axis.of(pair[0]) == axis.of(pair[1]);
            let is_across = pair.iter().all(are_on) && !is_along(Axis::X) && !is_along(Axis::Y);
            if is_across && MIDDLE_MIN <= pair[0].apart(&pair[1]) {
                let middle = |of: fn(&Corner) -> i64| (of(&pair[0]) + of(&pair[1])).div_euclid(2);
                all.push(Corner { x: middle(|at| at.x), y: middle(|at| at.y), z: middle(|at| at.z) });
            }
        }
    }
    all
}

/// The Delaunay triangles inside a ring, counter-clockwise, whichever way it runs, of those of its corners that are
/// kept and of others inside. Edges that would cross one before them are left out.
fn triangles(ring: &[Corner], is_kept: impl Fn(&Corner) -> bool, others: &[Corner]) -> Vec<[Corner; 3]> {
    let mut corners: Vec<Corner> = ring.iter().filter(|corner| is_kept(corner)).chain(others).copied().collect();
    corners.sort_by_key(Corner::place);
    corners.dedup_by_key(|corner| corner.place());
    let places: Vec<LatticePoint> = corners.iter().map(Corner::place).collect();
    let number = |corner: &Corner| places.binary_search(&corner.place()).ok().map(|at| at as u32);
    let pairs = || ring.iter().zip(ring.iter().cycle().skip(1));
    let edges: Vec<[u32; 2]> = pairs().filter_map(|(from, to)| Some([number(from)?, number(to)?])).collect();
    let plan = |corner: &Corner| [corner.x as f64, corner.y as f64];
    let walls: Vec<[[f64; 2]; 2]> = pairs().map(|(from, to)| [plan(from), plan(to)]).collect();
    let is_within = |triangle: &[Corner; 3]| {
        let [a, b, c] = triangle.each_ref().map(plan);
        is_inside(&walls, [0, 1].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0))
    };
    let (triangles, _) = constrained_delaunay(&places, &edges);
    triangles.into_iter().map(|triangle| triangle.map(|at| corners[at as usize])).filter(is_within).collect()
}

/// A corner at a place inside a ring at the height of its triangle there, which is the same for all load modules that
/// meet there; none where the place is outside.
fn corner_inside(ring: &[Corner], [x, y]: [i64; 2]) -> Option<Corner> {
    let span = |axis: Axis| {
        let all = || ring.iter().map(|corner| axis.of(*corner));
        all().min().unwrap_or(0)..=all().max().unwrap_or(-1)
    };
    if !span(Axis::X).contains(&x) || !span(Axis::Y).contains(&y) {
        return None;
    }
    let place = Corner { x, y, z: 0 };
    triangles(ring, |_| true, &[]).into_iter().find_map(|[a, b, c]| {
        let turn = |a: Corner, b: Corner, c: Corner| i128::from(orient(a.place(), b.place(), c.place()));
        let [of_a, of_b, of_c] = [turn(place, b, c), turn(place, c, a), turn(place, a, b)];
        let whole = turn(a, b, c);
        let rise = of_b * i128::from(b.z - a.z) + of_c * i128::from(c.z - a.z);
        let z = a.z + (2 * rise + whole).div_euclid(2 * whole) as i64;
        [of_a, of_b, of_c].iter().all(|of| 0 <= *of).then_some(Corner { z, ..place })
    })
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
    use terrain::{ModuleGrid, Spacing, SurfaceGround, check_decks};

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
        cut.iter().for_each(|decks| assert_eq!(check_decks(decks, layout.side()), Ok(())));
        let on = |index: usize, x: u16| -> Vec<(u16, i32)> {
            cut[index].vertices.iter().filter(|v| v.x == x).map(|v| (v.y, v.z)).collect()
        };
        let (west, east) = (on(0, layout.side()), on(1, 0));
        assert!(west.len() == 2 && west == east, "{west:?} {east:?}");
        assert!(cut.iter().all(|decks| [0, 2].contains(&decks.triangles.len())), "each half has four corners");
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
