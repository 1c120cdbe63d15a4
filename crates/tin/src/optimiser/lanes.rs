//! The triangles around a vertex, all at once.
//!
//! Lane i is triangle i of a star, between neighbours i and i + 1. A lane does what `form` does for one triangle, in
//! the same order, so results are the same bits whatever the processor's lanes, and the same as without them.

use fearless_simd::{Simd, f64x8, prelude::*};

use crate::optimiser::form::Hinge;
use crate::optimiser::moments::{SUMS, Sums};
use crate::optimiser::place::Place;

/// Triangles a star may have here; few have more.
pub(crate) const LANES: usize = 8;

/// The star of a vertex. Lanes beyond the last triangle hold anything and are never added up.
#[derive(Default)]
pub(crate) struct StarLanes {
    count: usize,
    /// Neighbours in posts and quanta, the first again behind the last.
    x: [f64; LANES + 1],
    y: [f64; LANES + 1],
    h: [f64; LANES + 1],
    /// Sums west of the edges to them, and of those opposite to the vertex.
    spokes: [[f64; LANES + 1]; SUMS],
    rims: [[f64; LANES]; SUMS],
}

/// The normal equations of a step, added up: of x and y with x, y and height, and of height alone.
pub(crate) struct Totals {
    pub xx: f64,
    pub xy: f64,
    pub xh: f64,
    pub yy: f64,
    pub yh: f64,
    pub hh: f64,
    pub pull: [f64; 3],
    /// Distance to the farthest neighbour, in posts.
    pub reach: f64,
}

/// What the triangles say, seen from the vertex.
struct Views<S: Simd> {
    n: f64x8<S>,
    x: f64x8<S>,
    y: f64x8<S>,
    xx: f64x8<S>,
    xy: f64x8<S>,
    yy: f64x8<S>,
    z: f64x8<S>,
    xz: f64x8<S>,
    yz: f64x8<S>,
    zz: f64x8<S>,
    /// The gradients of the barycentric coordinates of neighbours i and i + 1.
    toward: [[f64x8<S>; 2]; 2],
}

impl StarLanes {
    /// Takes in the neighbours of a vertex with so many triangles; `false` where these are too many.
    #[inline(always)]
    pub fn enter(&mut self, around: &[(Place, f64)], triangles: usize) -> bool {
        self.count = triangles;
        if LANES < triangles {
            return false;
        }
        let closing = if around.len() == triangles { around.first() } else { None };
        for (i, &(at, height)) in around.iter().chain(closing).enumerate() {
            (self.x[i], self.y[i]) = at.posts();
            self.h[i] = height;
        }
        true
    }

    #[inline(always)]
    pub fn put_rim(&mut self, i: usize, sums: &Sums) {
        for (lanes, sum) in self.rims.iter_mut().zip(sums.all()) {
            lanes[i] = sum;
        }
    }

    /// Puts the sums of the edge to neighbour `i` of so many.
    #[inline(always)]
    pub fn put_spoke(&mut self, i: usize, neighbours: usize, sums: &Sums) {
        for (lanes, sum) in self.spokes.iter_mut().zip(sums.all()) {
            lanes[i] = sum;
        }
        if i == 0 && neighbours == self.count {
            for (lanes, sum) in self.spokes.iter_mut().zip(sums.all()) {
                lanes[neighbours] = sum;
            }
        }
    }

    /// The normal equations of the vertex `hub`, at a place and a height, with the stiffness and the pull of each of
    /// its triangles; where it stands on the ground the vertex rises with the ground, whose slope is then given.
    #[inline(always)]
    pub fn totals<S: Simd>(
        &self,
        simd: S,
        (at, height): (Place, f64),
        stiffness: &[f64; LANES],
        pull: &[f64; LANES],
        ground_slope: Option<[f64; 2]>,
    ) -> Totals {
        let (x0, y0) = at.posts();
        let (x, y, h) = (f64x8::splat(simd, x0), f64x8::splat(simd, y0), f64x8::splat(simd, height));
        let (ax, ay, ha) = (first(simd, &self.x) - x, first(simd, &self.y) - y, first(simd, &self.h) - h);
        let (bx, by, hb) = (second(simd, &self.x) - x, second(simd, &self.y) - y, second(simd, &self.h) - h);
        let per_area = f64x8::splat(simd, 1.0) / (ax * by - ay * bx);
        let (gx, gy) = ((ha * by - hb * ay) * per_area, (hb * ax - ha * bx) * per_area);
        let (tx, ty) = match ground_slope {
            Some([x, y]) => (f64x8::splat(simd, x) - gx, f64x8::splat(simd, y) - gy),
            None => (-gx, -gy),
        };
        let (s, p) = (f64x8::from_slice(simd, stiffness), f64x8::from_slice(simd, pull));
        let (sx, sy) = (s * tx, s * ty);
        let rises = if ground_slope.is_some() { 0.0 } else { 1.0 };
        let reach = |reach: f64, i: usize| reach.max((self.x[i] - x0).abs()).max((self.y[i] - y0).abs());
        Totals {
            xx: self.total(sx * tx),
            xy: self.total(sx * ty),
            xh: self.total(sx) * rises,
            yy: self.total(sy * ty),
            yh: self.total(sy) * rises,
            hh: self.total(s) * rises,
            pull: [self.total(p * tx), self.total(p * ty), self.total(p) * rises],
            reach: (0..self.count).fold(0.0, reach),
        }
    }

    /// What all triangles say about the height of a vertex at a place, spokes and rims being put.
    #[inline(always)]
    pub fn hinge<S: Simd>(&self, simd: S, at: Place, height: f64) -> Hinge {
        let Views { n, x, y, xx, xy, yy, z, xz, yz, zz, toward: [[px, py], [qx, qy]] } = self.views(simd, at);
        let h0 = f64x8::splat(simd, height);
        let (up, uq) = (first(simd, &self.h) - h0, second(simd, &self.h) - h0);
        let (gx, gy) = (up * px + uq * qx, up * py + uq * qy);
        let (z0, xz0, yz0) = (z - h0 * n, xz - h0 * x, yz - h0 * y);
        let zz0 = zz - h0 * (z + z0);
        let e = z0 - gx * x - gy * y;
        let xe = xz0 - gx * xx - gy * xy;
        let ye = yz0 - gx * xy - gy * yy;
        let (lx, ly) = (-(px + qx), -(py + qy));
        let two = f64x8::splat(simd, 2.0);
        Hinge {
            squares: self.total(zz0 - gx * (xz0 + xe) - gy * (yz0 + ye)),
            stiffness: self.total(n + two * (lx * x + ly * y) + lx * lx * xx + two * lx * ly * xy + ly * ly * yy),
            pull: self.total(e + lx * xe + ly * ye),
        }
    }

    #[inline(always)]
    fn views<S: Simd>(&self, simd: S, at: Place) -> Views<S> {
        let (x, y) = at.posts();
        let (x, y) = (f64x8::splat(simd, x), f64x8::splat(simd, y));
        let (bx, by) = (first(simd, &self.x) - x, first(simd, &self.y) - y);
        let (cx, cy) = (second(simd, &self.x) - x, second(simd, &self.y) - y);
        let per_area = f64x8::splat(simd, 1.0) / (bx * cy - by * cx);
        let toward = [[cy * per_area, -cx * per_area], [-by * per_area, bx * per_area]];
        let sum = |c: usize| {
            first(simd, &self.spokes[c]) + f64x8::from_slice(simd, &self.rims[c]) - second(simd, &self.spokes[c])
        };
        let (z, n, xz, zz) = (sum(0), sum(1), sum(2), sum(3));
        let (sx, sxx, sxy, syy) = (sum(4), sum(5), sum(6), sum(7));
        let (yz, sy) = (sum(8), sum(9));
        let (dx, dy) = (sx - x * n, sy - y * n);
        Views {
            n,
            x: dx,
            y: dy,
            xx: sxx - x * (sx + dx),
            xy: sxy - x * sy - y * dx,
            yy: syy - y * (sy + dy),
            z,
            xz: xz - x * z,
            yz: yz - y * z,
            zz,
            toward,
        }
    }

    /// The sum over the triangles there are, in their order.
    #[inline(always)]
    fn total<S: Simd>(&self, lanes: f64x8<S>) -> f64 {
        let mut all = [0.0; LANES];
        lanes.store_slice(&mut all);
        all[..self.count].iter().fold(0.0, |sum, lane| sum + lane)
    }
}

/// The first neighbours of all triangles.
#[inline(always)]
fn first<S: Simd>(simd: S, lanes: &[f64; LANES + 1]) -> f64x8<S> {
    f64x8::from_slice(simd, &lanes[..LANES])
}

/// The second neighbours of all triangles.
#[inline(always)]
fn second<S: Simd>(simd: S, lanes: &[f64; LANES + 1]) -> f64x8<S> {
    f64x8::from_slice(simd, &lanes[1..])
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;
    use terrain::geometry::levels_available;
    use terrain::{HeightFit, PostRect, SeamSides};

    use super::*;
    use crate::optimiser::hold::Hold;
    use crate::optimiser::parts::{Layout, Parts};
    use crate::optimiser::scene::{grid, patchy, rough};
    use crate::optimiser::tile_mesh::{Star, TileMesh, next};
    use crate::optimiser::weighted_heights::WeightedHeights;

    #[test]
    fn lanes_of_every_width_say_what_triangles_say_one_by_one() {
        let rect = PostRect { south: 0, west: 0, north: 40, east: 40 };
        let (dem, importance) = (rough(rect, 5), patchy(rect, 5));
        let ground = WeightedHeights::new(&dem, (&importance, &importance), SeamSides::OPEN, HeightFit::Squares);
        let layout = Layout { line_step: None, hold: &|_| Hold::FREE };
        let sheet = TileMesh::new(&ground, Parts::of(&ground, &grid(&dem, 4), &layout), None, false);
        let moments = &sheet.ground.moments;
        let (mut star, mut lanes) = (Star::default(), StarLanes::default());
        for vertex in 0..sheet.vertices.len() as u32 {
            sheet.star(vertex, &mut star);
            let record = &sheet.vertices[vertex as usize];
            let (at, height) = (record.at, record.height + 3.0);
            let look = |&other: &u32| (sheet.at(other), sheet.vertices[other as usize].height);
            let around: Vec<(Place, f64)> = star.ring.iter().map(look).collect();
            assert!(lanes.enter(&around, star.edges.len()));
            let mut expected = Hinge::default();
            for (i, &edge) in star.edges.iter().enumerate() {
                let (a, b) = (around[i], around[(i + 1) % around.len()]);
                let rim = sheet.sums_of(next(edge));
                lanes.put_rim(i, &rim);
                let sums = moments.edge(at, a.0) + rim - moments.edge(at, b.0);
                expected += Hinge::new(&sums, [at, a.0, b.0], [height, a.1, b.1]);
            }
            for (name, level) in levels_available() {
                for (i, &(to, _)) in around.iter().enumerate() {
                    let sums = dispatch!(level, simd => moments.edge_in(simd, at, to));
                    assert_eq!(sums, moments.edge(at, to), "{name}");
                    lanes.put_spoke(i, around.len(), &sums);
                }
                let found = dispatch!(level, simd => lanes.hinge(simd, at, height));
                let of = |hinge: &Hinge| [hinge.squares, hinge.stiffness, hinge.pull];
                assert_eq!(of(&found), of(&expected), "{name}, vertex {vertex}");
            }
        }
    }
}
