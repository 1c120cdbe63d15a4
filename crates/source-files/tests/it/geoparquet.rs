//! GeoParquet: what is read of it, by row groups, what a file of some of them holds, and what is refused.

use std::path::Path;
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, FloatType, Int32Type, Int64Type};
use parquet::file::metadata::{KeyValue, ParquetMetaDataReader, ParquetMetaDataWriter};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;
use source_files::{
    FeatureFile, GeoParquet, SourceError, VectorShape, Wanted, groups_near, is_feature_file, read_features,
};
use terrain::in_turn;

use crate::support::{self, Folder};

/// About -117.05 to -116.95 degrees east and 34.95 to 35.05 degrees north.
const WANTED: Wanted = Wanted { keys: &[], ..support::WANTED };
/// Columns of Overture's segments, with one in the place of `sources`.
const SEGMENTS: &str = "message schema { optional binary id (UTF8); optional binary geometry; required group bbox { \
    required float xmin; required float xmax; required float ymin; required float ymax; } required int32 version; \
    required int32 sources; optional binary subtype (UTF8); optional binary class (UTF8); optional group road_flags \
    (LIST) { repeated group list { optional group element { optional group values (LIST) { repeated group list { \
    optional binary element (UTF8); } } optional group between (LIST) { repeated group list { optional double element; \
    } } } } } }";
const GEO: &str = r#"{"version":"1.1.0","primary_column":"geometry","columns":{"geometry":{"encoding":"WKB",
    "geometry_types":[],"covering":{"bbox":{"xmin":["bbox","xmin"],"ymin":["bbox","ymin"],"xmax":["bbox","xmax"],
    "ymax":["bbox","ymax"]}}}}}"#;

/// A segment of two vertices along a parallel.
#[derive(Clone, Copy)]
struct Segment {
    id: &'static str,
    from: [f64; 2],
    flags: &'static [(&'static str, [f64; 2])],
    is_null: bool,
}

const fn segment(id: &'static str, from: [f64; 2]) -> Segment {
    Segment { id, from, flags: &[], is_null: false }
}

const BRIDGE: Segment = Segment { flags: &[("is_bridge", [0.25, 0.5])], ..segment("b", [-117.0, 35.0]) };
const FAR: Segment = segment("far", [-110.0, 35.0]);

/// Well-known binary of a line eastwards for a hundredth of a degree.
fn line([east, north]: [f64; 2]) -> Vec<u8> {
    let mut bytes = vec![1, 2, 0, 0, 0, 2, 0, 0, 0];
    [east, north, east + 0.01, north].iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    bytes
}

/// A file of row groups of segments.
fn file(groups: &[&[Segment]], geo: Option<&str>, packing: Compression) -> Vec<u8> {
    let geo = geo.map(|text| vec![KeyValue::new("geo".into(), text.to_owned())]);
    let properties = WriterProperties::builder().set_compression(packing).set_key_value_metadata(geo).build();
    let schema = Arc::new(parse_message_type(SEGMENTS).unwrap());
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties)).unwrap();
    for group in groups {
        let mut out = writer.next_row_group().unwrap();
        write(&mut out, group);
        out.close().unwrap();
    }
    writer.close().unwrap();
    bytes
}

fn write(out: &mut SerializedRowGroupWriter<'_, &mut Vec<u8>>, group: &[Segment]) {
    let ones = vec![1; group.len()];
    let texts = |out: &mut SerializedRowGroupWriter<'_, &mut Vec<u8>>, of: &dyn Fn(&Segment) -> ByteArray| {
        let values: Vec<ByteArray> = group.iter().map(of).collect();
        let mut column = out.next_column().unwrap().unwrap();
        column.typed::<ByteArrayType>().write_batch(&values, Some(&ones), None).unwrap();
        column.close().unwrap();
    };
    texts(out, &|segment| segment.id.into());
    let there: Vec<i16> = group.iter().map(|segment| i16::from(!segment.is_null)).collect();
    let lines: Vec<ByteArray> =
        group.iter().filter(|segment| !segment.is_null).map(|segment| line(segment.from).into()).collect();
    let mut column = out.next_column().unwrap().unwrap();
    column.typed::<ByteArrayType>().write_batch(&lines, Some(&there), None).unwrap();
    column.close().unwrap();
    for (axis, by) in [(0, 0.0), (0, 0.01), (1, 0.0), (1, 0.0)] {
        let values: Vec<f32> = group.iter().map(|segment| (segment.from[axis] + by) as f32).collect();
        let mut column = out.next_column().unwrap().unwrap();
        column.typed::<FloatType>().write_batch(&values, None, None).unwrap();
        column.close().unwrap();
    }
    for _ in 0..2 {
        let mut column = out.next_column().unwrap().unwrap();
        column.typed::<Int32Type>().write_batch(&vec![1; group.len()], None, None).unwrap();
        column.close().unwrap();
    }
    texts(out, &|_| "road".into());
    texts(out, &|_| "primary".into());
    let (mut values, mut ends, mut levels) = (Vec::<ByteArray>::new(), Vec::new(), [const { Vec::<i16>::new() }; 4]);
    for segment in group {
        for (index, (flag, between)) in segment.flags.iter().enumerate() {
            values.push((*flag).into());
            ends.extend(between);
            levels[0].push(6);
            levels[1].push(i16::from(0 < index));
            levels[2].extend([6, 6]);
            levels[3].extend([i16::from(0 < index), 2]);
        }
        if segment.flags.is_empty() {
            levels.iter_mut().for_each(|levels| levels.push(0));
        }
    }
    let mut column = out.next_column().unwrap().unwrap();
    column.typed::<ByteArrayType>().write_batch(&values, Some(&levels[0]), Some(&levels[1])).unwrap();
    column.close().unwrap();
    let mut column = out.next_column().unwrap().unwrap();
    column.typed::<DoubleType>().write_batch(&ends, Some(&levels[2]), Some(&levels[3])).unwrap();
    column.close().unwrap();
}

/// The same file, said to be packed in a way that is not read.
fn with_other_packing(bytes: &[u8]) -> Vec<u8> {
    let metadata = ParquetMetaDataReader::new().parse_and_finish(&bytes::Bytes::from(bytes.to_vec())).unwrap();
    let mut group = metadata.row_group(0).clone().into_builder();
    let columns = group.take_columns().into_iter();
    let columns = columns.map(|of| of.into_builder().set_compression(Compression::LZ4_RAW).build().unwrap()).collect();
    let groups = vec![group.set_column_metadata(columns).build().unwrap()];
    let metadata = metadata.into_builder().set_row_groups(groups).build();
    let mut out = bytes.to_vec();
    ParquetMetaDataWriter::new(&mut out, &metadata).finish().unwrap();
    out
}

fn read(bytes: &[u8]) -> Result<FeatureFile, SourceError> {
    let folder = Folder::new();
    read_features(&folder.write("a.parquet", bytes), &WANTED, &in_turn)
}

fn footer(bytes: &[u8]) -> Result<GeoParquet, SourceError> {
    GeoParquet::read(Path::new("a.parquet"), bytes.len() as u64, &mut |start, len| {
        Ok(bytes[start as usize..(start + len) as usize].to_vec())
    })
}

/// The id, the tags and the number of vertices of each feature.
fn told(file: &FeatureFile) -> Vec<String> {
    let vertices = |shape: &VectorShape| if let VectorShape::Line(line) = shape { line.places.len() } else { 0 };
    let tags = |feature: &source_files::VectorFeature| {
        let told = feature.tags.iter().filter(|(key, _)| !["class", "subtype"].contains(&key.as_ref()));
        told.map(|(key, value)| format!(" {key}={value}")).collect::<String>()
    };
    file.features
        .iter()
        .map(|feature| format!("{}{} {}", feature.id, tags(feature), vertices(&feature.shape)))
        .collect()
}

#[test]
fn segments_are_cut_at_their_rules_and_only_row_groups_near_the_area_are_read() {
    let null = Segment { is_null: true, ..segment("null", [-117.0, 35.0]) };
    let near: &[Segment] = &[segment("a", [-117.0, 35.01]), BRIDGE, null];
    for packing in [Compression::UNCOMPRESSED, Compression::SNAPPY, Compression::ZSTD(Default::default())] {
        let mut bytes = file(&[&[FAR], near, &[FAR, FAR]], Some(GEO), packing);
        let expected = [
            "a highway=primary 4",
            "b:1 highway=primary 2",
            "b:2 bridge=yes highway=primary 2",
            "b:3 highway=primary 3",
        ];
        let whole = read(&bytes).unwrap();
        assert_eq!((told(&whole), whole.found, whole.outside), (expected.map(String::from).to_vec(), 7, 3));
        assert!(whole.attribution.unwrap().contains("Overture"));
        // What is far away is not looked at, so it may be anything.
        let found = footer(&bytes).unwrap();
        assert_eq!(groups_near(&found, &WANTED).unwrap(), [1]);
        for (start, len) in found.ranges(&[0, 2]) {
            bytes[start as usize..(start + len) as usize].fill(0xaa);
        }
        assert_eq!(told(&read(&bytes).unwrap()), expected);
        // A file of the row groups that are wanted is read as the whole one.
        let mut part = Vec::new();
        let slice = |_: usize, (start, len): (u64, u64)| Ok(bytes[start as usize..(start + len) as usize].to_vec());
        GeoParquet::write(&[(&found, vec![1]), (&found, vec![])], &mut part, slice).unwrap();
        assert!(part.len() < bytes.len());
        assert_eq!((told(&read(&part).unwrap()), footer(&part).unwrap().group_count()), (told(&whole), 1));
        let mut none = Vec::new();
        GeoParquet::write(&[(&found, vec![])], &mut none, slice).unwrap();
        assert_eq!(told(&read(&none).unwrap()), [""; 0]);
    }
}

#[test]
fn the_system_is_as_the_file_says_and_boxes_may_be_without_a_word() {
    let bare = r#"{"primary_column":"geometry","columns":{"geometry":{"encoding":"WKB"CRS}}}"#;
    let of = |crs: &str| {
        let bytes = file(&[&[FAR], &[BRIDGE]], Some(&bare.replace("CRS", crs)), Compression::UNCOMPRESSED);
        let groups = footer(&bytes).and_then(|found| groups_near(&found, &WANTED));
        groups.map(|groups| (groups, read(&bytes).unwrap().features.len())).map_err(|error| error.to_string())
    };
    for degrees in [
        "",
        r#","crs":{"id":{"authority":"OGC","code":"CRS84"}}"#,
        r#","crs":{"id":{"authority":"EPSG","code":4326}}"#,
        r#","crs":null,"bbox":[-180,-90,180,90]"#,
        r#","crs":{"name":"both","components":[{"id":{"authority":"EPSG","code":"4326"}}]}"#,
    ] {
        assert_eq!(of(degrees), Ok((vec![1], 3)), "{degrees}");
    }
    assert_eq!(of(r#","crs":{"id":{"authority":"EPSG","code":32611}}"#), Ok((vec![], 0)));
    for (bad, told) in [
        (r#","crs":{"name":"Mars"}"#, "Mars, without a code"),
        (r#","crs":{"id":{"authority":"IAU","code":49900}}"#, "IAU:49900"),
    ] {
        assert!(of(bad).unwrap_err().contains(told), "{bad}");
    }
}

#[test]
fn heights_are_in_the_unit_that_the_system_says() {
    let folder = Folder::new();
    let read = |vertical: &str| {
        let geo = r#"{"primary_column":"geometry","columns":{"geometry":{"encoding":"WKB","crs":{"components":
            [{"id":{"authority":"EPSG","code":4326}},VERTICAL]}}}}"#;
        let bytes = file(&[&[BRIDGE]], Some(&geo.replace("VERTICAL", vertical)), Compression::UNCOMPRESSED);
        footer(&bytes).and_then(|found| groups_near(&found, &WANTED)).map_err(|error| error.to_string())?;
        let path = folder.write("a.parquet", &bytes);
        read_features(&path, &WANTED, &in_turn).map(|file| file.features.len()).map_err(|error| error.to_string())
    };
    assert_eq!(read(r#"{"name":"NAVD88 height (ftUS)","id":{"authority":"EPSG","code":6360}}"#), Ok(3));
    let axis =
        |unit: &str| format!(r#"{{"name":"x","coordinate_system":{{"axis":[{{"direction":"up","unit":{unit}}}]}}}}"#);
    assert_eq!(read(&axis(r#""metre""#)), Ok(3));
    assert_eq!(read(&axis(r#"{"type":"LinearUnit","name":"foot","conversion_factor":0.3048}"#)), Ok(3));
    assert!(read(&axis(r#""fathom""#)).unwrap_err().contains("no unit"));
    assert!(read(&axis(r#""metre""#).replace("up", "down")).unwrap_err().contains("downwards"));
}

#[test]
fn what_is_no_geoparquet_is_refused_with_a_word() {
    let good = file(&[&[BRIDGE]], Some(GEO), Compression::SNAPPY);
    let folder = Folder::new();
    assert!(is_feature_file(&folder.write("a.parquet", &good)));
    let other = |from: &str, to: &str| file(&[&[BRIDGE]], Some(&GEO.replace(from, to)), Compression::SNAPPY);
    let mut long = good.clone();
    let end = long.len() - 8;
    long[end..end + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut sealed = good.clone();
    sealed[end + 4..].copy_from_slice(b"PARE");
    for (bytes, told) in [
        (b"PAR1".to_vec(), "truncated: the footer"),
        (b"PAR1\0\0\0\0\0\0\0\0PAR1".to_vec(), "a footer that cannot be read"),
        (good[..good.len() - 1].to_vec(), "no mark at its end"),
        (long, "bytes of a footer"),
        (sealed, "no mark at its end"),
        (file(&[&[BRIDGE]], None, Compression::SNAPPY), "a Parquet file that is no GeoParquet"),
        (other("WKB", "linestring"), "geometries encoded as linestring"),
        (other("\"geometry\":{", "\"geometri\":{"), "no description of geometries"),
        (
            file(&[&[BRIDGE]], Some(&GEO.replace("\"geometry\"", "\"version\"")), Compression::SNAPPY),
            "`version` of binary",
        ),
        (with_other_packing(&good), "its pages are packed with lz4, which is not read"),
    ] {
        let error = read(&bytes).unwrap_err().to_string();
        assert!(error.contains(told) && error.contains("a.parquet"), "{told}: {error}");
    }
}

#[test]
fn no_cut_and_no_flipped_byte_is_ever_a_panic() {
    let near: &[Segment] = &[segment("a", [-117.0, 35.01]), BRIDGE];
    for packing in [Compression::UNCOMPRESSED, Compression::SNAPPY] {
        let whole = file(&[near, &[FAR]], Some(GEO), packing);
        for end in 0..whole.len() {
            assert!(read(&whole[..end]).is_err(), "cut at {end}");
        }
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= [1, 0x10, 0x80, 0xff][at % 4];
            let _ = read(&bytes);
        }
    }
}

/// A file of one line in metres, in a system that is not said, with columns of days and moments.
fn dated(day: i32, moment: i64) -> Vec<u8> {
    let schema = "message m { required binary geometry; required int32 day (DATE); required int64 at \
                  (TIMESTAMP(NANOS,false)); required int64 seen (TIMESTAMP(MILLIS,true)); required double lanes; }";
    let geo = r#"{"primary_column":"geometry","columns":{"geometry":{"encoding":"WKB","crs":null}}}"#;
    let geo = Some(vec![KeyValue::new("geo".into(), geo.to_owned())]);
    let properties = WriterProperties::builder().set_key_value_metadata(geo).build();
    let mut bytes = Vec::new();
    let schema = Arc::new(parse_message_type(schema).unwrap());
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties)).unwrap();
    let mut out = writer.next_row_group().unwrap();
    let mut column = out.next_column().unwrap().unwrap();
    column.typed::<ByteArrayType>().write_batch(&[line([500_000.0, 3.87e6]).into()], None, None).unwrap();
    column.close().unwrap();
    let mut column = out.next_column().unwrap().unwrap();
    column.typed::<Int32Type>().write_batch(&[day], None, None).unwrap();
    column.close().unwrap();
    for count in [moment.saturating_mul(1_000_000), moment] {
        let mut column = out.next_column().unwrap().unwrap();
        column.typed::<Int64Type>().write_batch(&[count], None, None).unwrap();
        column.close().unwrap();
    }
    let mut column = out.next_column().unwrap().unwrap();
    column.typed::<DoubleType>().write_batch(&[3.0], None, None).unwrap();
    column.close().unwrap();
    out.close().unwrap();
    writer.close().unwrap();
    bytes
}

#[test]
fn days_and_moments_are_texts_and_metres_of_no_system_are_told() {
    // The last of January 2020, at half past twelve.
    let file = read(&dated(18_292, 1_580_473_800_250)).unwrap();
    let expected = "a.parquet#0 at=2020-01-31T12:30:00.25 day=2020-01-31 lanes=3 seen=2020-01-31T12:30:00.25Z 2";
    assert_eq!(told(&file), [expected]);
    assert!(file.notes[0].contains("taken for metres of EPSG:32611"), "{:?}", file.notes);
    // No library writes such.
    assert_eq!(
        told(&read(&dated(i32::MAX, i64::MAX)).unwrap()),
        ["a.parquet#0 at=2262-04-11T23:47:16.854775 lanes=3 2"]
    );
}
