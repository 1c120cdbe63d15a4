//! One load-module file (`docs/FORMAT.md`) per load module, for simulators that page single files.

use store::{TileModules, encode_levels};
use terrain::{LoadModule, ModuleId, ModuleRect};

use crate::{ExportError, Product, Put, Sheet, Work};

/// The name of a load module: `r0012c0034`.
pub(crate) fn module_name(id: ModuleId) -> String {
    format!("r{:04}c{:04}", id.row, id.col)
}

/// The name of a sheet of a rectangle of load modules: that of the load modules for the ground, else
/// `decks_r0012c0034`.
pub(crate) fn sheet_name(sheet: Sheet, rect: ModuleRect) -> String {
    match sheet {
        Sheet::Ground => group_name(rect),
        _ => format!("{}_{}", sheet.name(), group_name(rect)),
    }
}

/// The name of the load modules of a rectangle: the south-west one, and the north-east one if there are several.
pub(crate) fn group_name(rect: ModuleRect) -> String {
    let low = ModuleId { row: rect.south, col: rect.west };
    let high = ModuleId { row: rect.north - 1, col: rect.east - 1 };
    if low == high { module_name(low) } else { format!("{}_{}", module_name(low), module_name(high)) }
}

/// The rectangle of one load module.
pub(crate) fn alone(id: ModuleId) -> ModuleRect {
    ModuleRect { south: id.row, west: id.col, north: id.row + 1, east: id.col + 1 }
}

/// The name of a load module's file: `r0012c0034.slm`.
pub(crate) fn file_name(id: ModuleId, extension: &str) -> String {
    format!("{}.{extension}", module_name(id))
}

/// Writes every load module of a product, at all of its levels, as a file of its own: a tile's file that holds one load
/// module.
///
/// # Errors
/// When a file cannot be written, or the work was asked to stop.
pub fn write_modules(product: &Product, put: &Put, work: &Work) -> Result<(), ExportError> {
    let all: Vec<usize> = (0..product.modules.len()).collect();
    work.each("load modules", &all, |&index| {
        let module = &product.modules[index];
        let tile = &product.tiles[product.tile_of[index] as usize];
        let coarser = product.coarser.iter().map(|level| level[index].clone());
        let levels = std::iter::once(module.clone()).chain(coarser);
        put(&file_name(module.id, "slm"), &file_of(tile, levels.collect()))
    })?;
    Ok(())
}

/// The file of one load module, at all of its levels, as [`write_modules`] writes it; `tile` and `levels` are what the
/// file of its tile says. `None` where the tile has no such load module.
pub fn module_file(tile: &TileModules, levels: &[Vec<LoadModule>], id: ModuleId) -> Option<Vec<u8>> {
    let at = |level: &Vec<LoadModule>| level.iter().find(|module| module.id == id).cloned();
    Some(file_of(tile, levels.iter().map(at).collect::<Option<_>>()?))
}

/// The file of a load module that is given at all of its levels.
fn file_of(tile: &TileModules, levels: Vec<LoadModule>) -> Vec<u8> {
    let modules = alone(levels[0].id);
    let levels: Vec<Vec<LoadModule>> = levels.into_iter().map(|module| vec![module]).collect();
    encode_levels(&TileModules { modules, ..tile.clone() }, &levels)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::samples;

    #[test]
    fn each_file_holds_one_load_module_as_it_was() {
        check(&samples::product());
    }

    #[test]
    fn each_file_holds_all_levels_of_its_load_module() {
        check(&samples::with_levels());
    }

    #[track_caller]
    fn check(product: &Product) {
        let files = samples::files(|put, work| write_modules(product, put, work));
        assert_eq!(files.keys().collect::<Vec<_>>(), ["r0000c0000.slm", "r0000c0001.slm"]);
        for (index, (name, bytes)) in files.iter().enumerate() {
            let (header, read) = store::decode_levels(Path::new(name), bytes).unwrap();
            assert_eq!((header.modules.count(), read.len()), (1, 1 + product.coarser.len()));
            let levels: Vec<_> = product.levels().map(|level| vec![level.modules[index].clone()]).collect();
            assert_eq!(read, levels);
        }
    }
}
