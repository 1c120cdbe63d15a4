//! The built-in terrain: desert basin and range, a pure function of a seed and a place.
//!
//! Eroded mountain blocks with a common trend stand in basins; fans slope gently off the mountain fronts, washes run
//! down the fans, and the lowest floors are dead flat playas. What lies where is decided at three scales:
//! the lie of the land (ranges, basin floors: noise), drainage (ridges, gullies and washes that run downhill),
//! and playas (found by walking to the bottom of closed basins).
//!
//! Upon it lie [`features()`]: highways, tracks over passes, bridges, washes and lakes, from the same seed.
//!
//! The same place has the same height whichever window or spacing it is asked for, on any machine: only `+ - * /`,
//! square roots, comparisons and integer hashing are used, and heights are rounded once, to quanta of 1/128 m.

mod drainage;
mod features;
mod noise;
mod patch;
mod playa;
mod region;

use terrain::{Dem, PostRect, Spacing, quanta_of_metres};

pub use features::{SampleFeature, SampleShape, features};

use drainage::Posts;
use patch::{BLOCK_M, Block, Run, runs};
use playa::Playa;
use region::Region;

/// The seed used when none is named.
pub const DEFAULT_SEED: u64 = 1;
/// No ground is lower than this, in metres.
pub const LOWEST_M: f64 = patch::LOWEST_M as f64;
/// No ground is higher than this, in metres.
pub const HIGHEST_M: f64 = patch::HIGHEST_M as f64;
/// Class of basins, fans and playas in [`classes`].
pub const PLAIN: u8 = 0;
/// Class of mountains in [`classes`].
pub const MOUNTAIN: u8 = 1;

/// Heights at every post of `rect`, post (0, 0) lying at metres (0, 0); no post is void.
pub fn heights(seed: u64, rect: PostRect, spacing: Spacing) -> Dem {
    let region = Region::new(seed);
    let metres = spacing.metres();
    let corner_m = (f64::from(rect.west) * metres, f64::from(rect.south) * metres);
    let size_m = (rect.cells_wide() as f64 * metres, rect.cells_high() as f64 * metres);
    let playas = Playa::around(seed, &region, corner_m, size_m);
    let block_at = |corner_m: (f64, f64)| {
        let near = playas.iter().filter(|playa| playa.touches(corner_m, BLOCK_M)).copied().collect();
        Block::new(seed, &region, corner_m, near)
    };
    let quanta =
        by_patch(rect, spacing, block_at, |block, posts| block.heights_m(posts).into_iter().map(quanta).collect());
    Dem::from_rows(rect, &quanta)
}

/// [`PLAIN`] or [`MOUNTAIN`] at every post of `rect`, row-major from the south-west post.
///
/// Outlines are smooth, as a person would draw them around whole ranges: small knolls in a basin are plain,
/// valley floors well inside a range are mountain.
pub fn classes(seed: u64, rect: PostRect, spacing: Spacing) -> Vec<u8> {
    /// Spurs reach out this far (in metres of bedrock under the fans) beyond where the front would lie unbroken.
    const OUTLINE_M: f32 = -30.0;
    let region = Region::new(seed);
    by_patch(
        rect,
        spacing,
        |corner_m| patch::nodes(&region, corner_m, BLOCK_M),
        |nodes, posts| {
            let class = |lie: &region::Lie| if OUTLINE_M < lie.bedrock_m() { MOUNTAIN } else { PLAIN };
            patch::lie(nodes, posts).iter().map(class).collect()
        },
    )
}

/// Height in metres, rounded to 1/128 m, at a place in metres east and north of post (0, 0).
///
/// For a few places only: each call prepares some ten square kilometres of ground, as [`heights`] does once
/// for all the posts in them.
pub fn height_m(seed: u64, east_m: f64, north_m: f64) -> f64 {
    let region = Region::new(seed);
    let corner_m = ((east_m / BLOCK_M).floor() * BLOCK_M, (north_m / BLOCK_M).floor() * BLOCK_M);
    let mut playas = Playa::around(seed, &region, corner_m, (BLOCK_M, BLOCK_M));
    playas.retain(|playa| playa.touches(corner_m, BLOCK_M));
    let (east, north) = ([(east_m - corner_m.0) as f32], [(north_m - corner_m.1) as f32]);
    let posts = Posts { east_m: &east, north_m: &north, spacing_m: 1.0 };
    let heights_m = Block::new(seed, &region, corner_m, playas).heights_m(posts);
    terrain::metres_of_quanta(quanta(heights_m[0]))
}

fn quanta(height_m: f32) -> i32 {
    quanta_of_metres(f64::from(height_m)).expect("heights lie between LOWEST_M and HIGHEST_M")
}

/// Values at every post of `rect`, row-major, evaluated patch by patch: `prepare` readies the block with the given
/// south-west corner, `values` gives those of one patch in it.
fn by_patch<Ready, Value: Copy + Default>(
    rect: PostRect,
    spacing: Spacing,
    prepare: impl Fn((f64, f64)) -> Ready,
    values: impl Fn(&Ready, Posts<'_>) -> Vec<Value>,
) -> Vec<Value> {
    let (rows, cols) = (runs(rect.south, rect.north, spacing), runs(rect.west, rect.east, spacing));
    let wide = rect.posts_wide();
    let mut all = vec![Value::default(); rect.post_count()];
    for rows in rows.chunk_by(|a, b| a.corner_m == b.corner_m) {
        for cols in cols.chunk_by(|a, b| a.corner_m == b.corner_m) {
            let block = prepare((cols[0].corner_m, rows[0].corner_m));
            for (row, col) in rows.iter().flat_map(|row| cols.iter().map(move |col| (row, col))) {
                let posts = Posts { east_m: &col.places_m, north_m: &row.places_m, spacing_m: spacing.metres() as f32 };
                place(&mut all, wide, row, col, &values(&block, posts));
            }
        }
    }
    all
}

/// Copies a patch to where it belongs in rows `wide` values long.
fn place<Value: Copy>(all: &mut [Value], wide: usize, rows: &Run, cols: &Run, patch: &[Value]) {
    for (up, line) in patch.chunks(cols.places_m.len()).enumerate() {
        all[(rows.start + up) * wide + cols.start..][..line.len()].copy_from_slice(line);
    }
}
