//! Class rasters: which class lies at a post, by the nearest sample.

use std::path::Path;

use geometry::resample::{TAP_UNITS, nearest};
use terrain::{GridFrame, Post, PostRect};

use crate::crs::Crs;
use crate::resample::{col_of, row_of};
use crate::warp::Warp;
use crate::{DemFile, Raster, RasterFrame, Reading, SourceError};

/// A raster of classes: whole numbers, at a spacing and in a coordinate system of its own.
#[derive(Clone, Debug)]
pub struct ClassRaster {
    raster: Raster,
    /// Where posts lie in it, when its system is not the area's.
    warp: Option<Warp>,
}

impl ClassRaster {
    /// Opens the raster at `path` and reads what lies under the posts `area` of the working grid, which is in the
    /// system EPSG:`epsg`.
    ///
    /// # Errors
    /// As [`DemFile::open`] and [`DemFile::read`]; samples that are not whole numbers; a coordinate system that cannot
    /// be brought to the area's; or a raster that has no post in the area at all.
    pub fn read(path: &Path, epsg: u32, grid: &GridFrame, area: PostRect) -> Result<Self, SourceError> {
        // Classes have no unit; a unit in the file must not be an error.
        let file = DemFile::open(path, &Reading { height_unit_m: Some(1.0), ..Reading::AS_IT_SAYS })?;
        let frame = file.frame();
        let (window, warp) = match frame.require_epsg(epsg) {
            Ok(()) => (window_near(frame, grid, area)?, None),
            Err(other) => {
                let warp = Warp::new(frame, &Crs::from_epsg(epsg).map_err(|_| other)?, grid);
                let window = warp.window(area, 1);
                (window.ok_or_else(|| SourceError::OutsideArea { path: path.into() })?, Some(warp))
            }
        };
        let raster = file.read(window)?;
        match raster.samples.fractional() {
            // Text has no types; whole numbers in it are whole numbers.
            Some(_) if file.format() == "Esri ASCII grid" && raster.samples.all_whole() => Ok(Self { raster, warp }),
            Some(found) => Err(SourceError::NotClasses { path: path.into(), found }),
            None => Ok(Self { raster, warp }),
        }
    }

    /// Which posts of `rect` are of class `value`, row-major from the south. Posts where the raster has no sample, or
    /// a void one, are of no class.
    pub fn members(&self, grid: &GridFrame, rect: PostRect, value: i32) -> Vec<bool> {
        let frame = self.raster.frame();
        if let Some(warp) = &self.warp {
            let places = warp.over(rect);
            let posts = (rect.south..=rect.north).flat_map(|row| (rect.west..=rect.east).map(move |col| (row, col)));
            let near = |units: i64| u32::try_from((units + i64::from(TAP_UNITS / 2)).div_euclid(TAP_UNITS.into())).ok();
            return posts
                .map(|(row, col)| places.at(row, col).is_some_and(|[col, row]| self.is_of(near(row), near(col), value)))
                .collect();
        }
        let cols: Vec<Option<u32>> =
            (rect.west..=rect.east).map(|col| nearest(col_of(frame, grid, col), frame.cols)).collect();
        let rows = (rect.south..=rect.north).map(|row| nearest(row_of(frame, grid, row), frame.rows));
        rows.flat_map(|row| cols.iter().map(move |&col| self.is_of(row, col, value))).collect()
    }

    fn is_of(&self, row: Option<u32>, col: Option<u32>, value: i32) -> bool {
        let (Some(Ok(row)), Some(Ok(col))) = (row.map(i32::try_from), col.map(i32::try_from)) else { return false };
        let post = Post::new(row, col);
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
