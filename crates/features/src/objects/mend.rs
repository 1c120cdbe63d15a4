//! Objects as they were found become outlines on the lattice: without flaws, with few corners, woods united.

use std::collections::BTreeMap;

use terrain::ObjectKind;
use terrain::plans::{common, sorted_out, union};

use super::corners::{fewer, smoothed};
use super::plan::{At, FAR, METRE, Plan, Ring, bounds, doubled_area, edges, length, ring_area};
use super::table::Traits;

/// An object as a source has it.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundObject {
    /// How its source names it.
    pub name: String,
    /// What it is.
    pub traits: Traits,
    /// Tags whose values cannot be, and these.
    pub bad_tags: Vec<(String, String)>,
    /// Where it is.
    pub shape: FoundShape,
}

/// Where an object is: metres east and north of the place 0, 0.
#[derive(Clone, Debug, PartialEq)]
pub enum FoundShape {
    /// A point: as wide as its kind, along the axes.
    Point([f64; 2]),
    /// A line.
    Line(Vec<[f64; 2]>),
    /// The outer ring, then holes.
    Polygon(Vec<Vec<[f64; 2]>>),
}

/// How objects are mended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectOptions {
    /// Corners of a building at most, courtyards included; 4 or more.
    pub corners_max: usize,
    /// Square metres under which a building is left out.
    pub area_min_m2: f64,
}

/// An object on the lattice.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Outline {
    /// What it is.
    pub traits: Traits,
    /// Where it is: quanta east and north of the place 0, 0.
    pub plan: Plan,
}

/// Steps of the lattice of buildings in quanta: 12.5 cm.
const STEP: i32 = 16;
/// Metres within which the border of a wood stays.
const WOOD_WITHIN_M: f64 = 2.0;
/// Square metres of the least clearing and the least wood.
pub(super) const WOOD_M2_MIN: f64 = 400.0;
/// Metres of a class of heights: woods of one class are united.
pub(super) const CLASS_M: f64 = 3.0;
/// Metres of a stretch of wall, which has one roof.
const WALL_M_MAX: f64 = 25.0;
/// Square metres by which an outline has to differ from a simple one to be told.
const CROSSED_M2_MIN: f64 = 1.0;
/// The part of its area by which a building has to change for fewer corners to be told.
const AREA_PART_TOLD: f64 = 0.1;
/// Why an object with a place that is no number, or is far away, is left out.
const NO_PLACE: &str = "a place that is none";
/// The part of an outline that parts of the building have to cover to stand in its place.
const PARTS_MIN: f64 = 0.5;

/// What was wrong with an object, and what was done.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectRemark {
    /// How its source names it; empty where it is about several.
    pub name: String,
    /// Its first place, in metres.
    pub at_m: Option<[f64; 2]>,
    /// What was wrong.
    pub found: String,
    /// What was done; `None` where it was left out.
    pub done: Option<&'static str>,
}

/// Outlines of what was found, sorted, each once; and what was wrong.
pub fn mended(found: Vec<FoundObject>, options: &ObjectOptions) -> (Vec<Outline>, Vec<ObjectRemark>) {
    let (mut outlines, mut remarks) = (Vec::new(), Vec::new());
    let mut woods: BTreeMap<(ObjectKind, i32), Vec<(Traits, Plan)>> = BTreeMap::new();
    for object in found {
        let at_m = first_place(&object.shape);
        let mut tell = |found, done| remarks.push(ObjectRemark { name: object.name.clone(), at_m, found, done });
        for (key, value) in &object.bad_tags {
            let found = format!("{key} = {value:?}, which is no such number");
            tell(found, Some("taken as if it were not there"));
        }
        let traits = object.traits;
        let enclosed = enclosed(&object.shape);
        if let Some([simple, enclosed]) = enclosed
            && CROSSED_M2_MIN < (enclosed - simple).abs()
        {
            tell("an outline that crosses itself".into(), Some("what it encloses an odd number of times was taken"));
        }
        let plans = plans_of(&object.shape, traits, options);
        if let (Some([_, enclosed]), Ok(plans), true) = (enclosed, &plans, traits.kind.is_prism()) {
            let left: i64 = plans.iter().map(doubled_area).sum();
            let changed = (left as f64 / (2.0 * METRE * METRE) - enclosed).abs();
            if AREA_PART_TOLD * enclosed < changed && options.area_min_m2 < changed {
                let found =
                    format!("an outline that changes by {changed:.0} m2 with at most {} corners", options.corners_max);
                tell(found, Some("simplified"));
            }
        }
        match plans {
            Err(why) => tell(why.to_owned(), None),
            Ok(plans) if is_wood(&object.shape, traits.kind) => {
                let class = (f64::from(traits.height) / (CLASS_M * METRE)).floor() as i32;
                let plans = plans.into_iter().map(|plan| (traits, plan));
                woods.entry((traits.kind, class)).or_default().extend(plans);
            }
            Ok(plans) => outlines.extend(plans.into_iter().map(|plan| Outline { traits, plan })),
        }
    }
    woods.into_values().for_each(|woods| outlines.extend(united(woods)));
    outlines.sort();
    let all = outlines.len();
    outlines.dedup();
    if outlines.len() < all {
        let found = format!("{} that are there twice", all - outlines.len());
        remarks.push(ObjectRemark { name: String::new(), at_m: None, found, done: Some("kept once") });
    }
    remarks.sort_by(|a, b| (&a.name, &a.found).cmp(&(&b.name, &b.found)));
    (without_covered(outlines), remarks)
}

/// Whether it is united with others of its kind and height: all polygons but those of buildings.
fn is_wood(shape: &FoundShape, kind: ObjectKind) -> bool {
    matches!(shape, FoundShape::Polygon(_)) && !kind.is_prism()
}

/// What an object covers, or why that is nothing.
fn plans_of(shape: &FoundShape, traits: Traits, options: &ObjectOptions) -> Result<Vec<Plan>, &'static str> {
    let plans = match (shape, traits.kind) {
        (FoundShape::Line(line), ObjectKind::Wall) => {
            stretches(&lattice(line).ok_or(NO_PLACE)?, traits.width, WALL_M_MAX * METRE)
        }
        (FoundShape::Line(line), ObjectKind::Row) => {
            union(&stretches(&lattice(line).ok_or(NO_PLACE)?, traits.width, f64::MAX))
        }
        (FoundShape::Line(_), _) => return Err("a line, where a polygon is needed"),
        (&FoundShape::Point([x, y]), ObjectKind::Tower | ObjectKind::Row) => {
            let half = f64::from(traits.width) / METRE / 2.0;
            let ring = [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[dx, dy]| [x + dx, y + dy]);
            sorted_out(vec![lattice(&ring).ok_or(NO_PLACE)?])
        }
        (FoundShape::Point(_), _) => return Err("a point, where a polygon is needed"),
        (FoundShape::Polygon(rings), kind) if kind.is_prism() => building(rings, traits, options)?,
        (FoundShape::Polygon(rings), _) => {
            sorted_out(rings.iter().map(|ring| lattice(ring)).collect::<Option<_>>().ok_or(NO_PLACE)?)
        }
    };
    if plans.is_empty() { Err("without length or area") } else { Ok(plans) }
}

/// Square metres of a polygon, `None` of what is none: of its outer ring without its holes, and of what its rings
/// enclose an odd number of times. They differ where rings cross themselves or each other.
fn enclosed(shape: &FoundShape) -> Option<[f64; 2]> {
    let FoundShape::Polygon(rings) = shape else { return None };
    let rings = rings.iter().map(|ring| lattice(ring)).collect::<Option<Plan>>()?;
    let own = |ring: &Ring| ring_area(ring).abs();
    let (outer, holes) = rings.split_first()?;
    let simple = own(outer) - holes.iter().map(own).sum::<i64>();
    let enclosed: i64 = sorted_out(rings).iter().map(doubled_area).sum();
    Some([simple, enclosed].map(|doubled| doubled as f64 / (2.0 * METRE * METRE)))
}

fn first_place(shape: &FoundShape) -> Option<[f64; 2]> {
    match shape {
        FoundShape::Point(at) => Some(*at),
        FoundShape::Line(line) => line.first().copied(),
        FoundShape::Polygon(rings) => rings.first()?.first().copied(),
    }
}

/// Places in quanta, none twice in a row; `None` where one is none or far away.
fn lattice(line: &[[f64; 2]]) -> Option<Ring> {
    let at = |place: &[f64; 2]| {
        let quanta = place.map(|metres| (metres * METRE).round());
        quanta.iter().all(|quanta| quanta.abs() < f64::from(FAR)).then(|| quanta.map(|quanta| quanta as i32))
    };
    let mut ring: Ring = line.iter().map(at).collect::<Option<_>>()?;
    ring.dedup();
    Some(ring)
}

fn building(rings: &[Vec<[f64; 2]>], traits: Traits, options: &ObjectOptions) -> Result<Vec<Plan>, &'static str> {
    let coarse = |ring: &Vec<[f64; 2]>| {
        let snapped = |at: At| at.map(|quanta| (quanta + STEP / 2).div_euclid(STEP) * STEP);
        Some(lattice(ring)?.into_iter().map(snapped).collect::<Ring>())
    };
    let rings: Plan = rings.iter().map(coarse).collect::<Option<_>>().ok_or(NO_PLACE)?;
    let least = if traits.kind == ObjectKind::Building { options.area_min_m2 } else { 0.0 };
    let is_large = |plan: &Plan| 2.0 * least * METRE * METRE <= doubled_area(plan) as f64;
    let all = sorted_out(rings);
    if all.is_empty() {
        return Err("a polygon without area");
    }
    let large: Vec<Plan> =
        all.iter().filter(|plan| is_large(plan)).map(|plan| fewer(plan, options.corners_max)).collect();
    if large.is_empty() { Err("smaller than objects.area_min_m2") } else { Ok(large) }
}

/// What a way covers that is so many quanta wide: a rectangle along each of its edges, and what they leave between them
/// on the outer sides of bends.
pub fn strips(line: &[[i32; 2]], width: i32) -> Vec<Plan> {
    let bends = line.windows(3).filter_map(|places| outer_bend(places, f64::from(width) / 2.0));
    stretches(line, width, f64::MAX).into_iter().chain(bends.flat_map(|ring| sorted_out(vec![ring]))).collect()
}

/// The corner on the outer side of a bend: from the place to both rectangles that meet there, and to where their sides
/// do, unless the way nearly turns back.
fn outer_bend(places: &[At], half: f64) -> Option<Ring> {
    const TURN_COSINE_MIN: f64 = -0.5;
    let direction = |from: At, to: At| {
        let run = [0, 1].map(|axis| f64::from(to[axis]) - f64::from(from[axis]));
        run.map(|along| along / length(from, to).max(1.0))
    };
    let at = places[1];
    let [u, v] = [direction(places[0], at), direction(at, places[2])];
    let (turn, cosine) = (u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1]);
    if turn == 0.0 {
        return None;
    }
    // A way that turns left has its outer side on the right.
    let aside = |[x, y]: [f64; 2]| [y * turn.signum(), -x * turn.signum()];
    let [u, v] = [aside(u), aside(v)];
    let place = |off: [f64; 2]| [0, 1].map(|axis| at[axis] + (half * off[axis]).round() as i32);
    let meet = [0, 1].map(|axis| (u[axis] + v[axis]) / (1.0 + cosine));
    let tip = (TURN_COSINE_MIN < cosine).then(|| place(meet));
    Some([Some(at), Some(place(u)), tip, Some(place(v))].into_iter().flatten().collect())
}

/// The rectangles along a line, each as long as `most` quanta at most; they overlap where the line bends.
fn stretches(line: &[At], width: i32, most: f64) -> Vec<Plan> {
    let mut plans = Vec::new();
    for ends in line.windows(2) {
        let long = length(ends[0], ends[1]);
        let parts = (long / most).ceil().max(1.0) as i32;
        let run = [0, 1].map(|axis| f64::from(ends[1][axis]) - f64::from(ends[0][axis]));
        let half = f64::from(width.max(2)) / (2.0 * long);
        for part in 0..parts {
            let [from, to] = [part, part + 1].map(|part| f64::from(part) / f64::from(parts));
            let corner = |share: f64, left: f64| {
                let x = f64::from(ends[0][0]) + share * run[0] - left * half * run[1];
                let y = f64::from(ends[0][1]) + share * run[1] + left * half * run[0];
                [x.round() as i32, y.round() as i32]
            };
            let ring = vec![corner(from, -1.0), corner(to, -1.0), corner(to, 1.0), corner(from, 1.0)];
            plans.extend(sorted_out(vec![ring]));
        }
    }
    plans
}

/// Woods of one kind and class of heights as one layer, as high as the middle of their heights by area.
fn united(woods: Vec<(Traits, Plan)>) -> Vec<Outline> {
    let mut heights: Vec<(i32, i64)> = woods.iter().map(|(traits, plan)| (traits.height, doubled_area(plan))).collect();
    heights.sort_unstable();
    let all: i64 = heights.iter().map(|(_, area)| area).sum();
    let mut below = 0;
    let middle = heights.iter().find(|(_, area)| {
        below += area;
        all <= 2 * below
    });
    let (Some(&(height, _)), Some(&(traits, _))) = (middle, woods.first()) else { return Vec::new() };
    let traits = Traits { height, width: 0, is_part: false, bottom: 0, ..traits };
    let plans: Vec<Plan> = woods.into_iter().map(|(_, plan)| plan).collect();
    let least = (2.0 * WOOD_M2_MIN * METRE * METRE) as i64;
    let smooth = union(&plans).into_iter().flat_map(|plan| smoothed(&plan, WOOD_WITHIN_M * METRE, least));
    // Borders that moved may overlap.
    union(&smooth.collect::<Vec<_>>()).into_iter().map(|plan| Outline { traits, plan }).collect()
}

/// Without the outlines of buildings in whose place their parts stand.
fn without_covered(outlines: Vec<Outline>) -> Vec<Outline> {
    const CELL: i32 = 1 << 13;
    let mut parts: BTreeMap<At, Vec<usize>> = BTreeMap::new();
    for (number, outline) in outlines.iter().enumerate().filter(|(_, outline)| outline.traits.is_part) {
        for_each_cell(&outline.plan, CELL, |cell| parts.entry(cell).or_default().push(number));
    }
    let is_covered = |outline: &Outline| {
        if outline.traits.is_part || outline.traits.kind != ObjectKind::Building {
            return false;
        }
        let mut near = Vec::new();
        for_each_cell(&outline.plan, CELL, |cell| near.extend(parts.get(&cell).into_iter().flatten().copied()));
        near.sort_unstable();
        near.dedup();
        let near: Vec<Plan> = near.into_iter().map(|number| outlines[number].plan.clone()).collect();
        if near.is_empty() {
            return false;
        }
        let over: i64 = common(std::slice::from_ref(&outline.plan), &union(&near)).iter().map(doubled_area).sum();
        PARTS_MIN * doubled_area(&outline.plan) as f64 <= over as f64
    };
    let covered: Vec<bool> = outlines.iter().map(is_covered).collect();
    outlines.into_iter().zip(covered).filter(|(_, covered)| !covered).map(|(outline, _)| outline).collect()
}

fn for_each_cell(plan: &Plan, cell: i32, mut each: impl FnMut(At)) {
    let [[west, south], [east, north]] = bounds(plan).map(|at| at.map(|quanta| quanta.div_euclid(cell)));
    (south..=north).for_each(|y| (west..=east).for_each(|x| each([x, y])));
}

impl Outline {
    /// What of it is seen from the side, in square metres: its mean width over all directions, times its height and
    /// what it takes of the light.
    pub fn silhouette_m2(&self) -> f64 {
        let around: f64 = self.plan.iter().flat_map(|ring| edges(ring)).map(|(a, b)| length(a, b)).sum();
        self.traits.silhouette_m2(around)
    }
}

impl Traits {
    /// The same of a border so many quanta long.
    pub(super) fn silhouette_m2(&self, around: f64) -> f64 {
        let height = f64::from(self.height - self.bottom);
        around / std::f64::consts::PI * height * f64::from(self.fullness) / (100.0 * METRE * METRE)
    }
}
