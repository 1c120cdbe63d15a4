//! Trafficability: how much ground falls into which class of slope, and how much of it the TIN puts into another.
//!
//! A vehicle climbs by the grade, metres up for each metre ahead, so classes are bounded in per cent: 15, 30 and 45.
//! Ground that the TIN shows gentler than it is invites a route that is none; steeper, it closes one that is open.

use terrain::Metres;

use crate::PostHeights;

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
    use terrain::{Dem, PostRect};

    use super::*;

    const SPACING: Metres = Metres(25.0);

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
            let found = slope_classes(&plane, &plane, SPACING);
            assert_eq!((found.posts[class][class], found.total()), (38 * 20, 38 * 20), "{grade} %");
            assert_eq!((found.agreement(), found.shares_dem()[class]), (1.0, 1.0));
        }
    }

    #[test]
    fn ground_that_the_tin_flattens_is_told_apart_from_ground_it_steepens() {
        let dem = bands([10, 20, 35, 60].map(per_cent));
        // Across a step between bands the ground is steep on both.
        let found = slope_classes(&dem, &bands([10, 10, 60, 60].map(per_cent)), SPACING);
        assert!(found.posts[1][0] >= 8 * 20 && found.posts[2][3] >= 8 * 20, "{found:?}");
        assert!(found.posts[0][0] >= 8 * 20 && found.posts[3][3] >= 8 * 20, "{found:?}");
        assert!(0.2 < found.gentler() && 0.2 < found.steeper() && found.agreement() < 0.6, "{found:?}");
        let sum = found.shares_dem().iter().sum::<f64>() + found.shares_tin().iter().sum::<f64>();
        assert!((sum - 2.0).abs() < 1e-12);
        assert_eq!(SlopeClasses::default().agreement(), 1.0);
    }
}
