//! Load modules as the checks take them: read when they are asked for, and those of two rows of tiles kept. Of a large
//! area no more is held than its width makes.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use build::ground::GamingArea;
use load_module_reader::SlmFile;
use store::{DatabaseError, Folder, load_module};
use terrain::{LoadModule, ModuleId, TileId};

/// The load modules of a level, by place.
pub(crate) struct Modules<'a> {
    files: Rc<Files<'a>>,
    level: usize,
}

/// Files of load modules, and what was read last of them.
struct Files<'a> {
    folder: &'a Folder,
    area: &'a GamingArea,
    held: RefCell<BTreeMap<TileId, Rc<TileLevels>>>,
    fault: RefCell<Option<DatabaseError>>,
}

/// The load modules of a tile, level by level.
type TileLevels = Vec<BTreeMap<ModuleId, Rc<LoadModule>>>;

impl<'a> Modules<'a> {
    /// So many levels of a database.
    pub fn levels(folder: &'a Folder, area: &'a GamingArea, count: usize) -> Vec<Self> {
        let files = Rc::new(Files { folder, area, held: RefCell::default(), fault: RefCell::default() });
        (0..count).map(|level| Self { files: Rc::clone(&files), level }).collect()
    }

    /// One of them.
    pub fn get(&self, id: &ModuleId) -> Option<Rc<LoadModule>> {
        let GamingArea { grid, tiling, .. } = self.files.area;
        let tile = grid.all().contains(*id).then(|| tiling.tile_of_module(*id, *grid))?;
        self.files.tile(tile).get(self.level)?.get(id).cloned()
    }

    /// Those of a tile, row by row from the south-west.
    pub fn of_tile(&self, tile: TileId) -> Vec<Rc<LoadModule>> {
        self.files.tile(tile).get(self.level).map_or_else(Vec::new, |level| level.values().cloned().collect())
    }

    /// All, row by row from the south-west.
    pub fn values(&self) -> impl Iterator<Item = Rc<LoadModule>> + '_ {
        self.files.area.grid.all().iter().filter_map(|id| self.get(&id))
    }

    /// What could not be read of any level, though it was sound a moment ago.
    pub fn fault(&self) -> Result<(), DatabaseError> {
        self.files.fault.borrow_mut().take().map_or(Ok(()), Err)
    }
}

impl Files<'_> {
    fn tile(&self, tile: TileId) -> Rc<TileLevels> {
        if let Some(held) = self.held.borrow().get(&tile) {
            return Rc::clone(held);
        }
        let levels = Rc::new(self.read(tile).unwrap_or_else(|fault| {
            self.fault.borrow_mut().get_or_insert(fault);
            TileLevels::new()
        }));
        let mut held = self.held.borrow_mut();
        // Walks go from south to north, and compare each row with the next.
        held.retain(|other, _| other.row == tile.row || other.row + 1 == tile.row);
        held.insert(tile, Rc::clone(&levels));
        levels
    }

    fn read(&self, tile: TileId) -> Result<TileLevels, DatabaseError> {
        let path = self.folder.modules_path(tile);
        let file = SlmFile::open(&path).map_err(|fault| DatabaseError::Modules { path, fault: Box::new(fault) })?;
        let header = file.header();
        let of_level = |level: u16| {
            let modules = file.level(level).unwrap_or(&[]).iter().map(|module| load_module(module, header.side));
            modules.map(|module| (module.id, Rc::new(module))).collect()
        };
        Ok((0..header.level_count).map(of_level).collect())
    }
}

pub(crate) fn at_level(level: usize, problem: String) -> String {
    if level == 0 { problem } else { format!("level {level}: {problem}") }
}
