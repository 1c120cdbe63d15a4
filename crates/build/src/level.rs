//! The stage `level`: how high all features of the area lie, and what they put into each tile. It sees profiles and
//! features, never a raster.
//!
//! Buildings of the sources are kept beside: they are drawn only, so no other stage asks for them.

use features::{Share, Shares, Sounded};
use job::{FeaturesSpec, Job};
use store::engine::{Artifact, Fingerprint, Key, Outcome, Stamp, keep_or_make};
use store::{AreaLevel, Building, FileStamp, Folder, Profile, SourceRecord, files};
use terrain::{TileId, in_turn};
use tin::tiling::Budget;

use crate::ground::GamingArea;
use crate::pieces::{area_level, pieces, reserved};
use crate::read_features::{Heard, ReadFeatures};
use crate::run::{ALGORITHM_REVISION, Run};
use crate::{CompileError, Event, Progress, Stage, keys};

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

/// The fingerprint of what features of an area come to, from their files, which `records` name, and from the ground
/// along them as it is published; `None` where that is not the ground along these features, or the job has none.
///
/// # Errors
/// When a file cannot be read.
pub fn level_fingerprint(
    job: &Job,
    area: &GamingArea,
    records: &[SourceRecord],
    folder: &Folder,
) -> Result<Option<Fingerprint>, CompileError> {
    let Some(read) = ReadFeatures::open(job, area, &in_turn)? else { return Ok(None) };
    let mut profiles = Vec::new();
    for (index, &tile) in area.tiles.iter().enumerate() {
        let (.., profile) = folder.read_profile(tile)?;
        let asked = [read.stations(index).len(), read.on_ways(index).len()];
        if asked != [profile.heights.len(), profile.middles.len()] {
            return Ok(None);
        }
        profiles.push(profile);
    }
    let heard = Heard::of(&read, profiles.iter());
    Ok(Some(keys::level(job, &area.budget, records, read.seen(), heard.sounded()).fingerprint()))
}

/// Publishes the buildings of a job that has some, or keeps what is published and fresh.
fn publish_buildings(run: &Run, read: &ReadFeatures) -> Result<(), CompileError> {
    if are_wanted(run) {
        keep_or_make(&Buildings { run, all: &read.vectors.buildings }, ALGORITHM_REVISION)?;
    }
    Ok(())
}

/// What `database.json` says of their file; nothing where the job wants none, and then none of an earlier job is left.
pub(crate) fn stamp_of_buildings(run: &Run) -> Result<Option<FileStamp>, CompileError> {
    if !are_wanted(run) {
        run.database.remove(files::BUILDINGS)?;
        return Ok(None);
    }
    let folder = run.database.folder();
    Ok(Some(folder.stamp_file(&folder.path(files::BUILDINGS))?))
}

fn are_wanted(run: &Run) -> bool {
    run.job.features.as_ref().is_some_and(job::FeaturesSpec::has_buildings)
}

/// The buildings of the area, as the engine asks for them.
struct Buildings<'a> {
    run: &'a Run<'a>,
    all: &'a [Building],
}

impl Artifact for Buildings<'_> {
    type Output = ();
    type Error = CompileError;

    fn key(&self) -> Key {
        keys::buildings(self.all)
    }

    fn published(&self) -> Result<Option<Stamp>, CompileError> {
        Ok(self.run.database.folder().buildings_stamp()?)
    }

    fn read(&self, _key: &Key) -> Option<(Stamp, ())> {
        let (stamp, _) = self.run.database.folder().read_buildings().ok()?;
        Some((stamp, ()))
    }

    fn make(&self, _key: &Key, stamp: &Stamp) -> Result<(), CompileError> {
        self.run.database.write_buildings(stamp, self.all)?;
        Ok(())
    }
}
