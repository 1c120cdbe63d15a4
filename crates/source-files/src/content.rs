//! The bytes of a source, for its hash: a database says what it was made from; and whether it is still that file. Files
//! beside it that say how it is to be read, found by its name, are a part of that.

use std::fs::{File, Metadata};
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::SourceError;
use crate::error::{A_DANGLING_LINK, A_DATABASE, A_FOLDER};

/// The bytes of the file at `path`, and after them those of files beside it that say how it is to be read. They are
/// read as they are wanted: a source may be larger than the memory there is.
///
/// # Errors
/// When one cannot be opened, or is no regular file.
pub fn content(path: &Path) -> Result<Box<dyn Read>, SourceError> {
    let open = |path: &Path| -> Result<File, SourceError> {
        regular(path)?;
        File::open(path).map_err(|source| SourceError::Read { path: path.into(), source })
    };
    let first: Box<dyn Read> = Box::new(open(path)?);
    all_beside(path)
        .iter()
        .try_fold(first, |all, other| -> Result<Box<dyn Read>, SourceError> { Ok(Box::new(all.chain(open(other)?))) })
}

/// What the disk says of a regular file. Nothing is opened: that of a pipe would wait for a writer for ever.
pub(crate) fn regular(path: &Path) -> Result<Metadata, SourceError> {
    let not_a_file = |found| SourceError::NotAFile { path: path.into(), found };
    match std::fs::metadata(path) {
        Ok(data) if data.is_file() => Ok(data),
        Ok(data) if data.is_dir() && path.join("database.json").is_file() => Err(not_a_file(A_DATABASE)),
        Ok(data) => Err(not_a_file(kind_of(&data))),
        Err(_) if path.is_symlink() => Err(not_a_file(A_DANGLING_LINK)),
        Err(source) => Err(SourceError::Open { path: path.into(), source }),
    }
}

#[cfg(unix)]
fn kind_of(data: &Metadata) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    let kind = data.file_type();
    match () {
        () if kind.is_dir() => A_FOLDER,
        () if kind.is_fifo() => "a named pipe",
        () if kind.is_socket() => "a socket",
        () => "a device",
    }
}

#[cfg(not(unix))]
fn kind_of(data: &Metadata) -> &'static str {
    if data.is_dir() { A_FOLDER } else { "a device" }
}

#[cfg(unix)]
fn modified(data: &Metadata) -> Option<(i64, i64)> {
    use std::os::unix::fs::MetadataExt;
    Some((data.mtime(), data.mtime_nsec()))
}

#[cfg(not(unix))]
fn modified(_: &Metadata) -> Option<(i64, i64)> {
    None
}

/// Which file a path led to, and what it was like, so that a change is seen without reading it again; and the same of
/// the files beside it that say how it is to be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileState {
    path: PathBuf,
    len: u64,
    /// When it was last written, in whatever the file system counts; never compared with a clock.
    modified: Option<(i64, i64)>,
    place: (u64, u64),
    beside: Vec<FileState>,
}

impl FileState {
    /// Of the file at `path` now.
    ///
    /// # Errors
    /// When there is none, or no regular one.
    pub fn of(path: &Path) -> Result<Self, SourceError> {
        let beside = all_beside(path).iter().map(|other| Self::alone(other)).collect::<Result<_, _>>()?;
        Ok(Self { beside, ..Self::alone(path)? })
    }

    /// The path, and those of the files beside it.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(self).chain(&self.beside).map(|state| state.path.as_path())
    }

    fn alone(path: &Path) -> Result<Self, SourceError> {
        let data = regular(path)?;
        let (modified, place) = (modified(&data), place_of(&data));
        Ok(Self { path: path.into(), len: data.len(), modified, place, beside: Vec::new() })
    }

    /// Checks that the path still leads to the same file, unchanged, and that those beside it are still the same.
    ///
    /// # Errors
    /// [`SourceError::Changed`] when it does not.
    pub fn check(&self) -> Result<(), SourceError> {
        self.check_alone()?;
        self.beside.iter().try_for_each(Self::check_alone)?;
        let is_known = |path: &PathBuf| self.beside.iter().any(|state| state.path == *path);
        match all_beside(&self.path).into_iter().find(|path| !is_known(path)) {
            Some(path) => Err(SourceError::Changed { path, found: "put there".into() }),
            None => Ok(()),
        }
    }

    fn check_alone(&self) -> Result<(), SourceError> {
        let changed = |found: String| Err(SourceError::Changed { path: self.path.clone(), found });
        match Self::alone(&self.path) {
            Ok(now) if now.place != self.place => changed("replaced by another file".into()),
            Ok(now) if now.len != self.len => changed(format!("{} bytes long instead of {}", now.len, self.len)),
            Ok(now) if now.modified != self.modified => changed("written to".into()),
            Ok(_) => Ok(()),
            Err(_) => changed("gone".into()),
        }
    }
}

/// The device and the number of a file on it, where the system has such.
#[cfg(unix)]
fn place_of(data: &Metadata) -> (u64, u64) {
    use std::os::unix::fs::MetadataExt;
    (data.dev(), data.ino())
}

#[cfg(not(unix))]
fn place_of(_: &Metadata) -> (u64, u64) {
    (0, 0)
}

/// Endings of raw grids, which a header of the same name describes.
pub(crate) const RAW_ENDINGS: [&str; 8] = ["flt", "bil", "bin", "raw", "img", "bsq", "bip", "dem"];

/// The file of the same name with one of some endings.
pub(crate) fn beside(path: &Path, endings: &[&str]) -> Option<PathBuf> {
    let mut names = endings.iter().flat_map(|ending| [ending.to_string(), ending.to_uppercase()]);
    names.find_map(|ending| Some(path.with_extension(ending)).filter(|other| other != path && other.is_file()))
}

/// The files that a reader of `path` may look at besides it: a coordinate system (`.prj`), a header (`.hdr`) or the
/// grid that a header describes, the index and the table of a Shapefile (`.shx`, `.dbf`, `.cpg`), what was written to
/// a GeoPackage last (`.gpkg-wal`).
fn all_beside(path: &Path) -> Vec<PathBuf> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    // A packed file's other name: `a.asc.gz` and `a.prj`.
    let is_packed = matches!(ending.as_deref(), Some("gz" | "zip"));
    let plain = if is_packed { path.with_extension("") } else { path.to_owned() };
    let mut kinds: Vec<&[&str]> = vec![&["prj"]];
    match ending.as_deref() {
        Some("hdr") => kinds.push(&RAW_ENDINGS),
        Some("shp") => kinds.extend([&["shx"][..], &["dbf"], &["cpg"]]),
        _ if is_packed => {}
        _ => kinds.push(&["hdr"]),
    }
    let named = kinds.into_iter().filter_map(|endings| beside(&plain, endings).or_else(|| beside(path, endings)));
    named.chain((ending.as_deref() == Some("gpkg")).then(|| log_beside(path)).flatten()).collect()
}

/// The log beside a database, which holds what has not been brought into it yet. Readers leave empty ones behind.
fn log_beside(path: &Path) -> Option<PathBuf> {
    let mut name = path.as_os_str().to_owned();
    name.push("-wal");
    let log = PathBuf::from(name);
    log.metadata().is_ok_and(|data| data.is_file() && 0 < data.len()).then_some(log)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_files_that_a_shapefile_or_a_geopackage_consists_of_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        for name in ["a.shp", "a.shx", "a.dbf", "a.PRJ", "a.cpg", "a.sbn", "b.gpkg", "b.gpkg-wal", "c.gpkg"] {
            write(name, "x");
        }
        write("c.gpkg-wal", "");
        let found = |name: &str| -> Vec<String> {
            let all = all_beside(&folder.path().join(name));
            all.iter().map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect()
        };
        assert_eq!(found("a.shp"), ["a.PRJ", "a.shx", "a.dbf", "a.cpg"]);
        assert_eq!(found("b.gpkg"), ["b.gpkg-wal"]);
        assert_eq!(found("c.gpkg"), [""; 0], "an empty log holds nothing");
    }
}
