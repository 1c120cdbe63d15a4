//! Numbers of a byte at each place of a grid, as a GeoTIFF: what is seen from somewhere.

use std::io::{Result, Seek, Write};

use source_files::write_bytes;
use terrain::{GridFrame, PostRect, Spacing};

/// Where the numbers lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByteRaster {
    /// Easting and northing of the south-western place.
    pub origin_m: [f64; 2],
    /// Between neighbouring places.
    pub spacing: Spacing,
    /// Places across and up.
    pub size: [usize; 2],
    /// The coordinate system, EPSG:this.
    pub epsg: u16,
    /// Numbers at each place.
    pub bands: u16,
}

/// Writes the numbers. `rows` is asked for one band of rows after another, by the first and the last of them counted
/// from the north, and gives their numbers row by row from the north, those of a place one behind
/// the other.
///
/// # Errors
/// Those of `out`.
pub fn write_byte_raster(
    out: &mut (impl Write + Seek),
    raster: &ByteRaster,
    mut rows: impl FnMut(usize, usize) -> Vec<u8>,
) -> Result<()> {
    let ByteRaster { origin_m: [origin_east_m, origin_north_m], spacing, size: [wide, high], epsg, bands } = *raster;
    let frame = GridFrame { origin_east_m, origin_north_m, spacing };
    write_bytes(out, &frame, PostRect::of_size(high, wide), epsg, bands, |band| {
        let from_north = |row: i32| high - 1 - row as usize;
        let numbers = rows(from_north(band.north), from_north(band.south));
        // The writer takes them from the south.
        numbers.rchunks(usize::from(bands) * wide).flatten().copied().collect()
    })
}
