//! Ways and relations that are kept while a file is gone through, and the texts of its blocks that are.

use std::collections::HashSet;
use std::sync::Arc;

use super::assemble::Role;
use super::block::Block;
use crate::SourceError;
use crate::features::columns::Texts;
use crate::features::model::Tags;
use crate::limits::Allowance;

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

impl KeptWay {
    /// Counts what it takes: its own bytes, and for each node its number here and among those that are looked for.
    pub(super) fn counted(self, allowance: &Allowance) -> Result<Self, SourceError> {
        allowance.take(128 + 16 * self.nodes.len() + 32 * self.tags.len())?;
        Ok(self)
    }
}

impl KeptRelation {
    /// Counts what it takes: its own bytes, and for each member the member here and in the list of all.
    pub(super) fn counted(self, allowance: &Allowance) -> Result<Self, SourceError> {
        allowance.take(128 + 32 * self.members.len() + 32 * self.tags.len())?;
        Ok(self)
    }
}

/// In the order of their numbers. Of a way that a file has twice, one is kept, whichever comes first.
pub(super) fn sort_ways(ways: &mut Vec<KeptWay>) {
    ways.sort_by(|a, b| (a.id, &a.nodes).cmp(&(b.id, &b.nodes)));
    ways.dedup_by_key(|way| way.id);
}

/// Which texts of a block are wanted keys.
pub(super) fn wanted_texts(block: &Block, keys: &[&str]) -> Vec<bool> {
    let keys: HashSet<&[u8]> = keys.iter().map(|key| key.as_bytes()).collect();
    block.texts.iter().map(|text| keys.contains(text)).collect()
}

/// The texts of a block that have been kept so far.
pub(super) struct KnownTexts(Vec<Option<Arc<str>>>);

impl KnownTexts {
    pub(super) fn of(block: &Block) -> Self {
        Self(vec![None; block.texts.len()])
    }

    pub(super) fn tags(&mut self, block: &Block, tags: &[(usize, usize)], texts: &mut Texts) -> Tags {
        let mut text = |index: usize| {
            self.0[index].get_or_insert_with(|| texts.keep(&String::from_utf8_lossy(block.texts[index]))).clone()
        };
        let mut tags: Tags = tags.iter().map(|&(key, value)| (text(key), text(value))).collect();
        tags.sort_unstable();
        tags
    }
}
