//! Whole files, read and held against what they should be.

use std::path::Path;

use crate::engine::{Entry, Store};

use crate::frame::FRAME_BYTES;
use crate::manifest::FileStamp;
use crate::names::files;
use crate::{DatabaseError, codec};

/// Bytes of the longest file that is read: the longest payload and its frame.
const FILE_BYTES_MAX: u64 = codec::PAYLOAD_BYTES_MAX + FRAME_BYTES as u64;

/// Whether `bytes`, read from `path`, are those that `stamp` promises, which `list` has: `database.json` or the report.
pub(crate) fn check_stamp(path: &Path, bytes: &[u8], stamp: &FileStamp, list: &str) -> Result<(), DatabaseError> {
    let found = FileStamp::of(bytes);
    same_length(path, found.length, stamp, list)?;
    if found.blake3 != stamp.blake3 {
        let (found, expected) = (found.blake3.to_string(), stamp.blake3.to_string());
        return Err(DatabaseError::WrongChecksum { path: path.to_path_buf(), section: against(list), found, expected });
    }
    Ok(())
}

/// Whether the file at `path` is there with as many bytes as `stamp` promises; it is not read.
pub(crate) fn check_length(store: &dyn Store, path: &Path, stamp: &FileStamp, list: &str) -> Result<(), DatabaseError> {
    same_length(path, length(store, path)?, stamp, list)
}

fn same_length(path: &Path, found: u64, stamp: &FileStamp, list: &str) -> Result<(), DatabaseError> {
    if found == stamp.length {
        return Ok(());
    }
    let (path, expected) = (path.to_path_buf(), stamp.length);
    Err(DatabaseError::WrongLength { path, section: against(list), found, expected })
}

fn against(list: &str) -> &'static str {
    if list == files::REPORT { "whole file, against report.json" } else { "whole file, against database.json" }
}

/// All of a file, unless it is longer than any of ours.
pub(crate) fn read(store: &dyn Store, path: &Path) -> Result<Vec<u8>, DatabaseError> {
    let found = length(store, path)?;
    if FILE_BYTES_MAX < found {
        return Err(DatabaseError::TooLarge { path: path.to_path_buf(), found, limit: FILE_BYTES_MAX });
    }
    store.read(path).map_err(|source| DatabaseError::from_io("read", path, 0, source))
}

fn length(store: &dyn Store, path: &Path) -> Result<u64, DatabaseError> {
    match store.target(path).map_err(|source| DatabaseError::from_io("read", path, 0, source))? {
        Entry::File(bytes) => Ok(bytes),
        Entry::Folder | Entry::Other => Err(DatabaseError::NotAFile { path: path.to_path_buf() }),
    }
}

/// Refuses what is there and no file: a pipe would wait for a writer, and a device may have no end.
pub(crate) fn refuse_other(store: &dyn Store, path: &Path) -> Result<(), DatabaseError> {
    match store.target(path) {
        Ok(Entry::Folder | Entry::Other) => Err(DatabaseError::NotAFile { path: path.to_path_buf() }),
        _ => Ok(()),
    }
}
