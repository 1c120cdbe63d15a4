//! How many tiles suit a mesh for which none are asked.

use terrain::PostRect;

/// Cells of a tile, about: work on smaller ones is spent on borders, and larger ones share out badly.
const CELLS: f64 = 110_000.0;
/// Points of a tile, at least: with fewer, points that tiles share weigh too much.
const POINTS: f64 = 2000.0;
/// Fewer tiles than this are not worth their borders.
const TILES_MIN: f64 = 4.0;

/// Rows and columns of tiles for a mesh of so many points, from the raster's size and that number alone.
pub(crate) fn usual_tiles(rect: PostRect, points: usize) -> (u32, u32) {
    let (high, wide) = (rect.cells_high() as f64, rect.cells_wide() as f64);
    let count = (high * wide / CELLS).min(points as f64 / POINTS);
    if count < TILES_MIN {
        return (1, 1);
    }
    // Squares, but for rasters narrower than one.
    let side = (high * wide / count).sqrt();
    let across = (high.min(wide) / side + 0.5).max(1.0).floor();
    let (across, along) = (across as u32, (count / across + 0.5) as u32);
    if high < wide { (across, along) } else { (along, across) }
}

#[cfg(test)]
mod tests {
    use terrain::Post;

    use super::*;

    #[test]
    fn large_rasters_with_many_points_are_cut_and_others_are_not() {
        let tiles =
            |rows, cols, points| usual_tiles(PostRect::new(Post::new(0, 0), Post::new(rows - 1, cols - 1)), points);
        assert_eq!(tiles(1979, 1979, 76_500), (6, 6));
        assert_eq!(tiles(990, 3958, 76_500), (3, 12));
        assert_eq!(tiles(1979, 1979, 5000), (1, 1));
        assert_eq!(tiles(1979, 1979, 18_000), (3, 3));
        assert_eq!(tiles(460, 376, 100_000), (1, 1));
        assert_eq!(tiles(2, 100_000_000, 1_000_000), (1, 500));
        assert_eq!(tiles(2, 2, 4), (1, 1));
    }
}
