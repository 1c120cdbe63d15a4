//! Ways and relations that are kept while a file is gone through.

use super::assemble::Role;
use crate::features::model::Tags;

/// Longer segments are no road or river but a node in the wrong place. Nodes up to this far from the area are kept.
pub(super) const SEGMENT_M_MAX: f64 = 20_000.0;
/// A way near the area, or a member of a relation that is.
#[derive(Debug)]
pub(super) struct KeptWay {
    pub id: i64,
    /// Empty where only a relation wants it.
    pub tags: Tags,
    pub nodes: Box<[i64]>,
    /// Whether some of its nodes are not near the area.
    pub reaches_out: bool,
    pub is_wanted: bool,
}

/// A multipolygon relation that is wanted.
#[derive(Debug)]
pub(super) struct KeptRelation {
    pub id: i64,
    pub tags: Tags,
    pub members: Vec<(Role, i64)>,
}

/// In the order of their numbers. Of a way that a file has twice, one is kept, whichever comes first.
pub(super) fn sort_ways(ways: &mut Vec<KeptWay>) {
    ways.sort_by(|a, b| (a.id, &a.nodes).cmp(&(b.id, &b.nodes)));
    ways.dedup_by_key(|way| way.id);
}
