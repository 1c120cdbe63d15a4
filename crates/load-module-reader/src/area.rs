//! A gaming area opened for a simulator: all its files, of which load modules are taken as they are needed.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::{AreaFrame, Block, Keep, LoadedGround, ReadError, TerrainModule, TileFile};

/// Extension of load-module files.
const EXTENSION: &str = "slm";

/// A gaming area: the headers of its files read, load modules left where they are.
#[derive(Debug)]
pub struct Area {
    files: Vec<TileFile>,
    /// Of each row of load modules, the columns that files hold, and the places of these in `files`.
    rows: BTreeMap<u32, Vec<(Range<u32>, u32)>>,
    frame: AreaFrame,
}

impl Area {
    /// Opens the load modules of a terrain database, `DIR` or `DIR/modules`, or any folder of load-module files.
    ///
    /// # Errors
    /// When there are none, one cannot be read, or they do not belong to one area.
    pub fn open(dir: impl AsRef<Path>, keep: Keep) -> Result<Self, ReadError> {
        let paths = Self::files_in(dir)?;
        Self::of_files(paths.iter().map(|path| TileFile::open(path, keep)).collect::<Result<_, _>>()?)
    }

    /// The load-module files of a terrain database, `DIR` or `DIR/modules`, or of any folder, by name.
    ///
    /// # Errors
    /// When the folder cannot be read, or there are none.
    pub fn files_in(dir: impl AsRef<Path>) -> Result<Vec<PathBuf>, ReadError> {
        let dir = dir.as_ref();
        let inner = dir.join("modules");
        let folder = if inner.is_dir() { inner } else { dir.to_path_buf() };
        let unreadable = |source| ReadError::Unreadable { path: folder.clone(), source };
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(&folder).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            if path.extension().is_some_and(|extension| extension == EXTENSION) {
                paths.push(path);
            }
        }
        paths.sort();
        if paths.is_empty() { Err(ReadError::NoFiles { path: folder }) } else { Ok(paths) }
    }

    /// An area of files that are open already, such as memory maps of your own ([`TileFile::of_bytes`]).
    ///
    /// # Errors
    /// When there are none, or they do not belong to one area.
    pub fn of_files(files: Vec<TileFile>) -> Result<Self, ReadError> {
        let Some(first) = files.first() else { return Err(ReadError::NoFiles { path: Path::new("").into() }) };
        let frame = AreaFrame::of(first.header());
        let mut rows: BTreeMap<u32, Vec<(Range<u32>, u32)>> = BTreeMap::new();
        for (place, file) in (0..).zip(&files) {
            let header = file.header();
            if AreaFrame::of(header) != frame {
                return Err(ReadError::OtherArea { file: format!("{file:?}"), first: format!("{first:?}") });
            }
            for row in header.south..header.north {
                rows.entry(row).or_default().push((header.west..header.east, place));
            }
        }
        Ok(Self { files, rows, frame })
    }

    /// The file of a load module, the last one where several hold it.
    fn file_of(&self, row: u32, col: u32) -> Option<&TileFile> {
        let mut from_last = self.rows.get(&row)?.iter().rev();
        let (_, place) = from_last.find(|(cols, _)| cols.contains(&col))?;
        self.files.get(*place as usize)
    }

    /// Where load modules lie.
    pub fn frame(&self) -> &AreaFrame {
        &self.frame
    }

    /// Every load module of the area.
    pub fn whole(&self) -> Block {
        Block { south: 0, west: 0, north: self.frame.rows, east: self.frame.cols }
    }

    /// The block of `2 * reach + 1` load modules a side around a place, less what lies beyond the area.
    pub fn block_around(&self, place_m: [f64; 2], reach: u32) -> Block {
        let [row, col] = self.frame.module_at(place_m);
        let reach = i64::from(reach);
        let range = |at: i64, count: u32| {
            let clamped = |edge: i64| edge.clamp(0, i64::from(count)) as u32;
            (clamped(at.saturating_sub(reach)), clamped(at.saturating_add(reach + 1)))
        };
        let ((south, north), (west, east)) = (range(row, self.frame.rows), range(col, self.frame.cols));
        Block { south, west, north: north.max(south), east: east.max(west) }
    }

    /// Looks whether every load module of a block is in a file, before room is made for any: there are at most as many
    /// looks as load modules, and one.
    pub(crate) fn check_holds(&self, block: Block) -> Result<(), ReadError> {
        if block.count() == 0 {
            return Ok(());
        }
        let places = (block.south..block.north).flat_map(|row| (block.west..block.east).map(move |col| [row, col]));
        let mut missing = places.filter(|[row, col]| self.file_of(*row, *col).is_none());
        missing.next().map_or(Ok(()), |[row, col]| Err(ReadError::NoSuchModule { row, col }))
    }

    /// Loads a level of one row of a block; `into` takes each load module with its column.
    pub(crate) fn load_row(
        &self,
        level: u16,
        row: u32,
        cols: std::ops::Range<u32>,
        mut into: impl FnMut(u32, Arc<TerrainModule>),
    ) -> Result<(), ReadError> {
        let mut col = cols.start;
        while col < cols.end {
            let file = self.file_of(row, col).ok_or(ReadError::NoSuchModule { row, col })?;
            let end = cols.end.min(file.header().east);
            for module in file.row(level, row, col..end)? {
                into(module.col, Arc::new(TerrainModule::new(module, self.frame.side)));
            }
            col = end;
        }
        Ok(())
    }
}

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
