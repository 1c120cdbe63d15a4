//! Lines and polygons from GeoJSON, with its properties as tags.

use geojson::{GeoJson, JsonValue};

use super::columns::{Texts, with_packed_tags};
use super::loose::{Loose, Written, with_numbers};
use super::model::{FeatureFile, Wanted, file_name};
use super::placing::{Placing, look_like_degrees};
use super::raw::RawFeature;
use super::strict::said_by;
use super::value::Value;
use crate::SourceError;
use crate::crs::Crs;
use crate::store::Store;

pub(super) fn read(store: &Store, wanted: &Wanted) -> Result<FeatureFile, SourceError> {
    let path = store.path();
    let broken = |reason: String| SourceError::NotGeoJson { path: path.into(), reason };
    let text = &*store.text(|| broken("it is not UTF-8 text".into()))?;
    let with_nulls;
    let written = match Written::of(text) {
        Some(written) => written,
        None => {
            with_nulls = with_numbers(text);
            if is_sequence(text) {
                let reason = "one feature after the other (GeoJSONSeq), expected them in a FeatureCollection";
                return Err(broken(reason.into()));
            }
            let reason = || text.parse::<GeoJson>().err().map_or("it is none".to_owned(), |error| error.to_string());
            Written::of(&with_nulls).ok_or_else(|| broken(reason()))?
        }
    };
    let said = wanted.system(|| said_by(path, written.crs.as_ref()))?;
    // Where nothing is said all is read twice, rather than kept.
    let shapes = || written.features().filter_map(|feature| feature.shape?.ok());
    let vertices = || shapes().flat_map(|shape| shape.vertices().copied().collect::<Vec<_>>());
    let said = said.or_else(|| look_like_degrees(vertices()).then(Crs::wgs84));
    let mut placing = Placing::new(path, store.file_bytes(), wanted, said)?;
    let (name, mut texts) = (file_name(store), Texts::default());
    for (index, Loose { properties, shape }) in written.features().enumerate() {
        let id = format!("{name}#{index}");
        let shape = match shape {
            // A feature without a geometry is legal and adds nothing.
            None => continue,
            Some(Ok(shape)) => shape,
            Some(Err(found)) => {
                placing.count_left_out();
                placing.leave_out(&id, found);
                continue;
            }
        };
        let tags: Vec<(String, String)> =
            properties.into_iter().flatten().filter_map(|(key, value)| Some((key, text_of(value)?))).collect();
        let tags = with_packed_tags(tags.iter().map(|(key, value)| (key.as_str(), value.as_str())));
        let feature = RawFeature { id, tags: texts.tags(tags), shape };
        texts.count(placing.allowance());
        placing.place(feature);
    }
    placing.finish(None)
}

/// Whether each line is a feature of its own.
fn is_sequence(text: &str) -> bool {
    let mut records = text.lines().map(str::trim).filter(|record| !record.is_empty());
    records.next().is_some_and(|first| Written::of(first).is_some()) && records.next().is_some()
}

/// A property as a tag's value; lists and objects as they are written.
fn text_of(value: JsonValue) -> Option<String> {
    let value = match value {
        JsonValue::Null => return None,
        JsonValue::String(text) => Value::Text(text),
        JsonValue::Bool(value) => Value::Truth(value),
        JsonValue::Number(number) => match (number.as_i64(), number.as_u64(), number.as_f64()) {
            (Some(whole), ..) => Value::Whole(whole),
            (_, Some(count), _) => Value::Count(count),
            (.., Some(number)) => Value::Number(number),
            _ => Value::Text(number.to_string()),
        },
        other => Value::Text(other.to_string()),
    };
    value.text()
}
