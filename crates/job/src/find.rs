//! What a job may leave open about its area, and what a caller that knows coordinate systems and rasters makes of it.
//!
//! This crate looks at neither, so it asks: [`crate::Job::load_with`] takes the answer as a function.

use terrain::Spacing;

use crate::SourceFile;

/// An area that is to be found.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaRequest {
    /// EPSG code of the coordinate system; `None` for the UTM zone of the middle.
    pub epsg: Option<u32>,
    /// Where it is to lie.
    pub place: AreaPlace,
    /// Distance between posts of the working grid.
    pub spacing: Spacing,
    /// Side of a load module in metres: the area is a whole number of them.
    pub side_m: f64,
}

/// Where an area is to lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AreaPlace {
    /// Around a place, in degrees.
    Around {
        /// Degrees north.
        latitude: f64,
        /// Degrees east.
        longitude: f64,
        /// Metres from west to east and from south to north, at least.
        size_m: [f64; 2],
    },
    /// Where the sources have heights: the largest rectangle of whole load modules.
    CoverDem,
}

/// An area that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaFound {
    /// EPSG code of the coordinate system.
    pub epsg: u32,
    /// East and north of the south-west post, in metres.
    pub origin_m: [f64; 2],
    /// Width and height in metres, whole numbers of load modules.
    pub size_m: [f64; 2],
}

/// Why there is no such area.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoArea {
    /// What is the matter.
    pub found: String,
    /// What would do.
    pub expected: String,
    /// What to change.
    pub hint: String,
}

/// Finds an area; the files are those of `dem.sources`, patterns expanded, where it is to cover them.
pub type FindArea<'a> = dyn Fn(&AreaRequest, &[SourceFile]) -> Result<AreaFound, NoArea> + 'a;
