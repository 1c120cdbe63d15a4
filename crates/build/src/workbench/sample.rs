//! The sample terrain as a raster, for other programs.

use std::io::{Result, Seek, Write};

use source_files::{write_classes, write_heights};
use terrain::{GridFrame, PostRect, Spacing};

/// EPSG code and origin of the sample terrain: UTM 11 north, near Fort Irwin, as in the project's jobs.
const PLACE: (u16, f64, f64) = (32_611, 505_000.0, 3_875_000.0);

/// What of the sample terrain is to be a raster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Which sample terrain.
    pub seed: u64,
    /// Rows and columns of posts.
    pub size: (usize, usize),
    /// Distance between posts.
    pub spacing: Spacing,
}

impl Sample {
    /// Writes its heights as a GeoTIFF. No more than a band of rows is ever held. Nothing is buffered here: give it a
    /// `BufWriter`.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_heights(&self, out: &mut (impl Write + Seek)) -> Result<()> {
        let &Self { seed, spacing, .. } = self;
        write_heights(out, &self.frame(), self.rect(), PLACE.0, |band| sample_terrain::heights(seed, band, spacing))
    }

    /// The same with its classes.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_classes(&self, out: &mut (impl Write + Seek)) -> Result<()> {
        let &Self { seed, spacing, .. } = self;
        write_classes(out, &self.frame(), self.rect(), PLACE.0, |band| sample_terrain::classes(seed, band, spacing))
    }

    fn frame(&self) -> GridFrame {
        let (_, origin_east_m, origin_north_m) = PLACE;
        GridFrame { origin_east_m, origin_north_m, spacing: self.spacing }
    }

    fn rect(&self) -> PostRect {
        PostRect::of_size(self.size.0, self.size.1)
    }
}
