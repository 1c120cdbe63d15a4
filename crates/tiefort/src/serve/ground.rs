//! Load modules in memory, in blocks of 16 x 16: those that were asked for longest ago make place for others.

use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use axum::http::StatusCode;
use load_module_reader::{Area, Block, Keep, LoadedGround, ReadError, TileFile};
use lru::LruCache;

use super::refusal::Refusal;
use crate::contents::Contents;

/// Load modules along a side of a block.
const SIDE: u32 = 16;
/// Blocks in memory at most: 16,384 load modules, about 0.4 GB of those with 100 polygons.
const BLOCKS_MAX: NonZeroUsize = NonZeroUsize::new(64).expect("it is not zero");
/// Load modules in a block around a line of sight at most, 64 km a side where they are 500 m wide.
const AROUND_LINE_MAX: usize = 1 << 14;

/// Level, then row and column of a block.
type Key = (u16, u32, u32);
type Loading = Arc<OnceLock<Result<LoadedGround, Refusal>>>;

/// Load modules in memory.
pub struct Ground {
    blocks: Mutex<LruCache<Key, Loading>>,
}

impl Default for Ground {
    fn default() -> Self {
        Self { blocks: Mutex::new(LruCache::new(BLOCKS_MAX)) }
    }
}

impl Ground {
    /// The block of this key, read once however many ask for it.
    fn block(&self, of: &Contents, key: Key) -> Result<Loading, Refusal> {
        let lock = || self.blocks.lock().unwrap_or_else(PoisonError::into_inner);
        let loading = Arc::clone(lock().get_or_insert(key, Loading::default));
        if let Err(refusal) = loading.get_or_init(|| load(of, key)) {
            // Another try may find it mended.
            lock().pop(&key);
            return Err(refusal.clone());
        }
        Ok(loading)
    }

    /// Calls `each` for the ground under places, block by block, with the places of `places` that lie in it. Those
    /// outside the area are left out.
    ///
    /// # Errors
    /// When there is no such level, or a file cannot be read.
    pub fn under(
        &self,
        of: &Contents,
        level: u16,
        places: &[[f64; 2]],
        mut each: impl FnMut(&LoadedGround, &[usize]),
    ) -> Result<(), Refusal> {
        check_level(of, level)?;
        let key = |place: &[f64; 2]| of.frame.module_under(*place).map(|[row, col]| (level, row / SIDE, col / SIDE));
        let mut keyed: Vec<(Key, usize)> =
            (0..).zip(places).filter_map(|(index, place)| Some((key(place)?, index))).collect();
        keyed.sort_unstable();
        for group in keyed.chunk_by(|a, b| a.0 == b.0) {
            let indices: Vec<usize> = group.iter().map(|(_, index)| *index).collect();
            let loading = self.block(of, group[0].0)?;
            if let Some(Ok(ground)) = loading.get() {
                each(ground, &indices);
            }
        }
        Ok(())
    }

    /// The ground around a line, or the same ground as before where that holds it.
    ///
    /// # Errors
    /// When there is no such level, the line is too long, or a file cannot be read.
    pub fn around(
        &self,
        of: &Contents,
        level: u16,
        ends: [[f64; 2]; 2],
        before: Option<LoadedGround>,
    ) -> Result<LoadedGround, Refusal> {
        let wanted = around(of, ends);
        let holds = |ground: &LoadedGround| {
            let held = ground.block();
            held.south <= wanted.south
                && held.west <= wanted.west
                && wanted.north <= held.north
                && wanted.east <= held.east
        };
        if let Some(ground) = before.filter(|ground| holds(ground)) {
            return Ok(ground);
        }
        check_level(of, level)?;
        if AROUND_LINE_MAX < wanted.count() {
            return Err(Refusal::new(
                StatusCode::UNPROCESSABLE_ENTITY,
                format!(
                    "found a line with {} load modules in the rectangle around it, expected at most {AROUND_LINE_MAX}",
                    wanted.count()
                ),
                "cut the line into pieces, and ask for each",
            ));
        }
        let mut modules = vec![None; wanted.count()];
        let blocks = |from: u32, to: u32| from / SIDE..to.div_ceil(SIDE);
        for (row, col) in blocks(wanted.south, wanted.north)
            .flat_map(|row| blocks(wanted.west, wanted.east).map(move |col| (row, col)))
        {
            let loading = self.block(of, (level, row, col))?;
            let Some(Ok(ground)) = loading.get() else { continue };
            for module in ground.modules() {
                let (row, col) = (module.module().row, module.module().col);
                if wanted.contains(row, col) {
                    modules[wanted.index(row, col)] = Some(Arc::clone(module));
                }
            }
        }
        let modules = modules.into_iter().flatten().collect();
        Ok(LoadedGround::of_modules(of.frame.clone(), level, wanted, modules))
    }
}

fn check_level(of: &Contents, level: u16) -> Result<(), Refusal> {
    match of.frame.level_count {
        count if level < count => Ok(()),
        1 => Err(Refusal::request(format!("found level {level}, expected 0, the only one"), "leave level out")),
        count => Err(Refusal::request(
            format!("found level {level}, expected 0 to {}", count - 1),
            "0 is the finest level of detail",
        )),
    }
}

/// The load modules of the area in the rectangle around a line, and one more on every side.
fn around(of: &Contents, ends: [[f64; 2]; 2]) -> Block {
    let [from, to] = ends.map(|end| of.frame.module_at(end));
    let range = |axis: usize, count: u32| {
        let clamped = |index: i64| index.clamp(0, i64::from(count)) as u32;
        let (low, high) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
        let (low, high) = (clamped(low.saturating_sub(1)), clamped(high.saturating_add(2)));
        (low, high.max(low))
    };
    let ((south, north), (west, east)) = (range(0, of.frame.rows), range(1, of.frame.cols));
    Block { south, west, north, east }
}

fn load(of: &Contents, (level, row, col): Key) -> Result<LoadedGround, Refusal> {
    let block = Block {
        south: row * SIDE,
        west: col * SIDE,
        north: ((row + 1) * SIDE).min(of.frame.rows),
        east: ((col + 1) * SIDE).min(of.frame.cols),
    };
    let files = of.files_of(block).map_err(Refusal::of)?;
    let open = || {
        let files =
            files.iter().map(|file| TileFile::open(&file.path, Keep::OnDisk)).collect::<Result<_, ReadError>>()?;
        Area::of_files(files)?.load_level(block, level)
    };
    open().map_err(|error| Refusal::later(error.to_string(), "`tiefort verify` says what is damaged"))
}
