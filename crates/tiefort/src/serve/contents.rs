//! What a database holds, as its record and the headers of its files say.

use std::fs;
use std::path::{Path, PathBuf};

use load_module_reader::{AreaFrame, Block, Keep, TileFile};
use store::{FileStamp, Fingerprint, Folder, Manifest};
use terrain::TileId;

use crate::failure::{Cause, Failure};

/// The name of the record.
pub const RECORD: &str = "database.json";

/// The file of a tile's load modules.
pub struct TileModulesFile {
    pub tile: TileId,
    pub path: PathBuf,
    /// The load modules in it.
    pub block: Block,
    /// How it must look.
    pub stamp: FileStamp,
}

/// What a database holds.
pub struct Contents {
    pub folder: PathBuf,
    /// What `database.json` says.
    pub manifest: Manifest,
    /// Of `database.json`, which holds the checksum of every file.
    pub fingerprint: Fingerprint,
    /// Where load modules lie.
    pub frame: AreaFrame,
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
            files.push(TileModulesFile { tile: tile.tile(), path, block, stamp });
        }
        let frame = frame.ok_or_else(|| damaged(&"found no load modules, expected some"))?;
        let fingerprint = Fingerprint::of_bytes(&bytes);
        Ok(Self { folder: folder.to_path_buf(), manifest, fingerprint, frame, files })
    }
}

fn damaged(error: &dyn std::fmt::Display) -> Failure {
    let hint = "`tiefort verify` says what is damaged, `tiefort build` mends it";
    Failure::about(Cause::Database, error, hint)
}
