//! Lines and polygons from GeoJSON, with its properties as tags.

use geojson::{Feature, GeoJson, Geometry, GeometryValue, JsonValue, Position};

use super::clip::Vertex;
use super::columns::with_packed_tags;
use super::loose::{self, Loose};
use super::model::{FeatureFile, Wanted, file_name};
use super::placing::{LEFT_OUT, Placing, Texts, look_like_degrees};
use super::raw::{Part, RawFeature, RawShape};
use crate::SourceError;
use crate::crs::Crs;
use crate::limits::GEOJSON_BYTES_MAX;
use crate::polygons::{said_by, said_in};
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
    let text = text.trim_start_matches('\u{feff}');
    let (said, features) = match text.parse::<GeoJson>() {
        Ok(json) => (wanted.system(|| said_in(path, &json))?, strict(json)),
        Err(error) => {
            let (crs, features) = loose::read(text).ok_or_else(|| broken(error.to_string()))?;
            (wanted.system(|| said_by(path, crs.as_ref()))?, features)
        }
    };
    let (name, mut texts) = (file_name(store), Texts::default());
    let (mut raw, mut faults) = (Vec::new(), Vec::new());
    for (index, Loose { properties, shape }) in features.into_iter().enumerate() {
        let id = format!("{name}#{index}");
        let shape = match shape {
            // A feature without a geometry is legal and adds nothing.
            None => continue,
            Some(Ok(shape)) => shape,
            Some(Err(found)) => {
                faults.push((id, found));
                continue;
            }
        };
        let tags: Vec<(String, String)> =
            properties.into_iter().flatten().filter_map(|(key, value)| Some((key, text_of(value)?))).collect();
        let tags = with_packed_tags(tags.iter().map(|(key, value)| (key.as_str(), value.as_str())));
        raw.push(RawFeature { id, tags: texts.tags(tags), shape });
    }
    let all = raw.iter().flat_map(|feature| feature.shape.vertices());
    let said = said.or_else(|| look_like_degrees(all).then(Crs::wgs84));
    let mut placing = Placing::new(path, store.file_bytes(), wanted, said)?;
    faults.into_iter().for_each(|(id, found)| placing.remark(&id, None, found, LEFT_OUT));
    texts.count(placing.allowance());
    raw.into_iter().for_each(|feature| placing.place(feature));
    placing.finish(None)
}

fn strict(json: GeoJson) -> Vec<Loose> {
    let features = match json {
        GeoJson::Geometry(geometry) => vec![Feature { geometry: Some(geometry), ..Feature::default() }],
        GeoJson::Feature(feature) => vec![feature],
        GeoJson::FeatureCollection(collection) => collection.features,
    };
    let of = |Feature { geometry, properties, .. }| Loose { properties, shape: geometry.map(|of| Ok(shape_of(of))) };
    features.into_iter().map(of).collect()
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
