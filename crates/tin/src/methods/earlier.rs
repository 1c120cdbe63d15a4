//! The iterative method's predecessor: one post for each region of large residuals, triangulated greedily.
//!
//! A reconstruction of Polis and McKeown, "Iterative TIN generation from digital elevation models" (CVPR 1992), as far
//! as its successor describes it: the DEM less the TIN is contoured at half its largest residual, each contour has one
//! point, and of the edges between near points those that follow the ground best are accepted first.

use std::cmp::Reverse;
use std::collections::HashSet;

use terrain::geometry::owned::{PostGrid, visit_residuals};
use terrain::geometry::{Facet, orient};
use terrain::mesh::constrained_delaunay;
use terrain::{Dem, Post, Tin};

use crate::methods::dem_window::{DemWindow, Impossible, RING, beside, tin_of, within};

/// Nearest points to which edges are tried.
const NEAREST: usize = 24;

/// The TIN of `points` vertices, or of fewer where no residual is left.
///
/// # Errors
/// When the window has not so many posts, or fewer than its corners are asked for.
pub fn earlier(ground: &DemWindow, points: usize) -> Result<Tin, Impossible> {
    let (dem, rect) = (ground.dem, ground.dem.rect());
    within(rect, points)?;
    let mut posts = rect.corners().to_vec();
    loop {
        let triangles = greedy(dem, &posts);
        let mut worst = worst_of_regions(dem, &posts, &triangles);
        worst.truncate(points - posts.len());
        if worst.is_empty() {
            return Ok(tin_of(dem, &posts, triangles));
        }
        posts.extend(worst);
    }
}

/// The worst post of each region, worst first: connected posts of one sign with at least half of the largest residual.
fn worst_of_regions(dem: &Dem, posts: &[Post], triangles: &[[u32; 3]]) -> Vec<Post> {
    let rect = dem.rect();
    let wide = rect.posts_wide();
    let place = |post: Post| (post.row - rect.south) as usize * wide + (post.col - rect.west) as usize;
    let mut residuals = vec![0i32; rect.post_count()];
    for triangle in triangles {
        let corners = triangle.map(|v| posts[v as usize]);
        let local = corners.map(|p| (p.col - rect.west, p.row - rect.south));
        let facet = Facet::new(local.map(|p| p.0), local.map(|p| p.1), corners.map(|p| dem.height(p)));
        visit_residuals(&PostGrid::of_area(rect), &facet, dem, |post, residual| {
            if !dem.is_void(post) {
                residuals[place(post)] = residual;
            }
        });
    }
    let largest = residuals.iter().map(|residual| residual.unsigned_abs()).max().unwrap_or(0);
    if largest == 0 {
        return Vec::new();
    }
    let stands_out = |residual: i32| largest <= 2 * residual.unsigned_abs();
    let mut found: Vec<(Reverse<u32>, Post)> = Vec::new();
    for post in rect.posts() {
        let sign = residuals[place(post)].signum();
        if !stands_out(residuals[place(post)]) {
            continue;
        }
        // A region is emptied as it is met.
        let mut region = vec![post];
        let mut worst = (Reverse(0), post);
        while let Some(at) = region.pop() {
            let residual = std::mem::take(&mut residuals[place(at)]);
            if residual == 0 {
                continue;
            }
            worst = worst.min((Reverse(residual.unsigned_abs()), at));
            let around = RING.map(|step| beside(at, step)).into_iter().filter(|&other| rect.contains(other));
            region.extend(around.filter(|&other| {
                let residual = residuals[place(other)];
                residual.signum() == sign && stands_out(residual)
            }));
        }
        found.push(worst);
    }
    found.sort_unstable();
    found.into_iter().map(|(_, post)| post).collect()
}

/// Triangles between posts: edges are accepted in the order of how far they stray from the ground, when they cross none
/// accepted before; what is still open then is Delaunay.
fn greedy(dem: &Dem, posts: &[Post]) -> Vec<[u32; 3]> {
    let mut edges: Vec<[u32; 2]> = terrain::mesh::delaunay(posts)
        .into_iter()
        .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
        .chain(nearest(dem, posts))
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let vertices: HashSet<Post> = posts.iter().copied().collect();
    let mut priced: Vec<(f64, [Post; 2], [u32; 2])> = edges
        .into_iter()
        .map(|edge| (edge, edge.map(|v| posts[v as usize])))
        .filter(|&(_, [a, b])| !runs_through(&vertices, a, b))
        .map(|(edge, [a, b])| (straying(dem, a, b), [a.min(b), a.max(b)], edge))
        .collect();
    priced.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let edges: Vec<[u32; 2]> = priced.into_iter().map(|(_, _, edge)| edge).collect();
    constrained_delaunay(posts, &edges).0
}

/// Edges from each post to those nearest to it, found through squares that hold about four posts each.
fn nearest(dem: &Dem, posts: &[Post]) -> Vec<[u32; 2]> {
    let rect = dem.rect();
    let side = ((4 * rect.post_count() / posts.len()) as f64).sqrt().ceil().max(1.0) as i32;
    let square = |post: Post| ((post.row - rect.south) / side, (post.col - rect.west) / side);
    let (rows, cols) = square(rect.north_east());
    let mut inside = vec![Vec::new(); ((rows + 1) * (cols + 1)) as usize];
    for (v, &post) in posts.iter().enumerate() {
        let (row, col) = square(post);
        inside[(row * (cols + 1) + col) as usize].push(v as u32);
    }
    let mut edges = Vec::new();
    for (v, &post) in posts.iter().enumerate() {
        let (row, col) = square(post);
        let mut near: Vec<(i64, u32)> = Vec::new();
        for reach in 0..=rows.max(cols) {
            let is_ring = |r: i32, c: i32| (r - row).abs().max((c - col).abs()) == reach;
            for r in (row - reach).max(0)..=(row + reach).min(rows) {
                for c in ((col - reach).max(0)..=(col + reach).min(cols)).filter(|&c| is_ring(r, c)) {
                    near.extend(
                        inside[(r * (cols + 1) + c) as usize].iter().map(|&w| (apart(post, posts[w as usize]), w)),
                    );
                }
            }
            // All posts nearer than the next ring are known once it is farther than enough of these.
            let known = i64::from(reach) * i64::from(side);
            if NEAREST < near.iter().filter(|&&(apart, _)| apart <= known * known).count() {
                break;
            }
        }
        near.sort_unstable();
        edges.extend(near.into_iter().filter(|&(_, w)| w != v as u32).take(NEAREST).map(|(_, w)| [v as u32, w]));
    }
    edges
}

fn apart(a: Post, b: Post) -> i64 {
    let (rows, cols) = (i64::from(a.row - b.row), i64::from(a.col - b.col));
    rows * rows + cols * cols
}

/// Whether an edge runs through a vertex.
fn runs_through(vertices: &HashSet<Post>, a: Post, b: Post) -> bool {
    let (rows, cols) = (b.row - a.row, b.col - a.col);
    let pieces = common_divisor(rows.abs(), cols.abs());
    let step = (rows / pieces.max(1), cols / pieces.max(1));
    (1..pieces).any(|i| {
        let post = Post::new(a.row + i * step.0, a.col + i * step.1);
        debug_assert_eq!(orient(a, b, post), 0);
        vertices.contains(&post)
    })
}

fn common_divisor(a: i32, b: i32) -> i32 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

/// Mean absolute difference between the ground and an edge, where it crosses rows (or columns, if it crosses more of
/// those), in quanta.
fn straying(dem: &Dem, a: Post, b: Post) -> f64 {
    // One direction, whichever end comes first, so that the sum is the same.
    let (a, b) = (a.min(b), a.max(b));
    let (rows, cols) = (b.row - a.row, b.col - a.col);
    let count = rows.abs().max(cols.abs());
    let (from, to) = (f64::from(dem.height(a)), f64::from(dem.height(b)));
    let height = |i: i32| {
        // Whole along the longer direction; between two posts along the other.
        let (row, col) = (a.row * count + rows * i, a.col * count + cols * i);
        let low = Post::new(row.div_euclid(count), col.div_euclid(count));
        let rest = row.rem_euclid(count).max(col.rem_euclid(count));
        let high = Post::new(low.row + i32::from(row % count != 0), low.col + i32::from(col % count != 0));
        let share = f64::from(rest) / f64::from(count);
        f64::from(dem.height(low)) * (1.0 - share) + f64::from(dem.height(high)) * share
    };
    let off = |i: i32| {
        let share = f64::from(i) / f64::from(count);
        (height(i) - (from * (1.0 - share) + to * share)).abs()
    };
    let sum: f64 = (1..count).map(off).sum();
    if count < 2 { 0.0 } else { sum / f64::from(count - 1) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::scene::{self, metres, rms_m};

    #[test]
    fn one_pass_takes_one_post_of_each_region() {
        let hill =
            |post: Post, row: i32, col: i32, top: i32| top - 80 * ((post.row - row).abs() + (post.col - col).abs());
        let dem = scene::dem(31, 41, |post| {
            let up = hill(post, 8, 9, metres(5.0)).max(hill(post, 22, 30, metres(4.0))).max(0);
            up - hill(post, 8, 30, metres(4.5)).max(0)
        });
        let posts = dem.rect().corners().to_vec();
        let worst = worst_of_regions(&dem, &posts, &greedy(&dem, &posts));
        assert_eq!(worst, [Post::new(8, 9), Post::new(8, 30), Post::new(22, 30)]);
    }

    #[test]
    fn edges_follow_a_ridge_that_delaunay_would_cross() {
        // A diagonal ridge between two posts on it; the nearer pair beside it would be joined by Delaunay.
        let dem = scene::dem(21, 21, |post| -metres(f64::from((post.row - post.col).abs())));
        let mut posts = dem.rect().corners().to_vec();
        posts.extend([Post::new(4, 4), Post::new(16, 16), Post::new(13, 7), Post::new(7, 13)]);
        let triangles = greedy(&dem, &posts);
        let has = |a: u32, b: u32| triangles.iter().any(|t| t.contains(&a) && t.contains(&b));
        assert!(has(4, 5) && !has(6, 7));
        let delaunay = terrain::mesh::delaunay(&posts);
        assert!(delaunay.iter().any(|t| t.contains(&6) && t.contains(&7)));
    }

    #[test]
    fn the_number_of_points_is_met_and_the_tin_is_sound() {
        let dem = scene::rough(90, 110);
        for points in [4, 50, 400] {
            let tin = earlier(&scene::ground(&dem), points).unwrap();
            assert_eq!((tin.vertices.len(), tin.check()), (points, Ok(())));
        }
        let rms = |points| rms_m(&dem, &earlier(&scene::ground(&dem), points).unwrap());
        assert!(rms(400) < rms(50));
        assert_eq!(earlier(&scene::ground(&dem), 3).unwrap_err().expected, "4 to 9900 points");
    }

    #[test]
    fn flat_ground_keeps_its_corners() {
        let dem = scene::dem(20, 20, |_| 77);
        assert_eq!(earlier(&scene::ground(&dem), 50).unwrap().vertices.len(), 4);
    }

    #[test]
    fn nearest_posts_are_those_of_a_full_search() {
        let dem = scene::rough(60, 80);
        let posts: Vec<Post> =
            (0..300).map(|i| Post::new(i * 37 % 60, i * i % 80)).collect::<HashSet<_>>().into_iter().collect();
        let found = nearest(&dem, &posts);
        for v in 0..posts.len() {
            let mut all: Vec<_> =
                (0..posts.len()).filter(|&w| w != v).map(|w| (apart(posts[v], posts[w]), w as u32)).collect();
            all.sort_unstable();
            let expected: Vec<_> = all.into_iter().take(NEAREST).map(|(_, w)| [v as u32, w]).collect();
            let ours: Vec<_> = found.iter().filter(|edge| edge[0] == v as u32).copied().collect();
            assert_eq!(ours, expected);
        }
    }
}
