//! A finished database read back, to be looked at: load modules, the ground they were made from, and
//! how far one lies from the other at every post.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::ground::{GamingArea, Ground, GroundError, PlannedTile, Window, planned_tiles};
use fidelity::each_residual;
use job::Job;
use schedule::Workers;
use store::{AreaLevel, FeatureRemark, Folder, Manifest};
use terrain::{Dem, GridFrame, LoadModule, ModuleGrid, ModuleId, ModuleRect, Post, PostRect, TileId};
use views::NO_RESIDUAL;

use crate::product::{Opened, ProductError, choose_ground, read_told};

/// What is wanted of a database.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    /// The load modules to read; all without one.
    pub part: Option<ModuleRect>,
    /// Whether the ground is wanted, too, and from where.
    pub ground: WantedGround<'a>,
    /// Tiles at once.
    pub workers: usize,
}

/// Where the ground under load modules comes from.
#[derive(Clone, Copy)]
pub enum WantedGround<'a> {
    /// It is not wanted.
    None,
    /// What the database was built from, looked for by its content.
    Recorded,
    /// Rasters, joined as the job joins its own.
    Rasters(&'a [PathBuf]),
    /// It is open: that of the build that has just made the database.
    Open(&'a Ground),
}

/// A finished database, or a part of it.
#[derive(Clone, Debug)]
pub struct Product {
    /// Its `database.json`.
    pub manifest: Manifest,
    /// The job it was built from.
    pub job: Job,
    /// All load modules of the area.
    pub grid: ModuleGrid,
    /// Where posts lie.
    pub frame: GridFrame,
    /// All tiles of the area, row by row from the south-west.
    pub tiles: Vec<PlannedTile>,
    /// The part that was read.
    pub part: ModuleRect,
    /// The load modules of that part, row by row from the south-west.
    pub modules: Vec<LoadModule>,
    /// The ground under them, if it was wanted.
    pub ground: Option<ProductGround>,
    /// What features of the area came to, and all remarks on them; nothing of jobs without any.
    pub features: Option<(AreaLevel, Vec<FeatureRemark>)>,
}

/// The ground under a part of a database.
#[derive(Clone, Debug)]
pub struct ProductGround {
    /// Heights at all posts of the part.
    pub dem: Dem,
    /// Residual of each post, DEM less triangles, in quanta, row by row from the south-west; [`NO_RESIDUAL`] at voids.
    pub residuals: Vec<i32>,
    /// What the heights come from, in words.
    pub name: String,
}

impl ProductGround {
    /// Share of the posts at which there is a height.
    pub fn covered(&self) -> f64 {
        1.0 - self.dem.void_count() as f64 / self.residuals.len() as f64
    }
}

/// Counts held against limits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LimitUse {
    /// Count of each load module, row by row from the south-west.
    pub modules: Vec<u32>,
    /// Count of each window, by its south-west load module, row by row.
    pub windows: Vec<u32>,
    /// Rows and columns of load modules in a window.
    pub window: [u32; 2],
}

impl Product {
    /// Reads a finished database. The heights of the part are held at once, 8 bytes a post.
    ///
    /// # Errors
    /// When it is missing, unfinished or damaged, or the ground is wanted and cannot be found or used.
    pub fn read(folder: &Path, wanted: &Wanted) -> Result<Self, ProductError> {
        Self::of(&Opened::open(folder)?, wanted)
    }

    /// The same of a database that is open.
    ///
    /// # Errors
    /// As [`Product::read`].
    pub fn of(opened: &Opened, wanted: &Wanted) -> Result<Self, ProductError> {
        let Opened { folder, manifest, job, area } = opened;
        let part = wanted.part.unwrap_or(area.grid.all());
        check_part(part, area)?;
        let (workers, stop) = (Workers::new(wanted.workers), AtomicBool::new(false));
        let own = open_ground(opened, wanted.ground, (&workers, &stop))?;
        let ground = wanted.ground.held(&own, opened);
        let meets = |tile: &TileId| area.tiling.modules(*tile, area.grid).intersection(part).is_some();
        let tiles: Vec<TileId> = area.tiles.iter().copied().filter(meets).collect();
        let read = |_: usize, &tile: &TileId| read_tile(opened, ground.map(|(ground, _)| ground), part, tile);
        let pieces = schedule::for_each_independent(&tiles, &workers, &stop, read)
            .map_err(|error| GroundError::from_schedule(&tiles, error))?;
        let (modules, pieces): (Vec<_>, Vec<_>) = pieces.into_iter().map(|piece| (piece.modules, piece.ground)).unzip();
        let mut modules: Vec<LoadModule> = modules.into_iter().flatten().collect();
        modules.sort_by_key(|module| module.id);
        check_complete(&modules, part, folder)?;
        let rect = area.grid.posts_of_rect(part);
        let ground = ground.map(|(_, name)| {
            let pieces: Vec<Piece> = pieces.into_iter().flatten().collect();
            join(&pieces, rect, name.to_owned())
        });
        let (manifest, job) = (manifest.clone(), job.clone());
        let (grid, frame, tiles) = (area.grid, area.frame, planned_tiles(area));
        let features = read_told(opened)?.map(|(level, told)| (level, told.remarks));
        Ok(Self { manifest, job, grid, frame, tiles, part, modules, ground, features })
    }

    /// The load modules of a part at the finest level, row by row from the south-west, and nothing else of the
    /// database.
    ///
    /// # Errors
    /// When one is missing or damaged.
    pub fn modules_in(opened: &Opened, part: ModuleRect) -> Result<Vec<LoadModule>, ProductError> {
        Ok(Self::levels_in(opened, part)?.swap_remove(0))
    }

    /// The same at every level, the finest first.
    ///
    /// # Errors
    /// As [`Product::modules_in`].
    pub fn levels_in(opened: &Opened, part: ModuleRect) -> Result<Vec<Vec<LoadModule>>, ProductError> {
        let Opened { folder, manifest, area, .. } = opened;
        let [low, high] = [part.south_west(), ModuleId { row: part.north - 1, col: part.east - 1 }]
            .map(|corner| area.tiling.tile_of_module(corner, area.grid));
        let mut levels = vec![Vec::new(); opened.job.lod.inner_shares.len() + 1];
        for (row, col) in (low.row..=high.row).flat_map(|row| (low.col..=high.col).map(move |col| (row, col))) {
            let read = folder.read_part(manifest, TileId { row, col }, part)?.1;
            levels.iter_mut().zip(read).for_each(|(level, mut modules)| level.append(&mut modules));
        }
        for level in &mut levels {
            level.sort_by_key(|module| module.id);
            check_complete(level, part, folder)?;
        }
        Ok(levels)
    }

    /// What `each` makes of the load modules of each of these parts, and of the ground under them where it is wanted:
    /// of each part by itself, so that no more is held at once than workers are at.
    ///
    /// # Errors
    /// As [`Product::read`].
    pub fn each_part<R: Send>(
        opened: &Opened,
        wanted: WantedGround,
        parts: &[ModuleRect],
        workers: usize,
        each: impl Fn(&[LoadModule], Option<&Window>) -> R + Sync,
    ) -> Result<Vec<R>, ProductError> {
        let area = &opened.area;
        let (workers, stop) = (Workers::new(workers), AtomicBool::new(false));
        let own = open_ground(opened, wanted, (&workers, &stop))?;
        let ground = wanted.held(&own, opened).map(|(ground, _)| ground);
        let tiles: Vec<TileId> =
            parts.iter().map(|part| area.tiling.tile_of_module(part.south_west(), area.grid)).collect();
        let read = |_: usize, part: &ModuleRect| -> Result<R, ProductError> {
            let modules = Self::modules_in(opened, *part)?;
            let window = ground.map(|ground| ground.window(area.grid.posts_of_rect(*part))).transpose()?;
            Ok(each(&modules, window.as_ref()))
        };
        schedule::for_each_independent(parts, &workers, &stop, read)
            .map_err(|error| GroundError::from_schedule(&tiles, error))
    }

    /// What limits count, in every load module and window.
    ///
    /// # Panics
    /// When only a part was read.
    pub fn limit_use(&self) -> LimitUse {
        assert_eq!(self.part, self.grid.all(), "windows are counted over the whole area");
        let modules: Vec<u32> = self.modules.iter().map(|module| self.job.counted(module)).collect();
        let window = self.job.limits.window;
        let windows = terrain::limits::Windows::of_size(self.grid, window.rows, window.cols);
        LimitUse { windows: windows.sums(self.grid, &modules), modules, window: [windows.rows, windows.cols] }
    }
}

impl<'a> WantedGround<'a> {
    /// The ground, and what it is called; `own` is what was opened for it.
    fn held(self, own: &'a Option<(Ground, String)>, opened: &'a Opened) -> Option<(&'a Ground, &'a str)> {
        match self {
            WantedGround::Open(ground) => Some((ground, &opened.job.area.name)),
            _ => own.as_ref().map(|(ground, name)| (ground, name.as_str())),
        }
    }
}

/// The ground where it is wanted and not open yet, and what it is called.
fn open_ground(
    opened: &Opened,
    wanted: WantedGround,
    (workers, stop): (&Workers, &AtomicBool),
) -> Result<Option<(Ground, String)>, ProductError> {
    let Opened { folder, manifest, job, area } = opened;
    let paths = match wanted {
        WantedGround::None | WantedGround::Open(_) => return Ok(None),
        WantedGround::Recorded => &[],
        WantedGround::Rasters(paths) => paths,
    };
    let mut job = job.clone();
    // No weight changes a height.
    job.importance.areas.clear();
    let name = choose_ground(&mut job, manifest, folder.dir(), paths)?;
    Ok(Some((Ground::open_built(&job, area, (workers, stop), folder)?, name)))
}

fn check_part(part: ModuleRect, area: &GamingArea) -> Result<(), ProductError> {
    let (rows, cols) = (area.grid.rows, area.grid.cols);
    if part.south < part.north && part.west < part.east && part.north <= rows && part.east <= cols {
        return Ok(());
    }
    Err(ProductError::impossible(
        "load modules",
        format!("{},{} to {},{}", part.south, part.west, i64::from(part.north) - 1, i64::from(part.east) - 1),
        format!("rows from 0 to {} and columns from 0 to {}", rows - 1, cols - 1),
        "rows come first and both count from the south-west",
    ))
}

fn check_complete(modules: &[LoadModule], part: ModuleRect, folder: &Folder) -> Result<(), ProductError> {
    if modules.len() == part.count() {
        return Ok(());
    }
    Err(ProductError::impossible(
        folder.dir().display().to_string(),
        format!("{} load modules in its files", modules.len()),
        format!("{}", part.count()),
        "the database is damaged: `tiefort verify` says where, `tiefort build --fresh` makes it anew",
    ))
}

/// One tile's share of a part.
struct TilePiece {
    modules: Vec<LoadModule>,
    ground: Option<Piece>,
}

/// Ground of a rectangle and the residuals of the posts in it, row by row from the south-west.
struct Piece {
    dem: Dem,
    residuals: Vec<i32>,
}

fn read_tile(
    Opened { folder, manifest, area, .. }: &Opened,
    ground: Option<&Ground>,
    part: ModuleRect,
    tile: TileId,
) -> Result<TilePiece, ProductError> {
    let inside = area.tiling.modules(tile, area.grid).intersection(part).expect("only tiles of the part are read");
    let modules = folder.read_part(manifest, tile, part)?.1.swap_remove(0);
    let ground = match ground {
        Some(ground) => {
            let rect = area.grid.posts_of_rect(inside);
            // Nothing is kept that no stage needs again.
            let made = ground.made(area, tile).filter(|_| rect == area.tiling.rect(tile));
            let window = made.map_or_else(|| ground.window(rect).map(Arc::new), Ok)?;
            Some(measured(&modules, &window, area, part))
        }
        None => None,
    };
    Ok(TilePiece { modules, ground })
}

fn measured(modules: &[LoadModule], window: &Window, area: &GamingArea, part: ModuleRect) -> Piece {
    let rect = window.dem.rect();
    let mut residuals = vec![NO_RESIDUAL; rect.post_count()];
    // Posts on the northern and eastern side of the part have no owner in it, unless they lie on the area's border.
    let grid = ModuleGrid { rows: part.north, cols: part.east, side_cells: area.grid.side_cells };
    let measured = fidelity::Reference { grid, ..window.measured(area) };
    for module in modules {
        each_residual(module, &measured, |post, residual| residuals[place(rect, post)] = residual);
    }
    Piece { dem: window.dem.clone(), residuals }
}

fn place(rect: PostRect, post: Post) -> usize {
    (post.row - rect.south) as usize * rect.posts_wide() + (post.col - rect.west) as usize
}

/// Puts the pieces of tiles together; a line that two share has the same heights in both, and its residuals in the one
/// that owns it.
fn join(pieces: &[Piece], rect: PostRect, name: String) -> ProductGround {
    let mut residuals = vec![NO_RESIDUAL; rect.post_count()];
    for piece in pieces {
        let own = piece.dem.rect();
        for (row, line) in (own.south..).zip(piece.residuals.chunks(own.posts_wide())) {
            let start = place(rect, Post::new(row, own.west));
            let known = residuals[start..start + line.len()].iter_mut().zip(line);
            known.filter(|(_, found)| **found != NO_RESIDUAL).for_each(|(slot, &found)| *slot = found);
        }
    }
    let holder =
        |post: Post| pieces.iter().find(|piece| piece.dem.rect().contains(post)).expect("pieces cover the part");
    let dem = if pieces.iter().all(|piece| piece.dem.void_count() == 0) {
        Dem::from_row_fn(rect, |row, heights| {
            for own in pieces.iter().map(|piece| &piece.dem).filter(|dem| has_row(dem, row)) {
                let west = (own.rect().west - rect.west) as usize;
                heights[west..west + own.rect().posts_wide()].copy_from_slice(own.row(row));
            }
        })
    } else {
        let height = |post: Post| Some(&holder(post).dem).filter(|dem| !dem.is_void(post)).map(|dem| dem.height(post));
        let mut dem = Dem::from_fn(rect, height);
        dem.fill_voids(|post| holder(post).dem.height(post));
        dem
    };
    ProductGround { dem, residuals, name }
}

fn has_row(dem: &Dem, row: i32) -> bool {
    dem.rect().south <= row && row <= dem.rect().north
}
