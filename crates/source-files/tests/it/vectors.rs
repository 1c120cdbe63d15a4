//! Lines and polygons from GeoPackages, Shapefiles and GeoJSON, and files that are none of these.

use std::path::{Path, PathBuf};

use source_files::{
    DemFile, Extent, FeatureFile, Reading, SourceError, VectorFeature, VectorShape, Wanted, feature_layers,
    is_feature_file, read_features,
};
use terrain::in_turn;

use crate::pbf::header;
use crate::support::{self, Folder, Tiff, ids, remarks};

const WANTED: Wanted = Wanted { keys: &[], ..support::WANTED };

#[track_caller]
pub fn read(path: &Path) -> FeatureFile {
    read_features(path, &WANTED, &in_turn).unwrap()
}

pub fn tags(feature: &VectorFeature) -> Vec<(&str, &str)> {
    feature.tags.iter().map(|(key, value)| (key.as_ref(), value.as_ref())).collect()
}

/// The number of vertices of the line, or of each ring, and the heights of the first.
fn sizes(feature: &VectorFeature) -> (Vec<usize>, Vec<Option<f64>>) {
    match &feature.shape {
        VectorShape::Point(_) => (vec![1], vec![]),
        VectorShape::Line(line) => (vec![line.places.len()], line.heights_m.clone()),
        VectorShape::Polygon(rings) => {
            (rings.iter().map(|ring| ring.places.len()).collect(), rings[0].heights_m.clone())
        }
    }
}

fn json(features: &[(&str, &str)]) -> FeatureFile {
    let feature = |(geometry, properties): &(&str, &str)| {
        format!(r#"{{"type":"Feature","geometry":{geometry},"properties":{{{properties}}}}}"#)
    };
    let features = features.iter().map(feature).collect::<Vec<_>>().join(",");
    let folder = Folder::new();
    let text = format!(r#"{{"type":"FeatureCollection","features":[{features}]}}"#);
    read(&folder.write("roads.geojson", text.as_bytes()))
}

const LINE: &str = r#"{"type":"LineString","coordinates":[[-117,35],[-116.991,35]]}"#;
const SQUARE: &str = "[[500000,3870000],[500900,3870000],[500900,3870900],[500000,3870000]]";
const HOLE: &str = "[[500500,3870100],[500600,3870100],[500600,3870200],[500500,3870100]]";

#[test]
fn geojson_is_read_in_every_wrapping_with_its_properties_as_texts() {
    let properties = r#""name":"a","lanes":2,"width":3.5,"oneway":true,"nothing":null,"list":[1,2]"#;
    let packed = r#""other_tags":"\"bridge\"=>\"yes\"""#;
    let properties = &format!("{properties},{packed}");
    let multi = r#"{"type":"MultiLineString","coordinates":[[[-117,35],[-116.99,35]],[[-117,35.01],[-117,35.02]]]}"#;
    let point = r#"{"type":"Point","coordinates":[-117,35]}"#;
    let collection = format!(r#"{{"type":"GeometryCollection","geometries":[{LINE},{point}]}}"#);
    let file = json(&[(LINE, properties), ("null", ""), (multi, ""), (&collection, ""), (point, "")]);
    let expected = ["roads.geojson#0", "roads.geojson#2.1", "roads.geojson#2.2", "roads.geojson#3"];
    assert_eq!((ids(&file), file.found, file.outside), (expected.to_vec(), 3, 0));
    let expected =
        [("bridge", "yes"), ("lanes", "2"), ("list", "[1,2]"), ("name", "a"), ("oneway", "true"), ("width", "3.5")];
    assert_eq!(tags(&file.features[0]), expected);
    // Half a kilometre at most between the vertices of a straight line in degrees.
    assert_eq!(sizes(&file.features[0]), (vec![3], vec![]));
    assert_eq!(
        remarks(&file),
        [
            "roads.geojson#3: a Point, where lines and polygons are read (left out, its lines and polygons kept)",
            "roads.geojson#4: a Point, where lines and polygons are read (left out)"
        ]
    );
}

#[test]
fn polygons_in_the_areas_metres_keep_their_holes_and_heights() {
    let polygon = format!(r#"{{"type":"Polygon","coordinates":[{SQUARE},{HOLE}]}}"#);
    let multi = format!(r#"{{"type":"MultiPolygon","coordinates":[[{SQUARE}],[{HOLE}]]}}"#);
    let high = r#"{"type":"LineString","coordinates":[[500000,3870000,7],[500010,3870000],[500020,3870000,9.5]]}"#;
    let file = json(&[(&polygon, ""), (&multi, ""), (high, "")]);
    let found: Vec<_> = file.features.iter().map(sizes).collect();
    let heights = vec![Some(7.0), None, Some(9.5)];
    assert_eq!(found, [(vec![4, 4], vec![]), (vec![4], vec![]), (vec![4], vec![]), (vec![3], heights)]);
    let expected = "roads.geojson#2: 1 of 3 heights that are none, the first NaN (left without a height there)";
    assert_eq!(remarks(&file), [expected]);
}

#[test]
fn numbers_that_are_no_degrees_are_metres_of_the_area_and_that_is_told() {
    let square = format!(r#"{{"type":"Polygon","coordinates":[{SQUARE}]}}"#);
    let [note] = &json(&[(&square, "")]).notes[..] else { panic!("expected one note") };
    assert!(note.starts_with("it names no coordinate system") && note.contains("metres of EPSG:32611"), "{note}");
    assert_eq!(json(&[(LINE, "")]).notes, [""; 0]);
}

#[test]
fn an_empty_collection_is_told_and_no_error() {
    let file = json(&[]);
    assert_eq!((file.features.len(), file.notes), (0, vec!["no line or polygon in the file".to_owned()]));
}

#[test]
fn a_feature_off_the_earth_is_left_out_and_the_others_are_still_in_degrees() {
    let off = r#"{"type":"LineString","coordinates":[[-117,35],[-117,95]]}"#;
    let nowhere = r#"{"type":"LineString","coordinates":[[-117,35],[-117]]}"#;
    let file = json(&[(LINE, ""), (off, ""), (nowhere, "")]);
    assert_eq!(ids(&file), ["roads.geojson#0"]);
    assert_eq!(
        remarks(&file),
        [
            "roads.geojson#1: a vertex at -117, 95, which is not on the Earth (left out)",
            "roads.geojson#2: a vertex at -117, NaN, expected two numbers (left out)",
        ]
    );
}

#[test]
fn rings_are_closed_and_those_of_too_few_vertices_left_out() {
    let open = "[[500000,3870000],[500900,3870000],[500900,3870900]]";
    let flat = "[[500000,3870000],[500900,3870000],[500000,3870000]]";
    let polygon = |rings: &str| format!(r#"{{"type":"Polygon","coordinates":[{rings}]}}"#);
    let one = r#"{"type":"MultiLineString","coordinates":[[[500000,3870000]],[]]}"#;
    let hole = format!("{SQUARE},{flat}");
    let file = json(&[(&polygon(open), ""), (&polygon(flat), ""), (&polygon(&hole), ""), (one, "")]);
    let found: Vec<_> = file.features.iter().map(|feature| sizes(feature).0).collect();
    assert_eq!(found, [vec![4], vec![4]]);
    assert_eq!(
        remarks(&file),
        [
            "roads.geojson#0: a ring whose last vertex is not its first (closed)",
            "roads.geojson#1: a ring of 3 vertices, the last being the first (left out)",
            "roads.geojson#2: a ring of 3 vertices, the last being the first (the hole left out)",
            "roads.geojson#3: a line of 1 vertex (left out)",
            "roads.geojson#3: a line of 0 vertices (left out)",
        ]
    );
}

#[test]
fn degrees_counted_eastward_all_round_are_the_same_places() {
    let file = json(&[(LINE, ""), (r#"{"type":"LineString","coordinates":[[243,35],[243.009,35]]}"#, "")]);
    let VectorShape::Line(a) = &file.features[0].shape else { panic!("expected a line") };
    let VectorShape::Line(b) = &file.features[1].shape else { panic!("expected a line") };
    let off = a.places.as_flattened().iter().zip(b.places.as_flattened()).map(|(a, b)| (a - b).abs());
    assert!(off.fold(0.0, f64::max) < 1.0e-6, "{a:?} {b:?}");
}

#[test]
fn what_crosses_the_180th_meridian_is_the_same_however_longitudes_are_counted() {
    let bounds = Extent { east: [700_000.0, 730_000.0], north: [5_500_000.0, 5_600_000.0] };
    let wanted = Wanted { epsg: 32_660, bounds, ..WANTED };
    let folder = Folder::new();
    let places = |kind: &str, coordinates: &str| {
        let text = format!(r#"{{"type":"{kind}","coordinates":{coordinates}}}"#);
        let file = read_features(&folder.write("a.geojson", text.as_bytes()), &wanted, &in_turn).unwrap();
        assert_eq!((file.outside, remarks(&file)), (0, vec![]), "{coordinates}");
        let flat = |shape: VectorShape| match shape {
            VectorShape::Point(place) => vec![place],
            VectorShape::Line(line) => line.places,
            VectorShape::Polygon(rings) => rings.into_iter().flat_map(|ring| ring.places).collect(),
        };
        file.features.into_iter().map(|feature| flat(feature.shape)).collect::<Vec<_>>()
    };
    for (kind, eastward, crossing) in [
        ("LineString", "[[179.99,50],[180.01,50.001]]", "[[179.99,50],[-179.99,50.001]]"),
        ("LineString", "[[180.01,50],[179.99,50]]", "[[-179.99,50],[179.99,50]]"),
        (
            "Polygon",
            "[[[179.99,50],[180.01,50],[180.01,50.01],[179.99,50]]]",
            "[[[179.99,50],[-179.99,50],[-179.99,50.01],[179.99,50]]]",
        ),
        (
            "MultiLineString",
            "[[[179.99,50],[180,50]],[[180,50],[180.01,50]]]",
            "[[[179.99,50],[180,50]],[[-180,50],[-179.99,50]]]",
        ),
    ] {
        let (one, other) = (places(kind, eastward), places(kind, crossing));
        assert_eq!(one.len(), other.len(), "{kind}");
        for (one, other) in one.iter().zip(&other) {
            assert_eq!(one.len(), other.len(), "{kind}");
            let off = one.iter().zip(other).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max);
            assert!(off < 1.0e-6, "{kind}: {off} m");
        }
    }
}

#[test]
fn features_elsewhere_are_counted_and_where_they_lie_is_told() {
    let file = json(&[(r#"{"type":"LineString","coordinates":[[8,47],[8.5,47.25]]}"#, "")]);
    assert_eq!((file.features.len(), file.found, file.outside), (0, 1, 1));
    assert!(file.notes[0].contains("they lie from 8.0000, 47.0000 to 8.5000, 47.2500 (EPSG:4326)"), "{:?}", file.notes);
    // Over all the Earth, where the area's system expresses nothing any more.
    let round = r#"{"type":"LineString","coordinates":[[-179,35],[-90,-80],[0,35],[90,80],[179,-35],[-117,35]]}"#;
    let file = json(&[(round, "")]);
    assert_eq!((file.outside, remarks(&file)), (0, vec![]));
    let VectorShape::Line(line) = &file.features[0].shape else { panic!("expected a line") };
    assert!(line.places.len() < 30, "only what is near is projected");
}

/// A GeoPackage geometry: mark, flags, no box, then well-known binary.
pub fn blob(kind: u32, runs: &[&[&[f64]]]) -> Vec<u8> {
    let mut bytes = b"GP\0\x01\0\0\0\0\x01".to_vec();
    bytes.extend(kind.to_le_bytes());
    if kind % 1000 != 2 {
        bytes.extend((runs.len() as u32).to_le_bytes());
    }
    for run in runs {
        bytes.extend((run.len() as u32).to_le_bytes());
        bytes.extend(run.iter().copied().flatten().flat_map(|number| number.to_le_bytes()));
    }
    bytes
}

pub fn package(folder: &Folder, layers: &[(&str, &[Vec<u8>])]) -> PathBuf {
    let path = folder.path("hydro.gpkg");
    let database = rusqlite::Connection::open(&path).unwrap();
    let tables =
        "CREATE TABLE gpkg_spatial_ref_sys (srs_id INTEGER, organization TEXT, organization_coordsys_id INTEGER);
        CREATE TABLE gpkg_geometry_columns (table_name TEXT, column_name TEXT, srs_id INTEGER);
        INSERT INTO gpkg_spatial_ref_sys VALUES (4326, 'EPSG', 4326), (7, 'epsg', 32611);";
    database.execute_batch(tables).unwrap();
    for (name, blobs) in layers {
        database.execute("INSERT INTO gpkg_geometry_columns VALUES (?1, 'geom', 7)", [name]).unwrap();
        let columns = "fid INTEGER PRIMARY KEY, geom BLOB, waterway TEXT, lanes INTEGER, width REAL, photo BLOB";
        database.execute_batch(&format!("CREATE TABLE \"{name}\" ({columns})")).unwrap();
        for blob in *blobs {
            let insert = format!("INSERT INTO \"{name}\" (geom, waterway, lanes, width) VALUES (?1, 'river', 2, 2.5)");
            database.execute(&insert, [blob]).unwrap();
        }
    }
    path
}

pub const RUN: &[&[f64]] = &[&[500_000.0, 3.87e6, 5.0], &[500_100.0, 3.87e6, f64::NAN], &[500_200.0, 3.87e6, 1.0e9]];

#[test]
fn a_geopackage_gives_lines_with_heights_and_columns_as_tags() {
    let folder = Folder::new();
    let flat: &[&[f64]] = &[&[500_000.0, 3.87e6], &[500_100.0, 3.87e6], &[500_200.0, 3.871e6]];
    let measured: &[&[f64]] = &[&[500_000.0, 3.87e6, 1.0], &[500_100.0, 3.87e6, 2.0]];
    let short = blob(2, &[flat])[..40].to_vec();
    let point = [&blob(1, &[])[..13], &[0; 16]].concat();
    let rivers = [blob(1002, &[RUN]), blob(2, &[flat]), blob(2002, &[measured]), short, point];
    let path = package(&folder, &[("rivers", &rivers), ("empty", &[])]);
    let file = read(&path);
    assert_eq!(ids(&file), ["hydro.gpkg:rivers#1", "hydro.gpkg:rivers#2", "hydro.gpkg:rivers#3"]);
    assert_eq!(tags(&file.features[0]), [("lanes", "2"), ("waterway", "river"), ("width", "2.5")]);
    assert_eq!(sizes(&file.features[0]), (vec![3], vec![Some(5.0), None, None]));
    assert_eq!((sizes(&file.features[1]), sizes(&file.features[2])), ((vec![3], vec![]), (vec![2], vec![])));
    assert_eq!(
        remarks(&file),
        [
            "hydro.gpkg:rivers#1: 2 of 3 heights that are none, the first NaN (left without a height there)",
            "hydro.gpkg:rivers#4: a geometry that is cut short (left out)",
            "hydro.gpkg:rivers#5: a Point, where lines and polygons are read (left out)",
        ]
    );
}

/// A geometry that holds others, in well-known binary.
fn holding(kind: u32, members: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = blob(kind, &[])[..13].to_vec();
    bytes.extend((members.len() as u32).to_le_bytes());
    members.iter().for_each(|member| bytes.extend(&member[8..]));
    bytes
}

/// A curve without a number of runs, as lines have none.
fn curve(kind: u32, run: &[&[f64]]) -> Vec<u8> {
    let mut bytes = blob(2, &[run]);
    bytes[9..13].copy_from_slice(&kind.to_le_bytes());
    bytes
}

#[test]
fn curves_of_a_geopackage_become_chords() {
    let folder = Folder::new();
    let (west, top, east) = ([500_000.0, 3.87e6], [500_100.0, 3_870_100.0], [500_200.0, 3.87e6]);
    let arc = curve(8, &[&west, &top, &east]);
    let high = curve(1008, &[&[west[0], west[1], 5.0], &[top[0], top[1], 6.0], &[east[0], east[1], 7.0]]);
    let back = curve(2, &[&east, &west]);
    let joined = holding(9, &[arc.clone(), back.clone()]);
    let hole = curve(8, &[&[500_090.0, 3_870_050.0], &[500_110.0, 3_870_050.0], &[500_090.0, 3_870_050.0]]);
    let area = holding(10, &[joined.clone(), hole]);
    let shapes = [arc.clone(), high, joined, area.clone(), holding(11, &[arc, back]), holding(12, &[area])];
    let unread: Vec<Vec<u8>> = (0..2).map(|_| holding(15, &[])).collect();
    let file = read(&package(&folder, &[("curves", &[&shapes[..], &unread].concat())]));
    assert_eq!(file.features.len(), 7, "two of the many lines");
    let [arc, high, joined, area] = &file.features[..4] else { panic!("expected four") };
    let count = sizes(arc).0[0];
    assert!((30..120).contains(&count), "{count}");
    assert_eq!(sizes(high).1[..], [&[Some(5.0)], &sizes(high).1[1..]].concat());
    assert_eq!(sizes(high).1.last(), Some(&Some(7.0)));
    assert_eq!(sizes(joined).0, [count + 1], "where one ends the other begins");
    assert!(matches!(sizes(area).0[..], [outer, hole] if outer == count + 1 && 9 < hole), "{:?}", sizes(area).0);
    let note =
        "2 of its features are left out, as their shapes are not read; the first has a geometry of some other kind";
    assert!(file.notes.iter().any(|told| told.starts_with(note)), "{:?}", file.notes);
}

#[test]
fn points_are_read_where_they_are_wanted() {
    let folder = Folder::new();
    let wanted = Wanted { points: true, ..WANTED };
    let places = |path: &Path| -> Vec<VectorShape> {
        let file = read_features(path, &wanted, &in_turn).unwrap();
        assert_eq!(file.remarks, []);
        file.features.into_iter().map(|feature| feature.shape).collect()
    };
    let at = |east: f64| VectorShape::Point([east, 3.87e6]);
    let point = |east: f64| [&blob(1, &[])[..13], &east.to_le_bytes(), &3.87e6_f64.to_le_bytes()].concat();
    let path = package(&folder, &[("masts", &[point(500_000.0), point(600_000.0)])]);
    assert_eq!(places(&path), [at(500_000.0)], "the other lies outside");
    let text = r#"{"type":"MultiPoint","coordinates":[[500000,3870000],[500100,3870000,7]]}"#;
    assert_eq!(places(&folder.write("a.geojson", text.as_bytes())), [at(500_000.0), at(500_100.0)]);
}

#[test]
fn a_system_that_a_geopackage_spells_out_is_read_with_its_heights() {
    let folder = Folder::new();
    let path =
        package(&folder, &[("rivers", &[blob(1002, &[&[&[500_000.0, 3.87e6, 100.0], &[500_100.0, 3.87e6, 10.0]]])])]);
    let database = rusqlite::Connection::open(&path).unwrap();
    let text = r#"COMPOUNDCRS["x",PROJCRS["WGS 84 / UTM zone 11N",ID["EPSG",32611]],VERTCRS["NAVD88 height (ftUS)",
        VDATUM["x"],CS[vertical,1],AXIS["h",up],LENGTHUNIT["US survey foot",0.304800609601219],ID["EPSG",6360]]]"#;
    let more =
        "UPDATE gpkg_spatial_ref_sys SET organization = 'NONE', organization_coordsys_id = 100000 WHERE srs_id = 7;
        ALTER TABLE gpkg_spatial_ref_sys ADD COLUMN definition TEXT DEFAULT 'undefined';";
    database.execute_batch(more).unwrap();
    let error = read_features(&path, &WANTED, &in_turn).unwrap_err().to_string();
    assert!(error.contains("NONE:100000"), "{error}");
    database.execute_batch("ALTER TABLE gpkg_spatial_ref_sys ADD COLUMN definition_12_063 TEXT").unwrap();
    database.execute("UPDATE gpkg_spatial_ref_sys SET definition_12_063 = ?1", [text]).unwrap();
    let heights = sizes(&read(&path).features[0]).1;
    assert!((heights[0].unwrap() - 30.48).abs() < 1.0e-3, "{heights:?}");
}

#[test]
fn a_layer_that_is_a_program_keeps_no_other_from_being_read() {
    let folder = Folder::new();
    let path = package(&folder, &[("rivers", &[blob(1002, &[RUN])])]);
    let database = rusqlite::Connection::open(&path).unwrap();
    let view = "CREATE VIEW all_rivers AS SELECT * FROM rivers;
        INSERT INTO gpkg_geometry_columns VALUES ('all_rivers', 'geom', 7);";
    database.execute_batch(view).unwrap();
    let file = read(&path);
    assert_eq!(ids(&file), ["hydro.gpkg:rivers#1"]);
    assert_eq!(file.notes, ["a layer `all_rivers` that is no table, which is not read"]);
    let of = |layer| read_features(&path, &Wanted { layer: Some(layer), ..WANTED }, &in_turn);
    assert_eq!(of("rivers").unwrap().notes, [""; 0]);
    let error = of("all_rivers").unwrap_err();
    assert!(error.to_string().contains("a layer `all_rivers` that is no table"), "{error}");
    assert!(error.hint().unwrap().contains("ogr2ogr"), "{error}");
}

#[test]
fn a_sequence_of_features_is_told_as_what_it_is() {
    let folder = Folder::new();
    let feature = format!(r#"{{"type":"Feature","properties":null,"geometry":{LINE}}}"#);
    let text = format!("{feature}\n{feature}\n");
    let error = read_features(&folder.write("a.geojson", text.as_bytes()), &WANTED, &in_turn).unwrap_err();
    assert!(error.to_string().contains("GeoJSONSeq"), "{error}");
}

#[test]
fn of_several_layers_one_is_to_be_named() {
    let folder = Folder::new();
    let lines = [blob(1002, &[RUN])];
    let path = package(&folder, &[("rivers", &lines), ("lakes", &lines), ("none", &[])]);
    let refused = |layer| {
        let error = read_features(&path, &Wanted { layer, ..WANTED }, &in_turn).unwrap_err();
        (error.to_string().replace(&path.display().to_string(), "F"), error.hint().unwrap())
    };
    assert_eq!(refused(None).0, "F: 2 layers: `rivers`, `lakes`; expected one of them named");
    assert!(refused(None).1.contains("layer = "));
    let expected = "F: the layer `roads` named; expected one of `rivers`, `lakes`, `none`";
    assert_eq!(refused(Some("roads")).0, expected);
    let named = read_features(&path, &Wanted { layer: Some("lakes"), ..WANTED }, &in_turn).unwrap();
    assert_eq!(ids(&named), ["hydro.gpkg:lakes#1"]);
    assert_eq!(feature_layers(&path).unwrap(), ["rivers", "lakes", "none"]);
    let json = folder.write("a.geojson", LINE.as_bytes());
    assert!(matches!(
        read_features(&json, &Wanted { layer: Some("x"), ..WANTED }, &in_turn),
        Err(SourceError::Layer { .. })
    ));
    assert_eq!((ids(&read(&json)), feature_layers(&json).unwrap().len()), (vec!["a.geojson#0"], 0));
}

#[test]
fn a_number_that_is_none_costs_its_own_feature_of_geojson_alone() {
    let line = |places: &str| format!(r#"{{"type":"LineString","coordinates":[{places}]}}"#);
    let places = ["[-117,35,NaN],[-116.996,35,7]", "[-117,null],[-116.991,35]", "[-117,35],[-116.991,1e999]"];
    let mut all: Vec<String> = places.iter().map(|places| line(places)).collect();
    all.extend([
        r#"{"type":"Line"}"#.into(),
        "7".into(),
        r#"{"type":"LineString","coordinates":[7]}"#.into(),
        line(r#"["a",35],[-117,35]"#),
        LINE.into(),
    ]);
    let all: Vec<(&str, &str)> = all.iter().map(|geometry| (geometry.as_str(), r#""highway":"track""#)).collect();
    let file = json(&all);
    assert_eq!(ids(&file), ["roads.geojson#0", "roads.geojson#7"]);
    let note = "6 of its 8 lines and polygons are left out; the first has a coordinate null, expected a number";
    assert_eq!(file.notes, [note]);

    assert_eq!(sizes(&file.features[0]), (vec![2], vec![None, Some(7.0)]));
    let told = remarks(&file).join("; ");
    for expected in [
        "#0: 1 of 2 heights that are none",
        "#1: a coordinate null, expected a number (left out)",
        "#2: a coordinate null, expected a number (left out)",
        "#6: a coordinate \"a\", expected a number (left out)",
        "#3: a geometry that is none (left out)",
        "#4: a geometry that is none (left out)",
        "#5: a place that is none (left out)",
    ] {
        assert!(told.contains(expected), "{expected}: {told}");
    }
}

#[test]
fn a_geopackage_without_features_or_layers_is_told() {
    let folder = Folder::new();
    let file = read(&package(&folder, &[("rivers", &[])]));
    assert_eq!((file.features.len(), file.notes), (0, vec!["no line or polygon in the file".to_owned()]));
    let folder = Folder::new();
    let file = read(&package(&folder, &[]));
    let expected = ["a GeoPackage without a layer of features", "no line or polygon in the file"];
    assert_eq!((file.features.len(), file.notes), (0, expected.map(String::from).to_vec()));
}

#[test]
fn a_column_whose_name_is_no_text_is_no_panic() {
    let folder = Folder::new();
    let path = package(&folder, &[("rivers", &[blob(1002, &[RUN])])]);
    let bytes = std::fs::read(&path).unwrap();
    let at = bytes.windows(10).position(|window| window == b"lanes INTE").unwrap();
    let file = read(&folder.write("hydro.gpkg", &[&bytes[..at], b"\xffanes", &bytes[at + 5..]].concat()));
    assert_eq!(tags(&file.features[0])[1..], [("width", "2.5"), ("\u{fffd}anes", "2")]);
}

/// A record of a Shapefile, whose parts begin at some points.
pub fn record(kind: u32, starts: &[u32], points: &[[f64; 3]]) -> Vec<u8> {
    let mut record: Vec<u8> = kind.to_le_bytes().to_vec();
    record.extend([0; 32]);
    record.extend((starts.len() as u32).to_le_bytes());
    record.extend((points.len() as u32).to_le_bytes());
    record.extend(starts.iter().flat_map(|start| start.to_le_bytes()));
    record.extend(points.iter().flat_map(|point| [point[0].to_le_bytes(), point[1].to_le_bytes()].concat()));
    if kind == 13 {
        record.extend([0; 16]);
        record.extend(points.iter().flat_map(|point| point[2].to_le_bytes()));
    }
    let head = [1_u32.to_be_bytes(), (record.len() as u32 / 2).to_be_bytes()].concat();
    [head, record].concat()
}

/// A table of one text, one number and one truth.
fn table(rows: &[&str]) -> Vec<u8> {
    let column = |name: &str, kind: u8, size: u8| {
        let mut column = name.as_bytes().to_vec();
        column.resize(11, 0);
        column.push(kind);
        column.resize(16, 0);
        column.push(size);
        column.resize(32, 0);
        column
    };
    let columns = [column("highway", b'C', 6), column("lanes", b'N', 3), column("oneway", b'L', 1), vec![13]].concat();
    let mut head = vec![3, 126, 1, 1];
    head.extend((rows.len() as u32).to_le_bytes());
    head.extend((32 + columns.len() as u16).to_le_bytes());
    head.extend(11_u16.to_le_bytes());
    head.resize(32, 0);
    [head, columns, rows.concat().into_bytes()].concat()
}

pub fn shapefile(records: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = vec![0, 0, 0x27, 0x0a];
    bytes.resize(100, 0);
    [bytes, records.concat()].concat()
}

#[test]
fn a_shapefile_gives_lines_with_heights_and_its_table_as_tags() {
    let folder = Folder::new();
    let points: Vec<[f64; 3]> = RUN.iter().map(|place| [place[0], place[1], 7.0]).collect();
    let lines =
        [record(13, &[0], &points), record(3, &[0], &points), record(3, &[0], &points), record(3, &[0], &points)];
    let path = folder.write("roads.shp", &shapefile(&lines));
    let bare = read(&path);
    assert_eq!((bare.features.len(), bare.notes.len()), (4, 2));
    assert!(bare.notes[1].contains("no table (.dbf) beside it"), "{:?}", bare.notes);
    folder.write("roads.DBF", &table(&[" track   2T", "*gone    1F", " \u{e9}    ***?"]));
    folder.write("roads.cpg", b"UTF-8\n");
    let file = read(&path);
    assert_eq!(ids(&file), ["roads.shp#0", "roads.shp#2", "roads.shp#3"]);
    assert_eq!(tags(&file.features[0]), [("highway", "track"), ("lanes", "2"), ("oneway", "true")]);
    assert_eq!(tags(&file.features[1]), [("highway", "\u{e9}")]);
    assert_eq!(sizes(&file.features[0]), (vec![3], vec![Some(7.0); 3]));
    assert_eq!(remarks(&file), ["roads.shp#3: no row in the table (read without attributes)"]);
    for end in 32..folder.path("roads.DBF").metadata().unwrap().len() as usize {
        let whole = table(&[" track   2T", "*gone    1F", " \u{e9}    ***?"]);
        folder.write("roads.DBF", &whole[..end]);
        assert!(matches!(read_features(&path, &WANTED, &in_turn), Err(SourceError::Truncated { .. })), "cut at {end}");
    }
}

#[test]
fn rings_of_a_shapefile_are_polygons_with_their_holes() {
    let folder = Folder::new();
    let square = |west: f64, side: f64| {
        let corners = [[0.0, 0.0], [0.0, side], [side, side], [side, 0.0], [0.0, 0.0]];
        corners.map(|[east, north]| [500_000.0 + west + east, 3.87e6 + west + north, 0.0])
    };
    let rings = [square(0.0, 100.0), square(10.0, 50.0), square(20.0, 5.0), square(200.0, 5.0)].concat();
    let path = folder.write("lakes.shp", &shapefile(&[record(5, &[0, 5, 10, 15], &rings)]));
    let found: Vec<Vec<usize>> = read(&path).features.iter().map(|feature| sizes(feature).0).collect();
    assert_eq!(found, [vec![5, 5], vec![5], vec![5]]);
}

#[test]
fn what_is_no_file_of_features_is_refused_by_name() {
    let folder = Folder::new();
    let refused = |name: &str, bytes: &[u8]| {
        let path = folder.write(name, bytes);
        assert!(!is_feature_file(&path), "{name}");
        let error = read_features(&path, &WANTED, &in_turn).unwrap_err();
        (error.to_string(), error.hint().unwrap())
    };
    let (message, hint) = refused("dem.tif", &Tiff::of_heights(&[&[1, 2], &[3, 4]]).bytes());
    assert!(message.contains("a GeoTIFF raster, which is not read as features; expected OpenStreetMap"), "{message}");
    assert!(hint.contains("dem.sources"), "{hint}");
    let (message, hint) = refused("a.osm", b"<?xml version='1.0'?>\n<osm version='0.6'>");
    assert!(message.contains("OpenStreetMap data as XML"), "{message}");
    assert!(hint.starts_with("rewrite it: osmium cat -o out.osm.pbf "), "{hint}");
    assert!(refused("a.kml", b"<kml>").0.contains("a file of XML (KML, GML or GPX, perhaps)"));
    assert!(refused("a.zip", b"PK\x03\x04").1.contains("unpack it"));
    assert!(refused("a.dbf", &table(&[])).1.contains("name the .shp"));
    assert!(refused("a.pbf", b"1234567890").0.contains("begins with 31 32 33 34 35 36 37 38"));
    assert!(refused("empty.gpkg", b"").1.contains("fetch it again"));
    assert!(refused("a.json", b"{\"type\": \"Topology\"}").0.contains("neither a Shapefile, a GeoPackage nor GeoJSON"));
}

#[test]
fn a_file_of_features_is_no_raster() {
    let folder = Folder::new();
    let shp = shapefile(&[record(3, &[0], &[])]);
    for (name, bytes) in [("a.osm.pbf", header(&[])), ("a.shp", shp), ("a.geojson", LINE.into())] {
        let path = folder.write(name, &bytes);
        assert!(is_feature_file(&path), "{name}");
        let error = DemFile::open(&path, &Reading::AS_IT_SAYS).unwrap_err();
        assert!(error.to_string().contains("not a raster"), "{error}");
        assert!(error.hint().unwrap().contains("name a raster"), "{error}");
    }
}

#[test]
fn json_that_names_no_features_is_no_file_of_them() {
    let folder = Folder::new();
    let check = |text: &str, expected: bool| {
        let path = folder.path("a.json");
        std::fs::write(&path, text).unwrap();
        assert_eq!(is_feature_file(&path), expected, "{text}");
    };
    check(r#"{"format": 2, "sources": []}"#, false);
    check(r#"{"features": [], "type": "FeatureCollection"}"#, true);
    check(r#" {"type": "LineString", "coordinates": []}"#, true);
    check(r#"{"type": "Feature", "geometry": null}"#, true);
}

/// A zip file of some files.
fn zipped(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in files {
        archive.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        std::io::Write::write_all(&mut archive, bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

#[test]
fn a_zipped_shapefile_is_read_with_all_that_is_beside_it() {
    let degrees = [[-117.0, 35.0, 0.0], [-116.999, 35.0, 0.0]];
    let square = [[-117.0, 35.0, 0.0], [-117.0, 35.001, 0.0], [-116.999, 35.001, 0.0], [-117.0, 35.0, 0.0]];
    let (lines, rings) = (shapefile(&[record(3, &[0], &degrees)]), shapefile(&[record(5, &[0], &square)]));
    let rows = table(&[" track   2T"]);
    let utm = concat!(
        r#"PROJCS["x",GEOGCS["x",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137,298.257223563]],"#,
        r#"PRIMEM["Greenwich",0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],"#,
        r#"PARAMETER["False_Easting",500000],PARAMETER["False_Northing",0],PARAMETER["Central_Meridian",-117],"#,
        r#"PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0],UNIT["Meter",1]]"#,
    );
    let folder = Folder::new();
    let more: [(&str, &[u8]); 4] =
        [("a/roads.DBF", &rows), ("a/roads.cpg", b"UTF-8"), ("readme.txt", b"x"), ("__MACOSX/a/._roads.shp", b"x")];
    let path = folder.write("r.zip", &zipped(&[&[("a/roads.shp", &lines[..])], &more[..]].concat()));
    assert!(is_feature_file(&path));
    let file = read(&path);
    assert_eq!((ids(&file), file.notes.len()), (vec!["r.zip#0"], 0));
    assert_eq!(tags(&file.features[0]), [("highway", "track"), ("lanes", "2"), ("oneway", "true")]);

    // The system is that of the .prj in the archive.
    let path = folder.write("p.zip", &zipped(&[("roads.shp", &lines), ("roads.prj", utm.as_bytes())]));
    assert_eq!((read(&path).found, read(&path).outside), (1, 1), "metres, though they look like degrees");
    let path = folder.write("w.zip", &zipped(&[("lake.shp", &rings)]));
    assert_eq!(source_files::read_polygons(&path, 32611).unwrap().len(), 1);

    let refused = |files: &[(&str, &[u8])]| {
        let path = folder.write("n.zip", &zipped(files));
        // One that is only too large is one all the same, so that no command takes it for a raster.
        let text = read_features(&path, &WANTED, &in_turn).unwrap_err().to_string();
        assert_eq!(is_feature_file(&path), text.contains("once unpacked"), "{text}");
        text
    };
    assert!(refused(&[("a.tif", b"x")]).contains("a zip archive without a Shapefile in it, which is not read as"));
    assert!(refused(&[("a.shp", &lines), ("b.shp", &rings)]).contains("a zip archive of 2 Shapefiles"));
    assert!(refused(&[("a.shp", b"nothing")]).contains("a .shp that is no Shapefile"));
    let bomb = shapefile(&[record(3, &[0], &vec![[-117.0, 35.0, 0.0]; 2_000_000])]);
    assert!(refused(&[("a.shp", &bomb)]).contains("bytes once unpacked (or more)"));
}
