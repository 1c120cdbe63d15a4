//! The bytes of a source, for its hash: a database says what it was made from; and whether it is still that file.

use std::fs::{File, Metadata};
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::SourceError;
use crate::beside::all_beside;
use crate::error::{A_DANGLING_LINK, A_DATABASE, A_FOLDER};

/// The bytes of the file at `path`, and after them those of files beside it that say how it is to be read. They are
/// read as they are wanted: a source may be larger than the memory there is.
///
/// # Errors
/// When one cannot be opened, or is no regular file.
pub fn content(path: &Path) -> Result<Box<dyn Read>, SourceError> {
    let open = |path: &Path| -> Result<File, SourceError> {
        regular(path)?;
        File::open(path).map_err(|source| SourceError::Read { path: path.into(), source })
    };
    let first: Box<dyn Read> = Box::new(open(path)?);
    all_beside(path)
        .iter()
        .try_fold(first, |all, other| -> Result<Box<dyn Read>, SourceError> { Ok(Box::new(all.chain(open(other)?))) })
}

/// What the disk says of a regular file. Nothing is opened: that of a pipe would wait for a writer for ever.
pub(crate) fn regular(path: &Path) -> Result<Metadata, SourceError> {
    let not_a_file = |found| SourceError::NotAFile { path: path.into(), found };
    match std::fs::metadata(path) {
        Ok(data) if data.is_file() => Ok(data),
        Ok(data) if data.is_dir() && path.join("database.json").is_file() => Err(not_a_file(A_DATABASE)),
        Ok(data) => Err(not_a_file(kind_of(&data))),
        Err(_) if path.is_symlink() => Err(not_a_file(A_DANGLING_LINK)),
        Err(source) => Err(SourceError::Open { path: path.into(), source }),
    }
}

#[cfg(unix)]
fn kind_of(data: &Metadata) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    let kind = data.file_type();
    match () {
        () if kind.is_dir() => A_FOLDER,
        () if kind.is_fifo() => "a named pipe",
        () if kind.is_socket() => "a socket",
        () => "a device",
    }
}

#[cfg(not(unix))]
fn kind_of(data: &Metadata) -> &'static str {
    if data.is_dir() { A_FOLDER } else { "a device" }
}

#[cfg(unix)]
fn modified(data: &Metadata) -> Option<(i64, i64)> {
    use std::os::unix::fs::MetadataExt;
    Some((data.mtime(), data.mtime_nsec()))
}

#[cfg(not(unix))]
fn modified(_: &Metadata) -> Option<(i64, i64)> {
    None
}

/// Which file a path led to, and what it was like, so that a change is seen without reading it again; and the same of
/// the files beside it that say how it is to be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileState {
    path: PathBuf,
    len: u64,
    /// When it was last written, in whatever the file system counts; never compared with a clock.
    modified: Option<(i64, i64)>,
    place: (u64, u64),
    beside: Vec<FileState>,
}

impl FileState {
    /// Of the file at `path` now.
    ///
    /// # Errors
    /// When there is none, or no regular one.
    pub fn of(path: &Path) -> Result<Self, SourceError> {
        let beside = all_beside(path).iter().map(|other| Self::alone(other)).collect::<Result<_, _>>()?;
        Ok(Self { beside, ..Self::alone(path)? })
    }

    fn alone(path: &Path) -> Result<Self, SourceError> {
        let data = regular(path)?;
        let (modified, place) = (modified(&data), place_of(&data));
        Ok(Self { path: path.into(), len: data.len(), modified, place, beside: Vec::new() })
    }

    /// Checks that the path still leads to the same file, unchanged, and that those beside it are still the same.
    ///
    /// # Errors
    /// [`SourceError::Changed`] when it does not.
    pub fn check(&self) -> Result<(), SourceError> {
        self.check_alone()?;
        self.beside.iter().try_for_each(Self::check_alone)?;
        let is_known = |path: &PathBuf| self.beside.iter().any(|state| state.path == *path);
        match all_beside(&self.path).into_iter().find(|path| !is_known(path)) {
            Some(path) => Err(SourceError::Changed { path, found: "put there".into() }),
            None => Ok(()),
        }
    }

    fn check_alone(&self) -> Result<(), SourceError> {
        let changed = |found: String| Err(SourceError::Changed { path: self.path.clone(), found });
        match Self::alone(&self.path) {
            Ok(now) if now.place != self.place => changed("replaced by another file".into()),
            Ok(now) if now.len != self.len => changed(format!("{} bytes long instead of {}", now.len, self.len)),
            Ok(now) if now.modified != self.modified => changed("written to".into()),
            Ok(_) => Ok(()),
            Err(_) => changed("gone".into()),
        }
    }
}

/// The device and the number of a file on it, where the system has such.
#[cfg(unix)]
fn place_of(data: &Metadata) -> (u64, u64) {
    use std::os::unix::fs::MetadataExt;
    (data.dev(), data.ino())
}

#[cfg(not(unix))]
fn place_of(_: &Metadata) -> (u64, u64) {
    (0, 0)
}
