//! Rings: closed, and split into simple ones.

use std::collections::HashMap;

use terrain::{LatticePoint, Vertex};

use crate::Place;
use crate::clean::Notes;
use crate::place::turn;
use crate::{Flaw, Remedy};

/// An open ring is closed by a straight line no longer than this share of its length.
const GAP_SHARE_MAX: f64 = 0.5;

/// A ring, its first place not repeated.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ring {
    /// Places, counter-clockwise around an outer ring, clockwise around a hole.
    pub places: Vec<Place>,
    /// Whether what it encloses is outside.
    pub hole: bool,
}

/// Twice the area a ring encloses, positive when it runs counter-clockwise.
pub fn doubled_area(ring: &[Place]) -> i128 {
    let Some(&first) = ring.first() else { return 0 };
    ring.windows(2).map(|pair| i128::from(turn(first, pair[0], pair[1]))).sum()
}

/// Whether `place` lies inside a ring; on its border, either.
pub fn encloses(ring: &[Place], place: Place) -> bool {
    let mut inside = false;
    for (number, &b) in ring.iter().enumerate() {
        let a = ring[(number + ring.len() - 1) % ring.len()];
        if (a.row <= place.row) != (b.row <= place.row) {
            let left = 0 < turn(a, b, place);
            inside ^= left == (a.row < b.row);
        }
    }
    inside
}

/// The height of rings at a place inside, in quanta: that of the plane of the corners that it lies between.
pub fn height_in(rings: &[&[Vertex]], at: LatticePoint) -> i32 {
    let cross = |a: LatticePoint, b: LatticePoint, c: LatticePoint| {
        let [ax, ay, bx, by] = [b.col - a.col, b.row - a.row, c.col - a.col, c.row - a.row].map(i64::from);
        ax * by - ay * bx
    };
    let fans = rings.iter().flat_map(|ring| ring.windows(2).skip(1).map(|pair| [ring[0], pair[0], pair[1]]));
    for [a, b, c] in fans {
        let whole = cross(a.at, b.at, c.at);
        let parts =
            [cross(b.at, c.at, at), cross(c.at, a.at, at), cross(a.at, b.at, at)].map(|part| part * whole.signum());
        if whole != 0 && parts.iter().all(|part| 0 <= *part) {
            let heights = [a, b, c].map(|vertex| i64::from(vertex.height));
            let sum: i128 =
                parts.iter().zip(heights).map(|(part, height)| i128::from(*part) * i128::from(height)).sum();
            let whole = i128::from(whole.abs());
            return (2 * sum + whole).div_euclid(2 * whole) as i32;
        }
    }
    // Rounding has bent the ring: the nearest corner says it.
    let squared = |vertex: &&Vertex| {
        let [rows, cols] = [vertex.at.row - at.row, vertex.at.col - at.col].map(i64::from);
        rows * rows + cols * cols
    };
    rings.iter().copied().flatten().min_by_key(squared).map_or(0, |vertex| vertex.height)
}

/// A ring without its repeated end; one that is open is closed by a straight line if that is short enough.
pub fn close(mut ring: Vec<Place>, notes: &mut Notes) -> Option<Vec<Place>> {
    let (first, last) = (*ring.first()?, *ring.last()?);
    if first == last {
        ring.pop();
    } else {
        let length = |a: Place, b: Place| (a.squared_to(b) as f64).sqrt();
        let all: f64 = ring.windows(2).map(|pair| length(pair[0], pair[1])).sum();
        if ring.len() < 3 || GAP_SHARE_MAX * all < length(first, last) {
            notes.write_at(first, Flaw::UnclosedRing, Remedy::PartLeftOut);
            return None;
        }
        notes.write_at(last, Flaw::UnclosedRing, Remedy::Closed);
    }
    (3 <= ring.len()).then_some(ring)
}

/// Splits closed walks that touch themselves at vertices only into simple rings, and says which of them are holes:
/// a ring inside an odd number of others is one. `holes` says which walks are meant as holes.
pub fn simple_rings(walks: &[(Vec<Place>, bool)], notes: &mut Notes) -> Vec<Ring> {
    let mut loops: Vec<(Vec<Place>, bool)> = Vec::new();
    for (walk, hole) in walks {
        let parts = loops_of(walk);
        if 1 < parts.len() {
            notes.write_at(parts[1][0], Flaw::BowTie, Remedy::Split);
        }
        loops.extend(parts.into_iter().map(|part| (part, *hole)));
    }
    cancel_copies(&mut loops, notes);
    let boxes: Vec<_> = loops.iter().map(|(part, _)| box_of(part)).collect();
    let mut rings = Vec::new();
    for (number, (part, meant_as_hole)) in loops.iter().enumerate() {
        let around = |other: &usize| {
            *other != number && box_holds(boxes[*other], boxes[number]) && contains(&loops[*other].0, part)
        };
        let depth = (0..loops.len()).filter(around).count();
        if depth == 0 && *meant_as_hole {
            notes.write_at(part[0], Flaw::HoleOutside, Remedy::PartLeftOut);
            continue;
        }
        let hole = depth % 2 == 1;
        let mut places = part.clone();
        if (doubled_area(&places) < 0) != hole {
            places.reverse();
        }
        let first = (0..places.len()).min_by_key(|&number| places[number]).unwrap_or(0);
        places.rotate_left(first);
        rings.push(Ring { places, hole });
    }
    rings.sort();
    rings
}

/// The simple loops of a closed walk: wherever it comes back to a place, what lies between is one.
fn loops_of(walk: &[Place]) -> Vec<Vec<Place>> {
    let (mut loops, mut stack): (Vec<Vec<Place>>, Vec<Place>) = (Vec::new(), Vec::new());
    let mut at: HashMap<Place, usize> = HashMap::new();
    for &place in walk {
        if let Some(&start) = at.get(&place) {
            let part: Vec<Place> = stack.drain(start..).collect();
            part.iter().for_each(|place| {
                at.remove(place);
            });
            loops.push(part);
        }
        at.insert(place, stack.len());
        stack.push(place);
    }
    loops.push(stack);
    // Two edges there and back enclose nothing.
    loops.retain(|part| 3 <= part.len() && doubled_area(part) != 0);
    loops.sort_by_key(|part| (std::cmp::Reverse(doubled_area(part).abs()), part.iter().min().copied()));
    loops
}

/// A ring that is there twice is there once.
fn cancel_copies(loops: &mut Vec<(Vec<Place>, bool)>, notes: &mut Notes) {
    let key = |part: &[Place]| {
        let mut places = part.to_vec();
        places.sort_unstable();
        places
    };
    let mut seen = std::collections::BTreeSet::new();
    loops.retain(|(part, _)| {
        let new = seen.insert(key(part));
        if !new {
            notes.write_at(part[0], Flaw::Doubled, Remedy::PartLeftOut);
        }
        new
    });
}

fn box_of(ring: &[Place]) -> [i32; 4] {
    ring.iter().fold([i32::MAX, i32::MAX, i32::MIN, i32::MIN], |[south, west, north, east], place| {
        [south.min(place.row), west.min(place.col), north.max(place.row), east.max(place.col)]
    })
}

fn box_holds(outer: [i32; 4], inner: [i32; 4]) -> bool {
    outer[0] <= inner[0] && outer[1] <= inner[1] && inner[2] <= outer[2] && inner[3] <= outer[3]
}

/// Whether `outer` contains `inner`; they touch at vertices and along shared edges only.
fn contains(outer: &[Place], inner: &[Place]) -> bool {
    let on_outer: std::collections::HashSet<&Place> = outer.iter().collect();
    match inner.iter().find(|place| !on_outer.contains(place)) {
        Some(place) => encloses(outer, *place),
        // All its vertices are also those of the other: it lies inside where it is smaller and one of its edges does.
        None => {
            let doubled = |place: Place| Place::new(2 * place.row, 2 * place.col);
            let wide: Vec<Place> = outer.iter().map(|place| doubled(*place)).collect();
            let middle = |a: Place, b: Place| Place::new(a.row + b.row, a.col + b.col);
            let edges: std::collections::HashSet<(Place, Place)> = (0..outer.len())
                .map(|at| (outer[at], outer[(at + 1) % outer.len()]))
                .flat_map(|(a, b)| [(a, b), (b, a)])
                .collect();
            (0..inner.len())
                .map(|at| (inner[at], inner[(at + 1) % inner.len()]))
                .find(|edge| !edges.contains(edge))
                .is_some_and(|(a, b)| encloses(&wide, middle(a, b)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FeatureId, FeatureLattice, Numbering, Remark};

    fn noted<T>(work: impl FnOnce(&mut Notes) -> T) -> (T, Vec<Flaw>) {
        let lattice = FeatureLattice::of(terrain::Spacing::from_metres(25.0).unwrap());
        let id = FeatureId { source: 0, numbering: Numbering::Relation, number: 1 };
        let mut remarks: Vec<Remark> = Vec::new();
        let result = work(&mut Notes { id, lattice, remarks: &mut remarks });
        (result, remarks.into_iter().map(|remark| remark.flaw).collect())
    }

    fn places(places: &[(i32, i32)]) -> Vec<Place> {
        places.iter().map(|&(row, col)| Place::new(row, col)).collect()
    }

    fn square(at: i32, side: i32) -> Vec<Place> {
        places(&[(at, at), (at, at + side), (at + side, at + side), (at + side, at)])
    }

    #[test]
    fn a_ring_that_lacks_a_little_is_closed_and_one_that_lacks_much_is_left_out() {
        let (ring, flaws) = noted(|notes| close(square(0, 9), notes));
        assert_eq!((ring, flaws), (Some(square(0, 9)), vec![Flaw::UnclosedRing]));
        let (ring, flaws) = noted(|notes| close(places(&[(0, 0), (0, 9)]), notes));
        assert_eq!((ring, flaws), (None, vec![Flaw::UnclosedRing]));
    }

    #[test]
    fn a_bow_tie_has_two_wings() {
        let walk = places(&[(0, 0), (5, 5), (10, 0), (10, 10), (5, 5), (0, 10)]);
        let (rings, flaws) = noted(|notes| simple_rings(&[(walk, false)], notes));
        assert_eq!((rings.len(), flaws), (2, vec![Flaw::BowTie]));
        assert!(rings.iter().all(|ring| !ring.hole && doubled_area(&ring.places) == 50));
    }

    #[test]
    fn an_island_in_a_hole_is_outer_and_a_hole_outside_is_left_out() {
        let walks = [(square(0, 90), false), (square(10, 70), true), (square(20, 10), false), (square(200, 9), true)];
        let (rings, flaws) = noted(|notes| simple_rings(&walks, notes));
        assert_eq!(rings.iter().map(|ring| ring.hole).collect::<Vec<_>>(), [false, true, false]);
        assert_eq!(flaws, [Flaw::HoleOutside]);
        assert!(rings.iter().all(|ring| (doubled_area(&ring.places) < 0) == ring.hole));
    }

    #[test]
    fn a_ring_there_and_back_has_no_area() {
        let (rings, _) = noted(|notes| simple_rings(&[(places(&[(0, 0), (0, 9), (0, 4)]), false)], notes));
        assert!(rings.is_empty());
    }
}
