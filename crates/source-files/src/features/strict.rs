//! Sound GeoJSON: the shapes of its features, and the system that it names.

use std::path::Path;

use geojson::{Feature, GeoJson, Geometry, GeometryValue, JsonObject, JsonValue, Position};

use super::clip::Vertex;
use super::raw::{Part, RawShape};
use crate::SourceError;
use crate::crs::Crs;

/// The features of a file.
pub(crate) fn features(json: GeoJson) -> Vec<Feature> {
    match json {
        GeoJson::Geometry(geometry) => vec![Feature { geometry: Some(geometry), ..Feature::default() }],
        GeoJson::Feature(feature) => vec![feature],
        GeoJson::FeatureCollection(collection) => collection.features,
    }
}

/// The points, lines and polygons of a geometry, those of a collection one after the other.
pub(crate) fn shape_of(geometry: Geometry) -> RawShape {
    let mut shape = RawShape::default();
    add(geometry, &mut shape);
    shape
}

fn add(geometry: Geometry, shape: &mut RawShape) {
    match geometry.value {
        GeometryValue::LineString { coordinates } => add_line(&coordinates, shape),
        GeometryValue::MultiLineString { coordinates } => {
            coordinates.iter().for_each(|line| add_line(line, shape));
        }
        GeometryValue::Polygon { coordinates } => add_polygon(&coordinates, shape),
        GeometryValue::MultiPolygon { coordinates } => {
            coordinates.iter().for_each(|polygon| add_polygon(polygon, shape));
        }
        GeometryValue::GeometryCollection { geometries } => {
            geometries.into_iter().for_each(|geometry| add(geometry, shape));
        }
        GeometryValue::Point { coordinates } => add_points(&[coordinates], shape),
        GeometryValue::MultiPoint { coordinates } => add_points(&coordinates, shape),
    }
}

fn add_line(positions: &[Position], shape: &mut RawShape) {
    let line = vertices(positions, shape);
    shape.parts.push(Part::Line(line));
}

fn add_points(positions: &[Position], shape: &mut RawShape) {
    let points = vertices(positions, shape);
    shape.parts.extend(points.into_iter().map(Part::Point));
}

fn add_polygon(rings: &[Vec<Position>], shape: &mut RawShape) {
    let rings = rings.iter().map(|ring| vertices(ring, shape)).collect();
    shape.parts.push(Part::Polygon(rings));
}

/// A position without two numbers is nowhere, which is told like any place that is not on the Earth.
fn vertices(positions: &[Position], shape: &mut RawShape) -> Vec<Vertex> {
    let vertex = |position: &Position| {
        let number = |axis: usize| position.as_slice().get(axis).copied().unwrap_or(f64::NAN);
        [number(0), number(1), number(2)]
    };
    let vertices: Vec<Vertex> = positions.iter().map(vertex).collect();
    shape.has_heights |= positions.iter().any(|position| 2 < position.as_slice().len());
    vertices
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
pub(super) fn said_by(path: &Path, crs: Option<&JsonValue>) -> Result<Option<Crs>, SourceError> {
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
