//! Decks raised where triangles of the ground stand above them.
//!
//! A TIN has few points under a bridge, and may stand above it where the DEM does not. Corners of decks rise there, but
//! for those at ends of bridges, which stay on the ground. Where the others lie too far off, a corner is added, as
//! limits leave room for a few in each load module; where that is not enough, all of them rise.
//! On the sides of a load module they rise by what is on the side alone, so that both load modules of a line raise the
//! same corners by as much, whatever either has inside.

use std::collections::{BTreeMap, BTreeSet};

use terrain::geometry::{in_circle, orient};
use terrain::{Decks, LatticePoint, LoadModule, ModuleLine, ModuleVertex};

/// Quanta that a deck may lie under the ground, as rounding puts it.
const ROUNDING: f64 = 1.0;

/// What is taken from heights before they are rounded up, so that the last digits do not decide.
const DIGITS: f64 = 1e-6;

/// Square quanta of the least piece that is one.
const AREA_MIN: f64 = 1.0;

/// The least part of what is missing at a place that the corners which may rise have to bear at first: where they lie
/// farther off, they would have to rise far beyond the ground, and one is added.
const SHARE_MIN: f64 = 0.5;

/// The same where there is no room for one, and corners at ends of decks rise, too.
const SHARE_MIN_FREE: f64 = 0.1;

/// The same at last, when no corner can be added: a deck that rises steeply is better than one in the ground.
const SHARE_MIN_LAST: f64 = 0.3;

/// Quanta that a corner at an end of a deck may rise above the ground there, where no corner can be added: half a
/// metre, which a vehicle climbs.
const STEP_MAX: f64 = 64.0;

/// How often all places are gone through at most where no corner can be added.
const LAST_TIMES: usize = 4;

/// The least part of a height that a corner has to make up to have a say in it.
const WEIGHT_MIN: f64 = 1e-9;

/// Quanta under the ground for which a corner is added.
pub(super) const ADDED_FOR: f64 = 4.0;

/// The decks of a load module, raised onto the triangles of the ground that stand above them as far as corners reach,
/// with at most so many triangles. They belong to `bridges`, of which the load module need not have lines.
pub fn lift_decks(drawn: &Decks, bridges: &[ModuleLine], ground: &LoadModule, most: usize) -> Decks {
    let mut decks = drawn.clone();
    // Places where corners rise wherever they are.
    let mut free: BTreeSet<[u16; 2]> = BTreeSet::new();
    loop {
        let mut lift = Lift::of(ground, &decks, bridges);
        let mut reaches = lift.reaches(ground);
        let [usual, last] = [lift.usual(&free), lift.last(&reaches)];
        lift.raise_inside(&mut reaches, &usual);
        let mut far: Vec<&Reach> = reaches.iter().filter(|reach| ADDED_FOR < reach.missing).collect();
        far.sort_by(|one, other| other.missing.total_cmp(&one.missing));
        let has_room = decks.triangles.len() < most;
        let more = far.iter().filter(|_| has_room).find_map(|reach| {
            // On a rim a corner adds one triangle, elsewhere two.
            with_corner((drawn, &decks), reach, ground.side).filter(|more| more.triangles.len() <= most)
        });
        if let Some(more) = more {
            decks = more;
            continue;
        }
        let before = free.len();
        let corners = far.iter().flat_map(|reach| decks.triangles[reach.triangle]);
        free.extend(corners.map(|corner| place(decks.vertices[usize::from(corner)])));
        if before == free.len() {
            for _ in 0..LAST_TIMES {
                if reaches.iter().any(|reach| ADDED_FOR < reach.missing) {
                    lift.raise_inside(&mut reaches, &last);
                }
            }
            return lift.raised();
        }
    }
}

/// How far the ground stands above decks at most, in quanta.
pub(super) fn deepest(decks: &Decks, ground: &LoadModule) -> f64 {
    let reaches = Lift::of(ground, decks, &[]).reaches(ground);
    reaches.iter().map(|reach| reach.missing).fold(0.0, f64::max)
}

/// Decks with one more corner at a place of a triangle, and of its neighbour where it lies on an edge; nothing where
/// that is a corner or close to one that was drawn, or on a side of the load module.
fn with_corner((drawn, decks): (&Decks, &Decks), reach: &Reach, side: u16) -> Option<Decks> {
    let corners = |triangle: &[u16; 3]| triangle.map(|corner| decks.vertices[usize::from(corner)]);
    let of = corners(&decks.triangles[reach.triangle]);
    let at = [0, 1].map(|axis| (dot(of.map(|vertex| at(vertex)[axis]), reach.weights) + 0.5).floor() as u16);
    let plane = dot(of.map(|vertex| f64::from(vertex.z)), weights(of, at.map(f64::from)));
    let added = ModuleVertex { y: at[1], x: at[0], z: (plane + 0.5).floor() as i32 };
    let is_close = |corner: &ModuleVertex| apart(self::at(*corner), at.map(f64::from)) < APART_MIN;
    let is_corner = drawn.vertices.iter().any(is_close) || decks.vertices.iter().any(|corner| place(*corner) == at);
    if is_corner || at.iter().any(|along| *along == 0 || *along == side) {
        return None;
    }
    let is_near = |&[from, to]: &[ModuleVertex; 2]| {
        let [from, to] = [from, to].map(self::at);
        cross(from, to, at.map(f64::from)).abs() <= EDGE * apart(from, to)
    };
    let edges = |of: [ModuleVertex; 3]| [[of[0], of[1]], [of[1], of[2]], [of[2], of[0]]];
    let split = edges(of).into_iter().find(is_near);
    let mut soup = Vec::with_capacity(decks.triangles.len() + 2);
    let mut around = Vec::new();
    for (number, (triangle, class)) in decks.triangles.iter().zip(&decks.classes).enumerate() {
        let own = corners(triangle);
        let is_split = |edge: &[ModuleVertex; 2]| split.is_some_and(|[a, b]| *edge == [a, b] || *edge == [b, a]);
        if number == reach.triangle || edges(own).iter().any(is_split) {
            let rest = edges(own).into_iter().filter(|edge| !is_split(edge));
            around.extend(rest.map(|[from, to]| ([from, to, added], *class)));
        } else {
            soup.push((own, *class));
        }
    }
    let is_turned = |[a, b, c]: &[ModuleVertex; 3]| 0.0 < cross(self::at(*a), self::at(*b), self::at(*c));
    around.iter().all(|(corners, _)| is_turned(corners)).then(|| {
        flip_around(&mut around, &mut soup);
        Decks::of_triangles(around.into_iter().chain(soup))
    })
}

/// Corners of a triangle of decks, and its class.
type DeckTriangle = ([ModuleVertex; 3], u8);

/// Flips edges until triangles around a corner, which is the last of each, are those of Delaunay (Lawson 1977): they
/// take what they gain from the rest.
fn flip_around(around: &mut Vec<DeckTriangle>, rest: &mut Vec<DeckTriangle>) {
    let mut settled = 0;
    while let Some(&([from, to, corner], class)) = around.get(settled) {
        let has = |(of, other): &DeckTriangle| *other == class && of.contains(&from) && of.contains(&to);
        let mut across = rest.iter().enumerate().filter(|(_, of)| has(of));
        let (Some((at, &(of, _))), None) = (across.next(), across.next()) else {
            settled += 1;
            continue;
        };
        let far = of.into_iter().find(|vertex| ![from, to].contains(vertex)).unwrap_or(corner);
        let place = |vertex: ModuleVertex| LatticePoint::new(i32::from(vertex.y), i32::from(vertex.x));
        let [a, b, c, d] = [from, to, corner, far].map(place);
        let is_convex = [[b, a, d], [a, d, c], [d, b, c]].into_iter().all(|[a, b, c]| 0 < orient(a, b, c));
        if is_convex && 0 < in_circle(a, b, c, d) {
            rest.swap_remove(at);
            around[settled] = ([from, far, corner], class);
            around.push(([far, to, corner], class));
        } else {
            settled += 1;
        }
    }
}

/// Quanta from an edge within which a place lies on it.
const EDGE: f64 = 2.0;

/// Quanta between a corner that was drawn and one that is added at least, which is half a metre.
const APART_MIN: f64 = 64.0;

/// Decks, and the heights that their vertices have come to.
struct Lift<'a> {
    decks: &'a Decks,
    heights: Vec<f64>,
    /// Which vertices are inside of the load module: those on its sides stay as they are.
    are_inside: Vec<bool>,
    /// Of vertices at ends of decks on the ground, its height there.
    ends: Vec<Option<f64>>,
    /// The highest that the ground is.
    top: f64,
}

/// How far vertices of decks may rise.
struct Bounds {
    /// How high at most.
    most: Vec<f64>,
    /// What the corners of a triangle have to bear together of what is missing at a place, by the least of theirs.
    share_min: Vec<f64>,
}

/// A place of the ground that a triangle of decks has to reach.
struct Reach {
    /// How far the triangle is below it.
    missing: f64,
    triangle: usize,
    /// What of the height there each corner of the triangle makes up.
    weights: [f64; 3],
    height: f64,
}

impl<'a> Lift<'a> {
    /// Decks whose vertices on the sides have been raised onto the ground.
    fn of(ground: &LoadModule, decks: &'a Decks, bridges: &[ModuleLine]) -> Self {
        let heights = decks.vertices.iter().map(|vertex| f64::from(vertex.z)).collect();
        let is_inside = |vertex: &ModuleVertex| place(*vertex).iter().all(|at| 0 < *at && *at < ground.side);
        let are_inside = decks.vertices.iter().map(is_inside).collect();
        let ends = decks.vertices.iter().map(|vertex| at_end(*vertex, bridges, ground)).collect();
        let top = top(ground.vertices.iter().map(|vertex| f64::from(vertex.z)));
        let mut lift = Self { decks, heights, are_inside, ends, top };
        lift.raise_sides(ground);
        lift
    }

    /// Raises vertices on the sides onto the ground there, and both ends of an edge along a side so far that it clears
    /// the vertices of the ground between them.
    fn raise_sides(&mut self, ground: &LoadModule) {
        for (axis, line) in [(0, 0), (0, ground.side), (1, 0), (1, ground.side)] {
            let along = |vertex: &ModuleVertex| f64::from(place(*vertex)[1 - axis]);
            let is_on = |vertex: &&ModuleVertex| place(**vertex)[axis] == line;
            let mut side: Vec<[f64; 2]> =
                ground.vertices.iter().filter(is_on).map(|vertex| [along(vertex), f64::from(vertex.z)]).collect();
            side.sort_by(|one, other| one[0].total_cmp(&other[0]));
            for (vertex, height) in self.decks.vertices.iter().zip(&mut self.heights).filter(|(at, _)| is_on(at)) {
                *height = height.max(height_along(&side, along(vertex)) - ROUNDING);
            }
            let top = top(side.iter().map(|vertex| vertex[1]));
            let mut raised = self.heights.clone();
            for triangle in &self.decks.triangles {
                for ends in [[0, 1], [1, 2], [2, 0]].map(|ends| ends.map(|end| usize::from(triangle[end]))) {
                    let [from, to] = ends.map(|end| &self.decks.vertices[end]);
                    if !is_on(&from) || !is_on(&to) {
                        continue;
                    }
                    let edge = ends.map(|end| [along(&self.decks.vertices[end]), self.heights[end]]);
                    let missing = missing_between(edge, &side);
                    // Where four load modules meet, two of them have nothing of this side.
                    let is_shared =
                        |end: &usize| ![0, ground.side].contains(&place(self.decks.vertices[*end])[1 - axis]);
                    for end in ends.into_iter().filter(is_shared) {
                        raised[end] = raised[end].max((self.heights[end] + missing).min(self.cap(end, top)));
                    }
                }
            }
            self.heights = raised;
        }
    }

    /// The places of the ground that stand above triangles of decks, the highest above them first.
    fn reaches(&self, ground: &LoadModule) -> Vec<Reach> {
        let boxes: Vec<[u16; 4]> = ground.triangles.iter().map(|triangle| bounds(triangle, &ground.vertices)).collect();
        let mut reaches = Vec::new();
        for number in 0..self.decks.triangles.len() {
            let [west, east, south, north] = bounds(&self.decks.triangles[number], &self.decks.vertices);
            for (beneath, of) in ground.triangles.iter().zip(&boxes) {
                if of[0] < east && west < of[1] && of[2] < north && south < of[3] {
                    self.reach(number, beneath.map(|corner| ground.vertices[usize::from(corner)]), &mut reaches);
                }
            }
        }
        reaches.sort_by(|one, other| other.missing.total_cmp(&one.missing).then(one.triangle.cmp(&other.triangle)));
        reaches
    }

    /// How vertices may rise at first: inside to their cap, unless they are held where a deck ends and are not free.
    fn usual(&self, free: &BTreeSet<[u16; 2]>) -> Bounds {
        let is_free: Vec<bool> = self.decks.vertices.iter().map(|vertex| free.contains(&place(*vertex))).collect();
        let most = |at: usize| match (self.are_inside[at], self.ends[at]) {
            (false, _) => self.heights[at],
            (_, Some(ground)) => {
                let step = if is_free[at] { STEP_MAX } else { 0.0 };
                self.heights[at].max(ground - ROUNDING + step)
            }
            _ => self.cap(at, self.top),
        };
        let share = |is_free: &bool| if *is_free { SHARE_MIN_FREE } else { SHARE_MIN };
        Bounds { most: (0..is_free.len()).map(most).collect(), share_min: is_free.iter().map(share).collect() }
    }

    /// How vertices may rise where no corner can be added: inside by what the place that asks them for most needs
    /// of them, and by no more than it misses where they lie too far off; on sides not at all.
    fn last(&self, reaches: &[Reach]) -> Bounds {
        let mut most = self.heights.clone();
        for reach in reaches {
            let corners = self.decks.triangles[reach.triangle].map(usize::from);
            let shares = [0, 1, 2].map(|at| if self.are_inside[corners[at]] { reach.weights[at] } else { 0.0 });
            let share = dot(shares, shares).sqrt();
            let rise = if share < SHARE_MIN_LAST { reach.missing } else { reach.missing / share };
            for corner in corners.into_iter().filter(|corner| self.are_inside[*corner]) {
                most[corner] = most[corner].max(self.heights[corner] + rise);
            }
        }
        for ((most, height), ground) in most.iter_mut().zip(&self.heights).zip(&self.ends) {
            *most = ground.map_or(*most, |ground| most.min(height.max(ground - ROUNDING + STEP_MAX)));
        }
        Bounds { share_min: vec![SHARE_MIN_LAST; most.len()], most }
    }

    /// Raises vertices until every triangle reaches the ground beneath it, each at most so high, and says what each
    /// place still misses.
    fn raise_inside(&mut self, reaches: &mut [Reach], Bounds { most, share_min }: &Bounds) {
        for &Reach { triangle, weights, height, .. } in reaches.iter() {
            let corners = self.decks.triangles[triangle].map(usize::from);
            let missing = height - self.height_at(triangle, weights);
            let has_room = |corner: usize| self.heights[corner] < most[corner];
            let shares = [0, 1, 2].map(|at| if has_room(corners[at]) { weights[at] } else { 0.0 });
            let share_min = corners.map(|corner| share_min[corner]).into_iter().fold(1.0, f64::min);
            // The least rise of all together that does it.
            let squares = dot(shares, shares).max(share_min * share_min);
            for at in (0..3).filter(|_| 0.0 < missing) {
                let height = &mut self.heights[corners[at]];
                *height = (*height + missing * shares[at] / squares).min(most[corners[at]]);
            }
        }
        self.lower_inside(reaches);
        for reach in reaches {
            reach.missing = reach.height - self.height_at(reach.triangle, reach.weights);
        }
    }

    /// The height of a triangle of decks, as it has become, at a place.
    fn height_at(&self, triangle: usize, weights: [f64; 3]) -> f64 {
        dot(self.decks.triangles[triangle].map(|corner| self.heights[usize::from(corner)]), weights)
    }

    /// The decks as they have become.
    fn raised(&self) -> Decks {
        let raised = |(vertex, height): (&ModuleVertex, &f64)| {
            let z = (height - DIGITS).ceil() as i32;
            ModuleVertex { z, ..*vertex }
        };
        let vertices: Vec<ModuleVertex> = self.decks.vertices.iter().zip(&self.heights).map(raised).collect();
        let corners = self.decks.triangles.iter().map(|triangle| triangle.map(|corner| vertices[usize::from(corner)]));
        Decks::of_triangles(corners.zip(self.decks.classes.iter().copied()))
    }

    /// Lowers vertices inside again as far as each may alone.
    fn lower_inside(&mut self, reaches: &[Reach]) {
        let corners = |reach: &Reach| self.decks.triangles[reach.triangle].map(usize::from);
        let mut of: BTreeMap<usize, Vec<&Reach>> = BTreeMap::new();
        for reach in reaches {
            corners(reach).into_iter().for_each(|corner| of.entry(corner).or_default().push(reach));
        }
        for (vertex, reaches) in of.into_iter().filter(|(vertex, _)| self.are_inside[*vertex]) {
            let mut least = f64::from(self.decks.vertices[vertex].z);
            for reach in reaches {
                let (corners, weights, height) = (corners(reach), reach.weights, reach.height);
                for at in (0..3).filter(|at| corners[*at] == vertex && WEIGHT_MIN < weights[*at]) {
                    let all = self.height_at(reach.triangle, weights);
                    least = least.max(self.heights[vertex] + (height - all) / weights[at]);
                }
            }
            self.heights[vertex] = self.heights[vertex].min(least);
        }
    }

    /// How high a vertex may be raised at most where the ground is nowhere higher than this: no farther above that than
    /// it lies below.
    fn cap(&self, vertex: usize, top: f64) -> f64 {
        self.heights[vertex].max(2.0 * top - f64::from(self.decks.vertices[vertex].z))
    }

    /// Adds the corners of what a triangle of decks and one of the ground have in common, where that is above.
    fn reach(&self, triangle: usize, ground: [ModuleVertex; 3], reaches: &mut Vec<Reach>) {
        let deck = self.decks.triangles[triangle].map(|corner| self.decks.vertices[usize::from(corner)]);
        for at in common(deck, ground) {
            let weights = weights(deck, at);
            let height = dot(ground.map(|vertex| f64::from(vertex.z)), self::weights(ground, at)) - ROUNDING;
            let missing = height - self.height_at(triangle, weights);
            if 0.0 < missing {
                reaches.push(Reach { missing, triangle, weights, height });
            }
        }
    }
}

/// The height of the ground at a vertex where a deck ends on it: beside an end of a bridge's line, within its width.
fn at_end(vertex: ModuleVertex, bridges: &[ModuleLine], ground: &LoadModule) -> Option<f64> {
    let is_inside = |end: &ModuleVertex| place(*end).iter().all(|at| 0 < *at && *at < ground.side);
    let is_beside = |line: &ModuleLine| {
        let reach = END_PART * f64::from(line.width);
        let ends = [line.vertices.first(), line.vertices.last()].into_iter().flatten();
        ends.filter(|end| is_inside(end)).any(|end| apart(at(*end), at(vertex)) <= reach)
    };
    if !bridges.iter().any(is_beside) {
        return None;
    }
    let triangles = ground.triangles.iter().map(|triangle| triangle.map(|at| ground.vertices[usize::from(at)]));
    triangles.into_iter().find_map(|triangle| {
        let weights = weights(triangle, at(vertex));
        let is_in = weights.iter().all(|weight| -WEIGHT_MIN < *weight);
        is_in.then(|| dot(triangle.map(|corner| f64::from(corner.z)), weights))
    })
}

/// How far from an end of a bridge's line its corners are at most, as a part of its width.
const END_PART: f64 = 0.75;

/// The highest of heights of the ground.
fn top(heights: impl Iterator<Item = f64>) -> f64 {
    heights.fold(f64::NEG_INFINITY, f64::max)
}

fn place(vertex: ModuleVertex) -> [u16; 2] {
    [vertex.x, vertex.y]
}

pub(super) fn at(vertex: ModuleVertex) -> [f64; 2] {
    place(vertex).map(f64::from)
}

pub(super) fn apart(one: [f64; 2], other: [f64; 2]) -> f64 {
    (other[0] - one[0]).hypot(other[1] - one[1])
}

pub(super) fn dot(one: [f64; 3], other: [f64; 3]) -> f64 {
    (0..3).map(|at| one[at] * other[at]).sum()
}

/// The height at a place along a side whose vertices are sorted.
fn height_along(side: &[[f64; 2]], along: f64) -> f64 {
    let after = side.partition_point(|vertex| vertex[0] <= along).clamp(1, side.len().max(2) - 1);
    match side.get(after - 1..=after) {
        Some(&[[from, low], [to, high]]) => low + (high - low) * (along - from) / (to - from),
        _ => f64::NEG_INFINITY,
    }
}

/// How far vertices of a side stand above an edge along it at most.
fn missing_between([one, other]: [[f64; 2]; 2], side: &[[f64; 2]]) -> f64 {
    let [from, to] = if one[0] < other[0] { [one, other] } else { [other, one] };
    let first = side.partition_point(|vertex| vertex[0] <= from[0]);
    let between = side[first..].iter().take_while(|vertex| vertex[0] < to[0]);
    let above = between.map(|[along, height]| height - ROUNDING - height_along(&[from, to], *along));
    above.fold(0.0, f64::max)
}

/// West, east, south and north of a triangle.
pub(super) fn bounds(triangle: &[u16; 3], vertices: &[ModuleVertex]) -> [u16; 4] {
    let [a, b, c] = triangle.map(|corner| vertices[usize::from(corner)]);
    let [west, south] = [a.x.min(b.x).min(c.x), a.y.min(b.y).min(c.y)];
    [west, a.x.max(b.x).max(c.x), south, a.y.max(b.y).max(c.y)]
}

/// What each corner of a triangle makes up of the height at a place.
pub(super) fn weights(triangle: [ModuleVertex; 3], place: [f64; 2]) -> [f64; 3] {
    let [a, b, c] = triangle.map(at);
    let whole = cross(a, b, c);
    let [of_b, of_c] = [cross(place, c, a) / whole, cross(a, b, place) / whole];
    [1.0 - of_b - of_c, of_b, of_c]
}

/// The corners of what two triangles have in common.
pub(super) fn common(deck: [ModuleVertex; 3], ground: [ModuleVertex; 3]) -> Vec<[f64; 2]> {
    let mut shape = deck.map(at).to_vec();
    let ground = ground.map(at);
    for side in 0..3 {
        shape = left_of(&shape, [ground[side], ground[(side + 1) % 3]]);
    }
    let area = (1..shape.len().max(2) - 1).map(|at| cross(shape[0], shape[at], shape[at + 1])).sum::<f64>();
    if area < AREA_MIN { Vec::new() } else { shape }
}

/// What of a convex shape lies to the left of a line.
fn left_of(shape: &[[f64; 2]], [from, to]: [[f64; 2]; 2]) -> Vec<[f64; 2]> {
    let mut kept = Vec::with_capacity(shape.len() + 1);
    for (at, &here) in shape.iter().enumerate() {
        let next = shape[(at + 1) % shape.len()];
        let [own, other] = [cross(from, to, here), cross(from, to, next)];
        if 0.0 <= own {
            kept.push(here);
        }
        if own * other < 0.0 {
            kept.push([0, 1].map(|axis| here[axis] + (next[axis] - here[axis]) * own / (own - other)));
        }
    }
    kept
}

pub(super) fn cross(from: [f64; 2], to: [f64; 2], at: [f64; 2]) -> f64 {
    (to[0] - from[0]) * (at[1] - from[1]) - (to[1] - from[1]) * (at[0] - from[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{LineForm, LineKind, LineStorey, LineTraits, ModuleId, check_decks};

    const SIDE: u16 = 12_800;

    fn vertex(x: u16, y: u16, z: i32) -> ModuleVertex {
        ModuleVertex { y, x, z }
    }

    /// A load module of four triangles about a hill in its middle, with a hump on its western side.
    fn hill(height: i32, hump: i32) -> LoadModule {
        let (side, middle) = (SIDE, SIDE / 2);
        let places =
            [(0, 0, 0), (side, 0, 0), (0, middle, hump), (middle, middle, height), (0, side, 0), (side, side, 0)];
        LoadModule {
            id: ModuleId { row: 0, col: 0 },
            side,
            vertices: places.map(|(x, y, z)| vertex(x, y, z)).to_vec(),
            triangles: vec![[0, 1, 3], [0, 3, 2], [1, 5, 3], [2, 3, 4], [3, 5, 4]],
            classes: vec![0; 5],
            polygon_count: 5,
            ..LoadModule::default()
        }
    }

    /// A deck at a height across the load module, from side to side, with two corners inside.
    fn deck(z: i32) -> Decks {
        let at = |(x, y)| vertex(x, y, z);
        let [a, b, c, d] = [(0, 6000), (6000, 6000), (6000, 6640), (0, 6640)].map(at);
        let [e, f] = [(SIDE, 6000), (SIDE, 6640)].map(at);
        Decks::of_triangles([([a, b, c], 3), ([a, c, d], 3), ([b, e, f], 3), ([b, f, c], 3)])
    }

    #[test]
    fn a_deck_above_the_ground_stays_as_it_is() {
        assert_eq!(lift_decks(&deck(2000), &[], &hill(1000, 0), 4), deck(2000));
    }

    #[test]
    fn a_deck_through_a_hill_rises_over_it_and_its_ends_stay() {
        let ground = hill(1000, 0);
        let lifted = lift_decks(&deck(500), &[], &ground, 4);
        assert_eq!((check_decks(&lifted, SIDE), lifted.triangles.len()), (Ok(()), 4));
        assert!(400.0 < deepest(&deck(500), &ground) && deepest(&lifted, &ground) == 0.0);
        assert!(lifted.vertices.contains(&vertex(0, 6000, 500)), "its ends stay");
        // The hill is 400 quanta beside its corners, and 6,400 from its end.
        assert!(lifted.vertices.iter().all(|vertex| vertex.z < 1100), "no higher than it has to: {lifted:?}");
    }

    #[test]
    fn a_corner_is_added_beneath_a_deck_whose_corners_are_too_far_off() {
        let ground = hill(3000, 0);
        let at = |(x, y)| vertex(x, y, 0);
        // From side to side, over the top of the hill.
        let [a, b, c, d] = [(0, 6390), (SIDE, 6390), (SIDE, 6410), (0, 6410)].map(at);
        let lifted = lift_decks(&Decks::of_triangles([([a, b, c], 3), ([a, c, d], 3)]), &[], &ground, 4);
        assert_eq!(check_decks(&lifted, SIDE), Ok(()));
        assert!((lifted.triangles.len(), lifted.vertices.len()) == (4, 5), "{lifted:?}");
        assert!(lifted.vertices.contains(&vertex(6400, 6400, 2999)), "{lifted:?}");
    }

    #[test]
    fn where_no_corner_can_be_added_a_deck_rises_steeply_rather_than_into_the_ground() {
        let ground = hill(3000, 0);
        // Its corners inside are far from the hill.
        let at = |(x, y)| vertex(x, y, 0);
        let [a, b, c, d] = [(0, 6390), (300, 6390), (300, 6410), (0, 6410)].map(at);
        let [e, f] = [(SIDE, 6390), (SIDE, 6410)].map(at);
        let decks = Decks::of_triangles([([a, b, c], 3), ([a, c, d], 3), ([b, e, c], 3), ([e, f, c], 3)]);
        let lifted = lift_decks(&decks, &[], &ground, 4);
        assert_eq!((check_decks(&lifted, SIDE), lifted.triangles.len()), (Ok(()), 4));
        let [before, after] = [&decks, &lifted].map(|decks| deepest(decks, &ground));
        assert!(2000.0 < before && after < ADDED_FOR, "{before} {after} {lifted:?}");
    }

    #[test]
    fn triangles_beside_a_corner_that_is_added_are_no_slivers() {
        // A ridge across a deck, close to one of its ends on the side of the load module, where corners stay.
        let at = |(x, y)| vertex(x, y, if x == 200 { 3000 } else { 0 });
        let places = [(0, 0), (200, 0), (400, 0), (SIDE, 0), (SIDE, SIDE), (400, SIDE), (200, SIDE), (0, SIDE)];
        let triangles = vec![[0, 1, 6], [0, 6, 7], [1, 2, 5], [1, 5, 6], [2, 3, 4], [2, 4, 5]];
        let mut ground = hill(0, 0);
        (ground.vertices, ground.triangles) = (places.map(at).to_vec(), triangles);
        let lifted = lift_decks(&deck(0), &[], &ground, 8);
        assert_eq!(check_decks(&lifted, SIDE), Ok(()));
        assert!(deepest(&lifted, &ground) <= ADDED_FOR, "{} {lifted:?}", deepest(&lifted, &ground));
        assert!(lifted.vertices.iter().all(|vertex| vertex.z < 3300), "{lifted:?}");
    }

    #[test]
    fn no_corner_rises_far_above_the_ground_that_stands_above_a_deck() {
        // A lip of 400 quanta close to the side, where corners stay, and no room for one more.
        let mut ground = hill(0, 0);
        ground.vertices[3] = vertex(20, 6400, 400);
        let lifted = lift_decks(&deck(0), &[], &ground, 2);
        // Several places ask for it, one after the other.
        assert!(lifted.vertices.iter().all(|vertex| vertex.z <= 3 * 400), "{lifted:?}");
    }

    #[test]
    fn on_the_side_of_a_load_module_a_deck_rises_by_what_is_there_alone() {
        let sides = |ground: &LoadModule| {
            let lifted = lift_decks(&deck(500), &[], ground, 4);
            assert!(deepest(&lifted, ground) == 0.0);
            lifted.vertices.into_iter().filter(|vertex| vertex.x == 0).collect::<Vec<ModuleVertex>>()
        };
        let heights: Vec<i32> = sides(&hill(0, 900)).iter().map(|vertex| vertex.z).collect();
        assert!(heights.iter().all(|height| 870 < *height), "{heights:?}");
        assert_eq!(sides(&hill(0, 900)), sides(&hill(1500, 900)));
    }

    #[test]
    fn ends_of_a_deck_stay_on_the_ground_and_corners_are_added_between_them() {
        let ground = hill(1000, 0);
        let [a, b, c, d] = [(2000, 6000), (10_800, 6000), (10_800, 6640), (2000, 6640)].map(|(x, y)| vertex(x, y, 313));
        let deck = Decks::of_triangles([([a, b, c], 3), ([a, c, d], 3)]);
        let highest_end = |lifted: &Decks| {
            let is_end = |vertex: &&ModuleVertex| [2000, 10_800].contains(&vertex.x);
            lifted.vertices.iter().filter(is_end).map(|vertex| vertex.z).max()
        };
        assert!(Some(600) < highest_end(&lift_decks(&deck, &[], &ground, 8)), "nothing says that they are ends");
        let traits = LineTraits {
            kind: LineKind::Travelled,
            form: LineForm::Strip,
            storey: LineStorey::Bridge,
            is_kept: true,
            is_in_ground: false,
            width: 640,
        };
        let vertices = vec![vertex(2000, 6320, 313), vertex(10_800, 6320, 313)];
        let lifted = lift_decks(&deck, &[traits.line(3, vertices)], &ground, 8);
        assert!(highest_end(&lifted) <= Some(320) && deepest(&lifted, &ground) <= ADDED_FOR, "{lifted:?}");
    }
}
