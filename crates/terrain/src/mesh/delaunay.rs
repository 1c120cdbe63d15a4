//! The canonical Delaunay triangulation of given points.
//!
//! A library builds some Delaunay triangulation by bulk load; its choices among co-circular points depend
//! on the order of insertion, so a flip pass in exact integers follows: of four co-circular points the
//! diagonal through the smallest (by row, then column) stays. Such a flip gives the smallest of its four
//! points one edge more and takes one from two larger points, so the edge counts listed from the smallest
//! point to the largest grow lexicographically and the pass ends. It ends in the fan of every co-circular
//! polygon from its smallest corner: as long as that corner lacks an edge, the triangle beside the gap and
//! the one behind it can be flipped. So the result depends on the set of points only.
//!
//! With edges that stay, the library builds it edge by edge; the canonical pass follows and leaves kept edges alone.
//! Edges that run through points are kept in pieces; an edge that would cross one already kept is left out, so their
//! order matters.

use std::collections::{HashSet, VecDeque};

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, DelaunayTriangulation, Point2, Triangulation};

use crate::geometry::{Canonical, in_circle_canonical, orient};

/// A side of a triangle that no other triangle shares.
const HULL: u32 = u32::MAX;

/// The canonical Delaunay triangulation of distinct `points` (coordinates below 2^30 in size).
///
/// Triangles are counter-clockwise, name points by their place in `points`, start with their smallest
/// number and are sorted. Points along a straight hull are all corners; no triangle is without area. Fewer
/// than three points, or points on one line, have no triangle.
///
/// # Panics
/// When a point is listed twice.
pub fn delaunay<P: Canonical>(points: &[P]) -> Vec<[u32; 3]> {
    let library = DelaunayTriangulation::<Point2<f64>>::bulk_load_stable(places(points))
        .expect("32-bit whole numbers are within the library's bounds");
    canonical(&library, points, |_, _| false)
}

/// Points where the library wants them. Whole numbers below 2^53 are exact in its coordinates, and its predicates
/// are exact.
pub(crate) fn places<P: Canonical>(points: &[P]) -> Vec<Point2<f64>> {
    points.iter().map(|p| Point2::new(f64::from(p.col()), f64::from(p.row()))).collect()
}

/// The triangles of what the library made of `points`, canonical but for edges that are `kept`.
pub(crate) fn canonical<P, T>(library: &T, points: &[P], kept: impl Fn(u32, u32) -> bool) -> Vec<[u32; 3]>
where
    P: Canonical,
    T: Triangulation<Vertex = Point2<f64>>,
{
    let mut mesh = Neighbours::of(library, points.len());
    mesh.flip_to_canonical(points, kept);
    let mut triangles = mesh.corners;
    for triangle in &mut triangles {
        let first = (0..3).min_by_key(|&i| triangle[i]).expect("a triangle has three corners");
        triangle.rotate_left(first);
    }
    triangles.sort_unstable();
    triangles
}

/// Triangles and, beside side `i` (from corner `i` to the next), the triangle on its far side.
struct Neighbours {
    corners: Vec<[u32; 3]>,
    beside: Vec<[u32; 3]>,
}

impl Neighbours {
    /// What the library made, ties as it decides.
    fn of<T: Triangulation<Vertex = Point2<f64>>>(library: &T, points: usize) -> Self {
        assert_eq!(library.num_vertices(), points, "points to triangulate are distinct");
        let count = library.num_inner_faces();
        let (mut corners, mut beside) = (Vec::with_capacity(count), Vec::with_capacity(count));
        // The library numbers its outer face 0 and the triangles from 1.
        for face in library.inner_faces() {
            let sides = face.adjacent_edges();
            corners.push(sides.map(|side| side.from().index() as u32));
            beside.push(sides.map(|side| (side.rev().face().index() as u32).wrapping_sub(1)));
        }
        Self { corners, beside }
    }

    fn flip_to_canonical<P: Canonical>(&mut self, points: &[P], kept: impl Fn(u32, u32) -> bool) {
        let mut open: VecDeque<(u32, u32)> = VecDeque::new();
        for t in 0..self.corners.len() as u32 {
            for side in 0..3 {
                // Each side once: from the triangle with the smaller number.
                if t < self.beside[t as usize][side as usize] {
                    self.settle(points, &kept, (t, side), &mut open);
                }
            }
        }
        while let Some(side) = open.pop_front() {
            self.settle(points, &kept, side, &mut open);
        }
    }

    /// Flips side `side` of triangle `t` where the canonical rule asks for it; its outer sides are open again.
    ///
    /// ```text
    ///        c                c
    ///       / \              /|\
    ///      / t \            / | \
    ///     a-----b    =>    a  |  b       t = a p c, u = p b c
    ///      \ u /            \ | /
    ///       \ /              \|/
    ///        p                p
    /// ```
    fn settle<P: Canonical>(
        &mut self,
        points: &[P],
        kept: impl Fn(u32, u32) -> bool,
        (t, side): (u32, u32),
        open: &mut VecDeque<(u32, u32)>,
    ) {
        let (t, i) = (t as usize, side as usize);
        if self.beside[t][i] == HULL {
            return;
        }
        let u = self.beside[t][i] as usize;
        let [a, b, c] = [0, 1, 2].map(|k| self.corners[t][(i + k) % 3]);
        let j = self.side_towards(u, t);
        let p = self.corners[u][(j + 2) % 3];
        let place = |v: u32| points[v as usize];
        if kept(a, b) || !in_circle_canonical(place(a), place(b), place(c), place(p)) {
            return;
        }
        debug_assert!(0 < orient(place(a), place(p), place(c)) && 0 < orient(place(p), place(b), place(c)));
        let (beside_bc, beside_ca) = (self.beside[t][(i + 1) % 3], self.beside[t][(i + 2) % 3]);
        let (beside_ap, beside_pb) = (self.beside[u][(j + 1) % 3], self.beside[u][(j + 2) % 3]);
        (self.corners[t], self.beside[t]) = ([a, p, c], [beside_ap, u as u32, beside_ca]);
        (self.corners[u], self.beside[u]) = ([p, b, c], [beside_pb, beside_bc, t as u32]);
        self.point_back(beside_ap, u, t);
        self.point_back(beside_bc, t, u);
        open.extend([(t as u32, 0), (t as u32, 2), (u as u32, 0), (u as u32, 1)]);
    }

    fn side_towards(&self, from: usize, to: usize) -> usize {
        let side = self.beside[from].iter().position(|&other| other as usize == to);
        side.expect("neighbours know each other")
    }

    fn point_back(&mut self, outer: u32, old: usize, new: usize) {
        if outer != HULL {
            let side = self.side_towards(outer as usize, old);
            self.beside[outer as usize][side] = new as u32;
        }
    }
}

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
    use super::*;
    use crate::geometry::{in_circle, orient};
    use crate::{LatticePoint, Post};
    use fastrand::Rng;
    use std::collections::BTreeSet;

    /// About `share` of 16 of the posts of a square, its corners included.
    fn subset(draw: &mut Rng, side: i32, share: usize) -> Vec<Post> {
        let corner = |v: i32| v == 0 || v == side - 1;
        let all = (0..side).flat_map(|row| (0..side).map(move |col| Post::new(row, col)));
        all.filter(|p| corner(p.row) && corner(p.col) || draw.usize(..16) < share).collect()
    }

    fn edges(points: &[Post]) -> BTreeSet<(Post, Post)> {
        let place = |v: u32| points[v as usize];
        let sides = delaunay(points).into_iter().flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)]);
        sides.map(|(a, b)| (place(a).min(place(b)), place(a).max(place(b)))).collect()
    }

    /// Areas fill the hull, no point lies in any circle, and on a circle the fan is from the smallest point.
    #[track_caller]
    fn check<P: Canonical + std::fmt::Debug>(points: &[P], doubled_area: i64) {
        let mut area = 0;
        for triangle in delaunay(points) {
            let [a, b, c] = triangle.map(|v| points[v as usize]);
            assert!(0 < orient(a, b, c));
            area += orient(a, b, c);
            let mut on_circle = vec![a, b, c];
            for &p in points {
                let side = in_circle(a, b, c, p);
                assert!(side <= 0, "{p:?} lies inside the circle of {a:?} {b:?} {c:?}");
                if side == 0 {
                    on_circle.push(p);
                }
            }
            let smallest = on_circle.into_iter().min().unwrap();
            assert!([a, b, c].contains(&smallest), "{a:?} {b:?} {c:?} is not in the fan from {smallest:?}");
        }
        assert_eq!(area, doubled_area);
    }

    #[test]
    fn every_order_of_insertion_gives_one_edge_set() {
        let mut draw = Rng::with_seed(1);
        let mut points = subset(&mut draw, 13, 9);
        let expected = edges(&points);
        for _ in 0..200 {
            draw.shuffle(&mut points);
            assert_eq!(edges(&points), expected);
        }
    }

    #[test]
    fn every_circle_is_empty_and_fanned_from_its_smallest_point() {
        for seed in 0..40 {
            check(&subset(&mut Rng::with_seed(seed), 13, 3 + seed as usize % 14), 2 * 12 * 12);
        }
    }

    #[test]
    fn a_full_grid_has_no_other_diagonals_than_south_west_to_north_east() {
        let points = subset(&mut Rng::with_seed(0), 9, 16);
        check(&points, 2 * 8 * 8);
        assert!(edges(&points).iter().all(|(a, b)| a.row == b.row || a.col <= b.col));
    }

    #[test]
    fn twelve_points_on_one_circle_are_fanned_from_the_smallest() {
        let offsets = [(0, 5), (3, 4), (4, 3), (5, 0), (4, -3), (3, -4), (0, -5), (-3, -4), (-4, -3), (-5, 0), (-4, 3)];
        let mut points: Vec<_> = offsets.iter().map(|&(row, col)| Post::new(row, col)).collect();
        points.push(Post::new(-3, 4));
        let mut draw = Rng::with_seed(7);
        for _ in 0..50 {
            draw.shuffle(&mut points);
            let smallest = points.iter().position(|&p| p == Post::new(-5, 0)).unwrap() as u32;
            let triangles = delaunay(&points);
            assert_eq!(triangles.len(), 10);
            assert!(triangles.iter().all(|triangle| triangle.contains(&smallest)));
        }
    }

    #[test]
    fn points_along_straight_borders_are_all_corners() {
        let border = |i: i32| [Post::new(0, i), Post::new(i, 40), Post::new(40, 40 - i), Post::new(40 - i, 0)];
        let points: Vec<_> = (0..40).step_by(5).flat_map(border).collect();
        check(&points, 2 * 40 * 40);
        let used: BTreeSet<_> = delaunay(&points).into_iter().flatten().collect();
        assert_eq!(used.len(), points.len());
    }

    #[test]
    fn points_on_one_line_have_no_triangle() {
        let line: Vec<_> = (0..9).map(|i| LatticePoint::new(2 * i, 3 * i)).collect();
        assert!(delaunay(&line).is_empty());
        assert!(delaunay(&line[..1]).is_empty());
        assert!(delaunay::<Post>(&[]).is_empty());
    }

    #[test]
    fn coordinates_near_two_to_the_thirty_are_exact() {
        let far = (1 << 30) - 13;
        let points: Vec<_> =
            subset(&mut Rng::with_seed(3), 13, 8).iter().map(|p| Post::new(p.row + far, p.col + far)).collect();
        check(&points, 2 * 12 * 12);
        let mut spread = points;
        spread.push(Post::new(0, far));
        spread.push(Post::new(far, 0));
        let edges_of_spread = edges(&spread);
        Rng::with_seed(4).shuffle(&mut spread);
        assert_eq!(edges(&spread), edges_of_spread);
    }

    #[test]
    #[should_panic(expected = "points to triangulate are distinct")]
    fn a_point_listed_twice_is_refused() {
        delaunay(&[Post::new(0, 0), Post::new(0, 1), Post::new(1, 0), Post::new(0, 1)]);
    }

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
