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
    let (path, is_of_report) = (path.to_path_buf(), list == files::REPORT);
    let section = if is_of_report { "whole file, against report.json" } else { "whole file, against database.json" };
    let found = FileStamp::of(bytes);
    if found.length != stamp.length {
        return Err(DatabaseError::WrongLength { path, section, found: found.length, expected: stamp.length });
    }
    if found.blake3 != stamp.blake3 {
        let (found, expected) = (found.blake3.to_string(), stamp.blake3.to_string());
        return Err(DatabaseError::WrongChecksum { path, section, found, expected });
    }
    Ok(())
}

/// All of a file, unless it is longer than any of ours.
pub(crate) fn read(store: &dyn Store, path: &Path) -> Result<Vec<u8>, DatabaseError> {
    let fault = |source| DatabaseError::from_io("read", path, 0, source);
    let found = match store.target(path).map_err(fault)? {
        Entry::File(bytes) => bytes,
        Entry::Folder | Entry::Other => return Err(DatabaseError::NotAFile { path: path.to_path_buf() }),
    };
    if FILE_BYTES_MAX < found {
        return Err(DatabaseError::TooLarge { path: path.to_path_buf(), found, limit: FILE_BYTES_MAX });
    }
    store.read(path).map_err(fault)
}

/// Refuses what is there and no file: a pipe would wait for a writer, and a device may have no end.
pub(crate) fn refuse_other(store: &dyn Store, path: &Path) -> Result<(), DatabaseError> {
    match store.target(path) {
        Ok(Entry::Folder | Entry::Other) => Err(DatabaseError::NotAFile { path: path.to_path_buf() }),
        _ => Ok(()),
    }
}
