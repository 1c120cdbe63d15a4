//! What the posts under one triangle say about its plane.

use crate::optimiser::moments::{Local, Sums};
use crate::optimiser::place::Place;

/// The squared residuals under a triangle as a function of its three heights: h'Ah - 2b'h + c.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Form {
    /// A's diagonal.
    pub aa: [f64; 3],
    /// A off its diagonal: opposite corner 0, 1, 2, so that `ab[i]` couples the other two.
    pub ab: [f64; 3],
    pub b: [f64; 3],
    pub c: f64,
}

impl Form {
    /// The form of the triangle `corners`, whose owned posts have these sums.
    #[inline(always)]
    pub fn new(sums: &Sums, corners: [Place; 3]) -> Self {
        let frame = Corner::new(sums, corners);
        let Local { n, x, y, xx, xy, yy, z, xz, yz, zz } = frame.local;
        let ([px, py], [qx, qy]) = (frame.toward[0], frame.toward[1]);
        // Barycentric coordinates of the other two corners: px x + py y and qx x + qy y.
        let (s1, s2) = (px * x + py * y, qx * x + qy * y);
        let a11 = px * px * xx + 2.0 * px * py * xy + py * py * yy;
        let a22 = qx * qx * xx + 2.0 * qx * qy * xy + qy * qy * yy;
        let a12 = px * qx * xx + (px * qy + py * qx) * xy + py * qy * yy;
        let (b1, b2) = (px * xz + py * yz, qx * xz + qy * yz);
        let (a01, a02) = (s1 - a11 - a12, s2 - a22 - a12);
        let a00 = n - s1 - s2 - a01 - a02;
        Self { aa: [a00, a11, a22], ab: [a12, a02, a01], b: [z - b1 - b2, b1, b2], c: zz }
    }

    /// Sum of squared residuals when the corners stand at heights `h`.
    #[inline(always)]
    pub fn squares(&self, h: [f64; 3]) -> f64 {
        let mut sum = self.c;
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            sum += h[i] * (h[i] * self.aa[i] - 2.0 * self.b[i]) + 2.0 * h[j] * h[k] * self.ab[i];
        }
        sum
    }

    /// Half the slope of the squares towards lower heights of corner `i`: what is left to explain there.
    #[inline(always)]
    pub fn pull(&self, i: usize, h: [f64; 3]) -> f64 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        self.b[i] - self.aa[i] * h[i] - self.ab[k] * h[j] - self.ab[j] * h[k]
    }
}

/// A triangle seen from its first corner.
struct Corner {
    local: Local,
    /// For the second and the third corner, the gradient of its barycentric coordinate.
    toward: [[f64; 2]; 2],
}

impl Corner {
    #[inline(always)]
    fn new(sums: &Sums, [a, b, c]: [Place; 3]) -> Self {
        let (x, y) = a.posts();
        let (bx, by) = Place::new(b.x - a.x, b.y - a.y).posts();
        let (cx, cy) = Place::new(c.x - a.x, c.y - a.y).posts();
        let per_area = 1.0 / (bx * cy - by * cx);
        let toward = [[cy * per_area, -cx * per_area], [-by * per_area, bx * per_area]];
        Self { local: sums.about(x, y), toward }
    }
}

/// Sum of squared residuals under a triangle whose corners stand at heights `h`, without its form.
#[inline(always)]
pub(crate) fn squares(sums: &Sums, corners: [Place; 3], h: [f64; 3]) -> f64 {
    Hinge::new(sums, corners, h).squares
}

/// What a triangle says about the height of its first corner.
#[derive(Clone, Copy, Default)]
pub(crate) struct Hinge {
    /// Sum of squares as it stands.
    pub squares: f64,
    /// Sum of the corner's squared barycentric coordinate.
    pub stiffness: f64,
    /// Sum of the residual times the coordinate.
    pub pull: f64,
}

impl Hinge {
    #[inline(always)]
    pub fn new(sums: &Sums, corners: [Place; 3], h: [f64; 3]) -> Self {
        let frame = Corner::new(sums, corners);
        let Local { n, x, y, xx, xy, yy, z, xz, yz, zz } = frame.local;
        let ([px, py], [qx, qy]) = (frame.toward[0], frame.toward[1]);
        let (up, uq) = (h[1] - h[0], h[2] - h[0]);
        let (gx, gy) = (up * px + uq * qx, up * py + uq * qy);
        // Residuals against a level plane through the corner, then against the triangle.
        let (z0, xz0, yz0) = (z - h[0] * n, xz - h[0] * x, yz - h[0] * y);
        let zz0 = zz - h[0] * (z + z0);
        let e = z0 - gx * x - gy * y;
        let xe = xz0 - gx * xx - gy * xy;
        let ye = yz0 - gx * xy - gy * yy;
        let (lx, ly) = (-(px + qx), -(py + qy));
        Self {
            squares: zz0 - gx * (xz0 + xe) - gy * (yz0 + ye),
            stiffness: n + 2.0 * (lx * x + ly * y) + lx * lx * xx + 2.0 * lx * ly * xy + ly * ly * yy,
            pull: e + lx * xe + ly * ye,
        }
    }
}

impl std::ops::AddAssign for Hinge {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.squares += other.squares;
        self.stiffness += other.stiffness;
        self.pull += other.pull;
    }
}
