//! Whether each triangle has the class of the feature it lies in, else that of the ground under it: a second opinion,
//! which asks places all over a triangle for features and counts the posts under it for the ground.

use std::collections::BTreeSet;

use job::Job;
use terrain::{FeatureSurface, Importance, LoadModule, ModuleGrid, Spacing, TileFeatures};

use super::square::{At, Outline, Square};
use crate::recount;

/// Parts of a side into which a triangle is cut; the middles of its pieces are asked.
const SIDE: i64 = 8;
/// Parts of a quantum in which these middles are whole numbers.
const PARTS: i64 = 3 * SIDE;
/// What shapes the ground without edges of its own has a triangle where it covers more than half of it. The build cuts
/// a triangle into 16 pieces to see that, so between these parts of ours either class will do.
const DOUBT: std::ops::RangeInclusive<f64> = 0.25..=0.75;

/// A feature's ground.
struct Body {
    class: u8,
    level: Option<i32>,
    outline: Outline,
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
        let step = PARTS * i64::from(spacing.quanta_per_post() / features.kept.steps_per_post);
        let body = |body: &[FeatureSurface]| Body {
            class: body[0].class,
            level: body[0].level(),
            outline: Outline::of(body, |at| (i64::from(at.row) * step, i64::from(at.col) * step)),
        };
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
        let square = Square::of(module);
        let extent = square.reach().map(|at| PARTS * at);
        let [kept, shaped] = [&self.kept, &self.shaped].map(|bodies| reaching(bodies, extent));
        let is_wrong = |number: &usize| {
            let triangle = &module.triangles[*number];
            let class = module.classes[*number];
            let is_level = |level: i32| triangle.iter().all(|&v| module.vertices[usize::from(v)].z == level);
            let class_at = |bodies: &[&Body], at: At| {
                bodies.iter().find(|body| body.level.is_none_or(is_level) && body.outline.holds(at)).map(|of| of.class)
            };
            let corners = square.corners(triangle);
            // What lies inside edges of its own is held against what was decided, with or without a raster.
            if class_at(&kept, place(corners, [SIDE; 3])).is_some() {
                return false;
            }
            let covers = covers(|shares| class_at(&shaped, place(corners, shares)));
            if *DOUBT.start() <= covers[usize::from(class)] {
                return false;
            }
            let ground = recount::class_of(module, *number, mask, grid, spacing);
            covers.iter().any(|cover| DOUBT.end() < cover) || ground.is_some_and(|ground| ground != class)
        };
        let number = (0..module.triangles.len()).find(is_wrong)?;
        let (id, class) = (module.id, module.classes[number]);
        Some(format!("load module {id}: triangle {number} has class {class}, the ground under it has another"))
    }
}

/// Those of some bodies that reach into a rectangle.
fn reaching(bodies: &[Body], extent: [i64; 4]) -> Vec<&Body> {
    bodies.iter().filter(|body| body.outline.reaches(extent)).collect()
}

/// The place that so many of [`PARTS`] of each corner make.
fn place(corners: [At; 3], shares: [i64; 3]) -> At {
    corners.iter().zip(shares).fold((0, 0), |(y, x), (corner, share)| (y + share * corner.0, x + share * corner.1))
}

/// The part of a triangle that each class covers, by the middles of its pieces.
fn covers(class_at: impl Fn([i64; 3]) -> Option<u8>) -> [f64; 256] {
    let mut covers = [0.0; 256];
    for (i, j) in (0..SIDE).flat_map(|i| (0..SIDE - i).map(move |j| (3 * i, 3 * j))) {
        // The piece that stands as the triangle does, and the one turned around beside it.
        for turned in [1, 2].into_iter().filter(|turned| i + j + 2 * turned < PARTS) {
            if let Some(class) = class_at([i + turned, j + turned, PARTS - i - j - 2 * turned]) {
                covers[usize::from(class)] += 1.0 / (SIDE * SIDE) as f64;
            }
        }
    }
    covers
}
