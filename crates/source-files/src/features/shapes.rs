//! Lines and polygons from a Shapefile, with the columns of the table beside it as tags.

use super::clip::Vertex;
use super::columns::{Table, with_packed_tags};
use super::model::{Done, FeatureFile, Wanted, file_name};
use super::nest;
use super::placing::{LEFT_OUT, Placing, Texts, look_like_degrees};
use super::raw::{Part, RawFeature, RawShape};
use crate::SourceError;
use crate::beside::beside;
use crate::crs::Crs;
use crate::limits::{RINGS_MAX, SHAPEFILE_BYTES_MAX};
use crate::polygons::{index_beside, said_beside};
use crate::shapefile::{self, Shape};
use crate::store::Store;

pub(super) fn read(store: &Store, wanted: &Wanted) -> Result<FeatureFile, SourceError> {
    let path = store.path();
    let bytes = whole(store)?;
    let index = index_beside(path)?;
    let table = table_beside(store)?;
    let said = wanted.system(|| match said_beside(path)? {
        Some(crs) => Ok(Some(crs)),
        None => Ok(looks(store, &bytes, index.as_deref())?.then(Crs::wgs84)),
    })?;
    let mut placing = Placing::new(path, store.len(), wanted, said)?;
    if table.is_none() {
        placing.note("no table (.dbf) beside it, so its features have no attributes".into());
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

fn whole(store: &Store) -> Result<Vec<u8>, SourceError> {
    if SHAPEFILE_BYTES_MAX < store.len() {
        let (found, limit) = (store.len(), SHAPEFILE_BYTES_MAX);
        return Err(SourceError::TooLarge { path: store.path().into(), what: "bytes", found, limit });
    }
    store.start(SHAPEFILE_BYTES_MAX)
}

fn table_beside(store: &Store) -> Result<Option<Table>, SourceError> {
    let Some(path) = beside(store.path(), &["dbf"]) else { return Ok(None) };
    let encoding = match beside(store.path(), &["cpg"]) {
        Some(cpg) => Some(String::from_utf8_lossy(&Store::plain(&cpg)?.start(64)?).into_owned()),
        None => None,
    };
    let table = Store::plain(&path)?;
    let bytes = whole(&table)?;
    Table::read(&table, bytes, encoding.as_deref()).map(Some)
}

fn looks(store: &Store, bytes: &[u8], index: Option<&[u8]>) -> Result<bool, SourceError> {
    let mut vertices: Vec<Vertex> = Vec::new();
    for shape in shapefile::shapes(store, bytes, index)?.take(1000) {
        if let Shape::Lines { lines: runs, .. } | Shape::Rings { rings: runs, .. } = shape? {
            vertices.extend(runs.into_iter().flatten());
        }
    }
    Ok(look_like_degrees(vertices.iter()))
}

/// A record as lines and polygons, or how many rings it has where those are too many.
fn raw(shape: Shape) -> Result<RawShape, usize> {
    let (parts, has_heights, other) = match shape {
        Shape::Nothing => (Vec::new(), false, None),
        Shape::Other(other) => (Vec::new(), false, Some(other)),
        Shape::Lines { lines, has_heights } => (lines.into_iter().map(Part::Line).collect(), has_heights, None),
        Shape::Rings { rings, .. } if RINGS_MAX < rings.len() => return Err(rings.len()),
        Shape::Rings { rings, has_heights } => {
            (nest::polygons(rings).into_iter().map(Part::Polygon).collect(), has_heights, None)
        }
    };
    Ok(RawShape { has_heights, parts, other })
}
