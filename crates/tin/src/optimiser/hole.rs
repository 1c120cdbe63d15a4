//! The best triangulation of a hole: dynamic programming over its chords, four triangles at a time.

use fearless_simd::{Simd, f64x4, prelude::*};

use crate::optimiser::form::Form;
use crate::optimiser::hold::Hold;
use crate::optimiser::moments::{SUMS, Sums};
use crate::optimiser::patch::Patch;
use crate::optimiser::place::{Place, Shape, is_fit};
use crate::optimiser::tile_mesh::{TileMesh, next};

/// Corners of a hole, at most.
const CORNERS_MAX: usize = 13;
/// Triangles that are looked at together.
const LANES: usize = 4;
/// Corners, and as many more as lanes may reach beyond the last.
const WIDE: usize = CORNERS_MAX + LANES;

/// A polygon and what is known of its parts. Lanes that are no triangle hold anything and are never looked at.
pub(crate) struct Hole {
    at: [Place; CORNERS_MAX],
    /// In posts and quanta.
    x: [f64; WIDE],
    y: [f64; WIDE],
    height: [f64; WIDE],
    /// What may not change about a corner; not asked where there are no features.
    hold: [Hold; CORNERS_MAX],
    has_features: bool,
    /// Quanta between steps of places, as the ground has them.
    quanta_per_step: f64,
    /// Sums west of the chord from corner i to corner j, for i < j: `forth[i][..][j]` and `back[j][..][i]`.
    forth: [[[f64; WIDE]; SUMS]; CORNERS_MAX],
    back: [[[f64; WIDE]; SUMS]; CORNERS_MAX],
    /// Least squares of the part between corners i and j, and the corner its last triangle reaches.
    best: [[f64; CORNERS_MAX]; CORNERS_MAX],
    split: [[u8; CORNERS_MAX]; CORNERS_MAX],
}

impl Default for Hole {
    fn default() -> Self {
        const N: usize = CORNERS_MAX;
        Self {
            at: [Place::default(); N],
            x: [0.0; WIDE],
            y: [0.0; WIDE],
            height: [0.0; WIDE],
            hold: [Hold::FREE; N],
            has_features: false,
            quanta_per_step: f64::INFINITY,
            forth: [[[0.0; WIDE]; SUMS]; N],
            back: [[[0.0; WIDE]; SUMS]; N],
            best: [[0.0; N]; N],
            split: [[0; N]; N],
        }
    }
}

impl Hole {
    /// Finds the triangles that fill a counter-clockwise polygon with the fewest squares, and gives these; `None`
    /// where it has no valid triangulation or too many corners. Where the polygon is a star's ring, `spokes` are the
    /// star's edges, and what is summed along the ring is not summed again.
    #[inline(always)]
    pub fn fill<S: Simd>(&mut self, simd: S, sheet: &TileMesh, polygon: &[u32], spokes: &[u32]) -> Option<f64> {
        let n = polygon.len();
        if n < 3 {
            return Some(0.0);
        }
        if CORNERS_MAX < n {
            return None;
        }
        for (i, &vertex) in polygon.iter().enumerate() {
            let vertex = &sheet.vertices[vertex as usize];
            (self.at[i], self.height[i], self.hold[i]) = (vertex.at, vertex.height, vertex.hold);
            (self.x[i], self.y[i]) = vertex.at.posts();
        }
        (self.has_features, self.quanta_per_step) = (sheet.has_features, sheet.ground.quanta_per_step);
        for i in 0..n {
            for j in i + 1..n {
                let sums = if j == i + 1 && i < spokes.len() {
                    sheet.sums_of(next(spokes[i]))
                } else if i == 0 && j + 1 == n && spokes.len() == n {
                    -sheet.sums_of(next(spokes[j]))
                } else {
                    sheet.ground.moments.edge_in(simd, self.at[i], self.at[j])
                };
                for (c, sum) in sums.all().into_iter().enumerate() {
                    self.forth[i][c][j] = sum;
                    self.back[j][c][i] = sum;
                }
            }
            if i + 1 < n {
                self.best[i][i + 1] = 0.0;
            }
        }
        for reach in 2..n {
            for i in 0..n - reach {
                self.find_split(simd, i, i + reach);
            }
        }
        if self.best[0][n - 1] == f64::INFINITY {
            return None;
        }
        Some(self.best[0][n - 1])
    }

    #[inline(always)]
    fn find_split<S: Simd>(&mut self, simd: S, i: usize, j: usize) {
        let (mut best, mut split) = (f64::INFINITY, 0);
        for first in (i + 1..j).step_by(LANES) {
            let squares = self.squares(simd, i, first, j);
            for k in first..j.min(first + LANES) {
                let parts = self.best[i][k] + self.best[k][j];
                let sum = parts + squares[k - first];
                if parts < best && sum < best && self.is_sound(i, k, j) {
                    (best, split) = (sum, k as u8);
                }
            }
        }
        self.best[i][j] = best;
        self.split[i][j] = split;
    }

    /// Squares of the triangles between corners i, k and j, for all k from `first` on that lanes reach.
    #[inline(always)]
    fn squares<S: Simd>(&self, simd: S, i: usize, first: usize, j: usize) -> [f64; LANES] {
        let load = |lanes: &[f64; WIDE]| f64x4::from_slice(simd, &lanes[first..first + LANES]);
        let splat = |value: f64| f64x4::splat(simd, value);
        let (forth, back) = (&self.forth[i], &self.back[j]);
        let sum = |c: usize| load(&forth[c]) + load(&back[c]) - splat(forth[c][j]);
        let (x0, y0, h0) = (splat(self.x[i]), splat(self.y[i]), splat(self.height[i]));
        let (bx, by) = (load(&self.x) - x0, load(&self.y) - y0);
        let (cx, cy) = (splat(self.x[j] - self.x[i]), splat(self.y[j] - self.y[i]));
        let per_area = splat(1.0) / (bx * cy - by * cx);
        let (px, py, qx, qy) = (cy * per_area, -cx * per_area, -by * per_area, bx * per_area);
        let (z, n, sx, sy) = (sum(0), sum(1), sum(4), sum(9));
        let (x, y) = (sx - x0 * n, sy - y0 * n);
        let (xx, xy, yy) = (sum(5) - x0 * (sx + x), sum(6) - x0 * sy - y0 * x, sum(7) - y0 * (sy + y));
        let (xz, yz) = (sum(2) - x0 * z, sum(8) - y0 * z);
        let (up, uq) = (load(&self.height) - h0, splat(self.height[j] - self.height[i]));
        let (gx, gy) = (up * px + uq * qx, up * py + uq * qy);
        let (z0, xz0, yz0) = (z - h0 * n, xz - h0 * x, yz - h0 * y);
        let zz0 = sum(3) - h0 * (z + z0);
        let xe = xz0 - gx * xx - gy * xy;
        let ye = yz0 - gx * xy - gy * yy;
        let mut all = [0.0; LANES];
        (zz0 - gx * (xz0 + xe) - gy * (yz0 + ye)).store_slice(&mut all);
        all
    }

    #[inline(always)]
    fn is_sound(&self, i: usize, k: usize, j: usize) -> bool {
        let corners = [i, k, j];
        let [a, b, c] = corners.map(|i| self.at[i]);
        if !self.has_features {
            return Shape::Sound.admits(a, b, c);
        }
        let (heights, holds) = (corners.map(|i| self.height[i]), corners.map(|i| self.hold[i]));
        is_fit([a, b, c], heights, holds, self.quanta_per_step)
    }

    #[inline(always)]
    fn sums(&self, i: usize, k: usize, j: usize) -> Sums {
        let mut all = [0.0; SUMS];
        for (c, sum) in all.iter_mut().enumerate() {
            *sum = self.forth[i][c][k] + self.forth[k][c][j] - self.forth[i][c][j];
        }
        Sums::of(all)
    }

    /// Appends the triangles that were found for a polygon.
    pub fn push_triangles(&self, polygon: &[u32], patch: &mut Patch) {
        let mut open = [(0, 0); CORNERS_MAX];
        open[0] = (0, polygon.len().saturating_sub(1));
        let mut count = 1;
        while 0 < count {
            count -= 1;
            let (i, j) = open[count];
            if i + 1 < j {
                let k = usize::from(self.split[i][j]);
                let form = Form::new(&self.sums(i, k, j), [self.at[i], self.at[k], self.at[j]]);
                patch.new.push(([polygon[i], polygon[k], polygon[j]], form));
                (open[count], open[count + 1]) = ((i, k), (k, j));
                count += 2;
            }
        }
    }
}
