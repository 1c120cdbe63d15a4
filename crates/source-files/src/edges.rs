//! Steps between rasters: where one ends over the next, how far apart their heights lie there.

use std::collections::BTreeMap;

use terrain::geometry::resample::TAP_UNITS;
use terrain::{GridFrame, Post, PostRect};

use crate::Raster;
use crate::crs::Crs;
use crate::mosaic::Corner;

/// Posts along one edge of a raster that are looked at, at most.
const POSTS_MAX: i32 = 1000;

/// The step from one raster to another along the edge of the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeStep {
    /// The raster that ends, by its place in the order of priority.
    pub upper: usize,
    /// The one that goes on.
    pub lower: usize,
    /// Posts at the edge that tell of it.
    pub posts: u32,
    /// How high it is, as RMS in metres.
    pub rms_m: f64,
    /// How much the ground beside it bends from post to post, as RMS in metres: no step there is less than noise.
    pub beside_m: f64,
}

/// Sums of one step.
#[derive(Default)]
struct Sums {
    posts: u32,
    squares: f64,
    beside: f64,
}

/// The steps between rasters in order of priority that lie in the area `rect`: at every edge of one under which the
/// next has heights, too, or beyond which it goes on. Where rasters are `feathered`, a step is spread over what both
/// have, and only those that have next to nothing in common make one.
pub fn edge_steps(
    rasters: &[Raster],
    (area, grid, rect): (&Crs, &GridFrame, PostRect),
    feathered: bool,
) -> Vec<EdgeStep> {
    let ([west_m, south_m], [east_m, north_m]) = (grid.place_m(rect.south_west()), grid.place_m(rect.north_east()));
    let is_within = |at: f64, low: f64, high: f64| low <= at && at <= high;
    let mut sums = BTreeMap::<[usize; 2], Sums>::new();
    for (upper, raster) in rasters.iter().enumerate() {
        for (post, inward) in edge(raster) {
            let along =
                |posts: i32| place_of(raster, Post::new(post.row + posts * inward[0], post.col + posts * inward[1]));
            let height =
                |other: &Raster, posts: i32| height_m(other, raster.frame.crs.to(&other.frame.crs, along(posts))?);
            let Some([east, north]) = raster.frame.crs.to(area, along(0)) else { continue };
            // What comes before has the ground.
            let is_hidden = || rasters[..upper].iter().any(|other| height(other, 0).is_some());
            if !(is_within(east, west_m, east_m) && is_within(north, south_m, north_m)) || is_hidden() {
                continue;
            }
            let Some(own) = height(raster, 0) else { continue };
            let bend = |[a, b, c, d]: [f64; 4]| (c - b) - ((b - a) + (d - c)) / 2.0;
            let inner = [3, 2, 1, 0].map(|posts| height(raster, posts));
            let found = (upper + 1..rasters.len()).find_map(|lower| {
                let other = |posts: i32| height(&rasters[lower], posts);
                let step = match other(0) {
                    Some(below) if feathered && other(2).is_some() => return Some((lower, own - below, true)),
                    Some(below) => own - below,
                    None => bend([inner[2]?, own, other(-1)?, other(-2)?]),
                };
                Some((lower, step, false))
            });
            let (Some((lower, step, false)), [Some(a), Some(b), Some(c), Some(d)]) = (found, inner) else { continue };
            let sums = sums.entry([upper, lower]).or_default();
            sums.posts += 1;
            sums.squares += step.powi(2);
            sums.beside += bend([a, b, c, d]).powi(2);
        }
    }
    let step = |([upper, lower], Sums { posts, squares, beside }): ([usize; 2], Sums)| {
        let [rms_m, beside_m] = [squares, beside].map(|squares| (squares / f64::from(posts)).sqrt());
        EdgeStep { upper, lower, posts, rms_m, beside_m }
    };
    sums.into_iter().map(step).collect()
}

/// The outermost posts of a raster that are in its window, some of them where there are many, each with the step of row
/// and column to the post further in.
fn edge(raster: &Raster) -> impl Iterator<Item = (Post, [i32; 2])> {
    let (all, window) = (raster.frame.rect(), raster.window);
    let along = |low: i32, high: i32| (low..=high).step_by(((high - low) / POSTS_MAX).max(1) as usize);
    let rows = [(all.south, [1, 0]), (all.north, [-1, 0])].into_iter();
    let sides = [(all.west, [0, 1]), (all.east, [0, -1])].into_iter();
    let across = rows
        .flat_map(move |(row, inward)| along(window.west, window.east).map(move |col| (Post::new(row, col), inward)));
    let up = sides
        .flat_map(move |(col, inward)| along(window.south, window.north).map(move |row| (Post::new(row, col), inward)));
    across.chain(up).filter(move |(post, _)| window.contains(*post))
}

/// Where a post lies, in units of its raster's system.
fn place_of(raster: &Raster, post: Post) -> [f64; 2] {
    let frame = &raster.frame;
    [(0, post.col), (1, post.row)].map(|(axis, at)| frame.south_west[axis] + f64::from(at) * frame.spacing[axis])
}

/// The height in metres at a place in units of a raster's system, above the datum that is wanted; `None` beside its
/// window, and where a post around is void.
fn height_m(raster: &Raster, place: [f64; 2]) -> Option<f64> {
    let frame = &raster.frame;
    let units = [0, 1].map(|axis| {
        ((place[axis] - frame.south_west[axis]) / frame.spacing[axis] * f64::from(TAP_UNITS)).round() as i64
    });
    let corner = Corner::around(units, frame, raster.window)?;
    let wide = raster.window.posts_wide();
    if corner.posts().posts().any(|post| raster.voids.contains(post.row as usize * wide + post.col as usize)) {
        return None;
    }
    let height_m = raster.scale.height_m(corner.bilinear(raster));
    let added = match &raster.shift {
        Some(shift) => frame.crs.to(&Crs::wgs84(), place).and_then(|place| shift.metres(place))?,
        None => 0.0,
    };
    Some(height_m + added)
}
