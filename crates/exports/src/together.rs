//! Several areas as one tileset of 3D Tiles: an index, below it a tileset for each area in a folder of its number.
//!
//! Where areas overlap, the finer one's ground is there and the coarser one's is not, down to the border of the finer.
//! One grid of the geoid is under all, so areas with the same points on a common border meet there.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};
use source_files::Crs;
use store::Manifest;
use terrain::ModuleRect;

use crate::borders::{Border, Gap};
use crate::covered::{Cover, Covered, take_out};
use crate::tiles3d::write_on;
use crate::{Datum, Earth, ExportError, Product, Put, Work};

/// Areas that become one tileset, each of which is read when it is written.
pub struct Together {
    areas: Vec<Footing>,
    /// The areas by their number, the finest first.
    order: Vec<usize>,
    /// What of the index is written, by the number of the area.
    tiles: Vec<Option<Value>>,
    bytes: AtomicU64,
}

/// An area on the globe.
struct Footing {
    manifest: Manifest,
    crs: Crs,
    earth: Option<Earth>,
    /// Its ground along its sides, once it is written.
    border: Option<Border>,
}

/// What was written of an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrittenArea {
    /// What was done to heights.
    pub datum: Datum,
    /// What of it lies under finer areas.
    pub covered: Covered,
}

impl Together {
    /// Sets areas on the globe, each with the name that messages have for it. `assumed` is what to take the heights of
    /// all to be above; else each says it.
    ///
    /// # Errors
    /// When one cannot be set on the globe, or is there twice.
    pub fn of(named: Vec<(String, Manifest)>, assumed: Option<Datum>) -> Result<Self, ExportError> {
        for (place, (name, manifest)) in named.iter().enumerate() {
            if let Some((other, _)) = named[..place].iter().find(|(_, other)| other == manifest) {
                return Err(ExportError::Impossible {
                    what: format!("{other} and {name}"),
                    found: "the same database twice".into(),
                    expected: "each once".into(),
                    hint: "leave one of them out".into(),
                });
            }
        }
        let mut areas = Vec::with_capacity(named.len());
        let mut earths = Vec::with_capacity(named.len());
        for (name, manifest) in named {
            let area = &manifest.area;
            let rect = ModuleRect { south: 0, west: 0, north: area.module_rows, east: area.module_cols };
            let earth = Earth::under(area, rect, assumed).map_err(|error| error.of(&name))?;
            areas.push(Footing { crs: earth.crs().clone(), manifest, earth: None, border: None });
            earths.push(earth);
        }
        areas.iter_mut().zip(Earth::together(earths)).for_each(|(area, earth)| area.earth = Some(earth));
        let mut order: Vec<usize> = (0..areas.len()).collect();
        order.sort_by(|&a, &b| areas[a].coarseness().partial_cmp(&areas[b].coarseness()).unwrap_or(a.cmp(&b)));
        let tiles = areas.iter().map(|_| None).collect();
        Ok(Self { areas, order, tiles, bytes: AtomicU64::new(0) })
    }

    /// Writes the files of the area of a number, counted from 0, which is read already.
    ///
    /// # Errors
    /// When a file cannot be written, or the work was asked to stop.
    pub fn write(
        &mut self,
        number: usize,
        mut product: Product,
        put: &Put,
        work: &Work,
    ) -> Result<WrittenArea, ExportError> {
        let finer = self.order.iter().take_while(|&&other| other != number).map(|&other| &self.areas[other]);
        let own = &self.areas[number].crs;
        let covers: Vec<Cover> = finer.map(|of| Cover::of(own, &of.crs, &of.manifest.area)).collect();
        let covered = take_out(&mut product, &covers)?;
        let earth = self.areas[number].earth.take().expect("an area is written once");
        let part = WrittenArea { datum: earth.datum(), covered };
        if covered.left_out == product.modules.len() {
            return Ok(part);
        }
        self.areas[number].border = Some(Border::of(&product, &earth)?);
        let folder = number + 1;
        let index = Mutex::new(Value::Null);
        let put = |name: &str, bytes: &[u8]| {
            if name == "tileset.json" {
                let read = serde_json::from_slice(bytes).map_err(|error| ExportError::write(name)(error.into()))?;
                *index.lock().unwrap_or_else(PoisonError::into_inner) = read;
            }
            self.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
            put(&format!("{folder}/{name}"), bytes)
        };
        write_on(&product, earth, &put, work)?;
        let index = index.into_inner().unwrap_or_else(PoisonError::into_inner);
        self.tiles[number] = Some(json!({
            "boundingVolume": index["root"]["boundingVolume"],
            "geometricError": index["geometricError"],
            "content": { "uri": format!("{folder}/tileset.json") },
        }));
        Ok(part)
    }

    /// How areas that are written, of one coordinate system, gape along common borders; nothing of those that meet.
    pub fn gaps(&self) -> Vec<Gap> {
        let pairs = (0..self.areas.len()).flat_map(|one| (one + 1..self.areas.len()).map(move |other| [one, other]));
        let gap = |numbers: [usize; 2]| {
            let [one, other] = numbers.map(|number| &self.areas[number]);
            let borders = [one.border.as_ref()?, other.border.as_ref()?];
            (one.crs == other.crs).then(|| Border::gap(numbers, borders)).flatten()
        };
        pairs.filter_map(gap).collect()
    }

    /// Writes the index, when all areas are; the bytes of all files.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(self, put: &Put) -> Result<u64, ExportError> {
        let tiles: Vec<Value> = self.order.iter().filter_map(|&number| self.tiles[number].clone()).collect();
        // As in the tileset of one area, all is missing where nothing is drawn.
        let missing_m: f64 = tiles.iter().filter_map(|tile| tile["geometricError"].as_f64()).sum();
        let of = |number: usize| {
            let area = &self.areas[number].manifest.area;
            json!({ "folder": (number + 1).to_string(), "area": area.name, "spacing_m": area.spacing_m })
        };
        let areas: Vec<Value> = (0..self.areas.len()).filter(|&number| self.tiles[number].is_some()).map(of).collect();
        let index = json!({
            "asset": { "version": "1.1", "extras": { "generator": "tiefort", "areas": areas } },
            "geometricError": missing_m,
            "root": {
                "boundingVolume": { "region": around(&tiles) },
                "geometricError": missing_m,
                "refine": "REPLACE",
                "children": tiles,
            },
        });
        let text = index.to_string();
        put("tileset.json", text.as_bytes())?;
        Ok(self.bytes.into_inner() + text.len() as u64)
    }

    /// The numbers of the areas, counted from 0, the finest first: in the order of their spacing, then of the metres
    /// between their points, then as they were named.
    pub fn order(&self) -> Vec<usize> {
        self.order.clone()
    }
}

impl Footing {
    /// Metres between posts, then square metres to a triangle.
    fn coarseness(&self) -> [f64; 2] {
        let area = &self.manifest.area;
        [area.spacing_m, area.size_m[0] * area.size_m[1] / self.manifest.totals.triangles.max(1) as f64]
    }
}

/// The region around those of tiles. Where they lie on both sides of the 180th meridian, it goes around the globe.
fn around(tiles: &[Value]) -> [f64; 6] {
    let of = |end: usize| {
        move |tile: &Value| tile["boundingVolume"]["region"][end].as_f64().expect("the root of a tileset has a region")
    };
    let low = |end: usize| tiles.iter().map(of(end)).fold(f64::INFINITY, f64::min);
    let high = |end: usize| tiles.iter().map(of(end)).fold(f64::NEG_INFINITY, f64::max);
    [low(0), low(1), high(2), high(3), low(4), high(5)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn areas_that_meet_have_one_height_of_the_geoid_on_their_common_border() {
        let area = |origin_m: [f64; 2], cols: u32| store::Area {
            origin_m,
            module_cols: cols,
            module_rows: 40,
            ..samples::product().manifest.area
        };
        let rect =
            |area: &store::Area| ModuleRect { south: 0, west: 0, north: area.module_rows, east: area.module_cols };
        // The eastern one is so long that its nodes lie farther apart.
        let (west, east) = (area([400_000.0, 3_875_000.0], 20), area([410_000.0, 3_875_000.0], 500));
        let earths = [west, east].iter().map(|area| Earth::under(area, rect(area), None).unwrap()).collect();
        let earths = Earth::together(earths);
        for north in 0..400 {
            let place = [410_000.0, 3_875_000.0 + 50.0 * f64::from(north)];
            let [a, b] = [0, 1].map(|of: usize| earths[of].datum_m(earths[of].lon_lat(place).unwrap()));
            assert!((a - b).abs() < 1e-9, "{north}: {a} {b}");
        }
    }

    #[test]
    fn an_area_that_cannot_be_set_on_the_globe_is_named() {
        let with = |change: &dyn Fn(&mut store::Area), parts: [&str; 2]| {
            let mut manifest = samples::product().manifest;
            change(&mut manifest.area);
            let named = vec![("one.tdb".to_owned(), samples::product().manifest), ("two.tdb".to_owned(), manifest)];
            let error = Together::of(named, None).err().unwrap().to_string();
            assert!(parts.iter().all(|part| error.contains(part)), "{error}");
        };
        with(&|_| {}, ["one.tdb and two.tdb", "the same database twice"]);
        with(&|area| area.vertical_datum.clear(), ["two.tdb: ", "unknown datum"]);
        with(&|area| area.vertical_datum = "NAVD88".into(), ["two.tdb: ", "NAVD88, which cannot be computed"]);
        with(&|area| area.crs = "EPSG:9999999".into(), ["two.tdb: ", "EPSG:9999999"]);
    }
}
