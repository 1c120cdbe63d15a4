//! Load modules as the checks take them: read when they are asked for, and those of two rows of tiles kept. Of a large
//! area no more is held than its width makes. And their files as a simulator opens them, with `load-module-reader`,
//! each header against the job.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use build::ground::GamingArea;
use build::{CompileError, database_area};
use job::Job;
use load_module_reader::{Header, Keep, SlmFile, TileFile};
use store::{DatabaseError, Fingerprint, Folder, load_module};
use terrain::{HOLE_CLASS, LoadModule, ModuleId, TileId};

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

/// What the headers of the load-module files of a database say.
pub(crate) struct Opened {
    /// Levels: as many as the job has, or as a file has where those are more.
    pub level_count: usize,
    /// What each tile's file says that it was made from.
    pub fingerprints: Vec<Fingerprint>,
    /// What is not as the job says in the header of each tile.
    pub problems: Vec<Vec<String>>,
}

/// Reads the header of every tile's file.
///
/// # Errors
/// When one cannot be read.
pub(crate) fn open_as_simulators(folder: &Folder, job: &Job, area: &GamingArea) -> Result<Opened, CompileError> {
    let mut opened = Opened {
        level_count: job.lod.level_count(),
        fingerprints: Vec::with_capacity(area.tiles.len()),
        problems: Vec::with_capacity(area.tiles.len()),
    };
    for &tile in &area.tiles {
        let path = folder.modules_path(tile);
        let file = TileFile::open(&path, Keep::OnDisk)
            .map_err(|fault| DatabaseError::Modules { path: path.clone(), fault: Box::new(fault) })?;
        let header = file.header();
        let differing = differing(header, job, area, tile);
        opened.problems.push(differing.into_iter().map(|what| format!("modules/{tile}.slm: {what}")).collect());
        opened.fingerprints.push(Fingerprint(header.fingerprint));
        opened.level_count = opened.level_count.max(usize::from(header.level_count));
    }
    Ok(opened)
}

/// Fields of a header that are not as the job says.
fn differing(header: &Header, job: &Job, area: &GamingArea, tile: TileId) -> Vec<String> {
    let (grid, rect) = (area.grid, area.tiling.modules(tile, area.grid));
    let told = database_area(job);
    let side = i64::from(grid.side_cells) * i64::from(area.frame.spacing.quanta_per_post());
    let metres = |[east, north]: [f64; 2]| format!("{east} m east, {north} m north");
    let text = |number: u32| number.to_string();
    let fields = [
        ("tile row", text(header.tile_row), text(tile.row)),
        ("tile column", text(header.tile_col), text(tile.col)),
        ("area rows", text(header.area_rows), text(grid.rows)),
        ("area columns", text(header.area_cols), text(grid.cols)),
        ("south", text(header.south), text(rect.south)),
        ("north", text(header.north), text(rect.north)),
        ("west", text(header.west), text(rect.west)),
        ("east", text(header.east), text(rect.east)),
        ("side", header.side.to_string(), side.to_string()),
        ("side in cells", text(header.side_cells), grid.side_cells.to_string()),
        ("spacing", text(header.spacing_sixteenths), text(area.frame.spacing.sixteenths())),
        ("origin", metres(header.origin_m), metres(told.origin_m)),
        ("crs", format!("\"{}\"", header.crs), format!("\"{}\"", told.crs)),
        ("vertical datum", format!("\"{}\"", header.vertical_datum), format!("\"{}\"", told.vertical_datum)),
    ];
    let wrong = fields.into_iter().filter(|(_, found, expected)| found != expected);
    wrong.map(|(field, found, expected)| format!("its header says {field} {found}, the job {expected}")).collect()
}

/// The first triangle of the ground at a level, or else of decks, whose class is none of so many that the job has.
pub(crate) fn unknown_class(level: usize, module: &LoadModule, count: usize) -> Option<String> {
    let is_unknown = |&class: &u8| class != HOLE_CLASS && count <= usize::from(class);
    let of = |what: &str, classes: &[u8]| {
        let triangle = classes.iter().position(is_unknown)?;
        Some(format!("{what} {triangle} has class {}, the job has {count}", classes[triangle]))
    };
    let what = of("triangle", &module.classes).or_else(|| of("triangle of decks", &module.decks.classes))?;
    Some(at_level(level, format!("load module {}: {what}", module.id)))
}
