//! A database's directory, for writing: made or found, locked, and never half-written.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use crate::engine::{Durability, Entry, LockKind, Stamp, check_writable, is_temporary, remove_all};
use serde::Serialize;
use terrain::{GainCurve, LoadModule, TileFeatures, TileTin};

use crate::lock::LOCK_NAME;
use crate::names::{FOLDERS, WORK, files};
use crate::verify::KINDS;
use crate::{
    Area, AreaLevel, AreaOutlines, Building, DatabaseError, FileStamp, Folder, Lock, Manifest, ManifestState, Measured,
    Profile, Removals, Report, TileModules, Work, encode_buildings, encode_curve, encode_level, encode_levels,
    encode_lines, encode_measured, encode_outlines, encode_profile, encode_removals, encode_tile, json,
};

/// What is written beside a finished build.
fn reports() -> impl Iterator<Item = &'static str> {
    [files::REPORT].into_iter().chain(files::BESIDE_REPORT)
}

/// A database to write to: by this process alone, or by all that have joined it.
#[derive(Debug)]
pub struct Database {
    folder: Folder,
    _lock: Lock,
}

impl Database {
    /// Makes the directory, or opens it to go on with the database of `area` in it; with what `database.json` says, if
    /// it is there and can be believed. Locks it, makes the folders and removes what a killed run left half-written.
    ///
    /// # Errors
    /// When the directory holds anything and no `database.json` of ours, a database of another format version or area,
    /// or a link in place of a folder; when another build holds the lock; when it cannot be written to. Nothing is
    /// changed then.
    pub fn create_or_open(folder: impl Into<Folder>, area: &Area) -> Result<(Self, Option<Manifest>), DatabaseError> {
        let (database, previous) = Self::open(folder.into(), area, LockKind::Alone)?;
        database.sweep()?;
        database.remove_work()?;
        Ok((database, previous))
    }

    /// Whether a database of `area` could be made or gone on with in `dir`, as far as that is known without locking it.
    /// Nothing is changed.
    ///
    /// # Errors
    /// As [`Database::create_or_open`].
    pub fn foresee(dir: &Path, area: &Area) -> Result<(), DatabaseError> {
        examine(&Folder::new(dir), area)?;
        if dir.exists() {
            let lock = dir.join(LOCK_NAME);
            return check_writable(dir).map_err(|source| DatabaseError::from_io("lock", &lock, 0, source));
        }
        let absolute = std::path::absolute(dir).unwrap_or_else(|_| dir.to_path_buf());
        let Some(around) = absolute.ancestors().find(|folder| folder.exists()) else { return Ok(()) };
        check_writable(around).map_err(|source| DatabaseError::from_io("create", dir, 0, source))
    }

    /// The same for one of several processes that share the directory: it keeps builds out and no other process, and
    /// removes nothing.
    ///
    /// # Errors
    /// As [`Database::create_or_open`].
    pub fn join(folder: impl Into<Folder>, area: &Area) -> Result<(Self, Option<Manifest>), DatabaseError> {
        Self::open(folder.into(), area, LockKind::Shared)
    }

    fn open(folder: Folder, area: &Area, kind: LockKind) -> Result<(Self, Option<Manifest>), DatabaseError> {
        // Looked at before the lock is made, so that nothing is put into a directory that is not ours.
        examine(&folder, area)?;
        let dir = folder.dir();
        folder.store().make_folders(dir).map_err(|source| DatabaseError::from_io("create", dir, 0, source))?;
        let lock = Lock::take(&folder, kind)?;
        // Looked at again, now that no other process can change it.
        let previous = examine(&folder, area)?;
        FOLDERS.iter().try_for_each(|name| make_folder(&folder, &folder.path(name)))?;
        Ok((Self { folder, _lock: lock }, previous))
    }

    /// Removes what killed processes left half-written. A process that is writing now finds its file gone.
    ///
    /// # Errors
    /// When a folder cannot be listed, or a file in it not removed.
    pub fn sweep(&self) -> Result<(), DatabaseError> {
        self.remove_left_over(self.folder.dir())?;
        FOLDERS.iter().try_for_each(|name| self.remove_left_over(&self.folder.path(name)))
    }

    /// Removes temporary files that a killed run left in one of its folders.
    fn remove_left_over(&self, folder: &Path) -> Result<(), DatabaseError> {
        let is_left = |path: &&PathBuf| path.file_name().is_some_and(|name| is_temporary(&name.to_string_lossy()));
        self.folder.list(folder)?.iter().filter(is_left).try_for_each(|path| self.remove_if_there(path))
    }

    /// What processes that share the directory leave for one another during the run of this name.
    ///
    /// # Errors
    /// When its folders cannot be made.
    pub fn work(&self, run: &str) -> Result<Work, DatabaseError> {
        let (work, own) = (self.folder.path(WORK), self.folder.path(WORK).join(run));
        let inside = Work::FOLDERS.map(|name| own.join(name));
        let folders: Vec<&PathBuf> = [&work, &own].into_iter().chain(&inside).collect();
        let make = |path: &&PathBuf| match self.folder.store().make_folder(path) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => Err(error),
            _ => Ok(()),
        };
        again(|| folders.iter().try_for_each(make))
            .map_err(|source| DatabaseError::from_io("create", &own, 0, source))?;
        folders.into_iter().try_for_each(|path| check_folder(&self.folder, path))?;
        Ok(self.folder.work(run))
    }

    /// Removes what processes left for one another, once the build is published or no process shares the directory;
    /// nothing that has another name than a run.
    ///
    /// # Errors
    /// When something cannot be removed.
    pub(crate) fn remove_work(&self) -> Result<(), DatabaseError> {
        let path = self.folder.path(WORK);
        check_folder(&self.folder, &path)?;
        let store = self.folder.store();
        let remove = || {
            let runs = store.list(&path)?.into_iter().filter(|run| Work::is_of_run(run));
            runs.filter(|run| matches!(store.entry(run), Ok(Entry::Folder)))
                .try_for_each(|run| remove_all(&**store, &run))?;
            store.remove_folder(&path)
        };
        match remove() {
            Err(source) if !matches!(source.kind(), ErrorKind::NotFound | ErrorKind::DirectoryNotEmpty) => {
                Err(DatabaseError::from_io("remove", &path, 0, source))
            }
            _ => Ok(()),
        }
    }

    /// The same directory, to read from.
    pub fn folder(&self) -> &Folder {
        &self.folder
    }

    /// Publishes a tile's TIN.
    ///
    /// # Errors
    /// When the file cannot be written; the one before it is then still there.
    pub fn write_tile(&self, stamp: &Stamp, tile: &TileTin) -> Result<FileStamp, DatabaseError> {
        self.publish(&self.folder.tile_path(tile.tile), &encode_tile(stamp, tile))
    }

    /// Publishes the list of what was removed from a tile.
    ///
    /// # Errors
    /// As [`Database::write_tile`].
    pub fn write_removals(&self, stamp: &Stamp, removals: &Removals) -> Result<FileStamp, DatabaseError> {
        self.publish(&self.folder.removals_path(removals.tile), &encode_removals(stamp, removals))
    }

    /// Publishes a tile's load modules at every level, the finest first, unless the very same bytes lie there.
    ///
    /// # Errors
    /// As [`Database::write_tile`].
    ///
    /// # Panics
    /// As [`encode_levels`].
    pub fn write_modules(&self, tile: &TileModules, levels: &[Vec<LoadModule>]) -> Result<FileStamp, DatabaseError> {
        let (path, bytes) = (self.folder.modules_path(tile.tile), encode_levels(tile, levels));
        let stamp = FileStamp::of(&bytes);
        if self.folder.check_file(&path, &stamp).is_err() {
            self.write(&path, &bytes, Durability::Later)?;
        }
        Ok(stamp)
    }

    /// Publishes what was measured of a tile's load modules.
    ///
    /// # Errors
    /// As [`Database::write_tile`].
    pub fn write_measured(&self, stamp: &Stamp, measured: &Measured) -> Result<FileStamp, DatabaseError> {
        self.publish(&self.folder.measured_path(measured.tile), &encode_measured(stamp, measured))
    }

    /// Publishes a tile's gain curve.
    ///
    /// # Errors
    /// As [`Database::write_tile`].
    pub fn write_curve(&self, stamp: &Stamp, curve: &GainCurve) -> Result<FileStamp, DatabaseError> {
        self.publish(&self.folder.curve_path(curve.tile), &encode_curve(stamp, curve))
    }

    /// Publishes what the ground is along the features of a tile.
    ///
    /// # Errors
    /// As [`Database::write_tile`].
    pub fn write_profile(&self, stamp: &Stamp, profile: &Profile) -> Result<FileStamp, DatabaseError> {
        self.publish(&self.folder.profile_path(profile.tile), &encode_profile(stamp, profile))
    }

    /// Publishes what features put into a tile.
    ///
    /// # Errors
    /// As [`Database::write_tile`].
    pub fn write_lines(&self, stamp: &Stamp, features: &TileFeatures) -> Result<FileStamp, DatabaseError> {
        self.publish(&self.folder.lines_path(features.tile), &encode_lines(stamp, features))
    }

    /// Publishes what features of the area came to.
    ///
    /// # Errors
    /// As [`Database::write_tile`].
    pub fn write_level(&self, stamp: &Stamp, level: &AreaLevel) -> Result<FileStamp, DatabaseError> {
        self.publish(&self.folder.path(files::LEVEL), &encode_level(stamp, level))
    }

    /// Publishes what stands on the ground of the area, before its heights are known.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_outlines(&self, stamp: &Stamp, outlines: &AreaOutlines) -> Result<FileStamp, DatabaseError> {
        self.publish(&self.folder.path(files::OUTLINES), &encode_outlines(stamp, outlines))
    }

    /// Publishes the buildings of the area.
    ///
    /// # Errors
    /// As [`Database::write_tile`].
    pub fn write_buildings(&self, stamp: &Stamp, buildings: &[Building]) -> Result<FileStamp, DatabaseError> {
        self.publish(&self.folder.path(files::BUILDINGS), &encode_buildings(stamp, buildings))
    }

    /// Publishes a value, which must be an object, as checksummed JSON under one of the names of [`files`].
    ///
    /// # Errors
    /// As [`Database::write_tile`]; also when `value` is not an object.
    pub fn write_json(&self, name: &str, value: &impl Serialize) -> Result<FileStamp, DatabaseError> {
        let path = self.folder.path(name);
        self.publish(&path, json::encode(&path, value)?.as_bytes())
    }

    /// Publishes bytes of another format under one of the names of [`files`].
    ///
    /// # Errors
    /// As [`Database::write_tile`].
    pub fn write_bytes(&self, name: &str, bytes: &[u8]) -> Result<FileStamp, DatabaseError> {
        self.publish(&self.folder.path(name), bytes)
    }

    /// Publishes the report, which says of which `database.json` it is and lists the files `beside` it; those that an
    /// earlier run left and that it does not list are removed.
    ///
    /// # Errors
    /// As [`Database::write_tile`].
    pub fn write_report(&self, report: &mut Report, manifest: &Manifest) -> Result<(), DatabaseError> {
        let is_listed = |name: &&&str| report.files.contains_key(**name);
        files::BESIDE_REPORT.iter().filter(|name| !is_listed(name)).try_for_each(|name| self.remove(name))?;
        let of_database = manifest.encode(&self.folder.path(files::DATABASE))?;
        report.files.insert(files::DATABASE.to_owned(), FileStamp::of(of_database.as_bytes()));
        self.write_json(files::REPORT, report)?;
        Ok(())
    }

    /// Removes a file by its name inside the directory, if it is there.
    ///
    /// # Errors
    /// When it cannot be removed.
    pub fn remove(&self, name: &str) -> Result<(), DatabaseError> {
        self.remove_if_there(&self.folder.path(name))
    }

    /// Begins as [`Database::begin`] does, and removes every file a build has made, for a fresh start. A reader finds
    /// an incomplete database meanwhile, and so does a build after this one was ended.
    ///
    /// # Errors
    /// When `database.json` cannot be written, or something not removed.
    ///
    /// # Panics
    /// When `manifest` is not incomplete.
    pub fn begin_afresh(&self, manifest: &Manifest) -> Result<(), DatabaseError> {
        self.begin(manifest)?;
        self.remove(files::ALLOCATION)?;
        for name in FOLDERS {
            for path in self.folder.list(&self.folder.path(name))? {
                let is_ours = KINDS.iter().any(|(ending, _)| path.to_string_lossy().ends_with(ending));
                if is_ours && matches!(self.folder.store().entry(&path), Ok(Entry::File(_))) {
                    self.remove_if_there(&path)?;
                }
            }
        }
        Ok(())
    }

    /// Says, before a build changes its first file, that the files no longer belong together; on the disk when this
    /// returns. What was reported of the files before is removed.
    ///
    /// # Errors
    /// When `database.json` cannot be written.
    ///
    /// # Panics
    /// When `manifest` is not incomplete.
    pub fn begin(&self, manifest: &Manifest) -> Result<(), DatabaseError> {
        assert_eq!(manifest.state, ManifestState::Incomplete, "a build begins incomplete");
        // By this file a later build knows that the others are ours.
        self.write_manifest(manifest, Durability::Now)?;
        reports().try_for_each(|name| self.remove(name))
    }

    /// Says that the build is complete, once every file it lists and every report is on the disk.
    ///
    /// # Errors
    /// When a listed file is missing or anything cannot be written.
    ///
    /// # Panics
    /// When `manifest` is not complete.
    pub fn finish(&self, manifest: &Manifest) -> Result<(), DatabaseError> {
        assert_eq!(manifest.state, ManifestState::Complete, "a build ends complete");
        let paths: Vec<PathBuf> = self.folder.listed_files(manifest).into_iter().map(|(path, _)| path).collect();
        let store = self.folder.store();
        if let Some(path) = paths.iter().find(|path| store.entry(path).is_err()) {
            return Err(DatabaseError::Missing { path: path.clone() });
        }
        let reports = reports().map(|name| self.folder.path(name)).filter(|path| store.entry(path).is_ok());
        let paths: Vec<PathBuf> = paths.iter().cloned().chain(reports).collect();
        let (dir, folders) = (self.folder.dir(), FOLDERS.map(|name| self.folder.path(name)));
        store.sync(dir, &paths, &folders).map_err(|source| DatabaseError::from_io("sync", dir, 0, source))?;
        self.write_manifest(manifest, Durability::Now)
    }

    fn write_manifest(&self, manifest: &Manifest, durability: Durability) -> Result<(), DatabaseError> {
        let path = self.folder.path(files::DATABASE);
        self.write(&path, manifest.encode(&path)?.as_bytes(), durability)
    }

    fn publish(&self, path: &Path, bytes: &[u8]) -> Result<FileStamp, DatabaseError> {
        self.write(path, bytes, Durability::Later)?;
        Ok(FileStamp::of(bytes))
    }

    fn write(&self, path: &Path, bytes: &[u8], durability: Durability) -> Result<(), DatabaseError> {
        let written = again(|| self.folder.store().replace(path, bytes, durability));
        written.map_err(|source| DatabaseError::from_io("write", path, bytes.len() as u64, source))
    }

    fn remove_if_there(&self, path: &Path) -> Result<(), DatabaseError> {
        match self.folder.store().remove(path) {
            Err(source) if source.kind() != ErrorKind::NotFound => {
                Err(DatabaseError::from_io("remove", path, 0, source))
            }
            _ => Ok(()),
        }
    }
}

/// Whether a database of `area` may be built in `folder`, and what `database.json` says, if it is there and can be
/// believed. Changes nothing.
fn examine(folder: &Folder, area: &Area) -> Result<Option<Manifest>, DatabaseError> {
    let dir = folder.dir();
    let not_ours = |found: &str| DatabaseError::NotOurFolder { path: dir.to_path_buf(), found: found.into() };
    match folder.store().target(dir) {
        Ok(Entry::Folder) => {}
        Ok(Entry::File(_) | Entry::Other) => return Err(not_ours("a file")),
        Err(_) if matches!(folder.store().entry(dir), Ok(Entry::Other)) => {
            return Err(not_ours("a link that leads nowhere"));
        }
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(DatabaseError::from_io("open", dir, 0, source)),
    }
    for name in FOLDERS {
        check_folder(folder, &folder.path(name))?;
    }
    match folder.manifest() {
        Ok(manifest) => {
            manifest.check_area(&folder.path(files::DATABASE), area)?;
            return Ok(Some(manifest));
        }
        // Where it is damaged, other files tell by themselves what they were made from.
        Err(DatabaseError::WrongChecksum { .. }) => refuse_others(folder)?,
        // A build makes all of its folders before that file; one that was cut short lies among them.
        Err(DatabaseError::Malformed { .. }) if FOLDERS.iter().all(|name| is_folder(folder, name)) => {
            refuse_others(folder)?;
        }
        Err(
            error @ (DatabaseError::Missing { .. }
            | DatabaseError::NotADatabase { .. }
            | DatabaseError::Malformed { .. }),
        ) => {
            let refused = refuse_filled(folder, &error);
            // Another process may have begun a build after `database.json` was looked for.
            if refused.is_err()
                && let Ok(manifest) = folder.manifest()
            {
                manifest.check_area(&folder.path(files::DATABASE), area)?;
                return Ok(Some(manifest));
            }
            refused?;
        }
        Err(error) => return Err(error),
    }
    Ok(None)
}

/// Refuses a directory whose `database.json` was ours and is damaged if a build would not make all that lies there.
fn refuse_others(folder: &Folder) -> Result<(), DatabaseError> {
    let ours = || [LOCK_NAME, WORK, files::DATABASE].into_iter().chain(FOLDERS).chain(reports());
    let is_ours = |name: &str| ours().any(|our| our == name) || is_temporary(name);
    let names = folder.list(folder.dir())?.into_iter().map(|path| name_of(&path));
    let other = names.into_iter().find(|name| !is_ours(name));
    other.map_or(Ok(()), |name| {
        let found = format!("{name:?} in it and a damaged {}", files::DATABASE);
        Err(DatabaseError::NotOurFolder { path: folder.dir().to_path_buf(), found })
    })
}

fn is_folder(folder: &Folder, name: &str) -> bool {
    matches!(folder.store().entry(&folder.path(name)), Ok(Entry::Folder))
}

fn name_of(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Refuses a directory without a `database.json` of ours in which there is anything to lose, whatever it is called:
/// a build that was ended before it wrote that file has left its lock and empty folders.
fn refuse_filled(folder: &Folder, why: &DatabaseError) -> Result<(), DatabaseError> {
    let (dir, store) = (folder.dir(), folder.store());
    for path in folder.list(dir)? {
        let name = name_of(&path);
        let is_nothing = match store.entry(&path) {
            Ok(Entry::File(_)) => name == LOCK_NAME || is_temporary(&name),
            Ok(Entry::Folder) => FOLDERS.contains(&name.as_str()) && folder.list(&path)?.is_empty(),
            Ok(Entry::Other) => false,
            // Another process has taken it away meanwhile.
            Err(error) => error.kind() == ErrorKind::NotFound,
        };
        if !is_nothing {
            let found = match (name == files::DATABASE, why) {
                (true, DatabaseError::Malformed { what, .. }) => format!("a {name} that no build wrote ({what})"),
                _ => format!("{name:?} in it and no {}", files::DATABASE),
            };
            return Err(DatabaseError::NotOurFolder { path: dir.to_path_buf(), found });
        }
    }
    Ok(())
}

/// Does what fails where another process sweeps up at the same moment, and takes a temporary file or a folder of
/// `work/` away: once more, a few times.
fn again<R>(mut done: impl FnMut() -> io::Result<R>) -> io::Result<R> {
    const TRIES: usize = 5;
    for _ in 1..TRIES {
        match done() {
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            done => return done,
        }
    }
    done()
}

/// Makes a folder inside the database, unless it is there.
fn make_folder(folder: &Folder, path: &Path) -> Result<(), DatabaseError> {
    match folder.store().make_folder(path) {
        Err(source) if source.kind() != ErrorKind::AlreadyExists => {
            Err(DatabaseError::from_io("create", path, 0, source))
        }
        _ => check_folder(folder, path),
    }
}

/// A folder of ours is a real one: output never follows a link out of the directory.
fn check_folder(folder: &Folder, path: &Path) -> Result<(), DatabaseError> {
    match folder.store().entry(path) {
        Ok(Entry::File(_) | Entry::Other) => Err(DatabaseError::NotAFolder { path: path.to_path_buf() }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests;
