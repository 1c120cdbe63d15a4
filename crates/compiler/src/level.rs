//! The stage `level`: how high all features of the area lie, and what they put into each tile. It sees profiles and
//! features, never a raster.

use std::collections::BTreeSet;

use database::{AreaLevel, FileStamp, Profile};
use engine::{Artifact, Key, Outcome, Stamp, keep_or_make};
use features::Cost;
use job::FeaturesSpec;
use terrain::{ModuleId, TileId};

use crate::buildings::publish_buildings;
use crate::keys;
use crate::pieces::{area_level, pieces, reserved};
use crate::read_features::ReadFeatures;
use crate::run::{ALGORITHM_REVISION, Run};
use crate::{CompileError, Event, Progress, Stage};

/// Decides all heights of features, or keeps what is published and fresh. `profiles` has the ground by tile.
pub(crate) fn level(
    run: &Run,
    profiles: &[Profile],
    progress: &mut dyn Progress,
) -> Result<(FileStamp, AreaLevel), CompileError> {
    progress.tell(Event::Enter(Stage::Level, 0));
    let (file, level) = level_area(run, profiles)?.into_inner();
    progress.tell(Event::Leave(Stage::Level));
    level.notes.iter().for_each(|note| progress.tell(Event::Note(note.clone())));
    Ok((file, level))
}

/// The same, with the bytes that say so.
pub(crate) fn level_area(run: &Run, profiles: &[Profile]) -> Result<Outcome<(FileStamp, AreaLevel)>, CompileError> {
    let (read, spec) = (run.features()?, run.job.features.as_ref().expect("a stage of jobs with features"));
    let mut ground = vec![None; read.features.stations().len()];
    for (profile, stations) in profiles.iter().zip(&read.by_tile) {
        stations.iter().zip(&profile.heights).for_each(|(&station, &height)| ground[station as usize] = height);
    }
    publish_buildings(run, &read)?;
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
    /// Triangles that every build starts from, of each load module, row-major.
    start: Vec<u32>,
    /// Triangles that features may take, of each load module, row-major.
    modules: Vec<u32>,
}

impl<'a> Shares<'a> {
    fn new(run: &'a Run<'a>, spec: &'a FeaturesSpec) -> Self {
        let start = run.area.budget.start();
        let per_module = u64::from(run.area.budget.per_module);
        let modules = start.iter().map(|&start| share(spec, per_module, u64::from(start)) as u32).collect();
        Self { run, spec, start, modules }
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

    fn narrow(&mut self, cost: &Cost) {
        let (budget, grid) = (&self.run.area.budget, self.run.area.grid);
        let mut taken = self.taken(cost);
        let windows = budget.windows;
        let sums = windows.sums(grid, &taken).into_iter().zip(windows.sums(grid, &self.start));
        for (origin, (before, start)) in windows.origins.iter().zip(sums) {
            let room = share(self.spec, budget.per_window.into(), start.into());
            if room < u64::from(before) {
                let modules: Vec<usize> = windows.modules_of(origin).iter().map(|module| grid.index(module)).collect();
                self.hold(&modules, &mut taken, room);
            }
        }
        let total = |of: &[u32]| of.iter().map(|&count| u64::from(count)).sum::<u64>();
        let room = share(self.spec, budget.area, total(&self.start));
        if room < total(&taken) {
            self.hold(&(0..grid.count()).collect::<Vec<usize>>(), &mut taken, room);
        }
    }

    fn widen(&mut self, cost: &Cost, short: &BTreeSet<(i32, i32)>) -> bool {
        let (budget, grid) = (&self.run.area.budget, self.run.area.grid);
        let taken = self.taken(cost);
        let is_short: Vec<u32> =
            grid.all().iter().map(|of| u32::from(short.contains(&(of.row as i32, of.col as i32)))).collect();
        // What is left of a limit goes to all that are short of it alike, so that together they stay within it.
        let each = |taken: u64, start: u64, limit: u64, short: u64| {
            share(self.spec, limit, start).saturating_sub(taken).checked_div(short).unwrap_or(0)
        };
        let windows = budget.windows;
        let [of_taken, of_start, of_short] = [&taken, &self.start, &is_short].map(|of| windows.sums(grid, of));
        let total = |of: &[u32]| of.iter().map(|&count| u64::from(count)).sum::<u64>();
        let of_area = each(total(&taken), total(&self.start), budget.area, total(&is_short));
        let mut most = vec![of_area; grid.count()];
        for (at, origin) in windows.origins.iter().enumerate() {
            let [taken, start, short] = [of_taken[at], of_start[at], of_short[at]].map(u64::from);
            let of_window = each(taken, start, budget.per_window.into(), short);
            for module in windows.modules_of(origin).iter().map(|module| grid.index(module)) {
                most[module] = most[module].min(of_window);
            }
        }
        let mut widened = false;
        let per_module = u64::from(budget.per_module);
        for (at, room) in self.modules.iter_mut().enumerate() {
            // What has to give something back keeps to that.
            if is_short[at] == 1 && taken[at] <= *room {
                let own = share(self.spec, per_module, self.start[at].into());
                *room = own.min(u64::from(taken[at]) + most[at]) as u32;
                widened |= taken[at] < *room;
            }
        }
        widened
    }
}

impl Shares<'_> {
    /// Leaves several load modules no more than `room` together: cuts the fullest of them to one level. What one
    /// window has cut counts as cut for the next.
    fn hold(&mut self, modules: &[usize], taken: &mut [u32], room: u64) {
        let level = level_of(modules.iter().map(|&module| taken[module]).collect(), room);
        for &module in modules {
            if level < taken[module] {
                taken[module] = level;
                self.modules[module] = self.modules[module].min(level);
            }
        }
    }

    /// Triangles that features take, of each load module, row-major.
    fn taken(&self, cost: &Cost) -> Vec<u32> {
        let of = |ModuleId { row, col }: ModuleId| cost.get(&(row as i32, col as i32));
        self.run.area.grid.all().iter().map(|of_| of(of_).map_or(0, |classes| classes.values().sum())).collect()
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
