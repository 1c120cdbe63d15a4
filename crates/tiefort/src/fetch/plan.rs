//! Which ranges of which files a job needs.
//!
//! For directories, the bytes of a file of another machine are fetched in blocks as they are read.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use build::ground::{GroundError, groups_needed, needed};
use job::{FeatureSource, Job, Lock, Locked, NamedFile, SourceFile};
use schedule::{ScheduleError, Workers};
use source_files::{Crs, GeoParquet, TiffLevels};
use store::engine::Fingerprint;

use super::address::{Address, in_bucket};
use super::check::{Refused, check_raster, is_page};
use super::client::{Client, REQUESTS};
use super::fault::{Fault, changed};
use super::pieces::{Piece, Pieces, folder_of, joined, whole};
use super::s3::Listed;

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
    pub(super) remotes: Vec<Remote>,
    pub(super) pieces: Vec<Piece>,
    pub(super) store: Pieces,
}

/// A file on a server. Those of one pattern lie one behind the other in the numbering of their bytes.
pub struct Remote {
    pub(super) address: Address,
    /// The server's mark of its version.
    pub(super) etag: String,
    /// The number of its first byte.
    pub(super) base: u64,
    /// Its bytes.
    pub(super) total: u64,
}

/// What of a file is fetched.
pub enum What {
    /// Row groups of files with the same columns.
    Groups(Vec<(GeoParquet, Vec<usize>)>),
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

    /// The file that a byte is of.
    pub(super) fn remote(&self, byte: u64) -> &Remote {
        &self.remotes[self.remotes.partition_point(|remote| remote.base <= byte) - 1]
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

/// Whether a file that a lock has is here as it was fetched and as the server has it; with `update` also whether a
/// build could read it.
///
/// # Errors
/// When the server has another version, or none.
pub fn kept(client: &Client, job: &Job, file: &NamedFile, (lock, update): (&Lock, bool)) -> Result<Kept, Fault> {
    let Some(locked) = lock.of(&file.written) else { return Ok(Kept::Not) };
    let (total, etag) = match pattern_of(&file.written) {
        Some((bucket, pattern)) => {
            let (total, mark) = mark_of(&client.list(bucket, pattern)?);
            (Some(total), mark)
        }
        None => {
            let (_, total, etag) = client.look(&client.address(&file.path.to_string_lossy())?)?;
            (total, etag)
        }
    };
    let is_same = etag == locked.etag && total.is_none_or(|total| total == locked.remote_len);
    if !is_same {
        let version =
            |etag: &str, total: u64| if etag.is_empty() { format!("of {total} bytes") } else { etag.to_owned() };
        let found = version(&etag, total.unwrap_or(0));
        return Err(changed(&file.written, &version(&locked.etag, locked.remote_len), &found));
    }
    let is_of_area = locked.window.is_none() || lock.area == job.fetch_area();
    let is_here = is_of_area && is_whole(locked, &job.path);
    Ok(if is_here && (!update || is_read(client, job, locked)?) { Kept::Here } else { Kept::Not })
}

/// Whether a build could read a file that is here as it came.
fn is_read(client: &Client, job: &Job, locked: &Locked) -> Result<bool, Fault> {
    let path = locked.path(&job.path);
    match raster_of(job, &locked.address) {
        None => Ok(!is_page(&path).map_err(|error| disk(&path, &error))?),
        Some(raster) => match check_raster(client, raster, &path) {
            Ok(()) => Ok(true),
            Err(Refused::Header(_) | Refused::Heights(_)) => Ok(false),
            Err(Refused::Stopped(fault)) => Err(fault),
        },
    }
}

/// The raster of a job that an address stands for.
pub(super) fn raster_of<'j>(job: &'j Job, written: &str) -> Option<&'j SourceFile> {
    job.remote_rasters().into_iter().find(|raster| raster.written == written)
}

/// The bucket and the pattern of an address that stands for several files.
fn pattern_of(written: &str) -> Option<(&str, &str)> {
    in_bucket(written).filter(|(_, key)| key.contains('*'))
}

/// Bytes of some files, and a mark of their versions.
fn mark_of(files: &[Listed]) -> (u64, String) {
    let text: String = files.iter().map(|file| format!("{} {} {}\n", file.key, file.len, file.etag)).collect();
    let digits = Fingerprint::of_bytes(text.as_bytes()).to_string();
    (files.iter().map(|file| file.len).sum(), format!("list-{}", &digits[..32]))
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
    let raster = raster_of(job, &file.written);
    let is_tiff = [".tif", ".tiff"].iter().any(|ending| file.written.to_lowercase().ends_with(ending));
    let is_parquet = [".parquet", ".geoparquet"].iter().any(|ending| file.written.to_lowercase().ends_with(ending));
    let vector = vector_of(job, &file.written);
    match (raster, vector, pattern_of(&file.written)) {
        (None, Some(crs), pattern) if is_parquet || pattern.is_some() => {
            groups(client, job, (file, crs), pattern, path)
        }
        (_, _, Some(_)) => {
            let hint = "name each file of its own";
            Err(Fault::hinted(format!("{}: a pattern, where only GeoParquet may be named by one", file.written), hint))
        }
        (Some(raster), ..) if is_tiff => {
            window(client, job, raster, (client.address(&file.path.to_string_lossy())?, path))
        }
        _ => all_of(client, &file.written, (client.address(&file.path.to_string_lossy())?, path)),
    }
}

/// The system that a job says a file of features or objects to be in, if it says one; `None` where it is none of them.
fn vector_of<'j>(job: &'j Job, written: &str) -> Option<Option<&'j str>> {
    let features = job.features.iter().flat_map(|features| &features.sources).find_map(|source| match source {
        FeatureSource::File { file, crs, .. } if file.written == written => Some(crs.as_deref()),
        _ => None,
    });
    let mut objects = job.objects.iter().flat_map(|objects| &objects.sources);
    features.or_else(|| objects.find(|source| source.file.written == written).map(|source| source.crs.as_deref()))
}

/// The row groups of a GeoParquet file, or of the files that fit a pattern, that an area needs.
fn groups(
    client: &Client,
    job: &Job,
    (file, crs): (&NamedFile, Option<&str>),
    pattern: Option<(&str, &str)>,
    path: PathBuf,
) -> Result<Planned, Fault> {
    /// Bytes between files, so that no range reaches over two.
    const APART: u64 = 1 << 20;
    let addresses = match pattern {
        None => vec![client.address(&file.path.to_string_lossy())?],
        Some((bucket, pattern)) => {
            let files = client.list(bucket, pattern)?;
            files.iter().map(|file| client.address(&format!("s3://{bucket}/{}", file.key))).collect::<Result<_, _>>()?
        }
    };
    let crs = crs.map(Crs::named).transpose().map_err(unusable)?;
    let read = schedule::for_each_independent(&addresses, &Workers::new(REQUESTS), client.stop(), |_, address| {
        let (found, remote) = footer(client, address)?;
        let groups = groups_needed(job, &found, crs.as_ref()).map_err(|error| of_ground(&error))?;
        Ok((found, groups, remote))
    });
    let read = read.map_err(|error| stopped_or(error, &file.written))?;
    let (mut files, mut remotes, mut extents, mut base) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for (found, groups, mut remote) in read {
        remote.base = base;
        extents.extend(found.ranges(&groups).into_iter().map(|(start, len)| (base + start, len)));
        base += remote.total + APART;
        files.push((found, groups));
        remotes.push(remote);
    }
    let (etag, total) = match (pattern, remotes.as_slice()) {
        (None, [remote]) => (remote.etag.clone(), remote.total),
        _ => {
            let listed = |remote: &Remote| Listed {
                key: remote.address.key().to_owned(),
                len: remote.total,
                etag: remote.etag.clone(),
            };
            let (total, mark) = mark_of(&remotes.iter().map(listed).collect::<Vec<_>>());
            (mark, total)
        }
    };
    let (written, pieces) = (file.written.clone(), joined(extents));
    let store = opened(&path, &format!("{etag}\n{total}\n{}", job.fetch_area()))?;
    Ok(Planned { written, path, what: What::Groups(files), etag, total, remotes, pieces, store })
}

/// The footer of a GeoParquet file, in at most three requests.
fn footer(client: &Client, address: &Address) -> Result<(GeoParquet, Remote), Fault> {
    let (has_ranges, total, etag) = client.look(address)?;
    let Some(total) = total.filter(|_| has_ranges) else {
        let hint = "fetch the file by other means, and name it by its path";
        return Err(Fault::hinted(format!("{address}: the server gives no parts of files"), hint));
    };
    let mut fault = None;
    let found = GeoParquet::read(Path::new(&address.to_string()), total, &mut |start, len| {
        client.range(address, start, len, Some(&etag)).map(|answer| answer.bytes).map_err(|error| {
            fault = Some(error.clone());
            io::Error::other(error.text)
        })
    });
    let found = found.map_err(|error| fault.unwrap_or_else(|| unusable(error.to_string())))?;
    Ok((found, Remote { address: address.clone(), etag, base: 0, total }))
}

/// Why work of several threads did not end.
pub(super) fn stopped_or<R>(error: ScheduleError<R, Fault>, written: &str) -> Fault {
    match error {
        ScheduleError::Failed { error, .. } => error,
        ScheduleError::Stopped { .. } => {
            Fault::hinted("stopped".into(), "run the same command again: what has come is kept")
        }
        ScheduleError::NoThread { message, .. } | ScheduleError::Panicked { message, .. } => {
            Fault::last(format!("{written}: {message}"))
        }
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
    let remotes = vec![Remote { address, etag: etag.clone(), base: 0, total }];
    Ok(Planned { written: written.to_owned(), path, what, etag, total, remotes, pieces, store })
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
    let remotes = vec![Remote { address, etag: etag.clone(), base: 0, total }];
    Ok(Planned { written: raster.written.clone(), path, what, etag, total, remotes, pieces, store })
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

/// Bytes of a block: the directories of a raster of a degree lie in the first.
const BLOCK: u64 = 16 << 10;
/// Blocks of one file, at most: directories of four million tiles.
const BLOCKS_MAX: usize = 1 << 13;

/// A file of another machine, open for reading.
struct RemoteReader<'a> {
    client: &'a Client<'a>,
    address: Address,
    /// Its bytes.
    pub total: u64,
    /// The server's mark of its version.
    pub etag: String,
    at: u64,
    blocks: BTreeMap<u64, Vec<u8>>,
    /// Why the last read failed; an `io::Error` has no room for a hint.
    pub fault: Option<Fault>,
}

impl<'a> RemoteReader<'a> {
    /// Opens the file by its first block.
    ///
    /// # Errors
    /// When the server does not give it.
    pub fn open(client: &'a Client<'a>, address: Address) -> Result<Self, Fault> {
        let first = client.range(&address, 0, BLOCK, None)?;
        let blocks = BTreeMap::from([(0, first.bytes)]);
        Ok(Self { client, address, total: first.total, etag: first.etag, at: 0, blocks, fault: None })
    }

    fn block(&mut self, number: u64) -> io::Result<&[u8]> {
        if !self.blocks.contains_key(&number) {
            if BLOCKS_MAX <= self.blocks.len() {
                return Err(io::Error::other("its directories are too long"));
            }
            let answer = self.client.range(&self.address, number * BLOCK, BLOCK, Some(&self.etag));
            let answer = answer.map_err(|fault| {
                self.fault = Some(fault.clone());
                io::Error::other(fault.text)
            })?;
            self.blocks.insert(number, answer.bytes);
        }
        Ok(&self.blocks[&number])
    }
}

impl Read for RemoteReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.total <= self.at {
            return Ok(0);
        }
        let (number, inside) = (self.at / BLOCK, (self.at % BLOCK) as usize);
        let block = self.block(number)?;
        let taken = buffer.len().min(block.len().saturating_sub(inside));
        buffer[..taken].copy_from_slice(&block[inside..inside + taken]);
        self.at += taken as u64;
        Ok(taken)
    }
}

impl Seek for RemoteReader<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => self.total.checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at = at.ok_or_else(|| io::Error::from(io::ErrorKind::InvalidInput))?;
        Ok(self.at)
    }
}
