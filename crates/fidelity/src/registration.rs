//! Registration: does the TIN lie where the DEM does, or aside?
//!
//! Ground that is moved aside as a whole (a datum mistaken, posts taken for cells) is found by cross-correlation: the
//! TIN's heights at posts are moved under the DEM's until their slopes agree best. Slopes, not heights: those of large
//! forms agree nearly as well a few posts aside. Whole posts are tried on some of the posts first, then the best of
//! them and its neighbours on more; a paraboloid through these nine tells the rest.

use serde::Serialize;
use terrain::{Metres, QUANTA_PER_METRE};

use crate::PostHeights;

/// How far aside is looked, in posts, where the area is large enough.
pub const SHIFT_POSTS_MAX: i32 = 8;
/// About how many posts are looked at for each shift, first and then for the best and its neighbours.
const POSTS_LOOKED_AT: (usize, usize) = (60_000, 1_000_000);

/// Where the TIN lies against the DEM.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Registration {
    /// How far east of the DEM it lies, in metres.
    pub east_m: f64,
    /// How far north, in metres.
    pub north_m: f64,
    /// How far above, in metres: the mean of its heights less the DEM's, as they lie.
    pub up_m: f64,
    /// How well slopes agree as they lie: 1 where they are the same.
    pub correlation: f64,
    /// How well they agree at the best whole post.
    pub best_correlation: f64,
    /// Whether the best place is at the end of what is tried, so that the TIN may lie further aside.
    pub is_at_end: bool,
}

impl Registration {
    /// How far aside, in metres.
    pub fn aside_m(&self) -> f64 {
        self.east_m.hypot(self.north_m)
    }
}

/// Finds where the TIN lies against the DEM; `None` where the ground has no forms to tell, or the area is too small.
pub fn registration(dem: &PostHeights, tin: &PostHeights, spacing: Metres) -> Option<Registration> {
    let smallest = dem.wide().min(dem.high()) as i32;
    // The outermost posts have no slope; at least half of the posts stay in view.
    let reach = SHIFT_POSTS_MAX.min(smallest / 4 - 1);
    if reach < 1 {
        return None;
    }
    let both = Both { dem, tin, margin: reach as usize + 2 };
    let coarse = both.best_of(reach)?;
    let nine = both.nine_around(coarse)?;
    // A finer look may prefer a neighbour, but none so far away that its own neighbours leave the posts.
    let within = (0..9).filter(|&i| moved(coarse, i).iter().all(|posts| posts.abs() <= reach));
    let best = within.max_by(|&a, &b| nine[a].total_cmp(&nine[b])).map(|i| moved(coarse, i)).unwrap_or(coarse);
    let nine = if best == coarse { nine } else { both.nine_around(best)? };
    let [east, north] = top_of(&nine);
    let posts = dem.known().count().max(1) as f64;
    let up = dem.known().map(|index| tin.quanta()[index] - dem.quanta()[index]).sum::<f64>() / posts;
    Some(Registration {
        east_m: (f64::from(best[0]) + east) * spacing.0,
        north_m: (f64::from(best[1]) + north) * spacing.0,
        up_m: up / f64::from(QUANTA_PER_METRE),
        correlation: both.correlation([0, 0], both.step(POSTS_LOOKED_AT.1))?,
        best_correlation: nine[4],
        is_at_end: best.iter().any(|posts| reach <= posts.abs()),
    })
}

/// The neighbour of a shift by its number from 0 to 8, row by row from the south-west.
fn moved([east, north]: [i32; 2], number: usize) -> [i32; 2] {
    [east + number as i32 % 3 - 1, north + number as i32 / 3 - 1]
}

struct Both<'a> {
    dem: &'a PostHeights,
    tin: &'a PostHeights,
    /// Posts along the border that stay out of view, so that the same are compared at every shift.
    margin: usize,
}

impl Both<'_> {
    /// The shift in whole posts, east and north, at which slopes agree best; the shortest among equals.
    fn best_of(&self, reach: i32) -> Option<[i32; 2]> {
        let mut shifts: Vec<[i32; 2]> =
            (-reach..=reach).flat_map(|north| (-reach..=reach).map(move |east| [east, north])).collect();
        shifts.sort_by_key(|[east, north]| (east * east + north * north, *north, *east));
        let step = self.step(POSTS_LOOKED_AT.0);
        let mut best = None;
        for shift in shifts {
            let found = self.correlation(shift, step)?;
            if best.is_none_or(|(_, most)| most < found) {
                best = Some((shift, found));
            }
        }
        best.map(|(shift, _)| shift)
    }

    fn nine_around(&self, shift: [i32; 2]) -> Option<[f64; 9]> {
        let mut nine = [0.0; 9];
        for (number, found) in nine.iter_mut().enumerate() {
            *found = self.correlation(moved(shift, number), self.step(POSTS_LOOKED_AT.1))?;
        }
        Some(nine)
    }

    /// How many posts apart, both ways, so many posts of the area lie.
    fn step(&self, wanted: usize) -> usize {
        let posts = self.dem.quanta().len();
        (1..).find(|step| posts <= wanted * step * step).unwrap_or(1)
    }

    /// How well the slopes of the DEM agree with those of the TIN that lie `shift` further, on every `step`th post.
    fn correlation(&self, shift: [i32; 2], step: usize) -> Option<f64> {
        let wide = self.dem.wide();
        let (rows, cols) = (self.dem.high() - self.margin, wide - self.margin);
        let offset = shift[1] as isize * wide as isize + shift[0] as isize;
        let mut sums = Sums::default();
        for row in (self.margin..rows).step_by(step) {
            for col in (self.margin..cols).step_by(step) {
                let here = row * wide + col;
                let there = here.wrapping_add_signed(offset);
                if !self.is_near_void(here) && !self.is_near_void(there) {
                    sums.add(rise(self.dem, here), rise(self.tin, there));
                }
            }
        }
        sums.correlation()
    }

    fn is_near_void(&self, index: usize) -> bool {
        if !self.dem.has_voids() {
            return false;
        }
        let wide = self.dem.wide();
        [index, index - 1, index + 1, index - wide, index + wide].iter().any(|&index| self.dem.is_void(index))
    }
}

fn rise(posts: &PostHeights, index: usize) -> [f64; 2] {
    let (quanta, wide) = (posts.quanta(), posts.wide());
    [quanta[index + 1] - quanta[index - 1], quanta[index + wide] - quanta[index - wide]]
}

/// Sums over pairs of slopes.
#[derive(Default)]
struct Sums {
    count: f64,
    a: [f64; 2],
    b: [f64; 2],
    products: f64,
    a_squared: f64,
    b_squared: f64,
}

impl Sums {
    fn add(&mut self, a: [f64; 2], b: [f64; 2]) {
        self.count += 1.0;
        for k in 0..2 {
            self.a[k] += a[k];
            self.b[k] += b[k];
        }
        self.products += a[0] * b[0] + a[1] * b[1];
        self.a_squared += a[0] * a[0] + a[1] * a[1];
        self.b_squared += b[0] * b[0] + b[1] * b[1];
    }

    /// `None` where one of the two is a plane.
    fn correlation(&self) -> Option<f64> {
        let less_means = |sum: f64, a: [f64; 2], b: [f64; 2]| sum - (a[0] * b[0] + a[1] * b[1]) / self.count;
        let a = less_means(self.a_squared, self.a, self.a);
        let b = less_means(self.b_squared, self.b, self.b);
        // Sums of many squares leave so much where nothing should be left.
        const ROUNDING: f64 = 1e-9;
        let has_forms = ROUNDING * self.a_squared < a && ROUNDING * self.b_squared < b;
        (0.0 < self.count && has_forms).then(|| less_means(self.products, self.a, self.b) / (a * b).sqrt())
    }
}

/// Where the paraboloid nearest to nine values stands highest, at most a post away; the middle where it has no top.
fn top_of(nine: &[f64; 9]) -> [f64; 2] {
    let sum = |weight: &dyn Fn(f64, f64) -> f64| {
        (0..9).map(|i| weight((i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0) * nine[i]).sum::<f64>()
    };
    let (x, y) = (sum(&|x, _| x) / 6.0, sum(&|_, y| y) / 6.0);
    let (xx, yy) = (sum(&|x, _| x * x - 2.0 / 3.0), sum(&|_, y| y * y - 2.0 / 3.0));
    let xy = sum(&|x, y| x * y) / 4.0;
    // The slope of c + x u + y v + xx u u / 2 + yy v v / 2 + xy u v is level at its top.
    let det = xx * yy - xy * xy;
    if 0.0 <= xx || det <= 0.0 {
        return [0.0, 0.0];
    }
    [(y * xy - x * yy) / det, (x * xy - y * xx) / det].map(|posts| posts.clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use terrain::{Dem, PostRect};

    use super::*;

    const SPACING: Metres = Metres(30.0);

    /// Hills, moved east and north by some posts.
    fn hills(east: f64, north: f64) -> PostHeights {
        let dem = Dem::from_fn(PostRect::of_size(150, 170), |post| {
            let (x, y) = (f64::from(post.col) - east, f64::from(post.row) - north);
            let height = 40.0 * (x * 0.21).sin() * (y * 0.17 + x * 0.05).cos() + 25.0 * (x * 0.09 - y * 0.3).sin();
            Some((height * 128.0 + 20.0 * x).round() as i32)
        });
        PostHeights::of_dem(&dem, dem.rect())
    }

    #[test]
    fn a_copy_that_is_moved_is_found_where_it_lies() {
        let still = hills(0.0, 0.0);
        for (east, north) in [(0.0, 0.0), (3.0, -2.0), (-1.0, 5.0), (0.5, 0.0), (-0.25, 0.4), (2.3, -1.7)] {
            let found = registration(&still, &hills(east, north), SPACING).unwrap();
            let off = [found.east_m / 30.0 - east, found.north_m / 30.0 - north];
            assert!(off.iter().all(|off| off.abs() < 0.06), "moved by {east}, {north}: {found:?}");
            assert!(found.correlation <= found.best_correlation + 1e-12 && !found.is_at_end);
            let is_whole = east.fract() == 0.0 && north.fract() == 0.0;
            assert!(if is_whole { 0.9999 } else { 0.9 } < found.best_correlation, "{found:?}");
        }
        for (east, north) in [(9.0, 0.0), (-9.0, 0.0), (0.0, 9.0), (0.0, -9.0), (9.0, 9.0), (-9.0, -9.0)] {
            let far = registration(&still, &hills(east, north), SPACING).unwrap();
            assert!(far.is_at_end, "moved by {east}, {north}: {far:?}");
        }
    }

    #[test]
    fn a_copy_that_is_lifted_is_not_moved() {
        let still = hills(0.0, 0.0);
        let dem =
            Dem::from_fn(still.rect(), |post| Some(still.quanta()[(post.row * 170 + post.col) as usize] as i32 + 320));
        let found = registration(&still, &PostHeights::of_dem(&dem, dem.rect()), SPACING).unwrap();
        assert_eq!((found.up_m, found.correlation), (2.5, 1.0));
        assert!(found.aside_m() < 0.1 && (found.best_correlation - 1.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn a_plane_and_an_area_of_few_posts_tell_nothing() {
        let plane = |rows, cols| {
            let dem = Dem::from_fn(PostRect::of_size(rows, cols), |post| Some(57 * post.col - 10 * post.row));
            PostHeights::of_dem(&dem, dem.rect())
        };
        assert_eq!(registration(&plane(60, 60), &plane(60, 60), SPACING), None);
        let few = |height: i32| {
            let dem = Dem::from_fn(PostRect::of_size(7, 90), |post| Some(post.col * post.col * height));
            PostHeights::of_dem(&dem, dem.rect())
        };
        assert_eq!(registration(&few(3), &few(3), SPACING), None);
    }

    #[test]
    fn voids_are_not_looked_at() {
        let still = hills(0.0, 0.0);
        let moved = hills(2.0, 1.0);
        let mut holed = Dem::from_fn(still.rect(), |post| {
            let index = (post.row * 170 + post.col) as usize;
            (post.row % 40 != 3).then_some(still.quanta()[index] as i32)
        });
        holed.fill_voids(|post| 99_000 * (post.col % 2));
        let found = registration(&PostHeights::of_dem(&holed, holed.rect()), &moved, SPACING).unwrap();
        assert!((found.east_m - 60.0).abs() < 2.0 && (found.north_m - 30.0).abs() < 2.0, "{found:?}");
    }
}
