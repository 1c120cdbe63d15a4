//! Where files lie and what time it is. What writes a database says where by a [`Store`], and never asks the system
//! itself.

use std::path::{Path, PathBuf};
use std::time::Duration;
use std::{fmt, io};

use thiserror::Error;

/// How the names of temporary files begin.
pub(crate) const TEMPORARY_PREFIX: &str = ".tiefort-";
/// How they end.
pub(crate) const TEMPORARY_SUFFIX: &str = ".part";

/// When bytes must be on the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Durability {
    /// Before the name appears, and the name before the call returns.
    Now,
    /// Whenever [`Store::sync`] is called.
    Later,
}

/// What a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// A file of so many bytes.
    File(u64),
    /// A folder.
    Folder,
    /// A link, a pipe or a device: never ours.
    Other,
}

/// Who may hold a lock beside the holder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LockKind {
    /// No process.
    Alone,
    /// Others who share it, too.
    Shared,
}

/// Who holds a lock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// No process.
    Free,
    /// Processes that share it.
    Shared,
    /// One process.
    Alone,
}

/// A lock that is held as long as this value lives; it dies with its process, however that ends.
pub trait Guard: fmt::Debug + Send + Sync {}

/// Where files lie. Nothing is ever half-written to a reader: [`Store::replace`] is all or nothing.
pub trait Store: fmt::Debug + Send + Sync {
    /// All bytes of a file.
    ///
    /// # Errors
    /// What the system says, here and below.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// Its first bytes, at most so many.
    ///
    /// # Errors
    /// As [`Store::read`].
    fn read_start(&self, path: &Path, count: usize) -> io::Result<Vec<u8>>;

    /// What a name stands for; a link is not followed.
    ///
    /// # Errors
    /// As [`Store::read`].
    fn entry(&self, path: &Path) -> io::Result<Entry>;

    /// The same of what a link leads to, where there are links.
    ///
    /// # Errors
    /// As [`Store::read`].
    fn target(&self, path: &Path) -> io::Result<Entry> {
        self.entry(path)
    }

    /// What lies in a folder, by ascending name.
    ///
    /// # Errors
    /// As [`Store::read`].
    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>>;

    /// Writes a file under a temporary name in the same folder and renames it, in place of what was there.
    ///
    /// # Errors
    /// As [`Store::read`]; what was there before is then still there.
    fn replace(&self, path: &Path, bytes: &[u8], durability: Durability) -> io::Result<()>;

    /// Makes a file that is not there yet.
    ///
    /// # Errors
    /// `AlreadyExists` to all but the first; others as [`Store::read`].
    fn create_new(&self, path: &Path, bytes: &[u8]) -> io::Result<()>;

    /// Writes over a file that is there; a reader may see a part meanwhile.
    ///
    /// # Errors
    /// As [`Store::read`].
    fn overwrite(&self, path: &Path, bytes: &[u8]) -> io::Result<()>;

    /// Removes a file.
    ///
    /// # Errors
    /// As [`Store::read`].
    fn remove(&self, path: &Path) -> io::Result<()>;

    /// Makes a folder that is not there yet.
    ///
    /// # Errors
    /// As [`Store::create_new`].
    fn make_folder(&self, path: &Path) -> io::Result<()>;

    /// Makes a folder and those around it, unless they are there.
    ///
    /// # Errors
    /// As [`Store::read`].
    fn make_folders(&self, path: &Path) -> io::Result<()>;

    /// Removes an empty folder.
    ///
    /// # Errors
    /// `DirectoryNotEmpty`; others as [`Store::read`].
    fn remove_folder(&self, path: &Path) -> io::Result<()>;

    /// Waits until these files of the database in `dir`, and every name in these folders of it, are on the disk.
    ///
    /// # Errors
    /// As [`Store::read`].
    fn sync(&self, dir: &Path, files: &[PathBuf], folders: &[PathBuf]) -> io::Result<()>;

    /// Takes the lock on a file, which is made if need be; nothing while others hold it.
    ///
    /// # Errors
    /// As [`Store::read`].
    fn lock(&self, path: &Path, kind: LockKind) -> io::Result<Option<Box<dyn Guard>>>;

    /// Who holds the lock on a file. Makes no file, and keeps others out for an instant at most.
    fn held(&self, path: &Path) -> Held;
}

/// Removes a folder and all that lies in it. What another process puts there or takes away meanwhile is no error
/// unless the folder is not empty in the end.
///
/// # Errors
/// When something cannot be removed.
pub(crate) fn remove_all(store: &dyn Store, folder: &Path) -> io::Result<()> {
    for path in store.list(folder)? {
        let removed = match store.entry(&path) {
            Ok(Entry::Folder) => remove_all(store, &path),
            Ok(_) => store.remove(&path),
            Err(error) => Err(error),
        };
        match removed {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            removed => removed?,
        }
    }
    store.remove_folder(folder)
}

/// Whether a file of this name is one of our temporary ones.
pub fn is_temporary(name: &str) -> bool {
    name.starts_with(TEMPORARY_PREFIX) && name.ends_with(TEMPORARY_SUFFIX)
}

/// What a store said of a file.
#[derive(Debug, Error)]
#[error("{}: cannot {action}: {source}", path.display())]
pub struct StoreError {
    /// What was to be done.
    pub action: &'static str,
    /// With which file.
    pub path: PathBuf,
    /// Bytes that were to be written; 0 if it was no write.
    pub bytes: u64,
    /// What the store said.
    pub source: io::Error,
}

impl StoreError {
    pub(crate) fn new(action: &'static str, path: &Path, bytes: usize, source: io::Error) -> Self {
        Self { action, path: path.to_path_buf(), bytes: bytes as u64, source }
    }
}

/// What time it is.
pub trait Clock: Sync {
    /// Time since any beginning that stays the same.
    fn wall(&self) -> Duration;

    /// Processor time of all threads since any beginning; nothing where it is not known.
    fn cpu(&self) -> Duration {
        Duration::ZERO
    }

    /// Returns after so much time.
    fn wait(&self, time: Duration);
}
