//! Where a vertex stands while it is being moved.

use terrain::{LATTICE_PER_POST, LatticePoint, PostRect};

/// Steps of the working lattice between posts: fine enough that rounding costs nothing (measured), and so coarse that
/// every orientation is exact.
pub(crate) const PER_POST: i32 = 64;

/// A place in 64ths of a post from the tile's south-west post.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(crate) struct Place {
    pub y: i32,
    pub x: i32,
}

impl Place {
    pub const fn new(x: i32, y: i32) -> Self {
        Self { y, x }
    }

    /// The place of a lattice point of a tile.
    pub fn of(point: LatticePoint, tile: PostRect) -> Self {
        let origin = LatticePoint::from(tile.south_west());
        const STEP: i32 = PER_POST / LATTICE_PER_POST;
        Self { y: (point.row - origin.row) * STEP, x: (point.col - origin.col) * STEP }
    }

    /// The lattice point here.
    ///
    /// # Panics
    /// When the place lies between lattice points.
    pub fn lattice_point(self, tile: PostRect) -> LatticePoint {
        const STEP: i32 = PER_POST / LATTICE_PER_POST;
        assert!(self.x % STEP == 0 && self.y % STEP == 0, "a finished vertex stands on the lattice");
        let origin = LatticePoint::from(tile.south_west());
        LatticePoint::new(origin.row + self.y / STEP, origin.col + self.x / STEP)
    }

    /// Posts east and north of the south-west post.
    #[inline(always)]
    pub fn posts(self) -> (f64, f64) {
        const POST: f64 = 1.0 / PER_POST as f64;
        (f64::from(self.x) * POST, f64::from(self.y) * POST)
    }

    /// The first row of posts at or north of here.
    #[inline(always)]
    pub fn row_from(self) -> i32 {
        (self.y + PER_POST - 1) / PER_POST
    }

    /// Squared distance in steps.
    pub fn squared_distance(self, other: Self) -> i64 {
        let (x, y) = (i64::from(self.x - other.x), i64::from(self.y - other.y));
        x * x + y * y
    }

    /// Doubled signed area of `a`, `b`, `c` in squared steps; positive when counter-clockwise.
    #[inline(always)]
    pub fn orient(a: Self, b: Self, c: Self) -> i64 {
        let (bx, by) = (i64::from(b.x - a.x), i64::from(b.y - a.y));
        let (cx, cy) = (i64::from(c.x - a.x), i64::from(c.y - a.y));
        bx * cy - by * cx
    }
}
