//! Cuts lines and rings at the border of the area plus one load module, exactly.

use crate::Place;
use crate::exact::Segment;

/// A rectangle of places, its border inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Its south-west corner.
    pub south_west: Place,
    /// Its north-east corner.
    pub north_east: Place,
}

impl Extent {
    /// Whether `place` lies inside or on the border.
    pub fn holds(&self, place: Place) -> bool {
        self.sides().iter().all(|side| 0 <= side.depth(place))
    }

    fn sides(&self) -> [HalfPlane; 4] {
        let (low, high) = (self.south_west, self.north_east);
        [
            HalfPlane { rows: true, limit: low.row, sign: 1 },
            HalfPlane { rows: true, limit: high.row, sign: -1 },
            HalfPlane { rows: false, limit: low.col, sign: 1 },
            HalfPlane { rows: false, limit: high.col, sign: -1 },
        ]
    }

    /// The parts of a line that lie inside, in order.
    pub fn cut_line(&self, line: &[Place]) -> Vec<Vec<Place>> {
        let mut parts: Vec<Vec<Place>> = vec![line.to_vec()];
        for side in self.sides() {
            parts = parts.iter().flat_map(|part| side.cut_line(part)).collect();
        }
        parts
    }

    /// The part of a ring (its first place not repeated) that lies inside; it may run along the border.
    pub fn cut_ring(&self, ring: &[Place]) -> Vec<Place> {
        let mut ring = ring.to_vec();
        for side in self.sides() {
            ring = side.cut_ring(&ring);
        }
        ring
    }
}

/// One side of a row or column of the lattice.
#[derive(Clone, Copy)]
struct HalfPlane {
    rows: bool,
    limit: i32,
    sign: i64,
}

impl HalfPlane {
    /// Steps inside; negative outside.
    fn depth(&self, place: Place) -> i64 {
        let at = if self.rows { place.row } else { place.col };
        self.sign * (i64::from(at) - i64::from(self.limit))
    }

    /// Where a segment with one end outside crosses the border.
    fn crossing(&self, a: Place, b: Place) -> Place {
        let (from, to) = (self.depth(a), self.depth(b));
        let sign = i128::from((from - to).signum());
        Segment { a, b }.at(sign * i128::from(from), sign * i128::from(from - to))
    }

    fn cut_line(&self, line: &[Place]) -> Vec<Vec<Place>> {
        let (mut parts, mut part) = (Vec::new(), Vec::new());
        for (number, &place) in line.iter().enumerate() {
            let before = number.checked_sub(1).map(|before| line[before]);
            if let Some(before) = before.filter(|before| self.depth(*before).signum() * self.depth(place).signum() < 0)
            {
                part.push(self.crossing(before, place));
            }
            if 0 <= self.depth(place) {
                part.push(place);
            } else {
                parts.push(std::mem::take(&mut part));
            }
        }
        parts.push(part);
        parts.iter_mut().for_each(Vec::dedup);
        parts.retain(|part| 2 <= part.len());
        parts
    }

    fn cut_ring(&self, ring: &[Place]) -> Vec<Place> {
        let mut kept = Vec::with_capacity(ring.len());
        for (number, &place) in ring.iter().enumerate() {
            let before = ring[(number + ring.len() - 1) % ring.len()];
            if self.depth(before).signum() * self.depth(place).signum() < 0 {
                kept.push(self.crossing(before, place));
            }
            if 0 <= self.depth(place) {
                kept.push(place);
            }
        }
        kept.dedup();
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXTENT: Extent = Extent { south_west: Place::new(0, 0), north_east: Place::new(10, 10) };

    fn places(places: &[(i32, i32)]) -> Vec<Place> {
        places.iter().map(|&(row, col)| Place::new(row, col)).collect()
    }

    #[test]
    fn a_line_that_leaves_and_returns_has_two_parts() {
        let line = places(&[(5, -5), (5, 5), (15, 5), (15, 8), (5, 8)]);
        assert_eq!(EXTENT.cut_line(&line), [places(&[(5, 0), (5, 5), (10, 5)]), places(&[(10, 8), (5, 8)])]);
        assert!(EXTENT.cut_line(&places(&[(-1, -1), (-1, 20)])).is_empty());
        assert_eq!(EXTENT.cut_line(&places(&[(-2, 5), (12, 5)])), [places(&[(0, 5), (10, 5)])]);
    }

    #[test]
    fn a_ring_is_cut_along_the_border() {
        let ring = places(&[(5, 5), (5, 15), (8, 15), (8, 5)]);
        assert_eq!(EXTENT.cut_ring(&ring), places(&[(5, 5), (5, 10), (8, 10), (8, 5)]));
        assert!(EXTENT.cut_ring(&places(&[(20, 20), (20, 30), (30, 30)])).is_empty());
    }
}
