//! A tile's file opened for paging: its header is decoded at once, its index when a load module is first asked for, and
//! load modules one by one. A file on disk is held open from then on: of an area of many, those that are near.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::{FILE_BYTES_MAX, Header, IndexEntry, Module, ReadError, index};

/// Where the bytes of files are kept while an area is open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// On disk: what is asked for is read then, mostly from the system's cache.
    OnDisk,
    /// In memory, all of them.
    InMemory,
}

/// The bytes of a whole file, wherever they are: a `Vec<u8>`, or a memory map of your own.
pub type Bytes = Arc<dyn AsRef<[u8]> + Send + Sync>;

/// A file whose load modules are decoded one by one.
pub struct TileFile {
    path: PathBuf,
    header: Header,
    indexed: OnceLock<Indexed>,
}

/// Where load modules lie, one entry for each and level: level by level, row by row from the south-west.
struct Indexed {
    index: Vec<IndexEntry>,
    source: Source,
}

enum Source {
    File(Mutex<File>),
    Bytes(Bytes),
}

impl std::fmt::Debug for TileFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Header { tile_row, tile_col, .. } = self.header;
        write!(f, "tile {tile_row},{tile_col} in {}", self.path.display())
    }
}

impl TileFile {
    /// Opens the file at `path`; of one that stays on disk only the header is read yet.
    ///
    /// # Errors
    /// When it cannot be read, or what is read is not as `docs/FORMAT.md` says; the error carries the path.
    pub fn open(path: impl AsRef<Path>, keep: Keep) -> Result<Self, ReadError> {
        let path = path.as_ref();
        let unreadable = |source| ReadError::Unreadable { path: path.to_path_buf(), source };
        let (mut file, found) = open_sized(path)?;
        if keep == Keep::InMemory {
            let mut bytes = Vec::with_capacity(found as usize);
            file.take(FILE_BYTES_MAX).read_to_end(&mut bytes).map_err(unreadable)?;
            return Self::of_bytes(path, Arc::new(bytes));
        }
        let start = read_start(&mut file, found, false).map_err(unreadable)?;
        let (header, header_length) = Header::parse(&start, found).map_err(|fault| in_file(path, fault))?;
        index::check_room(&header, header_length, found).map_err(|fault| in_file(path, fault))?;
        Ok(Self { path: path.to_path_buf(), header, indexed: OnceLock::new() })
    }

    /// A file whose bytes are in memory already; `name` is for messages.
    ///
    /// # Errors
    /// When header or index are not as `docs/FORMAT.md` says, or the file is too large.
    pub fn of_bytes(name: impl AsRef<Path>, bytes: Bytes) -> Result<Self, ReadError> {
        let path = name.as_ref();
        let whole = (*bytes).as_ref();
        let found = whole.len() as u64;
        if FILE_BYTES_MAX < found {
            return Err(in_file(path, ReadError::TooLarge { found, limit: FILE_BYTES_MAX }));
        }
        let (header, index) = parse_start(whole, whole.len() as u64).map_err(|fault| in_file(path, fault))?;
        let indexed = OnceLock::from(Indexed { index, source: Source::Bytes(bytes) });
        Ok(Self { path: path.to_path_buf(), header, indexed })
    }

    /// What holds for all load modules of the file.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// One entry per load module and level: level by level, row by row from the south-west.
    ///
    /// # Errors
    /// When the index is read only now and is not as `docs/FORMAT.md` says, or the file is another than when it was
    /// opened.
    pub fn index(&self) -> Result<&[IndexEntry], ReadError> {
        Ok(&self.indexed()?.index)
    }

    /// The index, read now if it was not before.
    fn indexed(&self) -> Result<&Indexed, ReadError> {
        if let Some(indexed) = self.indexed.get() {
            return Ok(indexed);
        }
        let unreadable = |source| ReadError::Unreadable { path: self.path.clone(), source };
        let (mut file, found) = open_sized(&self.path)?;
        let start = read_start(&mut file, found, true).map_err(unreadable)?;
        let (header, index) = parse_start(&start, found).map_err(|fault| in_file(&self.path, fault))?;
        if header != self.header {
            return Err(ReadError::Changed { path: self.path.clone() });
        }
        Ok(self.indexed.get_or_init(|| Indexed { index, source: Source::File(Mutex::new(file)) }))
    }

    /// Decodes and checks a level of the load modules of columns `cols` of one row of the area, all of which the file
    /// must hold. They lie side by side in the file, so they are read at once.
    ///
    /// # Errors
    /// When they cannot be read or are damaged.
    pub(crate) fn row(&self, level: u16, row: u32, cols: std::ops::Range<u32>) -> Result<Vec<Module>, ReadError> {
        let Some(first) = self.header.index_of(row, cols.start) else { return Ok(Vec::new()) };
        let level_count = self.header.level_count;
        if level_count <= level {
            return Err(in_file(&self.path, ReadError::NoSuchLevel { found: level, level_count }));
        }
        let first = first + usize::from(level) * self.header.module_count() as usize;
        let Indexed { index, source } = self.indexed()?;
        let entries = &index[first..first + cols.len()];
        let (Some(low), Some(high)) = (entries.first(), entries.last()) else { return Ok(Vec::new()) };
        let (start, end) = (low.offset, high.end());
        let read;
        let bytes = match source {
            Source::Bytes(bytes) => &(**bytes).as_ref()[start as usize..end as usize],
            Source::File(file) => {
                read = read_at(file, start, (end - start) as usize)
                    .map_err(|source| ReadError::Unreadable { path: self.path.clone(), source })?;
                &read
            }
        };
        let decode = |(col, entry): (u32, &IndexEntry)| {
            let section = &bytes[(entry.offset - start) as usize..(entry.end() - start) as usize];
            Module::parse(section, &self.header, entry, level, (row, col))
        };
        let modules: Result<Vec<Module>, ReadError> = cols.zip(entries).map(decode).collect();
        modules.map_err(|fault| in_file(&self.path, fault))
    }
}

/// Opens a file for reading. A pipe would wait for a writer, and a device may have no end.
///
/// # Errors
/// When there is none, or it is not a regular file.
pub fn open_file(path: &Path) -> Result<File, ReadError> {
    let unreadable = |source| ReadError::Unreadable { path: path.to_path_buf(), source };
    if !std::fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err(ReadError::NotAFile { path: path.to_path_buf() });
    }
    File::open(path).map_err(unreadable)
}

/// The same, and the bytes in it: not more than are read.
fn open_sized(path: &Path) -> Result<(File, u64), ReadError> {
    let file = open_file(path)?;
    let unreadable = |source| ReadError::Unreadable { path: path.to_path_buf(), source };
    let found = file.metadata().map_err(unreadable)?.len();
    match found {
        ..=FILE_BYTES_MAX => Ok((file, found)),
        _ => Err(in_file(path, ReadError::TooLarge { found, limit: FILE_BYTES_MAX })),
    }
}

fn in_file(path: &Path, fault: ReadError) -> ReadError {
    ReadError::InFile { path: path.to_path_buf(), fault: Box::new(fault) }
}

fn parse_start(start: &[u8], file_length: u64) -> Result<(Header, Vec<IndexEntry>), ReadError> {
    let (header, header_length) = Header::parse(start, file_length)?;
    let index = index::parse(start, &header, header_length, file_length)?;
    Ok((header, index))
}

/// The bytes of the header, and of the index if it is wanted, or, if they do not say how many these are, the first few.
fn read_start(file: &mut File, file_length: u64, with_index: bool) -> std::io::Result<Vec<u8>> {
    let guess: u64 = if with_index { 64 << 10 } else { 1 << 10 };
    let mut start = Vec::new();
    file.by_ref().take(guess).read_to_end(&mut start)?;
    let word = |at: usize| start.get(at..at + 4).map(|b| u64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
    let (Some(header), Some(south), Some(north), Some(west), Some(east)) =
        (word(12), word(40), word(44), word(48), word(52))
    else {
        return Ok(start);
    };
    // Wrong numbers are found later; here they must only not ask for more than there is.
    let levels = start.get(10..12).map_or(1, |b| u64::from(u16::from_le_bytes([b[0], b[1]])));
    let modules = north.saturating_sub(south).saturating_mul(east.saturating_sub(west)).saturating_mul(levels);
    let entry = start.get(8..10).map_or(0, |b| index::entry_bytes(u16::from_le_bytes([b[0], b[1]])) as u64);
    let index = if with_index { modules.saturating_mul(entry).saturating_add(4) } else { 0 };
    let wanted = header.saturating_add(index).min(file_length);
    if guess < wanted {
        file.take(wanted - guess).read_to_end(&mut start)?;
    }
    Ok(start)
}

/// Reads a piece of a file that other threads may be reading, too.
fn read_at(file: &Mutex<File>, offset: u64, length: usize) -> std::io::Result<Vec<u8>> {
    let mut bytes = vec![0; length];
    // A reader that panicked left the file as it was: every piece begins with a seek.
    let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}
