//! A finished database, opened: what it says of itself, its job, and its area.

use std::path::Path;

use crate::ground::GamingArea;
use job::Job;
use store::{Folder, Manifest};

use crate::product::ProductError;

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
