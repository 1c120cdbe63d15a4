//! What a job says of the plainer things: files by name, points that are given, the ground beside its rasters, levels
//! of detail, and what stands on the ground.

use std::path::PathBuf;

use features::objects::{ObjectOptions, ObjectRule};
use terrain::{LodBorder, ObjectKind};

/// A file that the job names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedFile {
    /// As written in the job, or as the job would write a file that a pattern found: for messages and provenance, so
    /// that no output depends on where the job lies.
    pub written: String,
    /// Where it is: the folder of the job file joined with `written`.
    pub path: PathBuf,
}

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

/// Coarser levels of load modules.
#[derive(Clone, Debug, PartialEq)]
pub struct LodSpec {
    /// For each level beside the finest, the share of the finest level's inner vertices that it keeps; strictly
    /// falling, between 0 and 1.
    pub inner_shares: Vec<f64>,
    /// What becomes of the vertices on the sides.
    pub border: LodBorder,
    /// For each of these levels, the classes of features that it leaves out; a coarser one leaves out those of finer
    /// ones, too.
    pub leave_out: Vec<Vec<String>>,
}

impl LodSpec {
    /// Whether any level leaves out features.
    pub fn leaves_out(&self) -> bool {
        self.leave_out.iter().any(|classes| !classes.is_empty())
    }

    /// Levels of a load module, the finest included.
    pub fn level_count(&self) -> usize {
        1 + self.inner_shares.len()
    }
}

/// What stands on the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectsSpec {
    /// Where it comes from; the order decides nothing.
    pub sources: Vec<ObjectSource>,
    /// What objects are by their tags; tried in order, before the built-in table.
    pub rules: Vec<ObjectRule>,
    /// How outlines are mended.
    pub options: ObjectOptions,
    /// Roofs, walls and triangles of canopies in a load module at most.
    pub per_load_module: u32,
    /// The same in every window of load modules, which is that of the job's limits.
    pub per_4km_square: u32,
    /// Whether they count in the job's limits, together with the ground.
    pub joint: bool,
}

/// A file of objects.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectSource {
    /// The file.
    pub file: NamedFile,
    /// Its layer, where it has several.
    pub layer: Option<String>,
    /// What its polygons and lines are, whatever their tags say; rules come first.
    pub kind: Option<ObjectKind>,
    /// The attribute with their heights, instead of `height`.
    pub height: Option<String>,
    /// The system of its coordinates as the job names it, whatever the file says.
    pub crs: Option<String>,
    /// Of a raster of heights of leaves: metres under which there is no wood.
    pub least_m: f64,
    /// The same: metres of the side of a cell, of which woods are made.
    pub cell_m: f64,
}

impl ObjectsSpec {
    /// Keys of tags that rules and sources look at, beside those of the built-in table.
    pub fn keys(&self) -> Vec<&str> {
        let of_rules = self.rules.iter().flat_map(|rule| &rule.tags).map(|(key, _)| key.as_str());
        of_rules.chain(self.sources.iter().filter_map(|source| source.height.as_deref())).collect()
    }
}
