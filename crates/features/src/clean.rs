//! Mends one run of positions: what is no number, what lies far away, what is repeated, what goes out and back.

use crate::place::turn;
use crate::{FeatureId, FeatureLattice, Flaw, Place, Position, Remark, Remedy};

/// A vertex farther than this from its neighbours, in metres, is a slip, where the rest of the way is not as coarse.
const FAR_M: f64 = 20_000.0;

/// How many times the length of what is beside it a step to a displaced vertex is.
const FAR_TIMES: f64 = 10.0;

/// Two legs this close to one another, in metres, are one leg out and back.
pub const NEAR_M: f64 = 1.0;

/// Collects the remarks of one feature.
pub struct Notes<'a> {
    /// The feature.
    pub id: FeatureId,
    /// The lattice on which its places lie.
    pub lattice: FeatureLattice,
    /// Where its remarks go.
    pub remarks: &'a mut Vec<Remark>,
}

impl Notes<'_> {
    /// Writes a remark about a position in posts; a position that is none has no place.
    pub fn write(&mut self, posts: [f64; 2], flaw: Flaw, remedy: Remedy) {
        let posts = posts.iter().all(|axis| axis.is_finite()).then_some(posts);
        self.remarks.push(Remark { id: self.id, posts, flaw, remedy });
    }

    /// Writes a remark about a place.
    pub fn write_at(&mut self, place: Place, flaw: Flaw, remedy: Remedy) {
        let posts = self.lattice.posts_of(place);
        self.write(posts, flaw, remedy);
    }

    /// Writes a remark about all of a feature.
    pub fn write_of(&mut self, first: Option<Place>, flaw: Flaw, remedy: Remedy) {
        match first {
            Some(place) => self.write_at(place, flaw, remedy),
            None => self.remarks.push(Remark { id: self.id, posts: None, flaw, remedy }),
        }
    }
}

/// Positions on the lattice, with the heights of those that have one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cleaned {
    /// Places, no two neighbours equal.
    pub places: Vec<Place>,
    /// Heights in quanta, sorted by place.
    pub heights: Vec<(Place, i32)>,
}

/// Rounds positions to the lattice and leaves out those that cannot be meant.
pub fn clean(positions: &[Position], notes: &mut Notes) -> Cleaned {
    let mut sound: Vec<(Position, Place)> = Vec::with_capacity(positions.len());
    for position in positions {
        let posts = [position.east, position.north];
        match notes.lattice.place_of(posts) {
            Some(place) => sound.push((*position, place)),
            None if posts.iter().all(|axis| axis.is_finite()) => {
                notes.write(posts, Flaw::OffTheEarth, Remedy::PointLeftOut);
            }
            None => notes.write_of(None, Flaw::NotFinite, Remedy::PointLeftOut),
        }
    }
    leave_out_displaced(&mut sound, notes);
    let mut cleaned = Cleaned::default();
    let mut before: Option<Position> = None;
    for (position, place) in sound {
        // Points that only share a place of the lattice are no flaw: they are what it rounds.
        let same = |before: &Position| (before.east, before.north) == (position.east, position.north);
        if before.as_ref().is_some_and(same) {
            notes.write_at(place, Flaw::RepeatedPoint, Remedy::PointLeftOut);
        }
        before = Some(position);
        if cleaned.places.last() != Some(&place) {
            cleaned.places.push(place);
        }
        let height = position.height_m.and_then(terrain::quanta_of_metres);
        cleaned.heights.extend(height.map(|height| (place, height)));
    }
    cleaned.heights.sort_unstable();
    cleaned.heights.dedup();
    cleaned
}

/// Leaves out vertices that lie far from both neighbours, while these lie near each other; an end, where the rest of
/// the way takes short steps.
fn leave_out_displaced(sound: &mut Vec<(Position, Place)>, notes: &mut Notes) {
    let steps = FAR_M / notes.lattice.metres_per_step();
    let distance = |a: Place, b: Place| (a.squared_to(b) as f64).sqrt();
    let far = |a: Place, b: Place, beside: f64| steps.max(FAR_TIMES * beside) < distance(a, b);
    let count = sound.len();
    if count < 3 {
        return;
    }
    let place = |number: usize| sound[number].1;
    let displaced = |number: usize| {
        if number == 0 {
            far(place(0), place(1), distance(place(1), place(2)))
        } else if number + 1 == count {
            far(place(number), place(number - 1), distance(place(number - 1), place(number - 2)))
        } else {
            let beside = distance(place(number - 1), place(number + 1));
            far(place(number), place(number - 1), beside) && far(place(number), place(number + 1), beside)
        }
    };
    // The first vertex of a closed way is repeated at its end: both go, or both stay.
    let inner = (1..count - 1).filter(|&number| displaced(number));
    let mut out: Vec<usize> = inner.collect();
    for end in [0, count - 1] {
        let beside = if end == 0 { 1 } else { count - 2 };
        if !out.contains(&beside) && displaced(end) {
            out.push(end);
        }
    }
    for &number in &out {
        let (position, _) = sound[number];
        notes.write([position.east, position.north], Flaw::Displaced, Remedy::PointLeftOut);
    }
    let mut number = 0;
    sound.retain(|_| {
        number += 1;
        !out.contains(&(number - 1))
    });
}

/// Takes out tips from which a line comes back within a metre of where it went, but for those at which it meets others:
/// two carriageways that close at a junction are drawn so.
pub fn leave_out_spikes(places: &mut Vec<Place>, is_junction: &dyn Fn(Place) -> bool, notes: &mut Notes) {
    let mut kept: Vec<Place> = Vec::with_capacity(places.len());
    for &place in places.iter() {
        while let [.., before, tip] = kept[..] {
            if is_junction(tip) || before != place && !is_spike(before, tip, place, notes.lattice) {
                break;
            }
            notes.write_at(tip, Flaw::Spike, Remedy::PointLeftOut);
            kept.pop();
        }
        if kept.last() != Some(&place) {
            kept.push(place);
        }
    }
    *places = kept;
}

/// The same for a ring, whose first place is not repeated.
pub fn leave_out_spikes_of_ring(ring: &mut Vec<Place>, notes: &mut Notes) {
    leave_out_spikes(ring, &|_| false, notes);
    while 3 <= ring.len() && ring.first() == ring.last() {
        ring.pop();
    }
    loop {
        let count = ring.len();
        let spike = (0..count).find(|&tip| {
            let (before, after) = (ring[(tip + count - 1) % count], ring[(tip + 1) % count]);
            before == ring[tip] || before == after || is_spike(before, ring[tip], after, notes.lattice)
        });
        let Some(tip) = spike.filter(|_| 3 <= count) else { return };
        notes.write_at(ring[tip], Flaw::Spike, Remedy::PointLeftOut);
        ring.remove(tip);
    }
}

/// Whether the shorter leg of a turn lies within a metre of the longer one.
fn is_spike(before: Place, tip: Place, after: Place, lattice: FeatureLattice) -> bool {
    let ([ax, ay], [bx, by]) = (tip.to(before), tip.to(after));
    if ax * bx + ay * by <= 0 {
        return false;
    }
    let longer = tip.squared_to(before).max(tip.squared_to(after));
    let near = lattice.steps_in(NEAR_M).max(1);
    let area = i128::from(turn(before, tip, after));
    // A leg shorter than a metre is a small corner, not a spike, unless it lies exactly on the other.
    let short = tip.squared_to(before).min(tip.squared_to(after)) <= 16 * near * near;
    area == 0 || (!short && area * area < i128::from(longer) * i128::from(near * near))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Numbering;

    fn cleaned(positions: &[(f64, f64)]) -> (Vec<(i32, i32)>, Vec<Flaw>) {
        let lattice = FeatureLattice::of(terrain::Spacing::from_metres(25.0).unwrap());
        let id = FeatureId { source: 0, numbering: Numbering::Way, number: 1 };
        let mut remarks = Vec::new();
        let mut notes = Notes { id, lattice, remarks: &mut remarks };
        let positions: Vec<Position> = positions.iter().map(|&(east, north)| Position::new(east, north)).collect();
        let mut places = clean(&positions, &mut notes).places;
        leave_out_spikes(&mut places, &|_| false, &mut notes);
        (
            places.iter().map(|place| (place.col, place.row)).collect(),
            remarks.into_iter().map(|remark| remark.flaw).collect(),
        )
    }

    #[track_caller]
    fn check(positions: &[(f64, f64)], expected: &[(i32, i32)], flaws: &[Flaw]) {
        assert_eq!(cleaned(positions), (expected.to_vec(), flaws.to_vec()));
    }

    #[test]
    fn a_point_that_is_none_or_is_repeated_is_left_out() {
        check(&[(0.0, 0.0), (f64::NAN, 1.0), (1.0, 0.0)], &[(0, 0), (64, 0)], &[Flaw::NotFinite]);
        check(&[(0.0, 0.0), (1e12, 1.0), (1.0, 0.0)], &[(0, 0), (64, 0)], &[Flaw::OffTheEarth]);
        check(&[(0.0, 0.0), (0.0, 0.0), (1.0, 0.0)], &[(0, 0), (64, 0)], &[Flaw::RepeatedPoint]);
        check(&[(0.0, 0.0), (0.001, 0.0), (1.0, 0.0)], &[(0, 0), (64, 0)], &[]);
    }

    #[test]
    fn a_displaced_vertex_is_left_out_and_a_long_way_is_not_shortened() {
        let far = 5000.0;
        check(&[(0.0, 0.0), (far, far), (1.0, 0.0)], &[(0, 0), (64, 0)], &[Flaw::Displaced]);
        check(&[(0.0, 0.0), (1.0, 0.0), (far, 0.0)], &[(0, 0), (64, 0)], &[Flaw::Displaced]);
        check(&[(0.0, 0.0), (far, 0.0)], &[(0, 0), (320_000, 0)], &[]);
        check(&[(0.0, 0.0), (far, 0.0), (2.0 * far, 1.0)], &[(0, 0), (320_000, 0), (640_000, 64)], &[]);
    }

    #[test]
    fn a_spike_is_left_out_and_a_hairpin_is_not() {
        check(
            &[(0.0, 0.0), (1.0, 0.0), (1.0, 5.0), (1.0, 0.0), (2.0, 0.0)],
            &[(0, 0), (64, 0), (128, 0)],
            &[Flaw::Spike],
        );
        let hairpin = [(0.0, 0.0), (5.0, 0.0), (0.0, 0.2)];
        check(&hairpin, &[(0, 0), (320, 0), (0, 13)], &[]);
    }
}
