//! Slope: does the ground fall as steeply, and the same way, on the TIN as on the DEM?
//!
//! Both are asked in one way: central differences over the two neighbouring posts each way, of DEM heights and of
//! the TIN's heights at the same posts. So a TIN through every post differs nowhere, and a fold of the TIN between
//! two posts does not count as a slope of its own. Posts on the border have no differences; those that are void, or
//! next to a void, are left out. Angles are figures to read and decide nothing, so their last bits may differ
//! between machines.
//!
//! Trafficability: how much ground falls into which class of slope, and how much of it the TIN puts into another. A
//! vehicle climbs by the grade, metres up for each metre ahead, so classes are bounded in per cent: 15, 30 and 45.
//! Ground that the TIN shows gentler than it is invites a route that is none; steeper, it closes one that is open.

use serde::Serialize;
use terrain::Metres;

use crate::PostHeights;

/// Bins in a degree: how fine a percentile of angles is told.
const BINS_PER_DEGREE: f64 = 1000.0;

/// How slopes differ, in degrees, over the inner posts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SlopeDifference {
    /// Posts compared.
    pub posts: u64,
    /// Root mean square of the difference in steepness; 0 without posts.
    pub rms_degrees: f64,
    /// Mean angle between the normals.
    pub normal_mean_degrees: f64,
    /// The angle that 95 % of the normals do not exceed, at most 0.001 too large.
    pub normal_p95_degrees: f64,
}

/// Compares the slopes of the TIN with those of the DEM at the inner posts.
pub fn slope(dem: &PostHeights, tin: &PostHeights, spacing: Metres) -> SlopeDifference {
    let mut sums = Sums::new();
    for index in dem.inner() {
        sums.add(dem.gradient(index, spacing), tin.gradient(index, spacing));
    }
    sums.figures()
}

/// Sums over the posts, in the order of posts.
struct Sums {
    posts: u64,
    squared: f64,
    between: f64,
    /// Posts by the angle between normals.
    bins: Vec<u64>,
}

impl Sums {
    fn new() -> Self {
        Self { posts: 0, squared: 0.0, between: 0.0, bins: vec![0; (180.0 * BINS_PER_DEGREE) as usize + 1] }
    }

    /// Counts a post by its two gradients, metres up for each metre east and north.
    fn add(&mut self, dem: [f64; 2], tin: [f64; 2]) {
        let steepness = |[x, y]: [f64; 2]| (x * x + y * y).sqrt().atan().to_degrees();
        let difference = steepness(dem) - steepness(tin);
        let between = angle_between(dem, tin);
        self.posts += 1;
        self.squared += difference * difference;
        self.between += between;
        self.bins[(between * BINS_PER_DEGREE).ceil() as usize] += 1;
    }

    fn figures(&self) -> SlopeDifference {
        if self.posts == 0 {
            return SlopeDifference::default();
        }
        let rank = (self.posts * 95).div_ceil(100);
        let mut below = 0;
        let reached = self.bins.iter().position(|&posts| {
            below += posts;
            rank <= below
        });
        let posts = self.posts as f64;
        SlopeDifference {
            posts: self.posts,
            rms_degrees: (self.squared / posts).sqrt(),
            normal_mean_degrees: self.between / posts,
            normal_p95_degrees: reached.map_or(0.0, |bin| bin as f64 / BINS_PER_DEGREE),
        }
    }
}

/// Angle between the normals (-x, -y, 1) of two gradients, in degrees.
fn angle_between([ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> f64 {
    let (x, y, z) = (by - ay, ax - bx, ax * by - ay * bx);
    (x * x + y * y + z * z).sqrt().atan2(ax * bx + ay * by + 1.0).to_degrees()
}

/// Where one class of slope ends and the next begins, in metres up for each metre ahead.
pub const GRADES: [f64; 3] = [0.15, 0.30, 0.45];
/// Classes of slope.
const CLASSES: usize = GRADES.len() + 1;

/// Inner posts by their class of slope on the DEM, then on the TIN; the gentlest class comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlopeClasses {
    /// `posts[a][b]` are of class `a` on the DEM and of class `b` on the TIN.
    pub posts: [[u64; CLASSES]; CLASSES],
}

impl SlopeClasses {
    /// Posts compared.
    pub fn total(&self) -> u64 {
        self.posts.iter().flatten().sum()
    }

    /// Share of the posts whose class is the same on both; 1 without posts.
    pub fn agreement(&self) -> f64 {
        1.0 - self.gentler() - self.steeper()
    }

    /// Share of the posts that the TIN shows in a gentler class than the DEM.
    pub fn gentler(&self) -> f64 {
        self.share(|dem, tin| tin < dem)
    }

    /// Share of the posts that the TIN shows in a steeper class than the DEM.
    pub fn steeper(&self) -> f64 {
        self.share(|dem, tin| dem < tin)
    }

    /// Share of the posts of each class on the DEM.
    pub fn shares_dem(&self) -> [f64; CLASSES] {
        std::array::from_fn(|class| self.share(|dem, _| dem == class))
    }

    /// Share of the posts of each class on the TIN.
    pub fn shares_tin(&self) -> [f64; CLASSES] {
        std::array::from_fn(|class| self.share(|_, tin| tin == class))
    }

    fn share(&self, is_counted: impl Fn(usize, usize) -> bool) -> f64 {
        let mut counted = 0;
        for (dem, row) in self.posts.iter().enumerate() {
            counted += row.iter().enumerate().filter(|&(tin, _)| is_counted(dem, tin)).map(|(_, n)| n).sum::<u64>();
        }
        if self.total() == 0 { 0.0 } else { counted as f64 / self.total() as f64 }
    }
}

/// Compares the classes of slope at the inner posts.
pub fn slope_classes(dem: &PostHeights, tin: &PostHeights, spacing: Metres) -> SlopeClasses {
    let mut found = SlopeClasses::default();
    for index in dem.inner() {
        let class = |heights: &PostHeights| class_of(heights.gradient(index, spacing));
        found.posts[class(dem)][class(tin)] += 1;
    }
    found
}

fn class_of([east, north]: [f64; 2]) -> usize {
    let grade_squared = east * east + north * north;
    GRADES.iter().filter(|&grade| grade * grade <= grade_squared).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Triangles;
    use crate::scene::{full_tin, height_by_search, random_tin};
    use terrain::{Dem, Post, PostRect};

    const SPACING: Metres = Metres(25.0);

    fn rect() -> PostRect {
        PostRect::new(Post::new(-3, 4), Post::new(30, 47))
    }

    fn against(dem: &Dem, tin: &terrain::Tin) -> SlopeDifference {
        let posts = PostHeights::of_dem(dem, tin.rect);
        slope(&posts, &PostHeights::of_triangles(&Triangles::of_tin(tin), &posts), SPACING)
    }

    #[test]
    fn a_tin_through_every_post_differs_nowhere() {
        let dem = Dem::from_fn(rect(), |post| Some(post.row * post.row * 50 - post.col * 77));
        let found = against(&dem, &full_tin(&dem));
        assert_eq!(found, SlopeDifference { posts: 32 * 42, ..SlopeDifference::default() });
    }

    #[test]
    fn a_flat_tin_under_a_ramp_differs_by_the_angle_of_the_ramp() {
        // 25 m up for each 25 m east: 45 degrees.
        let dem = Dem::from_fn(rect(), |post| Some(post.col * 25 * 128));
        let flat = Dem::from_fn(rect(), |_| Some(5));
        let found = against(&dem, &full_tin(&flat));
        for degrees in [found.rms_degrees, found.normal_mean_degrees, found.normal_p95_degrees] {
            assert!((degrees - 45.0).abs() < 0.0011, "{found:?}");
        }
        // As steep, but the other way: steepness agrees, normals stand at a right angle.
        let back = Dem::from_fn(rect(), |post| Some(-post.col * 25 * 128));
        let found = against(&dem, &full_tin(&back));
        assert!(found.rms_degrees < 1e-9 && (found.normal_mean_degrees - 90.0).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn posts_at_voids_are_left_out() {
        let dem = Dem::from_fn(rect(), |post| (post != Post::new(10, 20)).then_some(0));
        let tin = random_tin(rect(), 40, |_, _| 0, 1);
        let found = against(&dem, &tin);
        assert_eq!((found.posts, found.rms_degrees), (32 * 42 - 5, 0.0));
        let line = Dem::from_fn(PostRect::of_size(2, 9), |_| Some(0));
        assert_eq!(against(&line, &full_tin(&line)), SlopeDifference::default());
    }

    #[test]
    fn figures_equal_those_of_one_post_after_another() {
        for seed in 0..6 {
            let tin = random_tin(rect(), 10 << seed, |_, dice| dice.below(3000), seed);
            // A wider window than the TIN covers.
            let dem = Dem::from_fn(rect().grown(2), |post| Some((post.row * 31 + post.col * 17) % 101 * 20));
            let steepness = |[x, y]: [f64; 2]| x.hypot(y).atan().to_degrees();
            let (mut squares, mut angles) = (0.0, Vec::new());
            for row in rect().south + 1..rect().north {
                for col in rect().west + 1..rect().east {
                    let gradient = |height: &dyn Fn(i32, i32) -> f64| {
                        [height(0, 1) - height(0, -1), height(1, 0) - height(-1, 0)].map(|rise| rise / 6400.0)
                    };
                    let a = gradient(&|up, right| f64::from(dem.height(Post::new(row + up, col + right))));
                    let b =
                        gradient(&|up, right| height_by_search(&tin, [f64::from(col + right), f64::from(row + up)]));
                    squares += (steepness(a) - steepness(b)).powi(2);
                    let lengths = (1.0 + a[0] * a[0] + a[1] * a[1]).sqrt() * (1.0 + b[0] * b[0] + b[1] * b[1]).sqrt();
                    angles.push(((1.0 + a[0] * b[0] + a[1] * b[1]) / lengths).acos().to_degrees());
                }
            }
            angles.sort_by(f64::total_cmp);
            let posts = angles.len();
            let expected = [
                (squares / posts as f64).sqrt(),
                angles.iter().sum::<f64>() / posts as f64,
                angles[(posts * 95).div_ceil(100) - 1],
            ];
            let found = against(&dem, &tin);
            let figures = [found.rms_degrees, found.normal_mean_degrees, found.normal_p95_degrees];
            let agree = figures.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 0.0011);
            assert!(agree && found.posts == posts as u64, "seed {seed}: {found:?}, expected {expected:?}");
        }
    }

    const SPACING_OF_GRADES: Metres = Metres(25.0);

    /// Ground that rises by these quanta a post, one band of 10 rows after another.
    fn bands(rises: [i32; 4]) -> PostHeights {
        let dem = Dem::from_fn(PostRect::of_size(40, 22), |post| Some(rises[post.row as usize / 10] * post.col));
        PostHeights::of_dem(&dem, dem.rect())
    }

    fn per_cent(grade: i32) -> i32 {
        25 * 128 * grade / 100
    }

    #[test]
    fn a_plane_of_each_class_is_counted_there() {
        for (grade, class) in [(0, 0), (14, 0), (16, 1), (29, 1), (31, 2), (44, 2), (46, 3), (200, 3)] {
            let plane = bands([per_cent(grade); 4]);
            let found = slope_classes(&plane, &plane, SPACING_OF_GRADES);
            assert_eq!((found.posts[class][class], found.total()), (38 * 20, 38 * 20), "{grade} %");
            assert_eq!((found.agreement(), found.shares_dem()[class]), (1.0, 1.0));
        }
    }

    #[test]
    fn ground_that_the_tin_flattens_is_told_apart_from_ground_it_steepens() {
        let dem = bands([10, 20, 35, 60].map(per_cent));
        // Across a step between bands the ground is steep on both.
        let found = slope_classes(&dem, &bands([10, 10, 60, 60].map(per_cent)), SPACING_OF_GRADES);
        assert!(found.posts[1][0] >= 8 * 20 && found.posts[2][3] >= 8 * 20, "{found:?}");
        assert!(found.posts[0][0] >= 8 * 20 && found.posts[3][3] >= 8 * 20, "{found:?}");
        assert!(0.2 < found.gentler() && 0.2 < found.steeper() && found.agreement() < 0.6, "{found:?}");
        let sum = found.shares_dem().iter().sum::<f64>() + found.shares_tin().iter().sum::<f64>();
        assert!((sum - 2.0).abs() < 1e-12);
        assert_eq!(SlopeClasses::default().agreement(), 1.0);
    }
}
