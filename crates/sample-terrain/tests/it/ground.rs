//! What the sample terrain promises: one ground for every window, and ground that looks like basin and range.

use fastrand::Rng;
use sample_terrain::{DEFAULT_SEED, HIGHEST_M, LOWEST_M, MOUNTAIN, PLAIN, classes, height_m, heights};
use terrain::{Dem, Post, PostRect, Spacing, metres_of_quanta};

use crate::check_golden;

/// FNV-1a of the heights of [`golden_rects`], little-endian; `UPDATE_GOLDEN=1` prints the new one.
const GOLDEN: &str = "58636f729410a6b5";

fn spacing(metres: f64) -> Spacing {
    Spacing::from_metres(metres).expect("tests use multiples of a sixteenth")
}

fn rect(south: i32, west: i32, rows: i32, cols: i32) -> PostRect {
    PostRect::new(Post::new(south, west), Post::new(south + (rows - 1), west + (cols - 1)))
}

/// The default seed's 50 km area, at 50 m.
fn area() -> (PostRect, Dem, Vec<u8>) {
    let rect = PostRect::of_size(1001, 1001);
    (rect, heights(DEFAULT_SEED, rect, spacing(50.0)), classes(DEFAULT_SEED, rect, spacing(50.0)))
}

fn golden_rects() -> [PostRect; 3] {
    [rect(0, 0, 24, 24), rect(700, 300, 24, 24), rect(-40_010, 39_990, 24, 24)]
}

#[test]
fn overlapping_windows_agree_on_the_posts_they_share() {
    let mut draw = Rng::with_seed(7);
    for round in 0..12 {
        let (south, west) = (draw.i32(0..4_000) - 2_000, draw.i32(0..4_000) - 2_000);
        let one = rect(south, west, 1 + draw.i32(0..200), 1 + draw.i32(0..200));
        let other =
            rect(south - draw.i32(0..100), west - draw.i32(0..100), 100 + draw.i32(0..150), 100 + draw.i32(0..150));
        let shared = one.intersection(&other).expect("the other window reaches the first one's corner");
        let (a, b) = (heights(3, one, spacing(25.0)), heights(3, other, spacing(25.0)));
        assert_eq!(a.window(shared), b.window(shared), "round {round}: {one:?} and {other:?}");
    }
}

#[test]
fn classes_of_overlapping_windows_agree() {
    let (whole, part) = (rect(-300, -300, 700, 700), rect(-60, 40, 33, 77));
    let (a, b) = (classes(3, whole, spacing(25.0)), classes(3, part, spacing(25.0)));
    for row in 0..33 {
        let start = (row + 240) * 700 + 340;
        assert_eq!(&a[start..start + 77], &b[row * 77..(row + 1) * 77]);
    }
}

#[test]
fn another_spacing_samples_the_same_ground() {
    let coarse = heights(5, rect(-30, -30, 60, 60), spacing(100.0));
    for (metres, per_post) in [(25.0, 4), (6.25, 16)] {
        for post in [Post::new(-30, -30), Post::new(0, 0), Post::new(2, 29), Post::new(-1, 7)] {
            let fine = rect(post.row * per_post - 1, post.col * per_post - 1, 3, 3);
            let height = heights(5, fine, spacing(metres)).height(Post::new(post.row * per_post, post.col * per_post));
            assert_eq!(height, coarse.height(post), "at {post}, {metres} m");
        }
    }
}

#[test]
fn a_single_place_has_the_height_of_the_post_there() {
    let dem = heights(5, rect(-3, 126, 5, 5), spacing(25.0));
    for post in [Post::new(-3, 126), Post::new(0, 128), Post::new(1, 130)] {
        let height_m = height_m(5, f64::from(post.col) * 25.0, f64::from(post.row) * 25.0);
        assert_eq!(height_m, metres_of_quanta(dem.height(post)));
    }
}

#[test]
fn the_bytes_are_the_same_on_any_machine() {
    let heights = golden_rects().into_iter().flat_map(|rect| {
        let dem = heights(DEFAULT_SEED, rect, spacing(25.0));
        (rect.south..=rect.north).flat_map(|row| dem.row(row).to_vec()).collect::<Vec<i32>>()
    });
    check_golden(heights.flat_map(i32::to_le_bytes), GOLDEN);
}

#[test]
fn heights_stay_within_their_bounds_and_use_much_of_them() {
    for seed in [DEFAULT_SEED, 2, 77, u64::MAX] {
        let (lowest, highest) = heights(seed, rect(-150, -150, 301, 301), spacing(200.0)).range();
        let (lowest_m, highest_m) = (metres_of_quanta(lowest), metres_of_quanta(highest));
        assert!(LOWEST_M < lowest_m && highest_m < HIGHEST_M, "seed {seed}: {lowest_m}..{highest_m}");
        assert!((1_000.0..1_900.0).contains(&(highest_m - lowest_m)), "seed {seed}: {lowest_m}..{highest_m}");
    }
}

#[test]
fn the_farthest_posts_have_heights() {
    for (row, col) in [(i32::MAX - 2, i32::MIN), (i32::MIN, i32::MAX - 2), (40_000, 40_000)] {
        let (lowest, highest) = heights(1, rect(row, col, 3, 3), spacing(31.25)).range();
        assert!(LOWEST_M * 128.0 <= f64::from(lowest) && f64::from(highest) <= HIGHEST_M * 128.0);
    }
}

#[test]
fn far_away_ground_is_as_rough_as_near_ground() {
    let roughness = |row: i32, col: i32| {
        let dem = heights(1, rect(row, col, 401, 401), spacing(25.0));
        let slant =
            |row: i32| dem.row(row).windows(3).map(|h| f64::from(h[0] - 2 * h[1] + h[2])).map(|d| d * d).sum::<f64>();
        ((row..row + 401).map(slant).sum::<f64>() / (401.0 * 399.0)).sqrt() / 128.0
    };
    for (row, col) in [(0, 0), (40_000, -40_000), (-800_000, 2_000_000)] {
        let roughness_m = roughness(row, col);
        assert!((0.5..6.0).contains(&roughness_m), "{roughness_m} m at {row},{col}");
    }
}

#[test]
fn seeds_differ() {
    let window = rect(0, 0, 50, 50);
    assert_ne!(heights(1, window, spacing(25.0)), heights(2, window, spacing(25.0)));
}

#[test]
fn blocks_join_without_a_step() {
    // Blocks are 3,200 m wide; the window straddles a border between two of them at 1 m.
    let dem = heights(DEFAULT_SEED, rect(9_000, 6_396, 2_000, 9), spacing(1.0));
    for row in 9_000..11_000 {
        for bend in dem.row(row).windows(3).map(|h| h[0] - 2 * h[1] + h[2]) {
            assert!(bend.abs() <= 128, "row {row} bends by {bend} quanta in a metre");
        }
    }
}

#[test]
fn mountains_take_a_third_to_a_half_of_the_default_area() {
    let (rect, _, classes) = area();
    assert!(classes.iter().all(|&class| class == PLAIN || class == MOUNTAIN));
    let share = classes.iter().filter(|&&class| class == MOUNTAIN).count() as f64 / rect.post_count() as f64;
    assert!((0.35..=0.50).contains(&share), "{share}");
}

#[test]
fn mountains_are_steep_and_plains_are_not() {
    let (rect, dem, classes) = area();
    let mut slopes = [Vec::new(), Vec::new()];
    for row in 1..rect.north {
        for col in 1..rect.east {
            let rise = |a: Post, b: Post| metres_of_quanta(dem.height(a) - dem.height(b)) / 100.0;
            let east = rise(Post::new(row, col + 1), Post::new(row, col - 1));
            let north = rise(Post::new(row + 1, col), Post::new(row - 1, col));
            let class = classes[row as usize * rect.posts_wide() + col as usize];
            slopes[usize::from(class)].push((east * east + north * north).sqrt());
        }
    }
    let [plain, mountain] = slopes.map(|mut slopes| {
        slopes.sort_by(f64::total_cmp);
        slopes[slopes.len() / 2]
    });
    assert!((0.01..0.06).contains(&plain), "plains slope by {plain}");
    assert!((0.2..0.45).contains(&mountain), "mountains slope by {mountain}");
}

#[test]
fn playas_are_dead_flat_and_lie_in_the_plains() {
    let (rect, dem, classes) = area();
    let (mut flat, mut in_mountains) = (0, 0);
    for row in 1..rect.north {
        for col in 1..rect.east {
            let height = dem.height(Post::new(row, col));
            let same = |up: i32| dem.row(row + up)[col as usize - 1..=col as usize + 1].iter().all(|&h| h == height);
            if same(-1) && same(0) && same(1) {
                flat += 1;
                in_mountains += i32::from(classes[row as usize * rect.posts_wide() + col as usize] == MOUNTAIN);
                assert_eq!(height % 128, 0, "a playa's level is a whole metre");
            }
        }
    }
    // 400 posts of 50 m are a square kilometre.
    assert!(4_000 < flat, "{flat} posts of playa");
    assert!(in_mountains < flat / 50, "{in_mountains} of {flat} posts of playa in the mountains");
}

#[test]
fn washes_are_one_to_five_metres_deep() {
    let window = rect(0, 0, 801, 801);
    let dem = heights(DEFAULT_SEED, window, spacing(25.0));
    let classes = classes(DEFAULT_SEED, window, spacing(25.0));
    let (mut plains, mut washes, mut canyons) = (0, 0, 0);
    for row in 4..797 {
        for col in 4..797 {
            // Spurs and knolls reach beyond the outline; ground that is plain all round has none.
            let plain = |up: i32, right: i32| classes[((row + up) * 801 + col + right) as usize] == PLAIN;
            if ![(-4, -4), (-4, 4), (4, -4), (4, 4), (0, 0)].iter().all(|&(up, right)| plain(up, right)) {
                continue;
            }
            plains += 1;
            let depth = |(up, right): (i32, i32)| {
                let bank = |by: i32| dem.height(Post::new(row + by * up, col + by * right));
                bank(1).min(bank(-1)) - bank(0)
            };
            let depth = [(0, 3), (3, 0), (2, 2), (2, -2)].map(depth).into_iter().fold(0, i32::max);
            washes += i32::from((128..=640).contains(&depth));
            canyons += i32::from(768 < depth);
        }
    }
    assert!(plains / 25 < washes && washes < plains / 4, "{washes} of {plains} posts lie in a wash");
    assert!(canyons < plains / 1_000, "{canyons} of {plains} posts lie deeper than 6 m");
}
