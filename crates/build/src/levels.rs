//! Coarser levels of a tile's load modules, as the job wants them.

use std::collections::{BTreeMap, BTreeSet};

use job::Method;
use terrain::{Dem, FeatureSurface, Features, Importance, LoadModule, TileFeatures};
use tin::load_modules::{Face, Faces, Layout, LevelFeatures, LevelGround, Levels, coarser_levels};

use crate::left_out::{At, LeftOut, place_of};
use crate::run::Run;

/// Every level of a tile's load modules, beginning with the finest, which is given. Features stay in all of them, but
/// for classes that the job leaves out.
pub(crate) fn all_levels(
    run: &Run,
    finest: Vec<LoadModule>,
    (layout, dem, mask): (&Layout, &Dem, &Importance),
    features: &TileFeatures,
) -> Vec<Vec<LoadModule>> {
    let lod = &run.job.lod;
    let mut levels = vec![finest];
    if lod.inner_shares.is_empty() {
        return levels;
    }
    let left_out = run.left_out();
    let kept: Vec<LevelKept> = match left_out {
        Some(left_out) => (0..lod.inner_shares.len())
            .map(|level| LevelKept {
                kept: Kept::new(&features.kept, layout, Some((left_out, level))),
                faces: faces(features, left_out.classes(level)),
            })
            .collect(),
        None => {
            let faces = faces(features, &BTreeSet::new());
            vec![LevelKept { kept: Kept::new(&features.kept, layout, None), faces }]
        }
    };
    let ground = LevelGround { dem, mask };
    levels.resize_with(lod.level_count(), Vec::new);
    for place in 0..levels[0].len() {
        let mut of_levels: Vec<_> = kept.iter().map(|kept| kept.of(&levels[0][place])).collect();
        // Where none leaves out anything, all keep the same.
        let last = of_levels[of_levels.len() - 1].clone();
        of_levels.resize(lod.inner_shares.len(), last);
        let wanted = Levels {
            inner_shares: &lod.inner_shares,
            border: lod.border,
            flips: matches!(run.job.tin.method, Method::Optimised(_)),
            features: &of_levels,
        };
        let coarser = coarser_levels(&levels[0][place], layout, &wanted, &ground);
        levels[1..].iter_mut().zip(coarser).for_each(|(level, module)| level.push(module));
    }
    levels
}

/// Ground that has the class of a feature, but for some classes; nothing where there is none.
pub(crate) fn faces(features: &TileFeatures, without: &BTreeSet<u8>) -> Option<Faces> {
    let ring = |surface: &FeatureSurface| surface.ring.iter().map(|vertex| vertex.at).collect();
    let face = |body: &[FeatureSurface]| Face {
        class: body[0].class,
        level: body[0].level(),
        rings: body.iter().map(ring).collect(),
    };
    let bodies = features.bodies().filter(|body| !without.contains(&body[0].class));
    let all: Vec<Face> = bodies.map(face).collect();
    let loose = features.shaped_bodies().filter(|body| !without.contains(&body[0].class));
    let loose: Vec<Face> = loose.map(face).collect();
    let is_there = !all.is_empty() || !loose.is_empty();
    is_there.then(|| Faces::new(&all, features.kept.steps_per_post).with_loose(&loose))
}

/// What a level keeps of the features of a tile.
struct LevelKept {
    kept: Kept,
    faces: Option<Faces>,
}

impl LevelKept {
    fn of(&self, module: &LoadModule) -> LevelFeatures<'_> {
        LevelFeatures { faces: self.faces.as_ref(), ..self.kept.of(module) }
    }
}

/// Vertices and edges of features by their places.
struct Kept {
    vertices: BTreeSet<At>,
    edges: BTreeMap<At, Vec<At>>,
    side: i64,
}

impl Kept {
    /// All of them, or those that a level does not leave out.
    fn new(features: &Features, layout: &Layout, left_out: Option<(&LeftOut, usize)>) -> Self {
        let place = place_of(features, layout.spacing);
        let keeps_edge = |ends: &[At; 2]| left_out.is_none_or(|(left_out, level)| left_out.keeps_edge(level, *ends));
        let keeps_vertex = |at: &At| left_out.is_none_or(|(left_out, level)| left_out.keeps_vertex(level, *at));
        let mut edges: BTreeMap<At, Vec<At>> = BTreeMap::new();
        for [a, b] in features.edges.iter().map(|ends| ends.map(&place)).filter(keeps_edge) {
            edges.entry(a).or_default().push(b);
            edges.entry(b).or_default().push(a);
        }
        let vertices = (0..features.vertices.len() as u32).map(&place).filter(keeps_vertex).collect();
        Self { vertices, edges, side: i64::from(layout.side()) }
    }

    /// What a load module has of them. An edge that other vertices lie on is there in its pieces.
    fn of(&self, module: &LoadModule) -> LevelFeatures<'static> {
        let corner = [i64::from(module.id.row) * self.side, i64::from(module.id.col) * self.side];
        let place = |v: u16| {
            let vertex = module.vertices[usize::from(v)];
            [corner[0] + i64::from(vertex.y), corner[1] + i64::from(vertex.x)]
        };
        let count = module.vertices.len() as u16;
        let vertices: Vec<u16> = (0..count).filter(|&v| self.vertices.contains(&place(v))).collect();
        let mut edges: BTreeSet<[u16; 2]> = BTreeSet::new();
        for triangle in &module.triangles {
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                let [a, b] = [triangle[a], triangle[b]];
                if a < b && self.lies_on_one(place(a), place(b)) || b < a && self.lies_on_one(place(b), place(a)) {
                    edges.insert([a.min(b), a.max(b)]);
                }
            }
        }
        LevelFeatures { vertices, edges: edges.into_iter().collect(), faces: None }
    }

    /// Whether an edge of a load module is one of features, or the first piece of one.
    fn lies_on_one(&self, a: [i64; 2], b: [i64; 2]) -> bool {
        let ends = [(a, b), (b, a)];
        ends.into_iter().any(|(from, to)| {
            let towards = |end: &&[i64; 2]| {
                let [along, across] = [[end[0] - from[0], end[1] - from[1]], [to[0] - from[0], to[1] - from[1]]];
                let dot = along[0] * across[0] + along[1] * across[1];
                along[0] * across[1] == along[1] * across[0]
                    && 0 < dot
                    && across[0].abs() <= along[0].abs()
                    && across[1].abs() <= along[1].abs()
            };
            self.edges.get(&from).is_some_and(|others| others.iter().any(|end| towards(&end)))
        })
    }
}
