//! Cuts a window of posts into patches that lie in one block of ground each.

use terrain::Spacing;

use crate::patch::BLOCK_M;

/// Posts a side of a patch: few enough that a patch's sums stay in a near cache.
const PATCH_POSTS: usize = 64;

/// Neighbouring rows (or columns) of a window that lie in one row (or column) of blocks.
#[derive(Debug)]
pub(crate) struct Run {
    /// Where the block begins, in metres from post (0, 0).
    pub(crate) corner_m: f64,
    /// Index, in the window, of the first one.
    pub(crate) start: usize,
    /// Metres from the block's border. A sixteenth of a metre within a block is exact in single precision.
    pub(crate) places_m: Vec<f32>,
}

/// The runs of rows (or columns) `first..=last`, ascending.
pub(crate) fn runs(first: i32, last: i32, spacing: Spacing) -> Vec<Run> {
    let side = BLOCK_M as i64 * 16;
    let mut runs: Vec<Run> = Vec::new();
    for post in first..=last {
        let sixteenths = i64::from(post) * i64::from(spacing.sixteenths());
        let corner_m = sixteenths.div_euclid(side) as f64 * BLOCK_M;
        let place_m = sixteenths.rem_euclid(side) as f32 / 16.0;
        match runs.last_mut() {
            Some(run) if run.corner_m == corner_m && run.places_m.len() < PATCH_POSTS => run.places_m.push(place_m),
            _ => runs.push(Run {
                corner_m,
                start: (i64::from(post) - i64::from(first)) as usize,
                places_m: vec![place_m],
            }),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_hold_every_row_once_and_never_cross_a_block() {
        for (first, last, metres) in
            [(-300, 300, 25.0), (-5, 5, 5_000.0), (100, 100, 1.0), (i32::MAX - 9, i32::MAX, 31.25)]
        {
            let spacing = Spacing::from_metres(metres).expect("a multiple of a sixteenth");
            let mut post = i64::from(first);
            for run in runs(first, last, spacing) {
                assert_eq!(run.start as i64, post - i64::from(first));
                for &place_m in &run.places_m {
                    assert!((0.0..BLOCK_M as f32).contains(&place_m));
                    assert_eq!(run.corner_m + f64::from(place_m), post as f64 * metres);
                    post += 1;
                }
            }
            assert_eq!(post, i64::from(last) + 1);
        }
    }
}
