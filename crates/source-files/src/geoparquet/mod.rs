//! GeoParquet: what its footer says, which of its row groups meet a rectangle, and a file of some of them.
//!
//! The footer lies at the end of a file and says where each column of each row group is and between which values its
//! boxes lie; so what an area needs is known from a few ranges of bytes. A file of some row groups has their bytes as
//! they were, and a footer of its own.

mod pages;
mod thrift;

use std::io::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use geojson::JsonValue;
use parquet::basic::Compression;
use parquet::errors::ParquetError;
use parquet::file::metadata::page_index::RowGroupPageIndex;
use parquet::file::metadata::{
    ColumnChunkMetaData, ParquetMetaData, ParquetMetaDataReader, ParquetMetaDataWriter, RowGroupMetaData,
};
use parquet::file::properties::ReaderProperties;
use parquet::file::serialized_reader::SerializedRowGroupReader;
use parquet::file::statistics::Statistics;
use parquet::file::writer::TrackedWrite;
use parquet::record::Row;
use parquet::record::reader::RowIter;
use parquet::schema::types::Type;

use crate::SourceError;
use crate::crs::Crs;
use crate::error::at_most;
use crate::features::clip::Extent;
use crate::geoparquet::pages::Pages;
use crate::limits::PARQUET_FOOTER_BYTES_MAX;

/// How every one begins and ends.
pub(crate) const MARK: &[u8] = b"PAR1";
/// Bytes at the end that are read at once: a small footer lies in them.
const TAIL: u64 = 64 << 10;
/// Bytes of a part of a row group that is asked for at once.
const SLICE: u64 = 4 << 20;

/// What the footer of a GeoParquet file says.
pub struct GeoParquet {
    path: PathBuf,
    len: u64,
    metadata: ParquetMetaData,
    geo: Geo,
}

impl GeoParquet {
    /// Reads the footer of a file of `len` bytes, of which `read` gives those from a place on; `path` is for messages.
    ///
    /// # Errors
    /// Those of `read`, and when it is no GeoParquet, broken, or its geometries are not in well-known binary.
    pub fn read(
        path: &Path,
        len: u64,
        read: &mut dyn FnMut(u64, u64) -> io::Result<Vec<u8>>,
    ) -> Result<Self, SourceError> {
        let mut bytes =
            |start, count| read(start, count).map_err(|source| SourceError::Read { path: path.into(), source });
        let whole = (MARK.len() * 2 + 4) as u64;
        if len < whole {
            return Err(SourceError::Truncated {
                path: path.into(),
                what: "the footer".into(),
                expected: whole,
                found: len,
            });
        }
        let tail_len = len.min(TAIL);
        let mut tail = bytes(len - tail_len, tail_len)?;
        let end = tail.len().saturating_sub(8);
        let [a, b, c, d, ref mark @ ..] = tail[end..] else {
            return Err(broken(path, "nothing at its end".into(), "a footer"));
        };
        if mark != MARK {
            return Err(broken(path, "no mark at its end".into(), "a whole file, not encrypted"));
        }
        let footer_len = u64::from(u32::from_le_bytes([a, b, c, d]));
        at_most(path, footer_len, PARQUET_FOOTER_BYTES_MAX, "bytes of a footer")?;
        if len - whole < footer_len {
            return Err(broken(path, format!("a footer of {footer_len} bytes"), "one that fits into the file"));
        }
        tail.truncate(end);
        let footer = match (tail.len() as u64).checked_sub(footer_len) {
            Some(before) => tail.split_off(before as usize),
            None => bytes(len - 8 - footer_len, footer_len)?,
        };
        if !thrift::is_sound_footer(&footer) {
            return Err(broken(path, "a footer that cannot be read".into(), "a sound one"));
        }
        let metadata = caught(|| ParquetMetaDataReader::decode_metadata(&footer));
        let metadata = metadata.map_err(|error| broken(path, error.to_string(), "a sound footer"))?;
        Self::of(path, len, metadata)
    }

    fn of(path: &Path, len: u64, metadata: ParquetMetaData) -> Result<Self, SourceError> {
        let said = metadata.file_metadata().key_value_metadata().into_iter().flatten();
        let text = said.filter(|said| said.key == "geo").find_map(|said| said.value.as_deref());
        let text = text.ok_or_else(|| SourceError::NotFeatures {
            path: path.into(),
            found: "a Parquet file that is no GeoParquet: nothing in it says which column holds geometries".into(),
        })?;
        let mut geo = Geo::read(text).map_err(|(found, expected)| match expected {
            WELL_KNOWN_BINARY => {
                SourceError::NotFeatures { path: path.into(), found: format!("GeoParquet with {found}") }
            }
            expected => broken(path, found, expected),
        })?;
        check_groups(path, len, &metadata)?;
        geo.boxes = geo.boxes.or_else(|| boxes_of(metadata.file_metadata().schema()));
        Ok(Self { path: path.into(), len, metadata, geo })
    }

    /// The file, for messages.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Its bytes.
    pub(crate) fn bytes(&self) -> u64 {
        self.len
    }

    /// The column of geometries.
    pub(crate) fn column(&self) -> &str {
        &self.geo.column
    }

    /// The columns.
    pub(crate) fn schema(&self) -> &Type {
        self.metadata.file_metadata().schema()
    }

    /// The system of its coordinates, where it is known.
    pub(crate) fn system(&self) -> Result<Option<Crs>, SourceError> {
        match &self.geo.crs {
            Ok(None) => Ok(self.geo.looks_like_degrees.then(Crs::wgs84)),
            Ok(crs) => Ok(crs.clone()),
            Err(found) => Err(SourceError::UnnamedCrs { path: self.path.clone(), found: found.clone() }),
        }
    }

    /// How many row groups it has.
    pub fn group_count(&self) -> usize {
        self.metadata.num_row_groups()
    }

    /// Rows of a row group.
    pub(crate) fn rows_of(&self, group: usize) -> u64 {
        u64::try_from(self.metadata.row_group(group).num_rows()).unwrap_or(0)
    }

    /// Where the features of a row group lie, where its statistics say so.
    pub(crate) fn extent(&self, group: usize) -> Option<Extent> {
        let group = self.metadata.row_group(group);
        let [east, north] = self.geo.boxes.as_ref()?;
        let end = |path: &[String], pick: Pick| {
            let columns = group.columns();
            let column = columns.iter().find(|column| column.column_path().parts() == path)?;
            bound(column.statistics()?, pick)
        };
        let side = |[least, greatest]: &[Vec<String>; 2]| {
            let (least, greatest) = (end(least, Pick::Least)?, end(greatest, Pick::Greatest)?);
            // Boxes may be rounded to floats of 32 bits, to either side.
            let slack = 2e-7 * least.abs().max(greatest.abs());
            (least <= greatest).then_some([least - slack, greatest + slack])
        };
        Some(Extent { east: side(east)?, north: side(north)? })
    }

    /// Hands on the rows of a row group with some of its columns.
    ///
    /// # Errors
    /// When they cannot be read, or `each` fails.
    pub(crate) fn rows(
        &self,
        groups: &[usize],
        columns: &Type,
        each: &mut dyn FnMut(usize, Row) -> Result<(), SourceError>,
    ) -> Result<(), SourceError> {
        let pages =
            Pages::open(&self.path, self.len).map_err(|source| SourceError::Open { path: self.path.clone(), source });
        let (pages, properties) = (Arc::new(pages?), Arc::new(ReaderProperties::builder().build()));
        for &number in groups {
            let failed =
                |error: ParquetError| broken(&self.path, format!("row group {number}: {error}"), "a sound one");
            let group = self.metadata.row_group(number);
            self.check_packing(group, columns)?;
            let index = RowGroupPageIndex::new(number, None);
            let reader = SerializedRowGroupReader::new(pages.clone(), group, index, properties.clone());
            let reader = reader.map_err(failed)?;
            let mut rows = caught(|| RowIter::from_row_group(Some(columns.clone()), &reader)).map_err(failed)?;
            while let Some(row) = caught(|| rows.next().transpose()).map_err(failed)? {
                each(number, row)?;
            }
        }
        Ok(())
    }

    /// Refuses pages of columns that are to be read and are packed in a way that is not.
    fn check_packing(&self, group: &RowGroupMetaData, columns: &Type) -> Result<(), SourceError> {
        let is_wanted = |column: &&ColumnChunkMetaData| {
            let name = column.column_path().parts().first();
            columns.get_fields().iter().any(|field| name.is_some_and(|name| name == field.name()))
        };
        let refused = group.columns().iter().filter(is_wanted).find_map(|column| match column.compression() {
            Compression::BROTLI(_) => Some("brotli"),
            Compression::LZ4 | Compression::LZ4_RAW => Some("lz4"),
            Compression::LZO => Some("lzo"),
            Compression::UNCOMPRESSED | Compression::SNAPPY | Compression::GZIP(_) | Compression::ZSTD(_) => None,
        });
        refused.map_or(Ok(()), |found| Err(SourceError::Packing { path: self.path.clone(), found }))
    }

    /// Ranges of bytes of some row groups, in their order.
    pub fn ranges(&self, groups: &[usize]) -> Vec<(u64, u64)> {
        let columns = groups.iter().flat_map(|&group| self.metadata.row_group(group).columns());
        columns.flat_map(|column| slices(column.byte_range())).collect()
    }

    /// Writes some row groups of files with the same columns as one file; `data` gives ranges of bytes of each.
    ///
    /// # Errors
    /// Those of `out` and of `data`, and when the columns differ.
    pub fn write(
        parts: &[(&Self, Vec<usize>)],
        out: &mut impl Write,
        mut data: impl FnMut(usize, (u64, u64)) -> io::Result<Vec<u8>>,
    ) -> io::Result<()> {
        let mut out = TrackedWrite::new(out);
        let Some((first, _)) = parts.first() else { return Ok(()) };
        out.write_all(MARK)?;
        let mut groups = Vec::new();
        for (number, (file, wanted)) in parts.iter().enumerate() {
            if file.schema() != first.schema() || file.geo.column != first.geo.column {
                let text = format!("{} has other columns than {}", file.path.display(), first.path.display());
                return Err(io::Error::new(io::ErrorKind::InvalidData, text));
            }
            for &group in wanted {
                let group = file.metadata.row_group(group);
                let place = out.bytes_written() as u64;
                for column in group.columns() {
                    for slice in slices(column.byte_range()) {
                        out.write_all(&data(number, slice)?)?;
                    }
                }
                groups.push(moved(group, place, groups.len()).map_err(io::Error::other)?);
            }
        }
        let metadata = ParquetMetaData::new(first.metadata.file_metadata().clone(), groups);
        ParquetMetaDataWriter::new_with_tracked(out, &metadata).finish().map_err(io::Error::other)
    }
}

/// Refuses row groups that lie outside the file or have more rows than it can hold.
fn check_groups(path: &Path, len: u64, metadata: &ParquetMetaData) -> Result<(), SourceError> {
    let (mut rows, mut number) = (0_u64, 0);
    for group in metadata.row_groups() {
        rows = rows.saturating_add(u64::try_from(group.num_rows()).unwrap_or(u64::MAX));
        for column in group.columns() {
            let start = column.dictionary_page_offset().unwrap_or_else(|| column.data_page_offset());
            let [start, size] = [start, column.compressed_size()].map(|number| u64::try_from(number).ok());
            let end = start.zip(size).and_then(|(start, size)| start.checked_add(size));
            if end.is_none_or(|end| len < end) || column.file_path().is_some() {
                return Err(broken(path, format!("row group {number}, which lies outside the file"), "one inside"));
            }
        }
        number += 1;
    }
    // Each row has a geometry, of which none is packed to less than a byte.
    match rows <= len {
        true => Ok(()),
        false => Err(broken(path, format!("{rows} rows in {len} bytes"), "fewer rows than bytes")),
    }
}

/// What the library does, which panics at some values that no writer would have written.
fn caught<T>(read: impl FnOnce() -> parquet::errors::Result<T>) -> parquet::errors::Result<T> {
    let read = catch_unwind(AssertUnwindSafe(read));
    read.unwrap_or_else(|_| Err(ParquetError::General("values that cannot be read".into())))
}

/// A row group whose columns lie one after another from a place on.
fn moved(group: &RowGroupMetaData, place: u64, number: usize) -> parquet::errors::Result<RowGroupMetaData> {
    let mut at = place;
    let column = |column: &ColumnChunkMetaData| {
        let (start, len) = column.byte_range();
        let by = at.cast_signed() - start.cast_signed();
        at += len;
        let dictionary = column.dictionary_page_offset().map(|offset| offset + by);
        let moved = column.clone().into_builder().set_data_page_offset(column.data_page_offset() + by);
        // What lies outside the row groups is not copied.
        moved
            .set_dictionary_page_offset(dictionary)
            .set_index_page_offset(None)
            .set_bloom_filter_offset(None)
            .set_bloom_filter_length(None)
            .set_offset_index_offset(None)
            .set_offset_index_length(None)
            .set_column_index_offset(None)
            .set_column_index_length(None)
            .build()
    };
    let columns = group.columns().iter().map(column).collect::<Result<Vec<_>, _>>()?;
    let moved = group.clone().into_builder().set_column_metadata(columns);
    moved.set_file_offset(place.cast_signed()).set_ordinal(number as i32).build()
}

fn slices((start, len): (u64, u64)) -> impl Iterator<Item = (u64, u64)> {
    (0..len.div_ceil(SLICE)).map(move |index| (start + index * SLICE, SLICE.min(len - index * SLICE)))
}

/// Which end of a column's values.
#[derive(Clone, Copy)]
enum Pick {
    Least,
    Greatest,
}

fn bound(statistics: &Statistics, pick: Pick) -> Option<f64> {
    let bound = match (statistics, pick) {
        (Statistics::Double(values), Pick::Least) => *values.min_opt()?,
        (Statistics::Double(values), Pick::Greatest) => *values.max_opt()?,
        (Statistics::Float(values), Pick::Least) => f64::from(*values.min_opt()?),
        (Statistics::Float(values), Pick::Greatest) => f64::from(*values.max_opt()?),
        _ => return None,
    };
    bound.is_finite().then_some(bound)
}

/// The boxes of a column `bbox`, as files had them before GeoParquet had a word for it.
fn boxes_of(schema: &Type) -> Option<[[Vec<String>; 2]; 2]> {
    let column = schema.get_fields().iter().find(|field| field.name() == "bbox" && field.is_group())?;
    let path = |name: &str| {
        let is_there = column.get_fields().iter().any(|field| field.name() == name && field.is_primitive());
        is_there.then(|| vec!["bbox".to_owned(), name.to_owned()])
    };
    Some([[path("xmin")?, path("xmax")?], [path("ymin")?, path("ymax")?]])
}

fn broken(path: &Path, found: String, expected: &str) -> SourceError {
    SourceError::Malformed { path: path.into(), what: "the GeoParquet".into(), found, expected: expected.into() }
}

/// The only encoding of geometries that is read.
const WELL_KNOWN_BINARY: &str = "WKB";

/// The column of geometries and their system.
#[derive(Clone, Debug)]
struct Geo {
    /// The column's name.
    pub column: String,
    /// The system of its coordinates: none where the file says that it is not known; or what is wrong with it.
    pub crs: Result<Option<Crs>, String>,
    /// Whether all places can be degrees, where the file says between which its features lie.
    pub looks_like_degrees: bool,
    /// Paths of the columns of the least and the greatest easting and northing, where the file has such.
    pub boxes: Option<[[Vec<String>; 2]; 2]>,
}

impl Geo {
    /// From the text.
    ///
    /// # Errors
    /// What it is, and what it should be.
    pub fn read(text: &str) -> Result<Self, (String, &'static str)> {
        let broken = || ("no description of geometries".to_owned(), "what GeoParquet says of it");
        let all: JsonValue = text.parse().map_err(|_| broken())?;
        let name = all.get("primary_column").and_then(JsonValue::as_str).ok_or_else(broken)?;
        let column = all.get("columns").and_then(|columns| columns.get(name)).ok_or_else(broken)?;
        match column.get("encoding").and_then(JsonValue::as_str) {
            Some("WKB") => {}
            other => {
                return Err((format!("geometries encoded as {}", other.unwrap_or("nothing")), WELL_KNOWN_BINARY));
            }
        }
        let boxes = column.get("covering").and_then(|covering| covering.get("bbox")).and_then(|boxes| {
            let path = |name: &str| {
                let parts = boxes.get(name)?.as_array()?.iter();
                parts.map(|part| part.as_str().map(str::to_owned)).collect::<Option<Vec<_>>>()
            };
            Some([[path("xmin")?, path("xmax")?], [path("ymin")?, path("ymax")?]])
        });
        let extent: Vec<f64> = column
            .get("bbox")
            .and_then(JsonValue::as_array)
            .into_iter()
            .flatten()
            .filter_map(JsonValue::as_f64)
            .collect();
        let looks_like_degrees = match extent.as_slice() {
            [west, south, east, north] | [west, south, _, east, north, _] => {
                west.abs().max(east.abs()) <= 360.0 && south.abs().max(north.abs()) <= 90.0
            }
            _ => false,
        };
        let crs = match column.get("crs") {
            None => Ok(Some(Crs::wgs84())),
            Some(JsonValue::Null) => Ok(None),
            Some(JsonValue::String(text)) => Crs::named(text).map(Some),
            Some(json) => of_projjson(json).map(Some),
        };
        Ok(Self { column: name.to_owned(), crs, looks_like_degrees, boxes })
    }
}

/// The system that PROJJSON describes, by its code: that of the whole, or of its parts on the ground and of heights.
fn of_projjson(json: &JsonValue) -> Result<Crs, String> {
    let code = |json: &JsonValue| {
        let id = json.get("id")?;
        let code = id.get("code")?;
        let code = code.as_str().map_or_else(|| code.to_string(), str::to_owned);
        Some((id.get("authority")?.as_str()?.to_ascii_uppercase(), code))
    };
    let part = |index: usize| json.get("components").and_then(|parts| parts.get(index));
    let own = code(json);
    let heights = if own.is_none() { part(1) } else { None };
    let ground = part(0).or_else(|| json.get("source_crs"));
    let (authority, code) = own.or_else(|| code(ground?)).ok_or_else(|| {
        let name = json.get("name").and_then(JsonValue::as_str).unwrap_or("without a name");
        format!("{name}, without a code")
    })?;
    let crs = match (authority.as_str(), code.as_str()) {
        ("OGC", "CRS84" | "CRS84h") => Crs::wgs84(),
        ("EPSG", number) => {
            let found = number.parse().map_err(|_| "no number".to_owned()).and_then(Crs::from_epsg);
            found.map_err(|found| format!("EPSG:{number}: {found}"))?
        }
        _ => return Err(format!("{authority}:{code}")),
    };
    heights.map_or(Ok(crs.clone()), |heights| with_heights(crs, heights))
}

/// A system with the heights of the vertical system that PROJJSON describes.
fn with_heights(crs: Crs, json: &JsonValue) -> Result<Crs, String> {
    // A vertical system with its shift to another is wrapped in one of both.
    let json = json.get("source_crs").unwrap_or(json);
    let id = json.get("id").filter(|id| id.get("authority").and_then(JsonValue::as_str) == Some("EPSG"));
    let code = id.and_then(|id| id.get("code")?.as_u64()).and_then(|code| u32::try_from(code).ok());
    let axis = json.get("coordinate_system").and_then(|system| system.get("axis")?.get(0));
    if axis.and_then(|axis| axis.get("direction")?.as_str()) == Some("down") {
        return Err("depths, which count downwards".into());
    }
    let unit = axis.and_then(|axis| axis.get("unit"));
    let unit_m = match unit.and_then(JsonValue::as_str) {
        Some("metre") => Some(1.0),
        _ => unit.and_then(|unit| unit.get("conversion_factor")?.as_f64()),
    };
    crs.with_heights(code, json.get("name").and_then(JsonValue::as_str).unwrap_or_default(), unit_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_compound_system_has_the_unit_of_its_vertical_part() {
        let of = |vertical: &str| {
            let text = format!(r#"{{"components":[{{"id":{{"authority":"EPSG","code":32612}}}},{vertical}]}}"#);
            of_projjson(&text.parse().unwrap()).unwrap()
        };
        let feet = of(r#"{"name":"NAVD88 height (ftUS)","id":{"authority":"EPSG","code":6360}}"#);
        assert_eq!((feet.vertical_unit_m(), feet.vertical_datum()), (Some(1200.0 / 3937.0), Some("NAVD88")));
        let own = r#"{"name":"x","coordinate_system":{"axis":[{"unit":{"name":"foot","conversion_factor":0.3048}}]}}"#;
        assert_eq!(of(own).vertical_unit_m(), Some(0.3048));
    }
}
