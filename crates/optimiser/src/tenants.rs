//! Which vertices stand in which load module: whoever comes where a limit is met takes the place of one of them.

use std::collections::BTreeMap;

use terrain::{ModuleId, ModuleRect};

use crate::account::Account;
use crate::parts::NONE;
use crate::tile_mesh::TileMesh;

/// Vertices by load module; one on a line stands in the first of the two beside it.
#[derive(Default)]
pub(crate) struct Tenants {
    by_module: BTreeMap<ModuleId, Vec<u32>>,
}

impl Tenants {
    /// All vertices of a sheet that may go.
    pub fn new(account: &Account, sheet: &TileMesh) -> Self {
        let mut tenants = Self::default();
        for (vertex, record) in sheet.vertices.iter().enumerate() {
            if record.edge != NONE && !record.hold.is_fixed() {
                tenants.enter(account, sheet, vertex as u32);
            }
        }
        tenants
    }

    /// Enters a vertex that has come.
    pub fn enter(&mut self, account: &Account, sheet: &TileMesh, vertex: u32) {
        if let Some(module) = account.module_of(sheet.at(vertex)) {
            self.by_module.entry(module).or_default().push(vertex);
        }
    }

    /// Those that stand in some load modules; some of them may have gone since.
    pub fn within(&self, modules: ModuleRect) -> impl Iterator<Item = u32> {
        let row = move |row| {
            let (west, east) = (ModuleId { row, col: modules.west }, ModuleId { row, col: modules.east });
            self.by_module.range(west..east)
        };
        (modules.south..modules.north).flat_map(row).flat_map(|(_, vertices)| vertices).copied()
    }
}
