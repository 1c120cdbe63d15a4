//! A TIN from contour lines: their simplified pieces are edges, and flat triangles have a point in the middle.
//!
//! Lines come from marching squares, points on them move to the nearest post and take its height, and pieces that would
//! then cross others are left out.

mod lines;

use std::collections::HashMap;

use terrain::mesh::constrained_delaunay;
use terrain::{Post, QUANTA_PER_METRE, Tin};

use crate::methods::dem_window::{DemWindow, Impossible, tin_of, tolerance, within};
use crate::methods::polyline::tolerances;
use lines::{Levels, Line, contours};

/// Intervals tried for a number of points.
const TRIES: usize = 24;

/// Which contours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contours {
    /// Every so many metres, counted from 0.
    Interval(f64),
    /// As many, counted from the lowest post, as make no more than so many points; the number is not met exactly.
    Points(usize),
}

/// Posts by which lines are simplified where their interval is given: nothing is spared.
const TOLERANCE_POSTS: f64 = 0.5;
/// The same where a number of points is. Many lines drawn roughly are nearer to the ground than few drawn exactly: on
/// 460 x 376 posts of desert mountains, 2500 points, 0.5, 1, 2 and 4 posts leave RMS 24.9, 13.2, 5.5 and 6.6 m.
const TOLERANCE_POSTS_OF_FEW: f64 = 2.0;

/// The TIN of contours simplified by `line_tolerance_m`; where none is given, by half a post for an interval and by two
/// for a number of points.
///
/// # Errors
/// When a number is not possible.
pub fn contour_tin(ground: &DemWindow, which: Contours, line_tolerance_m: Option<f64>) -> Result<Tin, Impossible> {
    let posts = if matches!(which, Contours::Points(_)) { TOLERANCE_POSTS_OF_FEW } else { TOLERANCE_POSTS };
    let line_tolerance_m = tolerance(line_tolerance_m.unwrap_or(ground.spacing.0 * posts))?;
    match which {
        Contours::Interval(metres) => {
            let quanta = metres * f64::from(QUANTA_PER_METRE);
            if !(1.0..=f64::from(i32::MAX)).contains(&quanta) {
                let hint = "contours every 10 m are usual";
                return Err(Impossible::new(format!("an interval of {metres} m"), "1/128 m or more", hint));
            }
            Ok(of_levels(ground, Levels { from: 0, interval: quanta as i32 }, line_tolerance_m))
        }
        Contours::Points(points) => of_points(ground, points, line_tolerance_m),
    }
}

/// Bisects the interval: the finest that makes no more than `points`.
fn of_points(ground: &DemWindow, points: usize, line_tolerance_m: f64) -> Result<Tin, Impossible> {
    within(ground.dem.rect(), points)?;
    let (lowest, highest) = ground.dem.range();
    // At the widest interval, no line is left.
    let (mut fine, mut coarse) = (0, (highest - lowest).max(1) + 1);
    let levels = |interval: i32| Levels { from: lowest, interval };
    let mut best = of_levels(ground, levels(coarse), line_tolerance_m);
    for _ in 0..TRIES {
        let middle = fine + (coarse - fine) / 2;
        if middle == fine {
            break;
        }
        match within_points(ground, levels(middle), line_tolerance_m, points) {
            Some(tin) => {
                coarse = middle;
                // A finer interval has more points nearly always, but not by law.
                if best.vertices.len() <= tin.vertices.len() {
                    best = tin;
                }
            }
            None => fine = middle,
        }
    }
    Ok(best)
}

/// The TIN of some levels, unless it has more than `most` points.
fn within_points(ground: &DemWindow, levels: Levels, line_tolerance_m: f64, most: usize) -> Option<Tin> {
    let pieces = Pieces::of(ground, levels, line_tolerance_m);
    (pieces.posts.len() <= most).then(|| pieces.tin(ground)).filter(|tin| tin.vertices.len() <= most)
}

fn of_levels(ground: &DemWindow, levels: Levels, line_tolerance_m: f64) -> Tin {
    Pieces::of(ground, levels, line_tolerance_m).tin(ground)
}

/// Simplified contours on posts.
struct Pieces {
    /// Corners of the window, then posts of lines in the order they were met.
    posts: Vec<Post>,
    /// The level of each post's first line; none for corners.
    levels: Vec<Option<i32>>,
    /// Pieces of lines, as places in `posts`.
    edges: Vec<[u32; 2]>,
}

impl Pieces {
    fn of(ground: &DemWindow, levels: Levels, line_tolerance_m: f64) -> Self {
        let corners = ground.dem.rect().corners();
        let mut pieces = Self { posts: corners.to_vec(), levels: vec![None; 4], edges: Vec::new() };
        let mut index_of: HashMap<Post, u32> = corners.into_iter().zip(0..).collect();
        for line in contours(ground.dem, levels) {
            let posts = simplified(ground, &line, line_tolerance_m);
            let places: Vec<u32> = posts
                .into_iter()
                .map(|post| {
                    *index_of.entry(post).or_insert_with(|| {
                        pieces.posts.push(post);
                        pieces.levels.push(Some(line.level));
                        pieces.posts.len() as u32 - 1
                    })
                })
                .collect();
            pieces.edges.extend(places.windows(2).filter(|pair| pair[0] != pair[1]).map(|pair| [pair[0], pair[1]]));
        }
        pieces
    }

    /// The constrained triangulation, with a point in the middle of each flat triangle that has room for one.
    fn tin(mut self, ground: &DemWindow) -> Tin {
        let (triangles, _) = constrained_delaunay(&self.posts, &self.edges);
        let mut medial: Vec<Post> = triangles.iter().filter_map(|&triangle| self.medial(ground, triangle)).collect();
        if medial.is_empty() {
            return tin_of(ground.dem, &self.posts, triangles);
        }
        medial.sort_unstable();
        medial.dedup();
        self.posts.extend(medial);
        let (triangles, _) = constrained_delaunay(&self.posts, &self.edges);
        tin_of(ground.dem, &self.posts, triangles)
    }

    /// The post nearest to the middle of a triangle whose corners are on one level, if it lies inside.
    fn medial(&self, ground: &DemWindow, triangle: [u32; 3]) -> Option<Post> {
        let [a, b, c] = triangle.map(|v| self.levels[v as usize]);
        if a.is_none() || a != b || b != c {
            return None;
        }
        let corners = triangle.map(|v| self.posts[v as usize]);
        let third = |sum: i32| (2 * sum + 3).div_euclid(6);
        let row = third(corners.iter().map(|post| post.row).sum());
        let col = third(corners.iter().map(|post| post.col).sum());
        let post = Post::new(row, col);
        let inside = (0..3).all(|i| 0 < terrain::geometry::orient(corners[i], corners[(i + 1) % 3], post));
        (inside && !ground.dem.is_void(post)).then_some(post)
    }
}

/// The posts nearest to the points of a line that are kept.
fn simplified(ground: &DemWindow, line: &Line, line_tolerance_m: f64) -> Vec<Post> {
    let spacing = ground.spacing.0;
    let metres: Vec<_> = line.points.iter().map(|point| [point.col * spacing, point.row * spacing, 0.0]).collect();
    let kept = line.points.iter().zip(tolerances(&metres)).filter(|&(_, below)| line_tolerance_m < below);
    let mut posts: Vec<Post> = kept.map(|(point, _)| point.nearest).collect();
    posts.dedup();
    posts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::scene::{self, metres, rms_m};

    #[test]
    fn contours_of_a_cone_are_edges_of_the_tin() {
        let height = |post: Post| {
            let (row, col) = (f64::from(post.row - 30), f64::from(post.col - 30));
            metres(200.0 - 4.0 * (row * row + col * col).sqrt())
        };
        let dem = scene::dem(61, 61, height);
        let tin = contour_tin(&scene::ground(&dem), Contours::Interval(20.0), None).unwrap();
        assert_eq!(tin.check(), Ok(()));
        // Every edge of a ring near 150 m joins posts near that height.
        let near = |v: u32| (tin.vertices[v as usize].height - metres(160.0)).abs() < metres(4.0);
        let along =
            tin.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).filter(|&(a, b)| near(a) && near(b));
        assert!(16 <= along.count());
    }

    #[test]
    fn a_flat_top_has_a_point_in_the_middle() {
        let height = |post: Post| {
            let off = (post.row - 20).abs().max((post.col - 20).abs());
            metres(f64::from(50 - 4 * (off - 8).max(0)) - if off == 0 { 0.5 } else { 0.0 })
        };
        let dem = scene::dem(41, 41, height);
        let tin = contour_tin(&scene::ground(&dem), Contours::Interval(10.0), None).unwrap();
        let top = tin.vertices.iter().filter(|vertex| {
            let post = vertex.at.post().unwrap();
            (post.row - 20).abs() < 7 && (post.col - 20).abs() < 7
        });
        assert!(0 < top.count());
    }

    #[test]
    fn a_number_of_points_is_never_exceeded_and_nearly_met() {
        let dem = scene::rough(120, 140);
        let ground = scene::ground(&dem);
        for points in [50, 300, 1500] {
            let tin = contour_tin(&ground, Contours::Points(points), None).unwrap();
            assert_eq!(tin.check(), Ok(()));
            assert!(tin.vertices.len() <= points, "{}", tin.vertices.len());
            assert!(points < 2 * tin.vertices.len(), "{} of {points}", tin.vertices.len());
        }
        let rms = |points| rms_m(&dem, &contour_tin(&ground, Contours::Points(points), None).unwrap());
        assert!(rms(1500) < rms(50));
    }

    #[test]
    fn impossible_numbers_are_refused() {
        let dem = scene::rough(20, 20);
        let ground = scene::ground(&dem);
        assert!(contour_tin(&ground, Contours::Interval(0.0), None).is_err());
        assert!(contour_tin(&ground, Contours::Interval(f64::NAN), None).is_err());
        assert!(contour_tin(&ground, Contours::Points(3), None).is_err());
        assert!(contour_tin(&ground, Contours::Points(30), Some(-1.0)).is_err());
        let flat = scene::dem(20, 20, |_| 5);
        assert_eq!(contour_tin(&scene::ground(&flat), Contours::Points(30), None).unwrap().vertices.len(), 4);
    }
}
