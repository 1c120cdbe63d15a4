//! Ground for tests.

use terrain::{Dem, Metres, Post, PostRect, Tin};

use crate::methods::DemWindow;

/// Heights of `rows` x `cols` posts, in quanta.
pub fn dem(rows: usize, cols: usize, mut height: impl FnMut(Post) -> i32) -> Dem {
    Dem::from_fn(PostRect::of_size(rows, cols), |post| Some(height(post)))
}

/// The ground of a window, its posts 25 m apart.
pub fn ground(dem: &Dem) -> DemWindow<'_> {
    DemWindow { dem, spacing: Metres(25.0) }
}

/// Metres as quanta.
pub fn metres(metres: f64) -> i32 {
    terrain::quanta_of_metres(metres).expect("a number of the test")
}

/// Hills of every size: noise whose waves halve in length and height, the same on any machine.
pub fn rough(rows: usize, cols: usize) -> Dem {
    let wave = |octave: i32| (64.0 / f64::from(1 << octave), 120.0 / f64::from(1 << octave));
    dem(rows, cols, |post| {
        let octaves = (0..6).map(|octave| {
            let (length, height) = wave(octave);
            height * noise(octave, f64::from(post.row) / length, f64::from(post.col) / length)
        });
        metres(octaves.sum())
    })
}

/// Between 0 and 1, smooth between random values at whole places.
fn noise(octave: i32, row: f64, col: f64) -> f64 {
    let (low_row, low_col) = (row.floor(), col.floor());
    let smooth = |share: f64| share * share * (3.0 - 2.0 * share);
    let (up, right) = (smooth(row - low_row), smooth(col - low_col));
    let at = |r: f64, c: f64| draw(octave, (low_row + r) as i32, (low_col + c) as i32);
    let along = |r: f64| at(r, 0.0) * (1.0 - right) + at(r, 1.0) * right;
    along(0.0) * (1.0 - up) + along(1.0) * up
}

/// SplitMix64 of a place.
fn draw(octave: i32, row: i32, col: i32) -> f64 {
    let mut z = (octave as u64) << 48 ^ (row as u64) << 24 ^ col as u64;
    z = z.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)) as f64 / u64::MAX as f64
}

/// RMS residual of a TIN in metres, from the posts its triangles own.
pub fn rms_m(dem: &Dem, tin: &Tin) -> f64 {
    let (posts, squares) = crate::methods::squares::of_tin(dem, tin);
    (squares as f64 / posts as f64).sqrt() / 128.0
}
