//! Decks of load modules against the polygons that bridges were decided to have.

use std::collections::{BTreeMap, BTreeSet};

use fidelity::DeckFigures;
use job::Job;
use terrain::{FeatureSurface, LatticePoint, ModuleVertex, QUANTA_PER_METRE};

use super::square::{At, Square, is_on, turn};
use super::total::LevelSums;

/// Quanta that rounding may put a deck above the ground onto which it was raised: 5 cm.
const ROUNDING: f64 = 6.4;

/// Square quanta of the least piece that a deck and a triangle of the ground have in common.
const AREA_MIN: f64 = 0.5;

const OF_NONE: &str = "a corner of decks is that of no bridge";

/// What all decks come to, in words: square metres and the least height over each class of ways
/// and water at the finest level, and what
/// lies under the ground at the level that has most of it. That limits and the ground left some there is no damage.
pub(crate) fn told(levels: &[LevelSums], job: &Job) -> Option<String> {
    let classes = job.class_names();
    let by_level: Vec<&DeckFigures> = levels.iter().map(|sums| &sums.decks).collect();
    let worst = by_level.iter().max_by_key(|figures| (figures.under, figures.deepest))?;
    let all = by_level[0];
    let metres = |quanta: f64| quanta / f64::from(QUANTA_PER_METRE);
    let under = match worst.under {
        0 => "none of them under the ground".to_owned(),
        some => format!("{some} of them under the ground, by {:.2} m at most", metres(worst.deepest.into())),
    };
    let least = all.clearance.iter().filter_map(|(class, quanta)| {
        let name = classes.get(usize::from(*class)).filter(|_| job.is_of_features(*class))?;
        Some(format!("{:.2} m above {name}", metres((*quanta).into())))
    });
    let least: Vec<String> = least.collect();
    let least = if least.is_empty() { String::new() } else { format!("; at least {}", least.join(", ")) };
    (0 < all.samples).then(|| format!("{} square metres, {under}{least}", all.samples))
}

/// What is wrong with the decks of a load module: corners that are not there, corners of no deck, corners that are
/// higher than bridges are and ground beneath them asks for, or less or more than the polygons cover.
pub(crate) fn wrong_decks(
    decks: &[FeatureSurface],
    at: &dyn Fn(LatticePoint) -> At,
    square: &Square,
) -> Option<String> {
    let decks: Vec<Deck> = decks.iter().map(|deck| Deck::of(at, deck)).collect();
    let found = &square.module.decks;
    // Of a ring that crosses itself it is not said what a deck has.
    if decks.iter().any(|deck| !deck.is_simple() && deck.touches(square)) {
        return None;
    }
    let inner = |y: u16, x: u16| 0 < y && y < square.module.side && 0 < x && x < square.module.side;
    let mut expected: BTreeMap<(At, u8), BTreeSet<i32>> = BTreeMap::new();
    for ((at, height), class) in decks.iter().flat_map(|deck| deck.ring.iter().map(|corner| (*corner, deck.class))) {
        expected.entry((at, class)).or_default().insert(height);
    }
    let needed: BTreeSet<(At, i32)> = decks.iter().flat_map(Deck::turns).collect();
    let mut seen: BTreeMap<At, i32> = BTreeMap::new();
    // Corners that are higher than any of their bridges, and whether a triangle of theirs rests on the ground.
    let mut raised: BTreeMap<u16, bool> = BTreeMap::new();
    for (triangle, class) in found.triangles.iter().zip(&found.classes) {
        let above = height_above(square, triangle.map(|v| found.vertices[usize::from(v)]));
        for &v in triangle {
            let vertex = found.vertices[usize::from(v)];
            if !inner(vertex.y, vertex.x) {
                continue;
            }
            let at = square.at(vertex.y, vertex.x);
            let told = expected.get(&(at, *class)).cloned().unwrap_or_else(|| {
                decks.iter().filter(|deck| deck.class == *class && deck.holds(at)).flat_map(Deck::reach).collect()
            });
            if told.first().is_none_or(|least| vertex.z < *least) {
                return Some(OF_NONE.to_owned());
            }
            if !told.contains(&vertex.z) {
                *raised.entry(v).or_default() |= above <= ROUNDING;
            }
            let highest = seen.entry(at).or_insert(vertex.z);
            *highest = (*highest).max(vertex.z);
        }
    }
    if raised.values().any(|rests| !rests) {
        return Some(format!("{OF_NONE}, and no ground stands so high"));
    }
    let [south, west, north, east] = square.reach();
    let is_inside = |(y, x): At| south < y && y < north && west < x && x < east;
    let is_missing = |at: &At, height: &i32| seen.get(at).is_none_or(|highest| highest < height);
    let missing = needed.iter().filter(|(at, height)| is_inside(*at) && is_missing(at, height)).count();
    if 0 < missing {
        return Some(format!("lacks {missing} corners of decks of bridges"));
    }
    let told: f64 = once(&decks).map(|deck| deck.area_in(square)).sum();
    let covered: f64 = found.triangles.iter().map(|&triangle| found.doubled_area(triangle) as f64 / 2.0).sum();
    // Where a line of load modules cuts a deck, a corner is rounded to a quantum.
    let rounding: f64 = decks.iter().filter(|deck| deck.touches(square)).map(Deck::perimeter).sum();
    let is_other = rounding < (told - covered).abs();
    is_other.then(|| "its decks cover not what the bridges do".to_owned())
}

/// How high a triangle of decks is above the ground at least, in quanta.
fn height_above(square: &Square, deck: [ModuleVertex; 3]) -> f64 {
    let at = |vertex: ModuleVertex| [f64::from(vertex.y), f64::from(vertex.x)];
    let deck = deck.map(|vertex| (at(vertex), f64::from(vertex.z)));
    let mut least = f64::INFINITY;
    for ground in &square.module.triangles {
        let ground = ground.map(|v| square.module.vertices[usize::from(v)]).map(|v| (at(v), f64::from(v.z)));
        let apart = |axis: usize| {
            let span = |of: [([f64; 2], f64); 3]| of.map(|(at, _)| at[axis]);
            let (one, other) = (span(deck), span(ground));
            one.iter().all(|a| other.iter().all(|b| a <= b)) || one.iter().all(|a| other.iter().all(|b| b <= a))
        };
        if apart(0) || apart(1) {
            continue;
        }
        let mut common: Vec<[f64; 2]> = deck.map(|(at, _)| at).to_vec();
        for side in 0..3 {
            let [from, to] = [ground[side].0, ground[(side + 1) % 3].0];
            common = half(&common, |at| doubled(from, to, at));
        }
        let area: f64 = (2..common.len()).map(|next| doubled(common[0], common[next - 1], common[next])).sum();
        let heights =
            common.iter().filter(|_| AREA_MIN <= area).map(|at| height_in(deck, *at) - height_in(ground, *at));
        least = heights.fold(least, f64::min);
    }
    least
}

/// Twice the area of a triangle of places, north before east: positive where it turns left.
fn doubled(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
}

/// The height of a triangle's plane at a place.
fn height_in([(a, of_a), (b, of_b), (c, of_c)]: [([f64; 2], f64); 3], at: [f64; 2]) -> f64 {
    (of_a * doubled(b, c, at) + of_b * doubled(c, a, at) + of_c * doubled(a, b, at)) / doubled(a, b, c)
}

/// Decks but for repeated ones.
fn once(decks: &[Deck]) -> impl Iterator<Item = &Deck> {
    let mut seen = BTreeSet::new();
    decks.iter().filter(move |deck| {
        let mut corners = deck.ring.clone();
        corners.sort_unstable();
        seen.insert(corners)
    })
}

struct Deck {
    class: u8,
    ring: Vec<(At, i32)>,
}

impl Deck {
    fn of(at: &dyn Fn(LatticePoint) -> At, surface: &FeatureSurface) -> Self {
        let ring = surface.ring.iter().map(|vertex| (at(vertex.at), vertex.height)).collect();
        Self { class: surface.class, ring }
    }

    /// Corners at which it turns: no triangle needs the others.
    fn turns(&self) -> Vec<(At, i32)> {
        let (ring, count) = (&self.ring, self.ring.len());
        let turns = |at: &usize| turn(ring[(at + count - 1) % count].0, ring[*at].0, ring[(at + 1) % count].0) != 0;
        (0..count).filter(turns).map(|at| ring[at]).collect()
    }

    fn edges(&self) -> Vec<[At; 2]> {
        (0..self.ring.len()).map(|at| [self.ring[at].0, self.ring[(at + 1) % self.ring.len()].0]).collect()
    }

    /// Whether no two edges have anything in common but the corner between neighbours.
    fn is_simple(&self) -> bool {
        let edges = self.edges();
        let count = edges.len();
        let touch = |[a, b]: [At; 2], [c, d]: [At; 2]| {
            let across = |p, q, r, s| turn(p, q, r).signum() * turn(p, q, s).signum() < 0;
            (across(a, b, c, d) && across(c, d, a, b))
                || is_on(a, b, c)
                || is_on(a, b, d)
                || is_on(c, d, a)
                || is_on(c, d, b)
        };
        let turns_back = |at: usize| {
            let ([a, b], [_, c]) = (edges[at], edges[(at + 1) % count]);
            a == b || is_on(a, b, c) || is_on(b, c, a)
        };
        let far = |one: usize, other: usize| one + 1 != other && (other + 1) % count != one;
        3 <= count
            && !(0..count).any(turns_back)
            && !(0..count).any(|one| (one + 1..count).any(|other| far(one, other) && touch(edges[one], edges[other])))
    }

    /// Whether a place lies in it, or as near to its edges as rounding puts it.
    fn holds(&self, at: At) -> bool {
        let crosses = |[a, b]: &&[At; 2]| (a.0 <= at.0) != (b.0 <= at.0) && (turn(*a, *b, at) < 0) == (b.0 < a.0);
        let edges = self.edges();
        edges.iter().filter(crosses).count() % 2 == 1 || edges.iter().any(|edge| from_edge(*edge, at) <= 2.0)
    }

    /// All heights between its own, as rounding puts them.
    fn reach(&self) -> std::ops::RangeInclusive<i32> {
        let heights = || self.ring.iter().map(|(_, height)| *height);
        heights().min().unwrap_or(0) - 1..=heights().max().unwrap_or(0) + 1
    }

    fn touches(&self, square: &Square) -> bool {
        let [south, west, north, east] = square.reach();
        let span = |of: fn(&At) -> i64| {
            let all = self.ring.iter().map(move |(at, _)| of(at));
            (all.clone().min().unwrap_or(0), all.max().unwrap_or(0))
        };
        let ((low, high), (left, right)) = (span(|at| at.0), span(|at| at.1));
        low <= north && south <= high && left <= east && west <= right
    }

    fn perimeter(&self) -> f64 {
        let length = |[a, b]: &[At; 2]| ((b.0 - a.0) as f64).hypot((b.1 - a.1) as f64);
        self.edges().iter().map(length).sum::<f64>() * 2.0 + 8.0
    }

    /// Square quanta of it that lie in a load module.
    fn area_in(&self, square: &Square) -> f64 {
        let [south, west, north, east] = square.reach().map(|line| line as f64);
        // From its south-west corner, for the sake of digits.
        let mut ring: Vec<[f64; 2]> =
            self.ring.iter().map(|((y, x), _)| [*y as f64 - south, *x as f64 - west]).collect();
        for (axis, line, sign) in [(0, 0.0, 1.0), (0, north - south, -1.0), (1, 0.0, 1.0), (1, east - west, -1.0)] {
            ring = half(&ring, |at| sign * (at[axis] - line));
        }
        let cross = |at: usize| {
            let (a, b) = (ring[at], ring[(at + 1) % ring.len()]);
            a[1] * b[0] - a[0] * b[1]
        };
        ((0..ring.len()).map(cross).sum::<f64>() / 2.0).abs()
    }
}

/// Quanta from a place to an edge.
fn from_edge([a, b]: [At; 2], at: At) -> f64 {
    let [along, across] =
        [[b.0 - a.0, b.1 - a.1], [at.0 - a.0, at.1 - a.1]].map(|step| step.map(|quanta| quanta as f64));
    let whole = along[0] * along[0] + along[1] * along[1];
    let share = ((along[0] * across[0] + along[1] * across[1]) / whole.max(1.0)).clamp(0.0, 1.0);
    (across[0] - share * along[0]).hypot(across[1] - share * along[1])
}

/// What of a ring lies where `above` is not negative. What remains of one that turns inwards may run to and fro along
/// the line, which adds nothing to its area.
fn half(ring: &[[f64; 2]], above: impl Fn([f64; 2]) -> f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::with_capacity(ring.len() + 2);
    for (at, &here) in ring.iter().enumerate() {
        let next = ring[(at + 1) % ring.len()];
        let (from, to) = (above(here), above(next));
        if 0.0 <= from {
            kept.push(here);
        }
        if from * to < 0.0 {
            let share = from / (from - to);
            kept.push([here[0] + share * (next[0] - here[0]), here[1] + share * (next[1] - here[1])]);
        }
    }
    kept
}
