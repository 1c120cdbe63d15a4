//! Which ranges of which files a job needs.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use build::ground::{GroundError, needed};
use job::{Job, Lock, Locked, NamedFile, SourceFile};
use source_files::TiffLevels;
use store::engine::Fingerprint;

use super::address::Address;
use super::client::Client;
use super::fault::{Fault, changed};
use super::pieces::{Piece, Pieces, folder_of, joined, whole};
use super::reader::RemoteReader;

/// A file that is to be fetched.
pub struct Planned {
    /// As messages and the lock have it.
    pub written: String,
    /// Where it will lie.
    pub path: PathBuf,
    /// What of it.
    pub what: What,
    /// The server's mark of its version.
    pub etag: String,
    /// Bytes of the whole file on the server.
    pub total: u64,
    pub(super) address: Address,
    pub(super) pieces: Vec<Piece>,
    pub(super) store: Pieces,
}

/// What of a file is fetched.
pub enum What {
    /// The strips or tiles of a level of a raster.
    Window {
        /// The directories of the raster.
        levels: TiffLevels,
        /// Which level; 0 is the raster itself.
        level: usize,
        /// Which strips or tiles.
        chunks: Vec<u32>,
        /// Metres between posts of that level, about.
        spacing_m: f64,
    },
    /// All of it; whether in ranges.
    Whole {
        /// Whether the server gives parts of it.
        has_ranges: bool,
    },
}

impl Planned {
    /// Bytes that are still to come.
    pub fn left(&self) -> u64 {
        match self.what {
            What::Whole { has_ranges: false } => self.total,
            _ => self.pieces.iter().filter(|piece| !self.store.has(**piece)).map(|piece| piece.len).sum(),
        }
    }

    /// Bytes of all that is fetched of it.
    pub fn bytes(&self) -> u64 {
        if let What::Whole { .. } = self.what { self.total } else { self.pieces.iter().map(|piece| piece.len).sum() }
    }
}

/// What became of a file that was fetched before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// It is here, and the server has the same version.
    Here,
    /// It is to be fetched, again.
    Not,
}

/// Whether a file that a lock has is here as it was fetched and as the server has it.
///
/// # Errors
/// When the server has another version, or none.
pub fn kept(client: &Client, job: &Job, file: &NamedFile, lock: &Lock) -> Result<Kept, Fault> {
    let Some(locked) = lock.of(&file.written) else { return Ok(Kept::Not) };
    let (_, total, etag) = client.look(&client.address(&file.path.to_string_lossy())?)?;
    let is_same = etag == locked.etag && total.is_none_or(|total| total == locked.remote_len);
    if !is_same {
        let version =
            |etag: &str, total: u64| if etag.is_empty() { format!("of {total} bytes") } else { etag.to_owned() };
        let found = version(&etag, total.unwrap_or(0));
        return Err(changed(&file.written, &version(&locked.etag, locked.remote_len), &found));
    }
    let is_of_area = locked.window.is_none() || lock.area == job.fetch_area();
    Ok(if is_of_area && is_whole(locked, &job.path) { Kept::Here } else { Kept::Not })
}

fn is_whole(locked: &Locked, job: &Path) -> bool {
    let hash = File::open(locked.path(job)).ok().map(Fingerprint::of_reader);
    hash.is_some_and(|hash| hash.is_ok_and(|hash| hash.to_string() == locked.blake3))
}

/// What is to be fetched of a file that will lie at `path`.
///
/// # Errors
/// When the server does not give it, or a raster cannot be used.
pub fn plan(client: &Client, job: &Job, file: &NamedFile, path: PathBuf) -> Result<Planned, Fault> {
    let address = client.address(&file.path.to_string_lossy())?;
    let raster = job.remote_rasters().into_iter().find(|raster| raster.written == file.written);
    let is_tiff = [".tif", ".tiff"].iter().any(|ending| file.written.to_lowercase().ends_with(ending));
    match raster.filter(|_| is_tiff) {
        Some(raster) => window(client, job, raster, (address, path)),
        None => all_of(client, &file.written, (address, path)),
    }
}

fn all_of(client: &Client, written: &str, (address, path): (Address, PathBuf)) -> Result<Planned, Fault> {
    let (has_ranges, total, etag) = client.look(&address)?;
    let total = total.ok_or_else(|| {
        let hint = "fetch the file by other means, and name it by its path";
        Fault::hinted(format!("{address}: the server does not say how long it is"), hint)
    })?;
    let store = opened(&path, &format!("{etag}\n{total}"))?;
    let pieces = if has_ranges { whole(total) } else { Vec::new() };
    let what = What::Whole { has_ranges };
    Ok(Planned { written: written.to_owned(), path, what, etag, total, address, pieces, store })
}

fn window(
    client: &Client,
    job: &Job,
    raster: &SourceFile,
    (address, path): (Address, PathBuf),
) -> Result<Planned, Fault> {
    let mut reader = RemoteReader::open(client, address.clone())?;
    let total = reader.total;
    let levels = TiffLevels::read(&mut reader, total, Path::new(&raster.written));
    let levels = levels.map_err(|error| reader.fault.take().unwrap_or_else(|| unusable(error.to_string())))?;
    let etag = std::mem::take(&mut reader.etag);
    let store = opened(&path, &format!("{etag}\n{total}\n{}", job.fetch_area()))?;
    let name = path.file_name().expect("the file has a name");
    // The raster without its posts says where they lie, as the build will see it.
    let place = store.beside("directory").join(name);
    let see = |level: usize| {
        written(&place, &levels, level).map_err(|error| disk(&place, &error))?;
        needed(job, raster, &place).map_err(|error| of_ground(&error))
    };
    let mut found = see(0)?;
    let level = level_for(&levels, found.spacing_m, job.area.spacing.metres());
    if 0 < level {
        found = see(level)?;
    }
    let (chunks, spacing_m) = (found.chunks, found.spacing_m);
    let pieces = joined(chunks.iter().map(|&chunk| levels.chunk(level, chunk)));
    let what = What::Window { levels, level, chunks, spacing_m };
    Ok(Planned { written: raster.written.clone(), path, what, etag, total, address, pieces, store })
}

/// The coarsest level whose posts are no farther apart than those of the working grid.
fn level_for(levels: &TiffLevels, posts_m: f64, spacing_m: f64) -> usize {
    let factor = |level: usize| levels.factors(level).into_iter().fold(1.0, f64::max);
    let fine = (0..levels.count()).filter(|&level| posts_m * factor(level) <= spacing_m);
    fine.max_by(|&a, &b| factor(a).total_cmp(&factor(b))).unwrap_or(0)
}

fn opened(path: &Path, version: &str) -> Result<Pieces, Fault> {
    let folder = folder_of(path);
    Pieces::open(folder.clone(), version).map_err(|error| disk(&folder, &error))
}

/// Writes a level of a raster without any of its strips or tiles.
fn written(place: &Path, levels: &TiffLevels, level: usize) -> io::Result<()> {
    place.parent().map_or(Ok(()), std::fs::create_dir_all)?;
    let mut out = BufWriter::new(File::create(place)?);
    levels.write(level, &[], &mut out, |_| Ok(Vec::new()))?;
    out.flush()
}

/// A file of this machine that cannot be written.
pub(super) fn disk(path: &Path, error: &io::Error) -> Fault {
    let hint = "check that the folder is writable and has room; what has come is kept";
    Fault::hinted(format!("{}: {error}", path.display()), hint)
}

fn unusable(text: String) -> Fault {
    Fault::hinted(text, "a build could not use this raster either: name another")
}

fn of_ground(error: &GroundError) -> Fault {
    unusable(error.to_string())
}
