//! Lines and polygons from GeoJSON, with its properties as tags.

use geojson::{Feature, GeoJson, JsonValue};

use super::columns::{Texts, with_packed_tags};
use super::loose::{self, Loose};
use super::model::{FeatureFile, Wanted, file_name};
use super::placing::{Placing, look_like_degrees};
use super::raw::RawFeature;
use super::strict::{self, said_by, said_in, shape_of};
use super::value::Value;
use crate::SourceError;
use crate::crs::Crs;
use crate::store::Store;

pub(super) fn read(store: &Store, wanted: &Wanted) -> Result<FeatureFile, SourceError> {
    let path = store.path();
    let broken = |reason: String| SourceError::NotGeoJson { path: path.into(), reason };
    let text = &*store.text(|| broken("it is not UTF-8 text".into()))?;
    let (said, features) = match text.parse::<GeoJson>() {
        Ok(json) => {
            let said = wanted.system(|| said_in(path, &json))?;
            let loose =
                |Feature { geometry, properties, .. }| Loose { properties, shape: geometry.map(|of| Ok(shape_of(of))) };
            (said, strict::features(json).into_iter().map(loose).collect())
        }
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
    for (id, found) in faults {
        placing.count_left_out();
        placing.leave_out(&id, found);
    }
    texts.count(placing.allowance());
    raw.into_iter().for_each(|feature| placing.place(feature));
    placing.finish(None)
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
