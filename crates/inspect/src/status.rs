//! How far a database is, from what lies in its directory: nothing is believed that the files do not bear out.

use std::collections::BTreeSet;
use std::io::Read;
use std::path::Path;

use build::{CompileError, run_name};
use load_module_reader::{MAGIC, open_file};
use store::engine::Held;
use store::{Folder, Lock, Manifest, ManifestState, TileRecord, TileState};
use terrain::TileId;

/// How one tile stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TileProgress {
    /// Published, by the last finished build or by the one under way.
    Done,
    /// Published, with a limit that could not be met.
    OverLimit,
    /// Published, its sides held as its neighbours have them.
    Frozen,
    /// Published by the build before; the one under way has not replaced it yet, and may keep it.
    Earlier,
    /// Not published, or its file is gone.
    Missing,
}

/// How a database stands.
#[derive(Clone, Debug)]
pub struct Status {
    /// Its `database.json`.
    pub manifest: Manifest,
    /// Who is at work on it now.
    pub held: Held,
    /// Every tile, row by row.
    pub tiles: Vec<(TileId, TileProgress)>,
    /// What shows of damage to a finished one without reading its files, a sentence each.
    pub damage: Vec<String>,
    /// Whether only some tiles of it were made again since what all are made from had changed.
    pub is_outdated: bool,
    /// The versions of the format that its files of load modules have, in ascending order.
    pub formats: BTreeSet<u16>,
}

impl Status {
    /// Whether every file belongs to one finished build.
    pub fn is_complete(&self) -> bool {
        self.manifest.state == ManifestState::Complete
    }

    /// Tiles that are frozen: a build makes them whole.
    pub fn frozen(&self) -> Vec<TileId> {
        let is_frozen = |record: &&TileRecord| record.state == TileState::Frozen;
        self.manifest.tiles.iter().filter(is_frozen).map(TileRecord::tile).collect()
    }
}

/// Reads how a database stands, without touching it.
///
/// # Errors
/// When there is none, or its `database.json` cannot be read.
pub fn status(folder: &Path) -> Result<Status, CompileError> {
    let folder = Folder::new(folder);
    let manifest = folder.manifest()?;
    let held = Lock::held(&folder);
    let complete = manifest.state == ManifestState::Complete;
    let work = folder.work(&run_name(&manifest.job, &manifest.sources, manifest.algorithm_revision));
    let marked: BTreeSet<String> = work.marks().all()?.into_iter().collect();
    let progress = |record: &TileRecord| match complete {
        true => finished(&folder, record),
        false if marked.contains(&format!("refine-{}", record.tile())) => TileProgress::Done,
        false => under_way(&folder, record),
    };
    let tiles = manifest.tiles.iter().map(|record| (record.tile(), progress(record))).collect();
    let paths = manifest.tiles.iter().map(|record| folder.modules_path(record.tile()));
    let formats = paths.filter_map(|path| format_of(&path)).collect();
    let damage = if complete { folder.visible_damage(&manifest) } else { Vec::new() };
    let damage = damage.iter().map(|damage| damage.error.to_string()).collect();
    let is_outdated = complete && is_outdated(&folder);
    Ok(Status { manifest, held, tiles, damage, is_outdated, formats })
}

/// Whether only some tiles of a finished database were made again since what all are made from had changed.
pub(crate) fn is_outdated(folder: &Folder) -> bool {
    folder.report().is_ok_and(|report| report.outdated)
}

/// The version of the format that a file of load modules names; nothing where there is no such file.
fn format_of(path: &Path) -> Option<u16> {
    let mut start = [0; 10];
    open_file(path).ok()?.read_exact(&mut start).ok()?;
    start.starts_with(&MAGIC).then(|| u16::from_le_bytes([start[8], start[9]]))
}

fn finished(folder: &Folder, record: &TileRecord) -> TileProgress {
    let tile = record.tile();
    let paths = [folder.tile_path(tile), folder.modules_path(tile)];
    match record.state {
        _ if !paths.iter().all(|path| path.exists()) => TileProgress::Missing,
        TileState::Done => TileProgress::Done,
        TileState::OverLimit => TileProgress::OverLimit,
        TileState::Frozen => TileProgress::Frozen,
        TileState::Failed | TileState::Missing => TileProgress::Missing,
    }
}

/// A file with the bytes of the last finished build is that build's; any other is of the one under way.
fn under_way(folder: &Folder, record: &TileRecord) -> TileProgress {
    let path = folder.tile_path(record.tile());
    match record.tin {
        _ if folder.read_tile(record.tile()).is_err() => TileProgress::Missing,
        Some(before) if folder.check_file(&path, &before).is_ok() => TileProgress::Earlier,
        _ => TileProgress::Done,
    }
}
