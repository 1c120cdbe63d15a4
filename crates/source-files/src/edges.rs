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
    /// How high it is in metres: what heights of both differ by as RMS; where they only abut, what the ground steps by
    /// on average beyond its own slope.
    pub height_m: f64,
}

/// Sums of one step: squares where both have heights, and steps where they abut, each with how many posts.
#[derive(Default)]
struct Sums {
    squares: (f64, u32),
    steps: (f64, u32),
}

impl Sums {
    /// How high the step is; few posts say nothing.
    fn height_m(&self) -> f64 {
        const POSTS_MIN: u32 = 16;
        let mean = |(sum, posts): (f64, u32)| if posts < POSTS_MIN { 0.0 } else { sum / f64::from(posts) };
        mean(self.squares).sqrt().max(mean(self.steps).abs())
    }
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
    let mut all = BTreeMap::<[usize; 2], Sums>::new();
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
            for (lower, other) in (upper + 1..).zip(&rasters[upper + 1..]) {
                let (sum, by) = match [0, 2, -1, -2].map(|posts| height(other, posts)) {
                    [Some(_), Some(_), ..] if feathered => break,
                    [Some(below), ..] => (&mut all.entry([upper, lower]).or_default().squares, (own - below).powi(2)),
                    [None, _, Some(next), Some(beyond)] => {
                        let Some(inner) = height(raster, 1) else { break };
                        let slope = ((own - inner) + (beyond - next)) / 2.0;
                        (&mut all.entry([upper, lower]).or_default().steps, next - own - slope)
                    }
                    _ => continue,
                };
                *sum = (sum.0 + by, sum.1 + 1);
                break;
            }
        }
    }
    let step = |([upper, lower], sums): ([usize; 2], Sums)| EdgeStep { upper, lower, height_m: sums.height_m() };
    all.into_iter().map(step).collect()
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
