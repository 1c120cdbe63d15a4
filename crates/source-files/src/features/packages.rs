//! Lines and polygons from a layer of a GeoPackage, with its columns as tags.

use std::path::Path;

use rusqlite::Row;
use rusqlite::types::ValueRef;

use super::clip::Vertex;
use super::columns::{Texts, with_packed_tags};
use super::curves::Chords;
use super::model::{FeatureFile, Wanted};
use super::placing::{Placing, look_like_degrees};
use super::raw::RawFeature;
use super::value::Value;
use super::well_known::geometry;
use crate::SourceError;
use crate::crs::Crs;
use crate::geopackage::{Column, Package, Table, Unread};

/// Features whose places say whether a layer without a system is in degrees.
const LOOKED_AT: usize = 1000;

pub(super) fn read(path: &Path, wanted: &Wanted) -> Result<FeatureFile, SourceError> {
    let package = Package::open(path)?;
    let (table, unread) = chosen(path, &package, wanted.layer)?;
    let Some(table) = table else {
        let mut placing = Placing::new(path, package.bytes(), wanted, None)?;
        placing.note("a GeoPackage without a layer of features".into());
        return placing.finish(None);
    };
    let said = wanted.system(|| match package.crs(table.srs)? {
        Some(crs) => Ok(Some(crs)),
        None => Ok(looks(path, &package, &table)?.then(Crs::wgs84)),
    })?;
    let chords = Chords::of(said.as_ref());
    let mut placing = Placing::new(path, package.bytes(), wanted, said)?;
    for Unread { found, .. } in unread.iter().filter(|_| wanted.layer.is_none()) {
        placing.note(format!("{found}, which is not read"));
    }
    let file = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let (name, mut texts) = (format!("{file}:{}", table.name), Texts::default());
    let columns = Columns::of(path, &package, &table)?;
    let mut count = 0_u64;
    // The row's own number goes first, so that it has a name even where no column is the key.
    package.rows(&table, "rowid, *", |row| {
        count += 1;
        let at = |index: usize| row.get_ref(index).map_err(|error| package.broken(error));
        let number = if let ValueRef::Integer(number) = at(0)? { number } else { count.cast_signed() };
        let id = format!("{name}#{number}");
        let shape = match at(1 + columns.geometry)? {
            // A feature without a geometry is legal and adds nothing.
            ValueRef::Null => return Ok(()),
            ValueRef::Blob(blob) => geometry(blob, chords),
            _ => Err("a geometry that is none".into()),
        };
        match shape {
            Ok(shape) => {
                let said = columns.said(row).map_err(|error| package.broken(error))?;
                let tags = with_packed_tags(said.iter().map(|(key, value)| (*key, value.as_str())));
                placing.place(RawFeature { id, tags: texts.tags(tags), shape });
                texts.count(placing.allowance());
            }
            Err(found) => placing.unread(&id, found),
        }
        Ok(())
    })?;
    placing.finish(None)
}

/// Columns of a layer and where they stand in a row.
struct Columns {
    geometry: usize,
    others: Vec<Column>,
}

impl Columns {
    fn of(path: &Path, package: &Package, table: &Table) -> Result<Self, SourceError> {
        let mut others = package.columns(table)?;
        let Some(index) = others.iter().position(|other| other.name.eq_ignore_ascii_case(&table.column)) else {
            let (what, found) = ("the GeoPackage".into(), format!("no column `{}` in `{}`", table.column, table.name));
            let expected = "the column of geometries that it lists".into();
            return Err(SourceError::Malformed { path: path.into(), what, found, expected });
        };
        Ok(Self { geometry: others.remove(index).place, others })
    }

    /// The columns of a row that hold something, as texts.
    fn said(&self, row: &Row) -> rusqlite::Result<Vec<(&str, String)>> {
        let mut said = Vec::new();
        for Column { place, name, declared } in &self.others {
            let value = match (row.get_ref(1 + place)?, declared.as_str()) {
                (ValueRef::Integer(number @ (0 | 1)), "BOOLEAN") => Value::Truth(number == 1),
                (ValueRef::Integer(number), _) => Value::Whole(number),
                (ValueRef::Real(number), _) => Value::Number(number),
                (ValueRef::Text(text), declared) => {
                    let text = String::from_utf8_lossy(text).into_owned();
                    match declared {
                        "DATE" => Value::Day(text),
                        "DATETIME" => Value::Moment(text),
                        _ => Value::Text(text),
                    }
                }
                (ValueRef::Null | ValueRef::Blob(_), _) => continue,
            };
            said.extend(value.text().map(|text| (name.as_str(), text)));
        }
        Ok(said)
    }
}

/// The layer that is named, or the only one that holds anything; none where there is no layer of features at all; and
/// those that cannot be read.
fn chosen(path: &Path, package: &Package, layer: Option<&str>) -> Result<(Option<Table>, Vec<Unread>), SourceError> {
    let (tables, unread) = package.tables()?;
    let listed =
        |tables: &[Table]| tables.iter().map(|table| format!("`{}`", table.name)).collect::<Vec<_>>().join(", ");
    let refused = |found: String, expected: String| SourceError::Layer { path: path.into(), found, expected };
    let named = unread.iter().find(|unread| layer.map_or(tables.is_empty(), |name| unread.name == name));
    if let Some(unread) = named {
        return Err(unread.refused(path));
    }
    if let Some(name) = layer {
        let expected = format!("one of {}", listed(&tables));
        let found = tables.into_iter().find(|table| table.name == name);
        let found = found.ok_or_else(|| refused(format!("the layer `{name}` named"), expected))?;
        return Ok((Some(found), unread));
    }
    let (mut filled, mut empty) = (Vec::new(), Vec::new());
    for table in tables {
        if package.has_rows(&table)? { filled.push(table) } else { empty.push(table) }
    }
    if 1 < filled.len() {
        let found = format!("{} layers: {}", filled.len(), listed(&filled));
        return Err(refused(found, "one of them named".into()));
    }
    // Where there is nothing in any layer, there is nothing in whichever is read.
    Ok((filled.into_iter().chain(empty).next(), unread))
}

/// Whether the first places of a layer look like degrees.
fn looks(path: &Path, package: &Package, table: &Table) -> Result<bool, SourceError> {
    let columns = Columns::of(path, package, table)?;
    let (mut vertices, mut count, chords): (Vec<Vertex>, _, _) = (Vec::new(), 0, Chords::of(None));
    package.rows(table, "*", |row| {
        count += 1;
        match row.get_ref(columns.geometry) {
            Ok(ValueRef::Blob(blob)) if count <= LOOKED_AT => {
                vertices.extend(geometry(blob, chords).iter().flat_map(|shape| shape.vertices()).take(LOOKED_AT));
            }
            _ => {}
        }
        Ok(())
    })?;
    Ok(look_like_degrees(vertices.into_iter()))
}
