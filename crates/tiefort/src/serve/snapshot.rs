//! A database as one build left it: all that is answered from it belongs together.
//!
//! `database.json` is the record of a build. It is looked at before and after every answer: an answer is given when
//! both looks found the same finished record. Where it changed, the database is opened again; while a build is at work,
//! the answer is to ask later.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use exports::Datum;

use super::globe::Globes;
use super::ground::Ground;
use super::refusal::Refusal;
use crate::contents::{Contents, FileLook, RECORD};
use crate::failure::Failure;

/// A database as one build left it.
pub struct Snapshot {
    record: Option<FileLook>,
    pub contents: Contents,
    /// Load modules in memory.
    pub ground: Ground,
    /// What globes ask for.
    pub globes: Globes,
}

impl Snapshot {
    fn open(folder: &Path, assumed: Option<Datum>) -> Result<Self, Failure> {
        // Looked at before anything is read: what changes meanwhile is seen.
        let record = FileLook::of(&folder.join(RECORD));
        let contents = Contents::read(folder)?;
        Ok(Self { record, contents, ground: Ground::default(), globes: Globes::new(assumed) })
    }

    /// Whether the database is still that of this build.
    fn is_current(&self) -> bool {
        self.record.is_some() && self.record == FileLook::of(&self.contents.folder.join(RECORD))
    }
}

/// A folder that is served.
pub struct Served {
    /// What its addresses begin with: the folder's name.
    pub name: String,
    folder: PathBuf,
    assumed: Option<Datum>,
    current: Mutex<Arc<Snapshot>>,
}

/// Looks at the record in one answer at most: a build changes it twice.
const TRIES: usize = 3;

impl Served {
    /// Opens the database in a folder.
    ///
    /// # Errors
    /// When it is unfinished, damaged or missing.
    pub fn open(name: String, folder: &Path, assumed: Option<Datum>) -> Result<Self, Failure> {
        let current = Mutex::new(Arc::new(Snapshot::open(folder, assumed)?));
        Ok(Self { name, folder: folder.to_path_buf(), assumed, current })
    }

    fn held(&self) -> MutexGuard<'_, Arc<Snapshot>> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The database as the last build left it.
    ///
    /// # Errors
    /// While a build is at work, and when it is damaged or gone.
    pub fn current(&self) -> Result<Arc<Snapshot>, Refusal> {
        let mut held = self.held();
        if !held.is_current() {
            let opened = Snapshot::open(&self.folder, self.assumed).map_err(Refusal::of)?;
            *held = Arc::new(opened);
        }
        Ok(Arc::clone(&held))
    }

    /// What `read` says of the database, all of it of one build.
    ///
    /// # Errors
    /// What `read` refuses; while a build is at work, and when the database is damaged or gone.
    pub fn ask<R>(&self, mut read: impl FnMut(&Snapshot) -> Result<R, Refusal>) -> Result<R, Refusal> {
        for _ in 0..TRIES {
            let snapshot = self.current()?;
            let answer = read(&snapshot);
            if snapshot.is_current() {
                return answer;
            }
        }
        Err(Refusal::later(
            format!("found {} being built again and again, expected a database at rest", self.name),
            "ask again when the build has ended",
        ))
    }
}
