//! Line of sight: of two vehicles, does one see the other on the TIN when it does on the DEM?
//!
//! Pairs are drawn at random: the first place anywhere in the area, the second in any direction and at any range
//! of a few kilometres, both inside. Eyes stand above each ground by itself: those of the TIN on the TIN. The DEM
//! is bilinear between posts and looked at every half post; the TIN is looked at where an edge is crossed, which
//! misses nothing. So a TIN through every post is not perfect either: on the real desert it agrees for 99.3 % of
//! pairs, and what it hides beyond the DEM lies between two looks or in the warp of a cell.
//!
//! Only `+ - * /` and square roots in a fixed order decide, so counts are the same on every machine.
//!
//! What looks drawn is the same everywhere: SplitMix64 (Steele, Lea and Flood 2014), started anew for each pair from
//! the seed and the pair's number, so that no pair depends on another.

use terrain::{Dem, Metres, Post, PostRect, QUANTA_PER_METRE};

use crate::triangles::Triangles;

/// Height of eyes and targets above the ground, in metres: a tank's.
pub const EYE_M: f64 = 2.5;
/// Nearest and farthest target, in metres.
pub const RANGE_M: (f64, f64) = (200.0, 4000.0);

/// How often the two grounds agreed on what is seen: pairs of places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineOfSight {
    /// Seen on both.
    pub visible: u64,
    /// Hidden on both.
    pub hidden: u64,
    /// Seen on the TIN only.
    pub false_visible: u64,
    /// Seen on the DEM only.
    pub false_hidden: u64,
    /// In no figure: pairs whose line lies over voids of the DEM, or that fit nowhere into the area.
    pub left_out: u64,
}

impl LineOfSight {
    /// Pairs that were compared.
    pub fn pairs(&self) -> u64 {
        self.visible + self.hidden + self.false_visible + self.false_hidden
    }

    /// Share of pairs on which DEM and TIN agree; 1 without pairs.
    pub fn agreement(&self) -> f64 {
        1.0 - self.false_visible_share() - self.false_hidden_share()
    }

    /// Share of all pairs that only the TIN shows.
    pub fn false_visible_share(&self) -> f64 {
        self.share(self.false_visible)
    }

    /// Share of all pairs that only the DEM shows.
    pub fn false_hidden_share(&self) -> f64 {
        self.share(self.false_hidden)
    }

    /// Share of pairs seen on the DEM.
    pub fn visible_share_dem(&self) -> f64 {
        self.share(self.visible + self.false_hidden)
    }

    /// Share of pairs seen on the TIN.
    pub fn visible_share_tin(&self) -> f64 {
        self.share(self.visible + self.false_visible)
    }

    /// How far, either way, the agreement of all possible pairs may lie from that of these (95 %).
    ///
    /// Two pairs that agree and two that do not are added, so that perfect agreement does not look certain
    /// (Agresti and Coull 1998).
    pub fn half_width(&self) -> f64 {
        const DEVIATIONS: f64 = 1.96;
        let pairs = self.pairs() as f64 + 4.0;
        let agreement = ((self.visible + self.hidden) as f64 + 2.0) / pairs;
        DEVIATIONS * (agreement * (1.0 - agreement) / pairs).sqrt()
    }

    fn share(&self, pairs: u64) -> f64 {
        if self.pairs() == 0 { 0.0 } else { pairs as f64 / self.pairs() as f64 }
    }
}

/// Draws `pairs` pairs of places from `seed` and compares what is seen on the DEM with what is seen on the TIN.
///
/// # Panics
/// When the DEM does not hold all posts of the triangles.
pub fn line_of_sight(dem: &Dem, triangles: &Triangles, spacing: Metres, pairs: u32, seed: u64) -> LineOfSight {
    let rect = triangles.rect();
    assert!(dem.rect().contains_rect(&rect), "the DEM holds the ground of the triangles");
    let samples = DemSamples::new(dem);
    let mut found = LineOfSight::default();
    for pair in drawn_pairs(rect, spacing, pairs, seed) {
        match pair.filter(|&pair| dem.void_count() == 0 || !touches_void(&samples, pair)) {
            Some(pair) => *found.count(sees(&samples, pair), sees_on(triangles, pair)) += 1,
            None => found.left_out += 1,
        }
    }
    found
}

impl LineOfSight {
    fn count(&mut self, on_dem: bool, on_tin: bool) -> &mut u64 {
        match (on_dem, on_tin) {
            (true, true) => &mut self.visible,
            (false, false) => &mut self.hidden,
            (false, true) => &mut self.false_visible,
            (true, false) => &mut self.false_hidden,
        }
    }
}

/// Two places, east and north in posts.
pub type Pair = [[f64; 2]; 2];

/// So many pairs inside `rect`, whose posts are so far apart: east and north in posts; `None` where none was found.
pub fn drawn_pairs(rect: PostRect, spacing: Metres, pairs: u32, seed: u64) -> impl Iterator<Item = Option<Pair>> {
    (0..pairs).map(move |index| draw_pair(rect, spacing, Draw::new(seed, u64::from(index))))
}

/// A pair inside `rect`; `None` where none was found.
fn draw_pair(rect: PostRect, spacing: Metres, mut draw: Draw) -> Option<Pair> {
    let size = [rect.cells_wide() as f64, rect.cells_high() as f64];
    let pair = draw.pair(size, [RANGE_M.0, RANGE_M.1].map(|range_m| range_m / spacing.0))?;
    Some(pair.map(|[x, y]| [x + f64::from(rect.west), y + f64::from(rect.south)]))
}

/// Places along a pair's line at most half a post apart, with the share of the way; both ends are among them.
fn steps([from, to]: Pair) -> impl Iterator<Item = (f64, [f64; 2])> {
    const STEPS_PER_POST: f64 = 2.0;
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let count = ((dx * dx + dy * dy).sqrt() * STEPS_PER_POST).ceil().max(1.0);
    (0..=count as u32).map(move |step| {
        let share = f64::from(step) / count;
        (share, [from[0] + share * dx, from[1] + share * dy])
    })
}

fn touches_void(samples: &DemSamples, pair: Pair) -> bool {
    steps(pair).any(|(_, place)| samples.is_void(place))
}

/// An eye, or a target, above the ground at `place`; heights are in quanta.
fn above(place: [f64; 2], ground: f64) -> [f64; 3] {
    [place[0], place[1], ground + EYE_M * f64::from(QUANTA_PER_METRE)]
}

/// Whether the second place of a pair is seen from the first on the DEM.
fn sees(samples: &DemSamples, pair: Pair) -> bool {
    let [eye, target] = pair.map(|place| above(place, samples.height(place)));
    steps(pair).all(|(share, place)| samples.height(place) <= eye[2] + share * (target[2] - eye[2]))
}

/// Whether the second place of a pair, east and north in posts, is seen from the first on the triangles, both
/// [`EYE_M`] above them.
pub fn sees_on(triangles: &Triangles, pair: [[f64; 2]; 2]) -> bool {
    let [eye, target] = pair.map(|place| above(place, triangles.height_at(place)));
    !triangles.hide(eye, target)
}

/// The fraction of the golden ratio, as an odd number: how far SplitMix64 steps.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// How often a pair that leaves the area is drawn again before it is left out.
const DRAWS_MAX: u32 = 1000;

/// The numbers of one pair, or of one place.
pub struct Draw(u64);

impl Draw {
    /// The numbers of a pair.
    pub fn new(seed: u64, index: u64) -> Self {
        Self(mix(seed ^ mix(index.wrapping_add(STEP))))
    }

    /// At least 0 and below 1, in steps of 2^-53.
    pub fn unit(&mut self) -> f64 {
        const STEPS: f64 = (1_u64 << 53) as f64;
        self.0 = self.0.wrapping_add(STEP);
        (mix(self.0) >> 11) as f64 / STEPS
    }

    /// A place of a rectangle from 0 to its size, each as likely as any other: east, then north.
    pub fn place(&mut self, [wide, high]: [f64; 2]) -> [f64; 2] {
        [wide * self.unit(), high * self.unit()]
    }

    /// Two places of a rectangle from 0 to its size: the first anywhere, the second in any direction from it and at any
    /// distance from `nearest` to `farthest`. `None` where none was found.
    pub fn pair(&mut self, [wide, high]: [f64; 2], [nearest, farthest]: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        // Nothing farther than the diagonal fits, so leaving it out changes no chance, only how often we draw.
        let farthest = farthest.min((wide * wide + high * high).sqrt());
        if farthest < nearest {
            return None;
        }
        (0..DRAWS_MAX).find_map(|_| {
            let [x, y] = self.place([wide, high]);
            let [east, north] = self.direction();
            let range = nearest + (farthest - nearest) * self.unit();
            let (to_x, to_y) = (x + range * east, y + range * north);
            let is_inside = 0.0 <= to_x && to_x <= wide && 0.0 <= to_y && to_y <= high;
            is_inside.then_some([[x, y], [to_x, to_y]])
        })
    }

    /// A direction, each as likely as any other: a point of the disc, moved to its rim. East, then north.
    fn direction(&mut self) -> [f64; 2] {
        /// Squared radius below which rounding would bend the direction.
        const HUB: f64 = 1e-6;
        loop {
            let [x, y] = [2.0 * self.unit() - 1.0, 2.0 * self.unit() - 1.0];
            let squared = x * x + y * y;
            if HUB < squared && squared <= 1.0 {
                // A square root is exact to the last bit on every machine; a sine is not.
                let length = squared.sqrt();
                return [x / length, y / length];
            }
        }
    }
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A DEM that can be asked for heights at any place.
struct DemSamples<'a> {
    dem: &'a Dem,
    rect: PostRect,
    heights: &'a [i32],
    stride: usize,
}

impl<'a> DemSamples<'a> {
    pub fn new(dem: &'a Dem) -> Self {
        let (heights, stride) = dem.padded();
        Self { dem, rect: dem.rect(), heights, stride }
    }

    /// Height at a place (east and north in posts, inside the window), in quanta.
    pub fn height(&self, place: [f64; 2]) -> f64 {
        let ([col, row], [x, y]) = self.cell(place);
        let south = row * self.stride + col;
        let height = |index: usize| f64::from(self.heights[index]);
        let along = |west: f64, east: f64| west + x * (east - west);
        let low = along(height(south), height(south + 1));
        let high = along(height(south + self.stride), height(south + self.stride + 1));
        low + y * (high - low)
    }

    /// Whether a post that the height at a place depends on is void.
    pub fn is_void(&self, place: [f64; 2]) -> bool {
        let ([col, row], _) = self.cell(place);
        let post = |up: usize, right: usize| {
            Post::new(self.rect.south + (row + up) as i32, self.rect.west + (col + right) as i32)
        };
        [post(0, 0), post(0, 1), post(1, 0), post(1, 1)].into_iter().any(|post| self.dem.is_void(post))
    }

    /// The cell a place lies in, column first from the south-west, and where in it. A window without cells has no
    /// places to ask for.
    fn cell(&self, place: [f64; 2]) -> ([usize; 2], [f64; 2]) {
        let axis = |at: f64, first: i32, cells: usize| {
            let at = at - f64::from(first);
            let cell = (at.max(0.0) as usize).min(cells - 1);
            (cell, at - cell as f64)
        };
        let (col, x) = axis(place[0], self.rect.west, self.rect.cells_wide());
        let (row, y) = axis(place[1], self.rect.south, self.rect.cells_high());
        ([col, row], [x, y])
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::{full_tin, random_tin};
    use terrain::{Post, PostRect};

    use super::*;

    const SPACING: Metres = Metres(25.0);

    fn dem(height: impl Fn(Post) -> Option<i32>) -> Dem {
        Dem::from_fn(PostRect::new(Post::new(5, -40), Post::new(205, 160)), height)
    }

    #[track_caller]
    fn check(dem: &Dem, tin: &terrain::Tin, expected: impl Fn(&LineOfSight) -> bool) -> LineOfSight {
        let found = line_of_sight(dem, &Triangles::of_tin(tin), SPACING, 4000, 1);
        assert_eq!(found.pairs() + found.left_out, 4000);
        assert!(expected(&found), "{found:?}");
        found
    }

    #[test]
    fn on_flat_ground_everything_is_seen() {
        let flat = dem(|_| Some(77));
        let tin = random_tin(flat.rect(), 300, |_, _| 77, 3);
        let found = check(&flat, &tin, |found| found.visible == 4000);
        assert_eq!((found.agreement(), found.visible_share_dem(), found.visible_share_tin()), (1.0, 1.0, 1.0));
        assert!(0.0 < found.half_width() && found.half_width() < 0.001);
    }

    #[test]
    fn a_wall_that_the_tin_lacks_is_false_visible_and_the_other_way_round() {
        let wall = dem(|post| Some(if post.col == 60 { 100_000 } else { 0 }));
        let flat = dem(|_| Some(0));
        let lacking = random_tin(flat.rect(), 300, |_, _| 0, 3);
        let lost = check(&wall, &lacking, |found| found.hidden == 0 && found.false_hidden == 0);
        // A third of the pairs or so cross the middle of 5 km at ranges of up to 4 km.
        assert!((0.2..0.5).contains(&lost.false_visible_share()), "{lost:?}");
        let gained = check(&flat, &full_tin(&wall), |found| found.hidden == 0 && found.false_visible == 0);
        assert_eq!(gained.false_hidden_share(), 1.0 - gained.visible_share_tin());
        // An eye on the wall's own slope may look past its top between two steps on the DEM, never on the TIN.
        assert!((lost.false_visible..lost.false_visible + 20).contains(&gained.false_hidden), "{gained:?}");
        let both = check(&wall, &full_tin(&wall), |found| found.false_visible == 0 && found.false_hidden < 20);
        assert_eq!(both.hidden, lost.false_visible);
    }

    #[test]
    fn a_tin_through_every_post_agrees_but_for_the_warp_inside_cells() {
        let hills = dem(|post| Some(((post.row % 37 - 18) * (post.col % 29 - 14)) * 30));
        let found = check(&hills, &full_tin(&hills), |found| 0.97 < found.agreement());
        assert!((0.05..0.95).contains(&found.visible_share_dem()), "{found:?}");
    }

    #[test]
    fn counts_are_the_same_on_every_machine() {
        let hills = dem(|post| Some(((post.row % 37 - 18) * (post.col % 29 - 14)) * 30));
        let tin = random_tin(hills.rect(), 900, |at, _| hills.height(Post::new(at.row / 8, at.col / 8)), 11);
        let counted = LineOfSight { visible: 279, hidden: 3230, false_visible: 246, false_hidden: 245, left_out: 0 };
        check(&hills, &tin, |found| *found == counted);
    }

    #[test]
    fn pairs_over_voids_are_left_out_and_the_others_stay_the_same() {
        let height = |post: Post| ((post.row % 37 - 18) * (post.col % 29 - 14)) * 30;
        let whole = dem(|post| Some(height(post)));
        let tin = random_tin(whole.rect(), 500, |at, _| height(Post::new(at.row / 8, at.col / 8)), 8);
        let mut holed = dem(|post| (post != Post::new(100, 60)).then(|| height(post)));
        holed.fill_voids(height);
        let with = check(&whole, &tin, |found| found.left_out == 0);
        let without = check(&holed, &tin, |found| 0 < found.left_out && found.left_out < 400);
        assert!(without.visible <= with.visible && without.hidden <= with.hidden);
        let nothing = dem(|_| None);
        let none = check(&nothing, &tin, |found| found.left_out == 4000);
        assert_eq!((none.pairs(), none.agreement(), none.visible_share_dem()), (0, 1.0, 0.0));
    }

    #[test]
    fn pairs_lie_inside_and_at_ranges_that_matter() {
        let rect = PostRect::new(Post::new(5, -40), Post::new(205, 160));
        let mut longest: f64 = 0.0;
        for index in 0..2000 {
            let [from, to] = draw_pair(rect, SPACING, Draw::new(5, index)).unwrap();
            for [x, y] in [from, to] {
                assert!(-40.0 <= x && x <= 160.0 && 5.0 <= y && y <= 205.0);
            }
            let range = ((to[0] - from[0]).powi(2) + (to[1] - from[1]).powi(2)).sqrt() * 25.0;
            assert!(200.0 - 1e-6 <= range && range <= 4000.0 + 1e-6);
            longest = longest.max(range);
        }
        assert!(3900.0 < longest);
    }

    #[test]
    fn an_area_without_room_for_a_pair_leaves_all_out() {
        // A diagonal of 198 m.
        let small = Dem::from_fn(PostRect::of_size(6, 7), |_| Some(0));
        let found = line_of_sight(&small, &Triangles::of_tin(&full_tin(&small)), SPACING, 9, 1);
        assert_eq!(found, LineOfSight { left_out: 9, ..LineOfSight::default() });
    }

    #[test]
    fn steps_hold_both_ends_and_are_half_a_post_at_most() {
        let places: Vec<_> = steps([[0.0, 0.0], [3.0, 4.0]]).collect();
        assert_eq!(places.len(), 11);
        assert_eq!((places[0], places[10]), ((0.0, [0.0, 0.0]), (1.0, [3.0, 4.0])));
        assert_eq!(steps([[0.0, 0.0], [0.0, 10.1]]).count(), 22);
    }

    #[test]
    fn numbers_of_a_pair_depend_on_seed_and_number_alone() {
        let first = |seed, index| Draw::new(seed, index).unit();
        assert_eq!(first(3, 7), first(3, 7));
        assert!(first(3, 7) != first(3, 8) && first(3, 7) != first(4, 7) && first(3, 7) != first(7, 3));
        // A change of this changes every published figure.
        assert_eq!(Draw::new(1, 0).unit().to_bits(), UNIT_OF_FIRST_PAIR);
    }

    const UNIT_OF_FIRST_PAIR: u64 = 4_602_881_968_005_306_593;

    #[test]
    fn units_and_directions_are_spread_evenly() {
        let (mut tenths, mut octants) = ([0_u32; 10], [0_u32; 8]);
        for index in 0..80_000 {
            let mut draw = Draw::new(9, index);
            tenths[(draw.unit() * 10.0) as usize] += 1;
            let [x, y] = draw.direction();
            assert!((x * x + y * y - 1.0).abs() < 1e-14);
            let octant = usize::from(x < 0.0) + 2 * usize::from(y < 0.0) + 4 * usize::from(x.abs() < y.abs());
            octants[octant] += 1;
        }
        // Six standard deviations.
        assert!(tenths.iter().all(|&count| count.abs_diff(8000) < 510), "{tenths:?}");
        assert!(octants.iter().all(|&count| count.abs_diff(10_000) < 562), "{octants:?}");
    }

    #[test]
    fn heights_are_those_of_posts_and_weighted_between_them() {
        let rect = PostRect::new(Post::new(10, -3), Post::new(12, 0));
        let dem = Dem::from_fn(rect, |post| Some(post.row * post.row * 10 + post.col * 100));
        let samples = DemSamples::new(&dem);
        for row in 10..=12 {
            for col in -3..=0 {
                let expected = f64::from(row * row * 10 + col * 100);
                assert_eq!(samples.height([f64::from(col), f64::from(row)]), expected);
            }
        }
        let (low, high) = (1000.0 - 275.0, 1210.0 - 275.0);
        assert_eq!(samples.height([-2.75, 10.5]), (low + high) / 2.0);
    }

    #[test]
    fn a_void_reaches_the_four_cells_around_it() {
        let rect = PostRect::of_size(5, 5);
        let dem = Dem::from_fn(rect, |post| (post != Post::new(2, 2)).then_some(0));
        let samples = DemSamples::new(&dem);
        assert!(samples.is_void([1.5, 1.5]) && samples.is_void([2.5, 2.9]));
        assert!(!samples.is_void([0.5, 2.0]) && !samples.is_void([3.1, 2.0]) && !samples.is_void([4.0, 4.0]));
    }
}
