//! Geoid grids: how far the zero of a vertical datum lies above the ellipsoid, by longitude and latitude.
//!
//! Heights change from one datum to another by the difference of two grids; heights above the ellipsoid need one.

use std::sync::Arc;

use terrain::{GridFrame, Post, PostRect, QUANTA_PER_METRE};

use crate::RasterFrame;
use crate::crs::Crs;
use crate::frame::SampleScale;
use crate::samples::VoidPosts;
use crate::samples::{Samples, union};
use crate::warp::Net;

/// Heights of a datum's zero above the ellipsoid, as far as they were read.
#[derive(Debug)]
pub struct Geoid {
    /// In degrees.
    pub(crate) frame: RasterFrame,
    pub(crate) scale: SampleScale,
    /// The posts that were read.
    pub(crate) window: PostRect,
    pub(crate) samples: Samples,
    pub(crate) voids: VoidPosts,
}

impl Geoid {
    /// The height of the datum's zero above the ellipsoid, in metres; `None` where the grid has none.
    pub fn height_m(&self, [east, north]: [f64; 2]) -> Option<f64> {
        let frame = &self.frame;
        let cols = i64::from(frame.cols);
        let around = 360.0 / frame.spacing[0];
        let is_global = around - 1.5 <= cols as f64;
        let mut x = (east - frame.south_west[0]) / frame.spacing[0];
        x -= around * (x / around).floor();
        let y = (north - frame.south_west[1]) / frame.spacing[1];
        let (col, row) = (x.floor() as i64, y.floor() as i64);
        let corner = |up: i64, right: i64| {
            let col = if is_global { (col + right) % (around.round() as i64).min(cols) } else { col + right };
            let post = Post::new(i32::try_from(row + up).ok()?, i32::try_from(col).ok()?);
            self.at(post)
        };
        let (right, up) = (x - x.floor(), y - y.floor());
        // A post without weight is not looked at: it may lie beyond the grid.
        let row_at = |north: i64| match 0.0 < right {
            true => Some(corner(north, 0)? * (1.0 - right) + corner(north, 1)? * right),
            false => corner(north, 0),
        };
        match 0.0 < up {
            true => Some(row_at(0)? * (1.0 - up) + row_at(1)? * up),
            false => row_at(0),
        }
    }

    /// The height at a post; `None` where the grid has none, or was not read.
    fn at(&self, post: Post) -> Option<f64> {
        if !self.window.contains(post) {
            return None;
        }
        let index = self.window.index(post);
        (!self.voids.contains(index)).then(|| self.scale.height_m(self.samples.get(index)))
    }
}

/// How heights above one datum become heights above another.
#[derive(Clone, Debug)]
pub struct DatumShift {
    /// The datums' names, as [`plain_datum`](crate::plain_datum) has them.
    pub from: String,
    /// As `from`.
    pub to: String,
    /// The grid of the datum that heights come in; `None` for the ellipsoid itself.
    pub from_grid: Option<Arc<Geoid>>,
    /// The grid of the datum that heights are wanted in.
    pub to_grid: Option<Arc<Geoid>>,
}

impl PartialEq for DatumShift {
    fn eq(&self, other: &Self) -> bool {
        (&self.from, &self.to) == (&other.from, &other.to)
    }
}

impl DatumShift {
    /// What is to be added to heights at a place in degrees, in metres; `None` where a grid has no value.
    pub(crate) fn metres(&self, place: [f64; 2]) -> Option<f64> {
        let height = |grid: &Option<Arc<Geoid>>| grid.as_ref().map_or(Some(0.0), |grid| grid.height_m(place));
        Some(height(&self.from_grid)? - height(&self.to_grid)?)
    }

    /// Whether its grids have values in all of an area.
    pub fn covers(&self, area: &Crs, grid: &GridFrame, rect: PostRect) -> bool {
        self.sampled(area, grid, rect).all(|metres| metres.is_some())
    }

    /// Between what the metres to be added lie in an area, a metre wider than looked at: geoids bend over kilometres.
    pub fn range_m(&self, area: &Crs, grid: &GridFrame, rect: PostRect) -> (f64, f64) {
        let found = self.sampled(area, grid, rect).flatten().map(|metres| (metres - 1.0, metres + 1.0));
        // Where a grid has no value nothing is added.
        found.fold((-1.0, 1.0), union)
    }

    /// What is to be added at places all over an area.
    fn sampled<'a>(
        &'a self,
        area: &'a Crs,
        grid: &'a GridFrame,
        rect: PostRect,
    ) -> impl Iterator<Item = Option<f64>> + 'a {
        const STEPS: i32 = 16;
        let wgs84 = Crs::wgs84();
        let along =
            |low: i32, high: i32, step: i32| low + ((high - low) as i64 * i64::from(step) / i64::from(STEPS)) as i32;
        (0..=STEPS).flat_map(|row| (0..=STEPS).map(move |col| (row, col))).map(move |(row, col)| {
            let (row, col) = (along(rect.south, rect.north, row), along(rect.west, rect.east, col));
            area.to(&wgs84, [grid.east_m(col), grid.north_m(row)]).and_then(|place| self.metres(place))
        })
    }

    /// What is to be added at the posts of a rectangle.
    pub(crate) fn over(&self, area: &Crs, grid: &GridFrame, rect: PostRect) -> Shifts {
        let net = Net::of(grid, STEP_POSTS);
        let near = |axis: usize, post: i32| net.split(axis, post).0;
        let lines = PostRect {
            south: near(1, rect.south),
            west: near(0, rect.west),
            north: near(1, rect.north) + 1,
            east: near(0, rect.east) + 1,
        };
        let wgs84 = Crs::wgs84();
        let quanta = |row: i32, col: i32| {
            let place = area.to(&wgs84, [grid.east_m(net.post(0, col)), grid.north_m(net.post(1, row))]);
            let metres = place.and_then(|place| self.metres(place)).unwrap_or(0.0);
            // Rounded, so that the last digits of sines, which differ from machine to machine, do not decide.
            (metres * f64::from(QUANTA_PER_METRE) * ROUNDED).round() / ROUNDED
        };
        let nodes = (lines.south..=lines.north).flat_map(|row| (lines.west..=lines.east).map(move |col| (row, col)));
        Shifts { net, lines, quanta: nodes.map(|(row, col)| quanta(row, col)).collect() }
    }
}

/// Posts between places where grids are asked; geoids bend over kilometres.
const STEP_POSTS: i32 = 16;
/// Steps of a quantum that differences are rounded to.
const ROUNDED: f64 = 1024.0;

/// What is to be added to heights, every sixteenth post; in between it is interpolated.
pub(crate) struct Shifts {
    net: Net,
    lines: PostRect,
    quanta: Vec<f64>,
}

impl Shifts {
    pub(crate) fn quanta_at(&self, row: i32, col: i32) -> f64 {
        let ((south, up), (west, right)) = (self.net.split(1, row), self.net.split(0, col));
        let [up, right] = [up, right].map(|posts| f64::from(posts) / f64::from(STEP_POSTS));
        let at = (south - self.lines.south) as usize * self.lines.posts_wide() + (west - self.lines.west) as usize;
        let far = at + self.lines.posts_wide();
        let near = self.quanta[at] * (1.0 - right) + self.quanta[at + 1] * right;
        near * (1.0 - up) + (self.quanta[far] * (1.0 - right) + self.quanta[far + 1] * right) * up
    }
}
