//! A database's directory, for reading: names, and what the files say.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use terrain::{GainCurve, LoadModule, TileId, TileTin};

use crate::frame::{FRAME_BYTES, Kind};
use crate::{
    DatabaseError, FileStamp, Manifest, ManifestState, Measured, NotADatabase, Removals, Report, Stamp, TileModules,
    Work, codec, curve_file, frame, json, measured_file, removals_file, slm, tile_file,
};

/// Names of files inside the directory.
pub mod files {
    /// What is there; written last.
    pub const DATABASE: &str = "database.json";
    /// What a run found.
    pub const REPORT: &str = "report.json";
    /// The same for a browser.
    pub const REPORT_HTML: &str = "report.html";
    /// Limits that could not be met, on a map.
    pub const BREACHES: &str = "breaches.geojson";
    /// The same as a table.
    pub const BREACHES_CSV: &str = "breaches.csv";
    /// What each tile may spend.
    pub const ALLOCATION: &str = "survey/allocation.json";
}

/// Folder of the tiles' TINs.
pub(crate) const TILES: &str = "tiles";
/// Folder of the load modules.
pub(crate) const MODULES: &str = "modules";
/// Folder of what was measured of them.
pub(crate) const MEASURED: &str = "measured";
/// Folder of the survey.
pub(crate) const SURVEY: &str = "survey";
/// Folder of leases and marks, gone at the end of a build.
pub(crate) const WORK: &str = "work";

/// Bytes of the longest file that is read: the longest payload and its frame.
const FILE_BYTES_MAX: u64 = codec::PAYLOAD_BYTES_MAX + FRAME_BYTES as u64;

/// The directory of a database, to read from. Holds no file open and no lock.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folder {
    dir: PathBuf,
}

impl Folder {
    /// The database in `dir`, whether or not it is there yet.
    pub fn new(dir: impl Into<PathBuf>) -> Self {
        Self { dir: dir.into() }
    }

    /// The directory.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Where a file lies, given its name inside the directory, such as one of [`files`].
    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// Where the TIN of `tile` lies.
    pub fn tile_path(&self, tile: TileId) -> PathBuf {
        self.path(&format!("{TILES}/{tile}.tin"))
    }

    /// Where the list of removals of `tile` lies, in clip mode.
    pub fn removals_path(&self, tile: TileId) -> PathBuf {
        self.path(&format!("{TILES}/{tile}.removed"))
    }

    /// Where the load modules of `tile` lie.
    pub fn modules_path(&self, tile: TileId) -> PathBuf {
        self.path(&format!("{MODULES}/{tile}.slm"))
    }

    /// Where what was measured of the load modules of `tile` lies.
    pub fn measured_path(&self, tile: TileId) -> PathBuf {
        self.path(&format!("{MEASURED}/{tile}.sums"))
    }

    /// Where the gain curve of `tile` lies.
    pub fn curve_path(&self, tile: TileId) -> PathBuf {
        self.path(&format!("{SURVEY}/{tile}.curve"))
    }

    /// What `database.json` says.
    ///
    /// # Errors
    /// When it is missing, damaged or of another format version.
    pub fn manifest(&self) -> Result<Manifest, DatabaseError> {
        let path = self.path(files::DATABASE);
        let bytes = read(&path).map_err(|error| self.without(error))?;
        Manifest::decode(&path, &bytes)
    }

    /// What `database.json` says of a database that a build has finished.
    ///
    /// # Errors
    /// As [`Folder::manifest`]; also when a build has not finished it.
    pub fn finished(&self) -> Result<Manifest, DatabaseError> {
        let manifest = self.manifest()?;
        match manifest.state {
            ManifestState::Complete => Ok(manifest),
            ManifestState::Incomplete => Err(DatabaseError::Unfinished { path: self.dir.clone() }),
        }
    }

    /// What it means that a file which every database has could not be read: `error`, or that this is no database.
    fn without(&self, error: DatabaseError) -> DatabaseError {
        let found = if self.path(files::DATABASE).is_file() { None } else { NotADatabase::of(&self.dir) };
        match (found, &error) {
            (Some(found), DatabaseError::Missing { .. } | DatabaseError::Io { .. }) => {
                DatabaseError::NotADatabase { path: self.dir.clone(), found }
            }
            _ => error,
        }
    }

    /// What processes that share the directory leave for one another during the run of this name.
    pub fn work(&self, run: &str) -> Work {
        Work::new(self.path(WORK).join(run))
    }

    /// What `report.json` says.
    ///
    /// # Errors
    /// When it is missing or damaged.
    pub fn report(&self) -> Result<Report, DatabaseError> {
        self.read_json(files::REPORT).map_err(|error| self.without(error))
    }

    /// The TIN of `tile`, and what it was made from.
    ///
    /// # Errors
    /// When the file is missing, damaged or of another tile.
    pub fn read_tile(&self, tile: TileId) -> Result<(Stamp, TileTin), DatabaseError> {
        let path = self.tile_path(tile);
        let (stamp, read) = tile_file::decode_tile(&path, &read(&path)?)?;
        same_tile(path, read.tile, tile)?;
        Ok((stamp, read))
    }

    /// What the TIN of `tile` was made from, by its header alone; `None` when there is none.
    ///
    /// # Errors
    /// When the header cannot be read or is damaged.
    pub fn tile_stamp(&self, tile: TileId) -> Result<Option<Stamp>, DatabaseError> {
        self.stamp(Kind::Tile, &self.tile_path(tile))
    }

    /// What the gain curve of `tile` was made from, by its header alone; `None` when there is none.
    ///
    /// # Errors
    /// When the header cannot be read or is damaged.
    pub fn curve_stamp(&self, tile: TileId) -> Result<Option<Stamp>, DatabaseError> {
        self.stamp(Kind::Curve, &self.curve_path(tile))
    }

    fn stamp(&self, kind: Kind, path: &Path) -> Result<Option<Stamp>, DatabaseError> {
        let mut header = Vec::with_capacity(FRAME_BYTES);
        refuse_pipe(path)?;
        let file = File::open(path).and_then(|file| file.take(FRAME_BYTES as u64).read_to_end(&mut header));
        match file {
            Ok(_) => frame::read_stamp(kind, path, &header).map(Some),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(source) => Err(DatabaseError::from_io("read", path, 0, source)),
        }
    }

    /// What was removed from `tile`, and what the list was made from.
    ///
    /// # Errors
    /// When the file is missing, damaged or of another tile.
    pub fn read_removals(&self, tile: TileId) -> Result<(Stamp, Removals), DatabaseError> {
        let path = self.removals_path(tile);
        let (stamp, read) = removals_file::decode_removals(&path, &read(&path)?)?;
        same_tile(path, read.tile, tile)?;
        Ok((stamp, read))
    }

    /// The load modules of `tile` at every level, the finest first, each sound, and what holds for all of them.
    ///
    /// # Errors
    /// When the file is missing, damaged or of another tile, or a load module is unsound.
    pub fn read_levels(&self, tile: TileId) -> Result<(TileModules, Vec<Vec<LoadModule>>), DatabaseError> {
        let path = self.modules_path(tile);
        let (header, levels) = slm::decode_levels(&path, &read(&path)?)?;
        same_tile(path, header.tile, tile)?;
        Ok((header, levels))
    }

    /// The load modules of `tile` at their finest level, each sound, and what holds for all of them.
    ///
    /// # Errors
    /// When the file is missing, damaged or of another tile, or a load module is unsound.
    pub fn read_modules(&self, tile: TileId) -> Result<(TileModules, Vec<LoadModule>), DatabaseError> {
        let path = self.modules_path(tile);
        let (header, modules) = slm::decode_modules(&path, &read(&path)?)?;
        same_tile(path, header.tile, tile)?;
        Ok((header, modules))
    }

    /// What was measured of the load modules of `tile`, and what those were made from.
    ///
    /// # Errors
    /// When the file is missing, damaged or of another tile.
    pub fn read_measured(&self, tile: TileId) -> Result<(Stamp, Measured), DatabaseError> {
        let path = self.measured_path(tile);
        let (stamp, read) = measured_file::decode_measured(&path, &read(&path)?)?;
        same_tile(path, read.tile, tile)?;
        Ok((stamp, read))
    }

    /// The gain curve of `tile`, and what it was made from.
    ///
    /// # Errors
    /// When the file is missing, damaged or of another tile.
    pub fn read_curve(&self, tile: TileId) -> Result<(Stamp, GainCurve), DatabaseError> {
        let path = self.curve_path(tile);
        let (stamp, read) = curve_file::decode_curve(&path, &read(&path)?)?;
        same_tile(path, read.tile, tile)?;
        Ok((stamp, read))
    }

    /// A value that [`crate::Database::write_json`] wrote under this name.
    ///
    /// # Errors
    /// When the file is missing or damaged, or holds something else.
    pub fn read_json<T: DeserializeOwned>(&self, name: &str) -> Result<T, DatabaseError> {
        let path = self.path(name);
        json::decode(&path, &read(&path)?)
    }

    /// The text of a file of this name, which has no form of ours.
    ///
    /// # Errors
    /// When the file is missing or no text.
    pub fn read_text(&self, name: &str) -> Result<String, DatabaseError> {
        let path = self.path(name);
        let text = String::from_utf8(read(&path)?);
        text.map_err(|error| DatabaseError::Malformed { path, section: "text", what: error.to_string() })
    }

    /// How a file looks now.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn stamp_file(&self, path: &Path) -> Result<FileStamp, DatabaseError> {
        Ok(FileStamp::of(&read(path)?))
    }

    /// Whether the file of this name has the bytes that `stamp` promises.
    ///
    /// # Errors
    /// When it is missing, or its length or content differs.
    pub fn check_file(&self, path: &Path, stamp: &FileStamp) -> Result<(), DatabaseError> {
        check_stamp(path, &read(path)?, stamp)
    }
}

/// Whether `bytes`, read from `path`, are those that `stamp` promises.
pub(crate) fn check_stamp(path: &Path, bytes: &[u8], stamp: &FileStamp) -> Result<(), DatabaseError> {
    let (path, section) = (path.to_path_buf(), "whole file, against database.json");
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
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, DatabaseError> {
    let fault = |source| DatabaseError::from_io("read", path, 0, source);
    let found = std::fs::metadata(path).map_err(fault)?.len();
    refuse_pipe(path)?;
    if FILE_BYTES_MAX < found {
        return Err(DatabaseError::TooLarge { path: path.to_path_buf(), found, limit: FILE_BYTES_MAX });
    }
    std::fs::read(path).map_err(fault)
}

/// Refuses what is there and no file: a pipe would wait for a writer, and a device may have no end.
pub(crate) fn refuse_pipe(path: &Path) -> Result<(), DatabaseError> {
    match std::fs::metadata(path) {
        Ok(data) if !data.is_file() => Err(DatabaseError::NotAFile { path: path.to_path_buf() }),
        _ => Ok(()),
    }
}

fn same_tile(path: PathBuf, found: TileId, expected: TileId) -> Result<(), DatabaseError> {
    if found == expected { Ok(()) } else { Err(DatabaseError::OtherTile { path, found, expected }) }
}
