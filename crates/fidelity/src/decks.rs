//! How far decks stand above the ground, from triangles alone.

use std::collections::{BTreeMap, BTreeSet};

use terrain::{LineStorey, LoadModule, ModuleLine, ModuleVertex};

use crate::places::{each_under, height_in};

/// Quanta between places at which decks are sampled: a metre.
const SAMPLE: i32 = 128;

/// Quanta from the end of a bridge within which ways may lead onto it: 30 m.
const APART: f64 = 3840.0;

/// Quanta that a deck may lie under the ground on which it rests: 5 cm, which is what raising its corners leaves.
const ROUNDING: i32 = 6;

/// How far from an end of a bridge's line the corners of its deck there are at most, as a part of its width.
const END_PART: f64 = 0.75;

/// How far corners there may lie along the bridge at most, as a part of how far they lie from its end.
const ALONG_MAX: f64 = 0.5;

/// Quanta that the line of a bridge lies off the ground at most where the bridge ends on it: 25 cm.
const ON_GROUND: f64 = 32.0;

/// What lies under decks, a place in every square metre.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeckFigures {
    /// Places of decks that were looked at.
    pub samples: u64,
    /// Those of them at which the ground stands above the deck.
    pub under: u64,
    /// How far it does at most, there or between them, in quanta; 0 where it does at none of them.
    pub deepest: u32,
    /// The least height of a deck above what it crosses, by the class of that, in quanta: above ways and rivers where
    /// middle lines cross, or run below the deck 30 m and more from where bridges end, above level ground of a class
    /// that has no middle line, such as lakes, anywhere.
    pub clearance: BTreeMap<u8, i32>,
    /// The highest step onto a deck: how far a corner stands above the end of its bridge's line, where that ends on the
    /// ground, and above the ground under it, in quanta.
    pub step: u32,
    /// How steep a triangle of a deck is at most, of a square metre and more, in thousandths.
    pub steepest: u32,
    /// Ends of bridges from which no way goes on and which hang above the ground.
    pub hanging: u64,
    /// How far one does at most, in quanta.
    pub hangs: u32,
}

impl DeckFigures {
    /// Those of the decks of a load module.
    pub fn of(module: &LoadModule) -> Self {
        let places = samples(module);
        let mut figures = Self { samples: places.len() as u64, ..Self::default() };
        let mut above = vec![f64::INFINITY; places.len()];
        let of_lines: BTreeSet<u8> = module.lines.iter().map(|line| line.class).collect();
        let is_level = |triangle: usize| {
            let [a, b, c] = module.triangles[triangle].map(|corner| module.vertices[usize::from(corner)].z);
            a == b && b == c
        };
        each_under(module, f64::from(module.side), &places, &mut |index, triangle, plane| {
            let height = places[index][2] - plane;
            above[index] = above[index].min(height);
            let class = module.classes[triangle];
            if is_level(triangle) && !of_lines.contains(&class) {
                figures.add_clearance(class, height.floor() as i32);
            }
        });
        for (class, height) in crossed(&module.lines).into_iter().chain(passed(module)) {
            figures.add_clearance(class, height);
        }
        figures.step = highest_step(module);
        figures.steepest = steepest(module);
        for height in hanging(module) {
            figures.hanging += 1;
            figures.hangs = figures.hangs.max(height);
        }
        figures.under = above.iter().filter(|above| ROUNDING < -above.floor() as i32).count() as u64;
        if 0 < figures.under {
            figures.deepest = deepest(module);
        }
        figures
    }

    /// Adds those of others.
    pub fn merge(&mut self, other: &Self) {
        self.samples += other.samples;
        self.under += other.under;
        self.deepest = self.deepest.max(other.deepest);
        self.step = self.step.max(other.step);
        self.steepest = self.steepest.max(other.steepest);
        self.hanging += other.hanging;
        self.hangs = self.hangs.max(other.hangs);
        other.clearance.iter().for_each(|(&class, &least)| self.add_clearance(class, least));
    }

    fn add_clearance(&mut self, class: u8, height: i32) {
        let least = self.clearance.entry(class).or_insert(height);
        *least = height.min(*least);
    }
}

/// How far the ground stands above decks where it does most, in quanta: both are flat between edges, so that is at a
/// corner of one of them, or where their edges cross.
fn deepest(module: &LoadModule) -> u32 {
    type Corners = [[f64; 3]; 3];
    let corners = |vertices: &[ModuleVertex], triangle: &[u16; 3]| -> Corners {
        triangle.map(|corner| Segment::place(&vertices[usize::from(corner)]))
    };
    let sides = |[a, b, c]: Corners| [[a, b], [b, c], [c, a]].map(|places| Segment { places, is_end: [false; 2] });
    let is_apart = |one: &Corners, other: &Corners| {
        let lies_before = |one: &Corners, other: &Corners, axis: usize| {
            one.iter().all(|corner| other.iter().all(|beyond| corner[axis] < beyond[axis]))
        };
        [0, 1].into_iter().any(|axis| lies_before(one, other, axis) || lies_before(other, one, axis))
    };
    let mut least: f64 = 0.0;
    for deck in module.decks.triangles.iter().map(|triangle| corners(&module.decks.vertices, triangle)) {
        let ground = module.triangles.iter().map(|triangle| corners(&module.vertices, triangle));
        for ground in ground.filter(|ground| !is_apart(&deck, ground)) {
            let over = ground.iter().filter_map(|&[x, y, z]| Some(height_in(deck, [x, y])? - z));
            let below = deck.iter().filter_map(|&[x, y, z]| Some(z - height_in(ground, [x, y])?));
            let pairs = sides(deck).into_iter().flat_map(|deck| sides(ground).map(|ground| (deck, ground)));
            let crossing = pairs.filter_map(|(deck, ground)| deck.height_over(ground));
            least = over.chain(below).chain(crossing).fold(least, f64::min);
        }
    }
    -least.floor() as u32
}

/// Class of each line in the ground that the line of a bridge crosses, and how high the bridge passes over it, in
/// quanta: lines that meet at an end, as those of a bridge and of the way that goes on from it, do not cross.
fn crossed(lines: &[ModuleLine]) -> Vec<(u8, i32)> {
    let is_bridge = |line: &&ModuleLine| line.storey == LineStorey::Bridge && line.is_kept;
    let bridges: Vec<Segment> = lines.iter().filter(is_bridge).flat_map(segments).collect();
    let crossings = |line: &ModuleLine| -> Vec<(u8, i32)> {
        let pairs = segments(line).into_iter().flat_map(|under| bridges.iter().map(move |over| (over, under)));
        pairs.filter_map(|(over, under)| Some((line.class, over.height_over(under)?.floor() as i32))).collect()
    };
    lines.iter().filter(|line| is_below(line)).flat_map(crossings).collect()
}

/// Class of each line in the ground that runs under a deck, and how high the deck passes over it, in quanta, at a place
/// in every metre of it that lies apart from where bridges end: beside these, ways lead onto them.
fn passed(module: &LoadModule) -> Vec<(u8, i32)> {
    let deck = |triangle: &[u16; 3]| {
        let corners = triangle.map(|corner| module.decks.vertices[usize::from(corner)]);
        corners.map(|corner| [f64::from(corner.x), f64::from(corner.y), f64::from(corner.z)])
    };
    let decks: Vec<[[f64; 3]; 3]> = module.decks.triangles.iter().map(deck).collect();
    let bridges = module.lines.iter().filter(|line| line.storey == LineStorey::Bridge);
    let end = |vertex: &ModuleVertex| [f64::from(vertex.x), f64::from(vertex.y)];
    let ends: Vec<[f64; 2]> =
        bridges.flat_map(|line| line.vertices.first().into_iter().chain(line.vertices.last())).map(end).collect();
    let is_apart = |[x, y, _]: [f64; 3]| ends.iter().all(|end| APART < (x - end[0]).hypot(y - end[1]));
    let mut found = Vec::new();
    for line in module.lines.iter().filter(|line| is_below(line)) {
        for place in places_along(line).filter(|place| is_apart(*place)) {
            let over = decks.iter().filter_map(|deck| height_in(*deck, [place[0], place[1]]));
            found.extend(over.map(|height| (line.class, (height - place[2]).floor() as i32)));
        }
    }
    found
}

/// How steep a triangle of a deck is at most, in thousandths. Those of less than a square metre are slivers.
fn steepest(module: &LoadModule) -> u32 {
    let slope = |triangle: &[u16; 3]| {
        let corners = triangle.map(|corner| Segment::place(&module.decks.vertices[usize::from(corner)]));
        let [[ux, uy, uz], [vx, vy, vz]] =
            [1, 2].map(|other| [0, 1, 2].map(|axis| corners[other][axis] - corners[0][axis]));
        let doubled = ux * vy - uy * vx;
        let [east, north] = [uz * vy - uy * vz, ux * vz - uz * vx];
        let is_large = 2.0 * f64::from(SAMPLE * SAMPLE) <= doubled.abs();
        is_large.then(|| (1000.0 * east.hypot(north) / doubled.abs()).round() as u32)
    };
    module.decks.triangles.iter().filter_map(slope).max().unwrap_or(0)
}

/// How far above the ground bridges end, in quanta, from which no other kept line goes on: what leads on there is not
/// in the data, or of a kind that is not read.
fn hanging(module: &LoadModule) -> Vec<u32> {
    let is_inside = |vertex: &ModuleVertex| [vertex.x, vertex.y].iter().all(|at| (1..module.side).contains(at));
    let kept = || module.lines.iter().filter(|line| line.is_kept);
    let ends = |line: &ModuleLine| line.vertices.first().into_iter().chain(line.vertices.last()).copied().collect();
    let bridges = kept().filter(|line| line.storey == LineStorey::Bridge);
    let ends: Vec<ModuleVertex> = bridges.flat_map(|line| -> Vec<ModuleVertex> { ends(line) }).collect();
    let goes_on = |end: &ModuleVertex| {
        let at = |vertex: &&ModuleVertex| [vertex.x, vertex.y] == [end.x, end.y];
        1 < kept().filter(|line| line.vertices.iter().any(|vertex| at(&vertex))).count()
    };
    let hangs = |end: &ModuleVertex| {
        let height = f64::from(end.z) - ground_under(module, end);
        (ON_GROUND < height).then_some(height as u32)
    };
    ends.iter().filter(|end| is_inside(end) && !goes_on(end)).filter_map(hangs).collect()
}

/// The highest step onto a deck: of corners beside an end of a bridge's line, where that ends on the ground. One beside
/// several ends belongs to that from which it rises least.
fn highest_step(module: &LoadModule) -> u32 {
    let is_inside = |vertex: &ModuleVertex| [vertex.x, vertex.y].iter().all(|at| (1..module.side).contains(at));
    let is_bridge = |line: &&ModuleLine| line.storey == LineStorey::Bridge && line.is_kept;
    let ends = |line: &ModuleLine| -> Vec<End> {
        let [.., before_last, last] = line.vertices[..] else { return Vec::new() };
        let reach = END_PART * f64::from(line.width);
        [(line.vertices[0], line.vertices[1]), (last, before_last)].map(|(at, next)| End { at, next, reach }).into()
    };
    let is_on_ground = |end: &End| (ground_under(module, &end.at) - f64::from(end.at.z)).abs() <= ON_GROUND;
    let ends = module.lines.iter().filter(is_bridge).flat_map(ends);
    let ends: Vec<End> = ends.filter(|end| is_inside(&end.at) && is_on_ground(end)).collect();
    let step = |corner: &ModuleVertex| {
        // Where a way is a line, the ground beside it rises as it does without the bridge.
        let above_ground = f64::from(corner.z) - ground_under(module, corner);
        Some(ends.iter().filter_map(|end| end.rise(corner)).min()?.min(above_ground.max(0.0) as u32))
    };
    module.decks.vertices.iter().filter(|corner| is_inside(corner)).filter_map(step).max().unwrap_or(0)
}

/// An end of a bridge's line, the vertex next to it, and how far corners there are at most, in quanta.
struct End {
    at: ModuleVertex,
    next: ModuleVertex,
    reach: f64,
}

impl End {
    /// How far a corner stands above it, where it lies beside it, across the bridge.
    fn rise(&self, corner: &ModuleVertex) -> Option<u32> {
        let run = |to: &ModuleVertex| [f64::from(to.x) - f64::from(self.at.x), f64::from(to.y) - f64::from(self.at.y)];
        let ([east, north], [x, y]) = (run(&self.next), run(corner));
        let apart = x.hypot(y);
        let is_across = (x * east + y * north).abs() <= ALONG_MAX * apart * east.hypot(north);
        (apart <= self.reach && is_across).then(|| (corner.z - self.at.z).max(0).unsigned_abs())
    }
}

/// The highest that the ground is under a vertex, in quanta.
fn ground_under(module: &LoadModule, vertex: &ModuleVertex) -> f64 {
    let place = [f64::from(vertex.x), f64::from(vertex.y)];
    let ground = module.triangles.iter().filter_map(|triangle| {
        let corners = triangle.map(|corner| module.vertices[usize::from(corner)]);
        height_in(corners.map(|corner| [f64::from(corner.x), f64::from(corner.y), f64::from(corner.z)]), place)
    });
    ground.fold(f64::NEG_INFINITY, f64::max)
}

/// Whether a line is one that bridges pass over.
fn is_below(line: &ModuleLine) -> bool {
    line.storey == LineStorey::Ground && line.is_in_ground
}

/// Two neighbouring vertices of a line, and which of them are its ends.
#[derive(Clone, Copy)]
struct Segment {
    places: [[f64; 3]; 2],
    is_end: [bool; 2],
}

fn segments(line: &ModuleLine) -> Vec<Segment> {
    let last = line.vertices.len().saturating_sub(2);
    let segment = |(at, pair): (usize, &[ModuleVertex])| Segment {
        places: [Segment::place(&pair[0]), Segment::place(&pair[1])],
        is_end: [at == 0, at == last],
    };
    line.vertices.windows(2).enumerate().map(segment).collect()
}

/// Places along a line, a metre apart at most, its last vertex left out.
pub(crate) fn places_along(line: &ModuleLine) -> impl Iterator<Item = [f64; 3]> + use<> {
    segments(line).into_iter().flat_map(|segment| segment.samples())
}

impl Segment {
    fn place(vertex: &ModuleVertex) -> [f64; 3] {
        [f64::from(vertex.x), f64::from(vertex.y), f64::from(vertex.z)]
    }

    /// Places along it, a metre apart at most, the last vertex left out.
    fn samples(self) -> impl Iterator<Item = [f64; 3]> {
        let [a, b] = self.places;
        let count = ((b[0] - a[0]).hypot(b[1] - a[1]) / f64::from(SAMPLE)).ceil();
        let place = move |step: u32| [0, 1, 2].map(|axis| a[axis] + f64::from(step) / count * (b[axis] - a[axis]));
        (0..count as u32).map(place)
    }

    /// How high it passes over another that it crosses, other than at an end of both lines.
    fn height_over(&self, under: Self) -> Option<f64> {
        let ([a, b], [c, d]) = (self.places, under.places);
        let cross = |u: [f64; 2], v: [f64; 2]| u[0] * v[1] - u[1] * v[0];
        let to = |from: [f64; 3], to: [f64; 3]| [to[0] - from[0], to[1] - from[1]];
        let turn = cross(to(a, b), to(c, d));
        let [along, share] = [cross(to(a, c), to(c, d)) / turn, cross(to(a, c), to(a, b)) / turn];
        let ends = |of: &Self, at: f64| (at == 0.0 && of.is_end[0]) || (at == 1.0 && of.is_end[1]);
        let crosses = (0.0..=1.0).contains(&along) && (0.0..=1.0).contains(&share);
        let is_crossing = crosses && !(ends(self, along) && ends(&under, share));
        is_crossing.then(|| a[2] + along * (b[2] - a[2]) - c[2] - share * (d[2] - c[2]))
    }
}

/// Places of decks with their heights: the middles of square metres of the load module that a triangle of a deck holds.
fn samples(module: &LoadModule) -> Vec<[f64; 3]> {
    let decks = &module.decks;
    let mut places = Vec::new();
    for triangle in &decks.triangles {
        let corners = triangle.map(|corner| decks.vertices[usize::from(corner)]);
        let span = |of: fn(&ModuleVertex) -> u16| {
            let low = corners.iter().map(|corner| i32::from(of(corner))).min().unwrap_or(0);
            let high = corners.iter().map(|corner| i32::from(of(corner))).max().unwrap_or(-1);
            (low.div_euclid(SAMPLE)..=high.div_euclid(SAMPLE)).map(|square| square * SAMPLE + SAMPLE / 2)
        };
        let corners = corners.map(|corner| [f64::from(corner.x), f64::from(corner.y), f64::from(corner.z)]);
        for y in span(|corner| corner.y) {
            for x in span(|corner| corner.x) {
                let place = [f64::from(x), f64::from(y)];
                places.extend(height_in(corners, place).map(|height| [place[0], place[1], height]));
            }
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{Decks, LineForm, LineKind, LineTraits, ModuleId};

    fn vertex(x: u16, y: u16, z: i32) -> ModuleVertex {
        ModuleVertex { y, x, z }
    }

    fn line(class: u8, storey: LineStorey, places: &[(u16, u16, i32)]) -> ModuleLine {
        let traits = LineTraits {
            kind: LineKind::Travelled,
            form: LineForm::Line,
            storey,
            is_kept: true,
            is_in_ground: storey == LineStorey::Ground,
            width: 640,
        };
        traits.line(class, places.iter().map(|&(x, y, z)| vertex(x, y, z)).collect())
    }

    /// A load module of 100 m at height 0, its northern half of class 1, under a deck of 20 m by 10 m over both halves.
    fn module(heights: [i32; 4]) -> LoadModule {
        let [a, b, c, d] = [(4000, 5000), (5280, 5000), (5280, 7560), (4000, 7560)];
        let corners = [a, b, c, d].into_iter().zip(heights).map(|((x, y), z)| vertex(x, y, z));
        let corners: Vec<ModuleVertex> = corners.collect();
        let triangles = [[0, 1, 2], [0, 2, 3]].map(|triangle| (triangle.map(|corner| corners[corner]), 3));
        LoadModule {
            id: ModuleId { row: 0, col: 0 },
            side: 12_800,
            vertices: vec![
                vertex(0, 0, 0),
                vertex(12_800, 0, 0),
                vertex(0, 6400, 0),
                vertex(12_800, 6400, 0),
                vertex(0, 12_800, 0),
                vertex(12_800, 12_800, 0),
            ],
            triangles: vec![[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]],
            classes: vec![0, 0, 1, 1],
            polygon_count: 4,
            decks: Decks::of_triangles(triangles.to_vec()),
            ..LoadModule::default()
        }
    }

    #[test]
    fn a_deck_has_its_least_height_over_level_ground_of_a_class_without_lines_and_no_place_under_it() {
        let mut module = module([256, 256, 768, 768]);
        let found = DeckFigures::of(&module);
        assert_eq!((found.samples, found.under, found.deepest), (200, 0, 0));
        let [south, north] = [found.clearance[&0], found.clearance[&1]];
        assert!((256..300).contains(&south) && (500..600).contains(&north), "{south} {north}");
        // The south slopes: nothing of it is level.
        module.vertices[0].z = -16;
        module.vertices[1].z = -16;
        assert_eq!(DeckFigures::of(&module).clearance.into_keys().collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn a_step_onto_a_deck_is_found_where_its_bridge_ends_on_the_ground() {
        let step = |south: i32| {
            let mut module = module([200, 100, 0, 0]);
            module.lines = vec![line(3, LineStorey::Bridge, &[(4300, 5000, south), (4300, 7560, 0)])];
            DeckFigures::of(&module).step
        };
        assert_eq!([0, 20, 64].map(step), [200, 180, 0], "the last ends in the air");
    }

    #[test]
    fn a_bridge_that_ends_in_the_air_is_told_where_no_way_goes_on() {
        let ends = |south: i32, goes_on: bool| {
            let mut module = module([200, 100, 0, 0]);
            module.lines = vec![line(3, LineStorey::Bridge, &[(4300, 5000, south), (4300, 7560, 0)])];
            if goes_on {
                module.lines.push(line(3, LineStorey::Ground, &[(4300, 5000, south), (4300, 3000, south)]));
            }
            let figures = DeckFigures::of(&module);
            (figures.hanging, figures.hangs)
        };
        assert_eq!([ends(20, false), ends(64, false), ends(64, true)], [(0, 0), (1, 64), (0, 0)]);
    }

    #[test]
    fn the_steepest_triangle_of_a_deck_is_found_and_slivers_are_not() {
        let steepest = |heights: [i32; 4]| DeckFigures::of(&module(heights)).steepest;
        assert_eq!(steepest([256; 4]), 0);
        assert!(0 < steepest([256, 256, 768, 768]));
    }

    #[test]
    fn a_bridge_passes_over_the_line_it_crosses_and_not_over_those_it_ends_at() {
        let mut module = module([256, 256, 768, 768]);
        let bridge = [(4640, 5000, 256), (4640, 7560, 768)];
        module.lines = vec![
            line(3, LineStorey::Bridge, &bridge),
            // The road that goes on from the bridge, and one that joins it there.
            line(3, LineStorey::Ground, &[(4640, 3000, 128), bridge[0]]),
            line(0, LineStorey::Ground, &[(3000, 5000, 200), bridge[0]]),
            // A stream halfway below, whose vertex lies in the middle, and a tunnel.
            line(1, LineStorey::Ground, &[(4000, 6280, 0), (4640, 6280, 12), (5280, 6280, 0)]),
            line(2, LineStorey::Tunnel, &[(4000, 6300, 0), (5280, 6300, 0)]),
        ];
        module.lines[4].is_kept = false;
        assert_eq!(DeckFigures::of(&module).clearance, [(1, 500)].into());
        // A road alongside, under the deck's side: told where it is apart from the bridge's ends.
        let ends = [(4000, 0, 256), (5280, 0, 256), (5280, 10_240, 768), (4000, 10_240, 768)];
        let corners = ends.map(|(x, y, z)| vertex(x, y, z));
        module.decks = Decks::of_triangles([[0, 1, 2], [0, 2, 3]].map(|of| (of.map(|corner| corners[corner]), 3)));
        module.lines = vec![
            line(3, LineStorey::Bridge, &[(4640, 0, 256), (4640, 10_240, 768)]),
            line(2, LineStorey::Ground, &[(5000, 0, 100), (5000, 10_240, 100)]),
        ];
        let least = DeckFigures::of(&module).clearance[&2];
        assert!((256 + 512 * 3840 / 10_240 - 100..=256 + 512 * 4000 / 10_240 - 100).contains(&least), "{least}");
    }

    #[test]
    fn places_of_a_deck_under_the_ground_are_counted_and_a_quantum_is_not() {
        let found = DeckFigures::of(&module([-640, -640, 640, 640]));
        assert!((90..=110).contains(&found.under) && found.deepest == 640, "{found:?}");
        assert_eq!(DeckFigures::of(&module([-1; 4])).under, 0);
    }
}
