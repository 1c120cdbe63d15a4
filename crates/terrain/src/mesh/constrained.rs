//! The Delaunay triangulation of given points that keeps given edges.
//!
//! The library builds it edge by edge; the canonical pass follows and leaves kept edges alone. Edges that run through
//! points are kept in pieces; an edge that would cross one already kept is left out, so their order matters.

use std::collections::HashSet;

use crate::geometry::Canonical;
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use crate::mesh::delaunay::{canonical, places};

/// The Delaunay triangulation of distinct `points` constrained by `edges` (places in `points`), and whether each edge
/// could be kept.
///
/// Triangles are as those of [`crate::mesh::delaunay`].
///
/// # Panics
/// When a point is listed twice, or an edge names none.
pub fn constrained_delaunay<P: Canonical>(points: &[P], edges: &[[u32; 2]]) -> (Vec<[u32; 3]>, Vec<bool>) {
    let mut library = ConstrainedDelaunayTriangulation::<Point2<f64>>::bulk_load_cdt(places(points), Vec::new())
        .expect("32-bit whole numbers are within the library's bounds");
    let handle = |v: u32| FixedVertexHandle::from_index(v as usize);
    let mut add = |&[from, to]: &[u32; 2]| {
        let fits = from != to && library.can_add_constraint(handle(from), handle(to));
        if fits {
            library.add_constraint(handle(from), handle(to));
        }
        fits
    };
    let kept: Vec<bool> = edges.iter().map(&mut add).collect();
    let pieces: HashSet<(u32, u32)> = library
        .undirected_edges()
        .filter(|edge| edge.is_constraint_edge())
        .map(|edge| {
            let [a, b] = edge.vertices().map(|vertex| vertex.index() as u32);
            (a.min(b), a.max(b))
        })
        .collect();
    (canonical(&library, points, |a, b| pieces.contains(&(a.min(b), a.max(b)))), kept)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use crate::Post;
    use crate::geometry::orient;

    use super::*;

    fn grid(side: i32) -> Vec<Post> {
        (0..side).flat_map(|row| (0..side).map(move |col| Post::new(row, col))).collect()
    }

    fn edges_of(triangles: &[[u32; 3]]) -> BTreeSet<(u32, u32)> {
        let sides = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        sides.map(|(a, b)| (a.min(b), a.max(b))).collect()
    }

    #[test]
    fn without_edges_it_is_the_canonical_triangulation() {
        let points = grid(6);
        assert_eq!(constrained_delaunay(&points, &[]).0, crate::mesh::delaunay(&points));
    }

    #[test]
    fn an_edge_is_kept_whole_or_in_pieces_at_the_points_it_runs_through() {
        let points = grid(5);
        // From (0, 0) to (1, 3), and from (4, 0) to (2, 4) through (3, 2).
        let (triangles, kept) = constrained_delaunay(&points, &[[0, 8], [20, 14]]);
        assert_eq!(kept, [true, true]);
        let edges = edges_of(&triangles);
        assert!(edges.contains(&(0, 8)) && edges.contains(&(17, 20)) && edges.contains(&(14, 17)));
        let area: i64 = triangles.iter().map(|t| t.map(|v| points[v as usize])).map(|[a, b, c]| orient(a, b, c)).sum();
        assert_eq!(area, 2 * 4 * 4);
        assert!(triangles.iter().all(|t| 0 < orient(
            points[t[0] as usize],
            points[t[1] as usize],
            points[t[2] as usize]
        )));
    }

    #[test]
    fn an_edge_that_would_cross_a_kept_one_is_left_out() {
        let (triangles, kept) = constrained_delaunay(&grid(3), &[[0, 8], [1, 3], [2, 6]]);
        assert_eq!(kept, [true, false, true]);
        assert!(!edges_of(&triangles).contains(&(1, 3)));
    }

    #[test]
    fn edges_may_share_their_ends_and_repeat() {
        let (_, kept) = constrained_delaunay(&grid(4), &[[0, 7], [7, 13], [7, 0], [5, 5]]);
        assert_eq!(kept, [true, true, true, false]);
    }
}
