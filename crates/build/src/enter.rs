//! How a process comes to share a build: it joins the one that is under way, or begins it where no other is at work.

use std::time::Duration;

use job::Job;
use store::{Area, Database, DatabaseError, Folder, Manifest, ManifestState, SourceRecord};

use crate::build::fresh;
use crate::publish::beginning_of;
use crate::run::ALGORITHM_REVISION;
use crate::{Clock, CompileError};

/// How often a process asks that wants to begin a build, and how long it waits in between: others that come at the same
/// moment stand in its way for an instant only.
const TRIES: usize = 100;
const PAUSE: Duration = Duration::from_millis(20);

/// A database that this process shares.
pub(crate) struct Entered {
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
pub(crate) fn enter(
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
            Ok((database, previous)) => database.begin(&beginning_of(job, records, previous.as_ref()))?,
            Err(DatabaseError::Locked { .. }) => clock.wait(PAUSE),
            Err(error) => return Err(error.into()),
        }
    }
    Err(CompileError::OtherRun { path: folder.dir().display().to_string() })
}
