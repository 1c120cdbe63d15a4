//! The stage `level`: how high all features of the area lie, and what they put into each tile. It sees profiles and
//! features, never a raster.

use features::{Share, Shares, Sounded};
use job::FeaturesSpec;
use store::engine::{Artifact, Key, Outcome, Stamp, keep_or_make};
use store::{AreaLevel, FileStamp, Profile};
use terrain::TileId;
use tin::tiling::Budget;

use crate::buildings::publish_buildings;
use crate::heard::Heard;
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
    let heard = Heard::of(&read, profiles.iter());
    publish_buildings(run, &read)?;
    keep_or_make(&Levelling { run, read: &read, spec, sounded: heard.sounded() }, ALGORITHM_REVISION)
}

/// What features of the area come to, as the engine asks for it.
struct Levelling<'a> {
    run: &'a Run<'a>,
    read: &'a ReadFeatures,
    spec: &'a FeaturesSpec,
    sounded: Sounded<'a>,
}

impl Artifact for Levelling<'_> {
    type Output = (FileStamp, AreaLevel);
    type Error = CompileError;

    fn key(&self) -> Key {
        keys::level(self.run.job, &self.run.area.budget, &self.run.records, self.read.seen(), self.sounded)
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
        let Self { run, read, spec, sounded } = *self;
        let shares = shares(&run.area.budget, spec);
        let levelled = read.features.level(sounded, (spec.options, spec.falls), &shares, &run.workers.each());
        let pieces = pieces(run, &read.features, &levelled);
        let mut level = area_level(run, read, &levelled);
        level.reserved = reserved(run, &levelled.reserved.formed, &pieces);
        for piece in &pieces {
            level.tiles.push(run.database.write_lines(stamp, piece)?);
        }
        Ok((run.database.write_level(stamp, &level)?, level))
    }
}

/// What features may take of the limits: of each load module, of each window and of the area no more than their share,
/// and never more than what the points leave that every build starts from. What features have already been granted is
/// not taken off: a worker that levels them again, because the level was lost after it had settled, grants the same.
pub(crate) fn shares(budget: &Budget, spec: &FeaturesSpec) -> Shares {
    let grid = budget.grid;
    let start = Budget { reserved: Vec::new(), ..budget.clone() }.start();
    let share = |limit: u64, start: u64| {
        let of = |share: f64| ((share * limit as f64) as u64).min(limit.saturating_sub(start));
        Share { main: of(spec.share_main.max(spec.share_max)), others: of(spec.share_max) }
    };
    let sums = budget.windows.sums(grid, &start);
    Shares {
        size: [grid.rows as i32, grid.cols as i32],
        window: [budget.windows.rows as i32, budget.windows.cols as i32],
        modules: start.iter().map(|&start| share(budget.per_module.into(), start.into())).collect(),
        windows: sums.into_iter().map(|start| share(budget.per_window.into(), start.into())).collect(),
        area: share(budget.area, start.iter().map(|&start| u64::from(start)).sum()),
    }
}
