//! GeoJSON in which something is wrong with single features: numbers that are none, geometries that are none. It is
//! taken apart by hand, so that one of them does not cost all others.

use geojson::{JsonObject, JsonValue};

use super::clip::Vertex;
use super::raw::{Part, RawShape};

/// One feature: its properties, and its shape or what is wrong with it; none where it has no geometry.
pub(super) struct Loose {
    pub properties: Option<JsonObject>,
    pub shape: Option<Result<RawShape, String>>,
}

/// The features in a text, and what it says of its coordinate system; `None` when it is no JSON or holds no geometry.
pub(super) fn read(text: &str) -> Option<(Option<JsonValue>, Vec<Loose>)> {
    let value: JsonValue = text.parse().or_else(|_| with_numbers(text).parse()).ok()?;
    let JsonValue::Object(mut all) = value else { return None };
    let crs = all.remove("crs").filter(|crs| !crs.is_null());
    let features = match all.get("type")?.as_str()? {
        "FeatureCollection" => match all.remove("features")? {
            JsonValue::Array(features) => features.into_iter().map(feature).collect(),
            _ => return None,
        },
        "Feature" => vec![feature(JsonValue::Object(all))],
        _ => vec![Loose { properties: None, shape: Some(Ok(shape_of(&JsonValue::Object(all)).ok()?)) }],
    };
    Some((crs, features))
}

/// The same text, with `null` for what some programs write in place of a number that is none.
fn with_numbers(text: &str) -> String {
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

fn feature(value: JsonValue) -> Loose {
    let JsonValue::Object(mut members) = value else {
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
        "Point" => {
            shape.other = Some("Point");
            Ok(())
        }
        "MultiPoint" => {
            shape.other = Some("MultiPoint");
            Ok(())
        }
        _ => Err(none()),
    }
}

fn add_line(places: &[JsonValue], shape: &mut RawShape) -> Result<(), String> {
    let line = vertices(places, shape)?;
    shape.parts.push(Part::Line(line));
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
        assert!(read("{NaN").is_none() && read("[1]").is_none() && read(r#"{"type": "Topology"}"#).is_none());
    }
}
