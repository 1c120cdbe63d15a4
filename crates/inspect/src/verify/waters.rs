//! Lakes as the triangles of load modules hold them: posts inside against the level, whether the outline is in the
//! ground or had no room there.

use std::collections::BTreeMap;

use build::ground::GamingArea;
use terrain::{FeatureSurface, LoadModule, ModuleId, Post, SurfaceGround, TileFeatures, metres_of_quanta};

use super::laid::Laid;
use super::modules::Modules;
use super::square::{Outline, turn};

/// Smaller lakes are not looked at, in square metres: 1 ha.
const AREA_MIN_M2: f64 = 10_000.0;
/// How far the posts of a lake may lie off its level, as RMS in metres.
const OFF_MAX_M: f64 = 0.5;

/// Posts in lakes, by the rings of each lake.
#[derive(Default)]
pub(crate) struct Waters(BTreeMap<Vec<FeatureSurface>, Posts>);

#[derive(Clone, Copy, Default)]
struct Posts {
    count: u64,
    sum_squared: f64,
    /// Whether its shore is in no triangles, for want of room.
    is_shaped: bool,
}

impl Waters {
    /// Adds the posts of a tile.
    pub fn add(&mut self, laid: &Laid, modules: &Modules) {
        let features = laid.features;
        let is_lake = |body: &&[FeatureSurface]| body[0].ground == SurfaceGround::Lake;
        if !features.bodies().chain(features.shaped_bodies()).any(|body| is_lake(&body)) {
            return;
        }
        // What comes first has the ground, and what is in the triangles comes before what is not.
        let bodies: Vec<Outline> =
            features.bodies().chain(features.shaped_bodies()).map(|body| Outline::of(body, |at| laid.at(at))).collect();
        for (number, body) in features.bodies().chain(features.shaped_bodies()).enumerate() {
            if !is_lake(&body) {
                continue;
            }
            let posts = posts_in(&bodies[number], &bodies[..number], (laid.area, features), modules);
            let level = body[0].ring[0].height;
            let key = body.iter().map(|surface| FeatureSurface { body: 0, ..surface.clone() }).collect();
            let sum = self.0.entry(key).or_default();
            sum.is_shaped = features.bodies().count() <= number;
            for height in posts {
                let off_m = height - metres_of_quanta(level);
                (sum.count, sum.sum_squared) = (sum.count + 1, sum.sum_squared + off_m * off_m);
            }
        }
    }

    /// Lakes of 1 ha and more by their posts, those of them that lie off their level, and those of these whose shore
    /// had no room.
    pub fn counts(&self, area: &GamingArea) -> [u64; 3] {
        let post_m2 = area.frame.spacing.metres() * area.frame.spacing.metres();
        let large = || self.0.values().filter(|posts| AREA_MIN_M2 <= posts.count as f64 * post_m2);
        let off = || large().filter(|posts| OFF_MAX_M * OFF_MAX_M < posts.sum_squared / posts.count as f64);
        [large().count() as u64, off().count() as u64, off().filter(|posts| posts.is_shaped).count() as u64]
    }
}

/// Heights in metres of the triangles at the posts of a tile that lie in a body and in none before it.
fn posts_in(
    body: &Outline,
    before: &[Outline],
    (area, features): (&GamingArea, &TileFeatures),
    modules: &Modules,
) -> Vec<f64> {
    let spacing = i64::from(area.frame.spacing.quanta_per_post());
    let side = i64::from(area.grid.side_cells);
    let rect = area.tiling.modules(features.tile, area.grid);
    let [south, west, north, east] = body.reach.map(|quanta| quanta.div_euclid(spacing));
    let within = |v: i64, low: u32, high: u32| v.clamp(i64::from(low) * side, i64::from(high) * side - 1);
    let mut heights = Vec::new();
    for row in within(south, rect.south, rect.north)..=within(north + 1, rect.south, rect.north) {
        for col in within(west, rect.west, rect.east)..=within(east + 1, rect.west, rect.east) {
            let at = (row * spacing, col * spacing);
            if !body.holds(at) || before.iter().any(|other| other.holds(at)) {
                continue;
            }
            let id = ModuleId { row: (row / side) as u32, col: (col / side) as u32 };
            let post = Post::new(row as i32, col as i32);
            heights.extend(modules.get(&id).and_then(|module| height_m(&module, post, spacing)));
        }
    }
    heights
}

/// The height of a load module's triangles at a post.
fn height_m(module: &LoadModule, post: Post, spacing: i64) -> Option<f64> {
    let side = i64::from(module.side);
    let local = |post: i32, number: u32| i64::from(post) * spacing - i64::from(number) * side;
    let at = (local(post.row, module.id.row), local(post.col, module.id.col));
    let corner = |vertex: u16| {
        let vertex = module.vertices[usize::from(vertex)];
        (i64::from(vertex.y), i64::from(vertex.x))
    };
    let found = module.triangles.iter().find_map(|triangle| {
        let [a, b, c] = triangle.map(corner);
        let parts = [turn(b, c, at), turn(c, a, at), turn(a, b, at)];
        parts.iter().all(|part| 0 <= *part).then_some((triangle, parts))
    });
    let (triangle, parts) = found?;
    let whole: i128 = parts.iter().sum();
    let heights = triangle.map(|vertex| metres_of_quanta(module.vertices[usize::from(vertex)].z));
    let weighed = parts.iter().zip(heights).map(|(part, height)| *part as f64 * height);
    Some(weighed.sum::<f64>() / whole as f64)
}
