//! What every GeoTIFF that is written has in common: floats as they deflate best, and where posts lie.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use terrain::{GridFrame, Post, PostRect};

/// Appends a row of floats under TIFF's predictor 3: the bytes of the row by significance, highest first, each as the
/// step from the one before.
pub fn put_predicted(bytes: &mut Vec<u8>, row: &[f32]) {
    let mut before = 0;
    for byte in 0..4 {
        for value in row {
            let next = value.to_be_bytes()[byte];
            bytes.push(next.wrapping_sub(before));
            before = next;
        }
    }
}

/// The bytes of a strip or tile, deflated.
pub fn deflate(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    written.expect("writing to memory cannot fail")
}

/// The GeoKey that says in what heights are, and its value for metres.
pub const VERTICAL_UNIT: [u16; 4] = [4099, 0, 1, METRE];
const METRE: u16 = 9001;

/// The GeoKeys of a projected system in metres, without the head of their list.
pub fn projected_keys(epsg: u16) -> [[u16; 4]; 4] {
    const PROJECTED: u16 = 1;
    const PIXEL_IS_AREA: u16 = 1;
    [[1024, 0, 1, PROJECTED], [1025, 0, 1, PIXEL_IS_AREA], [3072, 0, 1, epsg], [3076, 0, 1, METRE]]
}

/// The scale of a pixel, and the tie point of a raster of the posts `rect` of a grid.
pub fn scale_and_tie_point(grid: &GridFrame, rect: PostRect) -> ([f64; 3], [f64; 6]) {
    let spacing_m = grid.spacing.metres();
    // A post is the centre of its pixel, so the raster's corner lies half a post beyond the north-west post.
    let [east_m, north_m] = grid.place_m(Post::new(rect.north, rect.west));
    let corner = [0.0, 0.0, 0.0, east_m - spacing_m / 2.0, north_m + spacing_m / 2.0, 0.0];
    ([spacing_m, spacing_m, 0.0], corner)
}
