//! Where the load modules of an area lie.

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
    pub(crate) fn of(header: &Header) -> Self {
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

    pub(crate) fn contains(&self, row: u32, col: u32) -> bool {
        self.south <= row && row < self.north && self.west <= col && col < self.east
    }

    pub(crate) fn index(&self, row: u32, col: u32) -> usize {
        (row - self.south) as usize * (self.east - self.west) as usize + (col - self.west) as usize
    }
}
