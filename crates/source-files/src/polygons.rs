//! Polygons from GeoJSON, Shapefiles and GeoPackages, brought to the area's coordinate system.
//!
//! GeoJSON's own standard wants longitude and latitude; files in projected metres are common all the same, with a `crs`
//! member or without. Numbers that can only be degrees are taken for longitude and latitude on WGS 84, others that
//! nothing is said about for metres of the area's system.

use std::path::Path;

use geojson::{FeatureCollection, GeoJson, Geometry, GeometryValue, JsonObject, JsonValue, Position};
use terrain::mask::Polygon;

use crate::allowance::{Allowance, VERTEX_BYTES};
use crate::crs::Crs;
use crate::limits::GEOJSON_BYTES_MAX;
use crate::shapefile_parts::Parts;
use crate::store::Store;
use crate::{SourceError, geopackage, shapefile};

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
    if GEOJSON_BYTES_MAX < store.len() {
        let (found, limit) = (store.len(), GEOJSON_BYTES_MAX);
        return Err(SourceError::TooLarge { path: path.into(), what: "bytes", found, limit });
    }
    if store.start(geopackage::MARK.len() as u64)? == geopackage::MARK {
        return of_geopackage(path, epsg);
    }
    let bytes = store.start(GEOJSON_BYTES_MAX)?;
    let mut collected = Collected { path, polygons: Vec::new(), rings: 0 };
    let said = match bytes.starts_with(&shapefile::MARK) {
        true => {
            let parts = Parts::of(&store)?;
            for rings in shapefile::rings(&store, &bytes, parts.index()?.as_deref())? {
                let rings = rings.into_iter().map(|ring| collected.closed(Some(ring))).collect::<Result<_, _>>()?;
                collected.polygons.push(Polygon { rings });
            }
            parts.system()?
        }
        false => collected.add_json(&bytes)?,
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
    let (layers, bytes) = geopackage::layers(path)?;
    let allowance = Allowance::new(path, bytes);
    for layer in layers {
        for rings in layer.polygons {
            let rings = rings.into_iter().map(|ring| collected.closed(Some(ring))).collect::<Result<_, _>>()?;
            collected.polygons.push(Polygon { rings });
        }
        all.append(&mut placed(&allowance, std::mem::take(&mut collected.polygons), layer.crs, epsg)?);
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
    let of_polygon =
        |polygon: Polygon| Ok(Polygon { rings: polygon.rings.iter().map(ring).collect::<Result<_, SourceError>>()? });
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
    fn add_json(&mut self, bytes: &[u8]) -> Result<Option<Crs>, SourceError> {
        let broken = |reason: String| SourceError::NotGeoJson { path: self.path.into(), reason };
        let text = std::str::from_utf8(bytes).map_err(|_| broken("it is not UTF-8 text".into()))?;
        // Some editors put a byte order mark before UTF-8 text.
        let text = text.trim_start_matches('\u{feff}');
        let json: GeoJson = text.parse().map_err(|error: geojson::Error| broken(error.to_string()))?;
        let said = said_in(self.path, &json)?;
        match json {
            GeoJson::Geometry(geometry) => self.add(geometry)?,
            GeoJson::Feature(feature) => self.add_some(feature.geometry)?,
            GeoJson::FeatureCollection(FeatureCollection { features, .. }) => {
                features.into_iter().try_for_each(|feature| self.add_some(feature.geometry))?;
            }
        }
        Ok(said)
    }

    /// A feature without a geometry is legal and adds nothing.
    fn add_some(&mut self, geometry: Option<Geometry>) -> Result<(), SourceError> {
        geometry.map_or(Ok(()), |geometry| self.add(geometry))
    }

    fn add(&mut self, geometry: Geometry) -> Result<(), SourceError> {
        let found = match geometry.value {
            GeometryValue::Polygon { coordinates } => return self.add_polygon(coordinates),
            GeometryValue::MultiPolygon { coordinates } => {
                return coordinates.into_iter().try_for_each(|polygon| self.add_polygon(polygon));
            }
            GeometryValue::GeometryCollection { geometries } => {
                return geometries.into_iter().try_for_each(|geometry| self.add(geometry));
            }
            GeometryValue::Point { .. } => "Point",
            GeometryValue::MultiPoint { .. } => "MultiPoint",
            GeometryValue::LineString { .. } => "LineString",
            GeometryValue::MultiLineString { .. } => "MultiLineString",
        };
        Err(SourceError::NotPolygons { path: self.path.into(), found })
    }

    fn add_polygon(&mut self, rings: Vec<Vec<Position>>) -> Result<(), SourceError> {
        let rings: Result<_, _> = rings.iter().map(|ring| self.ring(ring)).collect();
        self.polygons.push(Polygon { rings: rings? });
        Ok(())
    }

    fn ring(&mut self, positions: &[Position]) -> Result<Vec<[f64; 2]>, SourceError> {
        self.closed(positions.iter().map(corner).collect())
    }

    /// Checks that a ring is one.
    fn closed(&mut self, corners: Option<Vec<[f64; 2]>>) -> Result<Vec<[f64; 2]>, SourceError> {
        let ring = self.rings;
        self.rings += 1;
        let wrong = |found: String| SourceError::Ring { path: self.path.into(), ring, found };
        let finite = corners.filter(|corners| corners.as_flattened().iter().all(|number| number.is_finite()));
        let corners = finite.ok_or_else(|| wrong("a corner without two finite numbers".into()))?;
        if corners.len() < 4 {
            return Err(wrong(format!("{} corners", corners.len())));
        }
        if corners.first() != corners.last() {
            return Err(wrong("a last corner that is not its first".into()));
        }
        Ok(corners)
    }
}

pub(crate) fn corner(position: &Position) -> Option<[f64; 2]> {
    let &[east_m, north_m, ..] = position.as_slice() else { return None };
    (east_m.is_finite() && north_m.is_finite()).then_some([east_m, north_m])
}

/// The system that the `crs` member of a file names.
pub(crate) fn said_in(path: &Path, json: &GeoJson) -> Result<Option<Crs>, SourceError> {
    let members: Option<&JsonObject> = match json {
        GeoJson::Geometry(geometry) => geometry.foreign_members.as_ref(),
        GeoJson::Feature(feature) => feature.foreign_members.as_ref(),
        GeoJson::FeatureCollection(features) => features.foreign_members.as_ref(),
    };
    said_by(path, members.and_then(|members| members.get("crs")).filter(|crs| !crs.is_null()))
}

/// The same of its member `crs`, where it has one.
pub(crate) fn said_by(path: &Path, crs: Option<&JsonValue>) -> Result<Option<Crs>, SourceError> {
    let Some(crs) = crs else { return Ok(None) };
    let refused = |found: String| SourceError::UnnamedCrs { path: path.into(), found };
    match crs.pointer("/properties/name").and_then(|name| name.as_str()) {
        None => Err(refused(format!("an unnamed system ({crs})"))),
        // Longitude first, which is how all GeoJSON is written.
        Some(name) if name.ends_with("CRS84") => Ok(Some(Crs::wgs84())),
        Some(name) => match epsg_of(name) {
            None => Err(refused(name.to_owned())),
            Some(code) => Crs::from_epsg(code).map(Some).map_err(|found| refused(format!("{name}: {found}"))),
        },
    }
}

/// The code in `EPSG:32611`, `urn:ogc:def:crs:EPSG::32611` or `http://www.opengis.net/def/crs/EPSG/0/32611`.
fn epsg_of(name: &str) -> Option<u32> {
    let code = name.rsplit([':', '/']).next()?;
    name.to_ascii_uppercase().contains("EPSG").then(|| code.parse().ok()).flatten()
}
