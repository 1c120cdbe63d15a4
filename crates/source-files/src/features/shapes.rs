//! Lines and polygons from a Shapefile, with the columns of the table beside it as tags.

use super::clip::Vertex;
use super::columns::{Table, Texts, with_packed_tags};
use super::model::{Done, FeatureFile, Wanted, file_name};
use super::nest;
use super::placing::{LEFT_OUT, Placing, look_like_degrees};
use super::raw::{Part, RawFeature, RawShape};
use crate::SourceError;
use crate::crs::Crs;
use crate::limits::RINGS_MAX;
use crate::shapefile::{self, Shape};
use crate::shapefile::{Parts, whole};
use crate::store::Store;

pub(super) fn read(store: &Store, wanted: &Wanted) -> Result<FeatureFile, SourceError> {
    let (path, parts) = (store.path(), Parts::of(store)?);
    let (bytes, index) = (whole(&parts.shapes)?, parts.index()?);
    let table = table_of(&parts)?;
    let said = wanted.system(|| match parts.system()? {
        Some(crs) => Ok(Some(crs)),
        None => Ok(looks(store, &bytes, index.as_deref())?.then(Crs::wgs84)),
    })?;
    let mut placing = Placing::new(path, store.file_bytes(), wanted, said)?;
    if table.is_none() {
        placing.note("no table (.dbf) beside it, so its features have no attributes".into());
    }
    if let Some(unread) = table.as_ref().and_then(|table| table.unread.as_ref()) {
        placing.note(format!(
            "{unread}, which is not read: its texts beyond ASCII are taken for Windows-1252, so names may be wrong; \
             write it anew in UTF-8: ogr2ogr -lco ENCODING=UTF-8 out.shp in.shp"
        ));
    }
    let (name, mut texts) = (file_name(store), Texts::default());
    for (number, shape) in shapefile::shapes(store, &bytes, index.as_deref())?.enumerate() {
        let id = format!("{name}#{number}");
        let row = table.as_ref().map(|table| table.row(number));
        let columns = match row {
            // Deleted in the table: no longer a feature.
            Some(Some((_, true))) => continue,
            Some(Some((columns, false))) => columns,
            Some(None) => {
                placing.remark(&id, None, "no row in the table".into(), Done::Kept("read without attributes"));
                Vec::new()
            }
            None => Vec::new(),
        };
        match raw(shape?) {
            Ok(shape) => {
                let tags = with_packed_tags(columns.iter().map(|(key, value)| (*key, value.as_str())));
                placing.place(RawFeature { id, tags: texts.tags(tags), shape });
                texts.count(placing.allowance());
            }
            Err(rings) => {
                let found = format!("a polygon of {rings} rings, more than the {RINGS_MAX} that are put together");
                placing.remark(&id, None, found, LEFT_OUT);
            }
        }
    }
    placing.finish(None)
}

fn table_of(parts: &Parts) -> Result<Option<Table>, SourceError> {
    let Some(table) = &parts.table else { return Ok(None) };
    Table::read(table, whole(table)?, parts.encoding()?.as_deref()).map(Some)
}

fn looks(store: &Store, bytes: &[u8], index: Option<&[u8]>) -> Result<bool, SourceError> {
    let mut vertices: Vec<Vertex> = Vec::new();
    for shape in shapefile::shapes(store, bytes, index)?.take(1000) {
        match shape? {
            Shape::Lines { lines: runs, .. } | Shape::Rings { rings: runs, .. } => {
                vertices.extend(runs.into_iter().flatten());
            }
            Shape::Points(points) => vertices.extend(points),
            Shape::Nothing | Shape::Other(_) => {}
        }
    }
    Ok(look_like_degrees(vertices.into_iter()))
}

/// A record as lines and polygons, or how many rings it has where those are too many.
fn raw(shape: Shape) -> Result<RawShape, usize> {
    let (parts, has_heights, other) = match shape {
        Shape::Nothing => (Vec::new(), false, None),
        Shape::Other(other) => (Vec::new(), false, Some(other)),
        Shape::Points(points) => (points.into_iter().map(Part::Point).collect(), false, None),
        Shape::Lines { lines, has_heights } => (lines.into_iter().map(Part::Line).collect(), has_heights, None),
        Shape::Rings { rings, .. } if RINGS_MAX < rings.len() => return Err(rings.len()),
        Shape::Rings { rings, has_heights } => {
            (nest::polygons(rings).into_iter().map(Part::Polygon).collect(), has_heights, None)
        }
    };
    Ok(RawShape { has_heights, parts, other })
}
