//! What `report.json` says of buildings, walls and woods.

use serde::{Deserialize, Serialize};

/// What stands on the ground, and what had no room.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportObjects {
    /// Each kind that is there.
    pub kinds: Vec<ObjectSums>,
    /// Roofs, walls and triangles of canopies that are kept.
    pub polygons: u64,
    /// Of them, in one load module.
    pub per_load_module: ReportObjectLimit,
    /// Of them, in one square of 4 km.
    pub per_4km: ReportObjectLimit,
    /// Objects, or parts of woods, that had no room; `objects.geojson` has each of them.
    pub left_out: u64,
    /// Remarks on what was mended or is no object; `objects.geojson` has each of them, too.
    pub remarks: u64,
}

/// The most there is, and the limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportObjectLimit {
    /// The most.
    pub max: u64,
    /// The limit.
    pub limit: u64,
}

/// How much there is of a kind of objects.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectSums {
    /// The word for the kind.
    pub kind: String,
    /// Buildings, towers, stretches of wall; of woods and rows their parts in single load modules.
    pub wanted: u64,
    /// Those that had room.
    pub kept: u64,
    /// What is seen of them from the side, in square metres.
    pub wanted_m2: f64,
    /// The same of those that had room.
    pub kept_m2: f64,
}
