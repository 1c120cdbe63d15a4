//! Decides where ground matters more: classes and weights per post, from polygons and class overlays.
//!
//! Its main verb is [`importance`]. Every post is decided from the area alone, never from the window asked for, so the
//! windows of two tiles agree wherever they overlap.
//!
//! Slopes are central differences, averaged over a square, in whole numbers; weights are smoothed in integers, with one
//! rounding at the end.

mod polygon;
pub use polygon::Polygon;
mod sight;
pub use sight::{Sight, Surroundings};

use std::ops::Range;

use crate::{Dem, GridFrame, HOLE_CLASS, Importance, Post, PostRect, Smooth, Spacing};

/// Index of the class of posts that no area claims.
pub const DEFAULT_CLASS: u8 = 0;

/// How many posts around a window decide its weights.
fn halo(smooth: Smooth) -> i32 {
    match smooth {
        Smooth::None => 0,
        Smooth::Binomial7 => REACH,
    }
}

/// What makes up an importance mask. Areas named later win where areas overlap.
#[derive(Debug)]
pub struct Mask<'a> {
    /// Weight of posts that no area claims, in thousandths; 0 excludes them.
    pub default_weight: u16,
    /// Areas with a class and a weight of their own.
    pub areas: Vec<Area<'a>>,
    /// How weights are mixed.
    pub smooth: Smooth,
    /// Areas over all others, with weights that end where they end: smoothing leaves them out, so that a shore's
    /// water weighs what water weighs, and its land what land does.
    pub over: Vec<Area<'a>>,
}

impl Mask<'_> {
    /// Names of the classes by index: `default`, then each new class in the order in which areas name it.
    ///
    /// An area may name `default` itself, to give a part of another area back.
    pub(crate) fn class_names(&self) -> Vec<&str> {
        let mut names = vec!["default"];
        for area in self.areas.iter().chain(&self.over) {
            if !names.contains(&area.class.as_str()) {
                names.push(&area.class);
            }
        }
        names
    }

    /// Whether every post of any window weighs the same and is of the default class.
    pub(crate) fn is_uniform(&self) -> bool {
        self.areas.is_empty() && self.over.is_empty()
    }
}

/// Weights and classes of the posts of `rect`, a window of the gaming area `area` on the grid `frame`.
///
/// Weights are smoothed with one rounding (half up) and posts of weight 0 stay 0; a post whose own weight is not 0
/// never becomes 0 by rounding.
///
/// # Panics
/// When `rect` is not inside `area`, or there are more classes than numbers below [`HOLE_CLASS`].
pub fn importance(mask: &Mask, area: PostRect, frame: &GridFrame, rect: PostRect) -> Importance {
    assert!(area.contains_rect(&rect), "a window of the mask lies inside the gaming area");
    if mask.is_uniform() {
        return Importance::uniform(rect, mask.default_weight);
    }
    let wide = rect.grown(halo(mask.smooth)).intersection(&area).expect("a window lies inside the area");
    let claims = claims(mask, frame, wide);
    let weights = match mask.smooth {
        Smooth::None => claims.weights,
        Smooth::Binomial7 => binomial7(&claims.weights, wide, rect),
    };
    let classes = if wide == rect { claims.classes } else { cut(&claims.classes, wide, rect) };
    let mut claims = Claims { weights, classes };
    claims.lay(&mask.over, mask, frame, rect);
    Importance::new(rect, claims.weights, claims.classes)
}

/// The same mask with weight 0 and the class of holes at the void posts of `dem`, which therefore are never selected.
///
/// # Panics
/// When `dem` does not hold every post of the mask's window.
pub fn without_voids(importance: Importance, dem: &Dem) -> Importance {
    if dem.void_count() == 0 {
        return importance;
    }
    let rect = importance.rect();
    assert!(dem.rect().contains_rect(&rect), "the window of heights holds the window of the mask");
    let weight = |post| if dem.is_void(post) { 0 } else { importance.weight(post) };
    let weights = rect.posts().map(weight).collect();
    let class = |post| if dem.is_void(post) { HOLE_CLASS } else { importance.class(post) };
    let classes = rect.posts().map(class).collect();
    Importance::new(rect, weights, classes)
}

/// Weight and class of every post of a window, row-major.
struct Claims {
    weights: Vec<u16>,
    classes: Vec<u8>,
}

impl Claims {
    /// Lays areas of a mask over what is there.
    fn lay(&mut self, areas: &[Area], mask: &Mask, frame: &GridFrame, rect: PostRect) {
        let names = mask.class_names();
        for area in areas {
            let index = names.iter().position(|&name| name == area.class).expect("every area's class is listed");
            let class =
                u8::try_from(index).ok().filter(|&class| class < HOLE_CLASS).expect("a mask has at most 255 classes");
            area.shape.visit_spans(frame, rect, |span| {
                self.weights[span.clone()].fill(area.weight);
                self.classes[span].fill(class);
            });
        }
    }
}

fn claims(mask: &Mask, frame: &GridFrame, rect: PostRect) -> Claims {
    let mut claims = Claims {
        weights: vec![mask.default_weight; rect.post_count()],
        classes: vec![DEFAULT_CLASS; rect.post_count()],
    };
    claims.lay(&mask.areas, mask, frame, rect);
    claims
}

fn cut<T: Copy>(values: &[T], from: PostRect, rect: PostRect) -> Vec<T> {
    let west = (rect.west - from.west) as usize;
    let south = (rect.south - from.south) as usize;
    let rows = values.chunks(from.posts_wide()).skip(south).take(rect.posts_high());
    rows.flat_map(|row| row[west..west + rect.posts_wide()].iter().copied()).collect()
}

/// Posts along a side of the squares that level ground is made of.
const LEVEL_SIDE: usize = 5;
/// Posts around a window whose heights decide which of its posts are level.
pub const LEVEL_HALO: i32 = LEVEL_SIDE as i32 - 1;

/// Which posts of `rect`, row-major, lie in squares of 5 x 5 posts all of which are `height` quanta high, as the sea is
/// in most rasters. `dem` holds [`LEVEL_HALO`] posts around `rect`, as far as the area goes.
///
/// # Panics
/// When `dem` does not hold `rect`.
pub fn level(dem: &Dem, rect: PostRect, height: i32) -> Vec<bool> {
    assert!(dem.rect().contains_rect(&rect), "a window holds the posts asked for");
    let around = rect.grown(LEVEL_HALO).intersection(&dem.rect()).expect("a window holds the posts asked for");
    let wide = around.posts_wide();
    let mut in_squares = vec![false; around.post_count()];
    // For each column, rows on end, this one the last, in which so many level posts end there.
    let mut rows = vec![0; wide];
    for (row, posts) in (around.south..=around.north).enumerate() {
        let mut run = 0;
        for (col, rows) in rows.iter_mut().enumerate() {
            let post = Post::new(posts, around.west + col as i32);
            run = if !dem.is_void(post) && dem.height(post) == height { run + 1 } else { 0 };
            *rows = if LEVEL_SIDE <= run { *rows + 1 } else { 0 };
            if LEVEL_SIDE <= *rows {
                for row in row + 1 - LEVEL_SIDE..=row {
                    in_squares[row * wide + col + 1 - LEVEL_SIDE..=row * wide + col].fill(true);
                }
            }
        }
    }
    cut(&in_squares, around, rect)
}

/// Slopes beyond this, in thousandths of a percent, count as this: sums over a square stay far inside 64 bits.
const SLOPE_MAX: f64 = 1.0e9;

/// Posts around a window whose heights decide which of its posts are steep.
pub fn steep_halo(radius: i32) -> i32 {
    radius + 1
}

/// Which posts of `rect`, row-major, lie on ground steeper than `above` thousandths of a percent: on the mean over all
/// posts at most `radius` rows and columns away that have a height. `dem` holds [`steep_halo`] posts around `rect`, as
/// far as the area goes.
///
/// # Panics
/// When `dem` does not hold `rect`.
pub fn steep(dem: &Dem, rect: PostRect, spacing: Spacing, radius: i32, above: u32) -> Vec<bool> {
    let around = rect.grown(radius).intersection(&dem.rect()).expect("a window holds the posts asked for");
    assert!(dem.rect().contains_rect(&rect), "a window holds the posts asked for");
    // Sums of slopes and counts of posts south-west of each post, one row and column wider than the posts.
    let wide = around.posts_wide() + 1;
    let mut sums = vec![(0u64, 0u64); wide * (around.posts_high() + 1)];
    for (index, row) in (around.south..=around.north).enumerate() {
        let mut line = (0, 0);
        for (place, col) in (around.west..=around.east).enumerate() {
            let post = Post::new(row, col);
            if !dem.is_void(post) {
                line = (line.0 + slope(dem, post, spacing), line.1 + 1);
            }
            let below = sums[index * wide + place + 1];
            sums[(index + 1) * wide + place + 1] = (below.0 + line.0, below.1 + line.1);
        }
    }
    let corner = |row: i32, col: i32| sums[(row - around.south) as usize * wide + (col - around.west) as usize];
    let is_steep = |row: i32, col: i32| {
        let square = PostRect { south: row, west: col, north: row, east: col }.grown(radius);
        let square = square.intersection(&around).expect("a post lies in its own square");
        let (south, north, west, east) = (square.south, square.north + 1, square.west, square.east + 1);
        let [a, b, c, d] = [corner(north, east), corner(south, west), corner(south, east), corner(north, west)];
        let (sum, count) = (a.0 + b.0 - c.0 - d.0, a.1 + b.1 - c.1 - d.1);
        u64::from(above) * count < sum
    };
    (rect.south..=rect.north)
        .flat_map(|row| (rect.west..=rect.east).map(move |col| (row, col)))
        .map(|(row, col)| is_steep(row, col))
        .collect()
}

/// Slope at a post in thousandths of a percent, from its neighbours; at the edge of the area from itself and one.
fn slope(dem: &Dem, post: Post, spacing: Spacing) -> u64 {
    let rect = dem.rect();
    let rise = |low: Post, high: Post, posts: i32| match posts {
        0 => 0.0,
        _ => f64::from(dem.height(high) - dem.height(low)) / f64::from(posts * spacing.quanta_per_post()),
    };
    let (west, east) = ((post.col - 1).max(rect.west), (post.col + 1).min(rect.east));
    let (south, north) = ((post.row - 1).max(rect.south), (post.row + 1).min(rect.north));
    let across = rise(Post::new(post.row, west), Post::new(post.row, east), east - west);
    let along = rise(Post::new(south, post.col), Post::new(north, post.col), north - south);
    ((across * across + along * along).sqrt() * 100_000.0).round().min(SLOPE_MAX) as u64
}

/// Posts the kernel reaches to either side.
const REACH: i32 = 3;

/// The kernel's weights add up to 64 each way, so to 2^12 together.
const SHIFT: u32 = 12;

/// Smooths the weights of `from`, which holds `rect` and the kernel's reach around it as far as the area goes.
/// Beyond the area the outermost posts repeat.
///
/// The sum of 65,535 x 4096 fits 32 bits.
fn binomial7(weights: &[u16], from: PostRect, rect: PostRect) -> Vec<u16> {
    let reach = REACH as usize;
    let rows: Vec<&[u16]> = weights.chunks(from.posts_wide()).collect();
    let mut smoothed = vec![0; rect.post_count()];
    let (wide, west) = (rect.posts_wide(), (rect.west - from.west) as usize);
    // Sums down the columns of `from`, its outermost columns repeated on either side.
    let mut sums = vec![0; from.posts_wide() + 2 * reach];
    for (smoothed, row) in smoothed.chunks_mut(wide).zip(rect.south..) {
        let near = |offset: i32| rows[((row + offset).clamp(from.south, from.north) - from.south) as usize];
        let (repeated_west, others) = sums.split_at_mut(reach);
        let (inner, repeated_east) = others.split_at_mut(from.posts_wide());
        sum_down(std::array::from_fn(|tap| near(tap as i32 - REACH)), inner);
        repeated_west.fill(inner[0]);
        repeated_east.fill(inner[inner.len() - 1]);
        smooth_across(&sums[west..west + wide + 2 * reach], &near(0)[west..west + wide], smoothed);
    }
    smoothed
}

/// Seven neighbours by the kernel's weights, which are small enough to be shifts and additions.
fn weighted([a, b, c, d, e, f, g]: [u32; 7]) -> u32 {
    (a + g) + 6 * (b + f) + 15 * (c + e) + 20 * d
}

fn sum_down(rows: [&[u16]; 7], sums: &mut [u32]) {
    let count = sums.len();
    let [a, b, c, d, e, f, g] = rows.map(|row| &row[..count]);
    for (index, sum) in sums.iter_mut().enumerate() {
        *sum = weighted([a, b, c, d, e, f, g].map(|row| u32::from(row[index])));
    }
}

/// `sums` begins and ends the kernel's reach beyond the posts of `own`.
fn smooth_across(sums: &[u32], own: &[u16], smoothed: &mut [u16]) {
    let [a, b, c, d, e, f, g] = std::array::from_fn(|tap| &sums[tap..tap + own.len()]);
    for (index, smoothed) in smoothed.iter_mut().enumerate() {
        let sum = weighted([a, b, c, d, e, f, g].map(|sums| sums[index]));
        *smoothed = if own[index] == 0 { 0 } else { rounded(sum) };
    }
}

/// Half up, and at least 1: only a weight of 0 excludes a post.
fn rounded(sum: u32) -> u16 {
    ((sum + (1 << (SHIFT - 1))) >> SHIFT).max(1) as u16
}

/// Which posts of a window belong, row-major from the south: one answer per post, the same for a post in whatever
/// window it is asked for.
pub type Membership<'a> = dyn Fn(PostRect) -> Vec<bool> + Send + Sync + 'a;

/// A part of the ground with a class and a weight of its own.
#[derive(Debug)]
pub struct Area<'a> {
    /// Name of the class.
    pub class: String,
    /// Weight in thousandths; 0 excludes its posts from selection.
    pub weight: u16,
    /// Which posts it claims.
    pub shape: Shape<'a>,
}

/// Which posts an area claims.
pub enum Shape<'a> {
    /// Those inside any of the polygons.
    Polygons(Vec<Polygon>),
    /// Those a class overlay says belong.
    Members(Box<Membership<'a>>),
}

impl std::fmt::Debug for Shape<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Shape::Polygons(polygons) => f.debug_tuple("Polygons").field(polygons).finish(),
            Shape::Members(_) => f.write_str("Members"),
        }
    }
}

impl Shape<'_> {
    /// Calls `claim` with ranges of row-major indices into `rect` that together hold exactly the posts claimed.
    pub(crate) fn visit_spans(&self, frame: &GridFrame, rect: PostRect, mut claim: impl FnMut(Range<usize>)) {
        match self {
            Shape::Polygons(polygons) => {
                for polygon in polygons {
                    polygon.visit_spans(frame, rect, &mut claim);
                }
            }
            Shape::Members(members) => {
                let members = members(rect);
                assert_eq!(members.len(), rect.post_count(), "an overlay answers for every post of the window");
                for (index, _) in members.iter().enumerate().filter(|&(_, &member)| member) {
                    claim(index..index + 1);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
