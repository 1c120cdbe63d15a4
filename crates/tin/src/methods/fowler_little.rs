//! Fowler and Little's method: ridges and channels first, then the worst posts.
//!
//! Fowler and Little, "Automatic extraction of irregular network digital terrain models" (SIGGRAPH 1979). Peaks, pits
//! and passes are read from the ring around a post, candidates for ridges and channels from cells of 2 x 2 posts; lines
//! are traced from the passes, simplified, and the rest is worst posts as long as there are points left.

mod surface;
mod trace;

use std::cmp::Ordering;
use std::collections::HashSet;

use terrain::{Dem, Post, QUANTA_PER_METRE, Tin, metres_of_quanta};

use crate::methods::dem_window::{DemWindow, Impossible, TOLERANCE_M, tolerance, within};
use crate::methods::growing::Growing;
use crate::methods::polyline::{Point, tolerances};

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FowlerLittle {
    /// Vertices; at most half of them are on lines.
    pub points: Option<usize>,
    /// Largest residual that is accepted, in metres; where none is given, 0 with `points` and else [`TOLERANCE_M`].
    pub tolerance_m: Option<f64>,
    /// How far lines may be from those that were traced, in metres; where none is given, as near as `points` allows,
    /// or the tolerance of residuals.
    pub line_tolerance_m: Option<f64>,
}

impl FowlerLittle {
    /// Exactly so many vertices.
    pub const fn of_points(points: usize) -> Self {
        Self { points: Some(points), tolerance_m: None, line_tolerance_m: None }
    }
}

/// Corners, lines, and the worst posts.
///
/// # Errors
/// When a number is negative, or fewer points than corners are asked for.
pub fn fowler_little(ground: &DemWindow, how: &FowlerLittle) -> Result<Tin, Impossible> {
    let rect = ground.dem.rect();
    how.points.map_or(Ok(()), |points| within(rect, points))?;
    let usual = if how.points.is_some() { 0.0 } else { TOLERANCE_M };
    let tolerance_m = tolerance(how.tolerance_m.unwrap_or(usual))?;
    let line_tolerance_m = how.line_tolerance_m.map(tolerance).transpose()?;
    let mut chains = trace::chains(ground.dem);
    // On flat ground a line is a whim of the order of posts.
    chains.retain(|chain| 0 < relief(ground.dem, chain));
    let lines = match (how.points, line_tolerance_m) {
        (_, Some(line_tolerance_m)) => above(kept_below(ground, &chains), line_tolerance_m),
        (Some(points), None) => most_significant(ground, chains, points / 2),
        (None, None) => above(kept_below(ground, &chains), tolerance_m),
    };
    if let Some(points) = how.points.filter(|&points| points < lines.len() + 4) {
        let expected = format!("at least {} points, on lines simplified to that tolerance", lines.len() + 4);
        let hint = "a larger line tolerance leaves fewer points on lines";
        return Err(Impossible::points(points, expected, hint));
    }
    let mut growing = Growing::new(ground.dem);
    growing.insert_all(lines);
    let accepted = (tolerance_m * f64::from(QUANTA_PER_METRE)) as u32;
    growing.grow(how.points.unwrap_or(usize::MAX), accepted);
    Ok(growing.tin())
}

/// Posts on lines, by row and column, and the tolerance below which each is kept.
fn kept_below(ground: &DemWindow, chains: &[Vec<Post>]) -> Vec<(Post, f64)> {
    let mut all: Vec<(Post, f64)> =
        chains.iter().flat_map(|chain| chain.iter().copied().zip(tolerances(&in_metres(ground, chain)))).collect();
    // A post on several lines is kept as long as one of them keeps it.
    all.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    all.dedup_by_key(|&mut (post, _)| post);
    all
}

fn above(posts: Vec<(Post, f64)>, tolerance_m: f64) -> Vec<Post> {
    posts.into_iter().filter(|&(_, below)| tolerance_m < below).map(|(post, _)| post).collect()
}

/// At most `most` posts: lines simplified by the smallest tolerance that leaves so few, or, where their ends alone are
/// more, the ends of the lines with the largest relief.
fn most_significant(ground: &DemWindow, mut chains: Vec<Vec<Post>>, most: usize) -> Vec<Post> {
    chains.sort_by(|a, b| relief(ground.dem, b).cmp(&relief(ground.dem, a)).then(a.cmp(b)));
    let mut ends = HashSet::new();
    let too_many = |chain: &Vec<Post>| {
        ends.extend([chain.first(), chain.last()].into_iter().flatten().copied());
        most < ends.len()
    };
    let fitting = chains.iter().position(too_many).unwrap_or(chains.len());
    chains.truncate(fitting);
    let mut posts = kept_below(ground, &chains);
    posts.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    if let Some(&(_, dropped)) = posts.get(most) {
        // Equals go together, as they would at any tolerance.
        posts.retain(|&(_, below)| below.total_cmp(&dropped) == Ordering::Greater);
    }
    let mut posts: Vec<Post> = posts.into_iter().map(|(post, _)| post).collect();
    posts.sort_unstable();
    posts
}

fn relief(dem: &Dem, chain: &[Post]) -> i32 {
    let heights = || chain.iter().map(|&post| dem.height(post));
    heights().max().unwrap_or(0) - heights().min().unwrap_or(0)
}

fn in_metres(ground: &DemWindow, chain: &[Post]) -> Vec<Point> {
    let spacing = ground.spacing.0;
    let point = |&post: &Post| {
        [f64::from(post.col) * spacing, f64::from(post.row) * spacing, metres_of_quanta(ground.dem.height(post))]
    };
    chain.iter().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::scene::{self, metres, rms_m};

    fn made(dem: &Dem, points: usize) -> Tin {
        let tin = fowler_little(&scene::ground(dem), &FowlerLittle::of_points(points)).unwrap();
        assert_eq!((tin.check(), tin.vertices.len()), (Ok(()), points));
        tin
    }

    #[test]
    fn the_number_of_points_is_met_exactly_with_at_most_half_of_them_on_lines() {
        let dem = scene::rough(120, 140);
        for points in [20, 200, 2000] {
            made(&dem, points);
        }
        let chains = trace::chains(&dem);
        for most in [10, 100, 1000] {
            let lines = most_significant(&scene::ground(&dem), chains.clone(), most);
            assert!(lines.len() <= most && most / 2 < lines.len(), "{} of {most}", lines.len());
        }
    }

    #[test]
    fn more_points_bring_it_nearer_to_the_ground() {
        let dem = scene::rough(120, 140);
        let rms = [50, 200, 800].map(|points| rms_m(&dem, &made(&dem, points)));
        assert!(rms[1] < rms[0] && rms[2] < rms[1], "{rms:?}");
    }

    #[test]
    fn a_tolerance_alone_is_an_end_too() {
        let dem = scene::rough(60, 60);
        let how = FowlerLittle { points: None, tolerance_m: Some(2.0), line_tolerance_m: None };
        let tin = fowler_little(&scene::ground(&dem), &how).unwrap();
        let mut growing = Growing::new(&dem);
        growing.insert_all(tin.vertices.iter().map(|vertex| vertex.at.post().unwrap()));
        assert_eq!(growing.failing(256), []);
        let refused = fowler_little(&scene::ground(&dem), &FowlerLittle { tolerance_m: Some(-2.0), ..how });
        assert_eq!(refused.unwrap_err().found, "a tolerance of -2 m");
    }

    #[test]
    fn a_line_tolerance_that_keeps_too_many_posts_is_refused() {
        let dem = scene::rough(60, 60);
        let how = FowlerLittle { line_tolerance_m: Some(0.0), ..FowlerLittle::of_points(10) };
        assert!(fowler_little(&scene::ground(&dem), &how).unwrap_err().expected.starts_with("at least "));
    }

    #[test]
    fn flat_ground_keeps_its_corners() {
        let dem = scene::dem(20, 20, |_| metres(7.0));
        let tin = fowler_little(&scene::ground(&dem), &FowlerLittle::of_points(100)).unwrap();
        assert_eq!(tin.vertices.len(), 4);
    }
}
