//! Class rasters and polygons, as the mask gets them.

use source_files::{ClassRaster, SourceError, read_polygons};
use terrain::mask::Polygon;
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
    let classes = ClassRaster::open(&path, 32611, &grid, area).unwrap();
    let picture = |value| {
        let members = classes.members(&grid, area, value).unwrap();
        let rows = members.chunks(9).rev();
        rows.map(|row| row.iter().map(|&member| if member { '#' } else { '.' }).collect()).collect::<Vec<String>>()
    };
    let (none, low, high) = (".........", "..##.....", "....##...");
    assert_eq!(picture(1), [none, none, none, none, none, low, low, none, none]);
    assert_eq!(picture(-5), [none, none, none, none, none, high, high, none, none]);
    assert_eq!(picture(3), [none, none, none, low, low, none, none, none, none]);
    assert!(picture(4).iter().all(|row| row == none), "a void sample is of no class");
    let east = PostRect::new(Post::new(2, 4), Post::new(3, 6));
    assert_eq!(classes.members(&grid, east, -5).unwrap(), [true, true, false, true, true, false]);
}

#[test]
fn classes_are_whole_numbers_in_the_areas_system_and_somewhere_in_the_area() {
    let folder = Folder::new();
    let area = PostRect::of_size(3, 3);
    let open = |tiff: &Tiff, epsg, east_m| {
        let path = folder.write("class.tif", &tiff.bytes());
        ClassRaster::open(&path, epsg, &grid(east_m, 3_999_990.0, 5.0), area).map(|_| ())
    };
    let good = Tiff::of_heights(&[&[3, 4]]);
    assert!(open(&good, 32611, 500_000.0).is_ok());
    assert!(matches!(open(&good, 32612, 500_000.0), Err(SourceError::OutsideArea { .. })));
    assert!(matches!(open(&good, 32611, 900_000.0), Err(SourceError::NotCovered { .. })));
    assert!(matches!(open(&Tiff::of_floats(&[&[1.0]]), 32611, 500_000.0), Err(SourceError::NotClasses { .. })));
}

fn polygons(text: &str) -> Result<Vec<Polygon>, SourceError> {
    let folder = Folder::new();
    read_polygons(&folder.write("area.geojson", text.as_bytes()), 32611)
}

const RING: &str = "[[500000,4000000],[500100,4000000],[500100,4000100],[500000,4000000]]";

#[test]
fn a_byte_order_mark_before_geojson_is_no_part_of_it() {
    let polygon = format!(r#"{{"type":"Polygon","coordinates":[{RING}]}}"#);
    assert_eq!(polygons(&format!("\u{feff}{polygon}")).unwrap(), polygons(&polygon).unwrap());
}

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
    check_refused(&named("EPSG:4267"), "EPSG:4267: on a datum that needs a grid of shifts");
    check_refused(&named("somewhere"), "the coordinate reference system is somewhere");
    let pole = r#"{"type":"Polygon","coordinates":[[[0,89],[1,89],[1,95],[0,89]]]}"#;
    let said = pole.replacen('{', r#"{"crs":{"type":"name","properties":{"name":"EPSG:4326"}},"#, 1);
    check_refused(&said, "which cannot be brought to the area's EPSG:32611");
}

#[track_caller]
fn check_triangle(polygons: &[Polygon]) {
    // 116.6 W, 35.3 N is 536367.040835 E, 3906386.105537 N.
    let [east, north] = polygons[0].rings[0][0];
    assert!((east - 536_367.041).abs() < 0.001 && (north - 3_906_386.106).abs() < 0.001, "{east}, {north}");
    assert!(100 < polygons[0].rings[0].len(), "long sides are cut into pieces");
}

#[test]
fn polygons_in_degrees_are_brought_to_the_areas_system() {
    let bare = r#"{"type":"Polygon","coordinates":[[[-116.6,35.3],[-116.2,35.3],[-116.2,35.6],[-116.6,35.3]]]}"#;
    check_triangle(&polygons(bare).unwrap());
    for name in ["urn:ogc:def:crs:OGC:1.3:CRS84", "EPSG:4269"] {
        let said = format!(r#"{{"crs":{{"type":"name","properties":{{"name":"{name}"}}}},"#);
        check_triangle(&polygons(&bare.replacen('{', &said, 1)).unwrap());
    }
}

/// A Shapefile of one triangle.
fn shapefile(kind: u32, points: &[[f64; 2]]) -> Vec<u8> {
    let mut record: Vec<u8> = kind.to_le_bytes().to_vec();
    record.extend([0; 32]);
    record.extend(1_u32.to_le_bytes());
    record.extend((points.len() as u32).to_le_bytes());
    record.extend([0; 4]);
    record.extend(points.iter().flatten().flat_map(|number| number.to_le_bytes()));
    let mut bytes = vec![0, 0, 0x27, 0x0a];
    bytes.resize(100, 0);
    bytes.extend([1_u32.to_be_bytes(), (record.len() as u32 / 2).to_be_bytes()].concat());
    [bytes, record].concat()
}

#[test]
fn a_shapefile_is_read_with_its_prj_and_every_truncation_is_an_error() {
    let folder = Folder::new();
    let points = [[-116.6, 35.3], [-116.2, 35.3], [-116.2, 35.6], [-116.6, 35.3]];
    let bytes = shapefile(5, &points);
    let path = folder.write("a.shp", &bytes);
    check_triangle(&read_polygons(&path, 32611).unwrap());
    folder.write(
        "a.prj",
        br#"GEOGCS["x",DATUM["D_North_American_1983",SPHEROID["x",1,1]],UNIT["Degree",0.0174532925199433]]"#,
    );
    check_triangle(&read_polygons(&path, 32611).unwrap());
    folder.write("a.prj", br#"LOCAL_CS["x"]"#);
    assert!(matches!(read_polygons(&path, 32611), Err(SourceError::UnnamedCrs { .. })));
    for end in 0..bytes.len() {
        assert!(read_polygons(&folder.write("b.shp", &bytes[..end]), 32611).is_err(), "cut at {end}");
    }
    // What lies behind the records of the index is left over from an older file.
    let left_over = [bytes.clone(), vec![7; 40]].concat();
    let path = folder.write("c.shp", &left_over);
    assert!(read_polygons(&path, 32611).is_err());
    folder.write("c.shx", &[vec![0; 100], vec![0, 0, 0, 50, 0, 0, 0, 0]].concat());
    check_triangle(&read_polygons(&path, 32611).unwrap());
    let mut huge = bytes;
    huge[100 + 8 + 40..100 + 8 + 44].fill(0xff);
    assert!(matches!(read_polygons(&folder.write("b.shp", &huge), 32611), Err(SourceError::Truncated { .. })));
    let lines = folder.write("b.shp", &shapefile(3, &points));
    assert!(matches!(read_polygons(&lines, 32611), Err(SourceError::NotPolygons { found: "PolyLine", .. })));
}

#[test]
fn a_class_raster_of_another_system_is_met_at_the_nearest_sample() {
    let folder = Folder::new();
    let tiff = Tiff::of_heights(&[&[1, 2], &[3, 4]]).with_keys(&[(1024, 2), (2048, 4326)]);
    let tiff = tiff.with(33550, Values::Double(vec![0.01, 0.01, 0.0]));
    let tiff = tiff.with(33922, Values::Double(vec![0.0, 0.0, 0.0, -116.61, 35.31, 0.0]));
    let path = folder.write("class.tif", &tiff.bytes());
    // Where the four pixels meet: 116.6 W, 35.3 N.
    let grid = grid(536_342.0, 3_906_361.0, 50.0);
    let rect = PostRect::of_size(2, 2);
    let classes = ClassRaster::open(&path, 32611, &grid, rect).unwrap();
    let members = |value| classes.members(&grid, rect, value).unwrap();
    assert_eq!(members(3), [true, false, false, false]);
    assert_eq!(members(4), [false, true, false, false]);
    assert_eq!(members(1), [false, false, true, false]);
    assert_eq!(members(2), [false, false, false, true]);
}

#[test]
fn what_is_not_a_polygon_is_refused() {
    check_refused("no json at all", "neither a Shapefile, a GeoPackage nor GeoJSON");
    check_refused(r#"{"type":"Point","coordinates":[1,2]}"#, "a Point, expected Polygon");
    check_refused(r#"{"type":"FeatureCollection","features":[]}"#, "no polygon");
    let open = r#"{"type":"Polygon","coordinates":[[[0,0],[900,0],[900,900],[1,1]]]}"#;
    check_refused(open, "ring 0 has a last corner that is not its first");
    check_refused(r#"{"type":"Polygon","coordinates":[[[0,0],[900,0],[0,0]]]}"#, "ring 0 has 3 corners");
}

/// A GeoPackage geometry: mark, flags, system, then a square as well-known binary.
fn blob(west: f64, south: f64, side: f64) -> Vec<u8> {
    let mut bytes = b"GP\0\x01".to_vec();
    bytes.extend(26911_u32.to_le_bytes());
    bytes.push(1);
    bytes.extend([3_u32, 1, 5].iter().flat_map(|number| number.to_le_bytes()));
    let (east, north) = (west + side, south + side);
    let corners = [[west, south], [east, south], [east, north], [west, north], [west, south]];
    bytes.extend(corners.as_flattened().iter().flat_map(|number| number.to_le_bytes()));
    bytes
}

fn package(folder: &Folder, features: &str, blobs: &[Vec<u8>]) -> std::path::PathBuf {
    let path = folder.path("areas.gpkg");
    let database = rusqlite::Connection::open(&path).unwrap();
    let tables =
        "CREATE TABLE gpkg_spatial_ref_sys (srs_id INTEGER, organization TEXT, organization_coordsys_id INTEGER);
        CREATE TABLE gpkg_geometry_columns (table_name TEXT, column_name TEXT, srs_id INTEGER);
        INSERT INTO gpkg_spatial_ref_sys VALUES (4326, 'EPSG', 4326), (7, 'epsg', 32611);
        INSERT INTO gpkg_geometry_columns VALUES ('lakes', 'geom', 7);";
    database.execute_batch(tables).unwrap();
    database.execute_batch(features).unwrap();
    for blob in blobs {
        database.execute("INSERT INTO lakes (geom) VALUES (?1)", [blob]).unwrap();
    }
    path
}

const LAKES: &str = "CREATE TABLE lakes (fid INTEGER PRIMARY KEY, geom BLOB); INSERT INTO lakes (geom) VALUES (NULL);";

#[test]
fn a_geopackage_gives_the_polygons_of_its_layers_in_the_areas_system() {
    let folder = Folder::new();
    let path = package(&folder, LAKES, &[blob(500_000.0, 4.0e6, 100.0), blob(500_300.0, 4.0e6, 50.0)]);
    let polygons = read_polygons(&path, 32611).unwrap();
    assert_eq!(polygons.len(), 2);
    assert_eq!(polygons[1].rings[0][2], [500_350.0, 4_000_050.0]);
    let elsewhere = read_polygons(&path, 32612).unwrap();
    assert!(elsewhere[0].rings[0][0][0] < -30_000.0, "{:?}", elsewhere[0].rings[0][0]);
}

#[test]
fn a_geopackage_without_polygons_with_programs_or_cut_short_is_refused() {
    let refused = |features: &str, blobs: &[Vec<u8>]| {
        let folder = Folder::new();
        read_polygons(&package(&folder, features, blobs), 32611).unwrap_err().to_string()
    };
    let point = [&blob(0.0, 0.0, 1.0)[..9], &1_u32.to_le_bytes(), &[0; 16]].concat();
    assert!(refused(LAKES, &[]).contains("no polygon in the file"));
    assert!(refused(LAKES, &[point]).contains("a Point, expected Polygon"));
    assert!(refused(LAKES, &[blob(0.0, 0.0, 1.0)[..60].to_vec()]).contains("a geometry that is cut short"));
    let endless =
        "CREATE VIEW lakes AS WITH RECURSIVE n(geom) AS (SELECT x'00' UNION ALL SELECT geom FROM n) SELECT geom FROM n";
    assert!(refused(endless, &[]).contains("a layer `lakes` that is no table"));
    let huge = [&blob(0.0, 0.0, 1.0)[..17], &u32::MAX.to_le_bytes()].concat();
    assert!(refused(LAKES, &[huge]).contains("cut short"));
    let folder = Folder::new();
    let path = package(&folder, LAKES, &[blob(500_000.0, 4.0e6, 100.0)]);
    let bytes = std::fs::read(&path).unwrap();
    assert!(read_polygons(&folder.write("short.gpkg", &bytes[..4096]), 32611).is_err());
}
