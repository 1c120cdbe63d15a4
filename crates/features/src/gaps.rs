//! Joins ends of ways that miss another way by less than a metre, or end on the other's carriageway: two heights there
//! would be a cliff in the road.

use std::collections::HashMap;

use crate::clean::{NEAR_M, Notes};
use crate::exact::Segment;
use crate::quarters::places_near;
use crate::ways::Way;
use crate::{FeatureLattice, Flaw, Kind, Place, Remark, Remedy, Storey};

/// Rounds of joining: the second is for ends that were moved to where a third one waits.
const ROUNDS: usize = 2;

/// Ways of a family join one another: what is travelled, what flows, and the rest.
pub fn family(kind: Kind) -> u8 {
    match kind {
        Kind::Rail => 1,
        kind if kind.is_travelled() => 0,
        kind if kind.flows() => 2,
        _ => 3,
    }
}

/// Moves dangling ends to the nearest vertex or segment of another way of their family: within a metre, half of the
/// other's width, or, to another dangling end, half of both widths.
pub fn join(ways: &mut [Way], lattice: FeatureLattice, remarks: &mut Vec<Remark>) {
    for family_number in [0, 1, 2] {
        let numbers: Vec<usize> =
            (0..ways.len()).filter(|&number| family(ways[number].traits.kind) == family_number).collect();
        for _ in 0..ROUNDS {
            let moves = moves(ways, &numbers, lattice);
            let none = moves.is_empty();
            for Move { way, last, to, .. } in moves {
                let id = ways[way].id;
                let places = &mut ways[way].places;
                let end = if last { places.len() - 1 } else { 0 };
                let from = std::mem::replace(&mut places[end], to);
                ways[way].heights.retain(|(place, _)| *place != from);
                Notes { id, lattice, remarks }.write_at(from, Flaw::Gap, Remedy::Joined);
            }
            if none {
                break;
            }
        }
    }
}

/// A dangling end and where it goes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Move {
    from: Place,
    squared: i64,
    to: Place,
    way: usize,
    last: bool,
}

fn moves(ways: &[Way], numbers: &[usize], lattice: FeatureLattice) -> Vec<Move> {
    let mut uses: HashMap<Place, u32> = HashMap::new();
    for &number in numbers {
        ways[number].places.iter().for_each(|place| *uses.entry(*place).or_insert(0) += 1);
    }
    let mut ends: Vec<(usize, bool)> = Vec::new();
    for &number in numbers {
        for last in [false, true] {
            let free = end_of(&ways[number], last).is_some_and(|place| uses[&place] == 1);
            ends.extend(free.then_some((number, last)));
        }
    }
    let places: Vec<Place> = ends.iter().filter_map(|&(number, last)| end_of(&ways[number], last)).collect();
    let dangling: std::collections::HashSet<Place> = places.iter().copied().collect();
    let (mut segments, mut owners) = (Vec::new(), Vec::new());
    for &number in numbers {
        for pair in ways[number].places.windows(2) {
            segments.push(Segment { a: pair[0], b: pair[1] });
            owners.push(number);
        }
    }
    // A step more, since both have been rounded.
    let near = lattice.steps_in(NEAR_M) + 1;
    let half = |number: usize| i64::from(ways[number].traits.width / (2 * lattice.quanta_per_step()));
    let widest = numbers.iter().map(|number| half(*number)).max().unwrap_or(0);
    let reach = near.max(2 * widest);
    let mut nearest: Vec<Option<Move>> = vec![None; ends.len()];
    places_near(&segments, &places, reach, &mut |segment, place| {
        let (owner, (way, last)) = (owners[segment as usize], ends[place as usize]);
        let from = places[place as usize];
        if owner == way || !meets(ways[owner].traits.storey, ways[way].traits.storey) {
            return;
        }
        let Some(to) = target(&segments[segment as usize], from, reach) else { return };
        let both = if dangling.contains(&to) { half(way) } else { 0 };
        let own = if is_ahead(&ways[way].places, last, to) { near.max(half(owner) + both) } else { near };
        if own * own < from.squared_to(to) {
            return;
        }
        // Of two dangling ends one goes to the other.
        if from == to || (dangling.contains(&to) && from < to) {
            return;
        }
        let candidate = Move { from, squared: from.squared_to(to), to, way, last };
        let best = &mut nearest[place as usize];
        if best.is_none_or(|best| candidate < best) {
            *best = Some(candidate);
        }
    });
    nearest.into_iter().flatten().filter(|found| ways[found.way].places.len() != 2 || !folds(ways, found)).collect()
}

/// Whether a way leads from its end to a place, within 60 degrees: one that ends beside another does not miss it.
fn is_ahead(places: &[Place], last: bool, to: Place) -> bool {
    let (end, before) = match last {
        true => (places[places.len() - 1], places[places.len() - 2]),
        false => (places[0], places[1]),
    };
    let ([east, north], [to_east, to_north]) = (before.to(end), end.to(to));
    let along = i128::from(east * to_east + north * to_north);
    0 < along && i128::from(before.squared_to(end)) * i128::from(end.squared_to(to)) <= 4 * along * along
}

/// Whether a way of two places would lose its length.
fn folds(ways: &[Way], found: &Move) -> bool {
    end_of(&ways[found.way], !found.last) == Some(found.to)
}

fn end_of(way: &Way, last: bool) -> Option<Place> {
    let closed = way.places.first() == way.places.last();
    if closed {
        None
    } else if last {
        way.places.last().copied()
    } else {
        way.places.first().copied()
    }
}

/// Whether ways at these storeys may meet: two decks of different layers do not, a deck and the ground do at its end.
fn meets(one: Storey, other: Storey) -> bool {
    one == other || one == Storey::Ground || other == Storey::Ground
}

/// The nearest place of a segment within reach: one of its ends if one is in reach, else the foot on it.
fn target(segment: &Segment, from: Place, reach: i64) -> Option<Place> {
    let in_reach = |place: Place| from.squared_to(place) <= reach * reach;
    let nearer = [segment.a, segment.b].into_iter().min_by_key(|end| (from.squared_to(*end), *end))?;
    if in_reach(nearer) {
        return Some(nearer);
    }
    let ([east, north], [to_east, to_north]) = (segment.a.to(segment.b), segment.a.to(from));
    let (along, whole) = (east * to_east + north * to_north, east * east + north * north);
    if along <= 0 || whole <= along {
        return None;
    }
    let foot = segment.at(i128::from(along), i128::from(whole));
    in_reach(foot).then_some(foot)
}
