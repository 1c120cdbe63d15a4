//! A picture and its overviews, opened and judged.

use std::path::Path;

use super::level::{Level, PIXELS_MAX};
use super::{directories, unpack};
use crate::SourceError;
use crate::dem_file::{Reading, crs_of, text_in};
use crate::frame::RasterFrame;
use crate::store::Store;

/// So many bytes say whether a file is a text.
const TEXT_BYTES: u64 = 512;
const EXPECTED: &str = "a GeoTIFF of colours";

/// A picture whose directories were read and found good; nothing is decoded yet, but for the range of 16-bit colours.
#[derive(Debug)]
pub struct Imagery {
    pub(super) frame: RasterFrame,
    pub(super) south_first: bool,
    /// The picture, then its overviews, the finest first.
    pub(super) levels: Vec<Level>,
    /// Tells its strips and tiles from those of others among those that are kept.
    pub(super) id: usize,
}

impl Imagery {
    /// Opens the file at `path`; `id` differs from that of any other picture with the same store of chunks.
    ///
    /// # Errors
    /// Whatever makes it unusable: no GeoTIFF, broken, too large, no picture, or nowhere on Earth.
    pub fn open(path: &Path, id: usize) -> Result<Self, SourceError> {
        Self::read(path, id).map_err(|error| as_picture(path, error))
    }

    fn read(path: &Path, id: usize) -> Result<Self, SourceError> {
        let store = Store::plain(path)?;
        if let Some(found) = text_in(path, &store.start(TEXT_BYTES)?) {
            return Err(SourceError::Picture {
                path: path.into(),
                found: found.into(),
                expected: EXPECTED,
                remedy: None,
            });
        }
        let (mut levels, tags) = directories::levels(&store)?;
        let crs = crs_of(&store, tags.keys.crs(), &Reading::AS_IT_SAYS)?;
        let (cols, rows) = (levels[0].cols, levels[0].rows);
        let (frame, south_first) = RasterFrame::new(path, crs, &tags.axes(path)?, cols, rows)?;
        if let Some(beside) = directories::overviews_beside(path) {
            levels.extend(directories::levels(&Store::plain(&beside)?)?.0);
        }
        let is_overview = |level: &Level| level.cols < cols && level.rows <= rows;
        let mut overviews: Vec<Level> = levels.drain(1..).filter(is_overview).collect();
        overviews.sort_by_key(|level| std::cmp::Reverse(level.cols));
        levels.extend(overviews);
        unpack::set_range(&mut levels)?;
        Ok(Self { frame, south_first, levels, id })
    }

    /// Where its pixels lie; a post is the centre of one.
    pub fn frame(&self) -> &RasterFrame {
        &self.frame
    }

    /// Pixels across and down, of the picture and of each overview.
    #[cfg(test)]
    pub(crate) fn sizes(&self) -> Vec<[u32; 2]> {
        self.levels.iter().map(|level| [level.cols, level.rows]).collect()
    }

    /// Whether all of it is so small, or its overviews are, that a square shows all of its pixels from afar.
    pub fn is_seen_from_afar(&self) -> bool {
        let least = self.levels.last().map_or(0, |level| u64::from(level.cols) * u64::from(level.rows));
        least <= PIXELS_MAX
    }
}

/// The word of a reader of heights, said of a picture.
fn as_picture(path: &Path, error: SourceError) -> SourceError {
    use SourceError::*;
    let picture =
        |found: String, expected, remedy| Picture { path: path.into(), found, expected, remedy: Some(remedy) };
    match error {
        NotTiff { found, .. } => {
            let found = format!("not a TIFF: it begins with {found}");
            picture(found, EXPECTED, "convert it, with its place: gdal_translate")
        }
        NoCrs { .. } => picture(
            "no coordinate reference system in the file or in a .prj beside it".into(),
            "one",
            "say which it is in: gdal_translate -a_srs EPSG:32611",
        ),
        UnnamedCrs { found, .. } => picture(
            format!("the coordinate reference system is {found}"),
            "one that can be computed",
            "bring it to another: gdalwarp -t_srs EPSG:4326",
        ),
        NoPosition { .. } => picture(
            "no position in the file".into(),
            "a tie point and a pixel scale, or a transformation",
            "give it one: gdal_translate -a_ullr WEST NORTH EAST SOUTH",
        ),
        other => other,
    }
}
