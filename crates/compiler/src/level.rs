//! The stage `level`: how high all features of the area lie, and what they put into each tile. It sees profiles and
//! features, never a raster.

use database::{AreaLevel, FileStamp};
use engine::{Artifact, Key, Outcome, Stamp, keep_or_make};
use features::Cost;
use job::FeaturesSpec;
use limits::start_triangles;
use terrain::{ModuleId, TileId};

use crate::keys;
use crate::pieces::{area_level, pieces, reserved};
use crate::profile::profile_tile;
use crate::read_features::ReadFeatures;
use crate::run::{ALGORITHM_REVISION, Run};
use crate::{CompileError, Event, Progress, Stage};

/// Decides all heights of features, or keeps what is published and fresh.
pub(crate) fn level(run: &Run, progress: &mut dyn Progress) -> Result<(FileStamp, AreaLevel), CompileError> {
    progress.tell(Event::Enter(Stage::Level, 0));
    let (file, level) = level_area(run)?.into_inner();
    progress.tell(Event::Leave(Stage::Level));
    level.notes.iter().for_each(|note| progress.tell(Event::Note(note.clone())));
    Ok((file, level))
}

/// The same, with the bytes that say so.
pub(crate) fn level_area(run: &Run) -> Result<Outcome<(FileStamp, AreaLevel)>, CompileError> {
    let (read, spec) = (run.features()?, run.job.features.as_ref().expect("a stage of jobs with features"));
    let mut ground = vec![None; read.features.stations().len()];
    for (&tile, stations) in run.area.tiles.iter().zip(&read.by_tile) {
        let (_, profile) = profile_tile(run, tile)?.into_inner();
        stations.iter().zip(profile.heights).for_each(|(&station, height)| ground[station as usize] = height);
    }
    keep_or_make(&Levelling { run, read: &read, spec, ground: &ground }, ALGORITHM_REVISION)
}

/// What features of the area come to, as the engine asks for it.
struct Levelling<'a> {
    run: &'a Run<'a>,
    read: &'a ReadFeatures,
    spec: &'a FeaturesSpec,
    ground: &'a [Option<i32>],
}

impl Artifact for Levelling<'_> {
    type Output = (FileStamp, AreaLevel);
    type Error = CompileError;

    fn key(&self) -> Key {
        keys::level(self.run.job, &self.run.area.budget, &self.run.records, self.read.seen(), self.ground)
    }

    fn published(&self) -> Result<Option<Stamp>, CompileError> {
        Ok(self.run.database.folder().level_stamp()?)
    }

    fn read(&self, _key: &Key) -> Option<(Stamp, (FileStamp, AreaLevel))> {
        let folder = self.run.database.folder();
        let (stamp, file, level) = folder.read_level().ok()?;
        let tiles = &self.run.area.tiles;
        let is_whole =
            |(&tile, stamp): (&TileId, &FileStamp)| folder.check_file(&folder.lines_path(tile), stamp).is_ok();
        let has_all = level.tiles.len() == tiles.len() && tiles.iter().zip(&level.tiles).all(is_whole);
        has_all.then_some((stamp, (file, level)))
    }

    fn make(&self, _key: &Key, stamp: &Stamp) -> Result<(FileStamp, AreaLevel), CompileError> {
        let Self { run, read, spec, ground } = *self;
        let levelled = read.features.level(ground, spec.options, &mut Shares::new(run, spec));
        let pieces = pieces(run, &read.features, &levelled.reserved.formed);
        let mut level = area_level(run, read, &levelled);
        level.reserved = reserved(run, &levelled.reserved.formed, &pieces);
        for piece in &pieces {
            level.tiles.push(run.database.write_lines(stamp, piece)?);
        }
        Ok((run.database.write_level(stamp, &level)?, level))
    }
}

/// What features may take of the limits: of each load module, of each window and of the area no more than their share,
/// and never more than what the points leave that every build starts from.
struct Shares<'a> {
    run: &'a Run<'a>,
    spec: &'a FeaturesSpec,
    /// Triangles of each load module, row-major.
    modules: Vec<u32>,
}

impl<'a> Shares<'a> {
    fn new(run: &'a Run<'a>, spec: &'a FeaturesSpec) -> Self {
        let budget = &run.area.budget;
        let room = |module: ModuleId| {
            let start = start_triangles(budget.grid, module, budget.border_step);
            share(spec, u64::from(budget.per_module), u64::from(start)) as u32
        };
        Self { run, spec, modules: budget.grid.all().iter().map(room).collect() }
    }
}

/// What features may take of a limit that a build begins with `start` of.
fn share(spec: &FeaturesSpec, limit: u64, start: u64) -> u64 {
    ((spec.share_max * limit as f64) as u64).min(limit.saturating_sub(start))
}

impl features::Room for Shares<'_> {
    fn of(&self, (row, col): (i32, i32)) -> u32 {
        let grid = self.run.area.grid;
        match (u32::try_from(row), u32::try_from(col)) {
            (Ok(row), Ok(col)) if row < grid.rows && col < grid.cols => self.modules[grid.index(ModuleId { row, col })],
            // Beyond the area nothing is built.
            _ => u32::MAX,
        }
    }

    fn narrow(&mut self, cost: &Cost) -> bool {
        let (area, grid) = (&self.run.area, self.run.area.grid);
        let taken: Vec<u32> = grid
            .all()
            .iter()
            .map(|ModuleId { row, col }| cost.get(&(row as i32, col as i32)).map_or(0, |of| of.values().sum()))
            .collect();
        let start: Vec<u32> =
            grid.all().iter().map(|module| start_triangles(grid, module, area.budget.border_step)).collect();
        let total = |modules: &[usize], of: &[u32]| modules.iter().map(|&module| u64::from(of[module])).sum::<u64>();
        let mut narrowed = false;
        let mut hold = |modules: &[usize], limit: u64| {
            let room = share(self.spec, limit, total(modules, &start));
            if total(modules, &taken) <= room {
                return;
            }
            let level = level_of(modules.iter().map(|&module| taken[module]).collect(), room);
            for &module in modules.iter().filter(|&&module| level < taken[module]) {
                self.modules[module] = self.modules[module].min(level);
            }
            narrowed = true;
        };
        let windows = area.budget.windows;
        for origin in windows.origins.iter() {
            let modules: Vec<usize> = windows.modules_of(origin).iter().map(|module| grid.index(module)).collect();
            hold(&modules, u64::from(area.budget.per_window));
        }
        hold(&(0..grid.count()).collect::<Vec<usize>>(), area.budget.area);
        narrowed
    }
}

/// The greatest count to which all may be cut so that no more than `room` is left together.
fn level_of(mut counts: Vec<u32>, room: u64) -> u32 {
    counts.sort_unstable();
    let mut left = room;
    for (at, &count) in counts.iter().enumerate() {
        let each = left / (counts.len() - at) as u64;
        if each < u64::from(count) {
            return each as u32;
        }
        left -= u64::from(count);
    }
    u32::MAX
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_cut_to_one_level_that_leaves_no_more_than_there_is_room_for() {
        assert_eq!(level_of(vec![10, 2, 30], 21), 9);
        assert_eq!(level_of(vec![10, 2, 30], 42), u32::MAX);
        assert_eq!(level_of(vec![10, 10], 7), 3);
        assert_eq!(level_of(vec![1, 1, 1], 2), 0);
    }
}
