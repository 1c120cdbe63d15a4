//! Decks of load modules against the polygons that bridges were decided to have.

use std::collections::{BTreeMap, BTreeSet};

use terrain::{FeatureSurface, LatticePoint};

use super::square::{At, Square, is_on, turn};

/// What is wrong with the decks of a load module: corners that are not there, corners of no deck, or less or more than
/// the polygons cover.
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
    let mut expected: BTreeMap<(At, i32), BTreeSet<u8>> = BTreeMap::new();
    for (corner, class) in decks.iter().flat_map(|deck| deck.ring.iter().map(|corner| (*corner, deck.class))) {
        expected.entry(corner).or_default().insert(class);
    }
    let needed: BTreeSet<(At, i32)> = decks.iter().flat_map(Deck::turns).collect();
    let corner = |v: u16| {
        let vertex = found.vertices[usize::from(v)];
        (square.at(vertex.y, vertex.x), vertex.z)
    };
    let mut seen: BTreeSet<(At, i32)> = BTreeSet::new();
    for (triangle, class) in found.triangles.iter().zip(&found.classes) {
        for &v in triangle {
            let vertex = found.vertices[usize::from(v)];
            if !inner(vertex.y, vertex.x) {
                continue;
            }
            if !expected.get(&corner(v)).is_some_and(|classes| classes.contains(class)) {
                return Some("a corner of decks is that of no bridge".to_owned());
            }
            seen.insert(corner(v));
        }
    }
    let [south, west, north, east] = square.reach();
    let is_inside = |(y, x): At| south < y && y < north && west < x && x < east;
    let missing = needed.iter().filter(|(at, height)| is_inside(*at) && !seen.contains(&(*at, *height))).count();
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
