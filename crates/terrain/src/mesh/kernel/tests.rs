//! The kernel against the empty-circle definition, in many insertion orders.

use std::collections::BTreeSet;

use crate::{Post, PostRect};
use fastrand::Rng;

use super::*;

fn edges(mesh: &Mesh) -> BTreeSet<(LocalPost, LocalPost)> {
    let of = |t: &Triangle| [0, 1, 2].map(|i| (t.corners[i], t.corners[(i + 1) % 3]));
    mesh.triangles().iter().flat_map(of).map(|(a, b)| (a.min(b), a.max(b))).collect()
}

fn insert(mesh: &mut Mesh, post: LocalPost) {
    let triangle = mesh.triangle_at(post, 0);
    if !mesh.triangles()[triangle as usize].corners.contains(&post) {
        mesh.insert(post, triangle);
    }
}

/// Twins name each other, every triangle turns left, areas add up, and no edge should be flipped.
#[track_caller]
fn check(mesh: &Mesh, tile: PostRect) {
    let mut area = 0;
    for (index, record) in mesh.triangles().iter().enumerate() {
        let [a, b, c] = record.corners;
        assert!(0 < LocalPost::orient(a, b, c), "triangle {index} turns right");
        area += LocalPost::orient(a, b, c);
        for i in 0..3 {
            let (from, to, twin) = (record.corners[i], record.corners[(i + 1) % 3], record.twins[i]);
            if twin == NO_TWIN {
                continue;
            }
            let other = &mesh.triangles()[(twin >> 2) as usize];
            let j = (twin & 3) as usize;
            assert_eq!((other.corners[j], other.corners[(j + 1) % 3]), (to, from));
            assert_eq!(other.twins[j], (index * 4 + i) as u32);
            let apex = other.corners[(j + 2) % 3];
            let opposite = record.corners[(i + 2) % 3];
            let constrained = mesh.lines.constrain(from, to);
            assert!(
                constrained || !LocalPost::in_circle(&record.corners, apex, opposite),
                "edge {from:?} {to:?} should be flipped"
            );
        }
    }
    assert_eq!(area, 2 * (tile.cells_high() * tile.cells_wide()) as i64);
}

#[test]
fn any_order_of_insertion_gives_the_same_edges() {
    let tile = PostRect::of_size(13, 13);
    let mut random = Rng::with_seed(7);
    let mut posts: Vec<LocalPost> = (0..169).map(|i| LocalPost::new(i / 13, i % 13)).collect();
    random.shuffle(&mut posts);
    posts.truncate(90);
    for lines in [Lines::none(), Lines::every(6), Lines::every(4)] {
        let mut first = None;
        for _ in 0..200 {
            let mut mesh = Mesh::new(tile, lines);
            random.shuffle(&mut posts);
            posts.iter().for_each(|&post| insert(&mut mesh, post));
            check(&mesh, tile);
            let found = edges(&mesh);
            assert_eq!(*first.get_or_insert(found.clone()), found);
        }
    }
}

#[test]
fn no_edge_crosses_a_line() {
    let tile = PostRect::of_size(25, 37);
    let mut mesh = Mesh::new(tile, Lines::every(12));
    let mut random = Rng::with_seed(3);
    for _ in 0..400 {
        insert(&mut mesh, LocalPost::new(random.i32(0..25), random.i32(0..37)));
    }
    check(&mesh, tile);
    for (a, b) in edges(&mesh) {
        let crosses = |a: i32, b: i32| a.min(b) / 12 < (a.max(b) - 1) / 12;
        assert!(!crosses(a.row(), b.row()) && !crosses(a.col(), b.col()), "{a:?} {b:?}");
    }
}

#[test]
fn a_full_grid_of_posts_keeps_south_west_diagonals() {
    let tile = PostRect::new(Post::new(0, 0), Post::new(5, 5));
    let mut mesh = Mesh::new(tile, Lines::none());
    for i in 0..36 {
        insert(&mut mesh, LocalPost::new(i / 6, i % 6));
    }
    check(&mesh, tile);
    assert_eq!(mesh.triangles().len(), 50);
    assert!(edges(&mesh).iter().all(|(a, b)| {
        let (rows, cols) = (b.row() - a.row(), b.col() - a.col());
        (rows, cols) == (0, 1) || (rows, cols) == (1, 0) || (rows, cols) == (1, 1)
    }));
}

#[test]
fn a_start_with_free_corners_is_the_same_grid() {
    let tile = PostRect::of_size(9, 13);
    let mut free = Mesh::with_corners_every(tile, 4);
    let constrained = Mesh::new(tile, Lines::every(4));
    check(&free, tile);
    assert_eq!(edges(&free), edges(&constrained));
    insert(&mut free, LocalPost::new(5, 7));
    check(&free, tile);
}

#[test]
fn lines_are_the_multiples_of_the_step() {
    for step in [2, 3, 4, 7, 16, 20, 21, 500] {
        let lines = Lines::every(step);
        for at in 0..65_536 {
            assert_eq!(lines.holds_row(LocalPost::new(at, 1)), at % step == 0, "{at} of {step}");
        }
    }
}

#[test]
fn without_lines_nothing_is_constrained() {
    let lines = Lines::none();
    assert!(!lines.constrain(LocalPost::new(0, 0), LocalPost::new(0, 5)));
    assert!(!lines.constrain(LocalPost::new(7, 3), LocalPost::new(9, 3)));
}
