//! Where the load modules of an area lie.

use crate::lookup::STEPS;
use crate::{Header, QUANTA_PER_METRE};

/// Where load modules lie.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaFrame {
    /// Rows of load modules in the area.
    pub rows: u32,
    /// Columns of load modules in the area.
    pub cols: u32,
    /// Levels of every load module: 0 is the finest, the last one the coarsest.
    pub level_count: u16,
    /// Side of a load module in quanta of 1/128 m.
    pub side: u16,
    /// Easting and northing of the area's south-west corner, metres.
    pub origin_m: [f64; 2],
    /// The coordinate system, such as `EPSG:32611`.
    pub crs: String,
    /// What heights are above; empty when unknown.
    pub vertical_datum: String,
}

impl AreaFrame {
    /// That of the area a file belongs to.
    pub fn of(header: &Header) -> Self {
        Self {
            rows: header.area_rows,
            cols: header.area_cols,
            level_count: header.level_count,
            side: header.side,
            origin_m: header.origin_m,
            crs: header.crs.clone(),
            vertical_datum: header.vertical_datum.clone(),
        }
    }

    /// Side of a load module in metres.
    pub fn side_m(&self) -> f64 {
        f64::from(self.side) / f64::from(QUANTA_PER_METRE)
    }

    /// Whether a place lies in the area, its far sides included.
    pub fn holds(&self, [east_m, north_m]: [f64; 2]) -> bool {
        let inside = |metres: f64, origin: f64, count: u32| {
            (0.0..=f64::from(count) * self.side_m()).contains(&(metres - origin))
        };
        inside(east_m, self.origin_m[0], self.cols) && inside(north_m, self.origin_m[1], self.rows)
    }

    /// Row and column of the load module under a place, however far outside the area that lies. What is not a number
    /// lies as far south and west as can be.
    pub fn module_at(&self, [east_m, north_m]: [f64; 2]) -> [i64; 2] {
        let index = |metres: f64, origin: f64| match ((metres - origin) / self.side_m()).floor() {
            index if index.is_nan() => i64::MIN,
            index => index as i64,
        };
        [index(north_m, self.origin_m[1]), index(east_m, self.origin_m[0])]
    }

    /// Row and column of the load module that is asked for what lies at a place; `None` outside the area. The far sides
    /// of the area belong to it.
    pub fn module_under(&self, [east_m, north_m]: [f64; 2]) -> Option<[u32; 2]> {
        let side_steps = i64::from(self.side) * STEPS;
        let (row, _) = steps(north_m - self.origin_m[1], self.rows, side_steps)?;
        let (col, _) = steps(east_m - self.origin_m[0], self.cols, side_steps)?;
        Some([row, col])
    }
}

/// The row or column of load modules, of `count`, at a distance from the area's side, and the steps from there.
#[inline]
pub(crate) fn steps(metres: f64, count: u32, side_steps: i64) -> Option<(u32, i64)> {
    let steps = metres * (f64::from(QUANTA_PER_METRE) * STEPS as f64) + 0.5;
    let end = side_steps * i64::from(count);
    // Far outside, or not a number: nowhere.
    if !(0.0 <= steps && steps < end as f64 + 1.0) {
        return None;
    }
    let steps = steps as i64;
    // A quotient of floats may be off by one at a line; either load module has the line.
    let index = ((steps as f64 / side_steps as f64) as i64).min(i64::from(count) - 1);
    Some((index as u32, (steps - index * side_steps).clamp(0, side_steps)))
}

/// A half-open rectangle of load modules.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// First row.
    pub south: u32,
    /// First column.
    pub west: u32,
    /// One past the last row.
    pub north: u32,
    /// One past the last column.
    pub east: u32,
}

impl Block {
    /// Load modules inside; none where a side lies beyond the one it faces.
    pub fn count(&self) -> usize {
        let (rows, cols) = (self.north.saturating_sub(self.south), self.east.saturating_sub(self.west));
        (rows as usize).saturating_mul(cols as usize)
    }

    /// Whether a load module lies inside.
    pub fn contains(&self, row: u32, col: u32) -> bool {
        self.south <= row && row < self.north && self.west <= col && col < self.east
    }

    /// Where a load module inside stands, row by row from the south-west.
    pub fn index(&self, row: u32, col: u32) -> usize {
        (row - self.south) as usize * (self.east - self.west) as usize + (col - self.west) as usize
    }

    /// Row and column of the load module at an index inside.
    pub(crate) fn place(&self, index: usize) -> [u32; 2] {
        let cols = (self.east - self.west) as usize;
        [self.south + (index / cols) as u32, self.west + (index % cols) as u32]
    }
}
