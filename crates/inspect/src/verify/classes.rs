//! Whether each triangle has the class of the feature it lies in, else that of the ground under it: a second opinion,
//! which asks places all over a triangle for features and counts the posts under it for the ground.

use std::collections::BTreeSet;

use job::Job;
use terrain::{FeatureSurface, Importance, LoadModule, ModuleGrid, Spacing, TileFeatures};

use crate::recount;

/// Places asked along a side of a triangle.
const PLACES: usize = 6;
/// What shapes the ground without edges of its own has a triangle where it covers more than half of it. Between these
/// parts of the places asked, either class will do.
const DOUBT: std::ops::RangeInclusive<f64> = 0.3..=0.7;

/// A feature's ground: the inside of an odd number of rings, in quanta from the area's south-west post.
struct Body {
    class: u8,
    level: Option<i32>,
    /// Its western, southern, eastern and northern end.
    ends: [f64; 4],
    rings: Vec<Vec<[f64; 2]>>,
}

/// The ground of the features of a tile, for one level of detail.
pub(super) struct Classes {
    /// What has edges of its own in the mesh.
    kept: Vec<Body>,
    /// What shapes the ground alone.
    shaped: Vec<Body>,
}

impl Classes {
    /// What a level of a job shows of the features of a tile; 0 is the finest.
    pub fn new(job: &Job, features: &TileFeatures, level: usize, spacing: Spacing) -> Self {
        let names = job.class_names();
        let left_out: BTreeSet<&String> = job.lod.leave_out.iter().take(level).flatten().collect();
        let is_shown = |body: &&[FeatureSurface]| !left_out.contains(&names[usize::from(body[0].class)]);
        let quanta = f64::from(spacing.quanta_per_post() / features.kept.steps_per_post);
        let body = |body: &[FeatureSurface]| Body::new(body, quanta);
        Self {
            kept: features.bodies().filter(is_shown).map(body).collect(),
            shaped: features.shaped_bodies().filter(is_shown).map(body).collect(),
        }
    }

    /// The first triangle of a load module that has another class; `mask` is that of the ground without features.
    pub fn problem(
        &self,
        module: &LoadModule,
        mask: &Importance,
        grid: ModuleGrid,
        spacing: Spacing,
    ) -> Option<String> {
        let origin = [module.id.col, module.id.row].map(|line| f64::from(line) * f64::from(module.side));
        let far = origin.map(|at| at + f64::from(module.side));
        let extent = [origin[0], origin[1], far[0], far[1]];
        let [kept, shaped] = [&self.kept, &self.shaped].map(|bodies| reaching(bodies, extent));
        let places = places();
        let number = (0..module.triangles.len()).find(|&number| {
            let corners = module.triangles[number].map(|corner| {
                let vertex = module.vertices[usize::from(corner)];
                ([origin[0] + f64::from(vertex.x), origin[1] + f64::from(vertex.y)], vertex.z)
            });
            let class = module.classes[number];
            let is_level = |level: i32| corners.iter().all(|&(_, height)| height == level);
            let class_at = |bodies: &[&Body], at: [f64; 2]| {
                bodies.iter().find(|body| body.level.is_none_or(is_level) && body.holds(at)).map(|body| body.class)
            };
            let at = |shares: [f64; 3]| {
                [0, 1].map(|axis| corners.iter().zip(shares).map(|(corner, share)| corner.0[axis] * share).sum())
            };
            if let Some(own) = class_at(&kept, at([1.0 / 3.0; 3])) {
                return class != own;
            }
            let mut covers = [0.0; 256];
            for &place in &places {
                if let Some(class) = class_at(&shaped, at(place)) {
                    covers[usize::from(class)] += 1.0 / places.len() as f64;
                }
            }
            if *DOUBT.start() <= covers[usize::from(class)] {
                return false;
            }
            let ground = recount::class_of(module, number, mask, grid, spacing);
            covers.iter().any(|cover| DOUBT.end() < cover) || ground.is_some_and(|ground| ground != class)
        })?;
        let (id, class) = (module.id, module.classes[number]);
        Some(format!("load module {id}: triangle {number} has class {class}, the ground under it has another"))
    }
}

impl Body {
    fn new(body: &[FeatureSurface], quanta: f64) -> Self {
        let ring = |surface: &FeatureSurface| {
            surface.ring.iter().map(|vertex| [vertex.at.col, vertex.at.row].map(|at| f64::from(at) * quanta)).collect()
        };
        let rings: Vec<Vec<[f64; 2]>> = body.iter().map(ring).collect();
        let nowhere = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        let ends = rings.iter().flatten().fold(nowhere, |[west, south, east, north], &[x, y]| {
            [west.min(x), south.min(y), east.max(x), north.max(y)]
        });
        Self { class: body[0].class, level: body[0].level(), ends, rings }
    }

    fn reaches(&self, [west, south, east, north]: [f64; 4]) -> bool {
        self.ends[0] <= east && west <= self.ends[2] && self.ends[1] <= north && south <= self.ends[3]
    }

    fn holds(&self, at: [f64; 2]) -> bool {
        let crosses = |[a, b]: [[f64; 2]; 2]| {
            (a[1] <= at[1]) != (b[1] <= at[1]) && at[0] < a[0] + (at[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        };
        let edges = self.rings.iter().flat_map(|ring| (0..ring.len()).map(|i| [ring[i], ring[(i + 1) % ring.len()]]));
        self.reaches([at[0], at[1], at[0], at[1]]) && edges.filter(|&edge| crosses(edge)).count() % 2 == 1
    }
}

/// Those of some bodies that reach into a rectangle.
fn reaching(bodies: &[Body], extent: [f64; 4]) -> Vec<&Body> {
    bodies.iter().filter(|body| body.reaches(extent)).collect()
}

/// Places all over a triangle, as parts of its corners.
fn places() -> Vec<[f64; 3]> {
    let third = 1.0 / 3.0;
    let part = |i: usize, j: usize| {
        let [a, b] = [i, j].map(|at| (at as f64 + third) / PLACES as f64);
        [a, b, 1.0 - a - b]
    };
    (0..PLACES).flat_map(|i| (0..PLACES - i).map(move |j| part(i, j))).collect()
}
