//! What the tests of this crate share: seeded points and what neighbours must agree on.

use std::collections::BTreeMap;

use fastrand::Rng;
use terrain::{LatticePoint, LoadModule, ModuleGrid, ModuleId, ModuleRect, ModuleVertex, Post, Side, Tin, Vertex};

use crate::load_modules::Layout;

/// Corners of all load modules, points every `border_step` posts on the outer border, and `count` random posts.
pub(crate) fn points(grid: ModuleGrid, border_step: i32, count: usize, seed: u64) -> Vec<Vertex> {
    let mut draw = Rng::with_seed(seed);
    let area = grid.area();
    let mut places = std::collections::BTreeSet::new();
    for post in area.posts() {
        let on = |step: i32| post.row % step == 0 && post.col % step == 0;
        let outer = post.row == 0 || post.col == 0 || post.row == area.north || post.col == area.east;
        if on(grid.side_cells) || outer && on(border_step) {
            places.insert(post);
        }
    }
    for _ in 0..count {
        let inner = |far: i32, draw: &mut Rng| draw.i32(1..far);
        places.insert(Post::new(inner(area.north, &mut draw), inner(area.east, &mut draw)));
    }
    places.into_iter().map(|post| Vertex { at: post.into(), height: draw.i32(-9_000..51_000) }).collect()
}

/// The places along a side and the heights there.
pub(crate) fn side_list(module: &LoadModule, side: Side) -> Vec<(u16, i32)> {
    let along = |v: ModuleVertex| match side {
        Side::South | Side::North => (v.x, v.z),
        Side::East | Side::West => (v.y, v.z),
    };
    module.side_vertices(side).into_iter().map(|v| along(module.vertices[usize::from(v)])).collect()
}

/// Both load modules of every side list the same places and heights on it.
#[track_caller]
pub(crate) fn assert_sides_are_shared(modules: &[LoadModule], rect: ModuleRect) {
    let by_id: BTreeMap<_, _> = modules.iter().map(|module| (module.id, module)).collect();
    assert_eq!(by_id.len(), rect.count());
    for module in modules {
        let ModuleId { row, col } = module.id;
        for (side, id) in [(Side::North, ModuleId { row: row + 1, col }), (Side::East, ModuleId { row, col: col + 1 })]
        {
            if let Some(other) = by_id.get(&id) {
                let (own, theirs) = (side_list(module, side), side_list(other, side.opposite()));
                assert_eq!(own, theirs, "side between load modules {} and {id}", module.id);
            }
        }
    }
}

/// A TIN over the load modules of a tile: each square triangulated on its own over shared sides.
pub(crate) fn constrained(layout: &Layout, seed: u64) -> Tin {
    let mut draw = Rng::with_seed(seed);
    let rect = layout.grid.posts_of_rect(layout.modules);
    let side = layout.side_lattice();
    let (low, high) = (LatticePoint::from(rect.south_west()), LatticePoint::from(rect.north_east()));
    let mut places = std::collections::BTreeSet::new();
    for row in (low.row..=high.row).step_by(side as usize) {
        for col in (low.col..=high.col).step_by(side as usize) {
            places.insert(LatticePoint::new(row, col));
        }
    }
    for i in 0..90 {
        let mut within = |low: i32, high: i32| draw.i32(low..=high);
        let (mut row, mut col) = (within(low.row, high.row), within(low.col, high.col));
        // A third on module lines, and those on whole posts.
        if i % 3 == 0 {
            row = row / side * side;
            col = col / 8 * 8;
        } else if i % 3 == 1 {
            col = col / side * side;
            row = row / 8 * 8;
        }
        places.insert(LatticePoint::new(row, col));
    }
    let vertices: Vec<_> = places.iter().map(|&at| Vertex { at, height: draw.i32(-4000..5000) }).collect();
    let mut triangles = Vec::new();
    for id in layout.modules.iter() {
        let square = layout.grid.posts_of(id);
        let (low, high) = (LatticePoint::from(square.south_west()), LatticePoint::from(square.north_east()));
        let inside =
            |at: LatticePoint| (low.row..=high.row).contains(&at.row) && (low.col..=high.col).contains(&at.col);
        let own: Vec<_> = (0..vertices.len()).filter(|&v| inside(vertices[v].at)).collect();
        let points: Vec<_> = own.iter().map(|&v| vertices[v].at).collect();
        triangles.extend(terrain::mesh::delaunay(&points).into_iter().map(|t| t.map(|v| own[v as usize] as u32)));
    }
    Tin::new(rect, vertices, triangles)
}
