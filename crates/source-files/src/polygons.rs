//! Polygons from GeoJSON, in metres of the area's coordinate system.
//!
//! The format's own standard wants longitude and latitude; files in projected metres are common all the same, with a
//! `crs` member or without. A file that names another system, or whose numbers can only be degrees, is refused.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use geojson::{FeatureCollection, GeoJson, Geometry, GeometryValue, JsonObject, Position};
use mask::Polygon;

use crate::SourceError;
use crate::limits::GEOJSON_BYTES_MAX;

/// Reads every Polygon and MultiPolygon of the GeoJSON file at `path`, whose coordinates are metres of the
/// coordinate system EPSG:`epsg`.
///
/// # Errors
/// When the file is no GeoJSON, holds other geometries or none, a ring is not closed, or its coordinates are in
/// another system.
pub fn read_polygons(path: &Path, epsg: u32) -> Result<Vec<Polygon>, SourceError> {
    let json = parse(path)?;
    let mut collected = Collected { path, polygons: Vec::new(), rings: 0 };
    check_crs(path, &json, epsg)?;
    match json {
        GeoJson::Geometry(geometry) => collected.add(geometry)?,
        GeoJson::Feature(feature) => collected.add_some(feature.geometry)?,
        GeoJson::FeatureCollection(FeatureCollection { features, .. }) => {
            features.into_iter().try_for_each(|feature| collected.add_some(feature.geometry))?;
        }
    }
    if collected.polygons.is_empty() {
        return Err(SourceError::NoPolygons { path: path.into() });
    }
    check_metres(path, &collected.polygons, epsg)?;
    Ok(collected.polygons)
}

fn parse(path: &Path) -> Result<GeoJson, SourceError> {
    let file = File::open(path).map_err(|source| SourceError::Open { path: path.into(), source })?;
    let read = |source| SourceError::Read { path: path.into(), source };
    let found = file.metadata().map_err(read)?.len();
    if GEOJSON_BYTES_MAX < found {
        return Err(SourceError::TooLarge { path: path.into(), what: "bytes", found, limit: GEOJSON_BYTES_MAX });
    }
    let mut text = String::new();
    BufReader::new(file).take(GEOJSON_BYTES_MAX).read_to_string(&mut text).map_err(|error| match error.kind() {
        std::io::ErrorKind::InvalidData => {
            SourceError::NotGeoJson { path: path.into(), reason: "it is not UTF-8 text".into() }
        }
        _ => read(error),
    })?;
    text.parse()
        .map_err(|error: geojson::Error| SourceError::NotGeoJson { path: path.into(), reason: error.to_string() })
}

/// Polygons found so far.
struct Collected<'a> {
    path: &'a Path,
    polygons: Vec<Polygon>,
    /// Rings seen, for messages.
    rings: usize,
}

impl Collected<'_> {
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
        let ring = self.rings;
        self.rings += 1;
        let wrong = |found: String| SourceError::Ring { path: self.path.into(), ring, found };
        let corners: Option<Vec<[f64; 2]>> = positions.iter().map(corner).collect();
        let corners = corners.ok_or_else(|| wrong("a corner without two finite numbers".into()))?;
        if corners.len() < 4 {
            return Err(wrong(format!("{} corners", corners.len())));
        }
        if corners.first() != corners.last() {
            return Err(wrong("a last corner that is not its first".into()));
        }
        Ok(corners)
    }
}

fn corner(position: &Position) -> Option<[f64; 2]> {
    let &[east_m, north_m, ..] = position.as_slice() else { return None };
    (east_m.is_finite() && north_m.is_finite()).then_some([east_m, north_m])
}

/// Refuses a file whose `crs` member names another system than the area's.
fn check_crs(path: &Path, json: &GeoJson, expected: u32) -> Result<(), SourceError> {
    let members: Option<&JsonObject> = match json {
        GeoJson::Geometry(geometry) => geometry.foreign_members.as_ref(),
        GeoJson::Feature(feature) => feature.foreign_members.as_ref(),
        GeoJson::FeatureCollection(features) => features.foreign_members.as_ref(),
    };
    let Some(crs) = members.and_then(|members| members.get("crs")).filter(|crs| !crs.is_null()) else { return Ok(()) };
    let name = crs.pointer("/properties/name").and_then(|name| name.as_str());
    let found = match name {
        None => format!("an unnamed system ({crs})"),
        Some(name) if epsg_of(name) == Some(expected) => return Ok(()),
        Some(name) => name.into(),
    };
    Err(SourceError::PolygonCrs { path: path.into(), found, expected })
}

/// The code in `EPSG:32611`, `urn:ogc:def:crs:EPSG::32611` or `http://www.opengis.net/def/crs/EPSG/0/32611`.
fn epsg_of(name: &str) -> Option<u32> {
    let code = name.rsplit([':', '/']).next()?;
    name.to_ascii_uppercase().contains("EPSG").then(|| code.parse().ok()).flatten()
}

/// Refuses numbers that can only be degrees: a projected area a degree or two of metres wide at the system's origin
/// is not a place anybody compiles.
fn check_metres(path: &Path, polygons: &[Polygon], expected: u32) -> Result<(), SourceError> {
    let mut corners = polygons.iter().flat_map(|polygon| &polygon.rings).flatten();
    if !corners.clone().all(|[east, north]| east.abs() <= 360.0 && north.abs() <= 90.0) {
        return Ok(());
    }
    let Some([east, north]) = corners.next() else { return Ok(()) };
    Err(SourceError::LonLat { path: path.into(), found: format!("{east}, {north}"), expected })
}
