//! A process that takes units of work from a shared directory until the build is done.
//!
//! Which units are ready follows from marks; who does which from leases. A tile is ready once every lower-ranked tile
//! that touches it is done, so two tiles that touch are never at work at once, unless a lease has expired under a
//! process that was only slow.

use std::collections::BTreeSet;
use std::time::Duration;

use job::Job;
use store::engine::{Claim, Lease, Leases};
use store::{Folder, ManifestState};

use crate::build::Built;
use crate::ground::TaskError;
use crate::order::Unit;
use crate::run::Options;
use crate::unit::Session;
use crate::{Clock, CompileError, Event, Progress, Stage, Stopwatch};

/// How a worker shares a directory with others.
#[derive(Clone, Copy)]
pub struct Sharing<'a> {
    /// A name that no other worker has.
    pub name: &'a str,
    /// A lease that was not renewed for so long is free.
    pub lease: Duration,
    /// How long to wait when nothing is ready.
    pub pause: Duration,
    /// Told which lease is held, to be given up if the process has to end.
    pub holding: &'a (dyn Fn(Option<Lease>) + Sync),
}

/// What a worker did.
#[derive(Debug)]
pub struct WorkerEnd {
    /// Units of work it did.
    pub units: usize,
    /// The build, whichever worker published it: to one that did not, it is unchanged.
    pub built: Box<Built>,
}

/// How often a lease is renewed while it lasts once.
const RENEWALS: u32 = 4;

/// Takes units of work on the build of `job` in `folder` until it is published, by this worker or another.
///
/// # Errors
/// As a build. What other workers do is not affected.
pub fn work(
    job: &Job,
    folder: impl Into<Folder>,
    options: &Options,
    sharing: &Sharing,
    progress: &mut dyn Progress,
) -> Result<WorkerEnd, CompileError> {
    let progress = &mut Stopwatch::start(options.clock, progress);
    let session = Session::join(job, &folder.into(), options, progress)?;
    if session.is_finished {
        return Ok(WorkerEnd { units: 0, built: Box::new(session.published()?) });
    }
    let mut worker = Worker {
        open: session.units(),
        leases: session.work.leases(sharing.name, sharing.lease),
        clock: options.clock,
        sharing,
        session,
        units: 0,
    };
    loop {
        if options.stop.load(std::sync::atomic::Ordering::Relaxed) {
            let total = worker.session.units().len();
            let (stage, done) = (Stage::Refine.name(), total - worker.open.len());
            return Err(TaskError::Stopped { stage, done, total }.into());
        }
        if worker.is_published() {
            // The process that published may have been ended before it swept up.
            return Ok(WorkerEnd { units: worker.units, built: Box::new(worker.session.published()?) });
        }
        let next = match worker.next() {
            // It was published and swept meanwhile.
            Err(_) if worker.is_published() => continue,
            next => next?,
        };
        match next {
            Some((Unit { stage: Stage::Publish, .. }, lease)) => return worker.publish(&lease, progress),
            Some((unit, lease)) => worker.perform(unit, lease, progress)?,
            None => options.clock.wait(sharing.pause),
        }
    }
}

struct Worker<'a, 'b> {
    session: Session<'a>,
    sharing: &'b Sharing<'b>,
    clock: &'b dyn Clock,
    leases: Leases,
    /// Units that were not done when last looked at.
    open: Vec<Unit>,
    units: usize,
}

impl Worker<'_, '_> {
    /// Whether the build was finished, by any process. Another one cannot begin in the folder while this one shares it.
    fn is_published(&self) -> bool {
        let manifest = self.session.run.database.folder().manifest();
        manifest.is_ok_and(|manifest| manifest.state == ManifestState::Complete)
    }

    /// A unit that is ready and now ours; the last one once all others are done.
    fn next(&mut self) -> Result<Option<(Unit, Lease)>, CompileError> {
        let marked: BTreeSet<String> = self.session.work.marks().all()?.into_iter().collect();
        let is_done = |unit: &Unit| marked.contains(&unit.to_string());
        self.open.retain(|unit| !is_done(unit));
        let mut ready: Vec<Unit> = match self.open.is_empty() {
            true => vec![Unit::whole(Stage::Publish)],
            false => self.open.iter().copied().filter(|&unit| self.session.needs(unit).iter().all(is_done)).collect(),
        };
        // Workers begin at different places, so that they rarely ask for the same lease.
        let places = ready.len().max(1);
        ready.rotate_left(self.sharing.name.bytes().fold(0, |sum, byte| (sum * 31 + usize::from(byte)) % places));
        for unit in ready {
            if let Claim::Ours(lease, _) = self.leases.claim(&unit.to_string(), self.clock.wall())? {
                // It may have been done between the look at the marks and the claim.
                if self.session.work.marks().marked(&unit.to_string()).is_none() {
                    return Ok(Some((unit, lease)));
                }
            }
        }
        Ok(None)
    }

    fn perform(&mut self, unit: Unit, lease: Lease, progress: &mut dyn Progress) -> Result<(), CompileError> {
        let session = &mut self.session;
        let done = hold(self.sharing, &lease, || session.perform(unit, progress));
        match done {
            Ok(()) => {
                self.units += 1;
                Ok(())
            }
            Err(CompileError::NotReady { .. }) => {
                // What it builds on was damaged, and is made again first.
                self.open = self.session.units();
                // Where this cannot be said, because the build was published meanwhile or otherwise, it expires.
                let _ = lease.give_up();
                Ok(())
            }
            // The process that published the build has swept away what this one was writing.
            Err(_) if self.is_published() => Ok(()),
            Err(error) => {
                // Others may have it at once; if that cannot be said either, the lease expires.
                let _ = lease.give_up();
                Err(error)
            }
        }
    }

    fn publish(self, lease: &Lease, progress: &mut Stopwatch) -> Result<WorkerEnd, CompileError> {
        let Self { session, sharing, units, .. } = self;
        progress.tell(Event::Note("every tile is done: publishing".into()));
        let built = hold(sharing, lease, || session.publish(progress))?;
        Ok(WorkerEnd { units: units + 1, built: Box::new(built) })
    }
}

/// Does `work` while the lease is renewed.
fn hold<R>(sharing: &Sharing, lease: &Lease, work: impl FnOnce() -> R) -> R {
    (sharing.holding)(Some(lease.clone()));
    let mut count = 0;
    let renew = || {
        count += 1;
        // Where it cannot be renewed it expires, and the work is done twice: no harm.
        let _ = lease.renew(count);
    };
    let result = schedule::with_heartbeat(sharing.lease / RENEWALS, renew, work);
    (sharing.holding)(None);
    result
}
