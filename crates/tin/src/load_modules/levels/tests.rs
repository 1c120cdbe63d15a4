//! Levels against what they promise: sides that fit, counts, ranks and heights by slow searches.

use std::collections::BTreeSet;

use fastrand::Rng;
use terrain::{Dem, ModuleGrid, ModuleRect, Post, PostRect, Spacing};

use super::*;
use crate::load_modules::sheets::{assert_sides_are_shared, constrained, points, side_list};
use crate::load_modules::{ClipHeights, Face, Faces, clip, concatenate};

const SHARES: [f64; 2] = [0.5, 0.2];

fn layout() -> Layout {
    let grid = ModuleGrid { rows: 3, cols: 3, side_cells: 20 };
    Layout { grid, modules: grid.all(), spacing: Spacing::from_metres(25.0).unwrap() }
}

/// Hills of a kilometre with small ones on them, in quanta.
fn hills(rect: PostRect) -> Dem {
    let wave = |v: i32, period: i32, size: i32| {
        let at = v.rem_euclid(period) - period / 2;
        size - 4 * size * at * at / (period * period)
    };
    Dem::from_fn(rect, |post| {
        let (row, col) = (post.row, post.col);
        Some(wave(row, 41, 9000) + wave(col + row / 3, 37, 7000) + wave(2 * row - col, 13, 600))
    })
}

/// The same places at the heights of the DEM.
fn at_ground(mut tin: terrain::Tin, dem: &Dem) -> terrain::Tin {
    for vertex in &mut tin.vertices {
        let nearest = |v: i32| (v + 4).div_euclid(8);
        vertex.height = dem.height(Post::new(nearest(vertex.at.row), nearest(vertex.at.col)));
    }
    tin
}

/// Load modules with constrained edges on hills.
fn constrained_modules(layout: &Layout, dem: &Dem, mask: &Importance, seed: u64) -> Vec<LoadModule> {
    concatenate(&at_ground(constrained(layout, seed), dem), layout, mask, None)
}

/// Load modules with clipped edges on hills.
fn clipped_modules(layout: &Layout, dem: &Dem, mask: &Importance, seed: u64) -> Vec<LoadModule> {
    let mut points = points(layout.grid, 5, 150, seed);
    points.iter_mut().for_each(|v| v.height = dem.height(v.at.post().unwrap()));
    clip(&points, layout, ClipHeights::Coplanar, mask)
}

/// All levels of every load module, the finest first.
fn all_levels(
    finest: &[LoadModule],
    layout: &Layout,
    wanted: &Levels,
    dem: &Dem,
    mask: &Importance,
) -> Vec<Vec<LoadModule>> {
    let coarser: Vec<_> =
        finest.iter().map(|module| coarser_levels(module, layout, wanted, &LevelGround { dem, mask })).collect();
    let level = |k: usize| coarser.iter().map(|levels| levels[k].clone()).collect();
    std::iter::once(finest.to_vec()).chain((0..wanted.inner_shares.len()).map(level)).collect()
}

fn inner_places(module: &LoadModule) -> BTreeSet<(u16, u16)> {
    module.vertices.iter().filter(|v| is_inside(**v, module.side)).map(|v| (v.y, v.x)).collect()
}

fn squares(module: &LoadModule, posts: &Posts) -> u128 {
    module.triangles.iter().map(|t| posts.squares(t.map(|v| module.vertices[usize::from(v)]))).sum()
}

/// Checks every load module of every level and gives them.
fn check(border: LodBorder, flips: bool, clipped: bool, seed: u64) -> Vec<Vec<LoadModule>> {
    let layout = layout();
    let (dem, mask) = (hills(layout.grid.area()), Importance::uniform(layout.grid.area(), 1000));
    let make = if clipped { clipped_modules } else { constrained_modules };
    let finest = make(&layout, &dem, &mask, seed);
    let wanted = Levels { inner_shares: &SHARES, border, flips, features: &[] };
    let levels = all_levels(&finest, &layout, &wanted, &dem, &mask);
    for (at, fine) in finest.iter().enumerate() {
        let inner = inner_places(fine);
        let mut finer = inner.clone();
        for (level, share) in levels[1..].iter().zip(SHARES) {
            let module = &level[at];
            assert_eq!((module.check(), module.id, module.side), (Ok(()), fine.id, fine.side));
            assert_eq!(module.polygon_count as usize, module.triangles.len());
            let own = inner_places(module);
            assert_eq!(own.len(), (inner.len() as f64 * share).round() as usize, "seed {seed}, {}", fine.id);
            assert!(own.is_subset(&finer), "a coarser level holds no vertex that a finer one lacks");
            finer = own;
        }
    }
    levels
}

#[test]
fn neighbours_at_any_two_levels_list_equal_sides() {
    for (flips, clipped, seed) in [(false, false, 1), (true, false, 2), (false, true, 3), (true, true, 4)] {
        let levels = check(LodBorder::Full, flips, clipped, seed);
        let rect = ModuleRect { south: 0, west: 0, north: 3, east: 3 };
        for fine in &levels {
            for coarse in &levels {
                // A chessboard of the two, both ways round.
                for turn in 0..2 {
                    let mixed = |(at, (a, b)): (usize, (&LoadModule, &LoadModule))| {
                        if (at + turn) % 2 == 0 { a.clone() } else { b.clone() }
                    };
                    let board: Vec<_> = fine.iter().zip(coarse).enumerate().map(mixed).collect();
                    assert_sides_are_shared(&board, rect);
                }
            }
        }
    }
}

#[test]
fn thinned_sides_are_equal_at_equal_levels_and_keep_their_share() {
    for (clipped, seed) in [(false, 5), (true, 6)] {
        let levels = check(LodBorder::Own, true, clipped, seed);
        for level in &levels {
            assert_sides_are_shared(level, ModuleRect { south: 0, west: 0, north: 3, east: 3 });
        }
        for (level, share) in levels[1..].iter().zip(SHARES) {
            for (fine, coarse) in levels[0].iter().zip(level) {
                for side in Side::ALL {
                    let whole = side_list(fine, side);
                    let kept = side_list(coarse, side);
                    assert_eq!(kept.len() - 2, share_of(whole.len() - 2, share));
                    assert!(kept.iter().all(|point| whole.contains(point)), "vertices on sides stay as they are");
                }
            }
        }
    }
}

#[test]
fn a_vertex_goes_when_a_triangulation_without_it_is_the_closest_of_all() {
    for seed in 0..4 {
        let layout = layout();
        let mut draw = Rng::with_seed(seed);
        let area = layout.grid.area();
        let weights = area.posts().map(|_| 500 * draw.u16(..5)).collect();
        let mask = Importance::new(area, weights, vec![0; area.post_count()]);
        let mut dem = Dem::from_fn(area, |post| (post.row % 9 != 4).then(|| (post.row * post.col * 37) % 4001));
        dem.fill_voids(|_| 900_000);
        let module = constrained_modules(&layout, &dem, &mask, seed).swap_remove(4);
        let ground = LevelGround { dem: &dem, mask: &mask };
        let near = Posts::new(module.id, &layout, &ground);
        let inner: Vec<u16> =
            (0..).zip(&module.vertices).filter(|(_, v)| is_inside(**v, module.side)).map(|(v, _)| v).collect();
        let order = rank::removal_order(&module.vertices, &inner, inner.len(), &near);
        let mut left: Vec<u16> = (0..module.vertices.len() as u16).collect();
        for &gone in &order {
            let without = |v: u16| -> u128 {
                let rest = left.iter().filter(|&&u| u != v).map(|&u| module.vertices[usize::from(u)]);
                LevelMesh::delaunay(rest.collect(), &near).squares.iter().sum()
            };
            let best = inner.iter().filter(|v| left.contains(v)).min_by_key(|&&v| (without(v), v));
            assert_eq!(Some(&gone), best, "seed {seed}");
            left.retain(|&v| v != gone);
        }
    }
}

#[test]
fn no_other_height_of_an_inner_vertex_fits_better() {
    let levels = check(LodBorder::Full, true, false, 7);
    let layout = layout();
    let (dem, mask) = (hills(layout.grid.area()), Importance::uniform(layout.grid.area(), 1000));
    let ground = LevelGround { dem: &dem, mask: &mask };
    for module in levels[1].iter().chain(&levels[2]) {
        let near = Posts::new(module.id, &layout, &ground);
        let best = squares(module, &near);
        for v in (0..module.vertices.len()).filter(|&v| is_inside(module.vertices[v], module.side)) {
            let (low, high) = near.height_bounds(module.vertices[v]);
            for rise in [-40, 40] {
                let mut other = module.clone();
                other.vertices[v].z += rise;
                if other.vertices[v].z < low || high < other.vertices[v].z {
                    continue;
                }
                let posts_there = module.triangles.iter().filter(|t| t.contains(&(v as u16))).count();
                assert!(best <= squares(&other, &near) + 4 * posts_there as u128, "{} at vertex {v}", module.id);
            }
        }
    }
}

#[test]
fn no_vertex_of_a_coarser_level_stands_far_outside_the_posts_around_it() {
    let layout = layout();
    let ground = hills(layout.grid.area());
    let cliff = |post: Post| if (post.col + post.row / 3) % 30 < 15 { 12_800 } else { 0 };
    let dem = Dem::from_fn(layout.grid.area(), |post| Some(ground.height(post) / 10 + cliff(post)));
    let mask = Importance::uniform(layout.grid.area(), 1000);
    let finest = constrained_modules(&layout, &dem, &mask, 3);
    let wanted = Levels { inner_shares: &SHARES, border: LodBorder::Full, flips: true, features: &[] };
    let levels = all_levels(&finest, &layout, &wanted, &dem, &mask);
    let mut at_bound = 0;
    for module in levels[1..].iter().flatten() {
        let posts = Posts::new(module.id, &layout, &LevelGround { dem: &dem, mask: &mask });
        for vertex in module.vertices.iter().filter(|vertex| is_inside(**vertex, module.side)) {
            let (low, high) = posts.height_bounds(*vertex);
            assert!(low <= vertex.z && vertex.z <= high, "{}: {vertex:?} of {low} to {high}", module.id);
            at_bound += usize::from(low == vertex.z || high == vertex.z);
        }
    }
    assert!(0 < at_bound, "the cliff asks for heights beyond it");
}

#[test]
fn coarser_levels_lie_further_from_the_ground_and_flips_bring_them_closer() {
    let total = |flips: bool, level: usize| -> u128 {
        let levels = check(LodBorder::Full, flips, false, 8);
        let layout = layout();
        let (dem, mask) = (hills(layout.grid.area()), Importance::uniform(layout.grid.area(), 1000));
        let ground = LevelGround { dem: &dem, mask: &mask };
        levels[level].iter().map(|module| squares(module, &Posts::new(module.id, &layout, &ground))).sum()
    };
    assert!(total(false, 1) < total(false, 2));
    assert!(total(true, 1) < total(true, 2));
    assert!(total(true, 1) < total(false, 1) && total(true, 2) < total(false, 2));
}

#[test]
fn ground_without_weight_and_a_load_module_without_inner_vertices_have_levels_too() {
    let layout = layout();
    let area = layout.grid.area();
    let (dem, mask) = (hills(area), Importance::new(area, vec![0; area.post_count()], vec![0; area.post_count()]));
    let finest = constrained_modules(&layout, &dem, &mask, 9);
    let weighted = constrained_modules(&layout, &dem, &Importance::uniform(area, 1000), 9);
    let wanted = Levels { inner_shares: &SHARES, border: LodBorder::Full, flips: true, features: &[] };
    let uniform = Importance::uniform(area, 1000);
    // Where nothing has a weight, all posts count the same.
    assert_eq!(
        all_levels(&finest, &layout, &wanted, &dem, &mask),
        all_levels(&weighted, &layout, &wanted, &dem, &uniform)
    );
    let bare = finest[0].vertices.iter().copied().filter(|v| !is_inside(*v, finest[0].side)).collect();
    let ground = LevelGround { dem: &dem, mask: &mask };
    let near = Posts::new(finest[0].id, &layout, &ground);
    let bare = load_module(&finest[0], LevelMesh::delaunay(bare, &near), &layout, (&mask, None));
    assert_eq!(coarser_levels(&bare, &layout, &Levels { flips: false, ..wanted }, &ground), [bare.clone(), bare]);
}

#[test]
fn a_level_keeps_the_edges_and_heights_of_the_features_it_is_told_to_keep() {
    let layout = layout();
    let area = layout.grid.area();
    let (dem, mask) = (hills(area), Importance::uniform(area, 1000));
    for (seed, border) in [(11, LodBorder::Full), (12, LodBorder::Own)] {
        let finest = constrained_modules(&layout, &dem, &mask, seed).swap_remove(4);
        // An edge of every second triangle: some of them flips would turn, and most have an end that would go.
        let edges: Vec<[u16; 2]> = finest.triangles.iter().step_by(2).map(|&[a, b, _]| [b, a]).collect();
        let side = finest.side_vertices(Side::North)[1];
        let all = LevelFeatures { vertices: vec![side], edges, faces: None };
        let few = LevelFeatures { edges: all.edges[..2].to_vec(), ..LevelFeatures::default() };
        let features = [all, few];
        let wanted = Levels { inner_shares: &[0.3, 0.0], border, flips: true, features: &features };
        let ground = LevelGround { dem: &dem, mask: &mask };
        let levels = coarser_levels(&finest, &layout, &wanted, &ground);
        let bare = coarser_levels(&finest, &layout, &Levels { features: &[], ..wanted }, &ground);
        let mut lost = 0;
        for ((level, bare), features) in levels.iter().zip(&bare).zip(&features) {
            assert_eq!(level.check(), Ok(()));
            let of = |module: &LoadModule| -> BTreeSet<[ModuleVertex; 2]> {
                let sides = module.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
                let both = sides.flat_map(|[a, b]| [[a, b], [b, a]]);
                both.map(|ends| ends.map(|v| module.vertices[usize::from(v)])).collect()
            };
            let (found, otherwise) = (of(level), of(bare));
            let places: BTreeSet<ModuleVertex> = level.vertices.iter().copied().collect();
            assert!(features.all_vertices().all(|v| places.contains(&finest.vertices[usize::from(v)])));
            for edge in &features.edges {
                let ends = edge.map(|v| finest.vertices[usize::from(v)]);
                assert!(found.contains(&ends), "{ends:?}");
                lost += usize::from(!otherwise.contains(&ends));
            }
        }
        assert!(0 < lost, "without being told, levels lose such edges");
    }
}

#[test]
fn a_level_gives_its_triangles_the_classes_of_the_faces_it_is_told_to_show() {
    let layout = layout();
    let (area, side) = (layout.grid.area(), layout.side_lattice());
    let (dem, mask) = (hills(area), Importance::uniform(area, 1000));
    let finest = constrained_modules(&layout, &dem, &mask, 13).swap_remove(4);
    let step = i32::from(finest.side) / side;
    // Triangles that share no corner: a pond each.
    let mut used = BTreeSet::new();
    let ponds: Vec<[u16; 3]> = finest
        .triangles
        .iter()
        .filter(|t| t.iter().all(|v| !used.contains(v)) && t.iter().all(|&v| used.insert(v)))
        .copied()
        .collect();
    let (row, col) = (finest.id.row as i32 * side, finest.id.col as i32 * side);
    let place = |v: u16| {
        let vertex = finest.vertices[usize::from(v)];
        terrain::LatticePoint::new(row + i32::from(vertex.y) / step, col + i32::from(vertex.x) / step)
    };
    let given: Vec<Face> =
        ponds.iter().map(|t| Face { class: 4, level: None, rings: vec![t.map(place).to_vec()] }).collect();
    let faces = Faces::new(&given, terrain::LATTICE_PER_POST);
    let edges = ponds.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    let wet = LevelFeatures { vertices: Vec::new(), edges, faces: Some(&faces) };
    let dry = LevelFeatures::default();
    let features = [wet, dry];
    let wanted = Levels { inner_shares: &[0.3, 0.0], border: LodBorder::Own, flips: true, features: &features };
    let levels = coarser_levels(&finest, &layout, &wanted, &LevelGround { dem: &dem, mask: &mask });
    let count = |level: &LoadModule| level.classes.iter().filter(|class| **class == 4).count();
    assert!(
        3 < ponds.len() && levels.iter().map(count).eq([ponds.len(), 0]),
        "{:?} of {}",
        levels.iter().map(count).collect::<Vec<_>>(),
        ponds.len()
    );
}
