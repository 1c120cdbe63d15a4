//! Posts that limits kept out of load modules, counted.

use std::collections::BTreeMap;

use terrain::{ModuleId, Refusal, RefusedBy};

/// Posts that limits kept out of one load module: how many, and the largest of their residuals, by what refused them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct RefusedPosts {
    counts: [u32; 3],
    largest: [u32; 3],
}

/// What refuses posts, in the order of the counts.
const BY: [RefusedBy; 3] = [RefusedBy::Module, RefusedBy::Window, RefusedBy::Reservation];

impl RefusedPosts {
    /// Takes in one more.
    fn add(&mut self, refusal: &Refusal) {
        let by = BY.iter().position(|&by| by == refusal.by).expect("the list names every limit");
        self.counts[by] += 1;
        self.largest[by] = self.largest[by].max(refusal.residual);
    }

    /// Takes in those of another load module or tile.
    pub fn merge(&mut self, other: &RefusedPosts) {
        for by in 0..BY.len() {
            self.counts[by] += other.counts[by];
            self.largest[by] = self.largest[by].max(other.largest[by]);
        }
    }

    /// Only those that `by` refused, or that anything else did.
    pub fn part(&self, keep: impl Fn(RefusedBy) -> bool) -> RefusedPosts {
        let mut part = RefusedPosts::default();
        for by in (0..BY.len()).filter(|&by| keep(BY[by])) {
            (part.counts[by], part.largest[by]) = (self.counts[by], self.largest[by]);
        }
        part
    }

    /// Those that one limit refused.
    pub fn count_by(&self, by: RefusedBy) -> u32 {
        BY.iter().position(|&one| one == by).map_or(0, |by| self.counts[by])
    }

    /// All of them.
    pub fn count(&self) -> u32 {
        self.counts.iter().sum()
    }

    /// The largest residual of any, in quanta.
    pub fn largest(&self) -> u32 {
        self.largest.into_iter().max().unwrap_or(0)
    }
}

/// Refusals by load module, in ascending order.
pub(crate) fn by_module(refused: &[Refusal]) -> Vec<(ModuleId, RefusedPosts)> {
    let mut modules: BTreeMap<ModuleId, RefusedPosts> = BTreeMap::new();
    refused.iter().for_each(|refusal| modules.entry(refusal.module).or_default().add(refusal));
    modules.into_iter().collect()
}
