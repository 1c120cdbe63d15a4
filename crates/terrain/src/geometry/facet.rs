//! One triangle with heights: its plane in integers.

/// A counter-clockwise triangle over posts of the working tile, with heights in quanta.
///
/// The plane at a post is `(z[0] * den + px * (x - x[0]) + py * (y - y[0])) / den`.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// Columns of the corners.
    pub x: [i32; 3],
    /// Rows of the corners.
    pub y: [i32; 3],
    /// Heights of the corners, in quanta.
    pub z: [i32; 3],
    /// Doubled area in cells, positive.
    pub den: i64,
    /// Slope to the east, times `den`.
    pub px: i64,
    /// Slope to the north, times `den`.
    pub py: i64,
}

impl Facet {
    /// The plane through three corners.
    #[inline(always)]
    pub fn new(x: [i32; 3], y: [i32; 3], z: [i32; 3]) -> Self {
        let edge = |i: usize| (i64::from(x[i] - x[0]), i64::from(y[i] - y[0]), i64::from(z[i] - z[0]));
        let ((bx, by, bz), (cx, cy, cz)) = (edge(1), edge(2));
        Self { x, y, z, den: bx * cy - cx * by, px: bz * cy - by * cz, py: bx * cz - bz * cx }
    }

    /// First and last column, first and last row of the bounding box.
    #[inline(always)]
    pub fn bounds(&self) -> (i32, i32, i32, i32) {
        let [a, b, c] = self.x;
        let [d, e, f] = self.y;
        (a.min(b).min(c), a.max(b).max(c), d.min(e).min(f), d.max(e).max(f))
    }

    /// How far an edge, from corner `edge` to the next, runs to the east and to the north.
    #[inline(always)]
    pub fn edge(&self, edge: usize) -> (i32, i32) {
        let next = (edge + 1) % 3;
        (self.x[next] - self.x[edge], self.y[next] - self.y[edge])
    }

    /// The function of an edge at a post, times the edge's length its distance to the left: positive inside, 0 on the
    /// edge. Exact for posts within 2^30 of the corners.
    #[inline(always)]
    pub fn edge_at(&self, edge: usize, x: i32, y: i32) -> i64 {
        let (dx, dy) = self.edge(edge);
        i64::from(dx) * i64::from(y - self.y[edge]) - i64::from(dy) * i64::from(x - self.x[edge])
    }

    /// Whether the triangle owns the posts on an edge, away from the far borders: a shift east, then a smaller one
    /// north, stays inside over edges that run south, or level to the east.
    #[inline(always)]
    pub fn owns_edge(&self, edge: usize) -> bool {
        let (dx, dy) = self.edge(edge);
        (-dy, dx) > (0, 0)
    }

    /// The plane's height at (0, 0) times `den`.
    #[inline(always)]
    pub fn origin(&self) -> i64 {
        i64::from(self.z[0]) * self.den - self.px * i64::from(self.x[0]) - self.py * i64::from(self.y[0])
    }
}
