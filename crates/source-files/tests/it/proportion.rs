//! Files of lines and polygons that ask for far more memory than they have bytes: refused in one sentence, and files
//! that are only unusual are read, with nothing written beside them.

use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use source_files::{SourceError, Wanted, read_features, read_polygons};
use terrain::in_turn;

use crate::pbf::{Osm, bytes, frame, header, number};
use crate::support::{self, Folder, LAKE, ROAD};

const WANTED: Wanted = Wanted { buildings: true, ..support::WANTED };

fn refusal(path: &Path) -> SourceError {
    read_features(path, &WANTED, &in_turn).expect_err("it is refused")
}

/// A file is refused for what it would take, in a sentence that tells both figures.
#[track_caller]
fn check_out_of_proportion(path: &Path) {
    let error = refusal(path);
    assert!(matches!(error, SourceError::OutOfProportion { .. }), "{error}");
    let kilobytes = path.metadata().unwrap().len().div_ceil(1000);
    let text = error.to_string();
    assert!(text.contains("more than ") && text.contains(&format!("a file of {kilobytes} kB")), "{text}");
    assert!(error.hint().is_some());
}

fn two_nodes() -> Osm {
    Osm::new(&[(1, [-117.0, 35.0]), (2, [-116.999, 35.0])])
}

#[test]
fn ways_of_very_many_nodes_are_refused() {
    let there_and_back: Vec<i64> = (0..1_000_000).map(|index| 1 + index % 2).collect();
    let mut osm = two_nodes();
    for id in 1..=6 {
        osm = osm.way(id, ROAD, &there_and_back);
    }
    let folder = Folder::new();
    check_out_of_proportion(&folder.write("ways.osm.pbf", &osm.bytes()));
    // One of them alone is a way, if a long one.
    let one = two_nodes().way(1, ROAD, &there_and_back);
    let read = read_features(&folder.write("one.osm.pbf", &one.bytes()), &WANTED, &in_turn).unwrap();
    assert_eq!(read.features.len(), 1);
    // No list of numbers is longer than a million.
    let longer: Vec<i64> = there_and_back.iter().chain(&there_and_back).copied().collect();
    let text = refusal(&folder.write("long.osm.pbf", &two_nodes().way(1, ROAD, &longer).bytes())).to_string();
    assert!(text.contains("a list of more than a million numbers"), "{text}");
}

#[test]
fn one_way_over_and_over_is_refused() {
    let way: Vec<i64> = (0..100).map(|index| 1 + index % 2).collect();
    let mut osm = two_nodes();
    for _ in 0..60_000 {
        osm = osm.way(7, ROAD, &way);
    }
    check_out_of_proportion(&Folder::new().write("doubled.osm.pbf", &osm.bytes()));
}

#[test]
fn many_lakes_of_the_same_long_way_are_refused() {
    let ring: Vec<(i64, [f64; 2])> = (0..20_000).map(|index| (index, [-117.0 + 1e-6 * index as f64, 35.0])).collect();
    let mut osm = Osm::new(&ring).way(7, &[], &(0..20_000).chain([0]).collect::<Vec<i64>>());
    for id in 0..2000 {
        osm = osm.relation(id, LAKE, &[(1, 7, "outer")]);
    }
    check_out_of_proportion(&Folder::new().write("lakes.osm.pbf", &osm.bytes()));
}

#[test]
fn nodes_without_end_are_refused() {
    // Groups of a million nodes at one place, in bytes that are all alike.
    let zeros = vec![0; 1_000_000];
    let dense = bytes(2, &[bytes(1, &vec![2; 1_000_000]), bytes(8, &zeros), bytes(9, &zeros)].concat());
    let place = [number(19, 35_000_000_000), number(20, (-117_000_000_000_i64).cast_unsigned())].concat();
    let block = [place, bytes(2, &dense.repeat(3))].concat();
    let file = [header(&["OsmSchema-V0.6", "DenseNodes"]), frame("OSMData", &block, crate::pbf::Packing::Zlib)];
    check_out_of_proportion(&Folder::new().write("nodes.osm.pbf", &file.concat()));
}

/// A GeoPackage with one river in it, made with some more statements; it stays open.
fn package(path: &Path, more: &str) -> rusqlite::Connection {
    let database = rusqlite::Connection::open(path).unwrap();
    let tables = "CREATE TABLE gpkg_spatial_ref_sys
            (srs_id INTEGER, organization TEXT, organization_coordsys_id INTEGER);
        CREATE TABLE gpkg_geometry_columns (table_name TEXT, column_name TEXT, srs_id INTEGER);
        INSERT INTO gpkg_spatial_ref_sys VALUES (7, 'epsg', 32611);
        INSERT INTO gpkg_geometry_columns VALUES ('rivers', 'geom', 7);
        CREATE TABLE rivers (fid INTEGER PRIMARY KEY, geom BLOB, waterway TEXT);";
    database.execute_batch(tables).unwrap();
    add_river(&database);
    database.execute_batch(more).unwrap();
    database
}

fn add_river(database: &rusqlite::Connection) {
    let mut blob = b"GP\0\x01\0\0\0\0\x01\x02\0\0\0\x02\0\0\0".to_vec();
    blob.extend([500_000.0_f64, 3.87e6, 500_100.0, 3.87e6].iter().flat_map(|number| number.to_le_bytes()));
    database.execute("INSERT INTO rivers (geom, waterway) VALUES (?1, 'river')", [blob]).unwrap();
}

#[test]
fn computed_columns_of_a_geopackage_are_refused_wherever_they_are() {
    let refused = |more: &str| {
        let folder = Folder::new();
        let path = folder.path("a.gpkg");
        drop(package(&path, more));
        assert!(read_polygons(&path, 32611).is_err());
        refusal(&path).to_string()
    };
    let bomb = "AS (hex(zeroblob(450000000)))";
    for kind in ["", " STORED"] {
        let remade = format!(
            "DROP TABLE rivers;
            CREATE TABLE rivers (fid INTEGER PRIMARY KEY, geom BLOB, waterway TEXT, x TEXT AS (fid || 'x'){kind});"
        );
        let text = refused(&remade);
        assert!(
            text.contains("a column `x` of `rivers` that is computed; expected a plain table with columns of values"),
            "{text}"
        );
    }
    let text = refused(&format!("ALTER TABLE rivers ADD COLUMN name TEXT {bomb}"));
    assert!(text.contains("a column `name` of `rivers` that is computed"), "{text}");
    let text = refused(&format!("ALTER TABLE gpkg_geometry_columns ADD COLUMN z TEXT {bomb}"));
    assert!(text.contains("a column `z` of `gpkg_geometry_columns` that is computed"), "{text}");
    let text = refused(&format!("ALTER TABLE gpkg_spatial_ref_sys ADD COLUMN z TEXT {bomb}"));
    assert!(text.contains("a column `z` of `gpkg_spatial_ref_sys` that is computed"), "{text}");
}

/// Names and bytes of all that lies in a folder.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut all: Vec<(String, Vec<u8>)> = entries
        .map(|entry| (entry.file_name().to_string_lossy().into_owned(), std::fs::read(entry.path()).unwrap()))
        .collect();
    all.sort();
    all
}

#[test]
fn a_geopackage_with_a_log_is_read_and_nothing_is_written_beside_it() {
    let folder = Folder::new();
    let count = |path: &Path| read_features(path, &WANTED, &in_turn).unwrap().features.len();
    // Left behind by a program that ended in order: a mark in the file, and no log.
    let closed = folder.path("a?b#c%20 d.gpkg");
    drop(package(&closed, "PRAGMA journal_mode = WAL;"));
    let before = contents(closed.parent().unwrap());
    assert_eq!(before.len(), 1);
    assert_eq!(count(&closed), 1);
    assert_eq!(contents(closed.parent().unwrap()), before);

    // Left behind by one that was ended: what it wrote last is in the log alone.
    let open = folder.path("open.gpkg");
    let database = package(&open, "PRAGMA journal_mode = WAL; PRAGMA wal_autocheckpoint = 0;");
    add_river(&database);
    let other = Folder::new();
    for name in ["open.gpkg", "open.gpkg-wal"] {
        std::fs::copy(folder.path(name), other.path(name)).unwrap();
    }
    let copied = other.path("open.gpkg");
    let before = contents(copied.parent().unwrap());
    assert_eq!(before.len(), 2);
    assert_eq!(count(&copied), 2);
    assert_eq!(contents(copied.parent().unwrap()), before);
    // While the other program still has it open.
    assert_eq!(count(&open), 2);
    add_river(&database);
    assert_eq!(count(&open), 3, "and it can go on");

    #[cfg(unix)]
    {
        let link = folder.path("link.gpkg");
        std::os::unix::fs::symlink(&copied, &link).unwrap();
        assert_eq!(count(&link), 2, "through a link, the log lies beside the file");
    }
}

#[test]
fn a_geopackage_in_the_middle_of_a_change_is_refused() {
    let folder = Folder::new();
    let path = folder.path("a.gpkg");
    drop(package(&path, ""));
    folder.write("a.gpkg-journal", &[0; 512]);
    assert!(read_features(&path, &WANTED, &in_turn).is_ok(), "a journal that is done with");
    let journal = [&[0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7][..], &[0; 504]].concat();
    folder.write("a.gpkg-journal", &journal);
    let text = refusal(&path).to_string();
    assert!(text.contains("in the middle of a change (a.gpkg-journal beside it)"), "{text}");
}

#[test]
fn packed_geojson_may_not_unpack_to_a_thousand_times_its_size() {
    let pack = |text: &str| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(text.as_bytes()).unwrap();
        encoder.finish().unwrap()
    };
    let text = |count: usize| {
        let places = "[500000,3870000],".repeat(count);
        format!(r#"{{"type":"LineString","coordinates":[{places}[500100,3870000]]}}"#)
    };
    let folder = Folder::new();
    let bomb = folder.write("a.geojson.gz", &pack(&text(2_000_000)));
    let text_of = refusal(&bomb).to_string();
    assert!(text_of.contains("bytes once unpacked (or more), at most"), "{text_of}");
    let plain = folder.write("b.geojson.gz", &pack(&text(100_000)));
    assert_eq!(read_features(&plain, &WANTED, &in_turn).unwrap().features.len(), 1);
}

#[test]
fn polygons_in_degrees_whose_long_sides_are_all_cut_up_are_refused() {
    let ring = "[-120,35],[-114,35],".repeat(20_000);
    let text = format!(r#"{{"type":"Polygon","coordinates":[[{ring}[-117,36],[-120,35]]]}}"#);
    let path = Folder::new();
    let path = path.write("a.geojson", text.as_bytes());
    let error = read_polygons(&path, 32611).unwrap_err();
    assert!(matches!(error, SourceError::OutOfProportion { .. }), "{error}");
}

/// A Shapefile of one line of so many points, and its index.
fn line_of(points: usize) -> (Vec<u8>, Vec<u8>) {
    let mut record = 3_u32.to_le_bytes().to_vec();
    record.extend([0; 32]);
    record.extend([1_u32.to_le_bytes(), (points as u32).to_le_bytes(), [0; 4]].concat());
    let place = |index: usize| [500_000.0 + (index % 2) as f64, 3.87e6];
    record.extend((0..points).flat_map(place).flat_map(|number: f64| number.to_le_bytes()));
    let mut bytes = vec![0, 0, 0x27, 0x0a];
    bytes.resize(100, 0);
    let index = [&bytes[..], &50_u32.to_be_bytes(), &(record.len() as u32 / 2).to_be_bytes()].concat();
    bytes.extend([1_u32.to_be_bytes(), (record.len() as u32 / 2).to_be_bytes()].concat());
    (bytes.into_iter().chain(record).collect(), index)
}

#[test]
fn an_index_that_names_one_record_over_and_over_is_refused() {
    let folder = Folder::new();
    let (shapes, index) = line_of(1000);
    let path = folder.write("a.shp", &shapes);
    folder.write("a.shx", &index);
    assert_eq!(read_features(&path, &WANTED, &in_turn).unwrap().features.len(), 1);
    folder.write("a.shx", &[&index[..100], &index[100..].repeat(100_000)].concat());
    let text = refusal(&path).to_string();
    assert!(text.contains("100000 records of more bytes than the file has, expected each record once"), "{text}");
    assert!(read_polygons(&path, 32611).unwrap_err().to_string().contains("each record once"));
}

#[test]
fn a_record_of_parts_without_points_is_refused() {
    let folder = Folder::new();
    let with = |parts: u32, points: u32| {
        let mut record = 5_u32.to_le_bytes().to_vec();
        record.extend([0; 32]);
        record.extend([parts.to_le_bytes(), points.to_le_bytes()].concat());
        record.resize(record.len() + 4 * parts as usize + 16 * points as usize, 0);
        let mut bytes = vec![0, 0, 0x27, 0x0a];
        bytes.resize(100, 0);
        bytes.extend([1_u32.to_be_bytes(), (record.len() as u32 / 2).to_be_bytes()].concat());
        let path = folder.write("a.shp", &[bytes, record].concat());
        read_features(&path, &WANTED, &in_turn).map(|file| file.features.len())
    };
    let text = with(1_000_000, 0).unwrap_err().to_string();
    assert!(text.contains("1000000 parts of 0 points, expected parts with points"), "{text}");
    assert_eq!(with(1, 0).unwrap(), 0, "a polygon of nothing is borne");
}

#[test]
fn an_index_that_goes_in_circles_is_refused() {
    let (folder, (shapes, index)) = (Folder::new(), line_of(10));
    let path = folder.write("a.shp", &shapes);
    // Into itself, into the header, and to records whose length leads back.
    for at in [50_u32, 0, 25, 52] {
        let entry = [at.to_be_bytes(), 50_u32.to_be_bytes()].concat();
        folder.write("a.shx", &[&index[..100], &entry.repeat(1000)].concat());
        let error = refusal(&path);
        assert!(matches!(error, SourceError::Malformed { .. } | SourceError::Truncated { .. }), "{at}: {error}");
    }
}

#[test]
fn a_table_that_promises_more_rows_than_it_has_is_refused() {
    let (folder, (shapes, _)) = (Folder::new(), line_of(10));
    let path = folder.write("a.shp", &shapes);
    let table = |rows: u32, row_bytes: u16| {
        let mut head =
            [&[3, 0, 0, 0][..], &rows.to_le_bytes(), &65_u16.to_le_bytes(), &row_bytes.to_le_bytes()].concat();
        head.resize(32, 0);
        head.extend(b"highway\0\0\0\0C\0\0\0\0\x07");
        head.resize(64, 0);
        head.extend(b"\r primary");
        folder.write("a.dbf", &head);
        read_features(&path, &WANTED, &in_turn).map(|file| file.features.len()).map_err(|error| error.to_string())
    };
    assert_eq!(table(1, 8), Ok(1));
    for rows in [2, 1 << 31, u32::MAX] {
        assert!(table(rows, 8).unwrap_err().contains("truncated: the rows of the table"), "{rows}");
    }
    assert!(table(u32::MAX, 0).unwrap_err().contains("columns of 8 bytes in rows of 0"));
    assert!(table(1, 7).unwrap_err().contains("columns of 8 bytes in rows of 7"));
}

#[test]
fn records_of_two_gigabytes_are_refused_unread() {
    let (folder, (shapes, _)) = (Folder::new(), line_of(10));
    for (record, name) in [(0x3fff_ffff_u32, "long"), (0x7fff_ffff, "negative")] {
        let bytes = [&shapes[..104], &record.to_be_bytes(), &shapes[108..]].concat();
        let path = folder.write(&format!("{name}.shp"), &bytes);
        // All of it but the start is a hole.
        std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(1 << 31).unwrap();
        let text = refusal(&path).to_string();
        assert!(text.contains("too large: 2147483648 bytes"), "{text}");
    }
}

#[test]
fn headers_of_a_shapefile_that_lie_are_refused_or_borne() {
    let folder = Folder::new();
    let (shapes, index) = line_of(10);
    let path = folder.write("a.shp", &shapes);
    let with = |bytes: &[u8], at: usize, number: u32| [&bytes[..at], &number.to_be_bytes(), &bytes[at + 4..]].concat();
    for number in [0, 1, 7, 0x3fff_ffff, 0x7fff_ffff, 0x8000_0000, u32::MAX, 1_u32.swap_bytes(), 6_u32.swap_bytes()] {
        // The length of the file, the number and length of the record, its kind, parts, points and first part.
        for at in [24, 100, 104, 108, 144, 148, 152] {
            folder.write("a.shp", &with(&shapes, at, number));
            for beside in [None, Some(index.clone()), Some(with(&index, 100, number)), Some(with(&index, 104, number))]
            {
                match beside {
                    Some(bytes) => _ = folder.write("a.shx", &bytes),
                    None => _ = std::fs::remove_file(folder.path("a.shx")),
                }
                if let Ok(file) = read_features(&path, &WANTED, &in_turn) {
                    assert!(file.features.len() <= 1, "{number} at {at}");
                }
                let _ = read_polygons(&path, 32611);
            }
        }
    }
}
