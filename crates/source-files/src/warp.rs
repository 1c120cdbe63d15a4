//! Where the posts of the working grid lie in a raster, whatever its coordinate system.
//!
//! In another system only every sixteenth post is projected, and what lies between is interpolated in whole numbers:
//! that is off by a few millimetres at most, and it keeps the last digits of sines and logarithms, which differ from
//! machine to machine, nearly always out of the result. Projected places hang on the system and not on the area or the
//! window asked for, so two tiles see the same ground at the seam between them, and two areas on a common border.

use std::collections::BTreeMap;
use std::ops::Range;

use terrain::geometry::resample::TAP_UNITS;
use terrain::{GridFrame, PostRect};

use crate::RasterFrame;
use crate::crs::Crs;
use crate::frame::{col_of, row_of};

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
    net: Net,
    /// Units of a turn around the Earth, where the raster is in degrees.
    turn: Option<i64>,
}

/// Every so many posts of a grid, counted from easting and northing 0, whatever post is the grid's first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Net {
    step: i32,
    /// Columns and rows from a line of the net to the first of the grid.
    past: [i32; 2],
}

impl Net {
    pub(crate) fn of(grid: &GridFrame, step: i32) -> Self {
        let past = |origin_m: f64| (origin_m / grid.spacing.metres()).floor().rem_euclid(f64::from(step)) as i32;
        Self { step, past: [past(grid.origin_east_m), past(grid.origin_north_m)] }
    }

    /// The line of the net at or before a row or column, and posts from there.
    pub(crate) fn split(self, axis: usize, post: i32) -> (i32, i32) {
        let post = post + self.past[axis];
        (post.div_euclid(self.step), post.rem_euclid(self.step))
    }

    /// The row or column on a line of the net.
    pub(crate) fn post(self, axis: usize, line: i32) -> i32 {
        line * self.step - self.past[axis]
    }
}

impl Warp {
    pub(crate) fn new(frame: &RasterFrame, area: &Crs, grid: &GridFrame) -> Self {
        let mut step = STEP_POSTS;
        while 1 < step && STEP_M < f64::from(step) * grid.spacing.metres() {
            step /= 2;
        }
        let other = (frame.crs != *area).then(|| area.clone());
        let turn = (360.0 / frame.spacing[0] * f64::from(TAP_UNITS)).round() as i64;
        let turn = frame.crs.is_geographic().then_some(turn);
        Self { frame: frame.clone(), grid: *grid, other, net: Net::of(grid, step), turn }
    }

    /// The place of one post, projected.
    fn projected(&self, row: i32, col: i32) -> Place {
        let area = self.other.as_ref()?;
        let place = area.to(&self.frame.crs, [self.grid.east_m(col), self.grid.north_m(row)])?;
        let ([east, north], [west, south]) = (self.frame.nearest(place), self.frame.south_west);
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
            return Places { warp: self, rect, kind: Kind::Aligned { cols, rows } };
        }
        let near = |axis: usize, post: i32| self.net.split(axis, post).0;
        let far = |axis: usize, post: i32| near(axis, post) + i32::from(0 < self.net.split(axis, post).1);
        let lines = PostRect {
            south: near(1, rect.south),
            west: near(0, rect.west),
            north: far(1, rect.north),
            east: far(0, rect.east),
        };
        let nodes = (lines.south..=lines.north).flat_map(|row| (lines.west..=lines.east).map(move |col| (row, col)));
        let places = nodes.map(|(row, col)| self.projected(self.net.post(1, row), self.net.post(0, col))).collect();
        Places { warp: self, rect, kind: Kind::Net { lines, places } }
    }

    /// Places beside each other without a turn between them: in a raster that goes around the Earth they may lie at
    /// both of its ends, and those at the first are counted on from the last.
    fn together(&self, places: [[i64; 2]; 4]) -> [[i64; 2]; 4] {
        let cols = places.map(|[col, _]| col);
        let west = cols.iter().fold(i64::MAX, |west, &col| west.min(col));
        match self.turn {
            Some(turn) if cols.iter().any(|col| turn / 2 < col - west) => {
                places.map(|[col, row]| [if turn / 2 < col - west { col } else { col + turn }, row])
            }
            _ => places,
        }
    }

    /// The same of a place among such: back at the first end where it lies beyond the last.
    fn in_turn(&self, [col, row]: [i64; 2]) -> [i64; 2] {
        let last = i64::from(self.frame.cols - 1) * i64::from(TAP_UNITS);
        match self.turn {
            Some(turn) if last < col && turn <= col => [col - turn, row],
            _ => [col, row],
        }
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

    /// The posts of the raster that the posts of a rectangle of the grid lie among.
    pub(crate) fn reach(&self, rect: PostRect) -> Reach {
        let places = self.over(rect);
        let rows = || rect.south..=rect.north;
        let cols = || rect.west..=rect.east;
        let sides: [Vec<Place>; 4] = [
            cols().map(|col| places.at(rect.south, col)).collect(),
            cols().map(|col| places.at(rect.north, col)).collect(),
            rows().map(|row| places.at(row, rect.west)).collect(),
            rows().map(|row| places.at(row, rect.east)).collect(),
        ];
        let mut reach = Reach::default();
        let unit = i64::from(TAP_UNITS);
        for [a, b] in sides.iter().flat_map(|side| side.windows(2)).filter_map(|pair| Some([pair[0]?, pair[1]?])) {
            let [cols, rows] = [0, 1].map(|axis| {
                let (low, high) = (a[axis].min(b[axis]), a[axis].max(b[axis]));
                let inside = |post: i64, count: u32| post.clamp(-1, i64::from(count)) as i32;
                let count = [self.frame.cols, self.frame.rows][axis];
                (inside(low.div_euclid(unit), count), inside(-(-high).div_euclid(unit), count))
            });
            (rows.0..=rows.1).for_each(|row| reach.widen(row, cols));
        }
        reach
    }

    /// Source posts in a metre of ground at the middle of a rectangle, across and along.
    pub(crate) fn posts_per_metre(&self, rect: PostRect) -> [f64; 2] {
        let (row, col) = ((rect.south + rect.north) / 2, (rect.west + rect.east) / 2);
        let spacing_m = self.grid.spacing.metres();
        if self.other.is_none() {
            return self.frame.spacing.map(|spacing| 1.0 / spacing);
        }
        let [Some(a), Some(b), Some(c)] = [(row, col), (row, col + self.net.step), (row + self.net.step, col)]
            .map(|(row, col)| self.projected(row, col))
        else {
            return [1.0 / spacing_m; 2];
        };
        let posts = |from: [i64; 2], to: [i64; 2], axis: usize| (to[axis] - from[axis]).abs() as f64;
        let per_metre = 1.0 / (f64::from(TAP_UNITS) * spacing_m * f64::from(self.net.step));
        [posts(a, b, 0).max(posts(a, c, 0)) * per_metre, posts(a, b, 1).max(posts(a, c, 1)) * per_metre]
    }
}

/// Columns of a raster by row: those between what lies farthest west in a row and what lies farthest east.
#[derive(Clone, Debug, Default)]
pub struct Reach(BTreeMap<i32, (i32, i32)>);

impl Reach {
    fn widen(&mut self, row: i32, (west, east): (i32, i32)) {
        let cols = self.0.entry(row).or_insert((west, east));
        *cols = (cols.0.min(west), cols.1.max(east));
    }

    /// The columns of a window, row by row.
    pub(crate) fn within(&self, window: PostRect) -> impl Iterator<Item = (i32, Range<i32>)> {
        let cut =
            move |(&row, &(west, east)): (&i32, &(i32, i32))| (row, west.max(window.west)..east.min(window.east) + 1);
        self.0.range(window.south..=window.north).map(cut).filter(|(_, cols)| !cols.is_empty())
    }
}

/// The places of the posts of a rectangle in a raster.
pub(crate) struct Places<'a> {
    warp: &'a Warp,
    rect: PostRect,
    kind: Kind,
}

enum Kind {
    /// Rows run along rows: each axis by itself.
    Aligned { cols: Vec<Option<i64>>, rows: Vec<Option<i64>> },
    /// Between projected places, which lie on lines of a net.
    Net { lines: PostRect, places: Vec<Place> },
}

impl Places<'_> {
    /// The place of one post of the rectangle.
    pub(crate) fn at(&self, row: i32, col: i32) -> Place {
        match &self.kind {
            Kind::Aligned { cols, rows } => {
                Some([cols[(col - self.rect.west) as usize]?, rows[(row - self.rect.south) as usize]?])
            }
            Kind::Net { lines, places } => {
                let net = self.warp.net;
                let ((south, up), (west, right)) = (net.split(1, row), net.split(0, col));
                let (up, right, step) = (i64::from(up), i64::from(right), net.step);
                let place = |row: i32, col: i32| {
                    places[(row - lines.south) as usize * lines.posts_wide() + (col - lines.west) as usize]
                };
                // A post on a projected line needs none beyond it.
                let (north, east) = (south + i32::from(0 < up), west + i32::from(0 < right));
                let corners = [place(south, west)?, place(south, east)?, place(north, west)?, place(north, east)?];
                let (corners, n) = (self.warp.together(corners), i64::from(step));
                Some(self.warp.in_turn([0, 1].map(|axis| {
                    let [a, b, c, d] = corners.map(|corner| corner[axis]);
                    let sum = (a * (n - right) + b * right) * (n - up) + (c * (n - right) + d * right) * up;
                    // The step is a power of two, so this is the division by its square, rounded down.
                    (sum + n * n / 2) >> (2 * step.trailing_zeros())
                })))
            }
        }
    }
}
