//! Shapes from a Shapefile: the records of the `.shp`, without their attributes, and the files that belong
//! to it, beside each other in a folder or in one zip file.
//!
//! Read here and not by a library, because the numbers of parts and points in a record have to be held against the
//! bytes that are there before anything is allocated for them, and because little else of the format is needed.

use crate::SourceError;
use crate::content::beside;
use crate::crs::Crs;
use crate::error::at_most;
use crate::limits::SHAPEFILE_BYTES_MAX;
use crate::store::Store;

/// How every one begins.
pub(crate) const MARK: [u8; 4] = [0, 0, 0x27, 0x0a];
const HEADER_BYTES: usize = 100;
/// Numbers below it stand for none (Esri's description, page 2).
const NO_DATA: f64 = -1.0e38;

/// What a record holds, in the file's own coordinates. A height that is not given is NaN.
#[derive(Debug)]
pub(crate) enum Shape {
    /// A record may be empty.
    Nothing,
    /// Places; their heights are not read.
    Points(Vec<[f64; 3]>),
    Lines {
        lines: Vec<Vec<[f64; 3]>>,
        has_heights: bool,
    },
    /// Outer rings and holes, in whatever order.
    Rings {
        rings: Vec<Vec<[f64; 3]>>,
        has_heights: bool,
    },
    Other(&'static str),
}

/// The shape of each record. `index` holds the bytes of the `.shx` beside it, where there is one: files that were
/// written over hold leftovers that only the index tells from records.
pub(crate) fn shapes<'a>(
    store: &'a Store,
    bytes: &'a [u8],
    index: Option<&[u8]>,
) -> Result<impl Iterator<Item = Result<Shape, SourceError>> + use<'a>, SourceError> {
    let places = match index.and_then(|index| index.get(HEADER_BYTES..)) {
        Some(entries) => indexed(store, bytes, entries)?,
        None => in_sequence(store, bytes)?,
    };
    Ok(places.into_iter().map(move |at| shape(store, bytes, at)))
}

fn shape(store: &Store, bytes: &[u8], at: usize) -> Result<Shape, SourceError> {
    let record = part(store, bytes, at + 8, 2 * big(&part(store, bytes, at, 8)?[4..]))?;
    let kind = little(store, record, 0)?;
    // Plain, with heights, with measures: the places come first in all three, then the heights.
    let has_heights = matches!(kind, 13 | 15);
    Ok(match kind {
        0 => Shape::Nothing,
        3 | 13 | 23 => Shape::Lines { lines: runs(store, record, has_heights)?, has_heights },
        5 | 15 | 25 => Shape::Rings { rings: runs(store, record, has_heights)?, has_heights },
        1 | 11 | 21 => Shape::Points(places(part(store, record, 4, 16)?).collect()),
        8 | 18 | 28 => {
            let count = little(store, record, 36)? as usize;
            Shape::Points(places(part(store, record, 40, count.saturating_mul(16))?).collect())
        }
        _ => Shape::Other("shape of some other kind"),
    })
}

/// Where records begin as the index says. They may come in any order and leave bytes out, but none of them twice: an
/// index that names one record a million times makes a file of gigabytes of it.
fn indexed(store: &Store, bytes: &[u8], entries: &[u8]) -> Result<Vec<usize>, SourceError> {
    let places: Vec<usize> = entries.chunks_exact(8).map(|entry| 2 * big(&entry[..4])).collect();
    let mut all = 0;
    for &at in &places {
        all += 8 + 2 * big(&part(store, bytes, at, 8)?[4..]);
        if bytes.len() < all {
            let found = format!("{} records of more bytes than the file has", places.len());
            return Err(store.malformed("the index beside it (.shx)", found, "each record once"));
        }
    }
    Ok(places)
}

/// Where records begin when one follows the other.
fn in_sequence(store: &Store, bytes: &[u8]) -> Result<Vec<usize>, SourceError> {
    let (mut places, mut at) = (Vec::new(), HEADER_BYTES);
    // A header that is cut short has no records, and is no Shapefile.
    part(store, bytes, 0, HEADER_BYTES)?;
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

fn number(bytes: &[u8]) -> f64 {
    f64::from_le_bytes(bytes.try_into().expect("eight bytes were cut"))
}

/// Places without heights.
fn places(bytes: &[u8]) -> impl Iterator<Item = [f64; 3]> {
    bytes.chunks_exact(16).map(|xy| [number(&xy[..8]), number(&xy[8..]), f64::NAN])
}

fn runs(store: &Store, record: &[u8], has_heights: bool) -> Result<Vec<Vec<[f64; 3]>>, SourceError> {
    let (parts, points) = (little(store, record, 36)? as usize, little(store, record, 40)? as usize);
    let starts = part(store, record, 44, parts.saturating_mul(4))?;
    // Parts without points are made of nothing, and there is room for a hundred million of them. One is borne.
    if points.saturating_add(1) < parts {
        return Err(store.malformed("a record", format!("{parts} parts of {points} points"), "parts with points"));
    }
    let places_at = 44 + starts.len();
    let flat = part(store, record, places_at, points.saturating_mul(16))?;
    let mut vertices: Vec<[f64; 3]> = places(flat).collect();
    if has_heights {
        // Their range goes before them.
        let heights = part(store, record, places_at + flat.len() + 16, points.saturating_mul(8))?;
        let given = heights.chunks_exact(8).map(number);
        for (vertex, height) in vertices.iter_mut().zip(given) {
            vertex[2] = if height < NO_DATA { f64::NAN } else { height };
        }
    }
    let mut starts: Vec<usize> = starts
        .chunks_exact(4)
        .map(|start| u32::from_le_bytes([start[0], start[1], start[2], start[3]]) as usize)
        .collect();
    starts.push(points);
    let run = |pair: &[usize]| match vertices.get(pair[0]..pair[1]) {
        Some(run) => Ok(run.to_vec()),
        None => Err(store.malformed(
            "a record",
            format!("a part from point {} to {}", pair[0], pair[1]),
            "points there are",
        )),
    };
    starts.windows(2).map(run).collect()
}

/// An unsigned number of four bytes, the lowest first.
fn little(store: &Store, bytes: &[u8], at: usize) -> Result<u32, SourceError> {
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

/// A Shapefile: its shapes, and what of the rest is there.
pub(crate) struct Parts {
    pub shapes: Store,
    index: Option<Store>,
    pub table: Option<Store>,
    encoding: Option<Store>,
    system: Option<Store>,
}

impl Parts {
    /// What belongs to the shapes in `store`, from where these come from.
    pub(crate) fn of(store: &Store) -> Result<Self, SourceError> {
        let shapes = store.clone();
        if !store.is_packed() {
            let part = |ending: &str| beside(store.path(), &[ending]).map(|path| Store::plain(&path)).transpose();
            let (index, table) = (part("shx")?, part("dbf")?);
            return Ok(Self { shapes, index, table, encoding: part("cpg")?, system: part("prj")? });
        }
        let mut packed = Store::zipped_shapefile(store.path())?;
        let mut part = |ending: &str| {
            let is_it = |store: &Store| store.name().to_lowercase().ends_with(&format!(".{ending}"));
            packed.iter().position(is_it).map(|index| packed.remove(index))
        };
        let (index, table) = (part("shx"), part("dbf"));
        Ok(Self { shapes, index, table, encoding: part("cpg"), system: part("prj") })
    }

    /// The bytes of its index.
    pub(crate) fn index(&self) -> Result<Option<Vec<u8>>, SourceError> {
        self.index.as_ref().map(whole).transpose()
    }

    /// What it says of how texts in its table are written.
    pub(crate) fn encoding(&self) -> Result<Option<String>, SourceError> {
        let said = self.encoding.as_ref().map(|store| store.start(64)).transpose()?;
        Ok(said.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()))
    }

    /// The coordinate system that it names.
    pub(crate) fn system(&self) -> Result<Option<Crs>, SourceError> {
        let Some(store) = &self.system else { return Ok(None) };
        let crs = Crs::from_wkt(&String::from_utf8_lossy(&store.start(1 << 16)?));
        crs.map(Some).map_err(|found| SourceError::UnnamedCrs { path: store.path().into(), found })
    }
}

/// All bytes of a part, which are held in memory.
pub(crate) fn whole(store: &Store) -> Result<Vec<u8>, SourceError> {
    at_most(store.path(), store.len(), SHAPEFILE_BYTES_MAX, "bytes")?;
    store.start(SHAPEFILE_BYTES_MAX)
}
