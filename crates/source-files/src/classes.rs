//! Class rasters: which class lies at a post, by the nearest sample.

use std::path::Path;

use geometry::resample::nearest;
use terrain::{GridFrame, Post, PostRect};

use crate::resample::{col_of, row_of};
use crate::{GeoTiff, Raster, RasterFrame, SourceError};

/// A raster of classes: whole numbers of up to 16 bits, at a spacing of its own.
#[derive(Clone, Debug)]
pub struct ClassRaster {
    raster: Raster,
}

impl ClassRaster {
    /// Opens the GeoTIFF at `path` and reads what lies under the posts `area` of the working grid.
    ///
    /// # Errors
    /// As [`GeoTiff::open`] and [`GeoTiff::read`]; a coordinate system other than EPSG:`epsg`; samples that are not
    /// whole numbers; or a raster that has no post in the area at all.
    pub fn read(path: &Path, epsg: u32, grid: &GridFrame, area: PostRect) -> Result<Self, SourceError> {
        // Classes have no unit; a unit in the file must not be an error.
        let file = GeoTiff::open(path, Some(1.0))?;
        file.frame().require_epsg(epsg)?;
        let raster = file.read(window_near(file.frame(), grid, area)?)?;
        match raster.samples.fractional() {
            Some(found) => Err(SourceError::NotClasses { path: path.into(), found }),
            None => Ok(Self { raster }),
        }
    }

    /// Which posts of `rect` are of class `value`, row-major from the south. Posts where the raster has no sample, or
    /// a void one, are of no class.
    pub fn members(&self, grid: &GridFrame, rect: PostRect, value: i32) -> Vec<bool> {
        let frame = self.raster.frame();
        let cols: Vec<Option<u32>> =
            (rect.west..=rect.east).map(|col| nearest(col_of(frame, grid, col), frame.cols)).collect();
        let rows = (rect.south..=rect.north).map(|row| nearest(row_of(frame, grid, row), frame.rows));
        rows.flat_map(|row| cols.iter().map(move |&col| self.is_of(row, col, value))).collect()
    }

    fn is_of(&self, row: Option<u32>, col: Option<u32>, value: i32) -> bool {
        let (Some(row), Some(col)) = (row, col) else { return false };
        let post = Post::new(row as i32, col as i32);
        self.raster.window().contains(post) && self.raster.sample(post) == Some(f64::from(value))
    }
}

/// The posts of a raster that are nearest to posts of `area`.
fn window_near(frame: &RasterFrame, grid: &GridFrame, area: PostRect) -> Result<PostRect, SourceError> {
    let reach = |first: f64, last: f64, count: u32| {
        let low = (first.round() - 1.0).max(0.0);
        let high = (last.round() + 1.0).min(f64::from(count - 1));
        (low <= high).then_some((low as i32, high as i32))
    };
    let cols = reach(col_of(frame, grid, area.west), col_of(frame, grid, area.east), frame.cols);
    let rows = reach(row_of(frame, grid, area.south), row_of(frame, grid, area.north), frame.rows);
    match (rows, cols) {
        (Some((south, north)), Some((west, east))) => Ok(PostRect { south, west, north, east }),
        _ => {
            let missing = crate::resample::missing(frame, grid, area);
            Err(SourceError::NotCovered { path: frame.path.clone(), missing })
        }
    }
}
