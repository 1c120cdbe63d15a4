//! One run: a job, its ground, its database, its workers; and how a stage goes through the tiles.
//!
//! TINs of tiles lie each in its file, those asked for last in memory too: a tile looks at its neighbours' borders
//! while it is refined, and at its own TIN when it is assembled; so a small area is never read back, and a large one
//! never takes more memory than this.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use job::{Budget as PointBudget, Edges, Job};
use lru::LruCache;
use schedule::{Event as Scheduled, RankedTasks, Workers, in_rank_order_observed};
use source_files::FileState;
use store::engine::{Cause, FingerprintBuilder, Outcome, Stamp};
use store::{AreaLevel, AreaOutlines, Database, DatabaseError, FileStamp, Folder, Manifest, RUN_DIGITS, SourceRecord};
use terrain::{ModuleId, POINT_COST, Post, Refusal, TileFeatures, TileId, TileTin, Vertex};
use tin::tiling::{Budget, outer_border_posts, outer_sides};

use crate::ground::{GamingArea, Ground, Window};
use crate::left_out::LeftOut;
use crate::read_features::ReadFeatures;
use crate::{Clock, CompileError, Event, Progress, Stage};

/// Rises whenever the result of any stage may change for the same input; a test with golden hashes holds it.
pub const ALGORITHM_REVISION: u32 = 22;

/// What a run needs from its caller.
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// Tiles at once.
    pub workers: usize,
    /// Start over, whatever is published.
    pub fresh: bool,
    /// Whether the report's page is drawn; without it, that of an earlier build goes.
    pub page: bool,
    /// Raised to ask the run to stop after the tiles in progress.
    pub stop: &'a AtomicBool,
    /// What time it is.
    pub clock: &'a dyn Clock,
}

impl<'a> Options<'a> {
    /// Those of a build that goes on from what is there, on so many workers.
    pub fn new(workers: usize, stop: &'a AtomicBool, clock: &'a dyn Clock) -> Self {
        Self { workers, fresh: false, page: true, stop, clock }
    }
}

/// Everything a stage may look at.
pub(crate) struct Run<'a> {
    pub job: &'a Job,
    pub area: GamingArea,
    pub ground: Ground,
    pub workers: Workers,
    pub page: bool,
    pub stop: &'a AtomicBool,
    pub database: Database,
    /// What the heights and weights are made from.
    pub records: Vec<SourceRecord>,
    /// What those files were like before they were hashed.
    pub states: Vec<FileState>,
    /// The TINs that this run has published or read.
    pub tins: Tins,
    /// What `database.json` said before this run.
    pub previous: Option<Manifest>,
    /// Roads, rivers and lakes, once they were asked for.
    pub read: OnceLock<Arc<ReadFeatures>>,
    /// What they came to, once that is decided.
    pub level: Option<Settled>,
    /// What stands on the ground, once that is decided, and the file that says so.
    pub outlines: Option<(FileStamp, Arc<AreaOutlines>)>,
}

/// What features came to, and the file that says so.
pub(crate) struct Settled {
    pub file: FileStamp,
    pub level: AreaLevel,
    /// What coarser levels leave out of them.
    pub left_out: Option<LeftOut>,
}

impl Run<'_> {
    /// Runs one task per tile in any order, and tells about each.
    pub fn for_each_tile<R: Send>(
        &self,
        stage: Stage,
        progress: &mut dyn Progress,
        task: impl Fn(TileId) -> Result<Outcome<R>, CompileError> + Sync,
    ) -> Result<Vec<Outcome<R>>, CompileError> {
        let alone = vec![Vec::new(); self.area.tiles.len()];
        let ranks: Vec<usize> = (0..alone.len()).collect();
        self.walk(stage, &RankedTasks::new(&ranks, &alone), progress, task)
    }

    /// Runs one task per tile, each after its lower-ranked neighbours, and tells about each.
    pub fn in_rank_order<R: Send>(
        &self,
        stage: Stage,
        progress: &mut dyn Progress,
        task: impl Fn(TileId) -> Result<Outcome<R>, CompileError> + Sync,
    ) -> Result<Vec<Outcome<R>>, CompileError> {
        self.walk(stage, &self.area.ranked_tasks(), progress, task)
    }

    fn walk<R: Send>(
        &self,
        stage: Stage,
        plan: &RankedTasks,
        progress: &mut dyn Progress,
        task: impl Fn(TileId) -> Result<Outcome<R>, CompileError> + Sync,
    ) -> Result<Vec<Outcome<R>>, CompileError> {
        let tiles = &self.area.tiles;
        progress.tell(Event::Enter(stage, tiles.len()));
        let observe = |event: Scheduled<Outcome<R>>| {
            // Of what other stages make nothing is written down by parts.
            if let Scheduled::Done(index, Outcome::Made(_, cause)) = &event
                && stage == Stage::Refine
                && *cause != Cause::New
            {
                progress.tell(Event::Because(stage, tiles[*index], cause.to_string()));
            }
            progress.tell(match event {
                Scheduled::Started(index) => Event::Started(stage, tiles[index]),
                Scheduled::Done(index, Outcome::Made(..)) => Event::Done(stage, tiles[index]),
                Scheduled::Done(index, Outcome::Kept(_)) => Event::Kept(stage, tiles[index]),
            });
        };
        let run = |index: usize| task(tiles[index]);
        let done = in_rank_order_observed(plan, &self.workers, self.stop, run, observe)
            .map_err(|error| CompileError::from_schedule(stage, tiles, error))?;
        progress.tell(Event::Leave(stage));
        Ok(done)
    }

    /// The TIN of a tile that is published with this stamp.
    pub fn tin(&self, tile: TileId, stamp: &Stamp) -> Result<Arc<TileTin>, CompileError> {
        Ok(self.tins.get(self.database.folder(), tile, stamp)?)
    }

    /// The features of a job that has some, read when they are first asked for.
    ///
    /// # Errors
    /// When a file of them cannot be read at all.
    pub fn features(&self) -> Result<Arc<ReadFeatures>, CompileError> {
        if let Some(read) = self.read.get() {
            return Ok(read.clone());
        }
        let read = ReadFeatures::open(self.job, &self.area, &self.workers.each())?;
        let read = read.expect("a stage of jobs with features");
        Ok(self.read.get_or_init(|| Arc::new(read)).clone())
    }

    /// From now on, features are part of the ground, and what they take of the limits is taken.
    pub fn settle(&mut self, file: FileStamp, level: AreaLevel) {
        let left_out_weight = self.job.features.as_ref().map_or(1.0, |spec| spec.left_out_weight);
        self.ground.burn_in(self.database.folder(), &self.area, left_out_weight);
        if self.job.objects.is_none() {
            self.read = OnceLock::new();
        }
        let left_out = LeftOut::of(self.job, &self.area, &level);
        self.level = Some(Settled { file, level, left_out });
        self.reserve();
    }

    /// From now on it is decided what stands on the ground, and what of it counts in the limits is taken from them.
    pub fn stand(&mut self, file: FileStamp, outlines: AreaOutlines) {
        self.read = OnceLock::new();
        self.outlines = Some((file, Arc::new(outlines)));
        self.reserve();
    }

    /// Triangles of each load module that features take, row by row; empty without features.
    pub fn reserved_by_features(&self) -> Vec<u32> {
        let count = self.area.grid.count();
        self.level.as_ref().map_or_else(Vec::new, |settled| settled.level.reserved_of(count))
    }

    /// Polygons of each load module that count in its limits beside those of the ground, row by row; empty where none
    /// do.
    pub fn joint_objects(&self) -> Vec<u32> {
        let outlines = self.outlines.as_ref().filter(|_| self.job.counts_objects());
        outlines.map_or_else(Vec::new, |(_, outlines)| outlines.counts(self.area.grid))
    }

    /// Takes from the limits what is decided already: features, objects, and points of a job on a fixed outer border,
    /// which stay where they do not fit and are a breach then.
    pub(crate) fn reserve(&mut self) {
        let (area, job) = (&self.area, self.job);
        let reserved = both(self.reserved_by_features(), self.joint_objects());
        let mut border = outer_border_posts(area.rect, outer_sides(area.rect, area.rect), job.outer_step_cells());
        border.sort_unstable();
        let (grid, side) = (area.grid, area.grid.side_cells);
        let is_corner = |post: &Post| post.row % side == 0 && post.col % side == 0;
        let is_more = |post: &Post| !is_corner(post) && border.binary_search(post).is_err();
        let mut given = Vec::new();
        for post in self.ground.given_outer_posts().filter(is_more) {
            let [row, col] = [(post.row, grid.rows), (post.col, grid.cols)].map(|(at, count)| {
                // What lies on the far border has no load module beyond it.
                ((at / side) as u32).min(count - 1)
            });
            given.resize(grid.count(), 0);
            given[grid.index(ModuleId { row, col })] += 1;
        }
        let with_given = Budget { reserved: both(reserved.clone(), given), ..area.budget.clone() };
        self.area.budget.reserved = if with_given.check().is_ok() { with_given.reserved } else { reserved };
    }

    /// What coarser levels leave out of features, in jobs where they do.
    pub fn left_out(&self) -> Option<&LeftOut> {
        self.level.as_ref()?.left_out.as_ref()
    }

    /// Whether features or water are burned into the sources' heights.
    pub fn burns_in(&self) -> bool {
        self.level.is_some() || self.job.dem.water.is_some()
    }

    /// What a person should know of what the run was made from.
    ///
    /// # Errors
    /// When what features put into a tile cannot be read.
    pub fn warnings(&self) -> Result<Vec<String>, CompileError> {
        let of_features = self.level.iter().flat_map(|settled| &settled.level.notes);
        let fewer = match self.job.tin.budget {
            PointBudget::Points(asked) => Some((asked, self.points_beside_features(asked))),
            PointBudget::Limits => None,
        };
        let fewer = fewer.filter(|(asked, fit)| fit < asked).map(|(asked, fit)| {
            format!(
                "tin.points: {asked} are asked for, and beside roads, water and objects {fit} fit \
                 limits.mean_per_load_module"
            )
        });
        let not_taken = self.ground.given_on_features(&self.area, &self.job.class_names())?;
        Ok(self.ground.warnings.iter().chain(of_features).cloned().chain(fewer).chain(not_taken).collect())
    }

    /// Of so many points that a job asks for, those that the limit of the area leaves room for beside features. Without
    /// features `plan` has made sure that all of them fit.
    pub fn points_beside_features(&self, asked: u64) -> u64 {
        let budget = &self.area.budget;
        if budget.reserved.is_empty() || self.job.modules.edges != Edges::Constrained {
            return asked;
        }
        asked.min(budget.area.saturating_sub(budget.start_total()) / u64::from(POINT_COST))
    }

    /// What features put into a tile; nothing in jobs without them.
    pub fn tile_features(&self, tile: TileId) -> Result<Arc<TileFeatures>, CompileError> {
        Ok(self.ground.features(tile)?)
    }

    /// The ground of a tile.
    pub fn window(&self, tile: TileId) -> Result<Arc<Window>, CompileError> {
        Ok(self.ground.tile(&self.area, tile)?)
    }
}

/// Sums of what is counted in each load module, of which either may be empty.
fn both(first: Vec<u32>, second: Vec<u32>) -> Vec<u32> {
    match (first.is_empty(), second.is_empty()) {
        (_, true) => first,
        (true, false) => second,
        (false, false) => first.iter().zip(second).map(|(first, second)| first + second).collect(),
    }
}

/// What a run is called in `work/`: equal for all processes that build the same from the same.
pub fn run_name(job: &str, sources: &[SourceRecord], revision: u32) -> String {
    let mut builder = FingerprintBuilder::new("run").text(job).number(u64::from(revision));
    for source in sources {
        builder = builder.text(&source.path).fingerprint(source.blake3);
    }
    builder.finish().to_string()[..RUN_DIGITS].to_owned()
}

/// Whether the files of a job are still what they were, or which is not.
///
/// # Errors
/// When a source is not what it was.
pub(crate) fn changed(states: &[FileState]) -> Result<(), CompileError> {
    states.iter().try_for_each(|state| Ok(state.check()?))
}

/// Bytes of TINs that are kept: some 150 tiles of 17 x 17 load modules with the paper's 32 triangles in each.
pub(crate) const KEPT_BYTES_MAX: usize = 32 << 20;

/// TINs by tile, for as long as there is room.
pub(crate) struct Tins {
    kept: Mutex<Kept>,
}

struct Kept {
    tins: LruCache<TileId, (Stamp, Arc<TileTin>)>,
    bytes: usize,
    bytes_max: usize,
}

impl Tins {
    /// None yet.
    pub fn new() -> Self {
        Self::of_bytes(KEPT_BYTES_MAX)
    }

    fn of_bytes(bytes_max: usize) -> Self {
        Self { kept: Mutex::new(Kept { tins: LruCache::unbounded(), bytes: 0, bytes_max }) }
    }

    /// Keeps a TIN that has just been published or read.
    pub fn keep(&self, stamp: Stamp, tin: Arc<TileTin>) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.bytes += bytes_of(&tin);
        if let Some((_, (_, before))) = kept.tins.push(tin.tile, (stamp, tin)) {
            kept.bytes -= bytes_of(&before);
        }
        while kept.bytes_max < kept.bytes {
            let Some((_, (_, oldest))) = kept.tins.pop_lru() else { break };
            kept.bytes -= bytes_of(&oldest);
        }
    }

    /// The TIN of a tile that is published with this stamp.
    ///
    /// # Errors
    /// When its file cannot be read, or was made from something else.
    pub fn get(&self, folder: &Folder, tile: TileId, stamp: &Stamp) -> Result<Arc<TileTin>, DatabaseError> {
        if let Some((kept, tin)) = self.kept.lock().unwrap_or_else(PoisonError::into_inner).tins.get(&tile)
            && kept == stamp
        {
            return Ok(tin.clone());
        }
        let (found, tin) = folder.read_tile(tile)?;
        if found != *stamp {
            let what = format!("found a TIN made from {}, expected {}", found.fingerprint, stamp.fingerprint);
            return Err(DatabaseError::Malformed { path: folder.tile_path(tile), section: "header", what });
        }
        let tin = Arc::new(tin);
        self.keep(found, tin.clone());
        Ok(tin)
    }
}

fn bytes_of(tile: &TileTin) -> usize {
    size_of::<TileTin>()
        + tile.tin.vertices.len() * size_of::<Vertex>()
        + tile.tin.triangles.len() * size_of::<[u32; 3]>()
        + tile.residuals.len() * size_of::<u32>()
        + tile.refused.len() * size_of::<Refusal>()
}

#[cfg(test)]
mod tests {
    use store::Fingerprint;
    use terrain::{PostRect, StopReason, Tin};

    use super::*;

    fn tin(col: u32) -> Arc<TileTin> {
        Arc::new(TileTin {
            tile: TileId { row: 0, col },
            tin: Tin::new(PostRect::of_size(3, 3), Vec::new(), Vec::new()),
            initial_count: 0,
            residuals: vec![0; 1000],
            triangles_charged: 0,
            refused: Vec::new(),
            stop: StopReason::Exhausted,
        })
    }

    #[test]
    fn the_tin_asked_for_longest_ago_makes_room() {
        let stamp = Stamp { algorithm_revision: 1, fingerprint: Fingerprint([1; 32]) };
        let nowhere = Folder::new(std::path::Path::new("not/there"));
        let tins = Tins::of_bytes(2 * bytes_of(&tin(0)));
        let is_there = |col| tins.get(&nowhere, TileId { row: 0, col }, &stamp).is_ok();
        tins.keep(stamp, tin(0));
        tins.keep(stamp, tin(1));
        tins.keep(stamp, tin(0));
        assert!(is_there(1) && is_there(0));
        tins.keep(stamp, tin(2));
        assert!(!is_there(1) && is_there(0) && is_there(2));
        let other = Stamp { algorithm_revision: 2, ..stamp };
        assert!(tins.get(&nowhere, TileId { row: 0, col: 0 }, &other).is_err(), "one made from something else");
    }
}
