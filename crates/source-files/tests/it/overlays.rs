//! Class rasters and polygons, as the mask gets them.

use mask::Polygon;
use source_files::{ClassRaster, SourceError, read_polygons};
use terrain::{Post, PostRect};

use crate::support::{Folder, Tiff, Values, grid};

#[test]
fn a_post_has_the_class_of_the_nearest_sample_and_none_beyond() {
    let folder = Folder::new();
    // Two by two samples 10 m apart; the south-west one at (500005, 3999985).
    let tiff = Tiff::of_heights(&[&[3, 4], &[1, -5]]).with(42113, Values::Text("4"));
    let path = folder.write("class.tif", &tiff.bytes());
    let grid = grid(499_990.0, 3_999_970.0, 5.0);
    let area = PostRect::of_size(9, 9);
    let classes = ClassRaster::read(&path, 32611, &grid, area).unwrap();
    let picture = |value| {
        let members = classes.members(&grid, area, value);
        let rows = members.chunks(9).rev();
        rows.map(|row| row.iter().map(|&member| if member { '#' } else { '.' }).collect()).collect::<Vec<String>>()
    };
    let (none, low, high) = (".........", "..##.....", "....##...");
    assert_eq!(picture(1), [none, none, none, none, none, low, low, none, none]);
    assert_eq!(picture(-5), [none, none, none, none, none, high, high, none, none]);
    assert_eq!(picture(3), [none, none, none, low, low, none, none, none, none]);
    assert!(picture(4).iter().all(|row| row == none), "a void sample is of no class");
    let east = PostRect::new(Post::new(2, 4), Post::new(3, 6));
    assert_eq!(classes.members(&grid, east, -5), [true, true, false, true, true, false]);
}

#[test]
fn classes_are_whole_numbers_in_the_areas_system_and_somewhere_in_the_area() {
    let folder = Folder::new();
    let area = PostRect::of_size(3, 3);
    let open = |tiff: &Tiff, epsg, east_m| {
        let path = folder.write("class.tif", &tiff.bytes());
        ClassRaster::read(&path, epsg, &grid(east_m, 3_999_990.0, 5.0), area).map(|_| ())
    };
    let good = Tiff::of_heights(&[&[3, 4]]);
    assert!(open(&good, 32611, 500_000.0).is_ok());
    assert!(matches!(open(&good, 32612, 500_000.0), Err(SourceError::OtherCrs { .. })));
    assert!(matches!(open(&good, 32611, 900_000.0), Err(SourceError::NotCovered { .. })));
    assert!(matches!(open(&Tiff::of_floats(&[&[1.0]]), 32611, 500_000.0), Err(SourceError::NotClasses { .. })));
}

fn polygons(text: &str) -> Result<Vec<Polygon>, SourceError> {
    let folder = Folder::new();
    read_polygons(&folder.write("area.geojson", text.as_bytes()), 32611)
}

const RING: &str = "[[500000,4000000],[500100,4000000],[500100,4000100],[500000,4000000]]";

#[test]
fn polygons_are_found_in_every_wrapping() {
    let polygon = format!(r#"{{"type":"Polygon","coordinates":[{RING},{RING}]}}"#);
    let multi = format!(r#"{{"type":"MultiPolygon","coordinates":[[{RING}],[{RING}]]}}"#);
    let feature = |geometry: &str| format!(r#"{{"type":"Feature","properties":null,"geometry":{geometry}}}"#);
    let collection = format!(
        r#"{{"type":"FeatureCollection","crs":{{"type":"name","properties":{{"name":"urn:ogc:def:crs:EPSG::32611"}}}},
        "features":[{},{},{}]}}"#,
        feature(&polygon),
        feature("null"),
        feature(&multi)
    );
    let rings = |text: &str| polygons(text).unwrap().iter().map(|polygon| polygon.rings.len()).collect::<Vec<_>>();
    assert_eq!(rings(&polygon), [2]);
    assert_eq!(rings(&feature(&multi)), [1, 1]);
    assert_eq!(rings(&collection), [2, 1, 1]);
    assert_eq!(polygons(&polygon).unwrap()[0].rings[0][1], [500_100.0, 4_000_000.0]);
}

#[track_caller]
fn check_refused(text: &str, expected: &str) {
    let error = polygons(text).unwrap_err();
    assert!(error.to_string().contains(expected), "{error}");
    assert!(error.hint().is_some());
}

#[test]
fn polygons_of_another_system_are_refused() {
    let named = |crs: &str| {
        format!(
            r#"{{"type":"FeatureCollection","features":[],"crs":{{"type":"name","properties":{{"name":"{crs}"}}}}}}"#
        )
    };
    check_refused(&named("urn:ogc:def:crs:OGC:1.3:CRS84"), "in urn:ogc:def:crs:OGC:1.3:CRS84, expected the area's");
    check_refused(&named("EPSG:32612"), "coordinates are in EPSG:32612");
    let degrees = r#"{"type":"Polygon","coordinates":[[[-116.5,35.1],[-116.2,35.1],[-116.2,35.4],[-116.5,35.1]]]}"#;
    check_refused(degrees, "look like longitude and latitude (-116.5, 35.1)");
}

#[test]
fn what_is_not_a_polygon_is_refused() {
    check_refused("no json at all", "not GeoJSON");
    check_refused(r#"{"type":"Point","coordinates":[1,2]}"#, "a Point, expected Polygon");
    check_refused(r#"{"type":"FeatureCollection","features":[]}"#, "no polygon");
    let open = r#"{"type":"Polygon","coordinates":[[[0,0],[900,0],[900,900],[1,1]]]}"#;
    check_refused(open, "ring 0 has a last corner that is not its first");
    check_refused(r#"{"type":"Polygon","coordinates":[[[0,0],[900,0],[0,0]]]}"#, "ring 0 has 3 corners");
}
