//! Finds which segments and places are near one another, by cutting the area into quarters until few are left.
//!
//! Crowded places are cut finer than empty ones, so a network takes time near linear in its segments wherever they
//! lie. A pair may be found more than once.

use crate::Place;
use crate::exact::Segment;

/// A square with this many candidate pairs or fewer is searched pair by pair.
const PAIRS_MAX: usize = 512;

/// A square, closed on all sides, in steps.
#[derive(Clone, Copy)]
struct Square {
    south: i64,
    west: i64,
    side: i64,
}

impl Square {
    fn around(segments: &[Segment]) -> Option<Self> {
        let ends = || segments.iter().flat_map(|segment| [segment.a, segment.b]);
        let (south, north) = (ends().map(|end| end.row).min()?, ends().map(|end| end.row).max()?);
        let (west, east) = (ends().map(|end| end.col).min()?, ends().map(|end| end.col).max()?);
        let [south, north, west, east] = [south, north, west, east].map(i64::from);
        let side = (north - south).max(east - west).max(1) as u64;
        Some(Self { south, west, side: side.next_power_of_two() as i64 })
    }

    fn quarters(self) -> [Self; 4] {
        let side = self.side / 2;
        [(0, 0), (0, side), (side, 0), (side, side)].map(|(north, east)| Self {
            south: self.south + north,
            west: self.west + east,
            side,
        })
    }

    /// Whether a segment comes within `reach` of it: never false for one that does.
    fn meets(&self, segment: &Segment, reach: i64) -> bool {
        let (south, west) = (self.south - reach, self.west - reach);
        let (north, east) = (self.south + self.side + reach, self.west + self.side + reach);
        let [row_a, row_b, col_a, col_b] = [segment.a.row, segment.b.row, segment.a.col, segment.b.col].map(i64::from);
        if row_a.max(row_b) < south || north < row_a.min(row_b) || col_a.max(col_b) < west || east < col_a.min(col_b) {
            return false;
        }
        let (run, rise) = (col_b - col_a, row_b - row_a);
        let side_of = |row: i64, col: i64| run * (row - row_a) - rise * (col - col_a);
        let sides = [side_of(south, west), side_of(south, east), side_of(north, west), side_of(north, east)];
        sides.iter().any(|side| *side <= 0) && sides.iter().any(|side| 0 <= *side)
    }

    fn near(&self, place: Place, reach: i64) -> bool {
        let within = |at: i32, low: i64| low - reach <= i64::from(at) && i64::from(at) <= low + self.side + reach;
        within(place.row, self.south) && within(place.col, self.west)
    }
}

/// Calls `found` with every pair of segments whose boxes touch, the lesser number first, and some that do not.
pub fn segment_pairs(segments: &[Segment], found: &mut impl FnMut(u32, u32)) {
    let Some(square) = Square::around(segments) else { return };
    let all: Vec<u32> = (0..segments.len() as u32).collect();
    pairs_in(square, segments, &all, found);
}

fn pairs_in(square: Square, segments: &[Segment], numbers: &[u32], found: &mut impl FnMut(u32, u32)) {
    let few = numbers.len() * numbers.len() <= 2 * PAIRS_MAX;
    if few || square.side <= 2 {
        for (place, &one) in numbers.iter().enumerate() {
            numbers[place + 1..].iter().for_each(|&other| found(one, other));
        }
        return;
    }
    for quarter in square.quarters() {
        let inside = |number: &u32| quarter.meets(&segments[*number as usize], 0);
        let inside: Vec<u32> = numbers.iter().copied().filter(inside).collect();
        if 1 < inside.len() {
            pairs_in(quarter, segments, &inside, found);
        }
    }
}

/// Calls `found` with every segment and every place within `reach` steps of it, both ways, and some farther ones.
pub fn places_near(segments: &[Segment], places: &[Place], reach: i64, found: &mut impl FnMut(u32, u32)) {
    let Some(square) = Square::around(segments) else { return };
    let (all_segments, all_places): (Vec<u32>, Vec<u32>) =
        ((0..segments.len() as u32).collect(), (0..places.len() as u32).collect());
    let near = Near { segments, places, reach };
    near.search(square, &all_segments, &all_places, found);
}

struct Near<'a> {
    segments: &'a [Segment],
    places: &'a [Place],
    reach: i64,
}

impl Near<'_> {
    fn search(&self, square: Square, segments: &[u32], places: &[u32], found: &mut impl FnMut(u32, u32)) {
        if segments.len() * places.len() <= PAIRS_MAX || square.side <= 2 * self.reach + 2 {
            for &segment in segments {
                places.iter().for_each(|&place| found(segment, place));
            }
            return;
        }
        for quarter in square.quarters() {
            let near = |place: &u32| quarter.near(self.places[*place as usize], self.reach);
            let near: Vec<u32> = places.iter().copied().filter(near).collect();
            if near.is_empty() {
                continue;
            }
            let meets = |segment: &u32| quarter.meets(&self.segments[*segment as usize], self.reach);
            let meeting: Vec<u32> = segments.iter().copied().filter(meets).collect();
            if !meeting.is_empty() {
                self.search(quarter, &meeting, &near, found);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn segments(most: usize) -> impl Strategy<Value = Vec<Segment>> {
        let place = (-300i32..300, -300i32..300).prop_map(|(row, col)| Place::new(row, col));
        let near = (-20i32..20, -20i32..20);
        let segment =
            (place, near).prop_map(|(a, (north, east))| Segment { a, b: Place::new(a.row + north, a.col + east) });
        proptest::collection::vec(segment, 0..most)
    }

    proptest! {
        #[test]
        fn every_crossing_pair_is_found(segments in segments(200)) {
            let mut found = BTreeSet::new();
            segment_pairs(&segments, &mut |one, other| { found.insert((one, other)); });
            for one in 0..segments.len() {
                for other in one + 1..segments.len() {
                    if segments[one].crossing(&segments[other]).is_some() {
                        prop_assert!(found.contains(&(one as u32, other as u32)));
                    }
                }
            }
        }

        #[test]
        fn every_place_in_reach_is_found(segments in segments(200)) {
            let places: Vec<Place> = segments.iter().map(|segment| segment.b).collect();
            let mut found = BTreeSet::new();
            places_near(&segments, &places, 1, &mut |segment, place| { found.insert((segment, place)); });
            for (number, segment) in segments.iter().enumerate() {
                for (other, place) in places.iter().enumerate() {
                    if segment.runs_through(*place) {
                        prop_assert!(found.contains(&(number as u32, other as u32)));
                    }
                }
            }
        }
    }
}
