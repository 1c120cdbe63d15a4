//! SRTM's HGT: big-endian 16-bit heights without any header; size and name say the rest.

use crate::directory::SampleKind;
use crate::frame::Axes;
use crate::rows::Rows;
use crate::store::Store;

/// Columns and rows of the tiles there are: 3 and 1 seconds, and 1 second north of 50 degrees with every second column.
const SIZES: [(u32, u32); 3] = [(1201, 1201), (3601, 3601), (1801, 3601)];
/// What marks a void post.
const VOID: f64 = -32768.0;

/// The rows of a tile, if the number of bytes is one of a tile.
pub(crate) fn rows(store: &Store) -> Option<Rows> {
    let (cols, rows) = SIZES.into_iter().find(|&(cols, rows)| u64::from(cols * rows) * 2 == store.len())?;
    Some(Rows {
        store: store.clone(),
        cols,
        rows,
        skipped: 0,
        row_bytes: u64::from(cols) * 2,
        kind: SampleKind::I16,
        big_endian: true,
        nodata: Some(VOID),
    })
}

/// Whether a file is meant to be a tile, by its ending.
pub(crate) fn is_named_so(name: &str) -> bool {
    name.len() > 4 && name.to_ascii_lowercase().ends_with(".hgt")
}

/// The sizes of tiles, in words.
pub(crate) fn sizes_text() -> String {
    let texts = SIZES.map(|(cols, rows)| format!("{} ({cols} x {rows} posts)", u64::from(cols * rows) * 2));
    format!("{} or {}", texts[..texts.len() - 1].join(", "), texts[texts.len() - 1])
}

/// Places of the posts of a tile of one degree whose south-west post lies at `corner`, in degrees east and north.
pub(crate) fn axes(rows: &Rows, [east, north]: [f64; 2]) -> Axes {
    let step = [1.0 / f64::from(rows.cols - 1), 1.0 / f64::from(rows.rows - 1)];
    Axes { first: [east, north + 1.0], step: [step[0], -step[1]] }
}

/// The corner in a name such as `N44E005.SRTMGL3.hgt`, in degrees east and north.
pub(crate) fn corner_in(name: &str) -> Option<[f64; 2]> {
    let name = name.to_ascii_uppercase();
    let part = |from: usize, count: usize, positive: &str, negative: &str, most: f64| {
        let sign = match name.get(from..=from)? {
            side if side == positive => 1.0,
            side if side == negative => -1.0,
            _ => return None,
        };
        let digits = name.get(from + 1..from + 1 + count).filter(|text| text.bytes().all(|b| b.is_ascii_digit()))?;
        digits.parse::<f64>().ok().filter(|&degrees| degrees <= most).map(|degrees| sign * degrees)
    };
    Some([part(3, 3, "E", "W", 180.0)?, part(0, 2, "N", "S", 90.0)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_is_named_after_its_south_west_corner() {
        assert_eq!(corner_in("N44E005.hgt"), Some([5.0, 44.0]));
        assert_eq!(corner_in("s03w120.SRTMGL3.hgt"), Some([-120.0, -3.0]));
        for other in ["tile.hgt", "N4E005.hgt", "N99E005.hgt", "N44E5.hgt", "", "É44E005"] {
            assert_eq!(corner_in(other), None, "{other}");
        }
    }
}
