//! Terrain for web maps: the heights of the ground as colours of PNG tiles in web mercator, in one file.
//!
//! A pixel has the height of the triangle under its middle, at every level; heights stay above the datum of the
//! database. Around what is exported, and over holes, a pixel has the height 0 m, as maps draw places without tiles:
//! browsers lose the colours of transparent pixels. A tile without any ground is left out.

mod encoding;
mod mercator;

use std::io::{Seek, Write};
use std::path::Path;

use pmtiles::{PmTilesWriter, PmtResult, TileCoord, TileId, TileType};
use serde_json::{Value, json};
use terrain::HOLE_CLASS;

use crate::earth::Earth;
use crate::mbtiles::write_tables;
use crate::textures::png_of;
use crate::triangle_index::TriangleIndex;
use crate::{Datum, ExportError, Product, Work};
pub use encoding::HeightEncoding;
use mercator::{Extent, LATITUDE_MAX, lon_lat};

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
    pub const SIZES: [usize; 2] = [256, 512];
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

#[cfg(test)]
mod tests;
