//! Quantized-mesh 1.0 for globes: the triangles themselves at the finest level, cut at the borders of tiles, and a
//! regular grid of heights for every tile above, up to both roots.
//!
//! Tiles cover their squares: around what is exported the ground goes on from its border and falls to the lowest
//! height, and where no source has a height the surface that closes the hole is kept; `holes.geojson` says where. A
//! tile is one surface without classes, so decks are left out; where water is, a mask says.

mod clip;
mod collar;
mod lattice;
mod tile;
pub(crate) use tile::Tile;

use std::borrow::Borrow;
use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};
use terrain::{DEGREE_M, HOLE_CLASS};

use crate::earth::{Earth, directions, earth_centred};
use crate::globe::Globe;
use crate::mesh::{Mesh, cross, minus, unit};
use crate::quantized::clip::{GONE, right, weld};
use crate::quantized::collar::{GlobeMesh, with_collar};
use crate::quantized::lattice::{Node, STEPS, height_steps, lon_lat, steps, tiles};
use crate::quantized::tile::{CELLS, WaterMask};
use crate::triangle_index::TriangleIndex;
use crate::{Datum, ExportError, Product, Put, Work};

/// Load modules along a tile of the finest level, about.
const MODULES_PER_TILE: f64 = 5.0;
/// Squares of heights along a side of a tile above the finest level.
const GRID: i64 = 64;
/// Level, column and row of a tile, these from the south-west.
pub(crate) type TileNumbers = (u32, i64, i64);
/// Levels between tiles that list those below them.
const METADATA_LEVELS: u32 = 10;

/// Writes `layer.json`, `LEVEL/COLUMN/ROW.terrain` and, where there are holes, `holes.geojson`. `assumed` is what to
/// take heights to be above; else the database says it. Returns what was done to heights.
///
/// # Errors
/// When a file cannot be written, heights cannot be brought above the ellipsoid, or the work was asked to stop.
pub fn write_quantized_mesh(
    product: &Product,
    assumed: Option<Datum>,
    put: &Put,
    work: &Work,
) -> Result<Datum, ExportError> {
    let terrain = QuantizedMesh::of(product, assumed, work)?;
    for (what, tiles) in terrain.tiles() {
        work.each(what, &tiles, |&(level, col, row)| {
            put(&format!("{level}/{col}/{row}.terrain"), &terrain.made(level, col, row))
        })?;
    }
    for name in ["holes.geojson", "layer.json"] {
        if let Some(text) = terrain.file(name) {
            put(name, &text)?;
        }
    }
    Ok(terrain.earth.datum())
}

/// A product as quantized-mesh, each file of which is made when it is asked for.
pub struct QuantizedMesh<P> {
    product: P,
    earth: Earth,
    /// A whole number of metres below all that is exported: how deep the ground around it falls.
    foot_m: f64,
    level: u32,
    /// How far from the border the ground has fallen to that, metres.
    fall_m: f64,
    bounds: Bounds,
    holes: Option<Value>,
    /// Of the finest level.
    nodes: Vec<Node>,
    triangles: Vec<[u32; 3]>,
    /// Which of them are water; empty where none is.
    wet: Vec<bool>,
    /// Triangles over each tile of the finest level, by row and column.
    of_tile: BTreeMap<[i64; 2], Vec<u32>>,
}

impl<P: Borrow<Product>> QuantizedMesh<P> {
    /// Sets a product on the globe.
    ///
    /// # Errors
    /// When heights cannot be brought above the ellipsoid, or the work was asked to stop.
    pub fn of(product: P, assumed: Option<Datum>, work: &Work) -> Result<Self, ExportError> {
        let whole: &Product = product.borrow();
        let earth = Earth::new(whole, assumed)?;
        // A tile has to cover its square, so holes keep the triangles that close them.
        let mesh = Mesh::whole(whole);
        let globe = Globe::of(whole, &mesh, &earth, work)?;
        let foot_m = globe.height_m.iter().copied().fold(f64::INFINITY, f64::min).floor();
        let level = finest_level(whole.side_m());
        let bounds = Bounds::of(&globe, level);
        let collar_m = collar_m(whole, &earth, &bounds, level)?;
        let extent_m = f64::from(whole.rect.rows().max(whole.rect.cols())) * whole.side_m();
        let holes = holes(&mesh, &globe);
        let (nodes, triangles, of_tile) = (Vec::new(), Vec::new(), BTreeMap::new());
        let mut wet: Vec<bool> = mesh.classes.iter().map(|class| whole.water.contains(class)).collect();
        if !wet.contains(&true) {
            wet.clear();
        }
        let fall_m = (2.0 * collar_m).max(0.2 * extent_m);
        let mut terrain = Self { product, earth, foot_m, level, fall_m, bounds, holes, nodes, triangles, wet, of_tile };
        let outer_m = |height_m| terrain.fallen(height_m, collar_m);
        let sheet = with_collar(terrain.product.borrow(), &mesh, &globe, &terrain.earth, collar_m, outer_m)?;
        terrain.place(sheet);
        Ok(terrain)
    }

    /// What was done to heights.
    pub(crate) fn datum(&self) -> Datum {
        self.earth.datum()
    }

    /// The bytes of a file by its name in the export; `None` where the export has none of this name.
    pub fn file(&self, name: &str) -> Option<Vec<u8>> {
        match name {
            "layer.json" => Some(format!("{:#}\n", self.layer()).into_bytes()),
            "holes.geojson" => self.holes.as_ref().map(|holes| format!("{holes}\n").into_bytes()),
            name => self.tile_named(name).map(|(level, col, row)| self.made(level, col, row)),
        }
    }

    /// Level, column and row of `LEVEL/COLUMN/ROW.terrain`, where there is such a tile.
    fn tile_named(&self, name: &str) -> Option<TileNumbers> {
        let mut parts = name.strip_suffix(".terrain")?.split('/');
        let tile = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
        let (level, col, row) = tile;
        if self.level < level || name != format!("{level}/{col}/{row}.terrain") {
            return None;
        }
        let (cols, rows) = self.bounds.tiles(self.level, level);
        let inside = |[first, last]: [i64; 2], at: i64| first <= at && at <= last;
        (inside(cols, col) && inside(rows, row)).then_some(tile)
    }

    /// All tiles, and what they are.
    pub(crate) fn tiles(&self) -> [(&'static str, Vec<TileNumbers>); 2] {
        [("tiles of triangles", self.finest_tiles()), ("tiles of heights", self.grid_tiles())]
    }

    /// The tiles that hold the triangles themselves.
    fn finest_tiles(&self) -> Vec<TileNumbers> {
        self.of_tile.keys().map(|&[row, col]| (self.level, col, row)).collect()
    }

    /// The tiles above, each a grid of heights.
    fn grid_tiles(&self) -> Vec<TileNumbers> {
        let mut all = BTreeSet::new();
        for level in 0..self.level {
            let (cols, rows) = self.bounds.tiles(self.level, level);
            all.extend((rows[0]..=rows[1]).flat_map(|row| (cols[0]..=cols[1]).map(move |col| (level, col, row))));
        }
        all.into_iter().collect()
    }

    /// The bytes of a tile that there is.
    fn made(&self, level: u32, col: i64, row: i64) -> Vec<u8> {
        let mut tile = self.tile(level, col, row);
        tile.metadata = level.is_multiple_of(METADATA_LEVELS).then(|| self.below(level, col, row));
        tile.bytes()
    }

    /// A tile that there is, without what it says of others.
    pub(crate) fn tile(&self, level: u32, col: i64, row: i64) -> Tile {
        if level < self.level { self.grid(level, col, row) } else { self.cut(col, row) }
    }

    /// A tile of the triangles themselves.
    fn cut(&self, col: i64, row: i64) -> Tile {
        let mut tile = Tile::new(self.level, col, row);
        let mut water = WaterMask::dry();
        for &triangle in self.of_tile.get(&[row, col]).into_iter().flatten() {
            let corners = self.triangles[triangle as usize].map(|v| self.nodes[v as usize]);
            tile.add(&clip::piece(corners, col, row));
            // Around what is exported there is none.
            if self.wet.get(triangle as usize) == Some(&true) {
                water.add(corners, [col * STEPS, row * STEPS]);
            }
        }
        tile.close();
        assert_eq!(tile.covered(), 1.0, "ground goes on over all of tile {}/{col}/{row}", self.level);
        tile.water = self.has_water().then_some(water);
        tile
    }

    fn has_water(&self) -> bool {
        !self.wet.is_empty()
    }

    /// Whether there is water at a longitude and latitude.
    fn is_water_at(&self, index: &mut TriangleIndex, place: [f64; 2]) -> bool {
        let product: &Product = self.product.borrow();
        let ground = self.earth.place_m(place).and_then(|place| index.at(place));
        ground.is_some_and(|ground| product.water.contains(&ground.class))
    }

    /// What a tile says of the tiles below it, down to the next that says so.
    fn below(&self, level: u32, col: i64, row: i64) -> Value {
        let ranges = |below: u32| {
            let (cols, rows) = self.bounds.tiles(self.level, below);
            let part = |at: i64, [first, last]: [i64; 2]| {
                let finer = below - level;
                [first.max(at << finer), last.min(((at + 1) << finer) - 1)]
            };
            let ([west, east], [south, north]) = (part(col, cols), part(row, rows));
            let is_any = west <= east && south <= north;
            let range = || json!({ "startX": west, "startY": south, "endX": east, "endY": north });
            is_any.then(range).into_iter().collect::<Vec<Value>>()
        };
        let last = self.level.min(level + METADATA_LEVELS);
        json!({ "available": (level + 1..=last).map(ranges).collect::<Vec<_>>() })
    }

    /// Puts ground and collar on the lattice, and finds the triangles over each tile of the finest level.
    fn place(&mut self, sheet: GlobeMesh) {
        let node = |v: usize| {
            let [x, y] = steps(self.level, sheet.lon_lat[v]);
            Node { x, y, h: height_steps(sheet.height_m[v]), normal: sheet.normal[v] }
        };
        self.nodes = (0..sheet.lon_lat.len()).map(node).collect();
        self.triangles = sheet.triangles;
        // Before tiles are cut: so they agree on what lies along the lines between them.
        weld(&self.nodes, &mut self.triangles);
        right(&self.nodes, &mut self.triangles);
        let (cols, rows) = self.bounds.tiles(self.level, self.level);
        for (index, triangle) in (0..).zip(&self.triangles).filter(|(_, triangle)| **triangle != GONE) {
            let triangle = triangle.map(|v| self.nodes[v as usize]);
            let range = |of: fn(&Node) -> i64, [first, last]: [i64; 2]| {
                let values = || triangle.iter().map(of);
                let tiles = tiles(values().min().unwrap_or(0), values().max().unwrap_or(0));
                *tiles.start().max(&first)..=*tiles.end().min(&last)
            };
            for row in range(|node| node.y, rows) {
                for col in range(|node| node.x, cols) {
                    self.of_tile.entry([row, col]).or_default().push(index);
                }
            }
        }
    }

    /// A tile of heights at the corners of squares, and of normals across them.
    fn grid(&self, level: u32, col: i64, row: i64) -> Tile {
        let at = |tile: i64, index: i64| tile * STEPS + (index * STEPS + GRID / 2).div_euclid(GRID);
        // One more line on every side, for normals that agree with the neighbours'.
        let samples: Vec<[f64; 2]> = (-1..=GRID + 1)
            .flat_map(|j| (-1..=GRID + 1).map(move |i| (i, j)))
            .map(|(i, j)| lon_lat(level, [at(col, i), at(row, j)]))
            .collect();
        let mut index = TriangleIndex::new(self.product.borrow());
        let heights: Vec<f64> = samples.iter().map(|&place| self.height_at(&mut index, place)).collect();
        let wide = (GRID + 3) as usize;
        let number = |i: i64, j: i64| (j + 1) as usize * wide + (i + 1) as usize;
        let place = |i: i64, j: i64| {
            let [longitude, latitude] = samples[number(i, j)];
            earth_centred([longitude, latitude.clamp(-90.0, 90.0)], heights[number(i, j)])
        };
        let node = |i: i64, j: i64| {
            let across = cross(minus(place(i + 1, j), place(i - 1, j)), minus(place(i, j + 1), place(i, j - 1)));
            let level_ground = across == [0.0; 3];
            let normal = if level_ground { directions(samples[number(i, j)])[2] } else { unit(across) };
            Node { x: at(col, i), y: at(row, j), h: height_steps(heights[number(i, j)]), normal }
        };
        let mut tile = Tile::new(level, col, row);
        for (i, j) in (0..GRID).flat_map(|j| (0..GRID).map(move |i| (i, j))) {
            tile.add(&[node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)]);
        }
        let middle = |tile: i64, cell: i64| tile * STEPS + (2 * cell + 1) * STEPS / (2 * CELLS);
        let mut is_water =
            |i: i64, j: i64| self.is_water_at(&mut index, lon_lat(level, [middle(col, i), middle(row, j)]));
        tile.water = self.has_water().then(|| WaterMask::of(&mut is_water));
        tile
    }

    /// The height so far outside of a border of this height.
    fn fallen(&self, border_m: f64, outside_m: f64) -> f64 {
        border_m + (outside_m / self.fall_m).min(1.0) * (self.foot_m - border_m)
    }

    /// Height above the ellipsoid at a longitude and latitude, on what is exported or around it.
    fn height_at(&self, index: &mut TriangleIndex, place: [f64; 2]) -> f64 {
        let product: &Product = self.product.borrow();
        let rect = product.rect;
        let (low, high) = (product.corner_m(rect.south, rect.west), product.corner_m(rect.north, rect.east));
        let Some(place) = self.earth.place_m(place) else { return self.foot_m };
        let beyond = |axis: usize| (low[axis] - place[axis]).max(place[axis] - high[axis]);
        let outside_m = beyond(0).max(beyond(1)).max(0.0);
        // Far away a system may give anything, or nothing.
        if !outside_m.is_finite() || self.fall_m <= outside_m {
            return self.foot_m;
        }
        let inside = [0, 1].map(|axis| place[axis].clamp(low[axis], high[axis]));
        let height = index.at(inside).map_or(0.0, |ground| ground.height_m);
        let above = self.earth.lon_lat(inside).map_or(0.0, |place| self.earth.datum_m(place));
        self.fallen(height + above, outside_m)
    }

    fn layer(&self) -> Value {
        let available = |level: u32| {
            let ([first_col, last_col], [first_row, last_row]) = self.bounds.tiles(self.level, level);
            json!([{ "startX": first_col, "startY": first_row, "endX": last_col, "endY": last_row }])
        };
        let product: &Product = self.product.borrow();
        let area = &product.manifest.area;
        let extensions: Vec<&str> = match self.has_water() {
            true => vec!["octvertexnormals", "watermask", "metadata"],
            false => vec!["octvertexnormals", "metadata"],
        };
        let of_holes = if self.holes.is_some() { "; holes are closed, holes.geojson says where" } else { "" };
        json!({
            "tilejson": "2.1.0",
            "name": area.name,
            "description": format!("from {}; {}{of_holes}", area.crs, self.earth.datum().said()),
            "version": "1.0.0",
            "format": "quantized-mesh-1.0",
            "scheme": "tms",
            "projection": "EPSG:4326",
            "tiles": ["{z}/{x}/{y}.terrain"],
            "extensions": extensions,
            "metadataAvailability": METADATA_LEVELS,
            "attribution": product.attributions().join("; "),
            "bounds": self.bounds.degrees,
            "minzoom": 0,
            "maxzoom": self.level,
            "available": (0..=self.level).map(available).collect::<Vec<_>>(),
        })
    }
}

/// The level whose tiles are some load modules wide.
fn finest_level(side_m: f64) -> u32 {
    let level = (180.0 * DEGREE_M / (MODULES_PER_TILE * side_m)).log2().ceil();
    level.clamp(1.0, 20.0) as u32
}

/// Lowest and highest steps of the finest level, east and north.
struct Bounds {
    x: (i64, i64),
    y: (i64, i64),
    /// West, south, east and north in degrees.
    degrees: [f64; 4],
}

impl Bounds {
    /// Those of all vertices on the globe.
    fn of(globe: &Globe, level: u32) -> Self {
        let places: Vec<[i64; 2]> = globe.lon_lat.iter().map(|&place| steps(level, place)).collect();
        let range = |axis: usize| {
            let values = || places.iter().map(|place| place[axis]);
            (values().min().unwrap_or(0), values().max().unwrap_or(0))
        };
        let degrees = |axis: usize| {
            let values = || globe.lon_lat.iter().map(|place| place[axis]);
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
        };
        let ([west, east], [south, north]) = (degrees(0), degrees(1));
        Self { x: range(0), y: range(1), degrees: [west, south, east, north] }
    }

    /// First and last column and row of the tiles of a level.
    fn tiles(&self, finest: u32, level: u32) -> ([i64; 2], [i64; 2]) {
        let range = |(low, high): (i64, i64)| {
            let tiles = tiles(low, high);
            [tiles.start() >> (finest - level), tiles.end() >> (finest - level)]
        };
        if level == 0 { ([0, 1], [0, 0]) } else { (range(self.x), range(self.y)) }
    }
}

/// The steps at which tiles begin and end.
fn ends([first, last]: [i64; 2]) -> [i64; 2] {
    [first * STEPS, (last + 1) * STEPS]
}

fn too_wide(product: &Product) -> ExportError {
    ExportError::Impossible {
        what: "the area".into(),
        found: format!("ground around it that {} does not reach", product.crs()),
        expected: "an area well inside its coordinate system".into(),
        hint: "export a smaller block with --modules".into(),
    }
}

/// How far ground has to go on around what is exported, so that it covers every tile of the finest level to its
/// borders; these need not run along the sides of the area.
fn collar_m(product: &Product, earth: &Earth, bounds: &Bounds, level: u32) -> Result<f64, ExportError> {
    /// Places looked at along a border of all tiles together.
    const LOOKS: i64 = 256;
    const MARGIN_M: f64 = 10.0;
    let (cols, rows) = bounds.tiles(level, level);
    let ([west, east], [south, north]) = (ends(cols), ends(rows));
    let rect = product.rect;
    let low = product.corner_m(rect.south, rect.west);
    let high = product.corner_m(rect.north, rect.east);
    let along = |from: i64, to: i64, look: i64| from + (to - from) * look / LOOKS;
    let looks = (0..=LOOKS).flat_map(|look| {
        let (x, y) = (along(west, east, look), along(south, north, look));
        [[x, south], [x, north], [west, y], [east, y]]
    });
    let mut collar_m = MARGIN_M;
    for steps in looks {
        let place = earth.place_m(lon_lat(level, steps)).ok_or_else(|| too_wide(product))?;
        for axis in 0..2 {
            collar_m = collar_m.max(low[axis] - place[axis] + MARGIN_M).max(place[axis] - high[axis] + MARGIN_M);
        }
    }
    Ok(collar_m)
}

/// The triangles over holes, as longitudes and latitudes; `None` without any.
fn holes(mesh: &Mesh, globe: &Globe) -> Option<Value> {
    let triangles = mesh.triangles.iter().zip(&mesh.classes).filter(|(_, class)| **class == HOLE_CLASS);
    let polygons: Vec<Value> = triangles
        .map(|(&[a, b, c], _)| {
            let ring = [a, b, c, a].map(|v| globe.lon_lat[v as usize]);
            json!([ring])
        })
        .collect();
    let geometry = || json!({ "type": "MultiPolygon", "coordinates": polygons });
    (!polygons.is_empty()).then(|| {
        json!({
            "type": "FeatureCollection",
            "features": [{ "type": "Feature", "properties": { "class": "hole" }, "geometry": geometry() }],
        })
    })
}

#[cfg(test)]
mod tests;
