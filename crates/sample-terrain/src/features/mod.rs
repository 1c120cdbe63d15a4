//! Roads, washes and lakes of the built-in terrain: pure functions of the seed and the place, as the ground is.
//!
//! ```text
//! lattice  nodes every 100 m, in squares of 12.8 km     ground  heights and washes of squares that are asked for
//! washes   each square drained to playas and gates      lakes   floors of playas
//! roads    the network of a cell of 64 km, every 400 m  chains  where each road runs, every 100 m, smoothed
//! ```
//! Bridges are highways cut where they cross a large wash.

mod chains;
mod ground;
mod lakes;
mod lattice;
mod line;
mod roads;
mod washes;

use crate::features::chains::Strips;
use crate::features::ground::Ground;
use crate::features::lattice::{SIDE, cells};
use crate::features::line::{Place, crossing, distance};
use crate::features::roads::{CELL, Class, Roads};

/// The shape of a feature, in metres east and north of the terrain's origin.
#[derive(Clone, Debug, PartialEq)]
pub enum SampleShape {
    /// Vertices in order; washes run downstream.
    Line(Vec<[f64; 2]>),
    /// Rings, the outer one first and counter-clockwise, each with its first vertex repeated at its end.
    Polygon(Vec<Vec<[f64; 2]>>),
}

/// A road, a wash or a lake of the built-in terrain.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleFeature {
    /// Its number, the same whatever rectangle is asked for; no other feature of the seed has it.
    pub id: i64,
    /// Tags as OpenStreetMap has them.
    pub tags: Vec<(&'static str, &'static str)>,
    /// Its shape.
    pub shape: SampleShape,
}

/// What numbers of features begin with.
#[derive(Clone, Copy)]
enum Family {
    Road = 1,
    Wash = 2,
    Lake = 3,
}

/// The features of the built-in terrain of this seed that touch a rectangle, by number.
///
/// The rectangle is in metres east and north of the terrain's origin, post (0, 0) of [`heights`](crate::heights). A
/// feature does not depend on it: neighbouring rectangles show the same road, whole. Highways are `highway = primary`
/// and `secondary`, cut into three ways where they have a `bridge`; other roads are `unclassified` and `track`; washes
/// are `waterway = stream` and playas `natural = water`, both `intermittent`. Roads share vertices where they meet;
/// roads and washes share none.
///
/// Roads are laid out for cells of 64 km, so a small rectangle costs nearly 0.1 s and 50 km x 50 km about 0.3 s on one
/// core of 2.3 GHz. A rectangle without a size, or with one that is no number, has no features.
pub fn features(seed: u64, west_m: f64, south_m: f64, east_m: f64, north_m: f64) -> Vec<SampleFeature> {
    let rect = Rect { low: [west_m, south_m], high: [east_m, north_m] };
    if !(west_m < east_m && south_m < north_m && (east_m - west_m + north_m - south_m).is_finite()) {
        return Vec::new();
    }
    let mut ground = Ground::new(seed);
    let mut found = Vec::new();
    for cell in rect.cells(CELL) {
        add_roads(&mut ground, cell, rect, &mut found);
    }
    for square in rect.cells(SIDE) {
        for (number, reach) in ground.washes(square).reaches.iter().enumerate() {
            if rect.touches(&reach.line) {
                let tags = vec![("waterway", "stream"), ("intermittent", "yes")];
                let shape = SampleShape::Line(reach.line.clone());
                found.push(SampleFeature { id: id(Family::Wash, square, number), tags, shape });
            }
        }
    }
    let size_m = (east_m - west_m, north_m - south_m);
    for playa in ground.playas((west_m, south_m), size_m) {
        if let Some(ring) = lakes::outline(&mut ground, &playa).filter(|ring| rect.touches_area(ring)) {
            let tags = vec![("natural", "water"), ("water", "playa"), ("intermittent", "yes")];
            found.push(SampleFeature {
                id: id(Family::Lake, playa.cell, 0),
                tags,
                shape: SampleShape::Polygon(vec![ring]),
            });
        }
    }
    found.sort_by_key(|feature| feature.id);
    found
}

fn add_roads(ground: &mut Ground, cell: (i64, i64), rect: Rect, found: &mut Vec<SampleFeature>) {
    /// More than the ways that bridges cut a road into.
    const WAYS: usize = 16;
    let roads = Roads::of(ground, cell);
    let chains = roads.chains();
    let strips = Strips::of(cell, &chains);
    for (number, chain) in chains.iter().enumerate() {
        let nodes: Vec<Place> = chain.nodes.iter().map(|&at| lattice::place(roads::node_of(cell, at))).collect();
        if !rect.widened(chains::REACH_M).touches(&nodes) {
            continue;
        }
        let line = chains::lay(ground, &strips, &chains, number);
        for (part, way) in cut_at_washes(ground, line, chain.class).into_iter().enumerate() {
            if rect.touches(&way.line) {
                let mut tags = match chain.class {
                    Class::Primary => vec![("highway", "primary"), ("lanes", "2")],
                    Class::Secondary => vec![("highway", "secondary"), ("lanes", "2")],
                    Class::Minor => vec![("highway", "unclassified"), ("surface", "gravel")],
                    Class::Track => vec![("highway", "track")],
                };
                if way.is_bridge {
                    tags.extend([("bridge", "yes"), ("layer", "1")]);
                }
                let id = id(Family::Road, cell, WAYS * number + part);
                found.push(SampleFeature { id, tags, shape: SampleShape::Line(way.line) });
            }
        }
    }
}

/// The number of a feature: its family, its cell and its number there, side by side in the bits.
fn id(family: Family, (east, north): (i64, i64), number: usize) -> i64 {
    let cell = |number: i64| number & 0xf_ffff;
    (((family as i64) << 20 | cell(east)) << 20 | cell(north)) << 18 | (number as i64 & 0x3_ffff)
}

/// A rectangle in metres.
#[derive(Clone, Copy)]
struct Rect {
    low: Place,
    high: Place,
}

impl Rect {
    /// The cells of `side` steps that it touches.
    fn cells(self, side: i64) -> impl Iterator<Item = (i64, i64)> {
        let easts = cells(self.low[0], self.high[0], side);
        cells(self.low[1], self.high[1], side).flat_map(move |north| easts.clone().map(move |east| (east, north)))
    }

    fn widened(self, by_m: f64) -> Self {
        Self { low: self.low.map(|low| low - by_m), high: self.high.map(|high| high + by_m) }
    }

    /// Whether a line has a place in it.
    fn touches(self, line: &[Place]) -> bool {
        line.windows(2).any(|leg| {
            // What is left of the leg between each pair of sides.
            let (mut from, mut to) = (0.0_f64, 1.0_f64);
            let axes = leg[0].into_iter().zip(leg[1]).zip(self.low.into_iter().zip(self.high));
            for ((start, end), (low, high)) in axes {
                if start == end {
                    if start < low || high < start {
                        return false;
                    }
                } else {
                    let (near, far) = ((low - start) / (end - start), (high - start) / (end - start));
                    (from, to) = (from.max(near.min(far)), to.min(near.max(far)));
                }
            }
            from <= to
        })
    }

    /// Whether the area inside a ring has a place in it.
    fn touches_area(self, ring: &[Place]) -> bool {
        let [east, north] = self.low;
        let crossed = ring.windows(2).filter(|leg| {
            let [a, b] = [leg[0], leg[1]];
            (a[1] <= north) != (b[1] <= north) && east < a[0] + (north - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        });
        self.touches(ring) || crossed.count() % 2 == 1
    }
}

/// Hundredths of a square kilometre that drain to a wash which is worth a bridge.
const AREA_MIN: u32 = 900;
/// Bridges on one stretch of road.
const BRIDGES_MAX: usize = 4;
/// Metres between bridges, and from a bridge to where the road meets another.
const APART_M: f64 = 400.0;
/// Metres on either side of a bridge's middle on which the road crosses no wash twice.
const ALONE_M: f64 = 120.0;

/// A part of a road.
struct Way {
    pub(super) line: Vec<Place>,
    pub(super) is_bridge: bool,
}

/// Cuts a road into ways that share their ends: on the ground and on bridges, by turns.
fn cut_at_washes(ground: &mut Ground, road: Vec<Place>, class: Class) -> Vec<Way> {
    let mut bridges = if class < Class::Secondary { Vec::new() } else { bridges(ground, &road) };
    bridges.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole_m = line::length(&road);
    let (mut ways, mut gone_m) = (Vec::new(), 0.0);
    for (middle_m, half_m) in bridges {
        let (from_m, to_m) = (middle_m - half_m, middle_m + half_m);
        ways.push(Way { line: line::part(&road, gone_m, from_m), is_bridge: false });
        let ends = [line::place_at(&road, from_m), line::place_at(&road, to_m)];
        ways.push(Way { line: ends.to_vec(), is_bridge: true });
        gone_m = to_m;
    }
    if ways.is_empty() {
        return vec![Way { line: road, is_bridge: false }];
    }
    ways.push(Way { line: line::part(&road, gone_m, whole_m), is_bridge: false });
    ways
}

/// Middles and half lengths of the bridges of a road, in metres along it.
fn bridges(ground: &mut Ground, road: &[Place]) -> Vec<(f64, f64)> {
    let whole_m = line::length(road);
    let crossings = crossings(ground, road);
    let is_alone = |at_m: f64| crossings.iter().filter(|other| (other.0 - at_m).abs() < ALONE_M).count() == 1;
    let mut large: Vec<(f64, u32)> = crossings
        .iter()
        .filter(|(at_m, area)| AREA_MIN <= *area && APART_M < *at_m && *at_m < whole_m - APART_M && is_alone(*at_m))
        .copied()
        .collect();
    large.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.total_cmp(&b.0)));
    let mut bridges: Vec<(f64, f64)> = Vec::new();
    for (at_m, area) in large {
        if bridges.len() < BRIDGES_MAX && bridges.iter().all(|other| APART_M < (other.0 - at_m).abs()) {
            // From 40 m to 80 m.
            bridges.push((at_m, (15.0 + 0.005 * f64::from(area)).clamp(20.0, 40.0)));
        }
    }
    bridges
}

/// Where a road crosses washes: metres along it, and what drains to the wash.
fn crossings(ground: &mut Ground, road: &[Place]) -> Vec<(f64, u32)> {
    let mut found = Vec::new();
    let mut gone_m = 0.0;
    for leg in road.windows(2) {
        let leg_m = distance(leg[0], leg[1]);
        let squares = |axis: usize| {
            let (a, b) = (leg[0][axis], leg[1][axis]);
            cells(a.min(b), a.max(b), SIDE)
        };
        for number in squares(1).flat_map(|north| squares(0).map(move |east| (east, north))) {
            for reach in &ground.washes(number).reaches {
                for wash in reach.line.windows(2) {
                    let share = crossing([leg[0], leg[1]], [wash[0], wash[1]]);
                    found.extend(share.map(|(share, _)| (gone_m + share * leg_m, reach.area)));
                }
            }
        }
        gone_m += leg_m;
    }
    found
}
