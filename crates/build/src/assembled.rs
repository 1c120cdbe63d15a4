//! What a build keeps in memory of load modules that are published: numbers only.

use store::FileStamp;
use terrain::ModuleResidual;

/// What whole-area stages know of one tile's load modules: numbers only.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Assembled {
    pub file: FileStamp,
    /// The file of what follows.
    pub measured: FileStamp,
    /// Per load module of the tile, row by row.
    pub modules: Vec<ModuleNumbers>,
    /// The same of every level beside the finest.
    pub coarser: Vec<Vec<ModuleNumbers>>,
}

/// Counts and residual of one load module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ModuleNumbers {
    pub triangles: u32,
    pub polygons: u32,
    pub residual: ModuleResidual,
}
