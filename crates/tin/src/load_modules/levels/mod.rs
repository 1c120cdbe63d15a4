//! Coarser levels of a load module: the same square with fewer vertices.
//!
//! The vertices inside are ranked: again and again the one goes whose absence costs least, and a level keeps those
//! that would go last. So a coarser level holds no vertex that a finer one lacks. What is left is triangulated as
//! Delaunay would have it, and the vertices inside take the heights at which squared residuals are least.
//! A side keeps all of its vertices, so that neighbours fit together at any two levels; or it is thinned by what it
//! knows of itself alone, so that they fit together at the same level.

mod fit;
mod flip;
mod level_mesh;
mod posts;
mod rank;
mod sides;
#[cfg(test)]
mod tests;

use terrain::{Importance, LoadModule, LodBorder, ModuleResidual, ModuleVertex, Side};

use crate::load_modules::{Faces, Layout, classes, pieces};
use level_mesh::{LevelMesh, is_inside};
pub use posts::LevelGround;
use posts::Posts;

/// Which levels a load module gets beside the finest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels<'a> {
    /// For each, the share of the finest level's inner vertices that it keeps; falling, between 0 and 1.
    pub inner_shares: &'a [f64],
    /// What becomes of the vertices on the sides.
    pub border: LodBorder,
    /// Whether edges leave Delaunay where the other diagonal has smaller squared residuals.
    pub flips: bool,
    /// What each level keeps of the features, as long as `inner_shares`, or nothing at all; a coarser one keeps no more
    /// than a finer one.
    pub features: &'a [LevelFeatures<'a>],
}

/// What a level keeps of roads, rivers and shores, by places in the list of the finest level's vertices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LevelFeatures<'a> {
    /// Vertices that stay where and as high as they are, those of `edges` and beside them those on a side that belong
    /// to an edge in the load module next to it.
    pub vertices: Vec<u16>,
    /// Edges that stay.
    pub edges: Vec<[u16; 2]>,
    /// What gives its triangles classes before the mask does.
    pub faces: Option<&'a Faces>,
}

impl LevelFeatures<'_> {
    fn all_vertices(&self) -> impl Iterator<Item = u16> {
        self.vertices.iter().copied().chain(self.edges.iter().flatten().copied())
    }
}

/// The levels of a load module, one for each share, from fine to coarse. Residuals are left empty.
///
/// # Panics
/// When shares do not fall, edges of features cross, or the windows of `ground` do not hold the load module.
pub fn coarser_levels(finest: &LoadModule, layout: &Layout, levels: &Levels, ground: &LevelGround) -> Vec<LoadModule> {
    assert!(levels.inner_shares.is_sorted_by(|finer, coarser| coarser < finer), "levels go from fine to coarse");
    let none = LevelFeatures::default();
    let features = |level: usize| levels.features.get(level).unwrap_or(&none);
    let count = levels.inner_shares.len();
    let posts = Posts::new(finest.id, layout, ground);
    let inner: Vec<u16> =
        (0..).zip(&finest.vertices).filter(|(_, vertex)| is_inside(**vertex, finest.side)).map(|(v, _)| v).collect();
    let kept: Vec<usize> = levels.inner_shares.iter().map(|&share| share_of(inner.len(), share)).collect();
    let fewest = kept.last().copied().unwrap_or(inner.len());
    let gone = rank::removal_order(&finest.vertices, &inner, inner.len() - fewest, &posts);
    let sides = SideOrder::of(finest);
    let level = |level: usize| {
        let mut stays = vec![true; finest.vertices.len()];
        gone[..inner.len() - kept[level]].iter().for_each(|&v| stays[usize::from(v)] = false);
        if levels.border == LodBorder::Own {
            sides.thin(levels.inner_shares[level], &mut stays);
        }
        features(level).all_vertices().for_each(|v| stays[usize::from(v)] = true);
        let sheet = fitted(finest, &stays, features(level), levels.flips, &posts);
        load_module(finest, sheet, layout, (ground.mask, features(level).faces))
    };
    (0..count).map(level).collect()
}

/// So many of `count`, rounded half up.
fn share_of(count: usize, share: f64) -> usize {
    (count as f64 * share).round() as usize
}

/// The vertices that stay triangulated, those inside at fitted heights unless they belong to features.
fn fitted(finest: &LoadModule, stays: &[bool], features: &LevelFeatures, flips: bool, posts: &Posts) -> LevelMesh {
    /// Flips ask for other heights, and these for other flips; a third round hardly changes anything.
    const ROUNDS: usize = 2;
    let staying: Vec<usize> = (0..stays.len()).filter(|&v| stays[v]).collect();
    let vertices: Vec<ModuleVertex> = staying.iter().map(|&v| finest.vertices[v]).collect();
    let number = |v: u16| staying.partition_point(|&other| other < usize::from(v)) as u16;
    let edges: Vec<[u16; 2]> = features.edges.iter().map(|ends| ends.map(number)).collect();
    let mut is_free: Vec<bool> = vertices.iter().map(|&vertex| is_inside(vertex, finest.side)).collect();
    features.all_vertices().for_each(|v| is_free[usize::from(number(v))] = false);
    let mut sheet = LevelMesh::keeping(vertices, &edges, posts);
    fit::fit_heights(&mut sheet, &is_free, posts);
    for _ in 0..ROUNDS {
        if !flips || flip::flip_all(&mut sheet, posts) == 0 {
            break;
        }
        fit::fit_heights(&mut sheet, &is_free, posts);
    }
    sheet
}

/// The load module that a sheet is.
fn load_module(
    finest: &LoadModule,
    sheet: LevelMesh,
    layout: &Layout,
    (mask, faces): (&Importance, Option<&Faces>),
) -> LoadModule {
    let (vertices, triangles) = sheet.into_lists();
    let mut module = LoadModule {
        id: finest.id,
        side: finest.side,
        polygon_count: triangles.len() as u32,
        triangles,
        vertices,
        classes: Vec::new(),
        residual: ModuleResidual::default(),
        decks: finest.decks.clone(),
        // They are the same at every level, so that the finest has them alone.
        lines: Vec::new(),
        objects: terrain::Objects::default(),
    };
    module.classes = classes::of_triangles(&module, layout, mask, faces);
    let sides = 3 * module.triangles.len();
    pieces::assert_sound(&module, sides);
    module
}

/// The vertices of each side but its ends, in the order in which thinning takes them.
struct SideOrder([Vec<u16>; 4]);

impl SideOrder {
    fn of(module: &LoadModule) -> Self {
        Self(Side::ALL.map(|side| {
            let list = module.side_vertices(side);
            let line: Vec<_> = list.iter().map(|&v| along(side, module.vertices[usize::from(v)])).collect();
            sides::removal_order(&line).into_iter().map(|place| list[place]).collect()
        }))
    }

    /// Takes out all but a share of each side's.
    fn thin(&self, share: f64, stays: &mut [bool]) {
        for order in &self.0 {
            let gone = order.len() - share_of(order.len(), share);
            order[..gone].iter().for_each(|&v| stays[usize::from(v)] = false);
        }
    }
}

/// How far along its side a vertex lies, and its height.
fn along(side: Side, vertex: ModuleVertex) -> (u16, i32) {
    match side {
        Side::South | Side::North => (vertex.x, vertex.z),
        Side::East | Side::West => (vertex.y, vertex.z),
    }
}
