//! What the cost of features leaves to each of them, load module by load module.

use std::collections::{HashMap, HashSet};

use crate::{FeatureId, Form};

/// What the cost of features leaves to one of them in a load module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Grant {
    /// How many times the usual tolerance it is thinned with: 1, 2 or 4.
    pub tolerance: u8,
    /// The most it may be: a bench, a strip or a line.
    pub most: Form,
    /// Whether it is left out.
    pub out: bool,
}

impl Grant {
    /// As asked for.
    pub const ALL: Self = Self { tolerance: 1, most: Form::Bench, out: false };
    /// Nothing.
    pub const OUT: Self = Self { out: true, ..Self::ALL };
}

/// What the cost of features leaves to each of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grants {
    /// Where nothing else is said.
    others: Grant,
    /// By feature and load module (row, column).
    less: HashMap<(FeatureId, (i32, i32)), Grant>,
    out: HashSet<FeatureId>,
}

impl Default for Grants {
    fn default() -> Self {
        Self::same(Grant::ALL)
    }
}

impl Grants {
    /// The same for every feature everywhere.
    pub fn same(grant: Grant) -> Self {
        Self { others: grant, less: HashMap::new(), out: HashSet::new() }
    }

    /// What a feature may be in a load module (row, column).
    pub fn of(&self, id: FeatureId, module: (i32, i32)) -> Grant {
        if self.is_out(id) {
            return Grant::OUT;
        }
        self.less.get(&(id, module)).copied().unwrap_or(self.others)
    }

    /// Whether a feature is left out wherever it lies.
    pub fn is_out(&self, id: FeatureId) -> bool {
        self.out.contains(&id)
    }

    /// Leaves less, or more again, to a feature in a load module.
    pub fn set(&mut self, id: FeatureId, module: (i32, i32), grant: Grant) {
        self.less.insert((id, module), grant);
    }

    /// Leaves out a feature wherever it lies; false where it was left out already.
    pub fn leave_out(&mut self, id: FeatureId) -> bool {
        self.out.insert(id)
    }
}
