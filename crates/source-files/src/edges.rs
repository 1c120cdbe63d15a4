//! Steps between rasters: where one ends over the next, how far apart their heights lie there.

use std::collections::BTreeMap;

use terrain::geometry::resample::TAP_UNITS;
use terrain::{GridFrame, Post, PostRect};

use crate::crs::Crs;
use crate::mosaic::{Corner, window_reaching};
use crate::{Raster, RasterFrame, Windows};

/// Rasters whose edges are looked at, at most.
const RASTERS_MAX: usize = 128;
/// Posts along one edge of a raster that are looked at, at most: of one that is held, and of one read by window.
const POSTS_MAX: [i32; 2] = [1000, 200];
/// Posts of a raster within which another is beside it.
const BESIDE_POSTS: f64 = 3.0;

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

/// Rasters in order of priority, as far as edges are looked at.
trait Stack {
    /// Each one's grid, and the part of it that reaches the area.
    fn extents(&self) -> Vec<(&RasterFrame, PostRect)>;
    /// The height in metres at a place in units of a raster's system, above the datum that is wanted; `None` beside
    /// its part, and where a post around is void.
    fn height_m(&self, raster: usize, place: [f64; 2]) -> Option<f64>;
    /// Posts along one edge that are looked at, at most.
    fn posts_max(&self) -> i32;
}

impl Stack for [Raster] {
    fn extents(&self) -> Vec<(&RasterFrame, PostRect)> {
        self.iter().map(|raster| (&raster.frame, raster.window)).collect()
    }

    fn height_m(&self, raster: usize, place: [f64; 2]) -> Option<f64> {
        height_m(&self[raster], place)
    }

    fn posts_max(&self) -> i32 {
        POSTS_MAX[0]
    }
}

/// Rasters that are read by window: their places in the list, and the part of each that reaches the area.
struct ByWindow<'a> {
    windows: &'a Windows,
    parts: Vec<(usize, PostRect)>,
}

impl Stack for ByWindow<'_> {
    fn extents(&self) -> Vec<(&RasterFrame, PostRect)> {
        self.parts.iter().map(|&(file, part)| (self.windows.files()[file].frame(), part)).collect()
    }

    fn height_m(&self, raster: usize, place: [f64; 2]) -> Option<f64> {
        let (file, part) = self.parts[raster];
        let frame = self.windows.files()[file].frame();
        let posts = Corner::around(units_of(frame, place), frame, part)?.posts();
        let [south, north] = [posts.south, posts.north].map(|row| row + part.south);
        let [west, east] = [posts.west, posts.east].map(|col| col + part.west);
        // What cannot be read is told where it is needed.
        height_m(&self.windows.read(file, PostRect { south, west, north, east }).ok()?, place)
    }

    fn posts_max(&self) -> i32 {
        POSTS_MAX[1]
    }
}

/// The steps between rasters in order of priority that lie in the area `rect`: at every edge of one under which the
/// next has heights, too, or beyond which it goes on. Where rasters are `feathered`, a step is spread over what both
/// have, and only those that have next to nothing in common make one. Of very many rasters some are looked at.
pub fn edge_steps(rasters: &[Raster], area: (&Crs, &GridFrame, PostRect), feathered: bool) -> Vec<EdgeStep> {
    steps_of(rasters, area, feathered)
}

/// The same of files that are read by window, of which those at the places `used` are in order of priority.
pub fn edge_steps_by_window(
    windows: &Windows,
    used: impl Iterator<Item = usize>,
    area: (&Crs, &GridFrame, PostRect),
    feathered: bool,
) -> Vec<EdgeStep> {
    let part = |file: usize| {
        let frame = windows.files()[file].frame();
        (file, window_reaching(frame, area.0, area.1, area.2).unwrap_or(frame.rect()))
    };
    steps_of(&ByWindow { windows, parts: used.map(part).collect() }, area, feathered)
}

fn steps_of<S: Stack + ?Sized>(
    rasters: &S,
    (area, grid, rect): (&Crs, &GridFrame, PostRect),
    feathered: bool,
) -> Vec<EdgeStep> {
    let extents = rasters.extents();
    let boxes: Vec<Option<[[f64; 2]; 2]>> = extents.iter().map(|&extent| box_of(extent, area)).collect();
    let touch = |upper: usize, other: usize| match (&boxes[upper], &boxes[other]) {
        (Some([low, high]), Some([least, most])) => {
            (0..2).all(|axis| low[axis] <= most[axis] && least[axis] <= high[axis])
        }
        _ => true,
    };
    let looked_at = (0..extents.len()).step_by(extents.len().div_ceil(RASTERS_MAX).max(1));
    let ([west_m, south_m], [east_m, north_m]) = (grid.place_m(rect.south_west()), grid.place_m(rect.north_east()));
    let is_within = |at: f64, low: f64, high: f64| low <= at && at <= high;
    let mut all = BTreeMap::<[usize; 2], Sums>::new();
    for upper in looked_at {
        let (frame, part) = extents[upper];
        let beside: Vec<usize> = (0..extents.len()).filter(|&other| other != upper && touch(upper, other)).collect();
        let (before, after) = beside.split_at(beside.partition_point(|&other| other < upper));
        for (post, inward) in edge(frame, part, rasters.posts_max()) {
            let along =
                |posts: i32| place_of(frame, Post::new(post.row + posts * inward[0], post.col + posts * inward[1]));
            let height =
                |other: usize, posts: i32| rasters.height_m(other, frame.crs.to(&extents[other].0.crs, along(posts))?);
            let Some([east, north]) = frame.crs.to(area, along(0)) else { continue };
            // What comes before has the ground.
            let is_hidden = || before.iter().any(|&other| height(other, 0).is_some());
            if !(is_within(east, west_m, east_m) && is_within(north, south_m, north_m)) || is_hidden() {
                continue;
            }
            let Some(own) = height(upper, 0) else { continue };
            for &lower in after {
                let (sum, by) = match [0, 2, -1, -2].map(|posts| height(lower, posts)) {
                    [Some(_), Some(_), ..] if feathered => break,
                    [Some(below), ..] => (&mut all.entry([upper, lower]).or_default().squares, (own - below).powi(2)),
                    [None, _, Some(next), Some(beyond)] => {
                        let Some(inner) = height(upper, 1) else { break };
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

/// The south-west and north-east corners of a box in the area's system that holds a part of a raster and what is
/// beside it; `None` where its corners have no place there.
fn box_of((frame, part): (&RasterFrame, PostRect), area: &Crs) -> Option<[[f64; 2]; 2]> {
    let middle = Post::new((part.south + part.north) / 2, (part.west + part.east) / 2);
    let [rows, cols] = [[part.south, middle.row, part.north], [part.west, middle.col, part.east]];
    let places = rows.into_iter().flat_map(|row| cols.map(|col| place_of(frame, Post::new(row, col))));
    let places = places.map(|place| frame.crs.to(area, place)).collect::<Option<Vec<_>>>()?;
    let bound = |axis: usize, of: fn(f64, f64) -> f64, start: f64| places.iter().map(|at| at[axis]).fold(start, of);
    let mut all = [[0.0; 2]; 2];
    for axis in 0..2 {
        let (low, high) = (bound(axis, f64::min, f64::INFINITY), bound(axis, f64::max, f64::NEG_INFINITY));
        let posts = [part.cells_wide(), part.cells_high()][axis].max(1) as f64;
        // Sides are curved in another system, by less than a hundredth of what they are long.
        let more = (high - low) * (BESIDE_POSTS / posts + 0.01);
        (all[0][axis], all[1][axis]) = (low - more, high + more);
    }
    Some(all)
}

/// The outermost posts of a raster that are in a part of it, `posts_max` of each edge at most, each with the step of
/// row and column to the post further in.
fn edge(frame: &RasterFrame, part: PostRect, posts_max: i32) -> impl Iterator<Item = (Post, [i32; 2])> {
    let all = frame.rect();
    let along = move |low: i32, high: i32| (low..=high).step_by(((high - low) / posts_max).max(1) as usize);
    let rows = [(all.south, [1, 0]), (all.north, [-1, 0])].into_iter();
    let sides = [(all.west, [0, 1]), (all.east, [0, -1])].into_iter();
    let across =
        rows.flat_map(move |(row, inward)| along(part.west, part.east).map(move |col| (Post::new(row, col), inward)));
    let up = sides
        .flat_map(move |(col, inward)| along(part.south, part.north).map(move |row| (Post::new(row, col), inward)));
    across.chain(up).filter(move |(post, _)| part.contains(*post))
}

/// Where a post lies, in units of its raster's system.
fn place_of(frame: &RasterFrame, post: Post) -> [f64; 2] {
    [(0, post.col), (1, post.row)].map(|(axis, at)| frame.south_west[axis] + f64::from(at) * frame.spacing[axis])
}

/// A place in units of a raster's system as columns and rows from its south-west post, in fractions of a post.
fn units_of(frame: &RasterFrame, place: [f64; 2]) -> [i64; 2] {
    let place = frame.nearest(place);
    [0, 1].map(|axis| {
        ((place[axis] - frame.south_west[axis]) / frame.spacing[axis] * f64::from(TAP_UNITS)).round() as i64
    })
}

/// The height in metres at a place in units of a raster's system, above the datum that is wanted; `None` beside its
/// window, and where a post around is void.
fn height_m(raster: &Raster, place: [f64; 2]) -> Option<f64> {
    let frame = &raster.frame;
    let corner = Corner::around(units_of(frame, place), frame, raster.window)?;
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
