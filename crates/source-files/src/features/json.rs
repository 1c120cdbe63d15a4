//! Lines and polygons from GeoJSON, with its properties as tags.

use geojson::{Feature, GeoJson, Geometry, GeometryValue, JsonValue, Position};

use super::clip::Vertex;
use super::columns::with_packed_tags;
use super::model::{FeatureFile, Wanted, file_name};
use super::placing::{Placing, Texts, look_like_degrees};
use super::raw::{Part, RawFeature, RawShape};
use crate::SourceError;
use crate::crs::Crs;
use crate::limits::GEOJSON_BYTES_MAX;
use crate::polygons::said_in;
use crate::store::Store;

pub(super) fn read(store: &Store, wanted: &Wanted) -> Result<FeatureFile, SourceError> {
    let path = store.path();
    if GEOJSON_BYTES_MAX < store.len() {
        let (found, limit) = (store.len(), GEOJSON_BYTES_MAX);
        return Err(SourceError::TooLarge { path: path.into(), what: "bytes", found, limit });
    }
    let broken = |reason: String| SourceError::NotGeoJson { path: path.into(), reason };
    let text = String::from_utf8(store.start(GEOJSON_BYTES_MAX)?);
    let text = text.map_err(|_| broken("it is not UTF-8 text".into()))?;
    let json: GeoJson =
        text.trim_start_matches('\u{feff}').parse().map_err(|error: geojson::Error| broken(error.to_string()))?;
    drop(text);
    let said = wanted.system(|| said_in(path, &json))?;
    let features = match json {
        GeoJson::Geometry(geometry) => vec![Feature { geometry: Some(geometry), ..Feature::default() }],
        GeoJson::Feature(feature) => vec![feature],
        GeoJson::FeatureCollection(collection) => collection.features,
    };
    let (name, mut texts) = (file_name(store), Texts::default());
    let raw: Vec<RawFeature> = features
        .into_iter()
        .enumerate()
        .filter_map(|(index, feature)| {
            // A feature without a geometry is legal and adds nothing.
            let shape = shape_of(feature.geometry?);
            let tags: Vec<(String, String)> = feature
                .properties
                .into_iter()
                .flatten()
                .filter_map(|(key, value)| Some((key, text_of(value)?)))
                .collect();
            let tags = with_packed_tags(tags.iter().map(|(key, value)| (key.as_str(), value.as_str())));
            Some(RawFeature { id: format!("{name}#{index}"), tags: texts.tags(tags), shape })
        })
        .collect();
    let all = raw.iter().flat_map(|feature| feature.shape.vertices());
    let said = said.or_else(|| look_like_degrees(all).then(Crs::wgs84));
    let mut placing = Placing::new(path, wanted, said)?;
    raw.into_iter().for_each(|feature| placing.place(feature));
    Ok(placing.finish(None))
}

/// A property as a tag's value: texts as they are, numbers and booleans as written.
fn text_of(value: JsonValue) -> Option<String> {
    match value {
        JsonValue::Null => None,
        JsonValue::String(text) => Some(text),
        other => Some(other.to_string()),
    }
}

fn shape_of(geometry: Geometry) -> RawShape {
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
        GeometryValue::Point { .. } => shape.other = Some("Point"),
        GeometryValue::MultiPoint { .. } => shape.other = Some("MultiPoint"),
    }
}

fn add_line(positions: &[Position], shape: &mut RawShape) {
    let line = vertices(positions, shape);
    shape.parts.push(Part::Line(line));
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
