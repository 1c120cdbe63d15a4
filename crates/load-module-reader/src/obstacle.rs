//! What lies on top at a place, and what a vehicle hits there.

use std::ops::Range;

use crate::lookup::STEPS;
use crate::past::holds;
use crate::{Canopy, Hider, LoadedGround, ObjectKind, Prism, QUANTA_PER_METRE, TerrainModule};

/// The highest of all surfaces over a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Top {
    /// Height above the vertical datum.
    pub height_m: f64,
    /// What it belongs to.
    pub of: Hider,
}

impl Top {
    fn raise(&mut self, height_m: f64, of: Hider) {
        if self.height_m < height_m {
            *self = Self { height_m, of };
        }
    }
}

/// What stands in a vehicle's way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// What it is.
    pub kind: ObjectKind,
    /// The number of all of its pieces.
    pub id: u64,
    /// Metres from the place to its plan; 0 inside.
    pub distance_m: f64,
    /// Metres between the stems of a wood or a row, for a vehicle to judge whether it passes between them; `None` of
    /// what cannot be passed.
    pub spacing_m: Option<f64>,
}

/// Metres above its wheels from which on a vehicle hits what stands in its way; lower is driven over.
const STEP_M: f64 = 0.3;
/// Metres above its wheels up to which it hits what hangs there.
const VEHICLE_HEIGHT_M: f64 = 3.0;

impl LoadedGround {
    /// The highest of the ground, decks, roofs and tops of canopies over a place; `None` where nothing is loaded.
    pub fn top(&self, place_m: [f64; 2]) -> Option<Top> {
        self.top_of(place_m, true)
    }

    /// Height of the highest of the ground, decks and roofs over a place: where someone can stand; `None` where nothing
    /// is loaded.
    pub fn roof_m(&self, place_m: [f64; 2]) -> Option<f64> {
        self.top_of(place_m, false).map(|top| top.height_m)
    }

    fn top_of(&self, place_m: [f64; 2], with_crowns: bool) -> Option<Top> {
        let (index, place) = self.locate(place_m)?;
        let module = &self.modules()[index];
        let ground_m = module.lookup().height_m(place)?;
        let mut top = Top { height_m: ground_m, of: Hider::Ground };
        module.decks().iter().for_each(|decks| decks.triangles(place).for_each(|(_, m, _)| top.raise(m, Hider::Deck)));
        let objects = &module.module().objects;
        let at = place.map(|steps| steps as f64 / STEPS as f64);
        for (corners, ..) in module.objects().prisms.iter().flat_map(|prisms| prisms.triangles(place)) {
            let prism = &objects.prisms[corners[0][2] as usize];
            if holds(prism, at) {
                top.raise(metres(prism.roof), Hider::of(prism.kind));
            }
        }
        let canopies = module.objects().canopies.iter().filter(|_| with_crowns);
        for (corners, ..) in canopies.flat_map(|canopies| canopies.triangles(place)) {
            let canopy = &objects.canopies[corners[0][2] as usize];
            top.raise(ground_m + metres(canopy.height.into()), Hider::of(canopy.kind));
        }
        Some(top)
    }

    /// What a vehicle hits that stands at a place, an easting, a northing and the height of its wheels, and reaches so
    /// many metres around it: the nearest building, tower or wall between 0.3 and 3 m above its wheels, else the wood,
    /// scrub, orchard or row whose stems stand closest together. `None` where its way is free, or nothing is loaded.
    pub fn obstacle_at(&self, [east_m, north_m, wheels_m]: [f64; 3], radius_m: f64) -> Option<Obstacle> {
        let metre = f64::from(QUANTA_PER_METRE);
        let side_m = self.frame().side_m();
        let radius_m = radius_m.max(0.0);
        let from = |axis: usize, at: f64| ((at - self.frame().origin_m[axis]) / side_m).floor();
        let (block, mut found) = (self.block(), None);
        for row in within(from(1, north_m - radius_m), from(1, north_m + radius_m), block.south..block.north) {
            for col in within(from(0, east_m - radius_m), from(0, east_m + radius_m), block.west..block.east) {
                let Some(module) = self.module(row, col) else { continue };
                let corner = [col, row].map(|index| f64::from(index) * side_m);
                let [x, y] = [0, 1].map(|axis| [east_m, north_m][axis] - self.frame().origin_m[axis] - corner[axis]);
                let circle = Circle { middle: [x * metre, y * metre], radius: radius_m * metre };
                let heights = [STEP_M, VEHICLE_HEIGHT_M].map(|above| (wheels_m + above) * metre);
                found = nearer(found, hit_in(module, self.frame().side, &circle, heights));
            }
        }
        found
    }
}

fn metres(quanta: i32) -> f64 {
    f64::from(quanta) / f64::from(QUANTA_PER_METRE)
}

/// Rows or columns from one to another, both included, that are among those that are loaded.
fn within(first: f64, last: f64, loaded: Range<u32>) -> Range<u32> {
    // What is no number becomes 0, and what is too large the largest; then the range is empty or right.
    let [first, last] = [first.max(0.0) as u32, (last + 1.0).max(0.0) as u32];
    first.max(loaded.start)..last.min(loaded.end)
}

/// A place in quanta of a load module, and all that lies within some quanta of it.
struct Circle {
    middle: [f64; 2],
    radius: f64,
}

impl Circle {
    /// Quanta to an edge.
    fn to_edge(&self, [a, b]: [[f64; 2]; 2]) -> f64 {
        let along = [b[0] - a[0], b[1] - a[1]];
        let to = [self.middle[0] - a[0], self.middle[1] - a[1]];
        let length_squared = along[0] * along[0] + along[1] * along[1];
        let share = ((to[0] * along[0] + to[1] * along[1]) / length_squared).clamp(0.0, 1.0);
        (to[0] - share * along[0]).hypot(to[1] - share * along[1])
    }

    /// Quanta to the nearest edge of a ring.
    fn to_ring(&self, ring: impl ExactSizeIterator<Item = [f64; 2]> + Clone) -> f64 {
        let next = ring.clone().cycle().skip(1);
        ring.zip(next).map(|(a, b)| self.to_edge([a, b])).fold(f64::INFINITY, f64::min)
    }

    fn to_prism(&self, prism: &Prism) -> f64 {
        if holds(prism, self.middle) {
            return 0.0;
        }
        let of_ring = |ring: &Vec<crate::Corner>| self.to_ring(ring.iter().map(|c| [c.x, c.y].map(f64::from)));
        prism.rings.iter().map(of_ring).fold(f64::INFINITY, f64::min)
    }

    fn to_triangle(&self, corners: [[f64; 2]; 3]) -> f64 {
        let left =
            |[a, b]: [[f64; 2]; 2]| (b[0] - a[0]) * (self.middle[1] - a[1]) - (b[1] - a[1]) * (self.middle[0] - a[0]);
        let is_inside = (0..3).all(|i| 0.0 <= left([corners[i], corners[(i + 1) % 3]]));
        if is_inside { 0.0 } else { self.to_ring(corners.into_iter()) }
    }
}

/// What a vehicle hits in one load module, between two heights in quanta.
fn hit_in(module: &TerrainModule, side: u16, circle: &Circle, [low, high]: [f64; 2]) -> Option<Obstacle> {
    let objects = &module.module().objects;
    let box_around = [-circle.radius, circle.radius].map(|reach| circle.middle.map(|at| at + reach));
    let mut found = None;
    let mut hit = |id: u64, kind: ObjectKind, distance: f64, spacing_m: Option<f64>| {
        if distance <= circle.radius {
            let distance_m = distance / f64::from(QUANTA_PER_METRE);
            found = nearer(found, Some(Obstacle { kind, id, distance_m, spacing_m }));
        }
    };
    if let Some(prisms) = &module.objects().prisms {
        prisms.triangles_within(side, box_around, |corners| {
            let prism = &objects.prisms[corners[0][2] as usize];
            if f64::from(prism.base) < high && low < f64::from(prism.roof) {
                hit(prism.id, prism.kind, circle.to_prism(prism), None);
            }
        });
    }
    for canopies in &module.objects().canopies {
        canopies.triangles_within(side, box_around, |corners| {
            let Canopy { id, kind, spacing, .. } = objects.canopies[corners[0][2] as usize];
            let plan = corners.map(|[x, y, _]| [x, y].map(f64::from));
            hit(id, kind, circle.to_triangle(plan), Some(metres(spacing.into())));
        });
    }
    found
}

/// Of two obstacles the one that is told: what cannot be passed, the nearer of two such, the denser of two others.
fn nearer(a: Option<Obstacle>, b: Option<Obstacle>) -> Option<Obstacle> {
    let rank = |found: &Obstacle| (found.spacing_m.unwrap_or(-1.0), found.distance_m, found.id);
    a.into_iter().chain(b).min_by(|a, b| {
        let ((spacing_a, far_a, id_a), (spacing_b, far_b, id_b)) = (rank(a), rank(b));
        spacing_a.total_cmp(&spacing_b).then(far_a.total_cmp(&far_b)).then(id_a.cmp(&id_b))
    })
}
