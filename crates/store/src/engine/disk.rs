//! The system's files.
//!
//! A rename is all or nothing for readers, and for a process that is killed. For a computer that loses power the
//! bytes must reach the disk first; that costs milliseconds a file, so the many files of a build wait until its end
//! ([`Store::sync`]), before `database.json` calls them complete. Until then each is guarded by its own checksum.

use std::fs::{self, File, Metadata, Permissions, TryLockError};
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock, RwLockWriteGuard};

use crate::engine::store::{TEMPORARY_PREFIX, TEMPORARY_SUFFIX};
use crate::engine::{Durability, Entry, Guard, Held, LockKind, Store};

/// Held for reading while a file is written.
static GATE: RwLock<()> = RwLock::new(());

/// Keeps this process from writing, so that it can end at once and leave nothing half-written.
#[derive(Debug)]
pub struct Writing {
    _gate: RwLockWriteGuard<'static, ()>,
}

impl Writing {
    /// Keeps every thread from beginning to write as long as the value lives; `None` while one is writing.
    pub fn held_back() -> Option<Self> {
        GATE.try_write().ok().map(|gate| Self { _gate: gate })
    }
}

/// The system's files.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

/// A file whose lock is held: the system frees it when the process ends.
#[derive(Debug)]
struct Locked {
    file: File,
}

impl Guard for Locked {}

impl Drop for Locked {
    fn drop(&mut self) {
        // A process that was forked meanwhile has the file open, too: closing it here alone would leave it locked.
        let _ = self.file.unlock();
    }
}

impl Store for Disk {
    fn read(&self, path: &Path) -> Result<Vec<u8>> {
        fs::read(path)
    }

    fn read_start(&self, path: &Path, count: usize) -> Result<Vec<u8>> {
        let mut start = Vec::with_capacity(count);
        File::open(path)?.take(count as u64).read_to_end(&mut start)?;
        Ok(start)
    }

    fn entry(&self, path: &Path) -> Result<Entry> {
        Ok(entry(&fs::symlink_metadata(path)?))
    }

    fn target(&self, path: &Path) -> Result<Entry> {
        Ok(entry(&fs::metadata(path)?))
    }

    fn list(&self, folder: &Path) -> Result<Vec<PathBuf>> {
        let mut paths = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
        paths.sort();
        Ok(paths)
    }

    fn replace(&self, path: &Path, bytes: &[u8], durability: Durability) -> Result<()> {
        let folder = folder_of(path);
        let _gate = GATE.read().unwrap_or_else(PoisonError::into_inner);
        let mut builder = tempfile::Builder::new();
        builder.prefix(TEMPORARY_PREFIX).suffix(TEMPORARY_SUFFIX);
        let permissions = ordinary_permissions();
        if let Some(permissions) = permissions {
            builder.permissions(permissions);
        }
        let mut file = builder.tempfile_in(folder).map_err(without_path)?;
        file.as_file_mut().write_all(bytes)?;
        if durability == Durability::Now {
            file.as_file().sync_all()?;
        }
        file.persist(path).map_err(|error| without_path(error.error))?;
        match durability {
            Durability::Now => sync_folder(folder),
            Durability::Later => Ok(()),
        }
    }

    fn create_new(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        File::options().write(true).create_new(true).open(path)?.write_all(bytes)
    }

    fn overwrite(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        File::options().write(true).truncate(true).open(path)?.write_all(bytes)
    }

    fn remove(&self, path: &Path) -> Result<()> {
        fs::remove_file(path)
    }

    fn make_folder(&self, path: &Path) -> Result<()> {
        fs::create_dir(path)
    }

    fn make_folders(&self, path: &Path) -> Result<()> {
        fs::create_dir_all(path)
    }

    fn remove_folder(&self, path: &Path) -> Result<()> {
        fs::remove_dir(path)
    }

    /// One call for the whole file system: measured 10 to 70 ms for the 72 files of a build on ext4, where a call per
    /// file takes 200 to 390 ms because each waits for the journal.
    #[cfg(target_os = "linux")]
    fn sync(&self, dir: &Path, _files: &[PathBuf], _folders: &[PathBuf]) -> Result<()> {
        Ok(rustix::fs::syncfs(File::open(dir)?)?)
    }

    #[cfg(not(target_os = "linux"))]
    fn sync(&self, _dir: &Path, files: &[PathBuf], folders: &[PathBuf]) -> Result<()> {
        // Windows writes out only what was opened for writing.
        files.iter().try_for_each(|path| File::options().write(true).open(path)?.sync_all())?;
        folders.iter().try_for_each(|folder| sync_folder(folder))
    }

    fn lock(&self, path: &Path, kind: LockKind) -> Result<Option<Box<dyn Guard>>> {
        // Windows locks no file that is opened for appending alone.
        let file = File::options().create(true).read(true).append(true).open(path)?;
        let locked = match kind {
            LockKind::Alone => file.try_lock(),
            LockKind::Shared => file.try_lock_shared(),
        };
        match locked {
            Ok(()) => Ok(Some(Box::new(Locked { file }))),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(source)) => Err(source),
        }
    }

    fn held(&self, path: &Path) -> Held {
        // A pipe would wait for a writer.
        let is_file = fs::metadata(path).is_ok_and(|found| found.is_file());
        let Some(file) = is_file.then(|| File::open(path).ok()).flatten() else { return Held::Free };
        if matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)) {
            return Held::Alone;
        }
        let _ = file.unlock();
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => Held::Shared,
            _ => Held::Free,
        }
    }
}

fn entry(found: &Metadata) -> Entry {
    match (found.is_file(), found.is_dir()) {
        (true, _) => Entry::File(found.len()),
        (_, true) => Entry::Folder,
        _ => Entry::Other,
    }
}

/// Whether this process may make files in `folder`. Nothing is made for that.
///
/// # Errors
/// What the system says if not.
#[cfg(unix)]
pub fn check_writable(folder: &Path) -> Result<()> {
    use rustix::fs::Access;
    Ok(rustix::fs::access(folder, Access::WRITE_OK | Access::EXEC_OK)?)
}

/// Elsewhere that is found when the first file is made.
///
/// # Errors
/// None.
#[cfg(not(unix))]
pub fn check_writable(_: &Path) -> Result<()> {
    Ok(())
}

/// What the system said about a temporary file, without its name, which means nothing to a user.
fn without_path(error: Error) -> Error {
    match error.kind() {
        ErrorKind::NotFound
        | ErrorKind::PermissionDenied
        | ErrorKind::StorageFull
        | ErrorKind::QuotaExceeded
        | ErrorKind::ReadOnlyFilesystem => error.kind().into(),
        _ => error,
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Temporary files are private by default; ours become ordinary ones, readable as the user's mask says.
#[cfg(unix)]
fn ordinary_permissions() -> Option<Permissions> {
    Some(std::os::unix::fs::PermissionsExt::from_mode(0o666))
}

#[cfg(not(unix))]
fn ordinary_permissions() -> Option<Permissions> {
    None
}

#[cfg(unix)]
fn sync_folder(folder: &Path) -> Result<()> {
    File::open(folder)?.sync_all()
}

/// Elsewhere a folder cannot be opened as a file, and renames are as durable as they get.
#[cfg(not(unix))]
fn sync_folder(_folder: &Path) -> Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_nothing_is_left_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tin");
        Disk.replace(&path, b"one", Durability::Now).unwrap();
        Disk.replace(&path, b"two", Durability::Later).unwrap();
        Disk.sync(folder.path(), std::slice::from_ref(&path), &[folder.path().to_path_buf()]).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_published_file_is_as_readable_as_any_other() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        Disk.replace(&ours, b"", Durability::Later).unwrap();
        std::fs::write(&plain, b"").unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_replaced_and_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (outside, link) = (folder.path().join("outside"), folder.path().join("a.tin"));
        std::fs::write(&outside, b"theirs").unwrap();
        std::os::unix::fs::symlink(&outside, &link).unwrap();
        Disk.replace(&link, b"ours", Durability::Later).unwrap();
        assert_eq!(std::fs::read(&outside).unwrap(), b"theirs");
        assert!(!std::fs::symlink_metadata(&link).unwrap().is_symlink());
    }

    #[test]
    fn no_file_is_written_while_writing_is_held_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tin");
        // Other tests of this process may be writing.
        let held = loop {
            if let Some(held) = Writing::held_back() {
                break held;
            }
        };
        let writer = std::thread::spawn({
            let path = path.clone();
            move || Disk.replace(&path, b"late", Durability::Later).unwrap()
        });
        assert!(!path.exists());
        drop(held);
        writer.join().unwrap();
        assert!(path.exists());
    }
}
