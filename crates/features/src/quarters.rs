//! Finds which segments and places are near one another: by a grid of squares, each cut into quarters until few are
//! left.
//!
//! Crowded places are cut finer than empty ones, so a network takes time near linear in its segments wherever they
//! lie. A pair may be found more than once.

use crate::Place;
use crate::exact::Segment;

/// A square with this many candidate pairs or fewer is searched pair by pair.
const PAIRS_MAX: usize = 512;

/// Segments for each square of the grid, were they spread evenly.
const PER_CELL: usize = 16;

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

/// The area of all segments as squares of one size.
struct Grid {
    whole: Square,
    /// Squares along a side.
    count: i64,
}

/// A square by its row and column, and the number of what lies in it.
type InCell = ([i64; 2], u32);

impl Grid {
    /// A grid for `segments`, none of whose squares is smaller than what lies within `reach` of a place.
    fn of(segments: &[Segment], reach: i64) -> Option<Self> {
        let whole = Square::around(segments)?;
        let mut count = 1;
        while (count * count) as usize * PER_CELL < segments.len() && 4 * (reach + 1) < whole.side / count {
            count *= 2;
        }
        Some(Self { whole, count })
    }

    /// The square at a row and a column.
    fn square(&self, [row, col]: [i64; 2]) -> Square {
        let side = self.whole.side / self.count;
        Square { south: self.whole.south + row * side, west: self.whole.west + col * side, side }
    }

    fn cell(&self, at: i64, low: i64) -> i64 {
        (at - low).div_euclid(self.whole.side / self.count).clamp(0, self.count - 1)
    }

    /// Segments in every square that they come within `reach` of, square by square.
    fn segments(&self, segments: &[Segment], reach: i64) -> Vec<InCell> {
        let mut cells: Vec<InCell> = Vec::with_capacity(segments.len() + segments.len() / 4);
        for (number, segment) in (0..).zip(segments) {
            let span = |a: i32, b: i32, low: i64| {
                self.cell(i64::from(a.min(b)) - reach, low)..=self.cell(i64::from(a.max(b)) + reach, low)
            };
            let cols = span(segment.a.col, segment.b.col, self.whole.west);
            for row in span(segment.a.row, segment.b.row, self.whole.south) {
                let here = cols.clone().map(|col| [row, col]);
                cells.extend(here.filter(|at| self.square(*at).meets(segment, reach)).map(|at| (at, number)));
            }
        }
        cells.sort_unstable();
        cells
    }

    /// Places in the square that each lies in, square by square.
    fn places(&self, places: &[Place]) -> Vec<InCell> {
        let at = |place: &Place| {
            [self.cell(place.row.into(), self.whole.south), self.cell(place.col.into(), self.whole.west)]
        };
        let mut cells: Vec<InCell> = (0..).zip(places).map(|(number, place)| (at(place), number)).collect();
        cells.sort_unstable();
        cells
    }
}

fn numbers(cells: &[InCell]) -> Vec<u32> {
    cells.iter().map(|(_, number)| *number).collect()
}

/// Calls `found` with every pair of segments whose boxes touch, the lesser number first, and some that do not.
pub fn segment_pairs(segments: &[Segment], found: &mut impl FnMut(u32, u32)) {
    let Some(grid) = Grid::of(segments, 0) else { return };
    for cell in grid.segments(segments, 0).chunk_by(|a, b| a.0 == b.0).filter(|cell| 1 < cell.len()) {
        pairs_in(grid.square(cell[0].0), segments, &numbers(cell), found);
    }
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
    let Some(grid) = Grid::of(segments, reach) else { return };
    let near = Near { segments, places, reach };
    let (of_segments, of_places) = (grid.segments(segments, reach), grid.places(places));
    let mut rest = &of_places[..];
    for cell in of_segments.chunk_by(|a, b| a.0 == b.0) {
        rest = &rest[rest.partition_point(|place| place.0 < cell[0].0)..];
        let here = &rest[..rest.partition_point(|place| place.0 == cell[0].0)];
        if !here.is_empty() {
            near.search(grid.square(cell[0].0), &numbers(cell), &numbers(here), found);
        }
    }
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
