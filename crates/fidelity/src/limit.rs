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

use terrain::{Dem, Each, Post, PostRect, QUANTA_PER_METRE, gather};

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

/// How much a part of the ground curves: what the limit of the whole is computed from. All are whole numbers, so that
/// sums over parts do not depend on the order of parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Curvature {
    /// Cells of ground that is known.
    pub cells: u64,
    /// The integral of (kappa |det H|)^(1/3) over them, in millionths: lengths across are in posts, heights in metres.
    pub integral: u64,
    /// Cells of rough ground.
    pub rough_cells: u64,
}

/// Parts of a whole in [`Curvature::integral`].
const MILLION: f64 = 1e6;

impl Curvature {
    /// Adds that of another part.
    pub fn merge(&mut self, other: &Self) {
        self.cells += other.cells;
        self.integral = self.integral.saturating_add(other.integral);
        self.rough_cells += other.rough_cells;
    }

    /// The limit for so many triangles; `None` where no second derivatives are known.
    pub fn limit(&self, triangles: usize) -> Option<Limit> {
        let area = (0 < self.cells).then_some(self.cells as f64)?;
        let integral = self.integral as f64 / MILLION;
        Some(Limit {
            triangles,
            rms_m: integral * integral.sqrt() / area.sqrt() / triangles.max(1) as f64,
            rough_share: self.rough_cells as f64 / area,
        })
    }
}

/// The limit of a ground for so many triangles; `None` where the ground is too small to have second derivatives.
pub fn limit(dem: &Dem, triangles: usize, each: Each) -> Option<Limit> {
    curvature(dem, dem.rect(), triangles, each).limit(triangles)
}

/// How much the ground of a rectangle curves for so many triangles.
///
/// Differences are taken over half the side of a triangle, at places as far apart: noise from post to post, which no
/// triangle follows, counts for as little as it does for the triangles.
///
/// # Panics
/// When the window does not hold all posts of the rectangle.
pub fn curvature(dem: &Dem, rect: PostRect, triangles: usize, each: Each) -> Curvature {
    assert!(dem.rect().contains_rect(&rect), "the window holds the ground that is asked for");
    let (wide, high) = (rect.cells_wide(), rect.cells_high());
    let area = wide as f64 * high as f64;
    // Two triangles make a square.
    let side = (2.0 * area / triangles.max(1) as f64).sqrt();
    let step = ((side / 2.0 + 0.5) as usize).clamp(1, (wide.min(high) / 4).max(1));
    let places = Places { dem, rect, step };
    let bands: Vec<Sums> = gather(each, places.row_count().div_ceil(BAND), |band| {
        let from = band * BAND;
        places.sums(from..(from + BAND).min(places.row_count()))
    });
    let mut sums = Sums::default();
    bands.iter().for_each(|band| sums.merge(band));
    if sums.measured == 0 {
        return Curvature::default();
    }
    let share = |part: u64, of: u64| part as f64 / of.max(1) as f64;
    let cells = area * share(sums.known, sums.places);
    let whole = |number: f64| (number + 0.5) as u64;
    Curvature {
        cells: whole(cells),
        integral: whole(cells * places.densities(sums.roots) / sums.measured as f64 * MILLION),
        rough_cells: whole(cells * share(sums.rough, sums.compared)),
    }
}

/// Rows of places that are summed together.
const BAND: usize = 32;

/// Second differences at a row of places, in quanta: whole numbers, NaN next to a void.
#[derive(Default)]
struct Bends {
    /// Twice to the east.
    xx: Vec<f64>,
    /// Four times that once to each side.
    xy: Vec<f64>,
    /// Twice to the north.
    yy: Vec<f64>,
}

/// Places a step apart, from a step inside a rectangle.
struct Places<'a> {
    dem: &'a Dem,
    rect: PostRect,
    step: usize,
}

impl Places<'_> {
    fn row_count(&self) -> usize {
        (self.rect.cells_high() / self.step).saturating_sub(1)
    }

    fn row(&self, index: usize) -> i32 {
        self.rect.south + ((index + 1) * self.step) as i32
    }

    /// Sums over some rows of places.
    fn sums(&self, rows: Range<usize>) -> Sums {
        let mut sums = Sums::default();
        let row = |index: usize| if index < self.row_count() { self.bends(index) } else { Bends::default() };
        let mut below = rows.start.checked_sub(1).map(row).unwrap_or_default();
        let mut here = row(rows.start);
        for index in rows {
            let above = row(index + 1);
            sums.add([&below, &here, &above]);
            if 0 < self.dem.void_count() {
                sums.known -= self.places(index).filter(|&post| self.dem.is_void(post)).count() as u64;
            }
            (below, here) = (here, above);
        }
        sums
    }

    /// The places of a row.
    fn places(&self, index: usize) -> impl Iterator<Item = Post> {
        let (row, rect, step) = (self.row(index), self.rect, self.step);
        (rect.west + step as i32..=rect.east - step as i32).step_by(step).map(move |col| Post::new(row, col))
    }

    /// The bends at a row of places, taken over a step.
    fn bends(&self, index: usize) -> Bends {
        let step = self.step as i32;
        let count = (self.rect.cells_wide() / self.step).saturating_sub(1);
        let from = (self.rect.west - self.dem.rect().west) as usize;
        let heights = |off: i32| -> Vec<f64> {
            let row = &self.dem.row(self.row(index) + off)[from..];
            row.iter().step_by(self.step).take(count + 2).map(|&height| f64::from(height)).collect()
        };
        let rows = [-step, 0, step].map(heights);
        let [south, here, north] = [0, 1, 2].map(|row| Row::of(&rows[row], count));
        let mut bends = Bends {
            xx: (0..count).map(|at| here.west[at] - 2.0 * here.middle[at] + here.east[at]).collect(),
            xy: (0..count).map(|at| north.east[at] - north.west[at] - south.east[at] + south.west[at]).collect(),
            yy: (0..count).map(|at| south.middle[at] - 2.0 * here.middle[at] + north.middle[at]).collect(),
        };
        if 0 < self.dem.void_count() {
            for (at, _) in self.places(index).enumerate().filter(|&(_, post)| self.is_next_to_void(post)) {
                [bends.xx[at], bends.xy[at], bends.yy[at]] = [f64::NAN; 3];
            }
        }
        bends
    }

    fn is_next_to_void(&self, post: Post) -> bool {
        let offs = [-1, 0, 1].map(|off| off * self.step as i32);
        offs.iter().any(|row| offs.iter().any(|col| self.dem.is_void(Post::new(post.row + row, post.col + col))))
    }

    /// The sum of (kappa |det H|)^(1/3) at places, from that of their roots: what all have in common comes last.
    fn densities(&self, roots: f64) -> f64 {
        let step = self.step as f64;
        let of_one = 1.0 / (f64::from(QUANTA_PER_METRE) * step * step);
        roots * cube_root(of_one * of_one / 16.0 / 180.0)
    }
}

/// Heights a step apart: those west of, at and east of each of some places.
struct Row<'a> {
    west: &'a [f64],
    middle: &'a [f64],
    east: &'a [f64],
}

impl<'a> Row<'a> {
    fn of(heights: &'a [f64], places: usize) -> Self {
        Self { west: &heights[..places], middle: &heights[1..=places], east: &heights[2..places + 2] }
    }
}

/// Sums over places, in the order of places within a band and of bands: they do not depend on who is at work.
#[derive(Clone, Copy, Default)]
struct Sums {
    places: u64,
    /// Those that are no void.
    known: u64,
    /// Those that are not next to one either.
    measured: u64,
    /// Cube roots of what the determinants count, in quanta.
    roots: f64,
    /// Places with all four neighbours, and the rough ones among them.
    compared: u64,
    rough: u64,
}

impl Sums {
    fn merge(&mut self, other: &Self) {
        self.places += other.places;
        self.known += other.known;
        self.measured += other.measured;
        self.roots += other.roots;
        self.compared += other.compared;
        self.rough += other.rough;
    }

    /// Adds a row of places, between the one south of it and the one north of it, which are empty where there are none.
    fn add(&mut self, [below, here, above]: [&Bends; 3]) {
        let count = here.xx.len();
        self.places += count as u64;
        self.known += count as u64;
        let roots: Vec<f64> = (0..count).map(|at| root(here.at(at))).collect();
        for root in roots.into_iter().filter(|root| !root.is_nan()) {
            self.measured += 1;
            self.roots += root;
        }
        if below.xx.is_empty() || above.xx.is_empty() {
            return;
        }
        for at in 1..count.saturating_sub(1) {
            let [across, along] =
                [(here.at(at - 1), here.at(at + 1)), (below.at(at), above.at(at))].map(|(a, b)| size(a, b));
            let own = size([0.0; 3], here.at(at));
            // From neighbour to neighbour are two steps. NaN where one of the five is.
            let change = if across < along { along } else { across } / 4.0;
            self.compared += u64::from(!(own + across + along).is_nan());
            self.rough += u64::from((own < change) & !(own + across + along).is_nan());
        }
    }
}

impl Bends {
    #[inline(always)]
    fn at(&self, place: usize) -> [f64; 3] {
        [self.xx[place], self.xy[place], self.yy[place]]
    }
}

/// The cube root of 16 times the determinant of a place, in quanta, doubled where it is negative: kappa is twice as
/// large there.
#[inline(always)]
fn root([xx, xy, yy]: [f64; 3]) -> f64 {
    let determinant = 16.0 * (xx * yy) - xy * xy;
    cube_root(if 0.0 < determinant { determinant } else { -2.0 * determinant })
}

/// 16 times the square of how much two bends differ.
#[inline(always)]
fn size(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [xx, xy, yy] = [0, 1, 2].map(|part| a[part] - b[part]).map(|off| off * off);
    16.0 * xx + 2.0 * xy + 16.0 * yy
}

/// The cube root of a number that is not negative, by sums, products and quotients alone: the same on every machine.
#[inline(always)]
fn cube_root(of: f64) -> f64 {
    // A third of the exponent is within 6 % of the root; each step of Halley's leaves the cube of what is missing.
    let mut root = f64::from_bits(of.to_bits() / 3 + THIRD_OF_BIAS);
    for _ in 0..2 {
        let cube = root * root * root;
        root *= (cube + of + of) / (cube + cube + of);
    }
    if of == 0.0 { 0.0 } else { root }
}

/// Two thirds of the bits of 1, less what makes the largest error smallest.
const THIRD_OF_BIAS: u64 = 0x2A9F_7893_0000_0000;

#[cfg(test)]
mod tests {
    use terrain::{in_turn, quanta_of_metres};

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
    fn the_limit_of_parts_together_is_that_of_the_whole_wherever_they_lie_in_their_windows() {
        let whole = ground(|x, y| 50.0 * (x / 40.0).sin() * (y / 50.0).sin());
        let mut parts = Curvature::default();
        for (row, col) in [(0, 0), (0, 200), (200, 0), (200, 200)] {
            let rect = PostRect::new(Post::new(row, col), Post::new(row + 200, col + 200));
            let part = curvature(&whole, rect, 2000, &in_turn);
            assert_eq!(part, curvature(&whole.window(rect), rect, 2000, &in_turn));
            parts.merge(&part);
        }
        let (parts, whole) = (parts.limit(8000).unwrap(), limit(&whole, 8000, &in_turn).unwrap());
        assert!((parts.rms_m / whole.rms_m - 1.0).abs() < 0.01, "{parts:?}, {whole:?}");
        assert!((parts.rough_share - whole.rough_share).abs() < 0.01, "{parts:?}, {whole:?}");
    }

    #[test]
    fn a_cube_root_is_one_to_twelve_digits() {
        for exponent in -60..60 {
            let of = 1.2345_f64.powi(5 * exponent);
            assert!((cube_root(of) / of.cbrt() - 1.0).abs() < 3e-12, "{of}: {}", cube_root(of));
        }
        assert_eq!(cube_root(0.0), 0.0);
    }

    #[test]
    fn voids_are_in_no_limit_and_small_ground_has_none() {
        let whole = ground(|x, y| 0.01 * (x * x + y * y));
        let all = limit(&whole, 2000, &in_turn).unwrap().rms_m;
        // The same triangles have less ground to follow.
        let is_torn = |post: Post| post.col % 97 == 5;
        let is_west = |post: Post| post.col < 200;
        for (is_void, share) in [(&is_torn as &dyn Fn(Post) -> bool, 96.0 / 97.0), (&is_west, 0.5)] {
            let dem = Dem::from_fn(whole.rect(), |post| (!is_void(post)).then(|| whole.height(post)));
            let found = limit(&dem, 2000, &in_turn).unwrap().rms_m / all;
            assert!((found - share).abs() < 0.01, "{found}, expected {share}");
        }
        let small = Dem::from_rows(PostRect::new(Post::new(0, 0), Post::new(1, 1)), &[1, 2, 3, 4]);
        assert_eq!(limit(&small, 2, &in_turn), None);
    }
}
