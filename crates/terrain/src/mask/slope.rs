//! Where the ground is steep: slopes by central differences, averaged over a square, in whole numbers.

use crate::{Dem, Post, PostRect, Spacing};

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
