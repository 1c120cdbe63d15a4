//! Why a file of ours could not be written, or not be believed when read.

use std::fmt;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use crate::engine::StoreError;
use load_module_reader::ReadError;
use terrain::TinFault;
use thiserror::Error as ThisError;

use crate::names::{FOLDERS, WORK, files};

/// Why a file of ours could not be written, or not be believed when read.
#[derive(Debug, ThisError)]
pub enum DatabaseError {
    /// The system refused.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// What was to be done, as in "cannot …".
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: Error,
    },
    /// The disk or the quota is full.
    #[error("{}: no space left for {bytes} bytes: {source}", path.display())]
    DiskFull {
        /// The file that was to be written.
        path: PathBuf,
        /// Its size.
        bytes: u64,
        /// What the system said.
        source: Error,
    },
    /// The folder cannot be written to.
    #[error("{}: not writable: {source}", path.display())]
    NotWritable {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: Error,
    },
    /// A file that should be there is not.
    #[error("{}: no such file", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The database is in the middle of a build.
    #[error("{}: incomplete, expected a database that a build has finished", path.display())]
    Unfinished {
        /// The database.
        path: PathBuf,
    },
    /// What was named as a database is none.
    #[error("{}: found {found}, expected the folder of a terrain database", path.display())]
    NotADatabase {
        /// What was named.
        path: PathBuf,
        /// What it is.
        found: NotADatabase,
    },
    /// The folder holds something, and no `database.json` of ours that vouches for it.
    #[error("{}: found {found}, expected an empty folder or a terrain database", path.display())]
    NotOurFolder {
        /// The folder.
        path: PathBuf,
        /// What it holds.
        found: String,
    },
    /// A link, or a file in place of a folder, inside the database.
    #[error("{}: found a link or a file, expected a folder", path.display())]
    NotAFolder {
        /// What should be a folder.
        path: PathBuf,
    },
    /// A link, a folder or a pipe in place of a file, inside the database.
    #[error("{}: found a link, a folder or a pipe, expected a file", path.display())]
    NotAFile {
        /// What should be a file.
        path: PathBuf,
    },
    /// The file is of another kind.
    #[error("{}: header: found {found:02x?}, expected {expected:02x?}", path.display())]
    NotOurFile {
        /// The file.
        path: PathBuf,
        /// Its first eight bytes.
        found: [u8; 8],
        /// The first eight bytes of such a file.
        expected: [u8; 8],
    },
    /// The file has another format version.
    #[error("{}: found format version {found}, expected {expected}", path.display())]
    OtherVersion {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
        /// Ours.
        expected: u32,
    },
    /// The database is of another gaming area.
    #[error("{}: found area.{key} {found}, expected {expected}", path.display())]
    OtherArea {
        /// The file.
        path: PathBuf,
        /// The first key in which the areas differ.
        key: &'static str,
        /// The database's value.
        found: String,
        /// The job's value.
        expected: String,
    },
    /// The file is shorter or longer than it says.
    #[error("{}: {section}: found {found} bytes, expected {expected}", path.display())]
    WrongLength {
        /// The file.
        path: PathBuf,
        /// Its part.
        section: &'static str,
        /// Bytes there.
        found: u64,
        /// Bytes promised.
        expected: u64,
    },
    /// The bytes are not those that were written.
    #[error("{}: {section}: found checksum {found}, expected {expected}", path.display())]
    WrongChecksum {
        /// The file.
        path: PathBuf,
        /// Its part.
        section: &'static str,
        /// Checksum of the bytes.
        found: String,
        /// Checksum stored.
        expected: String,
    },
    /// The file is larger than any of ours.
    #[error("{}: found {found} bytes, expected at most {limit}", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        found: u64,
        /// The limit.
        limit: u64,
    },
    /// The bytes are as written but do not say what they should.
    #[error("{}: {section}: {what}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Its part.
        section: &'static str,
        /// What is wrong, with what was found and expected.
        what: String,
    },
    /// The file is of another tile than its name says.
    #[error("{}: found tile {found}, expected {expected}", path.display())]
    OtherTile {
        /// The file.
        path: PathBuf,
        /// The tile it is of.
        found: terrain::TileId,
        /// The tile it should be of.
        expected: terrain::TileId,
    },
    /// A load-module file is damaged.
    #[error("{}: {fault}", path.display())]
    Modules {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: Box<ReadError>,
    },
    /// The TIN of a tile has a crack or the like.
    #[error("{}: TIN: {fault}", path.display())]
    UnsoundTin {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: TinFault,
    },
    /// A sound file of a database, which is not the one that a build left there.
    #[error("{}: found a file that is not of the build that database.json tells of", path.display())]
    OtherBuild {
        /// The file.
        path: PathBuf,
    },
    /// A file that `database.json` does not list.
    #[error("{}: found a file that database.json does not list", path.display())]
    NotListed {
        /// The file.
        path: PathBuf,
    },
    /// Another build works in the directory.
    #[error("{}: another run is building in this directory", path.display())]
    Locked {
        /// The directory.
        path: PathBuf,
    },
}

/// What lies where a database was looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotADatabase {
    /// Nothing.
    Nothing,
    /// A link whose target is gone.
    DanglingLink,
    /// A file whose name is that of a job.
    Job,
    /// A file inside a database.
    PartOfOne,
    /// Any other file.
    File,
    /// A folder that no build made.
    OtherFolder,
}

impl NotADatabase {
    /// What `dir`, in which there is no `database.json`, is; `None` for the folder of a build that has not begun to
    /// publish.
    pub(crate) fn of(dir: &Path) -> Option<Self> {
        let is_unfinished = || FOLDERS.iter().chain([&WORK]).any(|name| dir.join(name).is_dir());
        let is_job = || dir.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
        let is_inside = || dir.parent().is_some_and(|around| around.join(files::DATABASE).is_file());
        match std::fs::metadata(dir) {
            Ok(found) if found.is_dir() => (!is_unfinished()).then_some(Self::OtherFolder),
            Ok(_) if is_job() => Some(Self::Job),
            Ok(_) if is_inside() => Some(Self::PartOfOne),
            Ok(_) => Some(Self::File),
            Err(_) if dir.is_symlink() => Some(Self::DanglingLink),
            Err(_) => Some(Self::Nothing),
        }
    }

    fn hint(self) -> &'static str {
        match self {
            Self::Nothing | Self::DanglingLink => {
                "check the path; `tiefort build JOB.toml` leaves its database in NAME.tdb, NAME being area.name"
            }
            Self::Job => {
                "that is a job; name what `tiefort build` made of it: the folder NAME.tdb, NAME being area.name"
            }
            Self::PartOfOne => "name the folder that this file lies in",
            Self::File => "name the folder that `tiefort build` left, such as ntc.tdb",
            Self::OtherFolder => "there is no database.json in it; name the folder that `tiefort build` left",
        }
    }
}

impl fmt::Display for NotADatabase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Nothing => "nothing there",
            Self::DanglingLink => "a link that leads nowhere",
            Self::Job => "a job file",
            Self::PartOfOne | Self::File => "a file",
            Self::OtherFolder => "another folder",
        })
    }
}

impl From<StoreError> for DatabaseError {
    fn from(error: StoreError) -> Self {
        Self::from_io(error.action, &error.path, error.bytes, error.source)
    }
}

impl DatabaseError {
    /// Sorts what the system said about `path` while we were to `action` ("write `bytes` bytes", 0 if it was no write).
    pub(crate) fn from_io(action: &'static str, path: &Path, bytes: u64, source: Error) -> Self {
        let path = path.to_path_buf();
        match source.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Self::DiskFull { path, bytes, source },
            ErrorKind::ReadOnlyFilesystem => Self::NotWritable { path, source },
            ErrorKind::PermissionDenied if action != "read" => Self::NotWritable { path, source },
            ErrorKind::NotFound if action == "read" => Self::Missing { path },
            _ => Self::Io { action, path, source },
        }
    }

    /// Whether trying again later may help: exit code 75.
    pub fn is_transient(&self) -> bool {
        matches!(self, Self::Locked { .. })
    }

    /// What to do about it, where one thing is likely.
    pub fn hint(&self) -> Option<&'static str> {
        Some(match self {
            Self::DiskFull { .. } => "free some space and run the same command again; finished tiles are kept",
            Self::NotWritable { .. } => "choose another folder with --out",
            Self::Unfinished { .. } => "run `tiefort build` first, which goes on from what is there",
            Self::NotADatabase { found, .. } => found.hint(),
            Self::NotOurFolder { .. } => {
                "choose another folder with --out, or empty this one yourself; what is there is left alone"
            }
            Self::NotAFolder { .. } | Self::NotAFile { .. } => {
                "a database has plain files and folders only, and output follows no link out of it; remove it"
            }
            Self::OtherVersion { .. } => "another version of tiefort wrote it; build into another folder with --out",
            Self::OtherArea { .. } => "the folder holds another gaming area; build into another one with --out",
            Self::Locked { .. } => "wait for the other run to end, or build into another folder with --out",
            Self::OtherBuild { .. } => "`tiefort verify` tells more, and `tiefort build` of its job makes it again",
            Self::Missing { .. }
            | Self::NotOurFile { .. }
            | Self::WrongLength { .. }
            | Self::WrongChecksum { .. }
            | Self::Malformed { .. }
            | Self::OtherTile { .. }
            | Self::Modules { .. }
            | Self::UnsoundTin { .. } => "run `tiefort build` again: it rebuilds what is damaged or missing",
            Self::Io { .. } | Self::TooLarge { .. } | Self::NotListed { .. } => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_is_told_apart() {
        let source = Error::from(ErrorKind::StorageFull);
        let error = DatabaseError::from_io("write", Path::new("a.tdb/tiles/r00c00.tin"), 512, source);
        assert!(error.to_string().starts_with("a.tdb/tiles/r00c00.tin: no space left for 512 bytes"));
    }

    #[test]
    fn only_a_held_lock_is_transient() {
        assert!(DatabaseError::Locked { path: "a.tdb".into() }.is_transient());
        assert!(!DatabaseError::Missing { path: "a.tdb".into() }.is_transient());
    }
}
