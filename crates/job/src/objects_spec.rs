//! What a job says about buildings, walls and woods that stand on the ground.

use features::objects::{ObjectOptions, ObjectRule};
use terrain::ObjectKind;

use crate::NamedFile;

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
