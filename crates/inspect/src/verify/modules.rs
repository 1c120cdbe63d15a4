//! Load modules as the checks take them.

use std::collections::BTreeMap;

use terrain::{LoadModule, ModuleId};

/// Load modules by place.
pub(crate) type Modules = BTreeMap<ModuleId, LoadModule>;

pub(crate) fn at_level(level: usize, problem: String) -> String {
    if level == 0 { problem } else { format!("level {level}: {problem}") }
}
