//! Polygons from a Shapefile: the `.shp` alone, its attributes are not looked at.
//!
//! Read here and not by a library, because the numbers of parts and points in a record have to be held against the
//! bytes that are there before anything is allocated for them, and because nothing else of the format is needed.

use crate::SourceError;
use crate::store::Store;

/// How every one begins.
pub(crate) const MARK: [u8; 4] = [0, 0, 0x27, 0x0a];
const HEADER_BYTES: usize = 100;

/// The rings of each polygon, in the file's own coordinates. `index` holds the bytes of the `.shx` beside it, where
/// there is one: files that were written over hold leftovers that only the index tells from records.
pub(crate) fn rings(store: &Store, bytes: &[u8], index: Option<&[u8]>) -> Result<Vec<Vec<Vec<[f64; 2]>>>, SourceError> {
    let places = match index.and_then(|index| index.get(HEADER_BYTES..)) {
        Some(entries) => entries.chunks_exact(8).map(|entry| 2 * big(&entry[..4])).collect(),
        None => in_sequence(store, bytes)?,
    };
    let mut polygons = Vec::new();
    for at in places {
        let record = part(store, bytes, at + 8, 2 * big(&part(store, bytes, at, 8)?[4..]))?;
        match whole(store, record, 0)? {
            // A record may be empty.
            0 => {}
            // Plain, with heights, with measures: the places come first in all three.
            5 | 15 | 25 => polygons.push(polygon(store, record)?),
            1 | 11 | 21 => return Err(other(store, "Point")),
            3 | 13 | 23 => return Err(other(store, "PolyLine")),
            8 | 18 | 28 => return Err(other(store, "MultiPoint")),
            _ => return Err(other(store, "shape of some other kind")),
        }
    }
    Ok(polygons)
}

/// Where records begin when one follows the other.
fn in_sequence(store: &Store, bytes: &[u8]) -> Result<Vec<usize>, SourceError> {
    let (mut places, mut at) = (Vec::new(), HEADER_BYTES);
    while at < bytes.len() {
        places.push(at);
        at += 8 + 2 * big(&part(store, bytes, at, 8)?[4..]);
    }
    Ok(places)
}

/// An unsigned number of four bytes, the highest first.
fn big(bytes: &[u8]) -> usize {
    bytes.iter().fold(0, |number, &byte| number << 8 | usize::from(byte))
}

fn other(store: &Store, found: &'static str) -> SourceError {
    SourceError::NotPolygons { path: store.path().into(), found }
}

fn polygon(store: &Store, record: &[u8]) -> Result<Vec<Vec<[f64; 2]>>, SourceError> {
    let (parts, points) = (whole(store, record, 36)? as usize, whole(store, record, 40)? as usize);
    let starts = part(store, record, 44, parts.saturating_mul(4))?;
    let places = part(store, record, 44 + starts.len(), points.saturating_mul(16))?;
    let number = |bytes: &[u8]| f64::from_le_bytes(bytes.try_into().expect("eight bytes were cut"));
    let places: Vec<[f64; 2]> = places.chunks_exact(16).map(|xy| [number(&xy[..8]), number(&xy[8..])]).collect();
    let mut starts: Vec<usize> = starts
        .chunks_exact(4)
        .map(|start| u32::from_le_bytes([start[0], start[1], start[2], start[3]]) as usize)
        .collect();
    starts.push(points);
    let ring = |pair: &[usize]| match places.get(pair[0]..pair[1]) {
        Some(ring) => Ok(ring.to_vec()),
        None => Err(store.malformed(
            "a polygon",
            format!("a ring from point {} to {}", pair[0], pair[1]),
            "points there are",
        )),
    };
    starts.windows(2).map(ring).collect()
}

/// An unsigned number of four bytes, the lowest first.
fn whole(store: &Store, bytes: &[u8], at: usize) -> Result<u32, SourceError> {
    let four = part(store, bytes, at, 4)?;
    Ok(u32::from_le_bytes([four[0], four[1], four[2], four[3]]))
}

fn part<'a>(store: &Store, bytes: &'a [u8], at: usize, count: usize) -> Result<&'a [u8], SourceError> {
    let end = at.saturating_add(count);
    bytes.get(at..end).ok_or_else(|| SourceError::Truncated {
        path: store.path().into(),
        what: "a record".into(),
        expected: end as u64,
        found: bytes.len() as u64,
    })
}
