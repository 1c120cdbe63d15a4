//! Hierarchical triangulation: triangles split into three at an inner post, again and again; nothing is ever flipped.
//!
//! De Floriani, Falcidieno, Nagy and Pienovi, "A hierarchical structure for surface approximation" (Computers and
//! Graphics 8, 1984). Edges stay for good: the border of the window and its diagonal are as wrong in the end as in the
//! beginning, and triangles become slivers. What it buys is a tree, each cut of which is a TIN.
//!
//! Were posts on edges taken, too, for one of the two triangles at the edge, residuals would be smaller (on 460 x 376
//! posts of desert mountains RMS 15.7 instead of 20.8 m at 2500 points, 10.5 instead of 18.1 m at 5000), but the
//! surface would have cracks and be no TIN.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use terrain::geometry::{Facet, LocalPost, Surface, rounded, visit_posts};
use terrain::{Dem, Post, Tin};

use crate::methods::dem_window::{DemWindow, Impossible, tin_of, within};

/// Worst posts of a triangle among which the best is looked for.
const TRIED: usize = 16;

/// Where a triangle is split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Splitting {
    /// At its worst inner post.
    MaxError,
    /// At the one, of its 16 worst, that leaves the smallest largest residual inside the three parts.
    BestImprovement,
}

/// Triangles within triangles.
#[derive(Clone, Debug)]
pub struct Hierarchy<'a> {
    dem: &'a Dem,
    posts: Vec<LocalPost>,
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    corners: [u32; 3],
    /// The post it is split at; its parts are the three nodes from `first`.
    split: Option<Split>,
}

#[derive(Clone, Copy, Debug)]
struct Split {
    post: u32,
    first: u32,
}

/// A leaf that can be split: its error first, then the post by row and column.
type Entry = (u32, Reverse<LocalPost>, Reverse<u32>);

/// Splits the leaf of largest residual until there are `points` vertices; 4 are the corners of the window.
///
/// # Errors
/// When no leaf is left that can be split: `points` are out of reach.
pub fn hierarchical<'a>(ground: &DemWindow<'a>, points: usize, how: Splitting) -> Result<Hierarchy<'a>, Impossible> {
    let (dem, rect) = (ground.dem, ground.dem.rect());
    within(rect, points)?;
    let posts = rect.corners().map(|corner| LocalPost::of(corner, rect)).to_vec();
    let root = |corners| Node { corners, split: None };
    let mut made = Hierarchy { dem, posts, nodes: vec![root([0, 1, 2]), root([0, 2, 3])] };
    let surface = Surface::new(dem);
    let mut heap = BinaryHeap::new();
    heap.extend((0..2).filter_map(|node| made.entry(&surface, node, how)));
    while made.posts.len() < points {
        let Some((_, Reverse(post), Reverse(node))) = heap.pop() else {
            let expected = format!("at most {} points, since no triangle is left with an inner post", made.posts.len());
            return Err(Impossible::points(points, expected, "posts on edges are never taken by this method"));
        };
        let first = made.split(node, post);
        heap.extend((first..first + 3).filter_map(|part| made.entry(&surface, part, how)));
    }
    Ok(made)
}

impl Hierarchy<'_> {
    fn entry(&self, surface: &Surface, node: u32, how: Splitting) -> Option<Entry> {
        let corners = self.nodes[node as usize].corners.map(|v| self.posts[v as usize]);
        let worst = inner_residuals(self.dem, surface, corners, if how == Splitting::MaxError { 1 } else { TRIED });
        let &(value, Reverse(post)) = worst.first()?;
        let post = match how {
            Splitting::MaxError => post,
            Splitting::BestImprovement => {
                let left = |&&(_, Reverse(post)): &&(u32, Reverse<LocalPost>)| {
                    let part = |i: usize| {
                        let corners = [corners[i], corners[(i + 1) % 3], post];
                        inner_residuals(self.dem, surface, corners, 1).first().map_or(0, |worst| worst.0)
                    };
                    (0..3).map(part).max()
                };
                worst.iter().min_by_key(left)?.1.0
            }
        };
        Some((value, Reverse(post), Reverse(node)))
    }

    fn split(&mut self, node: u32, post: LocalPost) -> u32 {
        let (v, first) = (self.posts.len() as u32, self.nodes.len() as u32);
        self.posts.push(post);
        let [a, b, c] = self.nodes[node as usize].corners;
        self.nodes[node as usize].split = Some(Split { post: v, first });
        self.nodes.extend([[a, b, v], [b, c, v], [c, a, v]].map(|corners| Node { corners, split: None }));
        first
    }

    /// The TIN of the first `points` vertices.
    pub fn cut(&self, points: usize) -> Tin {
        let is_split = |node: &Node| node.split.is_some_and(|split| (split.post as usize) < points);
        let mut triangles = Vec::new();
        let mut open = vec![1, 0];
        while let Some(index) = open.pop() {
            let node = &self.nodes[index as usize];
            match node.split.filter(|_| is_split(node)) {
                Some(split) => open.extend((split.first..split.first + 3).rev()),
                None => triangles.push(node.corners),
            }
        }
        let rect = self.dem.rect();
        let posts: Vec<Post> = self.posts.iter().take(points).map(|post| post.post(rect)).collect();
        tin_of(self.dem, &posts, triangles)
    }
}

/// The `most` worst posts strictly inside a triangle, worst first, equals by row and column; none without a residual.
fn inner_residuals(
    dem: &Dem,
    surface: &Surface,
    corners: [LocalPost; 3],
    most: usize,
) -> Vec<(u32, Reverse<LocalPost>)> {
    let facet: Facet = surface.facet(corners);
    let rect = dem.rect();
    let mut worst: Vec<(u32, Reverse<LocalPost>)> = Vec::new();
    visit_posts(surface, &facet, |post, numerator| {
        let entry = (rounded(numerator, facet.den as u64) as u32, Reverse(post));
        if entry.0 == 0 || most <= worst.len() && worst.last().is_some_and(|least| entry <= *least) {
            return;
        }
        let inside = |i: usize| 0 < LocalPost::orient(corners[i], corners[(i + 1) % 3], post);
        if (0..3).all(inside) && !dem.is_void(post.post(rect)) {
            let place = worst.partition_point(|other| entry < *other);
            worst.insert(place, entry);
            worst.truncate(most);
        }
    });
    worst
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::growing::Growing;
    use crate::methods::scene::{self, rms_m};

    fn made(dem: &Dem, points: usize, how: Splitting) -> Tin {
        let tin = hierarchical(&scene::ground(dem), points, how).unwrap().cut(points);
        assert_eq!((tin.check(), tin.vertices.len(), tin.triangles.len()), (Ok(()), points, 2 * points - 6));
        tin
    }

    /// Smallest angle of each triangle in degrees, in order.
    fn least_angles(tin: &Tin) -> Vec<f64> {
        let angle = |triangle: &[u32; 3]| {
            let at = triangle.map(|v| tin.vertices[v as usize].at);
            let along = |i: usize, j: usize| (f64::from(at[j].col - at[i].col), f64::from(at[j].row - at[i].row));
            let angle = |i: usize| {
                let ((ax, ay), (bx, by)) = (along(i, (i + 1) % 3), along(i, (i + 2) % 3));
                (ax * by - ay * bx).atan2(ax * bx + ay * by).to_degrees()
            };
            (0..3).map(angle).fold(f64::INFINITY, f64::min)
        };
        let mut all: Vec<f64> = tin.triangles.iter().map(angle).collect();
        all.sort_by(f64::total_cmp);
        all
    }

    #[test]
    fn border_and_diagonal_are_as_wrong_in_the_end_as_in_the_beginning() {
        let dem = scene::rough(101, 101);
        let rect = dem.rect();
        let all = hierarchical(&scene::ground(&dem), 900, Splitting::MaxError).unwrap();
        for points in [4, 30, 900] {
            let tin = all.cut(points);
            let on_edges = tin.vertices.iter().filter(|vertex| {
                let post = vertex.at.post().unwrap();
                rect.has_on_border(post) || post.row == post.col
            });
            assert_eq!(on_edges.count(), 4, "no vertex but the corners is on the border or the diagonal");
            let edges: Vec<_> = tin.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
            assert!(edges.contains(&(0, 2)) || edges.contains(&(2, 0)), "the diagonal is an edge at {points} points");
        }
    }

    #[test]
    fn it_is_full_of_slivers_where_delaunay_is_not() {
        let dem = scene::rough(151, 151);
        let mut delaunay = Growing::new(&dem);
        delaunay.grow(900, 0);
        let median = |tin: &Tin| {
            let all = least_angles(tin);
            all[all.len() / 2]
        };
        let split = made(&dem, 900, Splitting::MaxError);
        assert!(median(&split) < 2.0, "{}", median(&split));
        assert!(20.0 < median(&delaunay.tin()), "{}", median(&delaunay.tin()));
        assert!(rms_m(&dem, &delaunay.tin()) < rms_m(&dem, &split));
    }

    #[test]
    fn a_cut_is_the_hierarchy_of_fewer_points() {
        let dem = scene::rough(61, 81);
        let ground = scene::ground(&dem);
        let all = hierarchical(&ground, 300, Splitting::MaxError).unwrap();
        for points in [4, 5, 50, 299] {
            assert_eq!(all.cut(points), hierarchical(&ground, points, Splitting::MaxError).unwrap().cut(points));
        }
    }

    #[test]
    fn the_best_improvement_is_another_choice_of_the_same_number() {
        let dem = scene::rough(61, 81);
        assert_ne!(made(&dem, 200, Splitting::BestImprovement), made(&dem, 200, Splitting::MaxError));
    }

    #[test]
    fn points_out_of_reach_are_refused_with_what_is_possible() {
        let dem = scene::dem(21, 21, |post| i32::from(post == Post::new(5, 9)) * 1000);
        let refused = hierarchical(&scene::ground(&dem), 400, Splitting::MaxError).unwrap_err();
        assert!(refused.expected.starts_with("at most "), "{refused}");
    }
}
