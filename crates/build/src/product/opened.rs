//! A finished database, opened: what it says of itself, its job, and its area; and the ground that it was built from,
//! for those who compare with it.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use job::Job;
use schedule::Workers;
use store::{Folder, Manifest};
use terrain::{Dem, PostRect};

use crate::ground::{GamingArea, Ground};
use crate::product::{ProductError, choose_ground};

/// A finished database, opened.
pub struct Opened {
    /// Its directory.
    pub folder: Folder,
    /// Its `database.json`.
    pub manifest: Manifest,
    /// The job it was built from, as it says itself.
    pub job: Job,
    /// What follows from that.
    pub area: GamingArea,
}

impl Opened {
    /// Opens the database in `dir`.
    ///
    /// # Errors
    /// When it is missing or unfinished, or its `database.json` cannot be read.
    pub fn open(dir: &Path) -> Result<Self, ProductError> {
        let folder = Folder::new(dir);
        let manifest = folder.finished()?;
        Self::of(folder, manifest)
    }

    /// One of which `manifest` says what there is, whether or not that is on the disk yet.
    ///
    /// # Errors
    /// When this version cannot read its job.
    pub fn of(folder: Folder, manifest: Manifest) -> Result<Self, ProductError> {
        let job = Job::from_text(&manifest.job, folder.dir()).map_err(|error| {
            ProductError::impossible(
                "database.json: job",
                error.to_string(),
                "a job this version reads",
                "the database was written by another version; build it again",
            )
        })?;
        let area = GamingArea::new(&job)?;
        Ok(Self { folder, manifest, job, area })
    }
}

/// Heights of a finished database's ground.
pub struct BuiltFrom {
    ground: Ground,
}

impl BuiltFrom {
    /// Opens the ground the database was built from, or the rasters `against` where there are some.
    ///
    /// # Errors
    /// When the database is missing, unfinished or damaged, or the ground cannot be found or used.
    pub fn open(folder: &Path, against: &[PathBuf]) -> Result<Self, ProductError> {
        let Opened { folder, manifest, mut job, area } = Opened::open(folder)?;
        // Nothing that is compared with heights depends on weights.
        job.importance.areas.clear();
        choose_ground(&mut job, &manifest, folder.dir(), against)?;
        let ground = Ground::open_built(&job, &area, (&Workers::new(1), &AtomicBool::new(false)), &folder)?;
        Ok(Self { ground })
    }

    /// Heights at the posts of a rectangle of the area.
    ///
    /// # Errors
    /// When the source has no heights there.
    pub fn heights(&self, rect: PostRect) -> Result<Dem, ProductError> {
        Ok(self.ground.window(rect)?.dem)
    }
}
