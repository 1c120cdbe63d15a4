//! What was mended, degraded or left out of roads, rivers and lakes, for maps: as GeoJSON, a point for each.

use geojson::{Feature, FeatureCollection, Geometry, JsonObject};
use serde_json::json;
use store::FeatureRemark;

/// What became of a feature, in one word.
pub fn outcome(remark: &FeatureRemark) -> &'static str {
    match (remark.leaves_out, remark.degrades) {
        (true, _) => "left out",
        (false, true) => "degraded",
        (false, false) => "mended",
    }
}

/// Remarks as a feature collection, indented, in metres of the coordinate system with this EPSG code (named by a `crs`
/// member, as GDAL and QGIS read it). One without a place has no geometry.
pub fn features_geojson(name: &str, remarks: &[FeatureRemark], epsg: u32) -> String {
    let features = remarks.iter().map(feature).collect();
    let crs = json!({ "type": "name", "properties": { "name": format!("urn:ogc:def:crs:EPSG::{epsg}") } });
    let members = [("name".to_owned(), json!(name)), ("crs".to_owned(), crs)];
    let collection = FeatureCollection { bbox: None, features, foreign_members: Some(members.into_iter().collect()) };
    let text = serde_json::to_string_pretty(&collection).expect("texts and finite numbers are JSON");
    text + "\n"
}

fn feature(remark: &FeatureRemark) -> Feature {
    let FeatureRemark { feature, at_m, found, done, .. } = remark;
    let pairs = [
        ("feature", json!(feature)),
        ("outcome", json!(outcome(remark))),
        ("found", json!(found)),
        ("done", json!(done)),
    ];
    let properties: JsonObject = pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    Feature {
        bbox: None,
        geometry: at_m.map(|[east, north]| Geometry::new_point([east, north])),
        id: None,
        properties: Some(properties),
        foreign_members: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    #[test]
    fn each_remark_stands_at_its_place_with_what_was_found_and_done() {
        let remark = |at_m, leaves_out, degrades| FeatureRemark {
            feature: "way 12".into(),
            at_m,
            found: "it goes out and back".into(),
            done: "left out".into(),
            leaves_out,
            degrades,
        };
        let remarks = [remark(Some([505_000.5, 3_875_000.0]), true, true), remark(None, false, true)];
        let value: Value = serde_json::from_str(&features_geojson("features", &remarks, 32611)).unwrap();
        assert_eq!(value["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::32611");
        assert_eq!(value["features"][0]["geometry"]["coordinates"], json!([505_000.5, 3_875_000.0]));
        let of = |index: usize, key: &str| value["features"][index]["properties"][key].clone();
        assert_eq!((of(0, "feature"), of(0, "outcome")), (json!("way 12"), json!("left out")));
        assert_eq!((of(1, "outcome"), of(1, "found")), (json!("degraded"), json!("it goes out and back")));
        assert_eq!(value["features"][1]["geometry"], Value::Null);
    }

    #[test]
    fn no_remark_is_an_empty_collection() {
        let value: Value = serde_json::from_str(&features_geojson("features", &[], 1)).unwrap();
        assert_eq!(value["features"], json!([]));
    }
}
