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
#[derive(Clone, Copy)]
struct Grid {
    whole: Square,
    /// Squares along a side.
    count: i64,
}

/// The numbers of what lies in each square of a grid, square by square.
struct Binned {
    /// Where each square's numbers begin, and where the last one's end.
    starts: Vec<u32>,
    numbers: Vec<u32>,
}

impl Binned {
    /// From the square of each number; a number may lie in several.
    fn of(squares: usize, all: &[(u32, u32)]) -> Self {
        let mut starts = vec![0; squares + 1];
        all.iter().for_each(|(square, _)| starts[*square as usize + 1] += 1);
        for square in 0..squares {
            starts[square + 1] += starts[square];
        }
        let (mut next, mut numbers) = (starts.clone(), vec![0; all.len()]);
        for (square, number) in all {
            let place = &mut next[*square as usize];
            numbers[*place as usize] = *number;
            *place += 1;
        }
        Self { starts, numbers }
    }

    fn of_square(&self, square: usize) -> &[u32] {
        &self.numbers[self.starts[square] as usize..self.starts[square + 1] as usize]
    }
}

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

    /// How many squares there are.
    fn squares(&self) -> usize {
        (self.count * self.count) as usize
    }

    /// The squares of a row.
    fn row(&self, row: usize) -> std::ops::Range<usize> {
        let count = self.count as usize;
        row * count..(row + 1) * count
    }

    /// The square of a number: row after row, from the south.
    fn square(&self, number: usize) -> Square {
        let side = self.whole.side / self.count;
        let (row, col) = (number as i64 / self.count, number as i64 % self.count);
        Square { south: self.whole.south + row * side, west: self.whole.west + col * side, side }
    }

    /// The row or column of squares at a coordinate; what lies outside is in the nearest.
    fn line(&self, at: i64, low: i64) -> i64 {
        // A square's side is a power of two.
        ((at - low) >> (self.whole.side / self.count).trailing_zeros()).clamp(0, self.count - 1)
    }

    /// Segments in every square that they come within `reach` of.
    fn segments(&self, segments: &[Segment], reach: i64) -> Binned {
        let mut all: Vec<(u32, u32)> = Vec::with_capacity(segments.len() + segments.len() / 4);
        for (number, segment) in (0..).zip(segments) {
            let span = |a: i32, b: i32, low: i64| {
                (self.line(i64::from(a.min(b)) - reach, low), self.line(i64::from(a.max(b)) + reach, low))
            };
            let (south, north) = span(segment.a.row, segment.b.row, self.whole.south);
            let (west, east) = span(segment.a.col, segment.b.col, self.whole.west);
            // A segment comes near every square of its box where that is one row or column.
            let is_slim = south == north || west == east;
            for row in south..=north {
                for square in (row * self.count + west) as usize..=(row * self.count + east) as usize {
                    if is_slim || self.square(square).meets(segment, reach) {
                        all.push((square as u32, number));
                    }
                }
            }
        }
        Binned::of(self.squares(), &all)
    }

    /// Places in the square that each lies in.
    fn places(&self, places: &[Place]) -> Binned {
        let square = |place: &Place| {
            let (row, col) =
                (self.line(place.row.into(), self.whole.south), self.line(place.col.into(), self.whole.west));
            (row * self.count + col) as u32
        };
        let all: Vec<(u32, u32)> = places.iter().map(square).zip(0..).collect();
        Binned::of(self.squares(), &all)
    }
}

/// Pairs of segments whose boxes touch, row of squares by row of squares, so that rows can be searched at once.
pub struct SegmentPairs<'a> {
    segments: &'a [Segment],
    grid: Option<(Grid, Binned)>,
}

impl<'a> SegmentPairs<'a> {
    pub fn of(segments: &'a [Segment]) -> Self {
        let grid = Grid::of(segments, 0).map(|grid| (grid, grid.segments(segments, 0)));
        Self { segments, grid }
    }

    pub fn rows(&self) -> usize {
        self.grid.as_ref().map_or(0, |(grid, _)| grid.count as usize)
    }

    /// Calls `found` with every pair in a row of which one is new, the lesser number first, and with some pairs whose
    /// boxes do not touch.
    pub fn in_row(&self, row: usize, is_new: &impl Fn(u32) -> bool, found: &mut impl FnMut(u32, u32)) {
        let Some((grid, binned)) = &self.grid else { return };
        for square in grid.row(row) {
            pairs_in(grid.square(square), self.segments, binned.of_square(square), is_new, found);
        }
    }
}

fn pairs_in(
    square: Square,
    segments: &[Segment],
    numbers: &[u32],
    is_new: &impl Fn(u32) -> bool,
    found: &mut impl FnMut(u32, u32),
) {
    if numbers.len() < 2 || !numbers.iter().any(|&number| is_new(number)) {
        return;
    }
    let few = numbers.len() * numbers.len() <= 2 * PAIRS_MAX;
    if few || square.side <= 2 {
        for (place, &one) in numbers.iter().enumerate() {
            let all = is_new(one);
            let others = numbers[place + 1..].iter().filter(|&&other| all || is_new(other));
            others.for_each(|&other| found(one, other));
        }
        return;
    }
    for quarter in square.quarters() {
        let inside = |number: &u32| quarter.meets(&segments[*number as usize], 0);
        let inside: Vec<u32> = numbers.iter().copied().filter(inside).collect();
        pairs_in(quarter, segments, &inside, is_new, found);
    }
}

/// Segments and the places within `reach` steps of them, both ways, row of squares by row of squares.
pub struct PlacesNear<'a> {
    near: Near<'a>,
    grid: Option<(Grid, Binned, Binned)>,
}

impl<'a> PlacesNear<'a> {
    pub fn of(segments: &'a [Segment], places: &'a [Place], reach: i64) -> Self {
        let grid = Grid::of(segments, reach);
        let grid = grid.map(|grid| (grid, grid.segments(segments, reach), grid.places(places)));
        Self { near: Near { segments, places, reach }, grid }
    }

    pub fn rows(&self) -> usize {
        self.grid.as_ref().map_or(0, |(grid, ..)| grid.count as usize)
    }

    /// Calls `found` with every segment and place of a row that are near, and with some that are farther apart.
    pub fn in_row(&self, row: usize, found: &mut impl FnMut(u32, u32)) {
        let Some((grid, of_segments, of_places)) = &self.grid else { return };
        for square in grid.row(row) {
            let (segments, places) = (of_segments.of_square(square), of_places.of_square(square));
            if !segments.is_empty() && !places.is_empty() {
                self.near.search(grid.square(square), segments, places, found);
            }
        }
    }
}

/// Calls `found` with every segment and every place within `reach` steps of it, both ways, and some farther ones.
pub fn places_near(segments: &[Segment], places: &[Place], reach: i64, found: &mut impl FnMut(u32, u32)) {
    let near = PlacesNear::of(segments, places, reach);
    (0..near.rows()).for_each(|row| near.in_row(row, found));
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
            let pairs = SegmentPairs::of(&segments);
            let mut keep = |one, other| {
                found.insert((one, other));
            };
            (0..pairs.rows()).for_each(|row| pairs.in_row(row, &|_| true, &mut keep));
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
