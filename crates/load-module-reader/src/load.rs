//! From the files of an area to ground in memory, and on with the observer: only what is new is read.

use std::sync::Arc;

use crate::{Area, Block, LoadedGround, ReadError, TerrainModule};

impl Area {
    /// Loads a block, ready to be asked.
    ///
    /// # Errors
    /// When a load module cannot be read, is damaged, or is in no file.
    pub fn load(&self, block: Block) -> Result<LoadedGround, ReadError> {
        self.load_level(block, 0)
    }

    /// Loads a block at a level of detail; 0 is the finest.
    ///
    /// # Errors
    /// When there is no such level, or a load module cannot be read, is damaged, or is in no file.
    pub fn load_level(&self, block: Block, level: u16) -> Result<LoadedGround, ReadError> {
        let level_count = self.frame().level_count;
        if level_count <= level {
            return Err(ReadError::NoSuchLevel { found: level, level_count });
        }
        LoadedGround::empty(self.frame().clone(), level).moved(self, block)
    }
}

impl LoadedGround {
    /// The same ground, at the same level, for another block: what both hold is kept, only the rest is read.
    ///
    /// # Errors
    /// When a load module cannot be read, is damaged, or is in no file, or when this ground is of another area; this
    /// ground is as it was.
    pub fn moved(&self, area: &Area, block: Block) -> Result<Self, ReadError> {
        if area.frame() != self.frame() {
            return Err(ReadError::OtherGround);
        }
        area.check_holds(block)?;
        let held = self.block();
        let block = if block.count() == 0 { Block { north: block.south, east: block.west, ..block } } else { block };
        let mut modules: Vec<Option<Arc<TerrainModule>>> = vec![None; block.count()];
        for row in block.south..block.north {
            let mut col = block.west;
            while col < block.east {
                if held.contains(row, col) {
                    modules[block.index(row, col)] = Some(Arc::clone(&self.modules()[held.index(row, col)]));
                    col += 1;
                    continue;
                }
                // Up to what is loaded already, all at once.
                let known = (col..block.east).find(|&col| held.contains(row, col)).unwrap_or(block.east);
                area.load_row(self.level(), row, col..known, |col, module| {
                    modules[block.index(row, col)] = Some(module)
                })?;
                col = known;
            }
        }
        Ok(self.clone().with_modules(block, modules.into_iter().flatten().collect()))
    }
}
