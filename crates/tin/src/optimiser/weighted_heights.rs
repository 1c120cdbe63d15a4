//! The ground of one tile as the optimiser sees it: moments for sums, posts for the worst residual.

use std::ops::Range;

use fearless_simd::{Level, dispatch};
use terrain::geometry::{BEYOND_LEAST, height_bounds_in, widest_level};
use terrain::{Dem, HeightFit, Importance, Post, SeamSides, THOUSANDTHS};

use crate::optimiser::hold::Hold;
use crate::optimiser::moments::{Moments, Walk};
use crate::optimiser::place::{PER_POST, Place};

/// Heights, weights and their moments.
pub(crate) struct WeightedHeights<'a> {
    pub moments: Moments,
    dem: &'a Dem,
    importance: &'a Importance,
    weight: Option<f64>,
    squares_are_plain: bool,
    /// Sides on which posts may be chosen.
    open: SeamSides,
    fit: HeightFit,
    far: Place,
    level: Level,
    /// Posts that no vertex may come nearest to, in ascending order.
    forbidden: Vec<Post>,
    /// Quanta between steps of places, infinite where that is not known.
    pub quanta_per_step: f64,
}

impl<'a> WeightedHeights<'a> {
    /// Posts weigh one thing where they are chosen and another in squares.
    pub fn new(
        dem: &'a Dem,
        (importance, in_squares): (&'a Importance, &Importance),
        open: SeamSides,
        fit: HeightFit,
    ) -> Self {
        let rect = dem.rect();
        let far = Place::new(rect.cells_wide() as i32 * PER_POST, rect.cells_high() as i32 * PER_POST);
        let weight = importance.uniform_weight().map(|weight| f64::from(weight) / f64::from(THOUSANDTHS));
        // One weight for all is a weight of one.
        let squares_are_plain = in_squares.uniform_weight().is_some_and(|weight| 0 < weight);
        Self {
            moments: Moments::new(dem, in_squares),
            squares_are_plain,
            dem,
            importance,
            weight,
            open,
            fit,
            far,
            level: widest_level(),
            forbidden: Vec::new(),
            quanta_per_step: f64::INFINITY,
        }
    }

    /// Quanta of height that count as zero.
    pub fn level(&self) -> f64 {
        self.moments.level()
    }

    /// The tile's north-east corner.
    pub fn far(&self) -> Place {
        self.far
    }

    /// Whether a place lies on a side on which nothing may be chosen.
    pub fn is_on_closed_side(&self, at: Place) -> bool {
        (at.y == 0 && !self.open.south)
            || (at.x == 0 && !self.open.west)
            || (at.y == self.far.y && !self.open.north)
            || (at.x == self.far.x && !self.open.east)
    }

    /// Forbids vertices to come to stand at these posts, in ascending order.
    pub fn forbid(&mut self, posts: Vec<Post>) {
        self.forbidden = posts;
    }

    /// Whether the post nearest to a place is forbidden.
    #[inline(always)]
    pub fn is_forbidden(&self, at: Place) -> bool {
        let nearest = |v: i32| (v + PER_POST / 2).div_euclid(PER_POST);
        !self.forbidden.is_empty() && self.forbidden.binary_search(&self.post(nearest(at.y), nearest(at.x))).is_ok()
    }

    /// What the post nearest to a place counts in squares.
    pub fn weight_in_squares(&self, at: Place) -> f64 {
        let nearest = |at: i32| (at + PER_POST / 2) / PER_POST;
        self.moments.weight_at(nearest(at.y), nearest(at.x))
    }

    /// Whether the post nearest to a place has a weight.
    pub fn counts(&self, at: Place) -> bool {
        let nearest = |v: i32| (v + PER_POST / 2).div_euclid(PER_POST);
        0 < self.importance.weight(self.post(nearest(at.y), nearest(at.x)))
    }

    /// Posts of the tile.
    pub fn post_count(&self) -> usize {
        self.dem.rect().post_count()
    }

    fn post(&self, row: i32, col: i32) -> Post {
        let origin = self.dem.rect().south_west();
        Post::new(origin.row + row, origin.col + col)
    }

    #[inline(always)]
    fn row(&self, row: i32) -> &[i32] {
        self.dem.row(self.dem.rect().south + row)
    }

    /// The DEM's height between posts, in quanta above the level.
    pub fn height(&self, at: Place) -> f64 {
        let clamp = |at: i32, far: i32| (at / PER_POST).min(far / PER_POST - 1);
        let (row, col) = (clamp(at.y, self.far.y), clamp(at.x, self.far.x));
        let (x, y) = Place::new(at.x - col * PER_POST, at.y - row * PER_POST).posts();
        let height = |row: i32, col: i32| f64::from(self.row(row)[col as usize]);
        let south = height(row, col) * (1.0 - x) + height(row, col + 1) * x;
        let north = height(row + 1, col) * (1.0 - x) + height(row + 1, col + 1) * x;
        south * (1.0 - y) + north * y - self.level()
    }

    /// The height nearest to another that a vertex may have at a place, in quanta above the level.
    #[inline(always)]
    pub fn bounded(&self, at: Place, height: f64) -> f64 {
        let clamp = |at: i32, far: i32| (at as u32 / PER_POST as u32).min(far as u32 / PER_POST as u32 - 1) as usize;
        let (row, col) = (clamp(at.y, self.far.y), clamp(at.x, self.far.x));
        let (heights, stride) = self.dem.padded();
        let cell = &heights[row * stride + col..][..stride + 2];
        let (a, b, c, d) = (cell[0], cell[1], cell[stride], cell[stride + 1]);
        let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        let absolute = height + self.level();
        // Within a metre of the cell it stands in, it is within that of all posts around it.
        if f64::from(low - BEYOND_LEAST) <= absolute && absolute <= f64::from(high + BEYOND_LEAST) {
            return height;
        }
        self.bounded_by_all(at, height)
    }

    #[inline(never)]
    fn bounded_by_all(&self, at: Place, height: f64) -> f64 {
        let origin = self.dem.rect().south_west();
        let steps = |post: i32, at: i32| i64::from(post) * i64::from(PER_POST) + i64::from(at);
        let place = (steps(origin.row, at.y), steps(origin.col, at.x));
        let (low, high) = dispatch!(self.level, simd => height_bounds_in(simd, self.dem, place, i64::from(PER_POST)));
        height.clamp(f64::from(low) - self.level(), f64::from(high) - self.level())
    }

    /// The DEM's slope between posts, in quanta per post to the east and to the north.
    pub fn slope(&self, at: Place) -> [f64; 2] {
        const HALF: i32 = PER_POST / 2;
        let clamp = |at: Place| Place::new(at.x.clamp(0, self.far.x), at.y.clamp(0, self.far.y));
        let rise = |dx: i32, dy: i32| {
            let (low, high) = (clamp(Place::new(at.x - dx, at.y - dy)), clamp(Place::new(at.x + dx, at.y + dy)));
            let run = Place::new(high.x - low.x, high.y - low.y).posts();
            (self.height(high) - self.height(low)) / (run.0 + run.1)
        };
        [rise(HALF, 0), rise(0, HALF)]
    }

    /// The post of largest weighted residual under a triangle, and that residual in quanta: candidates only, and none
    /// where a corner stands or that is not `allowed`.
    #[inline(always)]
    pub fn worst(
        &self,
        corners: [Place; 3],
        heights: [f64; 3],
        allowed: impl Fn(Place) -> bool,
    ) -> Option<(f64, Place)> {
        let [a, b, c] = corners;
        let Plane { x: x0, y: y0, gx, gy } = Plane::new(corners, heights);
        let mut worst = (0.0, Place::default());
        rows(self.far, corners, |row, cols| {
            if (row == 0 && !self.open.south) || (row == self.far.y / PER_POST && !self.open.north) {
                return;
            }
            let first = cols.start.max(i32::from(!self.open.west));
            let end = cols.end.min(self.far.x / PER_POST + i32::from(self.open.east));
            if end <= first {
                return;
            }
            let weights = self.importance.weights_of_row(self.dem.rect().south + row);
            let line = &self.row(row)[first as usize..end as usize];
            let y = f64::from(row) - y0;
            let base = heights[0] + self.level() + gy * y;
            for (col, &height) in (first..end).zip(line) {
                let weight = match (self.weight, weights) {
                    (Some(weight), _) => weight,
                    (None, Some(weights)) => f64::from(weights[col as usize]) / f64::from(THOUSANDTHS),
                    (None, None) => 1.0,
                };
                let residual = weight * (f64::from(height) - (base + gx * (f64::from(col) - x0))).abs();
                let at = Place::new(col * PER_POST, row * PER_POST);
                if worst.0 < residual && at != a && at != b && at != c && allowed(at) {
                    worst = (residual, at);
                }
            }
        });
        (0.0 < worst.0).then_some(worst)
    }

    /// Sum of squared residuals, not weighted, over the posts that a triangle owns.
    pub fn plain_squares(&self, corners: [Place; 3], heights: [f64; 3]) -> f64 {
        let plane = Plane::new(corners, heights);
        let mut sum = 0.0;
        rows(self.far, corners, |row, cols| {
            let base = heights[0] + self.level() + plane.gy * (f64::from(row) - plane.y);
            for col in cols {
                let residual = f64::from(self.row(row)[col as usize]) - base - plane.gx * (f64::from(col) - plane.x);
                sum += residual * residual;
            }
        });
        sum
    }

    /// Whether squares are what they would be if all posts weighed one.
    pub fn squares_are_plain(&self) -> bool {
        self.squares_are_plain
    }

    /// Absolute residual in quanta, not weighted, at the post of a triangle that lies at a place.
    pub fn residual(&self, corners: [Place; 3], heights: [f64; 3], at: Place) -> f64 {
        let plane = Plane::new(corners, heights);
        let (x, y) = at.posts();
        (self.height(at) - heights[0] - plane.gx * (x - plane.x) - plane.gy * (y - plane.y)).abs().round()
    }

    /// The post at a place that is one.
    pub fn post_at(&self, at: Place) -> Post {
        self.post(at.y / PER_POST, at.x / PER_POST)
    }

    /// Whether vertices keep to the DEM's height wherever they move.
    pub fn height_hold(&self) -> Hold {
        match self.fit {
            HeightFit::Squares => Hold::FREE,
            HeightFit::Off => Hold::ON_GROUND,
        }
    }
}

#[cfg(test)]
impl WeightedHeights<'_> {
    /// Visits the posts that a triangle owns.
    pub fn visit_owned(&self, corners: [Place; 3], mut visit: impl FnMut(i32, i32)) {
        rows(self.far, corners, |row, cols| cols.for_each(|col| visit(row, col)));
    }

    /// Height of a triangle's plane in quanta.
    pub fn plane_height(&self, corners: [Place; 3], heights: [f64; 3], at: Place) -> f64 {
        let plane = Plane::new(corners, heights);
        let (x, y) = at.posts();
        heights[0] + self.level() + plane.gx * (x - plane.x) + plane.gy * (y - plane.y)
    }
}

/// The plane of a triangle about its first corner.
struct Plane {
    x: f64,
    y: f64,
    gx: f64,
    gy: f64,
}

impl Plane {
    #[inline(always)]
    fn new([a, b, c]: [Place; 3], heights: [f64; 3]) -> Self {
        let (x, y) = a.posts();
        let (bx, by) = Place::new(b.x - a.x, b.y - a.y).posts();
        let (cx, cy) = Place::new(c.x - a.x, c.y - a.y).posts();
        let (hb, hc) = (heights[1] - heights[0], heights[2] - heights[0]);
        let per_area = 1.0 / (bx * cy - by * cx);
        Self { x, y, gx: (hb * cy - hc * by) * per_area, gy: (hc * bx - hb * cx) * per_area }
    }
}

/// Visits the rows of posts that a counter-clockwise triangle owns, and the range of columns in each. `far` is the
/// tile's north-east corner, whose row and column belong to the triangles there.
#[inline(always)]
fn rows(far: Place, corners: [Place; 3], mut visit: impl FnMut(i32, Range<i32>)) {
    let [mut low, mut middle, mut high] = corners;
    if middle < low {
        std::mem::swap(&mut low, &mut middle);
    }
    if high < low {
        std::mem::swap(&mut low, &mut high);
    }
    if high < middle {
        std::mem::swap(&mut middle, &mut high);
    }
    let (first, turn, end) = (low.row_from(), middle.row_from(), high.row_from());
    let middle_is_east = 0 < Place::orient(low, middle, high);
    let last = |a: Place, b: Place| i32::from(a.x == far.x && b.x == far.x);
    let mut long = (first < end).then(|| Walk::new(low, high, first));
    for (from, to, rows) in [(low, middle, first..turn), (middle, high, turn..end)] {
        let Some(long) = long.as_mut().filter(|_| !rows.is_empty()) else { continue };
        let mut short = Walk::new(from, to, rows.start);
        let beyond = if middle_is_east { last(from, to) } else { last(low, high) };
        for row in rows {
            let (a, b) = (long.next_column() as i32, short.next_column() as i32);
            let (west, east) = if middle_is_east { (a, b) } else { (b, a) };
            visit(row, west..east + beyond);
        }
    }
    if middle.y == far.y && high.y == far.y {
        let column = |at: Place| (at.x + PER_POST - 1) / PER_POST;
        visit(end, column(middle)..column(high) + last(high, high));
    }
}
