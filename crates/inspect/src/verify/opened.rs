//! The load-module files as a simulator opens them, with `load-module-reader`; each header against the job.

use job::Job;
use load_module_reader::{Header, Keep, TileFile};
use store::{DatabaseError, Fingerprint, Folder};
use terrain::{HOLE_CLASS, LoadModule, TileId};

use super::modules::at_level;
use build::CompileError;
use build::database_area;
use build::ground::GamingArea;

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
pub(crate) fn open(folder: &Folder, job: &Job, area: &GamingArea) -> Result<Opened, CompileError> {
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
