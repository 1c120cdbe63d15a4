//! One unit of a build's work, for processes that share a directory: idempotent, and it reads only what is published.
//!
//! ```text
//!   survey r02c03 ─► allocate ─► refine r02c03 (after its lower-ranked neighbours) ─► assemble r02c03 ─► publish
//! ```
//! A unit that is done leaves a mark with the fingerprint of what it published. Whoever builds on it compares mark and
//! file, and takes the mark back if they differ. `publish` walks through all stages again, keeps what is fresh and
//! makes what is not, so whatever went wrong before, the result is that of a build.

use std::collections::BTreeMap;
use std::sync::Arc;

use database::{Folder, Share, ShareAllowance, Work};
use engine::{Fingerprint, Outcome, Stamp};
use job::{Edges, Job};
use limits::Allowance;
use schedule::Workers;
use terrain::{LatticePoint, ModuleRect, TileId, TileTin};

use crate::assemble::assemble_tile;
use crate::build::{Built, finish, open_with};
use crate::curves::Curves;
use crate::enter::enter;
use crate::refine::{Published, refine_tile};
use crate::run::{ALGORITHM_REVISION, Options, Run, run_name};
use crate::survey::{allocate, survey_tile};
use crate::tasks::{TileBudget, inherited, is_surveyed};
use crate::{CompileError, Event, Progress, Stage, Stopwatch};

/// One unit of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unit {
    /// What would more points gain in this tile?
    Survey(TileId),
    /// What may each tile spend?
    Allocate,
    /// A tile's TIN.
    Refine(TileId),
    /// A tile's load modules.
    Assemble(TileId),
    /// Everything that is left, and the declaration that the database is complete.
    Publish,
}

impl Unit {
    /// As marks and leases are named.
    pub fn name(self) -> String {
        match self {
            Unit::Survey(tile) => format!("survey-{tile}"),
            Unit::Allocate => "allocate".into(),
            Unit::Refine(tile) => format!("refine-{tile}"),
            Unit::Assemble(tile) => format!("assemble-{tile}"),
            Unit::Publish => "publish".into(),
        }
    }

    /// The stage it is part of, and its tile if it has one.
    pub fn stage(self) -> (Stage, Option<TileId>) {
        match self {
            Unit::Survey(tile) => (Stage::Survey, Some(tile)),
            Unit::Allocate => (Stage::Allocate, None),
            Unit::Refine(tile) => (Stage::Refine, Some(tile)),
            Unit::Assemble(tile) => (Stage::Assemble, Some(tile)),
            Unit::Publish => (Stage::Publish, None),
        }
    }
}

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
        let tiles = &self.run.area.tiles;
        let surveys = tiles.iter().filter(|_| is_surveyed(self.run.job)).map(|&tile| Unit::Survey(tile));
        let by_rank = self.run.area.by_rank().into_iter().map(|index| Unit::Refine(tiles[index]));
        let assembles = tiles.iter().map(|&tile| Unit::Assemble(tile));
        surveys.chain([Unit::Allocate]).chain(by_rank).chain(assembles).collect()
    }

    /// The units that one needs done.
    pub fn needs(&self, unit: Unit) -> Vec<Unit> {
        let tiling = &self.run.area.tiling;
        let all = || self.run.area.tiles.iter();
        match unit {
            Unit::Survey(_) => Vec::new(),
            Unit::Allocate if is_surveyed(self.run.job) => all().map(|&tile| Unit::Survey(tile)).collect(),
            Unit::Allocate => Vec::new(),
            Unit::Refine(tile) => {
                let lower = |other: &TileId| tiling.rank(*other) < tiling.rank(tile);
                let neighbours = tiling.neighbours(tile).into_iter().filter(lower).map(Unit::Refine);
                [Unit::Allocate].into_iter().chain(neighbours).collect()
            }
            Unit::Assemble(tile) => self.around(tile).into_iter().map(Unit::Refine).collect(),
            Unit::Publish => all().map(|&tile| Unit::Assemble(tile)).collect(),
        }
    }

    /// The tiles whose TINs the load modules of one are made from.
    fn around(&self, tile: TileId) -> Vec<TileId> {
        let mut around = match self.run.job.modules.edges {
            Edges::Constrained => Vec::new(),
            Edges::Clip(_) => self.run.area.tiling.neighbours(tile),
        };
        around.push(tile);
        around
    }

    /// Does a unit that is not the last, and marks it as done. A panic in it is an error that names the tile.
    pub fn perform(&self, unit: Unit, progress: &mut dyn Progress) -> Result<(), CompileError> {
        let missing = self.needs(unit).into_iter().find(|&need| self.work.marks().marked(&need.name()).is_none());
        if let Some(need) = missing {
            // A mark that a computer without power has left empty is there, but says nothing.
            return Err(self.spoilt(unit, need));
        }
        let (stage, tile) = unit.stage();
        if let Some(tile) = tile {
            progress.tell(Event::Started(stage, tile));
        }
        let here = [tile.unwrap_or(TileId { row: 0, col: 0 })];
        let done = schedule::for_each_independent(&here, &Workers::new(1), self.run.stop, |_, _| self.make(unit));
        done.map_err(|error| CompileError::from_schedule(stage, &here, error))?;
        if let Some(tile) = tile {
            progress.tell(Event::Done(stage, tile));
        }
        Ok(())
    }

    fn make(&self, unit: Unit) -> Result<(), CompileError> {
        let fingerprint = match unit {
            Unit::Survey(tile) => survey_tile(&self.run, tile)?.into_inner().0.fingerprint,
            Unit::Allocate => self.allocate()?,
            Unit::Refine(tile) => self.refine(tile)?.into_inner().stamp.fingerprint,
            Unit::Assemble(tile) => self.assemble(tile)?,
            Unit::Publish => unreachable!("publishing ends the session"),
        };
        Ok(self.work.marks().mark(&unit.name(), fingerprint)?)
    }

    fn allocate(&self) -> Result<Fingerprint, CompileError> {
        let run = &self.run;
        let curve = |tile: TileId| {
            let unit = Unit::Survey(tile);
            match run.database.folder().read_curve(tile) {
                Ok((stamp, curve)) if Some(stamp.fingerprint) == self.work.marks().marked(&unit.name()) => Ok(curve),
                _ => Err(self.spoilt(Unit::Allocate, unit)),
            }
        };
        let curves = is_surveyed(run.job).then(|| Curves::published(run, curve)).transpose()?;
        let shares = allocate(run, curves.as_ref(), &mut Nobody)?;
        for (&tile, budget) in run.area.tiles.iter().zip(&shares.tiles) {
            self.work.write_share(tile, &to_share(budget))?;
        }
        Ok(Fingerprint::of_bytes(b"allocated"))
    }

    fn refine(&self, tile: TileId) -> Result<Outcome<Published>, CompileError> {
        let unit = Unit::Refine(tile);
        let share = self.work.read_share(tile).map_err(|_| self.spoilt(unit, Unit::Allocate))?;
        let seeds = inherited(&self.run.area.tiling, tile, |other| Ok(self.published(unit, other)?.1))?;
        refine_tile(&self.run, &from_share(&share), seeds, tile)
    }

    fn assemble(&self, tile: TileId) -> Result<Fingerprint, CompileError> {
        let area = &self.run.area;
        let mut near = BTreeMap::new();
        for other in self.around(tile) {
            let (stamp, tin) = self.published(Unit::Assemble(tile), other)?;
            self.run.tins.keep(stamp, tin);
            near.insert(area.tiling.index(other), stamp);
        }
        let none: Vec<Vec<LatticePoint>> = vec![Vec::new(); area.tiles.len()];
        let (assembled, _) = assemble_tile(&self.run, &|index| near[&index], &none, tile)?.into_inner();
        Ok(assembled.file.blake3)
    }

    /// The TIN of a tile that is marked as done, as it lies on the disk.
    fn published(&self, unit: Unit, tile: TileId) -> Result<(Stamp, Arc<TileTin>), CompileError> {
        match self.run.database.folder().read_tile(tile) {
            Ok((stamp, tin)) if Some(stamp.fingerprint) == self.work.marks().marked(&Unit::Refine(tile).name()) => {
                Ok((stamp, Arc::new(tin)))
            }
            _ => Err(self.spoilt(unit, Unit::Refine(tile))),
        }
    }

    /// Takes back the mark of a unit whose result is not what it was, so that it is done again.
    fn spoilt(&self, unit: Unit, need: Unit) -> CompileError {
        self.work.marks().unmark(&need.name());
        CompileError::NotReady { unit: unit.name(), needs: need.name() }
    }

    /// Declares the database complete, after whatever is still to be done.
    pub fn publish(self, progress: &mut Stopwatch) -> Result<Built, CompileError> {
        self.run.database.sweep()?;
        finish(self.run, progress)
    }
}

/// What came of a unit of work.
#[derive(Debug)]
pub enum UnitEnd {
    /// It is done, and so are others like it.
    Done,
    /// The database was finished and fresh already.
    Finished,
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
    let session = Session::join(job, &folder.into(), options, progress)?;
    if session.is_finished {
        return Ok(UnitEnd::Finished);
    }
    for &unit in units {
        if unit == Unit::Publish {
            return Ok(UnitEnd::Published(Box::new(session.publish(progress)?)));
        }
        session.perform(unit, progress)?;
    }
    Ok(UnitEnd::Done)
}

/// Listens to nothing.
struct Nobody;

impl Progress for Nobody {
    fn tell(&mut self, _event: Event) {}
}

fn to_share(budget: &TileBudget) -> Share {
    let rect = |rect: ModuleRect| [rect.south, rect.west, rect.north, rect.east];
    Share {
        points: budget.points.map(|points| points as u64),
        rms_quanta: budget.rms_quanta,
        allowance: budget.allowance.as_ref().map(|allowance| ShareAllowance {
            modules: rect(allowance.modules),
            module_room: allowance.module_room.clone(),
            windows: rect(allowance.windows),
            window_size: allowance.window_size.into(),
            window_room: allowance.window_room.clone(),
            triangles: allowance.triangles,
        }),
    }
}

fn from_share(share: &Share) -> TileBudget {
    let rect = |[south, west, north, east]: [u32; 4]| ModuleRect { south, west, north, east };
    TileBudget {
        points: share.points.map(|points| points as usize),
        rms_quanta: share.rms_quanta,
        allowance: share.allowance.as_ref().map(|allowance| Allowance {
            modules: rect(allowance.modules),
            module_room: allowance.module_room.clone(),
            windows: rect(allowance.windows),
            window_size: allowance.window_size.into(),
            window_room: allowance.window_room.clone(),
            triangles: allowance.triangles,
        }),
    }
}
