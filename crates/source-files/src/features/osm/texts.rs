//! Texts of a block: which of them are wanted keys, and those that have been kept.

use std::collections::HashSet;
use std::sync::Arc;

use super::block::Block;
use crate::features::columns::Texts;
use crate::features::model::Tags;

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
