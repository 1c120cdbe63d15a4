//! What a report lists, for maps and for tables: as GeoJSON breaches and what was mended, degraded or left out of
//! features, as CSV breaches.

use geojson::{Feature, FeatureCollection, Geometry, JsonObject, JsonValue};
use serde_json::json;
use store::{FeatureRemark, Report, ReportBreach, ReportPlace};

/// Where load modules and windows lie on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BreachPlaces {
    /// East and north of the area's south-west post, in metres.
    pub origin_m: [f64; 2],
    /// Side of a load module, in metres.
    pub module_side_m: f64,
    /// Rows and columns of load modules in the area.
    pub modules: [u32; 2],
    /// Rows and columns of load modules in a window.
    pub window: [u32; 2],
    /// EPSG code of the area's coordinate system.
    pub epsg: u32,
}

/// The breaches of `report` as a feature collection: a polygon for each load module or window with all its numbers.
pub fn breaches_geojson(report: &Report, places: &BreachPlaces) -> String {
    let feature = |breach: &ReportBreach| {
        let (place, row_col) = place_of(breach.place);
        let mut properties = json!(breach);
        properties["where"] = json!(place);
        properties["row"] = json!(row_col.map(|at| at[0]));
        properties["col"] = json!(row_col.map(|at| at[1]));
        feature(Some(Geometry::new_polygon([places.ring(breach.place)])), &properties)
    };
    collection("breaches", report.breaches.iter().map(feature), places.epsg)
}

/// Remarks as a feature collection: a point for each. One without a place has no geometry.
pub fn features_geojson(name: &str, remarks: &[FeatureRemark], epsg: u32) -> String {
    let feature = |remark: &FeatureRemark| {
        let FeatureRemark { feature: of, at_m, found, done, .. } = remark;
        let properties = json!({ "feature": of, "outcome": outcome(remark), "found": found, "done": done });
        feature(at_m.map(Geometry::new_point), &properties)
    };
    collection(name, remarks.iter().map(feature), epsg)
}

/// What became of a feature, in one word.
pub fn outcome(remark: &FeatureRemark) -> &'static str {
    match (remark.leaves_out, remark.degrades) {
        (true, _) => "left out",
        (false, true) => "degraded",
        (false, false) => "mended",
    }
}

fn feature(geometry: Option<Geometry>, properties: &JsonValue) -> Feature {
    Feature { geometry, properties: properties.as_object().cloned(), ..Feature::default() }
}

/// Features, indented, in metres of the coordinate system with this EPSG code (named by a `crs` member, as GDAL and
/// QGIS read it). There may be none.
fn collection(name: &str, features: impl Iterator<Item = Feature>, epsg: u32) -> String {
    let crs = json!({ "type": "name", "properties": { "name": format!("urn:ogc:def:crs:EPSG::{epsg}") } });
    let members = JsonObject::from_iter([("name".to_owned(), json!(name)), ("crs".to_owned(), crs)]);
    let collection = FeatureCollection { foreign_members: Some(members), ..FeatureCollection::new(features) };
    serde_json::to_string_pretty(&collection).expect("texts and finite numbers are JSON") + "\n"
}

/// The breaches of `report` as CSV: a line of names, then one for each, with the numbers of [`breaches_geojson`] and
/// the place's western, southern, eastern and northern side in metres of the area's coordinate system.
pub fn breaches_csv(report: &Report, places: &BreachPlaces) -> String {
    let mut text =
        "kind,where,row,col,count,limit,excess,refused,rms_with_m,rms_without_m,west_m,south_m,east_m,north_m\n"
            .to_owned();
    for breach in &report.breaches {
        let (place, row_col) = place_of(breach.place);
        let index = |which: usize| row_col.map_or(String::new(), |row_col| row_col[which].to_string());
        let ReportBreach { kind, count, limit, excess, refused, rms_with_m, .. } = breach;
        let without = breach.rms_without_m.map_or(String::new(), |rms_m| rms_m.to_string());
        let ring = places.ring(breach.place);
        let ([west, south], [east, north]) = (ring[0], ring[2]);
        // Nothing here can hold a comma or a quote: kinds and places are words of ours, the rest are numbers.
        text += &format!(
            "{kind},{place},{},{},{count},{limit},{excess},{refused},{rms_with_m},{without},\
             {west},{south},{east},{north}\n",
            index(0),
            index(1)
        );
    }
    text
}

/// What a place is called, and its row and column.
fn place_of(place: ReportPlace) -> (&'static str, Option<[u32; 2]>) {
    match place {
        ReportPlace::Module(row_col) => ("module", Some(row_col)),
        ReportPlace::Window(row_col) => ("window", Some(row_col)),
        ReportPlace::Area => ("area", None),
    }
}

impl BreachPlaces {
    /// South-west corner and extent of a place, in load modules: row, column, rows, columns.
    fn extent(&self, place: ReportPlace) -> [u32; 4] {
        match place {
            ReportPlace::Module([row, col]) => [row, col, 1, 1],
            ReportPlace::Window([row, col]) => [row, col, self.window[0], self.window[1]],
            ReportPlace::Area => [0, 0, self.modules[0], self.modules[1]],
        }
    }

    /// The closed ring around a place, counter-clockwise from the south-west.
    fn ring(&self, place: ReportPlace) -> Vec<[f64; 2]> {
        let [row, col, rows, cols] = self.extent(place);
        let east_m = |col: u32| self.origin_m[0] + f64::from(col) * self.module_side_m;
        let north_m = |row: u32| self.origin_m[1] + f64::from(row) * self.module_side_m;
        let (west, east, south, north) = (east_m(col), east_m(col + cols), north_m(row), north_m(row + rows));
        vec![[west, south], [east, south], [east, north], [west, north], [west, south]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    const PLACES: BreachPlaces = BreachPlaces {
        origin_m: [505_000.0, 3_875_000.0],
        module_side_m: 500.0,
        modules: [20, 30],
        window: [8, 8],
        epsg: 32611,
    };

    #[test]
    fn a_module_and_a_window_stand_where_they_lie_with_all_their_numbers() {
        let text = breaches_geojson(&samples::report(), &PLACES);
        let value: JsonValue = serde_json::from_str(&text).unwrap();
        assert_eq!(value["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::32611");
        let module = &value["features"][0];
        let ring = json!([
            [507500.0, 3877000.0],
            [508000.0, 3877000.0],
            [508000.0, 3877500.0],
            [507500.0, 3877500.0],
            [507500.0, 3877000.0]
        ]);
        assert_eq!(module["geometry"]["coordinates"][0], ring);
        assert_eq!(module["properties"]["kind"], "per_load_module");
        assert_eq!(module["properties"]["row"], 4);
        assert_eq!(module["properties"]["excess"], 7);
        let window = &value["features"][1];
        assert_eq!(window["geometry"]["coordinates"][0][2], json!([505500.0 + 4000.0, 3875000.0 + 4000.0]));
        assert_eq!(window["properties"]["rms_without_m"], 0.98);
        assert_eq!(value["features"][2]["properties"]["row"], JsonValue::Null);
        assert_eq!(value["features"][2]["geometry"]["coordinates"][0][2], json!([520000.0, 3885000.0]));
    }

    #[test]
    fn a_line_of_csv_has_a_field_for_every_name() {
        let text = breaches_csv(&samples::report(), &PLACES);
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        assert!(lines.iter().all(|line| line.len() == lines[0].len()), "{text}");
        assert_eq!(lines.len(), 1 + samples::report().breaches.len());
        assert_eq!(lines[1][..7], ["per_load_module", "module", "4", "5", "107", "100", "7"]);
        assert_eq!(lines[1][10..], ["507500", "3877000", "508000", "3877500"]);
        assert_eq!((lines[3][1], lines[3][2], lines[3][3]), ("area", "", ""));
    }

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
        let value: JsonValue = serde_json::from_str(&features_geojson("features", &remarks, 32611)).unwrap();
        assert_eq!(value["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::32611");
        assert_eq!(value["features"][0]["geometry"]["coordinates"], json!([505_000.5, 3_875_000.0]));
        let of = |index: usize, key: &str| value["features"][index]["properties"][key].clone();
        assert_eq!((of(0, "feature"), of(0, "outcome")), (json!("way 12"), json!("left out")));
        assert_eq!((of(1, "outcome"), of(1, "found")), (json!("degraded"), json!("it goes out and back")));
        assert_eq!(value["features"][1]["geometry"], JsonValue::Null);
    }

    #[test]
    fn no_breach_and_no_remark_is_an_empty_collection() {
        let mut report = samples::report();
        report.breaches.clear();
        for text in [breaches_geojson(&report, &PLACES), features_geojson("features", &[], 1)] {
            let value: JsonValue = serde_json::from_str(&text).unwrap();
            assert_eq!(value["features"], json!([]));
        }
    }
}
