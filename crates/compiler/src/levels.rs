//! Coarser levels of a tile's load modules, as the job wants them.

use std::collections::{BTreeMap, BTreeSet};

use job::Method;
use load_modules::{Faces, Layout, LevelFeatures, LevelGround, Levels, coarser_levels};
use terrain::{Dem, Features, Importance, LoadModule};

use crate::run::Run;

/// Every level of a tile's load modules, beginning with the finest, which is given. Features stay in all of them.
pub(crate) fn all_levels(
    run: &Run,
    finest: Vec<LoadModule>,
    (layout, dem, mask): (&Layout, &Dem, &Importance),
    (features, faces): (&Features, Option<&Faces>),
) -> Vec<Vec<LoadModule>> {
    let lod = &run.job.lod;
    let mut levels = vec![finest];
    if lod.inner_shares.is_empty() {
        return levels;
    }
    let kept = Kept::new(features, layout);
    let ground = LevelGround { dem, mask };
    levels.resize_with(lod.level_count(), Vec::new);
    for place in 0..levels[0].len() {
        let of_level = LevelFeatures { faces, ..kept.of(&levels[0][place]) };
        let of_levels = match features.is_empty() {
            true => Vec::new(),
            false => vec![of_level; lod.inner_shares.len()],
        };
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

/// Vertices and edges of features by their places, in quanta from the area's south-west post.
struct Kept {
    vertices: BTreeSet<[i64; 2]>,
    edges: BTreeMap<[i64; 2], Vec<[i64; 2]>>,
    side: i64,
}

impl Kept {
    fn new(features: &Features, layout: &Layout) -> Self {
        let step = i64::from(layout.spacing.quanta_per_post() / features.steps_per_post);
        let place = |v: u32| {
            let at = features.vertices[v as usize].at;
            [i64::from(at.row) * step, i64::from(at.col) * step]
        };
        let mut edges: BTreeMap<[i64; 2], Vec<[i64; 2]>> = BTreeMap::new();
        for [a, b] in features.edges.iter().map(|ends| ends.map(place)) {
            edges.entry(a).or_default().push(b);
            edges.entry(b).or_default().push(a);
        }
        let vertices = (0..features.vertices.len() as u32).map(place).collect();
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
