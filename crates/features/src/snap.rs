//! Snap rounding: lines on the lattice are bent so that two of them touch at shared vertices or not at all.
//!
//! Every pixel that holds a vertex or a crossing is hot; a segment that runs through a hot pixel gets a vertex there
//! (J. Hobby, Practical segment intersection with finite precision output, 1999). All of it is whole numbers, and the
//! result is a function of the set of segments. Repeated until nothing changes: then no vertex lies inside a segment
//! and no two segments cross, because either would have made a pixel hot. That ends: a vertex that is put in lies in
//! the box of its segment and parts it into two shorter ones, rows and columns counted; mostly the second round finds
//! nothing to do.

use terrain::{Each, gather};

use crate::Place;
use crate::exact::Segment;
use crate::quarters::{PlacesNear, SegmentPairs};

/// Where a line meets itself or another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Meeting {
    /// The lesser number of the two lines.
    pub one: u32,
    /// The other.
    pub other: u32,
    /// The pixel they share.
    pub place: Place,
}

/// Bends `lines` so that they touch at shared vertices or not at all; `hot` are further places at which a line that
/// runs through gets a vertex. Returns the proper crossings that became vertices, sorted.
///
/// After the first round only what is new is looked at: a segment that was not bent has a vertex at every pixel it runs
/// through, and so at every crossing with another such segment.
pub fn snap_round(lines: &mut [Vec<Place>], hot: &[Place], each: Each) -> Vec<Meeting> {
    lines.iter_mut().for_each(Vec::dedup);
    let (segments, owners) = segments_of(lines);
    let mut meetings = crossings(&segments, &owners, &|_| true, each);
    let crossed = meetings.iter().map(|meeting| meeting.place);
    let mut pixels: Vec<Place> = lines.iter().flatten().copied().chain(crossed).chain(hot.iter().copied()).collect();
    // Most vertices belong to several lines, and here every segment is asked for what it runs through.
    pixels.sort_unstable();
    pixels.dedup();
    let mut bent = bend(lines, &segments, &owners, hits(&segments, &pixels, each));
    while !bent.is_empty() {
        lines.iter_mut().for_each(Vec::dedup);
        let (segments, owners) = segments_of(lines);
        let is_new: Vec<bool> = segments.iter().map(|segment| bent.binary_search(segment).is_ok()).collect();
        let crossings = crossings(&segments, &owners, &|number| is_new[number as usize], each);
        let crossed: Vec<Place> = crossings.iter().map(|meeting| meeting.place).collect();
        meetings.extend(crossings);
        let (new, numbers): (Vec<Segment>, Vec<u32>) =
            segments.iter().zip(0..).filter(|(_, number)| is_new[*number as usize]).unzip();
        let pixels: Vec<Place> = lines.iter().flatten().copied().collect();
        let of_new = hits(&new, &pixels, each).into_iter().map(|(number, pixel)| (numbers[number as usize], pixel));
        let all = hits(&segments, &crossed, each).into_iter().chain(of_new).collect();
        bent = bend(lines, &segments, &owners, all);
    }
    meetings.sort_unstable();
    meetings.dedup();
    meetings
}

/// The segment that begins at a vertex of a line.
#[derive(Clone, Copy)]
struct Owner {
    line: u32,
    vertex: u32,
}

fn segments_of(lines: &[Vec<Place>]) -> (Vec<Segment>, Vec<Owner>) {
    let count = lines.iter().map(|line| line.len().saturating_sub(1)).sum();
    let (mut segments, mut owners) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for (line, places) in lines.iter().enumerate() {
        for (vertex, ends) in places.windows(2).enumerate() {
            segments.push(Segment { a: ends[0], b: ends[1] });
            owners.push(Owner { line: line as u32, vertex: vertex as u32 });
        }
    }
    (segments, owners)
}

/// Pixels where two segments cross that is not a vertex of both; one of the two is new.
fn crossings(
    segments: &[Segment],
    owners: &[Owner],
    is_new: &(impl Fn(u32) -> bool + Sync),
    each: Each,
) -> Vec<Meeting> {
    let pairs = SegmentPairs::of(segments);
    let of_row = |row: usize| {
        let mut crossings = Vec::new();
        pairs.in_row(row, is_new, &mut |one, other| {
            let (s, t) = (&segments[one as usize], &segments[other as usize]);
            let Some(place) = s.crossing(t) else { return };
            let ends = |segment: &Segment| segment.a == place || segment.b == place;
            if !(ends(s) && ends(t)) {
                let (one, other) = (owners[one as usize].line, owners[other as usize].line);
                crossings.push(Meeting { one: one.min(other), other: one.max(other), place });
            }
        });
        crossings
    };
    let mut crossings = gather(each, pairs.rows(), of_row).concat();
    crossings.sort_unstable();
    crossings.dedup();
    crossings
}

/// The number of every segment with each hot pixel that it runs through between its ends.
fn hits(segments: &[Segment], pixels: &[Place], each: Each) -> Vec<(u32, Place)> {
    let near = PlacesNear::of(segments, pixels, 1);
    let of_row = |row: usize| {
        let mut hits = Vec::new();
        near.in_row(row, &mut |number, pixel| {
            let (segment, place) = (&segments[number as usize], pixels[pixel as usize]);
            if segment.a != place && segment.b != place && segment.runs_through(place) {
                hits.push((number, place));
            }
        });
        hits
    };
    gather(each, near.rows(), of_row).concat()
}

/// Puts a vertex into every segment for each hot pixel it runs through, by its number; returns the segments that this
/// made, sorted.
fn bend(lines: &mut [Vec<Place>], segments: &[Segment], owners: &[Owner], mut hits: Vec<(u32, Place)>) -> Vec<Segment> {
    // A segment passes its pixels in the order of its own direction, which both axes follow.
    let along = |&(number, pixel): &(u32, Place)| {
        let segment = &segments[number as usize];
        let ([east, north], [to_east, to_north]) = (segment.a.to(segment.b), segment.a.to(pixel));
        (number, to_east * east.signum() + to_north * north.signum(), pixel)
    };
    hits.sort_unstable_by_key(along);
    hits.dedup();
    let mut hits = hits.into_iter().peekable();
    let mut made = Vec::new();
    while let Some(&(number, _)) = hits.peek() {
        let line = owners[number as usize].line;
        let first = number - owners[number as usize].vertex;
        let old = &lines[line as usize];
        let last = first + old.len() as u32 - 1;
        let mut new = Vec::with_capacity(old.len() + 4);
        for (vertex, &place) in old.iter().enumerate() {
            new.push(place);
            let from = new.len() - 1;
            let of_segment = |&(number, _): &(u32, Place)| number == first + vertex as u32 && number < last;
            while let Some((_, pixel)) = hits.next_if(of_segment) {
                new.push(pixel);
            }
            if from + 1 < new.len() {
                let ends = new[from..].windows(2).map(|ends| Segment { a: ends[0], b: ends[1] });
                made.extend(ends);
                made.push(Segment { a: new[new.len() - 1], b: old[vertex + 1] });
            }
        }
        lines[line as usize] = new;
    }
    made.sort_unstable();
    made
}

/// Checks by trying every pair that lines touch at shared vertices or not at all; for tests and assertions.
pub fn touch_at_vertices_only(lines: &[Vec<Place>]) -> Result<(), String> {
    let (segments, _) = segments_of(lines);
    for (number, one) in segments.iter().enumerate() {
        if one.a == one.b {
            return Err(format!("{one:?} has no length"));
        }
        for other in &segments[number + 1..] {
            let same = one.canonical() == other.canonical();
            let inner = |segment: &Segment, place: Place| segment.a != place && segment.b != place;
            let stuck = [other.a, other.b].iter().any(|end| one.holds(*end) && inner(one, *end))
                || [one.a, one.b].iter().any(|end| other.holds(*end) && inner(other, *end));
            let sides = |s: &Segment, t: &Segment| {
                let turns = [t.a, t.b].map(|end| crate::place::turn(s.a, s.b, end).signum());
                turns[0] * turns[1] < 0
            };
            if !same && (stuck || (sides(one, other) && sides(other, one))) {
                return Err(format!("{one:?} and {other:?} touch away from a shared vertex"));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use terrain::in_turn;

    fn place(row: i32, col: i32) -> Place {
        Place::new(row, col)
    }

    #[test]
    fn two_lines_that_cross_share_a_vertex() {
        let mut lines = vec![vec![place(0, 0), place(10, 10)], vec![place(0, 10), place(10, 1)]];
        let meetings = snap_round(&mut lines, &[], &in_turn);
        assert_eq!(meetings.len(), 1);
        assert!(lines.iter().all(|line| line.len() == 3 && line[1] == meetings[0].place));
    }

    #[test]
    fn an_end_half_a_step_beside_a_line_becomes_its_vertex() {
        let mut lines = vec![vec![place(0, 0), place(1, 9)], vec![place(0, 4), place(-9, 4)]];
        snap_round(&mut lines, &[], &in_turn);
        assert_eq!(lines[0], [place(0, 0), place(0, 4), place(1, 9)]);
    }

    #[test]
    fn a_line_gets_a_vertex_at_a_hot_place_it_runs_through_and_at_no_other() {
        let mut lines = vec![vec![place(0, 0), place(0, 9)]];
        snap_round(&mut lines, &[place(0, 5), place(3, 5)], &in_turn);
        assert_eq!(lines[0], [place(0, 0), place(0, 5), place(0, 9)]);
    }

    #[test]
    fn lines_that_lie_on_one_another_share_all_vertices() {
        let mut lines = vec![vec![place(0, 0), place(0, 9)], vec![place(0, 6), place(0, 3), place(0, -2)]];
        assert!(snap_round(&mut lines, &[], &in_turn).is_empty());
        assert_eq!(lines[0], [place(0, 0), place(0, 3), place(0, 6), place(0, 9)]);
        assert_eq!(lines[1], [place(0, 6), place(0, 3), place(0, 0), place(0, -2)]);
    }

    fn lines(side: i32, most: usize) -> impl Strategy<Value = Vec<Vec<Place>>> {
        let place = (0..side, 0..side).prop_map(|(row, col)| Place::new(row, col));
        proptest::collection::vec(proptest::collection::vec(place, 2..5), 1..most)
    }

    fn check(lines: &[Vec<Place>]) -> Result<(), TestCaseError> {
        let mut snapped = lines.to_vec();
        snap_round(&mut snapped, &[], &in_turn);
        prop_assert!(touch_at_vertices_only(&snapped).is_ok(), "{:?}", touch_at_vertices_only(&snapped));
        for (before, after) in lines.iter().zip(&snapped) {
            let mut kept = after.iter();
            let mut before = before.clone();
            before.dedup();
            prop_assert!(before.iter().all(|place| kept.any(|other| other == place)), "no vertex was moved");
        }
        let mut reversed: Vec<Vec<Place>> =
            lines.iter().rev().map(|line| line.iter().rev().copied().collect()).collect();
        snap_round(&mut reversed, &[], &in_turn);
        let back: Vec<Vec<Place>> = reversed.iter().rev().map(|line| line.iter().rev().copied().collect()).collect();
        prop_assert_eq!(snapped, back, "order and direction do not matter");
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn crowded_lines_touch_at_shared_vertices_or_not_at_all(lines in lines(12, 12)) {
            check(&lines)?;
        }

        #[test]
        fn sparse_lines_touch_at_shared_vertices_or_not_at_all(lines in lines(400, 30)) {
            check(&lines)?;
        }
    }
}
