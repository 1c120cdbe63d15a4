//! The limit: the smallest RMS residual that a surface of so many triangles can have on a ground, and how far a TIN is
//! from it.
//!
//! On smooth ground, for large N, the best continuous surface of N triangles with free vertices and free heights has
//!
//! ```text
//! RMS = (1 / N) * (integral of (kappa |det H|)^(1/3) over the area)^(3/2) / sqrt(area)
//! ```
//!
//! where H is the ground's Hessian, and kappa 1/180 where det H > 0 and 1/90 where det H < 0. It follows from the
//! best-fit squares of one triangle; the form is that of Cao (2005) and of Mirebeau and Cohen (2012), and 1/90 is the
//! best mesh that is known, not a proven bound. Where N is small or the ground rough for it, the limit does not hold:
//! a TIN may be better. So the number of triangles and the share of rough ground belong beside it.

use std::ops::Range;

use terrain::{Dem, Each, Post, gather, metres_of_quanta};

/// What so many triangles can reach on a ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Triangles.
    pub triangles: usize,
    /// Smallest RMS residual, in metres.
    pub rms_m: f64,
    /// Share of the ground that is rough for them: within half a triangle its second derivatives change by more than
    /// they are, so that no triangle sees one Hessian.
    pub rough_share: f64,
}

impl Limit {
    /// Eta: how many times the limit an RMS residual is; `None` where the limit is 0, as on a plane.
    pub fn eta(&self, rms_m: f64) -> Option<f64> {
        (0.0 < self.rms_m).then(|| rms_m / self.rms_m)
    }
}

/// Second derivatives in metres a post squared: twice to the east, twice to the north, once to each.
type Hessian = [f64; 3];

/// The limit of a ground for so many triangles; `None` where the ground is too small to have second derivatives.
///
/// Differences are taken over half the side of a triangle, at places as far apart: noise from post to post, which no
/// triangle follows, counts for as little as it does for the triangles.
pub fn limit(dem: &Dem, triangles: usize, each: Each) -> Option<Limit> {
    let rect = dem.rect();
    let (wide, high) = (rect.cells_wide(), rect.cells_high());
    let area = wide as f64 * high as f64;
    // Two triangles make a square.
    let side = (2.0 * area / triangles.max(1) as f64).sqrt();
    let step = ((side / 2.0 + 0.5) as usize).clamp(1, (wide.min(high) / 4).max(1));
    let rows: Vec<i32> = (rect.south + step as i32..=rect.north - step as i32).step_by(step).collect();
    let bands: Vec<Sums> = gather(each, rows.len().div_ceil(BAND), |band| {
        let from = band * BAND;
        Sums::of_rows(dem, &rows, from..(from + BAND).min(rows.len()), step)
    });
    let mut sums = Sums::default();
    bands.iter().for_each(|band| sums.merge(band));
    let mean = sums.densities / (0 < sums.places).then_some(sums.places as f64)?;
    Some(Limit {
        triangles,
        rms_m: (mean * area).powf(1.5) / area.sqrt() / triangles.max(1) as f64,
        rough_share: sums.rough as f64 / sums.compared.max(1) as f64,
    })
}

/// Lines of places that are summed together.
const BAND: usize = 32;

/// Sums over places, in the order of posts within a band and of bands: they do not depend on who is at work.
#[derive(Clone, Copy, Default)]
struct Sums {
    places: u64,
    densities: f64,
    /// Places with all four neighbours, and the rough ones among them.
    compared: u64,
    rough: u64,
}

impl Sums {
    /// Those of some of the lines of places.
    fn of_rows(dem: &Dem, rows: &[i32], band: Range<usize>, step: usize) -> Self {
        let (rect, far) = (dem.rect(), step as i32);
        let line = |index: usize| -> Vec<Option<Hessian>> {
            let Some(&row) = rows.get(index) else { return Vec::new() };
            let cols = (rect.west + far..=rect.east - far).step_by(step);
            cols.map(|col| hessian(dem, Post::new(row, col), far)).collect()
        };
        let mut sums = Self::default();
        let mut below = band.start.checked_sub(1).map(line).unwrap_or_default();
        let mut here = line(band.start);
        for index in band {
            let above = line(index + 1);
            sums.add(&below, &here, &above);
            (below, here) = (here, above);
        }
        sums
    }

    fn merge(&mut self, other: &Self) {
        self.places += other.places;
        self.densities += other.densities;
        self.compared += other.compared;
        self.rough += other.rough;
    }

    /// Adds a line of places; the lines below and above it are empty where there are none.
    fn add(&mut self, below: &[Option<Hessian>], here: &[Option<Hessian>], above: &[Option<Hessian>]) {
        for (index, hessian) in here.iter().enumerate() {
            let Some(hessian) = *hessian else { continue };
            self.places += 1;
            self.densities += density(hessian);
            let at = |line: &[Option<Hessian>], index: usize| line.get(index).copied().flatten();
            let west = index.checked_sub(1).and_then(|index| at(here, index));
            let around = [west.zip(at(here, index + 1)), at(below, index).zip(at(above, index))];
            if let [Some(across), Some(along)] = around {
                // From neighbour to neighbour are two steps.
                let change = size(across).max(size(along)) / 4.0;
                self.compared += 1;
                self.rough += u64::from(size(([0.0; 3], hessian)) < change);
            }
        }
    }
}

/// What a place adds to the integral.
fn density([xx, xy, yy]: Hessian) -> f64 {
    let determinant = xx * yy - xy * xy;
    let kappa = if 0.0 < determinant { 1.0 / 180.0 } else { 1.0 / 90.0 };
    (kappa * determinant.abs()).cbrt()
}

/// The square of how much two Hessians differ.
fn size((a, b): (Hessian, Hessian)) -> f64 {
    let [xx, xy, yy] = [0, 1, 2].map(|part| (a[part] - b[part]) * (a[part] - b[part]));
    xx + 2.0 * xy + yy
}

/// Second differences over steps of so many posts; `None` next to a void.
fn hessian(dem: &Dem, at: Post, step: i32) -> Option<Hessian> {
    let mut heights = [[0.0; 3]; 3];
    for (row, line) in (-1..=1).zip(&mut heights) {
        for (col, height) in (-1..=1).zip(line) {
            let post = Post::new(at.row + row * step, at.col + col * step);
            if dem.is_void(post) {
                return None;
            }
            *height = metres_of_quanta(dem.height(post));
        }
    }
    let [south, here, north] = heights;
    let square = f64::from(step) * f64::from(step);
    let xx = (here[0] - 2.0 * here[1] + here[2]) / square;
    let yy = (south[1] - 2.0 * here[1] + north[1]) / square;
    let xy = (north[2] - north[0] - south[2] + south[0]) / (4.0 * square);
    Some([xx, xy, yy])
}

#[cfg(test)]
mod tests {
    use terrain::{PostRect, in_turn, quanta_of_metres};

    use super::*;

    fn ground(height_m: impl Fn(f64, f64) -> f64) -> Dem {
        let rect = PostRect::new(Post::new(0, 0), Post::new(400, 400));
        Dem::from_fn(rect, |post| quanta_of_metres(height_m(f64::from(post.col) - 200.0, f64::from(post.row) - 200.0)))
    }

    /// The limit where the determinant is the same everywhere.
    fn of_determinant(determinant: f64, kappa: f64, triangles: usize) -> f64 {
        (kappa * determinant).sqrt() * 400.0 * 400.0 / triangles as f64
    }

    #[test]
    fn the_limit_of_quadratic_ground_is_the_one_of_its_determinant() {
        for triangles in [500, 2000] {
            for (found, expected) in [
                (ground(|x, y| 0.01 * (x * x + y * y)), of_determinant(4e-4, 1.0 / 180.0, triangles)),
                (ground(|x, y| 0.02 * x * y), of_determinant(4e-4, 1.0 / 90.0, triangles)),
                (ground(|x, y| 0.002 * (x * x + 25.0 * y * y)), of_determinant(4e-4, 1.0 / 180.0, triangles)),
            ] {
                let found = limit(&found, triangles, &in_turn).unwrap();
                assert!((found.rms_m / expected - 1.0).abs() < 0.02, "{found:?}, expected {expected}");
                assert!(found.rough_share < 0.01, "{found:?}");
                let eta = found.eta(1.5 * found.rms_m).unwrap();
                assert!((eta - 1.5).abs() < 1e-12, "{eta}");
            }
        }
    }

    #[test]
    fn a_plane_has_no_limit_to_be_far_from() {
        let found = limit(&ground(|x, y| x / 4.0 + y / 2.0), 100, &in_turn).unwrap();
        assert_eq!((found.rms_m, found.rough_share, found.eta(1.0)), (0.0, 0.0, None));
    }

    #[test]
    fn noise_from_post_to_post_is_rough_and_waves_are_not_once_triangles_follow_them() {
        let mut draw = fastrand::Rng::with_seed(1);
        let rect = PostRect::new(Post::new(0, 0), Post::new(400, 400));
        let noise = Dem::from_fn(rect, |_| Some(draw.i32(0..1000)));
        let share = limit(&noise, 20_000, &in_turn).unwrap().rough_share;
        assert!(0.3 < share, "{share}");
        let waves = ground(|x, y| 50.0 * (x / 40.0).sin() * (y / 40.0).sin());
        let [few, many] = [100, 20_000].map(|triangles| limit(&waves, triangles, &in_turn).unwrap().rough_share);
        assert!(many < 0.02 && many < few, "{few}, {many}");
    }

    #[test]
    fn voids_are_in_no_limit_and_small_ground_has_none() {
        let whole = ground(|x, y| 0.01 * (x * x + y * y));
        let torn = Dem::from_fn(whole.rect(), |post| (post.col % 97 != 5).then(|| whole.height(post)));
        let (whole, torn) = (limit(&whole, 2000, &in_turn).unwrap(), limit(&torn, 2000, &in_turn).unwrap());
        assert!((torn.rms_m / whole.rms_m - 1.0).abs() < 0.01, "{torn:?}, {whole:?}");
        let small = Dem::from_rows(PostRect::new(Post::new(0, 0), Post::new(1, 1)), &[1, 2, 3, 4]);
        assert_eq!(limit(&small, 2, &in_turn), None);
    }
}
