//! Polygons from GeoJSON, Shapefiles and GeoPackages, brought to the area's coordinate system.
//!
//! GeoJSON's own standard wants longitude and latitude; files in projected metres are common all the same, with a `crs`
//! member or without. Numbers that can only be degrees are taken for longitude and latitude on WGS 84, others that
//! nothing is said about for metres of the area's system.

use std::path::Path;

use geojson::GeoJson;
use terrain::mask::Polygon;

use crate::crs::Crs;
use crate::error::at_most;
use crate::features::clip::Vertex;
use crate::features::raw::{Part, RawShape};
use crate::features::strict::{self, said_in};
use crate::geopackage::Package;
use crate::limits::{Allowance, GEOJSON_BYTES_MAX, VERTEX_BYTES};
use crate::shapefile::Parts;
use crate::shapefile::Shape;
use crate::store::Store;
use crate::{SourceError, geopackage, longitudes, shapefile};

/// Reads every Polygon and MultiPolygon of the GeoJSON file, Shapefile or GeoPackage at `path`, in metres of the
/// coordinate system EPSG:`epsg`.
///
/// # Errors
/// When the file is none of them, holds other geometries or none, a ring is not closed, or its coordinates are in a
/// system that cannot be brought to the area's.
pub fn read_polygons(path: &Path, epsg: u32) -> Result<Vec<Polygon>, SourceError> {
    let mut store = Store::plain(path)?;
    if store.start(4)? == b"PK\x03\x04" {
        store = Store::zipped_shapefile(path)?.swap_remove(0);
    }
    at_most(path, store.len(), GEOJSON_BYTES_MAX, "bytes")?;
    if store.start(geopackage::MARK.len() as u64)? == geopackage::MARK {
        return of_geopackage(path, epsg);
    }
    let mut collected = Collected { path, polygons: Vec::new(), rings: 0 };
    let said = match store.start(4)? == shapefile::MARK {
        true => {
            let (parts, bytes) = (Parts::of(&store)?, store.start(GEOJSON_BYTES_MAX)?);
            for shape in shapefile::shapes(&store, &bytes, parts.index()?.as_deref())? {
                collected.add_record(shape?)?;
            }
            parts.system()?
        }
        false => collected.add_json(&store)?,
    };
    if collected.polygons.is_empty() {
        return Err(SourceError::NoPolygons { path: path.into() });
    }
    placed(&Allowance::new(path, store.file_bytes()), collected.polygons, said, epsg)
}

/// The polygons of all layers.
fn of_geopackage(path: &Path, epsg: u32) -> Result<Vec<Polygon>, SourceError> {
    let mut collected = Collected { path, polygons: Vec::new(), rings: 0 };
    let mut all = Vec::new();
    let package = Package::open(path)?;
    let allowance = Allowance::new(path, package.bytes());
    let (tables, unread) = package.tables()?;
    if let Some(unread) = unread.first() {
        return Err(unread.refused(path));
    }
    for table in tables {
        package.shapes(&table, |shape| collected.add(shape))?;
        let polygons = std::mem::take(&mut collected.polygons);
        if !polygons.is_empty() {
            all.append(&mut placed(&allowance, polygons, package.crs(table.srs)?, epsg)?);
        }
    }
    if all.is_empty() { Err(SourceError::NoPolygons { path: path.into() }) } else { Ok(all) }
}

/// Polygons in the area's system; `said` is their own, where it is known.
fn placed(
    allowance: &Allowance,
    polygons: Vec<Polygon>,
    said: Option<Crs>,
    epsg: u32,
) -> Result<Vec<Polygon>, SourceError> {
    let said = said.or_else(|| look_like_degrees(&polygons).then(Crs::wgs84));
    match said {
        Some(crs) if crs.epsg() != Some(epsg) => projected(allowance, polygons, &crs, epsg),
        _ => Ok(polygons),
    }
}

/// Whether numbers can only be degrees: a projected area a degree or two of metres wide at the system's origin is not
/// a place that is compiled.
fn look_like_degrees(polygons: &[Polygon]) -> bool {
    let mut corners = polygons.iter().flat_map(|polygon| &polygon.rings).flatten();
    corners.all(|[east, north]| east.abs() <= 360.0 && north.abs() <= 90.0)
}

/// Polygons brought from `crs` to the area's system. Long sides get corners between, since what is straight in one
/// system is not in the other.
pub(crate) fn projected(
    allowance: &Allowance,
    polygons: Vec<Polygon>,
    crs: &Crs,
    epsg: u32,
) -> Result<Vec<Polygon>, SourceError> {
    let outside = |found: String| SourceError::PolygonCrs { path: allowance.path().into(), found, expected: epsg };
    let area = Crs::from_epsg(epsg).map_err(&outside)?;
    let ring = |ring: &Vec<[f64; 2]>| {
        let mut corners = Vec::with_capacity(ring.len());
        let next = ring.iter().skip(1).map(Some).chain([None]);
        for (&from, to) in ring.iter().zip(next) {
            let to = to.copied().unwrap_or(from);
            let pieces = pieces_of(crs, from, to);
            allowance.take(VERTEX_BYTES * pieces as usize)?;
            for step in 0..pieces {
                let share = f64::from(step) / f64::from(pieces);
                let place = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
                let placed = crs.to(&area, place);
                corners.push(placed.ok_or_else(|| outside(format!("{}, at {place:?}", crs.name())))?);
            }
        }
        Ok(corners)
    };
    let of_polygon = |mut polygon: Polygon| {
        if crs.is_geographic() {
            longitudes::unwrap_polygon(&mut polygon.rings);
        }
        Ok(Polygon { rings: polygon.rings.iter().map(ring).collect::<Result<_, SourceError>>()? })
    };
    polygons.into_iter().map(of_polygon).collect()
}

/// Into how many pieces a side is cut before it is brought from `crs` to another system.
pub(crate) fn pieces_of(crs: &Crs, from: [f64; 2], to: [f64; 2]) -> u32 {
    /// Pieces of a side, at most.
    const PIECES_MAX: f64 = 1000.0;
    let piece = if crs.is_geographic() { 0.005 } else { 500.0 };
    let longest = (to[0] - from[0]).abs().max((to[1] - from[1]).abs());
    (longest / piece).ceil().clamp(1.0, PIECES_MAX) as u32
}

/// Polygons found so far.
struct Collected<'a> {
    path: &'a Path,
    polygons: Vec<Polygon>,
    /// Rings seen, for messages.
    rings: usize,
}

impl Collected<'_> {
    /// Adds all polygons of a GeoJSON text; returns the system that it names.
    fn add_json(&mut self, store: &Store) -> Result<Option<Crs>, SourceError> {
        let broken = |reason: String| SourceError::NotGeoJson { path: self.path.into(), reason };
        let text = store.text(|| broken("it is not UTF-8 text".into()))?;
        let json: GeoJson = text.parse().map_err(|error: geojson::Error| broken(error.to_string()))?;
        let said = said_in(self.path, &json)?;
        // A feature without a geometry is legal and adds nothing.
        let geometries = strict::features(json).into_iter().filter_map(|feature| feature.geometry);
        geometries.map(strict::shape_of).try_for_each(|shape| self.add(shape))?;
        Ok(said)
    }

    fn add(&mut self, shape: RawShape) -> Result<(), SourceError> {
        let refused = |found| Err(SourceError::NotPolygons { path: self.path.into(), found });
        if let Some(other) = shape.other {
            return refused(other);
        }
        for part in shape.parts {
            match part {
                Part::Polygon(rings) => self.add_rings(rings)?,
                Part::Line(_) => return refused("LineString"),
                Part::Point(_) => return refused("Point"),
            }
        }
        Ok(())
    }

    /// All rings of a record are one polygon.
    fn add_record(&mut self, shape: Shape) -> Result<(), SourceError> {
        let refused = |found| Err(SourceError::NotPolygons { path: self.path.into(), found });
        match shape {
            Shape::Nothing => Ok(()),
            Shape::Rings { rings, .. } => self.add_rings(rings),
            Shape::Points(_) => refused("Point"),
            Shape::Lines { .. } => refused("PolyLine"),
            Shape::Other(found) => refused(found),
        }
    }

    fn add_rings(&mut self, rings: Vec<Vec<Vertex>>) -> Result<(), SourceError> {
        let flat = |ring: Vec<Vertex>| ring.into_iter().map(|[east, north, _]| [east, north]).collect();
        let rings = rings.into_iter().map(|ring| self.closed(flat(ring))).collect::<Result<_, _>>()?;
        self.polygons.push(Polygon { rings });
        Ok(())
    }

    /// Checks that a ring is one.
    fn closed(&mut self, corners: Vec<[f64; 2]>) -> Result<Vec<[f64; 2]>, SourceError> {
        let ring = self.rings;
        self.rings += 1;
        let wrong = |found: String| SourceError::Ring { path: self.path.into(), ring, found };
        if !corners.as_flattened().iter().all(|number| number.is_finite()) {
            return Err(wrong("a corner without two finite numbers".into()));
        }
        if corners.len() < 4 {
            return Err(wrong(format!("{} corners", corners.len())));
        }
        if corners.first() != corners.last() {
            return Err(wrong("a last corner that is not its first".into()));
        }
        Ok(corners)
    }
}
