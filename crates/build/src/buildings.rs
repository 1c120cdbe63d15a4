//! Buildings of the sources, kept beside what features come to: they are drawn only, so no other stage asks for them.

use store::engine::{Artifact, Key, Stamp, keep_or_make};
use store::{Building, FileStamp, files};

use crate::CompileError;
use crate::keys;
use crate::read_features::ReadFeatures;
use crate::run::{ALGORITHM_REVISION, Run};

/// Publishes the buildings of a job that has some, or keeps what is published and fresh.
pub(crate) fn publish_buildings(run: &Run, read: &ReadFeatures) -> Result<(), CompileError> {
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
