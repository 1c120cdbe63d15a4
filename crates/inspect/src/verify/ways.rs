//! Roads and rivers as the middle lines of load modules tell them, against the triangles: whether what is kept has its
//! edges, from end to end, and lies on the ground, whether bridges have decks, and where what is kept ends although its
//! way goes on. Only files of load modules are asked.

use std::collections::BTreeMap;

use build::ground::GamingArea;
use job::Job;
use terrain::{LineKind, LineStorey, LoadModule, ModuleLine, ModuleVertex, QUANTA_PER_METRE, metres_of_quanta};

use super::laid::place_text;
use super::modules::Modules;
use super::square::{At, Square};
use super::standing::height_at;

/// Shorter stretches without edges are what rounding leaves, in metres.
const BARE_MIN_M: f64 = 3.0;
/// Longer stretches without edges are gaps, in metres.
const GAP_MIN_M: f64 = 30.0;
/// A deck that lies farther above or below a line carries another way, in quanta.
const DECK_OFF: i32 = QUANTA_PER_METRE;
/// A vertex of a line in the ground may lie so many metres off it: rounding moves lines and the strips they lie in.
const OFF_MAX_M: f64 = 0.5;

/// What is found of the ways of an area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct WaysFound {
    /// Metres of what is kept, bridges among them, tunnels not.
    pub kept_m: f64,
    /// Stretches of lines in the ground without edges and without ground of another way.
    pub pieces_missing: u64,
    /// Those of them that are longer than 30 m.
    pub gaps: u64,
}

/// The ways of an area.
#[derive(Default)]
pub(crate) struct Ways {
    pub found: WaysFound,
    /// The first place at which an edge is missing.
    missing: Option<At>,
    /// Stretches of bridges that are kept along which no deck lies, each with its metres.
    undecked: Vec<(f64, At)>,
    /// Vertices of lines in the ground that do not lie on it, with metres.
    off: Vec<(f64, At)>,
    /// What meets at each place: of kept ends, kept lines that pass, and lines that are left out.
    meetings: BTreeMap<(u8, At), Meeting>,
}

#[derive(Clone, Copy, Default)]
struct Meeting {
    kept_ends: u8,
    is_passed: bool,
    goes_on: bool,
    is_tunnel: bool,
}

impl Ways {
    /// The ways of all load modules; edges may lie `aside` quanta off their lines.
    pub fn of(job: &Job, modules: &Modules, aside: f64) -> Self {
        let first_class = job.importance.classes.len();
        let mut ways = Self::default();
        let names = job.class_names();
        for module in modules.values().filter(|module| !module.lines.is_empty()) {
            let ground = Ground::of(&module, first_class, aside);
            for line in &module.lines {
                let name = names.get(usize::from(line.class)).map_or("", String::as_str);
                ways.add(line, family(line.kind, name), &ground);
            }
        }
        ways
    }

    fn add(&mut self, line: &ModuleLine, family: u8, ground: &Ground) {
        let places: Vec<At> = line.vertices.iter().map(|vertex| ground.square.at(vertex.y, vertex.x)).collect();
        let heights: Vec<i32> = line.vertices.iter().map(|vertex| vertex.z).collect();
        // A channel in a tunnel is one that passes below a road.
        if line.is_kept && (line.storey != LineStorey::Tunnel || line.kind == LineKind::Channel) {
            self.found.kept_m += places.windows(2).map(length_m).sum::<f64>();
        }
        if line.is_in_ground {
            self.look(&places, &heights, line.kind, ground);
            let off = places.iter().zip(&heights).map(|(&at, &height)| (ground.off_m(at, height), at));
            self.off.extend(off.filter(|(off_m, _)| OFF_MAX_M < *off_m));
        }
        if line.is_kept && line.storey == LineStorey::Bridge {
            let bare = stretches(&places, &heights, |ends, heights| ground.undecked(ends, heights));
            self.undecked.extend(bare.into_iter().filter(|(long_m, _)| BARE_MIN_M < *long_m));
        }
        if line.kind == LineKind::Breakline {
            return;
        }
        let last = places.len() - 1;
        for (index, &place) in places.iter().enumerate() {
            let meeting = self.meetings.entry((family, place)).or_default();
            let is_end = index == 0 || index == last;
            // What passes on a bridge or in a tunnel does not meet what ends below or above it, also where it is cut
            // between two load modules.
            let is_cut = || ground.square.is_side(place);
            meeting.goes_on |= !line.is_kept && (line.storey == LineStorey::Ground || is_end && !is_cut());
            meeting.is_passed |= line.is_kept && !is_end;
            if line.is_kept && is_end {
                meeting.kept_ends = meeting.kept_ends.saturating_add(1);
                meeting.is_tunnel |= line.storey == LineStorey::Tunnel;
            }
        }
    }

    /// Looks for the pieces of a line in the triangles: stretches along which no edge and no other way's ground lies.
    fn look(&mut self, places: &[At], heights: &[i32], kind: LineKind, ground: &Ground) {
        let bare = stretches(places, heights, |ends, heights| ground.bare(ends, heights));
        // Streams pass below roads without edges.
        let least = if kind == LineKind::Channel { GAP_MIN_M } else { BARE_MIN_M };
        for (long_m, at) in bare.into_iter().filter(|(long_m, _)| least < *long_m) {
            self.found.pieces_missing += 1;
            self.found.gaps += u64::from(GAP_MIN_M < long_m);
            self.missing = self.missing.or(Some(at));
        }
    }

    /// Places inside the area at which what is kept ends although its way goes on.
    pub fn ends(&self, area: &GamingArea) -> Vec<At> {
        let spacing = i64::from(area.frame.spacing.quanta_per_post());
        let on = |at: i64, low: i32, high: i32| at == i64::from(low) * spacing || at == i64::from(high) * spacing;
        let rect = area.rect;
        let is_border = |(y, x): At| on(y, rect.south, rect.north) || on(x, rect.west, rect.east);
        let is_end = |of: &Meeting| of.kept_ends == 1 && !of.is_passed && of.goes_on && !of.is_tunnel;
        let found = self.meetings.iter().filter(|((_, at), of)| is_end(of) && !is_border(*at));
        found.map(|((_, at), _)| *at).collect()
    }

    /// What is wrong, in sentences.
    pub fn problems(&self, area: &GamingArea) -> Vec<String> {
        let WaysFound { pieces_missing, gaps, .. } = self.found;
        let missing = self.missing.map(|at| {
            format!(
                "load modules: {pieces_missing} stretches of lines that are in the ground have no edges there and no \
                 other way covers them, {gaps} of them longer than 30 m, the first {}",
                place_text(area, at)
            )
        });
        let off = self.off.iter().max_by(|one, other| one.0.total_cmp(&other.0)).map(|(off_m, at)| {
            format!(
                "load modules: {} vertices of lines that are in the ground lie more than {OFF_MAX_M} m off it, the \
                 farthest {off_m:.2} m {}",
                self.off.len(),
                place_text(area, *at)
            )
        });
        let undecked = self.undecked.iter().max_by(|one, other| one.0.total_cmp(&other.0)).map(|(long_m, at)| {
            format!(
                "load modules: {} stretches of bridges have no deck, the longest {long_m:.1} m {}",
                self.undecked.len(),
                place_text(area, *at)
            )
        });
        missing.into_iter().chain(off).chain(undecked).collect()
    }
}

/// Roads, rails, runways and channels end apart from each other.
fn family(kind: LineKind, class: &str) -> u8 {
    match (kind, class) {
        (LineKind::Travelled, "rail") => 1,
        (LineKind::Travelled, "runway") => 2,
        (LineKind::Travelled, _) => 0,
        _ => 3,
    }
}

/// The stretches of a line that `bare` leaves of its pieces, from 0 to 1 along each, with their metres and the vertex
/// before them. What lies close together is one stretch.
fn stretches(places: &[At], heights: &[i32], bare: impl Fn([At; 2], [i32; 2]) -> Vec<(f64, f64)>) -> Vec<(f64, At)> {
    let mut found: Vec<(f64, f64, At)> = Vec::new();
    let mut along_m = 0.0;
    for (ends, heights) in places.windows(2).zip(heights.windows(2)) {
        let length_m = length_m(ends);
        for (from, to) in bare([ends[0], ends[1]], [heights[0], heights[1]]) {
            let (from, to) = (along_m + from * length_m, along_m + to * length_m);
            match found.last_mut() {
                Some(last) if from - last.1 < BARE_MIN_M => last.1 = to,
                _ => found.push((from, to, ends[0])),
            }
        }
        along_m += length_m;
    }
    found.into_iter().map(|(from, to, at)| (to - from, at)).collect()
}

fn length_m(ends: &[At]) -> f64 {
    let [north, east] = [ends[1].0 - ends[0].0, ends[1].1 - ends[0].1].map(|quanta| metres_of_quanta(quanta as i32));
    north.hypot(east)
}

/// The triangles of a load module, as lines are looked for in them.
struct Ground<'a> {
    square: Square<'a>,
    /// Triangles of the ground that have a class of features, with their lowest and highest vertex.
    of_features: Vec<([At; 3], [i32; 2])>,
    /// Triangles of decks, likewise: beside a way that forks where it leaves a bridge, the deck reaches as far as both
    /// are apart.
    of_decks: Vec<([At; 3], [i32; 2])>,
    /// How far edges may lie off a line that was rounded with them, in quanta.
    aside: f64,
}

impl<'a> Ground<'a> {
    fn of(module: &'a LoadModule, first_class: usize, aside: f64) -> Self {
        let square = Square::of(module);
        let of_features = module.triangles.iter().zip(&module.classes);
        let of_features = of_features.filter(|(_, class)| first_class <= usize::from(**class));
        let with_heights = |vertices: &[ModuleVertex], triangle: &[u16; 3]| {
            let corners = triangle.map(|corner| vertices[usize::from(corner)]);
            let heights = corners.map(|corner| corner.z);
            let [low, high] = [heights.into_iter().min(), heights.into_iter().max()].map(Option::unwrap_or_default);
            (corners.map(|corner| square.at(corner.y, corner.x)), [low, high])
        };
        let of_features = of_features.map(|(triangle, _)| with_heights(&module.vertices, triangle)).collect();
        let decks = &module.decks;
        let of_decks = decks.triangles.iter().map(|triangle| with_heights(&decks.vertices, triangle)).collect();
        Self { square, of_features, of_decks, aside }
    }

    /// Metres by which a place of a line lies off the ground under it.
    fn off_m(&self, at: At, height: i32) -> f64 {
        let off_m = |ground: f64| (ground - f64::from(height)).abs() / f64::from(QUANTA_PER_METRE);
        if let Some(&there) = self.square.heights.get(&at) {
            return off_m(there.into());
        }
        let under = |triangle: &[u16; 3], [north, east]: [f64; 2]| {
            let corner = |v: &u16| self.square.module.vertices[usize::from(*v)];
            let corners = triangle.each_ref().map(corner).map(|of| [f64::from(of.x), f64::from(of.y), f64::from(of.z)]);
            let [y, x] = [at.0 - self.square.reach()[0], at.1 - self.square.reach()[1]].map(|at| at as f64);
            height_at(&corners, [x + east, y + north]).map(off_m)
        };
        let least = |off: [f64; 2]| {
            let triangles = self.square.module.triangles.iter();
            triangles.filter_map(|triangle| under(triangle, off)).reduce(f64::min)
        };
        let off_m = least([0.0; 2]).unwrap_or(0.0);
        if off_m <= OFF_MAX_M {
            return off_m;
        }
        // Beside a road that ends high above the ground, what rounding moves lies off by more than it was moved.
        let aside = self.aside;
        [[aside, 0.0], [-aside, 0.0], [0.0, aside], [0.0, -aside]].into_iter().filter_map(least).fold(off_m, f64::min)
    }

    /// Parts of the line between two places with their heights, from 0 to 1, along which neither an edge nor a triangle
    /// of features lies, nor a deck as high as the line.
    fn bare(&self, [a, b]: [At; 2], heights: [i32; 2]) -> Vec<(f64, f64)> {
        let line = Along::of(a, b);
        let edges = self.square.edges.iter().filter_map(|ends| line.beside(*ends, self.aside));
        let decks = self.of_decks.iter().filter(|(_, of_deck)| is_as_high(*of_deck, heights));
        let there = self.of_features.iter().chain(decks).flat_map(|(corners, _)| self.within(&line, *corners));
        line.bare(edges.chain(there).collect())
    }

    /// Parts of a bridge between two places with their heights, from 0 to 1, along which no deck lies but such as pass
    /// below it. Decks may be higher than the line, since they rise where the ground would stand above them; where ways
    /// meet at the end of a bridge the ground is as high.
    fn undecked(&self, [a, b]: [At; 2], heights: [i32; 2]) -> Vec<(f64, f64)> {
        let line = Along::of(a, b);
        let low = heights[0].min(heights[1]);
        let decks = self.of_decks.iter().filter(|(_, [_, highest])| low < highest + DECK_OFF);
        let ground = self.of_features.iter().filter(|(_, of_ground)| is_as_high(*of_ground, heights));
        line.bare(decks.chain(ground).flat_map(|(corners, _)| self.within(&line, *corners)).collect())
    }

    /// The parts of a line inside a triangle, whose corners may be rounded as lines are.
    fn within(&self, line: &Along, corners: [At; 3]) -> impl Iterator<Item = (f64, f64)> + use<> {
        [-self.aside, 0.0, self.aside].map(|aside| line.within(corners, aside)).into_iter().flatten()
    }
}

/// Whether a triangle, from its lowest to its highest vertex, may carry a line with these heights at its ends.
fn is_as_high([lowest, highest]: [i32; 2], [one, other]: [i32; 2]) -> bool {
    lowest - DECK_OFF < one.max(other) && one.min(other) < highest + DECK_OFF
}

/// A straight line between two places.
struct Along {
    from: [f64; 2],
    unit: [f64; 2],
    length: f64,
}

impl Along {
    fn of(a: At, b: At) -> Self {
        let [north, east] = [(b.0 - a.0) as f64, (b.1 - a.1) as f64];
        let length = north.hypot(east).max(1.0);
        Self { from: [a.0 as f64, a.1 as f64], unit: [north / length, east / length], length }
    }

    /// How far along a place lies, and how far aside, in quanta.
    fn of_place(&self, at: At) -> [f64; 2] {
        let [north, east] = [at.0 as f64 - self.from[0], at.1 as f64 - self.from[1]];
        [north * self.unit[0] + east * self.unit[1], north * self.unit[1] - east * self.unit[0]]
    }

    fn part(&self, from: f64, to: f64) -> Option<(f64, f64)> {
        let (from, to) = (from.min(to).max(0.0) / self.length, from.max(to).min(self.length) / self.length);
        (from < to).then_some((from, to))
    }

    /// What these parts leave of it. Triangles side by side leave what rounding leaves, which is less than a quantum
    /// and no stretch.
    fn bare(&self, mut there: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
        there.push((1.0, 1.0));
        there.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1)));
        let (mut at, mut bare) = (0.0, Vec::new());
        for (from, to) in there {
            if at + 1.0 / self.length < from {
                bare.push((at, from));
            }
            at = to.max(at);
        }
        bare
    }

    /// The part along which an edge lies no farther than `aside`.
    fn beside(&self, ends: [At; 2], aside: f64) -> Option<(f64, f64)> {
        let [[from, off], [to, off_too]] = ends.map(|end| self.of_place(end));
        if aside < off.abs().max(off_too.abs()) { None } else { self.part(from, to) }
    }

    /// The part inside a triangle of what lies so far beside it.
    fn within(&self, corners: [At; 3], aside: f64) -> Option<(f64, f64)> {
        let places = corners.map(|corner| self.of_place(corner)).map(|[along, off]| [along, off - aside]);
        let mut crossed: Vec<f64> = Vec::new();
        for (one, other) in [(0, 1), (1, 2), (2, 0)] {
            let ([from, off], [to, off_too]) = (places[one], places[other]);
            if (off <= 0.0) != (off_too <= 0.0) {
                crossed.push(from + (to - from) * off / (off - off_too));
            }
        }
        let [one, other] = crossed[..] else { return None };
        self.part(one, other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{Decks, ModuleId};

    #[test]
    fn triangles_of_a_strip_leave_nothing_of_its_middle_line_bare() {
        // North and east, in quanta, with the quad's diagonal either way.
        let [left, right] = [[(38_611, 4290), (39_200, 4040)], [(39_211, 5710), (39_800, 5460)]];
        let middle = |at: usize| ((left[at].0 + right[at].0) / 2, (left[at].1 + right[at].1) / 2);
        let line = Along::of(middle(0), middle(1));
        for corners in [
            [[left[0], right[0], right[1]], [left[0], right[1], left[1]]],
            [[left[0], right[0], left[1]], [right[0], right[1], left[1]]],
        ] {
            let there = corners.iter().filter_map(|corners| line.within(*corners, 0.0)).collect();
            assert_eq!(line.bare(there), [], "{corners:?}");
        }
        assert_eq!(line.bare(vec![(0.1, 0.5), (0.4, 0.9)]), [(0.0, 0.1), (0.9, 1.0)]);
    }

    #[test]
    fn a_vertex_beside_a_wall_lies_off_it_no_farther_than_rounding_moves_it() {
        let vertex = |y, x, z| ModuleVertex { y, x, z };
        // Level ground to the west, and 100 m above it to the east.
        let vertices = [0, 12_800].map(|z| [vertex(0, 1000, z), vertex(6400, 1000, z)]);
        let (low, high) = (vertex(0, 0, 0), vertex(0, 6400, 12_800));
        let module = LoadModule {
            id: ModuleId { row: 0, col: 0 },
            side: 6400,
            vertices: vec![low, vertices[0][0], vertices[0][1], vertices[1][0], high, vertices[1][1]],
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            classes: vec![0; 2],
            polygon_count: 2,
            ..LoadModule::default()
        };
        let ground = Ground::of(&module, 1, 8.0);
        assert_eq!([(500, 996), (500, 990), (500, 1004)].map(|at| ground.off_m(at, 12_800)), [0.0, 100.0, 0.0]);
    }

    #[test]
    fn a_deck_stands_for_ground_only_where_it_is_as_high_as_the_line() {
        let vertex = |y, x, z| ModuleVertex { y, x, z };
        let corners = |z| vec![vertex(0, 0, z), vertex(0, 6400, z), vertex(6400, 6400, z)];
        let module = |deck| LoadModule {
            id: ModuleId { row: 0, col: 0 },
            side: 6400,
            vertices: corners(0),
            triangles: vec![[0, 1, 2]],
            classes: vec![0],
            polygon_count: 1,
            decks: Decks { vertices: corners(deck), triangles: vec![[0, 1, 2]], classes: vec![2] },
            ..LoadModule::default()
        };
        let bare = |deck| Ground::of(&module(deck), 1, 8.0).bare([(1000, 3000), (1000, 5000)], [0, 64]).len();
        assert_eq!([bare(0), bare(128), bare(64 + 128), bare(900), bare(-128)], [0, 0, 1, 1, 1]);
        let undecked = |deck| Ground::of(&module(deck), 1, 8.0).undecked([(1000, 3000), (1000, 5000)], [0, 64]).len();
        assert_eq!([undecked(0), undecked(900), undecked(-128)], [0, 0, 1]);
    }
}
