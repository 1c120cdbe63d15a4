//! Very important points: posts ranked by how far they stand out from their neighbours.
//!
//! Chen and Guevara, "Systematic selection of very important points (VIP) from digital terrain model for constructing
//! triangular irregular networks" (AutoCarto 8, 1987). Importance is local, so a small sharp spike ranks above a smooth
//! mountain, ridges are taken post by post, and plains stay empty.

use std::cmp::Ordering;

use terrain::{Dem, Post, PostRect, Tin};

use crate::methods::dem_window::{DemWindow, Impossible, inner_posts, within};
use crate::methods::growing::delaunay_tin;

/// How far a post stands from the line between two opposite neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distance {
    /// At right angles to the line.
    Perpendicular,
    /// Straight up or down.
    Vertical,
}

/// What becomes of the posts on the window's border lines, which lack neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// All of them are points, and count.
    ForceAll,
    /// They are ranked like others, their missing neighbours as high as the nearest post.
    Extend,
    /// Only the four corners are points.
    CornersOnly,
}

impl Boundary {
    /// Points that are not chosen but forced, in a window of `rect`.
    pub fn forced(self, rect: PostRect) -> usize {
        match self {
            Boundary::ForceAll => rect.post_count() - inner_posts(rect).count(),
            Boundary::Extend | Boundary::CornersOnly => 4,
        }
    }
}

/// The TIN of exactly `points` points: those `boundary` forces, then the most important.
///
/// # Errors
/// When `boundary` forces more, or there are fewer posts to choose from.
pub fn vip(ground: &DemWindow, points: usize, distance: Distance, boundary: Boundary) -> Result<Tin, Impossible> {
    let (dem, rect) = (ground.dem, ground.dem.rect());
    within(rect, points)?;
    let forced: Vec<Post> = match boundary {
        Boundary::ForceAll => rect.posts().filter(|&post| rect.has_on_border(post)).collect(),
        Boundary::Extend | Boundary::CornersOnly => rect.corners().to_vec(),
    };
    let mut ranked: Vec<(f64, Post)> = rect
        .posts()
        .filter(|&post| boundary == Boundary::Extend || !rect.has_on_border(post))
        .filter(|post| !dem.is_void(*post) && !rect.corners().contains(post))
        .map(|post| (importance(ground, post, distance), post))
        .collect();
    let most = forced.len() + ranked.len();
    if points < forced.len() || most < points {
        let expected = format!("{} to {most} points", forced.len());
        let hint = "VIP takes every post of the border first; less is possible where only corners are forced";
        return Err(Impossible::points(points, expected, hint));
    }
    ranked.sort_unstable_by(by_importance);
    let chosen = ranked.iter().take(points - forced.len()).map(|&(_, post)| post);
    Ok(delaunay_tin(dem, forced.iter().copied().chain(chosen)))
}

fn by_importance(a: &(f64, Post), b: &(f64, Post)) -> Ordering {
    b.0.total_cmp(&a.0).then(a.1.cmp(&b.1))
}

/// How far a post stands out, summed over four directions, in quanta.
fn importance(ground: &DemWindow, post: Post, distance: Distance) -> f64 {
    let straight = ground.spacing_quanta();
    let diagonal = straight * std::f64::consts::SQRT_2;
    [((0, 1), straight), ((1, 1), diagonal), ((1, 0), straight), ((1, -1), diagonal)]
        .into_iter()
        .map(|((rows, cols), half)| {
            let a = height(ground.dem, post.row - rows, post.col - cols);
            let b = height(ground.dem, post.row + rows, post.col + cols);
            let above = (f64::from(ground.dem.height(post)) - (a + b) / 2.0).abs();
            match distance {
                Distance::Vertical => above,
                Distance::Perpendicular => above * 2.0 * half / (4.0 * half * half + (b - a) * (b - a)).sqrt(),
            }
        })
        .sum()
}

/// The height at a place, or of the post nearest to it.
fn height(dem: &Dem, row: i32, col: i32) -> f64 {
    let rect = dem.rect();
    f64::from(dem.height(Post::new(row.clamp(rect.south, rect.north), col.clamp(rect.west, rect.east))))
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::methods::scene::{self, metres};

    fn posts(tin: &Tin) -> HashSet<Post> {
        tin.vertices.iter().map(|vertex| vertex.at.post().unwrap()).collect()
    }

    fn chosen(dem: &Dem, points: usize) -> HashSet<Post> {
        let ground = scene::ground(dem);
        let tin = vip(&ground, points, Distance::Perpendicular, Boundary::CornersOnly).unwrap();
        assert_eq!(tin.check(), Ok(()));
        assert_eq!(tin.vertices.len(), points);
        posts(&tin)
    }

    #[test]
    fn a_sharp_spike_of_5_m_outranks_a_smooth_hill_of_100_m() {
        let hill = |post: Post| {
            let (row, col) = (f64::from(post.row - 30), f64::from(post.col - 30));
            100.0 * (1.0 - (row * row + col * col) / 1800.0)
        };
        let dem = scene::dem(61, 61, |post| metres(hill(post)) + if post == Post::new(6, 9) { metres(5.0) } else { 0 });
        assert!(chosen(&dem, 5).contains(&Post::new(6, 9)));
        assert!(!chosen(&dem, 12).contains(&Post::new(30, 30)), "the summit is not among the first eight");
    }

    #[test]
    fn a_straight_ridge_is_taken_post_by_post_and_the_plain_beside_it_is_empty() {
        // Two roofs from south to north with a plain between them.
        let height = |post: Post| (40 - 4 * (post.col - 12).abs()).max(40 - 4 * (post.col - 60).abs()).max(0);
        let dem = scene::dem(49, 73, |post| metres(f64::from(height(post))));
        let all = chosen(&dem, 4 + 2 * 47);
        let ridge = all.iter().filter(|post| post.col == 12 || post.col == 60).count();
        assert!(9 * 2 * 47 <= 10 * ridge, "{ridge} of {} posts of the ridges", 2 * 47);
        assert!(!all.iter().any(|post| (25..=47).contains(&post.col)));
    }

    #[test]
    fn the_forced_border_counts_and_less_is_refused() {
        let dem = scene::rough(20, 30);
        let ground = scene::ground(&dem);
        let forced = Boundary::ForceAll.forced(dem.rect());
        assert_eq!(forced, 2 * (20 + 30) - 4);
        let tin = vip(&ground, forced + 7, Distance::Vertical, Boundary::ForceAll).unwrap();
        assert_eq!((tin.vertices.len(), tin.check()), (forced + 7, Ok(())));
        let refused = vip(&ground, forced - 1, Distance::Vertical, Boundary::ForceAll).unwrap_err();
        assert_eq!(refused.to_string(), "95 points, expected 96 to 600 points");
        assert!(vip(&ground, 601, Distance::Vertical, Boundary::Extend).is_err());
        assert_eq!(vip(&ground, 600, Distance::Vertical, Boundary::Extend).unwrap().vertices.len(), 600);
    }

    #[test]
    fn the_perpendicular_distance_counts_less_on_a_slope() {
        let flat = |post: Post| f64::from((post.col - 5).abs());
        let steep = |post: Post| flat(post) + 100.0 * f64::from(post.row);
        let rank = |height: &dyn Fn(Post) -> f64, distance| {
            let dem = scene::dem(11, 11, |post| metres(height(post)));
            importance(&scene::ground(&dem), Post::new(5, 5), distance)
        };
        let equal = rank(&flat, Distance::Vertical) - rank(&steep, Distance::Vertical);
        assert_eq!(equal, 0.0);
        assert!(rank(&steep, Distance::Perpendicular) < rank(&flat, Distance::Perpendicular));
    }
}
