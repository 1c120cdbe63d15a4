//! Files in memory, as a disk keeps them: what is written is seen at once, and lost with the power until it is synced.

use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::engine::store::{TEMPORARY_PREFIX, TEMPORARY_SUFFIX};
use crate::engine::{Durability, Entry, Guard, Held, LockKind, Store};

/// Files in memory. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    files: Arc<Mutex<Files>>,
}

#[derive(Debug, Default)]
struct Files {
    nodes: BTreeMap<PathBuf, Node>,
    /// What is still on the disk of files that were removed since it was synced.
    removed: BTreeMap<PathBuf, Vec<u8>>,
    /// Holders of locks by number: one alone, or all that share one.
    locks: BTreeMap<PathBuf, (LockKind, Vec<u64>)>,
    /// Temporary names and holders of locks that were given out.
    count: u64,
}

#[derive(Clone, Debug)]
enum Node {
    Folder,
    File {
        bytes: Vec<u8>,
        /// What the disk has.
        durable: Option<Vec<u8>>,
    },
}

impl Memory {
    /// Without a file.
    pub fn new() -> Self {
        Self::default()
    }

    fn files(&self) -> MutexGuard<'_, Files> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Every file below a folder, by name.
    pub fn all(&self, folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
        let files = self.files();
        let inside = files.nodes.iter().filter(|(path, _)| path.starts_with(folder));
        let bytes = inside.filter_map(|(path, node)| match node {
            Node::Folder => None,
            Node::File { bytes, .. } => Some((path.clone(), bytes.clone())),
        });
        bytes.collect()
    }

    /// The computer loses its power: `choose` says of each file that was not synced what is found afterwards, as a
    /// number below the one it is given: 0 what was written, 1 what the disk had before, 2 the beginning of what was
    /// written, 3 as many zeros.
    pub(crate) fn lose_power(&self, mut choose: impl FnMut(usize) -> usize) {
        let mut files = self.files();
        let mut found = BTreeMap::new();
        for (path, node) in &files.nodes {
            let Node::File { bytes, durable } = node else {
                found.insert(path.clone(), node.clone());
                continue;
            };
            let after = match choose(if durable.as_ref() == Some(bytes) { 1 } else { 4 }) {
                0 => Some(bytes.clone()),
                1 => durable.clone(),
                2 => Some(bytes[..choose(bytes.len() + 1)].to_vec()),
                _ => Some(vec![0; bytes.len()]),
            };
            if let Some(bytes) = after {
                found.insert(path.clone(), Node::File { durable: Some(bytes.clone()), bytes });
            }
        }
        for (path, bytes) in std::mem::take(&mut files.removed) {
            let has_folder = path.parent().is_some_and(|folder| found.contains_key(folder));
            if has_folder && !found.contains_key(&path) && choose(2) == 1 {
                found.insert(path, Node::File { durable: Some(bytes.clone()), bytes });
            }
        }
        files.nodes = found;
        files.locks.clear();
    }

    /// Writes a file under a temporary name beside `path`: the first step of [`Store::replace`].
    pub(crate) fn write_temporary(&self, path: &Path, bytes: &[u8]) -> Result<PathBuf> {
        let mut files = self.files();
        files.count += 1;
        let name = format!("{TEMPORARY_PREFIX}{}{TEMPORARY_SUFFIX}", files.count);
        let temporary = path.with_file_name(name);
        files.folder_of(&temporary)?;
        files.nodes.insert(temporary.clone(), Node::File { bytes: bytes.to_vec(), durable: None });
        Ok(temporary)
    }

    /// Renames it: the second step.
    pub(crate) fn rename(&self, temporary: &Path, path: &Path, durability: Durability) -> Result<()> {
        let mut files = self.files();
        let Some(Node::File { bytes, .. }) = files.nodes.remove(temporary) else {
            return Err(ErrorKind::NotFound.into());
        };
        let durable = match (durability, files.nodes.get(path)) {
            (Durability::Now, _) => Some(bytes.clone()),
            (Durability::Later, Some(Node::File { durable, .. })) => durable.clone(),
            (Durability::Later, Some(Node::Folder)) => return Err(ErrorKind::IsADirectory.into()),
            (Durability::Later, None) => files.removed.get(path).cloned(),
        };
        files.removed.remove(path);
        files.nodes.insert(path.to_path_buf(), Node::File { bytes, durable });
        Ok(())
    }

    fn bytes<R>(&self, path: &Path, take: impl FnOnce(&[u8]) -> R) -> Result<R> {
        match self.files().nodes.get(path) {
            None => Err(ErrorKind::NotFound.into()),
            Some(Node::Folder) => Err(ErrorKind::IsADirectory.into()),
            Some(Node::File { bytes, .. }) => Ok(take(bytes)),
        }
    }
}

impl Files {
    /// Refuses a path whose folder is not there.
    fn folder_of(&self, path: &Path) -> Result<()> {
        match path.parent().map(|folder| (folder, self.nodes.get(folder))) {
            None => Ok(()),
            Some((folder, None)) if folder.as_os_str().is_empty() || folder == Path::new("/") => Ok(()),
            Some((_, None)) => Err(ErrorKind::NotFound.into()),
            Some((_, Some(Node::Folder))) => Ok(()),
            Some((_, Some(Node::File { .. }))) => Err(ErrorKind::NotADirectory.into()),
        }
    }

    fn children(&self, folder: &Path) -> Vec<PathBuf> {
        let inside = self.nodes.keys().filter(|path| path.parent() == Some(folder));
        inside.cloned().collect()
    }
}

impl Store for Memory {
    fn read(&self, path: &Path) -> Result<Vec<u8>> {
        self.bytes(path, <[u8]>::to_vec)
    }

    fn read_start(&self, path: &Path, count: usize) -> Result<Vec<u8>> {
        self.bytes(path, |bytes| bytes[..bytes.len().min(count)].to_vec())
    }

    fn entry(&self, path: &Path) -> Result<Entry> {
        match self.files().nodes.get(path) {
            None => Err(ErrorKind::NotFound.into()),
            Some(Node::Folder) => Ok(Entry::Folder),
            Some(Node::File { bytes, .. }) => Ok(Entry::File(bytes.len() as u64)),
        }
    }

    fn list(&self, folder: &Path) -> Result<Vec<PathBuf>> {
        let files = self.files();
        match files.nodes.get(folder) {
            Some(Node::Folder) => Ok(files.children(folder)),
            Some(Node::File { .. }) => Err(ErrorKind::NotADirectory.into()),
            None => Err(ErrorKind::NotFound.into()),
        }
    }

    fn replace(&self, path: &Path, bytes: &[u8], durability: Durability) -> Result<()> {
        let temporary = self.write_temporary(path, bytes)?;
        self.rename(&temporary, path, durability)
    }

    fn create_new(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        let mut files = self.files();
        files.folder_of(path)?;
        if files.nodes.contains_key(path) {
            return Err(ErrorKind::AlreadyExists.into());
        }
        let durable = files.removed.remove(path);
        files.nodes.insert(path.to_path_buf(), Node::File { bytes: bytes.to_vec(), durable });
        Ok(())
    }

    fn overwrite(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        match self.files().nodes.get_mut(path) {
            None => Err(ErrorKind::NotFound.into()),
            Some(Node::Folder) => Err(ErrorKind::IsADirectory.into()),
            Some(Node::File { bytes: before, .. }) => {
                *before = bytes.to_vec();
                Ok(())
            }
        }
    }

    fn remove(&self, path: &Path) -> Result<()> {
        let mut files = self.files();
        match files.nodes.get(path) {
            None => return Err(ErrorKind::NotFound.into()),
            Some(Node::Folder) => return Err(ErrorKind::IsADirectory.into()),
            Some(Node::File { .. }) => {}
        }
        if let Some(Node::File { durable: Some(durable), .. }) = files.nodes.remove(path) {
            files.removed.insert(path.to_path_buf(), durable);
        }
        Ok(())
    }

    fn make_folder(&self, path: &Path) -> Result<()> {
        let mut files = self.files();
        files.folder_of(path)?;
        if files.nodes.contains_key(path) {
            return Err(ErrorKind::AlreadyExists.into());
        }
        files.nodes.insert(path.to_path_buf(), Node::Folder);
        Ok(())
    }

    fn make_folders(&self, path: &Path) -> Result<()> {
        let mut files = self.files();
        for folder in path.ancestors().filter(|folder| folder.parent().is_some()) {
            match files.nodes.entry(folder.to_path_buf()).or_insert(Node::Folder) {
                Node::Folder => {}
                Node::File { .. } => return Err(ErrorKind::NotADirectory.into()),
            }
        }
        Ok(())
    }

    fn remove_folder(&self, path: &Path) -> Result<()> {
        let mut files = self.files();
        match files.nodes.get(path) {
            None => return Err(ErrorKind::NotFound.into()),
            Some(Node::File { .. }) => return Err(ErrorKind::NotADirectory.into()),
            Some(Node::Folder) if !files.children(path).is_empty() => {
                return Err(Error::from(ErrorKind::DirectoryNotEmpty));
            }
            Some(Node::Folder) => {}
        }
        files.nodes.remove(path);
        Ok(())
    }

    fn sync(&self, dir: &Path, _files: &[PathBuf], _folders: &[PathBuf]) -> Result<()> {
        let mut files = self.files();
        for (_, node) in files.nodes.iter_mut().filter(|(path, _)| path.starts_with(dir)) {
            if let Node::File { bytes, durable } = node {
                *durable = Some(bytes.clone());
            }
        }
        files.removed.retain(|path, _| !path.starts_with(dir));
        Ok(())
    }

    fn lock(&self, path: &Path, kind: LockKind) -> Result<Option<Box<dyn Guard>>> {
        match self.create_new(path, b"") {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(error),
            _ => {}
        }
        let mut files = self.files();
        files.count += 1;
        let holder = files.count;
        match files.locks.get_mut(path) {
            None => drop(files.locks.insert(path.to_path_buf(), (kind, vec![holder]))),
            Some((LockKind::Shared, holders)) if kind == LockKind::Shared => holders.push(holder),
            Some(_) => return Ok(None),
        }
        Ok(Some(Box::new(Locked { memory: self.clone(), path: path.to_path_buf(), holder })))
    }

    fn held(&self, path: &Path) -> Held {
        match self.files().locks.get(path) {
            None => Held::Free,
            Some((LockKind::Shared, _)) => Held::Shared,
            Some((LockKind::Alone, _)) => Held::Alone,
        }
    }
}

/// A lock that is held.
#[derive(Debug)]
struct Locked {
    memory: Memory,
    path: PathBuf,
    holder: u64,
}

impl Guard for Locked {}

impl Drop for Locked {
    fn drop(&mut self) {
        let mut files = self.memory.files();
        // Where the power was lost meanwhile, another process may hold it.
        if let Some((_, holders)) = files.locks.get_mut(&self.path) {
            holders.retain(|holder| *holder != self.holder);
        }
        files.locks.retain(|_, (_, holders)| !holders.is_empty());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::remove_all;

    fn store() -> Memory {
        let store = Memory::new();
        store.make_folders(Path::new("a.tdb/tiles")).unwrap();
        store
    }

    #[test]
    fn it_answers_as_a_disk_does() {
        let there = tempfile::tempdir().unwrap();
        let memory = Memory::new();
        memory.make_folders(there.path()).unwrap();
        let both: [&dyn Store; 2] = [&crate::engine::Disk, &memory];
        let at = |name: &str| there.path().join(name);
        let said = both.map(|store| {
            let kind = |done: Result<()>| done.map_err(|error| error.kind());
            vec![
                kind(store.replace(&at("no/a"), b"1", Durability::Later)),
                kind(store.make_folder(&at("a"))),
                kind(store.make_folder(&at("a"))),
                kind(store.create_new(&at("a/x"), b"12")),
                kind(store.create_new(&at("a/x"), b"34")),
                kind(store.overwrite(&at("a/y"), b"34")),
                kind(store.replace(&at("a/y"), b"56", Durability::Now)),
                kind(store.overwrite(&at("a/y"), b"7")),
                kind(store.remove_folder(&at("a"))),
                kind(store.remove(&at("a/z"))),
                kind(store.read(&at("a/z")).map(drop)),
                kind(store.list(&at("b")).map(drop)),
                kind(store.sync(&at("a"), &[], &[])),
                kind(remove_all(store, &at("b"))),
            ]
        });
        assert_eq!(said[0], said[1]);
        for store in both {
            assert_eq!(store.list(&at("a")).unwrap(), [at("a/x"), at("a/y")]);
            assert_eq!(store.read(&at("a/y")).unwrap(), b"7");
            assert_eq!(store.read_start(&at("a/x"), 1).unwrap(), b"1");
            assert_eq!(
                (store.entry(&at("a")).unwrap(), store.entry(&at("a/x")).unwrap()),
                (Entry::Folder, Entry::File(2))
            );
            let shared = [(); 2].map(|()| store.lock(&at("lock"), LockKind::Shared).unwrap());
            assert!(shared.iter().all(Option::is_some) && store.held(&at("lock")) == Held::Shared);
            assert!(store.lock(&at("lock"), LockKind::Alone).unwrap().is_none());
            drop(shared);
            let alone = store.lock(&at("lock"), LockKind::Alone).unwrap();
            assert!(alone.is_some() && store.held(&at("lock")) == Held::Alone);
            drop(alone);
            assert_eq!(store.held(&at("lock")), Held::Free);
            remove_all(store, &at("a")).unwrap();
            assert!(store.entry(&at("a")).is_err());
        }
    }

    #[test]
    fn what_was_synced_survives_the_power_and_anything_else_may_not() {
        let (store, file) = (store(), Path::new("a.tdb/tiles/a"));
        store.replace(file, b"one", Durability::Later).unwrap();
        store.sync(Path::new("a.tdb"), &[], &[]).unwrap();
        store.replace(file, b"two", Durability::Later).unwrap();
        store.lose_power(|cases| cases.min(2) - 1);
        assert_eq!(store.read(file).unwrap(), b"one");
        store.replace(file, b"three", Durability::Now).unwrap();
        store.remove(file).unwrap();
        store.lose_power(|cases| cases.min(2) - 1);
        assert_eq!(store.read(file).unwrap(), b"three");
    }
}
