//! A database's directory, for reading: names, and what the files say.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::engine::{Disk, Entry, Store};
use serde::de::DeserializeOwned;
use terrain::{GainCurve, LoadModule, ModuleRect, TileFeatures, TileId, TileTin};

use crate::frame::{FRAME_BYTES, Kind};
use crate::names::{MEASURED, MODULES, SURVEY, TILES, WORK, files};
use crate::read::{check_stamp, read, refuse_other};
use crate::{
    AreaLevel, AreaOutlines, Building, DatabaseError, FileStamp, Manifest, ManifestState, Measured, NotADatabase,
    Profile, Removals, Report, Stamp, TileModules, Work, beside_tile, buildings_file, frame, json, level_file,
    measured_file, outlines_file, slm, tile_file,
};

/// The directory of a database, to read from. Holds no file open and no lock.
#[derive(Clone, Debug)]
pub struct Folder {
    store: Arc<dyn Store>,
    dir: PathBuf,
}

impl From<&Path> for Folder {
    fn from(dir: &Path) -> Self {
        Self::new(dir)
    }
}

impl From<&PathBuf> for Folder {
    fn from(dir: &PathBuf) -> Self {
        Self::new(dir)
    }
}

impl From<&Folder> for Folder {
    fn from(folder: &Folder) -> Self {
        folder.clone()
    }
}

impl Folder {
    /// The database in `dir`, whether or not it is there yet.
    pub fn new(dir: impl Into<PathBuf>) -> Self {
        Self::stored(Arc::new(Disk), dir)
    }

    /// The same in another store than the system's files.
    pub fn stored(store: Arc<dyn Store>, dir: impl Into<PathBuf>) -> Self {
        Self { store, dir: dir.into() }
    }

    /// Where its files lie.
    pub(crate) fn store(&self) -> &Arc<dyn Store> {
        &self.store
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
    pub(crate) fn removals_path(&self, tile: TileId) -> PathBuf {
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

    /// Where the ground along the features of `tile` lies.
    pub fn profile_path(&self, tile: TileId) -> PathBuf {
        self.path(&format!("{SURVEY}/{tile}.profile"))
    }

    /// Where what features put into `tile` lies.
    pub fn lines_path(&self, tile: TileId) -> PathBuf {
        self.path(&format!("{SURVEY}/{tile}.lines"))
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
        let bytes = self.read(&path).map_err(|error| self.without(error))?;
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
        let found = if matches!(self.store.target(&self.path(files::DATABASE)), Ok(Entry::File(_))) {
            None
        } else {
            NotADatabase::of(&self.dir)
        };
        match (found, &error) {
            (Some(found), DatabaseError::Missing { .. } | DatabaseError::Io { .. }) => {
                DatabaseError::NotADatabase { path: self.dir.clone(), found }
            }
            _ => error,
        }
    }

    /// What processes that share the directory leave for one another during the run of this name.
    pub fn work(&self, run: &str) -> Work {
        Work::new(Arc::clone(&self.store), self.path(WORK).join(run))
    }

    /// What `report.json` says.
    ///
    /// # Errors
    /// When it is missing, damaged or of another build.
    pub fn report(&self) -> Result<Report, DatabaseError> {
        let report: Report = self.read_json(files::REPORT).map_err(|error| self.without(error))?;
        self.check_of_build(&report.files)?;
        Ok(report)
    }

    /// The TIN of `tile`, and what it was made from.
    ///
    /// # Errors
    /// When the file is missing, damaged or of another tile.
    pub fn read_tile(&self, tile: TileId) -> Result<(Stamp, TileTin), DatabaseError> {
        let path = self.tile_path(tile);
        let (stamp, read) = tile_file::decode_tile(&path, &self.read(&path)?)?;
        same_tile(&path, read.tile, tile)?;
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

    /// What was measured of the load modules of `tile` was made from this, by its header alone; `None` when there is
    /// none.
    ///
    /// # Errors
    /// When the header cannot be read or is damaged.
    pub fn measured_stamp(&self, tile: TileId) -> Result<Option<Stamp>, DatabaseError> {
        self.stamp(Kind::Measured, &self.measured_path(tile))
    }

    fn stamp(&self, kind: Kind, path: &Path) -> Result<Option<Stamp>, DatabaseError> {
        refuse_other(&*self.store, path)?;
        match self.store.read_start(path, FRAME_BYTES) {
            Ok(header) => frame::read_stamp(kind, path, &header).map(Some),
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
        let (stamp, read) = beside_tile::decode_removals(&path, &self.read(&path)?)?;
        same_tile(&path, read.tile, tile)?;
        Ok((stamp, read))
    }

    /// The load modules of `tile` at every level, the finest first, each sound, and what holds for all of them.
    ///
    /// # Errors
    /// When the file is missing or damaged, a load module is unsound, or the file is not the one `manifest` lists.
    pub fn read_levels(
        &self,
        manifest: &Manifest,
        tile: TileId,
    ) -> Result<(TileModules, Vec<Vec<LoadModule>>), DatabaseError> {
        self.read_listed(manifest, tile, slm::decode_levels)
    }

    /// The load modules of `tile` at their finest level, each sound, and what holds for all of them.
    ///
    /// # Errors
    /// As [`Folder::read_levels`].
    pub fn read_modules(
        &self,
        manifest: &Manifest,
        tile: TileId,
    ) -> Result<(TileModules, Vec<LoadModule>), DatabaseError> {
        self.read_listed(manifest, tile, slm::decode_modules)
    }

    /// The load modules of `tile` that lie in `part` at every level, the finest first, each sound, and what holds for
    /// all of the tile. The others are not looked at.
    ///
    /// # Errors
    /// As [`Folder::read_levels`].
    pub fn read_part(
        &self,
        manifest: &Manifest,
        tile: TileId,
        part: ModuleRect,
    ) -> Result<(TileModules, Vec<Vec<LoadModule>>), DatabaseError> {
        self.read_listed(manifest, tile, |path, bytes| slm::decode_part(path, bytes, part))
    }

    /// What a load-module file holds. That of another database of the same area is as sound as the one `manifest`
    /// lists, so bytes are compared, too.
    fn read_listed<T>(
        &self,
        manifest: &Manifest,
        tile: TileId,
        decode: impl FnOnce(&Path, &[u8]) -> Result<(TileModules, T), DatabaseError>,
    ) -> Result<(TileModules, T), DatabaseError> {
        let path = self.modules_path(tile);
        let bytes = self.read(&path)?;
        let (header, modules) = decode(&path, &bytes)?;
        same_tile(&path, header.tile, tile)?;
        is_listed(&path, &bytes, manifest, tile)?;
        Ok((header, modules))
    }

    /// Whether the load-module file of `tile` is the one that `manifest` lists. Nothing is decoded.
    ///
    /// # Errors
    /// When it is missing or another.
    pub fn check_modules(&self, manifest: &Manifest, tile: TileId) -> Result<(), DatabaseError> {
        let path = self.modules_path(tile);
        is_listed(&path, &self.read(&path)?, manifest, tile)
    }

    /// What was measured of the load modules of `tile`, what those were made from, and the bytes that say so.
    ///
    /// # Errors
    /// When the file is missing, damaged or of another tile.
    pub fn read_measured(&self, tile: TileId) -> Result<(Stamp, FileStamp, Measured), DatabaseError> {
        let path = self.measured_path(tile);
        let bytes = self.read(&path)?;
        let (stamp, read) = measured_file::decode_measured(&path, &bytes)?;
        same_tile(&path, read.tile, tile)?;
        Ok((stamp, FileStamp::of(&bytes), read))
    }

    /// What the profile of `tile` was made from, by its header alone; `None` when there is none.
    ///
    /// # Errors
    /// When the header cannot be read or is damaged.
    pub fn profile_stamp(&self, tile: TileId) -> Result<Option<Stamp>, DatabaseError> {
        self.stamp(Kind::Profile, &self.profile_path(tile))
    }

    /// What the features' heights were made from, by its header alone; `None` when there are none.
    ///
    /// # Errors
    /// When the header cannot be read or is damaged.
    pub fn level_stamp(&self) -> Result<Option<Stamp>, DatabaseError> {
        self.stamp(Kind::Level, &self.path(files::LEVEL))
    }

    /// What the outlines of objects were made from, by their file's header alone; `None` when there are none.
    ///
    /// # Errors
    /// When the header cannot be read or is damaged.
    pub fn outlines_stamp(&self) -> Result<Option<Stamp>, DatabaseError> {
        self.stamp(Kind::Objects, &self.path(files::OUTLINES))
    }

    /// What stands on the ground of the area, what it was made from, and its file.
    ///
    /// # Errors
    /// When the file is missing or damaged.
    pub fn read_outlines(&self) -> Result<(Stamp, FileStamp, AreaOutlines), DatabaseError> {
        let path = self.path(files::OUTLINES);
        let bytes = self.read(&path)?;
        let (stamp, outlines) = outlines_file::decode_outlines(&path, &bytes)?;
        Ok((stamp, FileStamp::of(&bytes), outlines))
    }

    /// What the buildings were made from, by their file's header alone; `None` when there are none.
    ///
    /// # Errors
    /// When the header cannot be read or is damaged.
    pub fn buildings_stamp(&self) -> Result<Option<Stamp>, DatabaseError> {
        self.stamp(Kind::Buildings, &self.path(files::BUILDINGS))
    }

    /// The buildings of the area, and what they were made from.
    ///
    /// # Errors
    /// When the file is missing or damaged.
    pub fn read_buildings(&self) -> Result<(Stamp, Vec<Building>), DatabaseError> {
        let path = self.path(files::BUILDINGS);
        buildings_file::decode_buildings(&path, &self.read(&path)?)
    }

    /// The ground along the features of `tile`, what it was made from, and the bytes that say so.
    ///
    /// # Errors
    /// When the file is missing, damaged or of another tile.
    pub fn read_profile(&self, tile: TileId) -> Result<(Stamp, FileStamp, Profile), DatabaseError> {
        let path = self.profile_path(tile);
        let bytes = self.read(&path)?;
        let (stamp, read) = beside_tile::decode_profile(&path, &bytes)?;
        same_tile(&path, read.tile, tile)?;
        Ok((stamp, FileStamp::of(&bytes), read))
    }

    /// What features put into `tile`, and the bytes that say so.
    ///
    /// # Errors
    /// When the file is missing, damaged or of another tile.
    pub fn read_lines(&self, tile: TileId) -> Result<(FileStamp, TileFeatures), DatabaseError> {
        let path = self.lines_path(tile);
        let bytes = self.read(&path)?;
        let (_, read) = beside_tile::decode_lines(&path, &bytes)?;
        same_tile(&path, read.tile, tile)?;
        Ok((FileStamp::of(&bytes), read))
    }

    /// What features of the area came to, what it was made from, and the bytes that say so.
    ///
    /// # Errors
    /// When the file is missing or damaged.
    pub fn read_level(&self) -> Result<(Stamp, FileStamp, AreaLevel), DatabaseError> {
        let path = self.path(files::LEVEL);
        let bytes = self.read(&path)?;
        let (stamp, read) = level_file::decode_level(&path, &bytes)?;
        Ok((stamp, FileStamp::of(&bytes), read))
    }

    /// The gain curve of `tile`, and what it was made from.
    ///
    /// # Errors
    /// When the file is missing, damaged or of another tile.
    pub fn read_curve(&self, tile: TileId) -> Result<(Stamp, GainCurve), DatabaseError> {
        let path = self.curve_path(tile);
        let (stamp, read) = beside_tile::decode_curve(&path, &self.read(&path)?)?;
        same_tile(&path, read.tile, tile)?;
        Ok((stamp, read))
    }

    /// A value that [`crate::Database::write_json`] wrote under this name.
    ///
    /// # Errors
    /// When the file is missing or damaged, or holds something else.
    pub fn read_json<T: DeserializeOwned>(&self, name: &str) -> Result<T, DatabaseError> {
        let path = self.path(name);
        json::decode(&path, &self.read(&path)?)
    }

    /// The text of a file of this name, which has no form of ours.
    ///
    /// # Errors
    /// When the file is missing or no text.
    pub fn read_text(&self, name: &str) -> Result<String, DatabaseError> {
        let path = self.path(name);
        let text = String::from_utf8(self.read(&path)?);
        text.map_err(|error| DatabaseError::Malformed { path, section: "text", what: error.to_string() })
    }

    /// How a file looks now.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn stamp_file(&self, path: &Path) -> Result<FileStamp, DatabaseError> {
        Ok(FileStamp::of(&self.read(path)?))
    }

    /// Whether the file of this name has the bytes that `stamp` promises.
    ///
    /// # Errors
    /// When it is missing, or its length or content differs.
    pub fn check_file(&self, path: &Path, stamp: &FileStamp) -> Result<(), DatabaseError> {
        check_stamp(path, &self.read(path)?, stamp, files::DATABASE)
    }

    /// All of one of its files.
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<u8>, DatabaseError> {
        read(&*self.store, path)
    }

    /// What lies in one of its folders, by name; nothing when there is no folder.
    pub(crate) fn list(&self, folder: &Path) -> Result<Vec<PathBuf>, DatabaseError> {
        match self.store.list(folder) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
            listed => listed.map_err(|source| DatabaseError::from_io("list", folder, 0, source)),
        }
    }
}

fn same_tile(path: &Path, found: TileId, expected: TileId) -> Result<(), DatabaseError> {
    let path = path.to_path_buf();
    if found == expected { Ok(()) } else { Err(DatabaseError::OtherTile { path, found, expected }) }
}

fn is_listed(path: &Path, bytes: &[u8], manifest: &Manifest, tile: TileId) -> Result<(), DatabaseError> {
    let listed = manifest.tile(tile).and_then(|record| record.slm);
    let is_same = listed.is_some_and(|stamp| stamp.length == bytes.len() as u64 && stamp == FileStamp::of(bytes));
    if is_same { Ok(()) } else { Err(DatabaseError::OtherBuild { path: path.to_path_buf() }) }
}
