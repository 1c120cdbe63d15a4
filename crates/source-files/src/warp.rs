//! Where the posts of the working grid lie in a raster, whatever its coordinate system.
//!
//! In another system only every sixteenth post is projected, and what lies between is interpolated in whole numbers:
//! that is off by a few millimetres at most, and it keeps the last digits of sines and logarithms, which differ from
//! machine to machine, nearly always out of the result. Projected places hang on the grid and not on the window asked
//! for, so two tiles see the same ground at the seam between them.

use terrain::geometry::resample::TAP_UNITS;
use terrain::{GridFrame, PostRect};

use crate::RasterFrame;
use crate::crs::Crs;
use crate::resample::{col_of, row_of};

/// Grid posts between projected places, and the most metres between them.
const STEP_POSTS: i32 = 16;
const STEP_M: f64 = 400.0;
/// Projected places are rounded to this many units: 1/4096 of a source post.
const ROUNDED_UNITS: f64 = 16.0;
/// Places farther out than this many units are as good as nowhere.
const UNITS_MAX: f64 = 1.0e15;

/// Column and row of a place in a raster, counted in 1/65536 of a source post; `None` where it has none.
pub(crate) type Place = Option<[i64; 2]>;

/// Where the posts of a grid lie in one raster.
#[derive(Clone, Debug)]
pub(crate) struct Warp {
    frame: RasterFrame,
    grid: GridFrame,
    /// The grid's system, where it is not the raster's.
    other: Option<Crs>,
    step: i32,
}

impl Warp {
    pub(crate) fn new(frame: &RasterFrame, area: &Crs, grid: &GridFrame) -> Self {
        let mut step = STEP_POSTS;
        while 1 < step && STEP_M < f64::from(step) * grid.spacing.metres() {
            step /= 2;
        }
        let other = (frame.crs != *area).then(|| area.clone());
        Self { frame: frame.clone(), grid: *grid, other, step }
    }

    /// The place of one post, projected.
    fn projected(&self, row: i32, col: i32) -> Place {
        let area = self.other.as_ref()?;
        let [mut east, north] = area.to(&self.frame.crs, [self.grid.east_m(col), self.grid.north_m(row)])?;
        let [west, south] = self.frame.south_west;
        if self.frame.crs.is_geographic() {
            // Longitudes come around: the one nearest to the raster's middle is meant.
            let middle = west + self.frame.spacing[0] * f64::from(self.frame.cols) / 2.0;
            east -= 360.0 * ((east - middle) / 360.0).round();
        }
        let units = |place: f64, first: f64, spacing: f64| {
            let units = (place - first) / spacing * f64::from(TAP_UNITS);
            (units.abs() < UNITS_MAX).then(|| (units / ROUNDED_UNITS).round() as i64 * ROUNDED_UNITS as i64)
        };
        Some([units(east, west, self.frame.spacing[0])?, units(north, south, self.frame.spacing[1])?])
    }

    /// The places of all posts of a rectangle.
    pub(crate) fn over(&self, rect: PostRect) -> Places<'_> {
        if self.other.is_none() {
            let units = |posts: f64| {
                let units = posts * f64::from(TAP_UNITS);
                (units.abs() < UNITS_MAX).then(|| (units + 0.5).floor() as i64)
            };
            let cols = (rect.west..=rect.east).map(|col| units(col_of(&self.frame, &self.grid, col))).collect();
            let rows = (rect.south..=rect.north).map(|row| units(row_of(&self.frame, &self.grid, row))).collect();
            return Places { rect, kind: Kind::Aligned { cols, rows } };
        }
        let near = |post: i32| post.div_euclid(self.step);
        let far = |post: i32| -(-post).div_euclid(self.step);
        let net =
            PostRect { south: near(rect.south), west: near(rect.west), north: far(rect.north), east: far(rect.east) };
        let posts = (net.south..=net.north).flat_map(|row| (net.west..=net.east).map(move |col| (row, col)));
        let places = posts.map(|(row, col)| self.projected(row * self.step, col * self.step)).collect();
        Places { rect, kind: Kind::Net { warp: self, net, places } }
    }

    /// The posts of the raster under a rectangle of the grid, with `margin` posts around them; `None` when the raster
    /// reaches nowhere into it.
    pub(crate) fn window(&self, rect: PostRect, margin: i64) -> Option<PostRect> {
        // The image of a rectangle lies inside the image of its border.
        let line = |south, west, north, east| PostRect { south, west, north, east };
        let border = [
            line(rect.south, rect.west, rect.south, rect.east),
            line(rect.north, rect.west, rect.north, rect.east),
            line(rect.south, rect.west, rect.north, rect.west),
            line(rect.south, rect.east, rect.north, rect.east),
        ];
        let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
        for line in border {
            let places = self.over(line);
            for row in line.south..=line.north {
                for [col, row] in (line.west..=line.east).filter_map(|col| places.at(row, col)) {
                    low = [low[0].min(col), low[1].min(row)];
                    high = [high[0].max(col), high[1].max(row)];
                }
            }
        }
        let range = |axis: usize, count: u32| {
            let unit = i64::from(TAP_UNITS);
            let first = (low[axis].checked_div_euclid(unit)? - margin).max(0);
            let last = (high[axis].div_euclid(unit) + 1 + margin).min(i64::from(count) - 1);
            (low[axis] <= high[axis] && first <= last).then_some((first as i32, last as i32))
        };
        let ((west, east), (south, north)) = (range(0, self.frame.cols)?, range(1, self.frame.rows)?);
        Some(PostRect { south, west, north, east })
    }

    /// Source posts in a metre of ground at the middle of a rectangle, across and along.
    pub(crate) fn posts_per_metre(&self, rect: PostRect) -> [f64; 2] {
        let (row, col) = ((rect.south + rect.north) / 2, (rect.west + rect.east) / 2);
        let spacing_m = self.grid.spacing.metres();
        if self.other.is_none() {
            return self.frame.spacing.map(|spacing| 1.0 / spacing);
        }
        let [Some(a), Some(b), Some(c)] =
            [(row, col), (row, col + self.step), (row + self.step, col)].map(|(row, col)| self.projected(row, col))
        else {
            return [1.0 / spacing_m; 2];
        };
        let posts = |from: [i64; 2], to: [i64; 2], axis: usize| (to[axis] - from[axis]).abs() as f64;
        let per_metre = 1.0 / (f64::from(TAP_UNITS) * spacing_m * f64::from(self.step));
        [posts(a, b, 0).max(posts(a, c, 0)) * per_metre, posts(a, b, 1).max(posts(a, c, 1)) * per_metre]
    }
}

/// The places of the posts of a rectangle in a raster.
pub(crate) struct Places<'a> {
    rect: PostRect,
    kind: Kind<'a>,
}

enum Kind<'a> {
    /// Rows run along rows: each axis by itself.
    Aligned { cols: Vec<Option<i64>>, rows: Vec<Option<i64>> },
    /// Between projected places, which lie `step` posts apart; `net` counts steps.
    Net { warp: &'a Warp, net: PostRect, places: Vec<Place> },
}

impl Places<'_> {
    /// The place of one post of the rectangle.
    pub(crate) fn at(&self, row: i32, col: i32) -> Place {
        match &self.kind {
            Kind::Aligned { cols, rows } => {
                Some([cols[(col - self.rect.west) as usize]?, rows[(row - self.rect.south) as usize]?])
            }
            Kind::Net { warp, net, places } => {
                let step = warp.step;
                let (south, west) = (row.div_euclid(step), col.div_euclid(step));
                let (up, right) = (i64::from(row.rem_euclid(step)), i64::from(col.rem_euclid(step)));
                let place = |row: i32, col: i32| {
                    places[(row - net.south) as usize * net.posts_wide() + (col - net.west) as usize]
                };
                // A post on a projected line needs none beyond it.
                let (north, east) = (south + i32::from(0 < up), west + i32::from(0 < right));
                let corners = [place(south, west)?, place(south, east)?, place(north, west)?, place(north, east)?];
                let n = i64::from(step);
                Some([0, 1].map(|axis| {
                    let [a, b, c, d] = corners.map(|corner| corner[axis]);
                    let sum = (a * (n - right) + b * right) * (n - up) + (c * (n - right) + d * right) * up;
                    // The step is a power of two, so this is the division by its square, rounded down.
                    (sum + n * n / 2) >> (2 * step.trailing_zeros())
                }))
            }
        }
    }
}
