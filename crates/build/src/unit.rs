//! One unit of a build's work, for processes that share a directory: idempotent, and it reads only what is published.
//!
//! A unit that is done leaves a mark with the fingerprint of what it published. What builds on it compares mark and
//! file, and takes the mark back if they differ. `publish` walks through all stages again, keeps what is fresh and
//! makes what is not, so whatever went wrong before, the result is that of a build.
//!
//! A process joins the build that is under way, or begins it where no other is at work.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use job::Job;
use schedule::Workers;
use store::engine::{Fingerprint, Outcome, Stamp};
use store::{Area, Database, DatabaseError, Folder, Manifest, ManifestState, Profile, SourceRecord, Work};
use terrain::{LatticePoint, TileId, TileTin};

use crate::assemble::assemble_tile;
use crate::build::{Built, finish, fresh, open_with};
use crate::curves::Curves;
use crate::level::level_area;
use crate::order::{ORDER, Unit, around, needs, units};
use crate::outlines::outlines_area;
use crate::profile::profile_tile;
use crate::publish::beginning_of;
use crate::refine::{Published, refine_tile};
use crate::run::{ALGORITHM_REVISION, Options, Run, run_name};
use crate::survey::{allocate, survey_tile};
use crate::tasks::{inherited, is_surveyed};
use crate::{Clock, CompileError, Event, Progress, Stage, Stopwatch};

/// A process's part in a build that several processes share.
pub(crate) struct Session<'a> {
    pub run: Run<'a>,
    pub work: Work,
    /// Whether it was complete and fresh when this process came to it.
    pub is_finished: bool,
}

impl<'a> Session<'a> {
    /// Joins the build of `job` in `folder`, or begins it.
    pub fn join(
        job: &'a Job,
        folder: &Folder,
        options: &Options<'a>,
        progress: &mut dyn Progress,
    ) -> Result<Self, CompileError> {
        let mut is_finished = false;
        let run = open_with(job, options, progress, |area, records| {
            let entered = enter(job, records, folder, area, options.clock)?;
            is_finished = entered.is_finished;
            Ok((entered.database, Some(entered.manifest)))
        })?;
        let name = run_name(&job.canonical_text(), &run.records, ALGORITHM_REVISION);
        let work = if is_finished { run.database.folder().work(&name) } else { run.database.work(&name)? };
        Ok(Self { run, work, is_finished })
    }

    /// Every unit but the last, in an order in which one process could do them.
    pub fn units(&self) -> Vec<Unit> {
        let before = ORDER.into_iter().filter(|&stage| stage != Stage::Publish);
        before.flat_map(|stage| units(stage, self.run.job, &self.run.area)).collect()
    }

    /// The units that one needs done.
    pub fn needs(&self, unit: Unit) -> Vec<Unit> {
        needs(unit, self.run.job, &self.run.area)
    }

    /// Does a unit that is not the last, and marks it as done. A panic in it is an error that names the tile.
    pub fn perform(&mut self, unit: Unit, progress: &mut dyn Progress) -> Result<(), CompileError> {
        let missing = self.needs(unit).into_iter().find(|&need| self.work.marks().marked(&need.to_string()).is_none());
        if let Some(need) = missing {
            return Err(not_ready(unit, need));
        }
        let Unit { stage, tile } = unit;
        let is_joint = self.run.job.counts_objects();
        let before_ground = matches!(stage, Stage::Profile | Stage::Level);
        if !before_ground && (stage != Stage::Outlines || is_joint) {
            self.take_features(unit)?;
        }
        if stage == Stage::Assemble || is_joint && !before_ground && stage != Stage::Outlines {
            self.take_outlines(unit)?;
        }
        if let Some(tile) = tile {
            progress.tell(Event::Started(stage, tile));
        }
        let here = [tile.unwrap_or(TileId { row: 0, col: 0 })];
        let done = schedule::for_each_independent(&here, &Workers::new(1), self.run.stop, |_, _| self.make(unit));
        if let Err(error) = done {
            let error = CompileError::from_schedule(stage, &here, error);
            return Err(if self.has_damaged_lines() { self.spoilt(unit, Unit::whole(Stage::Level)) } else { error });
        }
        if let Some(tile) = tile {
            progress.tell(Event::Done(stage, tile));
        }
        Ok(())
    }

    fn make(&self, unit: Unit) -> Result<(), CompileError> {
        let fingerprint = match (unit.stage, unit.tile) {
            (Stage::Profile, Some(tile)) => profile_tile(&self.run, tile)?.into_inner().0.blake3,
            (Stage::Level, None) => self.level()?,
            (Stage::Outlines, None) => outlines_area(&self.run)?.into_inner().0.blake3,
            (Stage::Survey, Some(tile)) => survey_tile(&self.run, tile)?.into_inner().0.fingerprint,
            (Stage::Allocate, None) => self.allocate()?,
            (Stage::Refine, Some(tile)) => self.refine(tile)?.into_inner().stamp.fingerprint,
            (Stage::Assemble, Some(tile)) => self.assemble(tile)?,
            _ => unreachable!("{unit} is no unit that a process does by itself"),
        };
        Ok(self.work.marks().mark(&unit.to_string(), fingerprint)?)
    }

    /// Takes over what features came to, where there are any, as another unit has published it.
    fn take_features(&mut self, unit: Unit) -> Result<(), CompileError> {
        if self.run.job.features.is_none() || self.run.level.is_some() {
            return Ok(());
        }
        let level = Unit::whole(Stage::Level);
        let marked = self.work.marks().marked(&level.to_string());
        match self.run.database.folder().read_level() {
            Ok((_, file, read)) if Some(file.blake3) == marked => {
                self.run.settle(file, read);
                Ok(())
            }
            _ => Err(self.spoilt(unit, level)),
        }
    }

    /// Takes over what stands on the ground, where anything does, as another unit has published it.
    fn take_outlines(&mut self, unit: Unit) -> Result<(), CompileError> {
        if self.run.job.objects.is_none() || self.run.outlines.is_some() {
            return Ok(());
        }
        let outlines = Unit::whole(Stage::Outlines);
        let marked = self.work.marks().marked(&outlines.to_string());
        match self.run.database.folder().read_outlines() {
            Ok((_, file, read)) if Some(file.blake3) == marked => {
                self.run.stand(file, read);
                Ok(())
            }
            _ => Err(self.spoilt(unit, outlines)),
        }
    }

    /// Whether what features put into a tile is no longer what `level` published. It is read in the middle of every
    /// later stage, so a unit that failed asks afterwards.
    fn has_damaged_lines(&self) -> bool {
        let folder = self.run.database.folder();
        self.run.level.as_ref().is_some_and(|settled| {
            let mut lines = self.run.area.tiles.iter().zip(&settled.level.tiles);
            lines.any(|(&tile, stamp)| folder.check_file(&folder.lines_path(tile), stamp).is_err())
        })
    }

    fn level(&self) -> Result<Fingerprint, CompileError> {
        let profile = |&tile: &TileId| {
            let unit = Unit::of(Stage::Profile, tile);
            match self.run.database.folder().read_profile(tile) {
                Ok((_, file, profile)) if Some(file.blake3) == self.work.marks().marked(&unit.to_string()) => {
                    Ok(profile)
                }
                _ => Err(self.spoilt(Unit::whole(Stage::Level), unit)),
            }
        };
        let profiles: Vec<Profile> = self.run.area.tiles.iter().map(profile).collect::<Result<_, _>>()?;
        Ok(level_area(&self.run, &profiles)?.into_inner().0.blake3)
    }

    fn allocate(&self) -> Result<Fingerprint, CompileError> {
        let run = &self.run;
        let curve = |tile: TileId| {
            let unit = Unit::of(Stage::Survey, tile);
            match run.database.folder().read_curve(tile) {
                Ok((stamp, curve)) if Some(stamp.fingerprint) == self.work.marks().marked(&unit.to_string()) => {
                    Ok(curve)
                }
                _ => Err(self.spoilt(Unit::whole(Stage::Allocate), unit)),
            }
        };
        let curves = is_surveyed(run.job).then(|| Curves::published(run, curve)).transpose()?;
        let shares = allocate(run, curves.as_ref(), &mut Silent)?;
        for (&tile, budget) in run.area.tiles.iter().zip(&shares.tiles) {
            self.work.write_share(tile, budget)?;
        }
        Ok(Fingerprint::of_bytes(b"allocated"))
    }

    fn refine(&self, tile: TileId) -> Result<Outcome<Published>, CompileError> {
        let unit = Unit::of(Stage::Refine, tile);
        let share = self.work.read_share(tile).map_err(|_| self.spoilt(unit, Unit::whole(Stage::Allocate)))?;
        let features = self.run.tile_features(tile)?;
        let published = |other| Ok(self.published_tile(unit, other)?.1);
        let seeds = inherited(&self.run.area.tiling, tile, &features.kept, published)?;
        refine_tile(&self.run, &share, seeds, tile)
    }

    fn assemble(&self, tile: TileId) -> Result<Fingerprint, CompileError> {
        let area = &self.run.area;
        let mut near = BTreeMap::new();
        for other in around(tile, self.run.job, &self.run.area) {
            let (stamp, tin) = self.published_tile(Unit::of(Stage::Assemble, tile), other)?;
            self.run.tins.keep(stamp, tin);
            near.insert(area.tiling.index(other), stamp);
        }
        let none: Vec<Vec<LatticePoint>> = vec![Vec::new(); area.tiles.len()];
        let (assembled, _) = assemble_tile(&self.run, &|index| near[&index], &none, tile)?.into_inner();
        Ok(assembled.file.blake3)
    }

    /// The TIN of a tile that is marked as done, as it lies on the disk.
    fn published_tile(&self, unit: Unit, tile: TileId) -> Result<(Stamp, Arc<TileTin>), CompileError> {
        match self.run.database.folder().read_tile(tile) {
            Ok((stamp, tin))
                if Some(stamp.fingerprint) == self.work.marks().marked(&Unit::of(Stage::Refine, tile).to_string()) =>
            {
                Ok((stamp, Arc::new(tin)))
            }
            _ => Err(self.spoilt(unit, Unit::of(Stage::Refine, tile))),
        }
    }

    /// Takes back the mark of a unit whose result is not what it was, so that it is done again.
    fn spoilt(&self, unit: Unit, need: Unit) -> CompileError {
        self.work.marks().unmark(&need.to_string());
        not_ready(unit, need)
    }

    /// Removes what processes left that were ended before they could: nothing of it is needed once the build is
    /// published.
    pub fn sweep(&self) -> Result<(), CompileError> {
        self.work.sweep();
        Ok(self.run.database.sweep()?)
    }

    /// The build that some process has published, once that is swept up.
    pub fn published(self) -> Result<Built, CompileError> {
        self.sweep()?;
        let Run { database, area, .. } = self.run;
        let report = database.folder().report()?;
        Ok(Built { report, kept: area.tiles.len(), rebuilt: 0, is_unchanged: true, database })
    }

    /// Declares the database complete, after whatever is still to be done.
    pub fn publish(self, progress: &mut Stopwatch) -> Result<Built, CompileError> {
        self.run.database.sweep()?;
        finish(self.run, progress)
    }
}

fn not_ready(unit: Unit, need: Unit) -> CompileError {
    CompileError::NotReady { unit: unit.to_string(), needs: need.to_string() }
}

/// What came of a unit of work.
#[derive(Debug)]
pub enum UnitEnd {
    /// It is done, and so are others like it.
    Done,
    /// The database was finished and fresh already.
    Finished(Box<Built>),
    /// It published the database.
    Published(Box<Built>),
}

/// Does units of work on the build of `job` in `folder`, in this order.
///
/// # Errors
/// As a build; [`CompileError::NotReady`] when what one needs is not done yet, which is worth trying again.
pub fn perform(
    job: &Job,
    folder: impl Into<Folder>,
    units: &[Unit],
    options: &Options,
    progress: &mut dyn Progress,
) -> Result<UnitEnd, CompileError> {
    let progress = &mut Stopwatch::start(options.clock, progress);
    let mut session = Session::join(job, &folder.into(), options, progress)?;
    if session.is_finished {
        return Ok(UnitEnd::Finished(Box::new(session.published()?)));
    }
    for &unit in units {
        if unit.stage == Stage::Publish {
            return Ok(UnitEnd::Published(Box::new(session.publish(progress)?)));
        }
        session.perform(unit, progress)?;
    }
    Ok(UnitEnd::Done)
}

/// Listens to nothing.
struct Silent;

impl Progress for Silent {
    fn tell(&mut self, _event: Event) {}
}

/// How often a process asks that wants to begin a build, and how long it waits in between: others that come at the same
/// moment stand in its way for an instant only.
const TRIES: usize = 100;
const PAUSE: Duration = Duration::from_millis(20);

/// A database that this process shares.
struct Entered {
    pub database: Database,
    /// What `database.json` says.
    pub manifest: Manifest,
    /// Whether there is nothing to do.
    pub is_finished: bool,
}

/// Shares the database in `folder`, in which a build of this job from these sources is under way or finished when this
/// returns. It is begun by a process that is alone there: so nothing of another build, not even by a process that
/// is only slow, comes between its files.
///
/// # Errors
/// [`CompileError::OtherRun`] while processes build something else there; others as for a build.
fn enter(
    job: &Job,
    records: &[SourceRecord],
    folder: &Folder,
    area: &Area,
    clock: &dyn Clock,
) -> Result<Entered, CompileError> {
    let canonical = job.canonical_text();
    let is_ours = |manifest: &Manifest| {
        manifest.job == canonical && manifest.algorithm_revision == ALGORITHM_REVISION && manifest.sources == records
    };
    let is_under_way = |manifest: &Manifest| is_ours(manifest) && manifest.state == ManifestState::Incomplete;
    for tries_left in (0..TRIES).rev() {
        let (database, previous) = match Database::join(folder, area) {
            // By another process that begins it, or by a build, which stays longer.
            Err(DatabaseError::Locked { .. }) if 0 < tries_left => {
                clock.wait(PAUSE);
                continue;
            }
            joined => joined?,
        };
        if let Some(manifest) = previous {
            let is_finished = fresh(database.folder(), &manifest, job, records)?.is_some();
            if is_finished || is_under_way(&manifest) {
                return Ok(Entered { database, manifest, is_finished });
            }
        }
        drop(database);
        match Database::create_or_open(folder, area) {
            Ok((_, Some(manifest))) if is_under_way(&manifest) => {}
            Ok((database, Some(previous))) if previous.area != *area => {
                database.begin_afresh(&beginning_of(job, records, None))?;
            }
            Ok((database, previous)) => database.begin(&beginning_of(job, records, previous.as_ref()))?,
            Err(DatabaseError::Locked { .. }) => clock.wait(PAUSE),
            Err(error) => return Err(error.into()),
        }
    }
    Err(CompileError::OtherRun { path: folder.dir().display().to_string() })
}
