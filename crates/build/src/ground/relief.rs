//! Heights of any rectangle of the area, whatever they come from, with water level.
//!
//! An independent guard holds that no height lies outside the range of the sources' own heights. The range is taken
//! while samples are decoded, before voids are filled or anything is resampled, so a mistake in either (a marker of
//! voids that is taken for a height, a curve that swings out) cannot move it.

use fidelity::{SourcePosts, Tally, residuals_at_places, residuals_at_source};
use source_files::{Mosaic, Patch, Raster, RasterFrame};
use terrain::{Dem, GridFrame, PostRect, QUANTA_PER_METRE};

use crate::ground::GroundError;
use crate::ground::area::GamingArea;
use crate::ground::source::Source;
use crate::ground::water::Water;

/// The heights of an area.
pub struct Relief {
    pub(crate) source: Source,
    pub(crate) frame: GridFrame,
    pub(crate) water: Option<Water>,
    /// What heights must lie within before water is level; none for the sample terrain.
    pub bounds: Option<Bounds>,
}

impl Relief {
    /// Heights at the posts of a rectangle.
    ///
    /// # Errors
    /// When the source has no heights there, or cannot be read any more.
    pub fn dem(&self, rect: PostRect) -> Result<Dem, GroundError> {
        if let Some(patch) = self.patch(rect)? {
            return Ok(patch.dem());
        }
        let dem = self.dry(rect)?;
        Ok(match &self.water {
            Some(water) => water.flatten(dem),
            None => dem,
        })
    }

    /// Heights as the source has them, whatever the water.
    ///
    /// # Errors
    /// As [`Relief::dem`].
    pub fn dry(&self, rect: PostRect) -> Result<Dem, GroundError> {
        let dem = match &self.source {
            Source::Sample(seed) => sample_terrain::heights(*seed, rect, self.frame.spacing),
            Source::Raster(raster) => raster.resample(&self.frame, rect)?,
            Source::Window(windows) => {
                let needed = source_files::window_under(windows.files()[0].frame(), &self.frame, rect)?;
                windows.read(0, needed)?.resample(&self.frame, rect)?
            }
            Source::Mosaic(mosaic) => mosaic.resample(rect).dem(),
            Source::Wide(mosaic) => mosaic.resample(rect)?.dem(),
        };
        self.bounds.map_or(Ok(()), |bounds| bounds.hold(dem.range()))?;
        Ok(dem)
    }

    /// Heights and how each came about, where there are several sources; water is level in it.
    ///
    /// # Errors
    /// As [`Relief::dem`].
    pub fn patch(&self, rect: PostRect) -> Result<Option<Patch>, GroundError> {
        let patch = match &self.source {
            Source::Mosaic(mosaic) => mosaic.resample(rect),
            Source::Wide(mosaic) => mosaic.resample(rect)?,
            Source::Sample(_) | Source::Raster(_) | Source::Window(_) => return Ok(None),
        };
        let highest = patch.heights.iter().copied().max();
        if let (Some(bounds), Some(lowest), Some(highest)) = (self.bounds, patch.heights.iter().copied().min(), highest)
        {
            bounds.hold((lowest, highest))?;
        }
        Ok(Some(match &self.water {
            Some(water) => water.flatten_patch(patch),
            None => patch,
        }))
    }

    /// Whether the source is on the working grid's own system, and no mosaic.
    pub(crate) fn is_single(&self) -> bool {
        !matches!(self.source, Source::Mosaic(_) | Source::Wide(_))
    }

    /// Whether the source has posts of its own to measure at: several sources have none in common.
    pub fn has_source_posts(&self) -> bool {
        match &self.source {
            Source::Mosaic(mosaic) => mosaic.has_own_posts(),
            Source::Wide(_) => false,
            Source::Sample(_) | Source::Raster(_) | Source::Window(_) => true,
        }
    }

    /// Residuals of the load modules of a tile at the source's own posts; `None` where those are the posts of the
    /// working grid.
    ///
    /// # Errors
    /// When the source cannot be read any more.
    pub fn residuals_at_source(
        &self,
        modules: &[terrain::LoadModule],
        area: &GamingArea,
        tile: PostRect,
    ) -> Result<Option<Tally>, GroundError> {
        match &self.source {
            Source::Raster(raster) => Ok(self.residuals_at(modules, area, raster)),
            Source::Window(windows) => {
                let window = source_files::window_under(windows.files()[0].frame(), &self.frame, tile)?;
                Ok(self.residuals_at(modules, area, &windows.read(0, window)?))
            }
            Source::Mosaic(mosaic) if mosaic.has_own_posts() => {
                Ok(Some(self.residuals_of(modules, area, tile, mosaic)))
            }
            Source::Sample(_) | Source::Mosaic(_) | Source::Wide(_) => Ok(None),
        }
    }

    /// Residuals at the posts of the one raster of a mosaic, which has another coordinate system.
    fn residuals_of(&self, modules: &[terrain::LoadModule], area: &GamingArea, tile: PostRect, of: &Mosaic) -> Tally {
        let quanta = |metres: f64| metres * f64::from(terrain::QUANTA_PER_METRE);
        let origin = [self.frame.origin_east_m, self.frame.origin_north_m];
        let mut places = Vec::new();
        of.each_own_post(tile, &mut |[east, north], height_m| {
            places.push([east - origin[0], north - origin[1], height_m].map(quanta));
        });
        residuals_at_places(modules, area.grid, self.frame.spacing, &places)
    }

    /// Whether the source's posts are others than those of the working grid, so that two sources may differ in what
    /// is measured and not in any window.
    pub fn has_posts_between(&self) -> bool {
        let frame = match &self.source {
            Source::Raster(raster) => raster.frame(),
            Source::Window(windows) => windows.files()[0].frame(),
            Source::Mosaic(mosaic) => return mosaic.has_own_posts(),
            Source::Sample(_) | Source::Wide(_) => return false,
        };
        self.offset_between(frame).is_some()
    }

    /// How far the posts of a raster lie off those of the working grid; `None` where they are the same.
    fn offset_between(&self, frame: &RasterFrame) -> Option<[f64; 2]> {
        let spacing = self.frame.spacing.metres();
        let off = [frame.south_west[0] - self.frame.origin_east_m, frame.south_west[1] - self.frame.origin_north_m];
        let is_on_grid = frame.spacing == [spacing; 2] && off.iter().all(|metres| (metres / spacing).fract() == 0.0);
        (!is_on_grid).then_some(off)
    }

    fn residuals_at(&self, modules: &[terrain::LoadModule], area: &GamingArea, raster: &Raster) -> Option<Tally> {
        let frame = raster.frame();
        let off = self.offset_between(frame)?;
        let quanta = |metres: f64| metres * f64::from(terrain::QUANTA_PER_METRE);
        let source = SourcePosts {
            window: raster.window(),
            south_west: off.map(quanta),
            step: frame.spacing.map(quanta),
            push_row_m: &|row, cols, heights| raster.push_row_m(row, cols, heights),
        };
        Some(residuals_at_source(modules, area.grid, self.frame.spacing, &source))
    }
}

/// The lowest and the highest height that any source has under the area, in quanta, as whole numbers around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    lowest: i32,
    highest: i32,
}

impl Bounds {
    /// Of heights in metres.
    pub fn of_metres((lowest_m, highest_m): (f64, f64)) -> Self {
        let quanta = |metres: f64| metres * f64::from(QUANTA_PER_METRE);
        // Filled heights are computed in single precision, whose last digit may be worth a quantum.
        Self { lowest: quanta(lowest_m).floor() as i32 - 1, highest: quanta(highest_m).ceil() as i32 + 1 }
    }

    /// The same, for heights that may also be one that a job gives.
    pub fn and(self, quanta: i32) -> Self {
        Self { lowest: self.lowest.min(quanta), highest: self.highest.max(quanta) }
    }

    /// By how many metres a height lies outside; 0 for one inside.
    pub fn metres_outside(self, quanta: i32) -> f64 {
        let outside = (i64::from(self.lowest) - i64::from(quanta)).max(i64::from(quanta) - i64::from(self.highest));
        metres(outside.max(0))
    }

    /// How far a surface leaves its sources only where something is wrong, in metres. Fitted heights stay nearer.
    pub fn far_m(self) -> f64 {
        far_m(self.metres().into())
    }

    /// The bounds in metres.
    pub fn metres(self) -> (f64, f64) {
        (metres(self.lowest.into()), metres(self.highest.into()))
    }

    /// Refuses heights that reach beyond.
    ///
    /// # Errors
    /// [`GroundError::OutsideSources`]: then this program is wrong, not the job.
    pub fn hold(self, (lowest, highest): (i32, i32)) -> Result<(), GroundError> {
        if self.lowest <= lowest && highest <= self.highest {
            return Ok(());
        }
        let found_m = (metres(lowest.into()), metres(highest.into()));
        Err(GroundError::OutsideSources { found_m, expected_m: self.metres() })
    }
}

/// The same of a range of heights in metres.
pub fn far_m([low, high]: [f64; 2]) -> f64 {
    (0.2 * (high - low)).max(10.0)
}

fn metres(quanta: i64) -> f64 {
    quanta as f64 / f64::from(QUANTA_PER_METRE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_height_a_metre_below_every_source_is_refused_with_both_ranges() {
        let bounds = Bounds::of_metres((10.0, 20.5));
        assert!(bounds.hold((10 * 128, 20 * 128 + 64)).is_ok());
        let text = bounds.hold((9 * 128, 20 * 128)).unwrap_err().to_string();
        assert!(text.contains("from 9.00 m to 20.00 m") && text.contains("9.99 m to 20.51 m"), "{text}");
        assert_eq!(bounds.metres_outside(9 * 128 - 1), 1.0);
        assert_eq!(bounds.and(0).metres_outside(0), 0.0);
    }
}
