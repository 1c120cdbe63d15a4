//! Points that a job gives: where tiles start from, and pins.

use crate::NamedFile;

/// What tiles start from beside their corners and borders.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Start {
    /// Points that another method chooses, tile by tile.
    Method {
        /// Which.
        method: StartMethod,
        /// How many in the whole area; none of a method whose number is the ground's choice.
        points: Option<u64>,
    },
    /// Points of a file.
    File(NamedFile),
}

/// A method whose points tiles can start from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartMethod {
    /// Very important points, no border forced.
    Vip,
    /// Peaks and pits.
    HighLow,
    /// A grid refined where it fails.
    Lattice,
    /// Ridges and channels first.
    FowlerLittle,
    /// Triangles split into three.
    Hierarchical,
    /// The authors' earlier algorithm.
    Earlier,
    /// A regular grid.
    Regular,
    /// Contour lines.
    Contour,
}
