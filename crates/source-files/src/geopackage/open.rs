//! Opens a GeoPackage so that nothing is written, not even beside it, and so that it cannot ask for much.
//!
//! SQLite writes beside a database that is in its mode with a log, even where it only reads: an index of the log
//! (`-shm`), and the log itself (`-wal`) where there is none. Where there is no log the file is read as one that
//! cannot change, and where there is one by a process that is taken to be alone: its index stays in memory.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::{Connection, OpenFlags};

use crate::SourceError;

/// How the journal of a change begins that was not brought to its end. One that is done with is cut or made zero.
const JOURNAL_MARK: [u8; 8] = [0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];

/// The database at `path`, and the bytes of it and of the log beside it.
pub(super) fn read_only(path: &Path) -> Result<(Connection, u64), SourceError> {
    // SQLite looks for its files beside the one that a link leads to.
    let whole = path.canonicalize().map_err(|source| SourceError::Open { path: path.into(), source })?;
    let bytes_in = |path: &Path| path.metadata().map_or(0, |data| data.len());
    let (bytes, in_log) = (bytes_in(&whole), bytes_in(&with_suffix(&whole, "-wal")));
    refuse_unfinished(path, &with_suffix(&whole, "-journal"))?;
    let open = || -> rusqlite::Result<Connection> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX | OpenFlags::SQLITE_OPEN_URI;
        let how = match in_log {
            0 => "immutable=1",
            _ if cfg!(windows) => "vfs=win32-none",
            _ => "vfs=unix-none",
        };
        let database = Connection::open_with_flags(format!("{}?{how}", address(&whole)), flags)?;
        database.set_db_config(DbConfig::SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, true)?;
        limit(&database, bytes + in_log)?;
        let guards = "PRAGMA locking_mode = EXCLUSIVE; PRAGMA trusted_schema = OFF; PRAGMA query_only = ON; \
                      PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0;";
        database.execute_batch(guards)?;
        Ok(database)
    };
    let database = open().map_err(|error| malformed(path, error.to_string(), "a sound GeoPackage"))?;
    Ok((database, bytes + in_log))
}

/// No value, row or statement is longer than the file, and nothing is computed at length.
fn limit(database: &Connection, bytes: u64) -> rusqlite::Result<()> {
    /// The list of tables is made of statements, and messages are made of texts.
    const LENGTH_LEAST: u64 = 1 << 16;
    let length = i32::try_from(bytes.max(LENGTH_LEAST)).unwrap_or(i32::MAX);
    for (limit, most) in [
        (Limit::SQLITE_LIMIT_LENGTH, length),
        (Limit::SQLITE_LIMIT_SQL_LENGTH, 1 << 20),
        (Limit::SQLITE_LIMIT_EXPR_DEPTH, 50),
        (Limit::SQLITE_LIMIT_COMPOUND_SELECT, 4),
        (Limit::SQLITE_LIMIT_VDBE_OP, 100_000),
        (Limit::SQLITE_LIMIT_ATTACHED, 0),
        (Limit::SQLITE_LIMIT_TRIGGER_DEPTH, 1),
        (Limit::SQLITE_LIMIT_WORKER_THREADS, 0),
    ] {
        database.set_limit(limit, most)?;
    }
    Ok(())
}

/// What is in the file is half of a change where its journal says so, and only its writer can take that back.
fn refuse_unfinished(path: &Path, journal: &Path) -> Result<(), SourceError> {
    let mut start = Vec::new();
    let read = File::open(journal).and_then(|file| file.take(8).read_to_end(&mut start));
    match read.is_ok() && start == JOURNAL_MARK {
        false => Ok(()),
        true => {
            let name = journal.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            let found = format!("in the middle of a change ({name} beside it)");
            Err(malformed(path, found, "one that was closed; open it once where it was written"))
        }
    }
}

fn malformed(path: &Path, found: String, expected: &str) -> SourceError {
    SourceError::Malformed { path: path.into(), what: "the GeoPackage".into(), found, expected: expected.into() }
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

/// A path as SQLite takes it in an address: every byte that could mean something else, written as a number.
fn address(path: &Path) -> String {
    let bytes = path.as_os_str().as_encoded_bytes();
    // How Windows begins a path that is whole; SQLite knows it without.
    let bytes = bytes.strip_prefix(br"\\?\").unwrap_or(bytes);
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/._-".contains(&byte);
    let written =
        bytes.iter().map(|&byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02x}") });
    // On Windows a path begins with a letter.
    let root = if bytes.starts_with(b"/") { "" } else { "/" };
    format!("file:{root}{}", written.collect::<String>().replace("%5c", "/"))
}
