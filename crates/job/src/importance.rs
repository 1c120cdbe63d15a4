//! What a job says about where ground matters more.

use terrain::Smooth;

use crate::NamedFile;

/// Where ground matters more.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportanceSpec {
    /// Weight of class 0, in thousandths.
    pub default_weight: u16,
    /// Areas in the order of the job file; a later one lies over an earlier one.
    pub areas: Vec<ImportanceArea>,
    /// Names of the classes; index 0 is the default one, at most 255 in all.
    pub classes: Vec<String>,
    /// How the borders between weights are softened.
    pub smooth: Smooth,
}

impl ImportanceSpec {
    /// The weights of ground, in thousandths; water and pins not counted.
    pub fn weights(&self) -> impl Iterator<Item = u16> {
        self.areas.iter().map(|area| area.weight).chain([self.default_weight])
    }

    /// The largest weight of any ground, in thousandths; water and pins not counted.
    pub fn heaviest(&self) -> u16 {
        self.weights().max().unwrap_or(self.default_weight)
    }

    /// The least weight of any ground that counts, in thousandths; water and pins not counted.
    pub fn lightest(&self) -> u16 {
        self.weights().filter(|weight| 0 < *weight).min().unwrap_or(1)
    }
}

/// What the class of holes is called, which no class of a job may be: ground where no source has a height.
pub const HOLE_CLASS_NAME: &str = "hole";

/// Part of the area with its own weight.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportanceArea {
    /// Which posts.
    pub shape: AreaShape,
    /// Index of its class in [`ImportanceSpec::classes`].
    pub class: u8,
    /// Weight in thousandths; 0 excludes posts from selection.
    pub weight: u16,
}

/// Which posts an importance area holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AreaShape {
    /// Posts inside the polygons of a GeoJSON file or a Shapefile.
    Polygons {
        /// The file.
        file: NamedFile,
    },
    /// Posts where a class raster holds a value.
    RasterValue {
        /// The raster.
        file: NamedFile,
        /// The value.
        value: i64,
    },
    /// Posts where the ground is steep.
    Slope {
        /// Slope in thousandths of a percent above which ground belongs.
        above: u32,
        /// Radius in millimetres over which slopes are averaged first.
        smooth_mm: u32,
    },
    /// Posts where the ground lies level at one height, as the sea does.
    Level {
        /// The height in millimetres.
        height_mm: i32,
    },
    /// Posts of a class of the sample terrain (only with [`crate::DemSource::Sample`]).
    Sample(SampleClass),
}

/// Classes the sample terrain comes with, besides its plains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleClass {
    /// Mountain blocks.
    Mountains,
}
