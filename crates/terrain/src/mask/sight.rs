//! How often each post decides what is seen: eyes all over the ground look along rays, and the highest post so far
//! hides or shows what lies beyond it.
//!
//! All in whole numbers. What a post comes to depends on the ground within [`Sight::halo`] posts of it and on nothing
//! else: eyes stand on posts of the whole area, and which way they look and how high they stand follows from where they
//! stand. So windows that overlap agree.

use crate::{Importance, Post, PostRect};

/// What stands for the height of a post that has none: too low to be seen.
const VOID: i32 = i32::MIN;
/// Posts between eyes, both ways.
const EYE_STEP: i32 = 8;
/// Directions there are.
const DIRECTIONS: usize = 64;
/// Directions in which an eye looks.
const RAYS: usize = 16;
/// Units in one: of sines, and of slopes in quanta a post.
const ONE: i64 = 1 << 20;
/// Sines of the first quarter of the directions, in units.
const SINES: [i64; DIRECTIONS / 4 + 1] = [
    0, 102778, 204567, 304386, 401273, 494295, 582558, 665210, 741455, 810560, 871859, 924761, 968758, 1003425,
    1028428, 1043527, 1048576,
];
/// What passes a horizon by less than this, in quanta, may be seen over another surface and not over this one.
const NEAR: i64 = 10 * 128;
/// What a point that passes its horizon exactly counts.
const FULL: i64 = 64;
/// What a post counts on average, in parts of what it would if every point of every ray counted in full. So measured:
/// 28 in the Alps, 34 in basin and range, 48 in the desert, within a kilometre. A constant, so that no ground weighs by
/// what lies far away.
const USUAL: i64 = 36;
/// How many times the usual count as much as anything can.
const MOST: i64 = 20;
/// Steps of the scale on which posts decide.
const FULLY: u32 = 1000;
/// A post that decides as much as anything can weighs so many times more, where squares are counted.
const STRENGTH: u64 = 12;

/// Posts that an eye may look far: a halo of that size is read around every tile.
const RANGE_MAX: i32 = 160;
/// Metres from an eye to the nearest point that it looks at.
const NEAREST_M: f64 = 200.0;

/// Who looks, and how far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sight {
    /// The lowest and the highest eye, and what they look at, above the ground in quanta.
    pub eyes: [i32; 2],
    /// How far they look, in posts.
    pub range: i32,
    /// How near what they look at may be, in posts.
    pub nearest: i32,
}

impl Sight {
    /// Of eyes between two heights in quanta, that look so many posts far, but no farther than a halo can be.
    pub fn new(eyes: [i32; 2], range: f64, metres_per_post: f64) -> Self {
        let whole = |posts: f64| posts.ceil().min(RANGE_MAX.into()) as i32;
        let range = whole(range).max(2);
        Self { eyes, range, nearest: whole(NEAREST_M / metres_per_post).min(range / 10).max(1) }
    }

    /// The same mask where a post weighs more that often decides what is seen. What surrounds it holds
    /// [`Sight::halo`] posts around the mask's window, as far as the area goes.
    ///
    /// # Panics
    /// When it does not hold every post of the mask's window.
    pub fn weigh(&self, importance: &Importance, around: &Surroundings) -> Importance {
        let rect = importance.rect();
        // What counts are squares, so weights rise by the root.
        let heavier = |(post, share): (Post, u32)| {
            let weight = u64::from(importance.weight(post));
            let squared = weight * weight * (u64::from(FULLY) + STRENGTH * u64::from(share)) / u64::from(FULLY);
            u16::try_from(squared.isqrt()).unwrap_or(u16::MAX)
        };
        let weights = rect.posts().zip(deciding(around, rect, self)).map(heavier).collect();
        Importance::new(rect, weights, rect.posts().map(|post| importance.class(post)).collect())
    }

    /// The height of an eye, one of four that lie closer where they are low: there a metre matters more.
    fn eye(&self, which: u32) -> i64 {
        let [low, high] = self.eyes.map(i64::from);
        let which = i64::from(which % 4);
        low + (high - low) * which * which / 9
    }

    /// Posts around a window that decide what its posts come to.
    pub fn halo(&self) -> i32 {
        // A ray through a post ends within the range of it; places are rounded, and neighbours are mixed.
        self.range + 2
    }
}

/// Heights of a window and of the ground around it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Surroundings {
    rect: PostRect,
    /// Row-major, in quanta.
    heights: Vec<i32>,
}

impl Surroundings {
    /// Of the posts of `rect`; those without a height hide nothing and are not looked at.
    pub fn new(rect: PostRect, height: impl Fn(Post) -> Option<i32>) -> Self {
        Self { rect, heights: rect.posts().map(|post| height(post).unwrap_or(VOID)).collect() }
    }

    /// Its heights, row by row from the south-west; the least number there is where there is none.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[i32]> {
        self.heights.chunks(self.rect.posts_wide())
    }
}

/// How much each post of `rect`, row-major, decides what is seen, in thousandths.
fn deciding(around: &Surroundings, rect: PostRect, sight: &Sight) -> Vec<u32> {
    assert!(around.rect.contains_rect(&rect), "a window holds the posts asked for");
    let mut scan = Scan::new(around, rect.grown(1), sight);
    let reach = rect.grown(sight.halo()).intersection(&around.rect).expect("a window holds the posts asked for");
    let first = |line: i32| line + (EYE_STEP / 2 - line).rem_euclid(EYE_STEP);
    for row in (first(reach.south)..=reach.north).step_by(EYE_STEP as usize) {
        for col in (first(reach.west)..=reach.east).step_by(EYE_STEP as usize) {
            if around.heights[around.rect.index(Post::new(row, col))] != VOID {
                scan.look_from(row, col);
            }
        }
    }
    scan.shares(rect)
}

/// One window while eyes look over it.
struct Scan<'a> {
    sight: &'a Sight,
    /// Where there are heights.
    around: PostRect,
    /// Posts that are counted, as far as they lie in `around`.
    counted: PostRect,
    heights: &'a [i32],
    counts: Vec<u32>,
    /// Of each direction, how far each step of a ray lies from its eye: columns, rows, and both in one.
    steps: Vec<Vec<(i32, i32, isize)>>,
    /// Units over steps.
    parts: Vec<i64>,
}

impl<'a> Scan<'a> {
    fn new(around: &'a Surroundings, counted: PostRect, sight: &'a Sight) -> Self {
        let (around, heights) = (around.rect, &around.heights[..]);
        let wide = around.posts_wide() as i64;
        let along = |direction: usize| {
            let (cosine, sine) = (sine(direction + DIRECTIONS / 4), sine(direction));
            let place = move |part: i64, step: i64| (part * step + ONE / 2).div_euclid(ONE);
            let step = move |step| {
                let (x, y) = (place(cosine, step), place(sine, step));
                (x as i32, y as i32, (y * wide + x) as isize)
            };
            (0..=i64::from(sight.range)).map(step).collect()
        };
        Self {
            sight,
            around,
            counted,
            heights,
            counts: vec![0; around.post_count()],
            steps: (0..DIRECTIONS).map(along).collect(),
            parts: (0..=i64::from(sight.range)).map(|step| ONE / step.max(1)).collect(),
        }
    }

    fn look_from(&mut self, row: i32, col: i32) {
        let hash = hash(row, col);
        let eye = self.sight.eye(hash);
        let turn = (hash >> 8) as usize % (DIRECTIONS / RAYS);
        for ray in 0..RAYS {
            let direction = ray * (DIRECTIONS / RAYS) + turn;
            if self.may_count(row, col, direction) {
                self.look_along(row, col, direction, eye);
            }
        }
    }

    /// Whether a ray comes near posts that are counted.
    fn may_count(&self, row: i32, col: i32, direction: usize) -> bool {
        let near = self.counted.grown(1);
        let &(x, y, _) = self.steps[direction].last().expect("a ray has an end");
        let is_beside = |from: i32, to: i32, low: i32, high: i32| from.max(to) < low || high < from.min(to);
        if is_beside(col, col + x, near.west, near.east) || is_beside(row, row + y, near.south, near.north) {
            return false;
        }
        let side =
            |corner: Post| i64::from(x) * i64::from(corner.row - row) - i64::from(y) * i64::from(corner.col - col);
        let sides = near.corners().map(side);
        sides.iter().any(|&side| side <= 0) && sides.iter().any(|&side| 0 <= side)
    }

    /// Walks a ray. The horizon so far decides whether what lies beyond it is seen; how much that counts goes by how
    /// near to it the line of sight passes there.
    fn look_along(&mut self, row: i32, col: i32, direction: usize, eye: i64) {
        let start = ((row - self.around.south) as usize * self.around.posts_wide()) as isize
            + (col - self.around.west) as isize;
        let line = &self.steps[direction];
        let from = i64::from(self.heights[start as usize]) + eye;
        let (mut horizon, mut decides, mut far, mut count) = (i64::MIN, start, 0, 0u32);
        for step in 1..=self.room(row, col, direction) {
            let at = start + line[step].2;
            let (rise, part) = (i64::from(self.heights[at as usize]) - from, self.parts[step]);
            let slope = rise * part;
            if self.sight.nearest <= step as i32 && 0 < far {
                let clearance = (((rise + eye) * part - horizon).abs() * far) >> 20;
                let worth = (NEAR - clearance).max(0) * FULL / NEAR;
                count += worth as u32;
                // An error at an end moves the line at the horizon by the horizon's share of the way, and counts by its
                // square; twice, since what is looked at looks back.
                let way = far * part;
                self.counts[at as usize] += ((((2 * worth * way) >> 20) * way) >> 20) as u32;
            }
            if horizon < slope {
                self.counts[decides as usize] += count;
                (horizon, decides, far, count) = (slope, at, step as i64, 0);
                if self.is_past(row + line[step].1, col + line[step].0, line[line.len() - 1]) {
                    return;
                }
            }
        }
        self.counts[decides as usize] += count;
    }

    /// Whether a ray that ends so far from its eye has left what is counted for good.
    #[inline(always)]
    fn is_past(&self, row: i32, col: i32, (x, y, _): (i32, i32, isize)) -> bool {
        let PostRect { south, west, north, east } = self.counted;
        (0 < x && east < col) || (x < 0 && col < west) || (0 < y && north < row) || (y < 0 && row < south)
    }

    /// Steps of a ray before it leaves the window.
    fn room(&self, row: i32, col: i32, direction: usize) -> usize {
        let line = &self.steps[direction];
        let is_inside = |&(x, y, _): &(i32, i32, isize)| self.around.contains(Post::new(row + y, col + x));
        line.partition_point(is_inside) - 1
    }

    /// Counts mixed with those of neighbours, in thousandths of what counts as much as anything can.
    fn shares(&self, rect: PostRect) -> Vec<u32> {
        let eyes = i64::from(EYE_STEP * EYE_STEP);
        let points = i64::from((self.sight.range - self.sight.nearest).max(1)) * RAYS as i64;
        let most = (16 * MOST * USUAL * points / eyes).max(1);
        let mut shares = Vec::with_capacity(rect.post_count());
        let (mut column, mut all) = (vec![0; rect.posts_wide() + 2], Vec::new());
        for row in rect.south..=rect.north {
            column.fill(0);
            for (beside, times) in [(row - 1, 1), (row, 2), (row + 1, 1)] {
                self.row_of_counts(beside, rect, &mut all);
                column.iter_mut().zip(&all).for_each(|(sum, &count)| *sum += times * i64::from(count));
            }
            let mixed = column.windows(3).map(|near| near[0] + 2 * near[1] + near[2]);
            shares.extend(mixed.map(|mixed| (mixed * i64::from(FULLY) / most).min(FULLY.into()) as u32));
        }
        shares
    }

    /// The counts of a row from one post west of `rect` to one east of it; 0 where there is no ground.
    fn row_of_counts(&self, row: i32, rect: PostRect, counts: &mut Vec<u32>) {
        let around = self.around;
        counts.clear();
        counts.resize(rect.posts_wide() + 2, 0);
        if row < around.south || around.north < row {
            return;
        }
        let (west, east) = ((rect.west - 1).max(around.west), (rect.east + 1).min(around.east));
        let from = around.index(Post::new(row, west));
        let to = (west - (rect.west - 1)) as usize;
        let wide = (east - west) as usize + 1;
        counts[to..to + wide].copy_from_slice(&self.counts[from..from + wide]);
    }
}

/// Sine of a direction, in units.
fn sine(direction: usize) -> i64 {
    let quarter = DIRECTIONS / 4;
    let (turns, rest) = (direction / quarter % 4, direction % quarter);
    let sine = if turns % 2 == 0 { SINES[rest] } else { SINES[quarter - rest] };
    if turns < 2 { sine } else { -sine }
}

/// A number that follows from a place, and looks like chance.
fn hash(row: i32, col: i32) -> u32 {
    let mut bits = (row as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (col as u64).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits ^= bits >> 29;
    bits = bits.wrapping_mul(0x94d0_49bb_1331_11eb);
    (bits >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: PostRect = PostRect { south: 0, west: 0, north: 89, east: 99 };

    fn sight() -> Sight {
        Sight { eyes: [128, 1280], range: 20, nearest: 2 }
    }

    /// Ridges that run every way, and a plain.
    fn height(post: Post) -> Option<i32> {
        let hill = |row: i32, col: i32, high: i32| {
            let (y, x) = (post.row - row, post.col - col);
            (high - 9 * (x * x + x * y + y * y)).max(0)
        };
        let bumps = (hash(post.row, post.col) % 97) as i32;
        Some(hill(20, 30, 9000) + hill(60, 25, 4000) + hill(45, 70, 12000) + bumps)
    }

    fn surroundings(rect: PostRect) -> Surroundings {
        Surroundings::new(rect.intersection(&AREA).unwrap(), height)
    }

    #[test]
    fn what_a_post_decides_depends_on_no_ground_beyond_the_halo() {
        let whole = deciding(&surroundings(AREA), AREA, &sight());
        assert!(200 < whole.iter().filter(|&&share| 0 < share).count());
        for (south, west) in [(0, 0), (30, 40), (64, 71), (33, 0)] {
            let rect = PostRect { south, west, north: south + 24, east: west + 27 };
            let part = deciding(&surroundings(rect.grown(sight().halo())), rect, &sight());
            let cut: Vec<u32> = rect.posts().map(|post| whole[AREA.index(post)]).collect();
            assert_eq!(part, cut, "{rect:?}");
        }
    }

    #[test]
    fn crests_weigh_more_than_the_ground_they_hide() {
        let ridge = |post: Post| Some(if post.col == 50 { 1000 } else { 0 });
        let around = Surroundings::new(AREA, ridge);
        let weighed = sight().weigh(&Importance::uniform(AREA, 1000), &around);
        // Of squares, that which sight has added.
        let added = |post: Post| u64::from(weighed.weight(post)).pow(2) - 1_000_000;
        let mean = |col: i32| (20..70).map(|row| added(Post::new(row, col))).sum::<u64>() / 50;
        let beside: Vec<u64> = (40..60).filter(|&col: &i32| 1 < (col - 50).abs()).map(mean).collect();
        assert!(beside.iter().all(|&squared| 9 * squared < 5 * mean(50)), "{beside:?} {}", mean(50));
        assert!(AREA.posts().all(|post| 1000 <= weighed.weight(post)));
    }

    #[test]
    fn posts_without_weight_or_height_stay_so_and_hide_nothing() {
        let is_void = |post: Post| 40 <= post.col && post.col <= 60;
        let plain = |post: Post| (!is_void(post)).then_some(0);
        let weights: Vec<u16> = AREA.posts().map(|post| if is_void(post) { 0 } else { 1000 }).collect();
        let importance = Importance::new(AREA, weights, vec![0; AREA.post_count()]);
        let weighed = sight().weigh(&importance, &Surroundings::new(AREA, plain));
        assert!(AREA.posts().all(|post| (weighed.weight(post) == 0) == is_void(post)));
    }

    #[test]
    fn directions_are_those_of_a_circle() {
        for direction in 0..DIRECTIONS {
            let expected = (std::f64::consts::TAU * direction as f64 / DIRECTIONS as f64).sin() * ONE as f64;
            assert!((sine(direction) as f64 - expected).abs() < 1.0, "{direction}");
        }
    }

    #[test]
    fn no_eye_looks_farther_than_a_halo_can_be() {
        let fine = Sight::new([128, 1280], 2000.0, 1.0);
        assert_eq!((fine.range, fine.nearest, fine.halo()), (RANGE_MAX, 16, RANGE_MAX + 2));
        let usual = Sight::new([128, 1280], 80.0, 25.0);
        assert_eq!((usual.range, usual.nearest), (80, 8));
        assert_eq!([0, 1, 2, 3].map(|which| usual.eye(which)), [128, 256, 640, 1280]);
    }
}
