//! What a job says about the ground beside its rasters: water that lies level, and what heights are measured from.

use crate::NamedFile;

/// Water that is to lie level.
#[derive(Clone, Debug, PartialEq)]
pub struct WaterSpec {
    /// Its polygons; each is one body of water.
    pub file: NamedFile,
    /// The level of all of them in metres; otherwise each lies at the median of its heights.
    pub level_m: Option<f64>,
    /// Index of its class in [`crate::ImportanceSpec::classes`].
    pub class: u8,
    /// Weight in thousandths, if not that of class 0.
    pub weight: Option<u16>,
}

/// A grid that says how far a vertical datum lies above the ellipsoid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GeoidSpec {
    /// The datum, as sources and the job name it.
    pub datum: String,
    /// The grid.
    pub file: NamedFile,
}
