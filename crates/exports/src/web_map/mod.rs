//! Terrain for web maps: the heights of the ground as colours of PNG tiles in web mercator, in one file.
//!
//! A pixel has the height of the triangle under its middle, at every level; heights stay above the datum of the
//! database. Around what is exported, and over holes, a pixel has the height 0 m, as maps draw places without tiles:
//! browsers lose the colours of transparent pixels. A tile without any ground is left out.
//!
//! Web mercator is the world as a square from 0 to 1, x east from 180 degrees west, y south from the northern border.

use std::f64::consts::PI;
use std::io::{Seek, Write};
use std::path::Path;

use pmtiles::{PmTilesWriter, PmtResult, TileCoord, TileId, TileType};
use serde_json::{Value, json};
use terrain::HOLE_CLASS;

use crate::archives::write_tables;
use crate::earth::Earth;
use crate::textures::png_of;
use crate::triangle_index::TriangleIndex;
use crate::{Datum, ExportError, Product, Work};

/// Height of pixels outside of what is exported and over holes, in metres.
const OUTSIDE_M: f64 = 0.0;

/// How terrain for web maps is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WebMap {
    /// How heights become colours.
    pub encoding: HeightEncoding,
    /// Pixels along a side of a tile.
    pub pixels: usize,
}

impl WebMap {
    /// The sides of a tile that maps take, in pixels.
    pub(crate) const SIZES: [usize; 2] = [256, 512];
}

/// Writes the tiles as MBTiles 1.3 at `path`.
///
/// # Errors
/// When the area has no place on the map, the file cannot be written, or the work was asked to stop.
pub fn write_web_mbtiles(path: &Path, product: &Product, map: WebMap, work: &Work) -> Result<(), ExportError> {
    let pyramid = Pyramid::of(product, map)?;
    let tiles = pyramid.tiles(work)?;
    // Rows of MBTiles count from the south.
    let numbered = tiles.iter().map(|(at, bytes)| {
        let last_row = (1_i64 << at.level) - 1;
        ([i64::from(at.level), at.col.into(), last_row - i64::from(at.row)], bytes.as_slice())
    });
    let about: Vec<(&str, String)> = pyramid
        .about()
        .into_iter()
        .map(|(name, value)| (name, value.as_str().map_or_else(|| value.to_string(), str::to_owned)))
        .chain([("bounds", joined(&pyramid.extent.degrees())), ("center", joined(&pyramid.center()))])
        .collect();
    write_tables(path, &about, numbered)
}

/// Writes the tiles as PMTiles 3.
///
/// # Errors
/// When the area has no place on the map, `out` cannot be written, or the work was asked to stop.
pub fn write_pmtiles(
    out: &mut (impl Write + Seek),
    product: &Product,
    map: WebMap,
    work: &Work,
) -> Result<(), ExportError> {
    let pyramid = Pyramid::of(product, map)?;
    let tiles = pyramid.tiles(work)?;
    pyramid.archive(out, &tiles).map_err(|error| ExportError::write("PMTiles")(std::io::Error::other(error)))
}

fn joined(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}

/// A tile's level, column from the west and row from the north.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Square {
    level: u32,
    col: u32,
    row: u32,
}

/// The tiles of a product, level by level.
struct Pyramid<'a> {
    product: &'a Product,
    map: WebMap,
    earth: Earth,
    extent: Extent,
    coarsest: u32,
    finest: u32,
}

impl<'a> Pyramid<'a> {
    fn of(product: &'a Product, map: WebMap) -> Result<Self, ExportError> {
        if !WebMap::SIZES.contains(&map.pixels) {
            return Err(ExportError::Impossible {
                what: "the size of a tile".into(),
                found: format!("{} pixels", map.pixels),
                expected: "256 or 512".into(),
                hint: "maps take these sizes only; leave --size out for 512".into(),
            });
        }
        // Heights stay as they are, so their datum does not matter.
        let earth = Earth::new(product, Some(Datum::Ellipsoid))?;
        let outline = earth.outline();
        let beyond = outline.iter().map(|place| place[1]).find(|latitude| LATITUDE_MAX < latitude.abs());
        if let Some(latitude) = beyond {
            return Err(ExportError::Impossible {
                what: "the area".into(),
                found: format!("ground at the latitude {latitude:.3}"),
                expected: "ground between 85.05 degrees south and north, where web mercator ends".into(),
                hint: "export a GeoTIFF, or 3D Tiles for a globe".into(),
            });
        }
        let extent = Extent::of(outline);
        let finest = extent.finest_level(map.pixels, product.frame.spacing.metres());
        let coarsest = extent.coarsest_level(finest);
        Ok(Self { product, map, earth, extent, coarsest, finest })
    }

    /// All tiles with ground, in the order of PMTiles: from coarse to fine, along a Hilbert curve.
    fn tiles(&self, work: &Work) -> Result<Vec<(Square, Vec<u8>)>, ExportError> {
        let mut squares = Vec::new();
        for level in self.coarsest..=self.finest {
            let [cols, rows] = self.extent.tiles(level);
            squares.extend(rows.flat_map(|row| cols.clone().map(move |col| Square { level, col, row })));
        }
        squares.sort_by_key(|&square| coord(square).map_or(u64::MAX, |coord| TileId::from(coord).value()));
        let made = work.each("tiles", &squares, |&square| {
            let Some(colors) = self.colors(square) else { return Ok(None) };
            let bytes = png_of([self.map.pixels; 2], &colors, |encoder| encoder.set_color(png::ColorType::Rgb))?;
            Ok(Some((square, bytes)))
        })?;
        Ok(made.into_iter().flatten().collect())
    }

    /// Red, green and blue of each pixel, row by row from the north; `None` where none has any ground.
    fn colors(&self, square: Square) -> Option<Vec<u8>> {
        let pixels = self.map.pixels;
        let side = f64::from(1_u32 << square.level) * pixels as f64;
        let middle = |tile: u32, pixel: usize| ((tile as usize * pixels + pixel) as f64 + 0.5) / side;
        let mut index = TriangleIndex::new(self.product);
        let (mut colors, mut is_empty) = (Vec::with_capacity(3 * pixels * pixels), true);
        for (line, col) in (0..pixels).flat_map(|line| (0..pixels).map(move |col| (line, col))) {
            let place = lon_lat([middle(square.col, col), middle(square.row, line)]);
            let ground = self.earth.place_m(place).and_then(|place| index.at(place));
            let ground = ground.filter(|ground| ground.class != HOLE_CLASS);
            is_empty &= ground.is_none();
            colors.extend(self.map.encoding.color(ground.map_or(OUTSIDE_M, |ground| ground.height_m)));
        }
        (!is_empty).then_some(colors)
    }

    /// Longitude, latitude and level of a view of all of it.
    fn center(&self) -> [f64; 3] {
        let [west, south, east, north] = self.extent.degrees();
        [west.midpoint(east), south.midpoint(north), self.coarsest.into()]
    }

    /// What is said of all tiles.
    fn about(&self) -> Vec<(&'static str, Value)> {
        let area = &self.product.manifest.area;
        let above = match self.product.vertical_datum() {
            "" => "an unknown datum",
            name => name,
        };
        let encoding = self.map.encoding;
        vec![
            ("name", json!(area.name)),
            ("format", json!("png")),
            ("type", json!("baselayer")),
            ("version", json!("1")),
            ("description", json!(format!("heights in metres above {above}; {}", encoding.formula()))),
            ("attribution", json!(self.product.attributions().join("; "))),
            ("minzoom", json!(self.coarsest)),
            ("maxzoom", json!(self.finest)),
            ("encoding", json!(encoding.name())),
            ("tile_size", json!(self.map.pixels)),
            ("outside_m", json!(OUTSIDE_M)),
            ("vertical_datum", json!(self.product.vertical_datum())),
        ]
    }

    fn archive(&self, out: &mut (impl Write + Seek), tiles: &[(Square, Vec<u8>)]) -> PmtResult<()> {
        let [west, south, east, north] = self.extent.degrees();
        let [longitude, latitude, _] = self.center();
        let about: serde_json::Map<String, Value> =
            self.about().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        let mut writer = PmTilesWriter::new(TileType::Png)
            .min_zoom(self.coarsest as u8)
            .max_zoom(self.finest as u8)
            .bounds(west, south, east, north)
            .center(longitude, latitude)
            .center_zoom(self.coarsest as u8)
            .metadata(Value::Object(about).to_string())
            .create(out)?;
        for (square, bytes) in tiles {
            writer.add_tile(coord(*square)?, bytes)?;
        }
        writer.finalize()
    }
}

fn coord(square: Square) -> PmtResult<TileCoord> {
    TileCoord::new(square.level as u8, square.col, square.row)
}

/// Latitude of the northern border in degrees.
const LATITUDE_MAX: f64 = 85.051_128_779_806_59;
/// Metres around the equator, as web mercator has it.
const AROUND_M: f64 = 2.0 * PI * 6_378_137.0;

/// The place of a longitude and latitude in degrees.
fn on_map([longitude, latitude]: [f64; 2]) -> [f64; 2] {
    [(longitude + 180.0) / 360.0, (1.0 - latitude.to_radians().tan().asinh() / PI) / 2.0]
}

/// Longitude and latitude in degrees of a place.
fn lon_lat([x, y]: [f64; 2]) -> [f64; 2] {
    [x * 360.0 - 180.0, (PI * (1.0 - 2.0 * y)).sinh().atan().to_degrees()]
}

/// Places along the sides of a product.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Extent {
    /// Of the north-western corner.
    pub low: [f64; 2],
    /// Of the south-eastern corner.
    pub high: [f64; 2],
}

impl Extent {
    /// That of longitudes and latitudes.
    pub(crate) fn of(lon_lats: &[[f64; 2]]) -> Self {
        let places: Vec<[f64; 2]> = lon_lats.iter().map(|&of| on_map(of)).collect();
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

/// How a height becomes red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeightEncoding {
    /// Mapbox Terrain-RGB: tenths of a metre above -10,000 m.
    Mapbox,
    /// Terrarium: 256ths of a metre above -32,768 m.
    Terrarium,
}

impl HeightEncoding {
    /// What programs call it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mapbox => "mapbox",
            Self::Terrarium => "terrarium",
        }
    }

    /// How a reader gets the height back.
    pub(crate) fn formula(self) -> &'static str {
        match self {
            Self::Mapbox => "height = -10000 + 0.1 * (65536 * red + 256 * green + blue)",
            Self::Terrarium => "height = 256 * red + green + blue / 256 - 32768",
        }
    }

    /// The lowest height, and steps to a metre.
    fn scale(self) -> (f64, f64) {
        match self {
            Self::Mapbox => (-10_000.0, 10.0),
            Self::Terrarium => (-32_768.0, 256.0),
        }
    }

    /// Red, green and blue of the step next to a height in metres.
    pub(crate) fn color(self, height_m: f64) -> [u8; 3] {
        const STEPS_MAX: f64 = 16_777_215.0;
        let (lowest_m, steps_per_m) = self.scale();
        let step = ((height_m - lowest_m) * steps_per_m).round().clamp(0.0, STEPS_MAX) as u32;
        let [_, red, green, blue] = step.to_be_bytes();
        [red, green, blue]
    }
}

#[cfg(test)]
mod tests;
