//! One thing reads alike in every format: attributes, and coordinates of which nothing says what they are.

use source_files::FeatureFile;

use crate::support::Folder;
use crate::vectors::{RUN, blob, package, read, record, shapefile, tags};

/// A table of one row; each column has a name, a type, and a text as wide as it is.
fn table(columns: &[(&str, u8, &[u8])], mark: u8) -> Vec<u8> {
    let described = |(name, kind, text): &(&str, u8, &[u8])| {
        let mut column = name.as_bytes().to_vec();
        column.resize(11, 0);
        column.extend([*kind, 0, 0, 0, 0, text.len() as u8]);
        column.resize(32, 0);
        column
    };
    let described: Vec<u8> = columns.iter().flat_map(described).chain([13]).collect();
    let row: Vec<u8> = columns.iter().fold(vec![b' '], |row, (.., text)| [&row, *text].concat());
    let mut head = vec![3, 126, 1, 1, 1, 0, 0, 0];
    head.extend((32 + described.len() as u16).to_le_bytes());
    head.extend((row.len() as u16).to_le_bytes());
    head.resize(32, 0);
    head[29] = mark;
    [head, described, row].concat()
}

fn shapes(columns: &[(&str, u8, &[u8])], mark: u8, cpg: Option<&[u8]>) -> FeatureFile {
    let folder = Folder::new();
    let points: Vec<[f64; 3]> = RUN.iter().map(|place| [place[0], place[1], 0.0]).collect();
    let path = folder.write("a.shp", &shapefile(&[record(3, &[0], &points)]));
    folder.write("a.dbf", &table(columns, mark));
    folder.write("a.prj", br#"PROJCS["x",AUTHORITY["EPSG","32611"]]"#);
    cpg.map(|bytes| folder.write("a.cpg", bytes));
    read(&path)
}

#[test]
fn attributes_read_alike_in_tables_packages_and_geojson() {
    let expected = [("bridge", "true"), ("day", "2020-01-31"), ("lanes", "3"), ("width", "3.1")];
    let columns: [(&str, u8, &[u8]); 5] = [
        ("bridge", b'L', b"T"),
        ("day", b'D', b"20200131"),
        ("lanes", b'N', b"       3.000000000000000"),
        ("none", b'D', b"00000000"),
        ("width", b'N', b"       3.100000000000000"),
    ];
    assert_eq!(tags(&shapes(&columns, 0, None).features[0]), expected);

    let folder = Folder::new();
    let path = package(&folder, &[("rivers", &[blob(2, &[&[&[500_000.0, 3.87e6], &[500_100.0, 3.87e6]]])])]);
    let database = rusqlite::Connection::open(&path).unwrap();
    let change = "ALTER TABLE rivers ADD COLUMN bridge BOOLEAN; ALTER TABLE rivers ADD COLUMN day DATE;
        ALTER TABLE rivers ADD COLUMN at DATETIME;
        UPDATE rivers SET lanes = 3.0, width = 3.1, waterway = NULL, bridge = 1, day = '2020-01-31',
        at = '2020-01-31T12:30:00.000Z';";
    database.execute_batch(change).unwrap();
    drop(database);
    let of_package = read(&path);
    let (at, others): (Vec<_>, Vec<_>) = tags(&of_package.features[0]).into_iter().partition(|(key, _)| *key == "at");
    assert_eq!((at, others), (vec![("at", "2020-01-31T12:30:00Z")], expected.to_vec()));

    let properties = r#"{"bridge":true,"day":"2020-01-31","lanes":3.0,"width":3.1,"none":null}"#;
    let line = r#"{"type":"LineString","coordinates":[[-117,35],[-116.991,35]]}"#;
    let text = format!(r#"{{"type":"Feature","geometry":{line},"properties":{properties}}}"#);
    let of_json = read(&folder.write("a.geojson", text.as_bytes()));
    assert_eq!(tags(&of_json.features[0]), expected);
}

#[test]
fn metres_of_which_no_file_says_the_system_are_told_in_every_format() {
    let told = "it names no coordinate system and its numbers are no degrees: they are taken for metres of \
                EPSG:32611; crs names another";
    let folder = Folder::new();
    let points: Vec<[f64; 3]> = RUN.iter().map(|place| [place[0], place[1], 0.0]).collect();
    let path = folder.write("a.shp", &shapefile(&[record(3, &[0], &points)]));
    folder.write("a.dbf", &table(&[("lanes", b'N', b"2")], 0));
    assert_eq!(read(&path).notes, [told]);
    folder.write("a.prj", br#"PROJCS["x",AUTHORITY["EPSG","32611"]]"#);
    assert_eq!(read(&path).notes, [""; 0]);

    let path = package(&folder, &[("rivers", &[blob(2, &[&[&[500_000.0, 3.87e6], &[500_100.0, 3.87e6]]])])]);
    assert_eq!(read(&path).notes, [""; 0]);
    for srs in [0, -1] {
        let database = rusqlite::Connection::open(&path).unwrap();
        database.execute("UPDATE gpkg_geometry_columns SET srs_id = ?1", [srs]).unwrap();
        drop(database);
        assert_eq!(read(&path).notes, [told], "{srs}");
    }
}

#[test]
fn a_code_page_that_is_not_read_is_told_where_texts_go_beyond_ascii() {
    let of = |text: &[u8], mark, cpg: Option<&[u8]>| {
        let file = shapes(&[("name", b'C', text)], mark, cpg);
        (tags(&file.features[0])[0].1.to_owned(), file.notes)
    };
    for cpg in ["UTF-8", "utf8\n"] {
        assert_eq!(of("Straße ".as_bytes(), 0, Some(cpg.as_bytes())), ("Straße".to_owned(), vec![]));
    }
    for cpg in [Some("ISO-8859-1"), Some("1252"), Some("CP1252"), Some(""), None] {
        assert_eq!(of(b"Stra\xdfe \x96", 0x57, cpg.map(str::as_bytes)), ("Straße –".to_owned(), vec![]), "{cpg:?}");
    }
    for (mark, cpg, said) in [
        (0, Some("CP437"), "the .cpg beside it says CP437, which is not read"),
        (0, Some("850"), "the .cpg beside it says 850, which is not read"),
        (1, None, "its table (.dbf) says CP437, which is not read"),
    ] {
        let (_, notes) = of(b"Stra\xe1e", mark, cpg.map(str::as_bytes));
        assert!(notes.len() == 1 && notes[0].starts_with(said), "{notes:?}");
        assert_eq!(of(b"Strasse", mark, cpg.map(str::as_bytes)).1, [""; 0], "nothing is read wrongly");
    }
}
