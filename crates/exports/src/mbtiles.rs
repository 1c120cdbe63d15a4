//! Tiles of a map in one SQLite file, as in MBTiles 1.3.

use std::path::Path;

use rusqlite::{Connection, params};

use crate::ExportError;

/// Writes tiles, each by its level, column and row counted from the south, and what is said of them at `path`.
///
/// # Errors
/// When the file cannot be written.
pub(crate) fn write_tables<'a>(
    path: &Path,
    about: &[(&str, String)],
    tiles: impl Iterator<Item = ([i64; 3], &'a [u8])>,
) -> Result<(), ExportError> {
    tables(path, about, tiles).map_err(|error| ExportError::write("MBTiles")(std::io::Error::other(error)))
}

fn tables<'a>(
    path: &Path,
    about: &[(&str, String)],
    tiles: impl Iterator<Item = ([i64; 3], &'a [u8])>,
) -> rusqlite::Result<()> {
    let mut connection = Connection::open(path)?;
    // The file has a temporary name until it is whole, so nothing has to survive a crash.
    connection.execute_batch(
        "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA application_id = 0x4d504258;
        CREATE TABLE metadata (name TEXT PRIMARY KEY, value TEXT);
        CREATE TABLE tiles (zoom_level INTEGER, tile_column INTEGER, tile_row INTEGER, tile_data BLOB);",
    )?;
    let transaction = connection.transaction()?;
    for ([level, column, row], bytes) in tiles {
        transaction.execute("INSERT INTO tiles VALUES (?1, ?2, ?3, ?4)", params![level, column, row, bytes])?;
    }
    for (name, value) in about {
        transaction.execute("INSERT INTO metadata VALUES (?1, ?2)", params![name, value])?;
    }
    transaction.execute_batch("CREATE UNIQUE INDEX tile_index ON tiles (zoom_level, tile_column, tile_row);")?;
    transaction.commit()
}
