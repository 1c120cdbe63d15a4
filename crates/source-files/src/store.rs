//! The bytes of a source: a file, or what a gzip or zip file holds, unpacked in memory.
//!
//! Nothing is ever unpacked to the disk, so a name inside an archive leads nowhere.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use flate2::bufread::GzDecoder;
use zip::ZipArchive;

use crate::SourceError;
use crate::content::regular;
use crate::error::at_most;
use crate::limits::{
    ARCHIVE_ENTRIES_MAX, GEOJSON_BYTES_MAX, UNPACKED_BYTES_MAX, UNPACKED_FEATURE_BYTES_A_BYTE,
    UNPACKED_FEATURE_BYTES_FREE,
};

/// Where the bytes of a source are.
#[derive(Clone, Debug)]
pub(crate) struct Store {
    /// The file, for messages.
    path: PathBuf,
    /// Name of the raster itself: the file's, or that inside an archive.
    name: String,
    unpacked: Option<Arc<[u8]>>,
    len: u64,
    /// Bytes of the file as it lies there.
    file_bytes: u64,
}

/// An open source.
pub(crate) enum Handle {
    File(File),
    Memory(Cursor<Arc<[u8]>>),
}

impl Read for Handle {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match self {
            Handle::File(file) => file.read(buffer),
            Handle::Memory(bytes) => bytes.read(buffer),
        }
    }
}

impl Seek for Handle {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        match self {
            Handle::File(file) => file.seek(to),
            Handle::Memory(bytes) => bytes.seek(to),
        }
    }
}

impl Store {
    /// The file at `path` as it is.
    pub(crate) fn plain(path: &Path) -> Result<Self, SourceError> {
        let data = regular(path)?;
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(Self { path: path.into(), name, unpacked: None, len: data.len(), file_bytes: data.len() })
    }

    /// The file at `path`, unpacked when it is a gzip or zip file.
    pub(crate) fn open(path: &Path) -> Result<Self, SourceError> {
        let plain = Self::plain(path)?;
        let start = plain.start(4)?;
        match start.as_slice() {
            [0x1f, 0x8b, ..] => plain.inflated(UNPACKED_BYTES_MAX),
            [b'P', b'K', 3 | 5, 4 | 6] => plain.unzipped(),
            _ => Ok(plain),
        }
    }

    /// The gzip file of lines and polygons at `path`, unpacked. These are taken apart, which takes many times the
    /// memory, so they are bounded by the size of the file.
    pub(crate) fn inflated_features(path: &Path) -> Result<Self, SourceError> {
        let plain = Self::plain(path)?;
        plain.inflated(unpacked_features_max(plain.len))
    }

    fn inflated(&self, limit: u64) -> Result<Self, SourceError> {
        let name = self.name.strip_suffix(".gz").unwrap_or(&self.name).to_owned();
        let mut decoder = GzDecoder::new(BufReader::new(self.handle()?));
        let bytes = self.unpack(&mut decoder, limit)?;
        // A reader that stops here would miss what was appended, a second part of the heights, perhaps.
        let rest = decoder.into_inner().fill_buf().map_err(|source| self.stopped(source))?.len();
        match rest {
            0 => Ok(self.holding(name, bytes)),
            _ => Err(self.malformed("the gzip file", "more bytes after its end".into(), "one packed file")),
        }
    }

    /// The parts of the one Shapefile in the zip file at `path`, unpacked, its shapes first.
    ///
    /// # Errors
    /// When there is none or more than one, or when the parts unpack to more than files of features may.
    pub(crate) fn zipped_shapefile(path: &Path) -> Result<Vec<Self>, SourceError> {
        const ENDINGS: [&str; 5] = [".shp", ".shx", ".dbf", ".cpg", ".prj"];
        let plain = Self::plain(path)?;
        let refused = |found: String| SourceError::NotFeatures { path: path.into(), found };
        let (mut archive, names) = plain.archive().map_err(|error| match error {
            SourceError::Malformed { .. } => refused("a zip archive that cannot be opened".into()),
            error => error,
        })?;
        let is_shapes = |name: &&String| name.to_lowercase().ends_with(ENDINGS[0]) && !is_beside(name);
        let all: Vec<&String> = names.iter().filter(is_shapes).collect();
        let [shapes] = all.as_slice() else {
            let found = match all.len() {
                0 => "a zip archive without a Shapefile in it".to_owned(),
                count => format!("a zip archive of {count} Shapefiles"),
            };
            return Err(refused(found));
        };
        let base = &shapes[..shapes.len() - ENDINGS[0].len()];
        let (mut parts, mut left) = (Vec::new(), unpacked_features_max(plain.len));
        for ending in ENDINGS {
            let is_part =
                |name: &&String| name.strip_prefix(base).is_some_and(|rest| rest.eq_ignore_ascii_case(ending));
            let Some(name) = names.iter().find(is_part) else { continue };
            let entry = archive.by_name(name).map_err(|error| plain.broken(error.to_string()))?;
            let bytes = plain.unpack(entry, left)?;
            left -= bytes.len() as u64;
            parts.push(plain.holding(name.rsplit(['/', '\\']).next().unwrap_or(name).to_owned(), bytes));
        }
        Ok(parts)
    }

    /// A zip file, and the names of the files in it.
    fn archive(&self) -> Result<(ZipArchive<Handle>, Vec<String>), SourceError> {
        let archive = ZipArchive::new(self.handle()?).map_err(|error| self.broken(error.to_string()))?;
        at_most(&self.path, archive.len() as u64, ARCHIVE_ENTRIES_MAX as u64, "files in an archive")?;
        let names = (0..archive.len())
            .filter_map(|index| archive.name_for_index(index)?.ok().map(std::borrow::Cow::into_owned))
            .filter(|name| !name.ends_with('/'))
            .collect();
        Ok((archive, names))
    }

    fn unzipped(&self) -> Result<Self, SourceError> {
        let (mut archive, mut names) = self.archive()?;
        if 1 < names.len() {
            names.retain(|name| !is_beside(name));
        }
        let [name] = names.as_slice() else {
            return Err(SourceError::ArchiveHolds { path: self.path.clone(), found: names.len() });
        };
        let entry = archive.by_name(name).map_err(|error| self.broken(error.to_string()))?;
        let bytes = self.unpack(entry, UNPACKED_BYTES_MAX)?;
        Ok(self.holding(name.rsplit(['/', '\\']).next().unwrap_or(name).to_owned(), bytes))
    }

    /// Everything `packed` holds, and no more than the limit, whatever its header promises.
    fn unpack(&self, packed: impl Read, limit: u64) -> Result<Vec<u8>, SourceError> {
        let mut bytes = Vec::new();
        packed
            .take(limit + 1)
            .read_to_end(&mut bytes)
            .map_err(|error| self.broken(format!("it cannot be unpacked: {error}")))?;
        at_most(&self.path, bytes.len() as u64, limit, "bytes once unpacked (or more)")?;
        Ok(bytes)
    }

    fn holding(&self, name: String, bytes: Vec<u8>) -> Self {
        let len = bytes.len() as u64;
        Self { path: self.path.clone(), name, unpacked: Some(bytes.into()), len, file_bytes: self.file_bytes }
    }

    fn broken(&self, found: String) -> SourceError {
        let (what, expected) = ("the archive".into(), "a sound one".into());
        SourceError::Malformed { path: self.path.clone(), what, found, expected }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// Bytes of the file as it lies there, packed or not.
    pub(crate) fn file_bytes(&self) -> u64 {
        self.file_bytes
    }

    pub(crate) fn is_packed(&self) -> bool {
        self.unpacked.is_some()
    }

    pub(crate) fn handle(&self) -> Result<Handle, SourceError> {
        match &self.unpacked {
            Some(bytes) => Ok(Handle::Memory(Cursor::new(bytes.clone()))),
            None => File::open(&self.path)
                .map(Handle::File)
                .map_err(|source| SourceError::Open { path: self.path.clone(), source }),
        }
    }

    /// The first bytes, fewer when there are not that many.
    pub(crate) fn start(&self, count: u64) -> Result<Vec<u8>, SourceError> {
        let mut bytes = Vec::new();
        self.handle()?.take(count).read_to_end(&mut bytes).map_err(|source| self.stopped(source))?;
        Ok(bytes)
    }

    /// All of it as text, without the byte order mark that some editors put before it.
    ///
    /// # Errors
    /// When it is longer than that of GeoJSON may be, or what `no_text` says where it is no text.
    pub(crate) fn text(&self, no_text: impl FnOnce() -> SourceError) -> Result<String, SourceError> {
        at_most(&self.path, self.len, GEOJSON_BYTES_MAX, "bytes")?;
        let text = String::from_utf8(self.start(GEOJSON_BYTES_MAX)?).map_err(|_| no_text())?;
        Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
    }

    /// `count` bytes from `at`.
    pub(crate) fn bytes_at(&self, handle: &mut Handle, at: u64, count: usize) -> Result<Vec<u8>, SourceError> {
        let mut bytes = vec![0; count];
        let read = handle.seek(SeekFrom::Start(at)).and_then(|_| handle.read_exact(&mut bytes));
        read.map_err(|source| self.stopped(source))?;
        Ok(bytes)
    }

    /// Checks that the source has as many bytes as its header promises.
    pub(crate) fn holds(&self, what: &str, expected: u64) -> Result<(), SourceError> {
        match expected <= self.len {
            true => Ok(()),
            false => {
                Err(SourceError::Truncated { path: self.path.clone(), what: what.into(), expected, found: self.len })
            }
        }
    }

    pub(crate) fn stopped(&self, source: std::io::Error) -> SourceError {
        SourceError::Read { path: self.path.clone(), source }
    }

    pub(crate) fn malformed(&self, what: &str, found: String, expected: &str) -> SourceError {
        SourceError::Malformed { path: self.path.clone(), what: what.into(), found, expected: expected.into() }
    }
}

/// Bytes that a packed file of lines and polygons of so many bytes may unpack to.
fn unpacked_features_max(file_bytes: u64) -> u64 {
    let limit = UNPACKED_FEATURE_BYTES_A_BYTE.saturating_mul(file_bytes).saturating_add(UNPACKED_FEATURE_BYTES_FREE);
    limit.min(UNPACKED_BYTES_MAX)
}

/// Files that lie beside a raster and describe it.
fn is_beside(name: &str) -> bool {
    let name = name.to_lowercase();
    let base = name.rsplit('/').next().unwrap_or(&name);
    let described = [".prj", ".xml", ".hdr", ".txt", ".html", ".pdf", ".avg", ".min", ".max", ".src", ".tfw", ".md5"];
    base.starts_with('.') || name.contains("__macosx/") || described.iter().any(|end| base.ends_with(end))
}
