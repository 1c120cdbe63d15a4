//! GeoPackages: their layers, each in its own coordinate system, and what is in them.
//!
//! The file is a database, and one that was made to do harm can hold programs (views, triggers, virtual tables,
//! columns that are computed). So it is opened for reading only, only plain tables of it are looked at, and no more is
//! taken from them than the file has bytes.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags, OptionalExtension, Row};

use crate::SourceError;
use crate::crs::Crs;
use crate::error::at_most;
use crate::features::curves::Chords;
use crate::features::raw::RawShape;
use crate::features::well_known::geometry;
use crate::limits::{LAYERS_MAX, ROWS_MAX};

/// How every one begins.
pub(crate) const MARK: &[u8] = b"SQLite format 3\0";

/// The names of the layers of the GeoPackage at `path`.
pub(crate) fn layer_names(path: &Path) -> Result<Vec<String>, SourceError> {
    let package = Package::open(path)?;
    let (tables, unread) = package.tables()?;
    match unread.first().filter(|_| tables.is_empty()) {
        Some(unread) => Err(unread.refused(path)),
        None => Ok(tables.into_iter().map(|table| table.name).collect()),
    }
}

/// A table of features, its column of geometries and their system.
pub(crate) struct Table {
    pub name: String,
    pub column: String,
    pub srs: i64,
}

/// A layer that is not read, for it is or holds a program.
pub(crate) struct Unread {
    pub name: String,
    /// What it is.
    pub found: String,
}

impl Unread {
    /// The error of having nothing else to read.
    pub(crate) fn refused(&self, path: &Path) -> SourceError {
        SourceError::Layer {
            path: path.into(),
            found: self.found.clone(),
            expected: "a plain table with columns of values".into(),
        }
    }
}

/// A column of a table of features.
pub(crate) struct Column {
    /// Its place in a row.
    pub place: usize,
    pub name: String,
    /// The type that the table declares, in capitals: what is in it may be of any.
    pub declared: String,
}

/// An open GeoPackage.
pub(crate) struct Package<'a> {
    path: &'a Path,
    database: Connection,
    /// Bytes of the file and of the log beside it.
    bytes: u64,
}

impl<'a> Package<'a> {
    /// Opens the GeoPackage at `path` for reading.
    pub(crate) fn open(path: &'a Path) -> Result<Self, SourceError> {
        let (database, bytes) = read_only(path)?;
        Ok(Self { path, database, bytes })
    }

    /// Bytes of the file and of the log beside it.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(crate) fn broken(&self, error: impl std::fmt::Display) -> SourceError {
        self.malformed(error.to_string(), "a sound GeoPackage")
    }

    fn malformed(&self, found: String, expected: &str) -> SourceError {
        let (what, expected) = ("the GeoPackage".into(), expected.into());
        SourceError::Malformed { path: self.path.into(), what, found, expected }
    }

    fn is_table(&self, name: &str) -> Result<bool, SourceError> {
        // A virtual table has no page of its own to begin on.
        let plain = "SELECT 1 FROM sqlite_schema WHERE type = 'table' AND rootpage > 0 AND lower(name) = lower(?1)";
        let found = self.database.query_row(plain, [name], |_| Ok(())).optional();
        found.map(|found| found.is_some()).map_err(|error| self.broken(error))
    }

    /// Whether there is a table to take values from.
    fn is_plain_table(&self, name: &str) -> Result<bool, SourceError> {
        if !self.is_table(name)? {
            return Ok(false);
        }
        match self.computed_column(name)? {
            None => Ok(true),
            Some(found) => Err(self.malformed(found, "columns of values")),
        }
    }

    /// A column that is computed is a program: it may make gigabytes of nothing.
    fn computed_column(&self, name: &str) -> Result<Option<String>, SourceError> {
        let computed = "SELECT CAST(name AS BLOB) FROM pragma_table_xinfo(?1) WHERE hidden <> 0";
        let found = self.database.query_row(computed, [name], |row| row.get::<_, Vec<u8>>(0)).optional();
        let found = found.map_err(|error| self.broken(error))?;
        let told =
            |column: Vec<u8>| format!("a column `{}` of `{name}` that is computed", String::from_utf8_lossy(&column));
        Ok(found.map(told))
    }

    /// Its tables of features, and the layers that are none.
    pub(crate) fn tables(&self) -> Result<(Vec<Table>, Vec<Unread>), SourceError> {
        const LIST: &str = "gpkg_geometry_columns";
        if !self.is_plain_table(LIST)? {
            return Err(self.malformed("a database without layers".into(), "a GeoPackage with a layer of features"));
        }
        let query = format!("SELECT table_name, column_name, srs_id FROM {LIST} LIMIT {}", LAYERS_MAX + 1);
        let mut statement = self.database.prepare(&query).map_err(|error| self.broken(error))?;
        let rows =
            statement.query_map([], |row| Ok(Table { name: row.get(0)?, column: row.get(1)?, srs: row.get(2)? }));
        let tables: Result<Vec<Table>, _> = rows.map_err(|error| self.broken(error))?.collect();
        let tables = tables.map_err(|error| self.broken(error))?;
        at_most(self.path, tables.len() as u64, LAYERS_MAX as u64, "layers")?;
        let (mut plain, mut unread) = (Vec::new(), Vec::new());
        for table in tables {
            let name = table.name.clone();
            let found = match self.is_table(&name)? {
                true => self.computed_column(&name)?,
                false => Some(format!("a layer `{name}` that is no table")),
            };
            match found {
                None => plain.push(table),
                Some(found) => unread.push(Unread { name, found }),
            }
        }
        Ok((plain, unread))
    }

    /// The system of a layer, where it names one.
    pub(crate) fn crs(&self, srs: i64) -> Result<Option<Crs>, SourceError> {
        // Undefined, projected and geographic: it is not known which.
        if srs <= 0 || !self.is_plain_table("gpkg_spatial_ref_sys")? {
            return Ok(None);
        }
        let query = "SELECT organization, organization_coordsys_id FROM gpkg_spatial_ref_sys WHERE srs_id = ?1";
        let named = self.database.query_row(query, [srs], |row| Ok((row.get::<_, String>(0)?, row.get::<_, i64>(1)?)));
        let Some((who, code)) = named.optional().map_err(|error| self.broken(error))? else { return Ok(None) };
        let refused = |found: String| SourceError::UnnamedCrs { path: self.path.into(), found };
        match (who.eq_ignore_ascii_case("EPSG"), u32::try_from(code)) {
            (true, Ok(code)) => {
                Crs::from_epsg(code).map(Some).map_err(|found| refused(format!("EPSG:{code}: {found}")))
            }
            _ => match self.definition(srs)? {
                Some(text) => Crs::from_wkt(&text).map(Some).map_err(|found| refused(format!("{who}:{code}: {found}"))),
                None => Err(refused(format!("{who}:{code}"))),
            },
        }
    }

    /// The well-known text of a system, where one is written: that of version 2 stands in a column of its own, and is
    /// the only one of systems that version 1 has no words for.
    fn definition(&self, srs: i64) -> Result<Option<String>, SourceError> {
        let has = "SELECT 1 FROM pragma_table_xinfo('gpkg_spatial_ref_sys') WHERE name = ?1";
        for column in ["definition", "definition_12_063"] {
            let found = self.database.query_row(has, [column], |_| Ok(())).optional();
            if found.map_err(|error| self.broken(error))?.is_none() {
                continue;
            }
            let query = format!("SELECT {column} FROM gpkg_spatial_ref_sys WHERE srs_id = ?1");
            let text = self.database.query_row(&query, [srs], |row| row.get::<_, Option<String>>(0)).optional();
            let text = text.map_err(|error| self.broken(error))?.flatten();
            if let Some(text) = text.filter(|text| text.contains('[')) {
                return Ok(Some(text));
            }
        }
        Ok(None)
    }

    /// Tells `found` the shape of every row of a layer.
    pub(crate) fn shapes(
        &self,
        table: &Table,
        mut found: impl FnMut(RawShape) -> Result<(), SourceError>,
    ) -> Result<(), SourceError> {
        let chords = Chords::of(self.crs(table.srs).ok().flatten().as_ref());
        self.rows(table, &quoted(&table.column), |row| {
            let value = row.get_ref(0).map_err(|error| self.broken(error))?;
            // A feature without a geometry is legal and adds nothing.
            match value.as_blob_or_null().map_err(|error| self.broken(error))? {
                Some(blob) => found(geometry(blob, chords).map_err(|found| self.malformed(found, "whole geometries"))?),
                None => Ok(()),
            }
        })
    }

    /// All columns of a layer, but for that of its number.
    ///
    /// The library's own list panics where a name is not UTF-8.
    pub(crate) fn columns(&self, table: &Table) -> Result<Vec<Column>, SourceError> {
        let query = "SELECT name, type, pk FROM pragma_table_xinfo(?1) ORDER BY cid";
        let mut statement = self.database.prepare(query).map_err(|error| self.broken(error))?;
        let mut rows = statement.query([&table.name]).map_err(|error| self.broken(error))?;
        let (mut columns, mut place) = (Vec::new(), 0);
        while let Some(row) = rows.next().map_err(|error| self.broken(error))? {
            let text = |index: usize| match row.get_ref(index) {
                Ok(ValueRef::Text(text)) => Ok(String::from_utf8_lossy(text).into_owned()),
                Ok(_) => Ok(String::new()),
                Err(error) => Err(self.broken(error)),
            };
            let (name, declared) = (text(0)?, text(1)?.to_ascii_uppercase());
            let is_number = declared == "INTEGER" && row.get(2).is_ok_and(|key: i64| key == 1);
            columns.extend((!is_number).then_some(Column { place, name, declared }));
            place += 1;
        }
        Ok(columns)
    }

    /// Tells `found` every row of a layer, with some of its columns.
    pub(crate) fn rows(
        &self,
        table: &Table,
        columns: &str,
        mut found: impl FnMut(&Row) -> Result<(), SourceError>,
    ) -> Result<(), SourceError> {
        let query = format!("SELECT {columns} FROM {} LIMIT {}", quoted(&table.name), ROWS_MAX + 1);
        let mut statement = self.database.prepare(&query).map_err(|error| self.broken(error))?;
        let mut rows = statement.query([]).map_err(|error| self.broken(error))?;
        let (mut count, mut bytes) = (0, 0);
        while let Some(row) = rows.next().map_err(|error| self.broken(error))? {
            count += 1;
            bytes += self.bytes_of(row)?;
            // Damaged pages may give the same bytes over and over.
            if self.bytes < bytes {
                let found = format!("rows of `{}` that hold more bytes than the file", table.name);
                return Err(self.malformed(found, "a sound GeoPackage"));
            }
            at_most(self.path, count, ROWS_MAX, "features (or more)")?;
            found(row)?;
        }
        Ok(())
    }

    /// Bytes of the texts and blobs of a row.
    fn bytes_of(&self, row: &Row) -> Result<u64, SourceError> {
        let mut bytes = 0;
        for index in 0..row.as_ref().column_count() {
            bytes += match row.get_ref(index).map_err(|error| self.broken(error))? {
                ValueRef::Text(bytes) | ValueRef::Blob(bytes) => bytes.len() as u64,
                ValueRef::Null | ValueRef::Integer(_) | ValueRef::Real(_) => 0,
            };
        }
        Ok(bytes)
    }

    /// Whether a layer holds anything.
    pub(crate) fn has_rows(&self, table: &Table) -> Result<bool, SourceError> {
        let query = format!("SELECT 1 FROM {} LIMIT 1", quoted(&table.name));
        let found = self.database.query_row(&query, [], |_| Ok(())).optional();
        found.map(|found| found.is_some()).map_err(|error| self.broken(error))
    }
}

fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
}

/// How the journal of a change begins that was not brought to its end. One that is done with is cut or made zero.
const JOURNAL_MARK: [u8; 8] = [0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];

/// The database at `path`, opened so that nothing is written, not even beside it, and so that it cannot ask for much;
/// and the bytes of it and of the log beside it.
///
/// SQLite writes beside a database that is in its mode with a log, even where it only reads: an index of the log
/// (`-shm`), and the log itself (`-wal`) where there is none. Where there is no log the file is read as one that
/// cannot change, and where there is one by a process that is taken to be alone: its index stays in memory.
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
