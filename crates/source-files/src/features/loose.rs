//! GeoJSON one feature after the other: those in which something is wrong, as numbers that are none, are taken apart by
//! hand, so that one of them does not cost all others.

use std::collections::BTreeMap;

use geojson::{Feature, JsonObject, JsonValue};
use serde_json::value::RawValue;

use super::clip::Vertex;
use super::raw::{Part, RawShape};
use super::strict;

/// One feature: its properties, and its shape or what is wrong with it; none where it has no geometry.
pub(super) struct Loose {
    pub properties: Option<JsonObject>,
    pub shape: Option<Result<RawShape, String>>,
}

/// A text of GeoJSON, whose features are not read yet.
pub(super) struct Written<'a> {
    /// What it says of its coordinate system.
    pub crs: Option<JsonValue>,
    features: Vec<&'a str>,
    /// How each of them is read.
    read: fn(&str) -> Loose,
}

impl<'a> Written<'a> {
    /// `None` when the text is no JSON or none of GeoJSON's types.
    pub fn of(text: &'a str) -> Option<Self> {
        let members: BTreeMap<String, &RawValue> = serde_json::from_str(text).ok()?;
        let kind: String = serde_json::from_str(members.get("type")?.get()).ok()?;
        let (features, read): (_, fn(&str) -> Loose) = match kind.as_str() {
            "FeatureCollection" => {
                let features: Vec<&RawValue> = serde_json::from_str(members.get("features")?.get()).ok()?;
                (features.into_iter().map(RawValue::get).collect(), feature)
            }
            "Feature" => (vec![text], feature),
            "Point" | "LineString" | "Polygon" | "MultiPoint" | "MultiLineString" | "MultiPolygon"
            | "GeometryCollection" => (vec![text], bare_geometry),
            _ => return None,
        };
        let crs = members.get("crs").and_then(|crs| serde_json::from_str(crs.get()).ok());
        Some(Self { crs: crs.filter(|crs: &JsonValue| !crs.is_null()), features, read })
    }

    /// Its features, read one by one.
    pub fn features(&self) -> impl Iterator<Item = Loose> {
        self.features.iter().map(|text| (self.read)(text))
    }
}

/// The same text, with `null` for what some programs write in place of a number that is none.
pub(super) fn with_numbers(text: &str) -> String {
    let mut clean = String::with_capacity(text.len());
    let (mut rest, mut in_string) = (text, false);
    while let Some(first) = rest.chars().next() {
        let taken = match first {
            '\\' if in_string => rest.chars().take(2).map(char::len_utf8).sum(),
            '"' => {
                in_string = !in_string;
                1
            }
            _ if in_string => first.len_utf8(),
            '-' | '+' | '0'..='9' | 'A'..='Z' | 'a'..='z' => {
                let ends = |c: char| !(c.is_ascii_alphanumeric() || matches!(c, '-' | '+' | '.'));
                let word = rest.find(ends).unwrap_or(rest.len());
                let is_number = rest[..word].parse::<f64>().is_ok_and(f64::is_finite);
                if !is_number && !matches!(&rest[..word], "true" | "false" | "null") {
                    clean.push_str("null");
                    rest = &rest[word..];
                    continue;
                }
                word
            }
            _ => first.len_utf8(),
        };
        clean.push_str(&rest[..taken]);
        rest = &rest[taken..];
    }
    clean
}

fn value_of(text: &str) -> JsonValue {
    let value = serde_json::from_str(text).or_else(|_| serde_json::from_str(&with_numbers(text)));
    value.unwrap_or_default()
}

fn bare_geometry(text: &str) -> Loose {
    Loose { properties: None, shape: Some(shape_of(&value_of(text))) }
}

fn feature(text: &str) -> Loose {
    if let Ok(Feature { geometry, properties, .. }) = serde_json::from_str(text) {
        return Loose { properties, shape: geometry.map(|geometry| Ok(strict::shape_of(geometry))) };
    }
    let JsonValue::Object(mut members) = value_of(text) else {
        return Loose { properties: None, shape: Some(Err("a feature that is none".into())) };
    };
    let properties = match members.remove("properties") {
        Some(JsonValue::Object(properties)) => Some(properties),
        _ => None,
    };
    let geometry = members.remove("geometry").filter(|geometry| !geometry.is_null());
    Loose { properties, shape: geometry.map(|geometry| shape_of(&geometry)) }
}

fn shape_of(geometry: &JsonValue) -> Result<RawShape, String> {
    let mut shape = RawShape::default();
    add(geometry, &mut shape)?;
    Ok(shape)
}

fn add(geometry: &JsonValue, shape: &mut RawShape) -> Result<(), String> {
    let none = || "a geometry that is none".to_owned();
    let list = |name: &str| geometry.get(name).and_then(JsonValue::as_array).ok_or_else(none);
    let kind = geometry.get("type").and_then(JsonValue::as_str).ok_or_else(none)?;
    match kind {
        "LineString" => add_line(list("coordinates")?, shape),
        "MultiLineString" => {
            list("coordinates")?.iter().try_for_each(|line| add_line(line.as_array().ok_or_else(none)?, shape))
        }
        "Polygon" => add_polygon(list("coordinates")?, shape),
        "MultiPolygon" => {
            list("coordinates")?.iter().try_for_each(|rings| add_polygon(rings.as_array().ok_or_else(none)?, shape))
        }
        "GeometryCollection" => list("geometries")?.iter().try_for_each(|geometry| add(geometry, shape)),
        "Point" => add_points(std::slice::from_ref(geometry.get("coordinates").ok_or_else(none)?), shape),
        "MultiPoint" => add_points(list("coordinates")?, shape),
        _ => Err(none()),
    }
}

fn add_line(places: &[JsonValue], shape: &mut RawShape) -> Result<(), String> {
    let line = vertices(places, shape)?;
    shape.parts.push(Part::Line(line));
    Ok(())
}

fn add_points(places: &[JsonValue], shape: &mut RawShape) -> Result<(), String> {
    let points = vertices(places, shape)?;
    shape.parts.extend(points.into_iter().map(Part::Point));
    Ok(())
}

fn add_polygon(rings: &[JsonValue], shape: &mut RawShape) -> Result<(), String> {
    let none = || "a ring that is none".to_owned();
    let rings: Result<Vec<Vec<Vertex>>, String> =
        rings.iter().map(|ring| vertices(ring.as_array().ok_or_else(none)?, shape)).collect();
    shape.parts.push(Part::Polygon(rings?));
    Ok(())
}

/// A height that is no number is none.
fn vertices(places: &[JsonValue], shape: &mut RawShape) -> Result<Vec<Vertex>, String> {
    let vertex = |place: &JsonValue| {
        let numbers = place.as_array().ok_or_else(|| "a place that is none".to_owned())?;
        shape.has_heights |= 2 < numbers.len();
        let number = |axis: usize| match numbers.get(axis) {
            Some(value) => value.as_f64().ok_or_else(|| format!("a coordinate {value}, expected a number")),
            None => Ok(f64::NAN),
        };
        Ok([number(0)?, number(1)?, number(2).unwrap_or(f64::NAN)])
    };
    places.iter().map(vertex).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_becomes_nothing_and_texts_stay() {
        let text = r#"{"a": [NaN, -Infinity, 1e999, -1.5e3, true, "NaN \" 1e999"], "b": null}"#;
        let clean = r#"{"a": [null, null, null, -1.5e3, true, "NaN \" 1e999"], "b": null}"#;
        assert_eq!(with_numbers(text), clean);
        for text in ["{NaN", "[1]", r#"{"type": "Topology"}"#, r#"{"type": "FeatureCollection"}"#] {
            assert!(Written::of(text).is_none(), "{text}");
        }
    }
}
