//! What a database holds, as its record and the headers of its files say; and its load modules, read from files that
//! are those of the record.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

use load_module_reader::{Area, AreaFrame, Block, Keep, LoadedGround, TileFile};
use store::{FileStamp, Fingerprint, Folder, Manifest};
use terrain::TileId;

use crate::failure::{Cause, Failure};

/// The name of the record.
pub const RECORD: &str = "database.json";

/// How a file looked: every change of it is a new file, or has another time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileLook {
    modified: Option<SystemTime>,
    length: u64,
    #[cfg(unix)]
    inode: u64,
}

impl FileLook {
    /// `None` where there is none.
    pub fn of(path: &Path) -> Option<Self> {
        let found = fs::metadata(path).ok()?;
        Some(Self {
            modified: found.modified().ok(),
            length: found.len(),
            #[cfg(unix)]
            inode: std::os::unix::fs::MetadataExt::ino(&found),
        })
    }
}

/// The file of a tile's load modules.
pub struct TileModulesFile {
    /// Which tile.
    pub tile: TileId,
    /// Where it lies.
    pub path: PathBuf,
    /// The load modules in it.
    pub block: Block,
    /// How it must look.
    pub stamp: FileStamp,
    /// How it looked when it was found to be the one of this build.
    sound: Mutex<Option<FileLook>>,
}

/// What a database holds.
pub struct Contents {
    /// Where it lies.
    pub folder: PathBuf,
    /// What `database.json` says.
    pub manifest: Manifest,
    /// Of `database.json`, which holds the checksum of every file.
    pub fingerprint: Fingerprint,
    /// Where load modules lie.
    pub frame: AreaFrame,
    /// Its load-module files.
    pub files: Vec<TileModulesFile>,
}

impl Contents {
    /// Reads the record and the headers of all files.
    ///
    /// # Errors
    /// When the database is unfinished, damaged or missing.
    pub fn read(folder: &Path) -> Result<Self, Failure> {
        let of_folder = Folder::new(folder);
        let manifest = of_folder.finished()?;
        let record = folder.join(RECORD);
        let bytes = fs::read(&record).map_err(|error| damaged(&format!("{}: {error}", record.display())))?;
        let mut files = Vec::new();
        let mut frame = None;
        for tile in &manifest.tiles {
            let Some(stamp) = tile.slm else { continue };
            let path = of_folder.modules_path(tile.tile());
            let file = TileFile::open(&path, Keep::OnDisk).map_err(|error| damaged(&error))?;
            let header = file.header();
            let block = Block { south: header.south, west: header.west, north: header.north, east: header.east };
            frame.get_or_insert_with(|| AreaFrame::of(header));
            files.push(TileModulesFile { tile: tile.tile(), path, block, stamp, sound: Mutex::default() });
        }
        let frame = frame.ok_or_else(|| damaged(&"found no load modules, expected some"))?;
        let fingerprint = Fingerprint::of_bytes(&bytes);
        Ok(Self { folder: folder.to_path_buf(), manifest, fingerprint, frame, files })
    }

    /// The files that hold load modules of a block, each the one of this build.
    ///
    /// # Errors
    /// When one is missing, damaged or of another build.
    pub fn files_of(&self, block: Block) -> Result<Vec<&TileModulesFile>, Failure> {
        let touches = |file: &Block| {
            file.south < block.north && block.south < file.north && file.west < block.east && block.west < file.east
        };
        let files: Vec<&TileModulesFile> = self.files.iter().filter(|file| touches(&file.block)).collect();
        files.iter().try_for_each(|file| self.check(file))?;
        Ok(files)
    }

    /// Checks that a file is the one of this build, byte by byte unless it looks as it did when it was found to be.
    ///
    /// # Errors
    /// When it is missing, damaged or of another build.
    pub fn check(&self, file: &TileModulesFile) -> Result<(), Failure> {
        // Others wait: it is read once however many ask.
        let mut sound = file.sound.lock().unwrap_or_else(PoisonError::into_inner);
        let look = FileLook::of(&file.path);
        if look.is_some() && *sound == look {
            return Ok(());
        }
        let folder = Folder::new(&self.folder);
        if let Err(other) = folder.check_modules(&self.manifest, file.tile) {
            // Reading it tells what is damaged; what is sound is of another build.
            return Err(folder.read_levels(&self.manifest, file.tile).err().unwrap_or(other).into());
        }
        *sound = look;
        Ok(())
    }
}

/// A finished database, of which load modules are taken as they are needed.
pub struct Opened {
    /// What it says of itself.
    pub contents: Contents,
    /// Load modules of its files; [`Contents::files_of`] says whether those are of this build.
    pub area: Area,
}

impl Opened {
    /// Opens the database in a folder.
    ///
    /// # Errors
    /// When it is unfinished, damaged or missing.
    pub fn open(folder: &Path) -> Result<Self, Failure> {
        let contents = Contents::read(folder)?;
        let area = Area::open(folder, Keep::OnDisk).map_err(|error| damaged(&error))?;
        Ok(Self { contents, area })
    }

    /// The load modules of a block.
    ///
    /// # Errors
    /// When a file is missing, damaged or of another build, or the block does not lie in the area.
    pub fn load(&self, block: Block) -> Result<LoadedGround, Failure> {
        self.contents.files_of(block)?;
        self.area.load(block).map_err(|error| damaged(&error))
    }
}

/// Why a database cannot be read, and what to do.
pub fn damaged(error: &dyn std::fmt::Display) -> Failure {
    let hint = "`tiefort verify` says what is damaged, `tiefort build` mends it";
    Failure::about(Cause::Database, error, hint)
}
