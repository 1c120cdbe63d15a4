//! Class rasters: which class lies at a post, by the nearest sample.

use std::collections::BTreeSet;
use std::path::Path;

use terrain::geometry::resample::{TAP_UNITS, nearest};
use terrain::{GridFrame, Post, PostRect};

use crate::crs::Crs;
use crate::frame::{col_of, row_of};
use crate::warp::Warp;
use crate::{DemFile, Raster, RasterFrame, Reading, SourceError, Windows};

/// Bytes of decoded samples that are kept.
const KEPT_BYTES: u64 = 32 << 20;

/// A raster of classes: whole numbers, at a spacing and in a coordinate system of its own.
#[derive(Debug)]
pub struct ClassRaster {
    windows: Windows,
    /// Its posts that decide those of the area.
    reach: PostRect,
    /// Where posts lie in it, when its system is not the area's.
    warp: Option<Warp>,
}

impl ClassRaster {
    /// Opens the raster at `path` for the posts `area` of the working grid, which is in the system EPSG:`epsg`.
    ///
    /// # Errors
    /// As [`DemFile::open`] and [`DemFile::look`]; samples that are not whole numbers; a coordinate system that cannot
    /// be brought to the area's; or a raster that has no post in the area at all.
    pub fn open(path: &Path, epsg: u32, grid: &GridFrame, area: PostRect) -> Result<Self, SourceError> {
        // Classes have no unit; a unit in the file must not be an error.
        let file = DemFile::open(path, &Reading { height_unit_m: Some(1.0), ..Reading::AS_IT_SAYS })?;
        let frame = file.frame();
        let (reach, warp) = match frame.require_epsg(epsg) {
            Ok(()) => (window_near(frame, grid, area)?, None),
            Err(other) => {
                let warp = Warp::new(frame, &Crs::from_epsg(epsg).map_err(|_| other)?, grid);
                let window = warp.window(area, 1);
                (window.ok_or_else(|| SourceError::OutsideArea { path: path.into() })?, Some(warp))
            }
        };
        // Text has no types; whole numbers in it are whole numbers.
        let fractional = file.fractional().filter(|_| file.format() != "Esri ASCII grid");
        if let Some(found) = fractional.or(file.first_fraction(reach)?.then_some("fractions")) {
            return Err(SourceError::NotClasses { path: path.into(), found });
        }
        Ok(Self { windows: Windows::new(vec![file], KEPT_BYTES), reach, warp })
    }

    /// The number by which the file marks samples that are none.
    pub fn nodata(&self) -> Option<f64> {
        self.windows.files()[0].nodata()
    }

    /// Which posts of `rect` are of class `value`, row-major from the south. Posts where the raster has no sample, or
    /// a void one, are of no class.
    ///
    /// # Errors
    /// When the file cannot be read any more.
    pub fn members(&self, grid: &GridFrame, rect: PostRect, value: i32) -> Result<Vec<bool>, SourceError> {
        let value = Some(f64::from(value));
        self.each(grid, rect, |class| class == value)
    }

    /// The classes that posts of `rect` are of, each once.
    ///
    /// # Errors
    /// When the file cannot be read any more.
    pub fn values(&self, grid: &GridFrame, rect: PostRect) -> Result<BTreeSet<i64>, SourceError> {
        let mut classes = self.each(grid, rect, |class| class)?;
        // Most posts are of the class of the one before.
        classes.dedup();
        // Opening has made sure that they are whole numbers.
        Ok(classes.into_iter().flatten().map(|class| class as i64).collect())
    }

    /// What `of` makes of the class of each post of `rect`.
    fn each<T: Clone>(
        &self,
        grid: &GridFrame,
        rect: PostRect,
        of: impl Fn(Option<f64>) -> T,
    ) -> Result<Vec<T>, SourceError> {
        let frame = self.windows.files()[0].frame();
        if let Some(warp) = &self.warp {
            let Some(raster) = self.read(warp.window(rect, 1))? else { return Ok(vec![of(None); rect.post_count()]) };
            let places = warp.over(rect);
            let posts = (rect.south..=rect.north).flat_map(|row| (rect.west..=rect.east).map(move |col| (row, col)));
            let near = |units: i64| u32::try_from((units + i64::from(TAP_UNITS / 2)).div_euclid(TAP_UNITS.into())).ok();
            let class = |[col, row]: [i64; 2]| class_at(&raster, near(row), near(col));
            return Ok(posts.map(|(row, col)| of(places.at(row, col).and_then(class))).collect());
        }
        let Some(raster) = self.read(window_near(frame, grid, rect).ok())? else {
            return Ok(vec![of(None); rect.post_count()]);
        };
        let cols: Vec<Option<u32>> =
            (rect.west..=rect.east).map(|col| nearest(col_of(frame, grid, col), frame.cols)).collect();
        let rows = (rect.south..=rect.north).map(|row| nearest(row_of(frame, grid, row), frame.rows));
        let places = rows.flat_map(|row| cols.iter().map(move |&col| (row, col)));
        Ok(places.map(|(row, col)| of(class_at(&raster, row, col))).collect())
    }

    fn read(&self, window: Option<PostRect>) -> Result<Option<Raster>, SourceError> {
        let window = window.and_then(|window| window.intersection(&self.reach));
        window.map(|window| self.windows.read(0, window)).transpose()
    }
}

fn class_at(raster: &Raster, row: Option<u32>, col: Option<u32>) -> Option<f64> {
    let post = Post::new(i32::try_from(row?).ok()?, i32::try_from(col?).ok()?);
    raster.window().contains(post).then(|| raster.sample(post)).flatten()
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
