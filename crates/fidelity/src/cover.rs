//! Cover: can a vehicle hide where it can?
//!
//! A post lies in defilade when the straight line between a place on its one side and a place on the other, each at
//! most 100 m away, passes at least 2 m above it: both sides hide what is 2 m high there. Looked at along the four
//! lines through its eight neighbours, at posts. On a plane, however steep, and on a crest nothing is in defilade.

use terrain::{Metres, QUANTA_PER_METRE};

use crate::PostHeights;

/// How deep a fold is that hides a vehicle, in metres.
pub const DEFILADE_M: f64 = 2.0;
/// How far away its sides may stand, in metres.
pub const COVER_RANGE_M: f64 = 100.0;
/// Posts looked at on each side, at most: of finer grids, evenly spaced ones.
const LOOKS_MAX: usize = 10;
/// North and east along the four lines.
const LINES: [(i32, i32); 4] = [(0, 1), (1, 0), (1, 1), (1, -1)];

/// Posts by whether they lie in defilade on the DEM and on the TIN.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cover {
    /// On both.
    pub both: u64,
    /// On neither.
    pub neither: u64,
    /// On the TIN only: who hides there is seen.
    pub false_cover: u64,
    /// On the DEM only: the fold is lost.
    pub lost: u64,
}

impl Cover {
    /// Posts compared.
    pub fn posts(&self) -> u64 {
        self.both + self.neither + self.false_cover + self.lost
    }

    /// Share of the posts in defilade on the DEM.
    pub fn share_dem(&self) -> f64 {
        self.share(self.both + self.lost)
    }

    /// Share of the posts in defilade on the TIN.
    pub fn share_tin(&self) -> f64 {
        self.share(self.both + self.false_cover)
    }

    /// Share of the posts that are the same on both; 1 without posts.
    pub fn agreement(&self) -> f64 {
        1.0 - self.share(self.false_cover + self.lost)
    }

    /// Share of the posts in defilade on the DEM that are so on the TIN; 1 where the DEM has none.
    pub fn kept(&self) -> f64 {
        let folds = self.both + self.lost;
        if folds == 0 { 1.0 } else { self.both as f64 / folds as f64 }
    }

    fn share(&self, posts: u64) -> f64 {
        if self.posts() == 0 { 0.0 } else { posts as f64 / self.posts() as f64 }
    }
}

/// Which posts lie in defilade.
#[derive(Clone, Debug)]
pub struct Defilade {
    is_covered: Vec<bool>,
}

impl Defilade {
    /// Looks around every post.
    pub fn of(posts: &PostHeights, spacing: Metres) -> Self {
        let lines = LINES.map(|(north, east)| {
            let step_m = spacing.0 * f64::from(north * north + east * east).sqrt();
            (north, east, distances((COVER_RANGE_M / step_m) as usize))
        });
        let mut is_covered = vec![false; posts.quanta().len()];
        for index in posts.known() {
            is_covered[index] = lines.iter().any(|(north, east, away)| {
                let here = Here { posts, index, north: *north, east: *east };
                here.is_below_a_chord(away)
            });
        }
        Self { is_covered }
    }
}

/// Up to [`LOOKS_MAX`] distances in posts, the last one `farthest`.
fn distances(farthest: usize) -> Vec<usize> {
    let looks = farthest.min(LOOKS_MAX);
    (1..=looks).map(|look| (look * farthest).div_ceil(looks)).collect()
}

/// A post and a line through it.
struct Here<'a> {
    posts: &'a PostHeights,
    index: usize,
    north: i32,
    east: i32,
}

impl Here<'_> {
    fn is_below_a_chord(&self, away: &[usize]) -> bool {
        // Rise for each post along the line, on either side.
        let (mut ahead, mut behind) = ([(0.0, 0.0); LOOKS_MAX], [(0.0, 0.0); LOOKS_MAX]);
        let ahead = self.rises(1, away, &mut ahead);
        let behind = self.rises(-1, away, &mut behind);
        let deep = DEFILADE_M * f64::from(QUANTA_PER_METRE);
        ahead.iter().any(|&(a, rise_a)| behind.iter().any(|&(b, rise_b)| deep * (a + b) <= rise_a * b + rise_b * a))
    }

    /// Distances and how much higher the ground is there, as far as the area reaches and without voids.
    fn rises<'a>(&self, way: i32, away: &[usize], into: &'a mut [(f64, f64); LOOKS_MAX]) -> &'a [(f64, f64)] {
        let (wide, high) = (self.posts.wide() as i64, self.posts.high() as i64);
        let (row, col) = (self.index as i64 / wide, self.index as i64 % wide);
        let mut count = 0;
        for &distance in away {
            let (row, col) = (
                row + i64::from(way * self.north) * distance as i64,
                col + i64::from(way * self.east) * distance as i64,
            );
            let index = (row * wide + col) as usize;
            if row < 0 || high <= row || col < 0 || wide <= col || self.posts.is_void(index) {
                break;
            }
            into[count] = (distance as f64, self.posts.quanta()[index] - self.posts.quanta()[self.index]);
            count += 1;
        }
        &into[..count]
    }
}

/// Compares where there is cover on two surfaces over the same posts.
pub fn cover(posts: &PostHeights, dem: &Defilade, tin: &Defilade) -> Cover {
    let mut found = Cover::default();
    for index in posts.known() {
        let counted = match (dem.is_covered[index], tin.is_covered[index]) {
            (true, true) => &mut found.both,
            (false, false) => &mut found.neither,
            (false, true) => &mut found.false_cover,
            (true, false) => &mut found.lost,
        };
        *counted += 1;
    }
    found
}

#[cfg(test)]
mod tests {
    use terrain::{Dem, Post, PostRect};

    use super::*;

    const SPACING: Metres = Metres(25.0);

    fn posts(height: impl Fn(Post) -> i32) -> PostHeights {
        let dem = Dem::from_fn(PostRect::of_size(30, 40), |post| Some(height(post)));
        PostHeights::of_dem(&dem, dem.rect())
    }

    fn covered(posts: &PostHeights, spacing: Metres) -> Vec<Post> {
        let found = Defilade::of(posts, spacing);
        (0..1200).filter(|&i| found.is_covered[i]).map(|i| Post::new(i as i32 / 40, i as i32 % 40)).collect()
    }

    fn between(dem: &PostHeights, tin: &PostHeights) -> Cover {
        cover(dem, &Defilade::of(dem, SPACING), &Defilade::of(tin, SPACING))
    }

    #[test]
    fn a_plane_a_cone_and_a_ridge_hide_nothing() {
        for ground in [
            posts(|post| 900 * post.col - 400 * post.row),
            posts(|post| -200 * (post.col - 20).abs().max((post.row - 15).abs())),
            posts(|post| -300 * (post.col - 20).abs()),
        ] {
            assert_eq!(covered(&ground, SPACING), []);
        }
    }

    #[test]
    fn a_fold_of_two_metres_hides_and_a_shallower_one_does_not() {
        let fold = |deep: i32| posts(move |post| 500 * post.row - if post.col == 20 { deep } else { 0 });
        // Along the diagonals too the ends of the row lack one side only.
        let expected: Vec<Post> = (0..30).map(|row| Post::new(row, 20)).collect();
        assert_eq!(covered(&fold(256), SPACING), expected);
        assert_eq!(covered(&fold(255), SPACING), []);
    }

    #[test]
    fn the_foot_of_a_step_is_hidden_as_far_as_its_chords_reach() {
        // 4 m high between columns 19 and 20. Chords over the foot run from four posts behind to the top one to four
        // posts ahead, so they pass 4 * 4 / (4 + 1) = 3.2 m above column 19, and 4 * 4 / (4 + 4) = 2 m above column 16.
        let step = posts(|post| if post.col < 20 { 0 } else { 512 });
        let row: Vec<i32> = covered(&step, SPACING).iter().filter(|p| p.row == 15).map(|p| p.col).collect();
        assert_eq!(row, [16, 17, 18, 19]);
        // Of posts 60 m apart only the neighbours are near enough.
        let row: Vec<i32> = covered(&step, Metres(60.0)).iter().filter(|p| p.row == 15).map(|p| p.col).collect();
        assert_eq!(row, [19]);
        assert_eq!(covered(&step, Metres(101.0)), []);
    }

    #[test]
    fn folds_that_the_tin_fills_or_invents_are_told_apart() {
        let fold = |at: i32| posts(move |post| if post.col == at { -300 } else { 0 });
        let same = between(&fold(20), &fold(20));
        assert_eq!((same.agreement(), same.kept(), same.both), (1.0, 1.0, 30));
        let moved = between(&fold(20), &fold(22));
        assert_eq!((moved.lost, moved.false_cover, moved.both, moved.kept()), (30, 30, 0, 0.0));
        assert_eq!((moved.share_dem(), moved.share_tin()), (0.025, 0.025));
        assert_eq!(Cover::default().agreement(), 1.0);
    }

    #[test]
    fn fine_grids_are_looked_at_in_ten_even_steps() {
        assert_eq!(distances(4), [1, 2, 3, 4]);
        assert_eq!(distances(25), [3, 5, 8, 10, 13, 15, 18, 20, 23, 25]);
        assert!(distances(0).is_empty());
    }
}
