//! Web mercator: the world as a square from 0 to 1, x east from 180 degrees west, y south from the northern border.

use std::f64::consts::PI;

/// Latitude of the northern border in degrees.
pub(crate) const LATITUDE_MAX: f64 = 85.051_128_779_806_59;
/// Metres around the equator, as web mercator has it.
const AROUND_M: f64 = 2.0 * PI * 6_378_137.0;

/// The place of a longitude and latitude in degrees.
pub(crate) fn place([longitude, latitude]: [f64; 2]) -> [f64; 2] {
    [(longitude + 180.0) / 360.0, (1.0 - latitude.to_radians().tan().asinh() / PI) / 2.0]
}

/// Longitude and latitude in degrees of a place.
pub(crate) fn lon_lat([x, y]: [f64; 2]) -> [f64; 2] {
    [x * 360.0 - 180.0, (PI * (1.0 - 2.0 * y)).sinh().atan().to_degrees()]
}

/// Places along the sides of a product.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extent {
    /// Of the north-western corner.
    pub low: [f64; 2],
    /// Of the south-eastern corner.
    pub high: [f64; 2],
}

impl Extent {
    /// That of longitudes and latitudes.
    pub(crate) fn of(lon_lats: &[[f64; 2]]) -> Self {
        let places: Vec<[f64; 2]> = lon_lats.iter().map(|&of| place(of)).collect();
        let end =
            |axis: usize, start: f64, of: fn(f64, f64) -> f64| places.iter().map(|place| place[axis]).fold(start, of);
        Self {
            low: [0, 1].map(|axis| end(axis, f64::INFINITY, f64::min)),
            high: [0, 1].map(|axis| end(axis, f64::NEG_INFINITY, f64::max)),
        }
    }

    /// West, south, east and north in degrees.
    pub(crate) fn degrees(&self) -> [f64; 4] {
        let ([west, north], [east, south]) = (lon_lat(self.low), lon_lat(self.high));
        [west, south, east, north]
    }

    /// The first level at which no pixel of tiles with so many on a side is larger than `pixel_m`.
    pub(crate) fn finest_level(&self, pixels: usize, pixel_m: f64) -> u32 {
        const LEVEL_MAX: f64 = 22.0;
        let [_, south, _, north] = self.degrees();
        let latitude = if south < 0.0 && 0.0 < north { 0.0 } else { south.abs().min(north.abs()) };
        let tiles = AROUND_M * latitude.to_radians().cos() / (pixels as f64 * pixel_m);
        tiles.log2().ceil().clamp(0.0, LEVEL_MAX) as u32
    }

    /// The last level at which it is no wider and higher than a tile, and no finer than `finest`.
    pub(crate) fn coarsest_level(&self, finest: u32) -> u32 {
        let side = (self.high[0] - self.low[0]).max(self.high[1] - self.low[1]);
        (1.0 / side).log2().floor().clamp(0.0, f64::from(finest)) as u32
    }

    /// Columns and rows of the tiles of a level that it meets.
    pub(crate) fn tiles(&self, level: u32) -> [std::ops::RangeInclusive<u32>; 2] {
        let count = 1_u32 << level;
        let tile = |place: f64| ((place * f64::from(count)) as u32).min(count - 1);
        [0, 1].map(|axis| tile(self.low[axis])..=tile(self.high[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_world_is_a_square_and_places_come_back() {
        assert_eq!(place([-180.0, 0.0]), [0.0, 0.5]);
        assert!(place([0.0, LATITUDE_MAX])[1].abs() < 1e-12);
        let back = lon_lat(place([-116.5, 35.25]));
        assert!((back[0] + 116.5).abs() < 1e-12 && (back[1] - 35.25).abs() < 1e-12);
    }

    #[test]
    fn levels_go_from_one_tile_to_pixels_no_larger_than_posts() {
        let extent = Extent::of(&[[-116.9, 35.0], [-116.4, 35.4]]);
        let finest = extent.finest_level(512, 25.0);
        assert_eq!((extent.coarsest_level(finest), finest), (9, 12));
        let [cols, rows] = extent.tiles(9);
        assert!(cols.count() <= 2 && rows.count() <= 2);
        // Smaller than a pixel is still in some tile.
        let dot = Extent::of(&[[10.0, 10.0], [10.000_001, 10.000_001]]);
        assert_eq!(dot.coarsest_level(dot.finest_level(256, 25.0)), 13);
    }
}
