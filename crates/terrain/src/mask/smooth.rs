//! The 7 x 7 binomial smoothing of weights, in integers with one rounding at the end.

use crate::PostRect;

/// Posts the kernel reaches to either side.
pub(crate) const REACH: i32 = 3;

/// The kernel's weights add up to 64 each way, so to 2^12 together.
const SHIFT: u32 = 12;

/// Smooths the weights of `from`, which holds `rect` and the kernel's reach around it as far as the area goes.
/// Beyond the area the outermost posts repeat.
///
/// The sum of 65,535 x 4096 fits 32 bits.
pub(crate) fn binomial7(weights: &[u16], from: PostRect, rect: PostRect) -> Vec<u16> {
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
