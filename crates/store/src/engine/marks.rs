//! Which units of work are done, among processes that share a store.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::engine::{Durability, Fingerprint, Store, StoreError, is_temporary};

/// The marks of one run: a file for each unit of work that is done, with the fingerprint of what it published.
#[derive(Clone, Debug)]
pub struct Marks {
    store: Arc<dyn Store>,
    folder: PathBuf,
}

impl Marks {
    /// The marks in a folder.
    pub fn new(store: Arc<dyn Store>, folder: PathBuf) -> Self {
        Self { store, folder }
    }

    /// Marks a unit of work, such as `refine-r02c03`, as done.
    ///
    /// # Errors
    /// When the mark cannot be written.
    pub fn mark(&self, unit: &str, fingerprint: Fingerprint) -> Result<(), StoreError> {
        let (path, text) = (self.path(unit), format!("{fingerprint}\n"));
        let written = self.store.replace(&path, text.as_bytes(), Durability::Later);
        written.map_err(|source| StoreError::new("write", &path, text.len(), source))
    }

    /// The fingerprint of what was published when a unit of work was done; `None` while it is not. A mark that says
    /// nothing, as a computer leaves it that lost its power, is none and goes.
    pub fn marked(&self, unit: &str) -> Option<Fingerprint> {
        let bytes = self.store.read(&self.path(unit)).ok()?;
        let said = std::str::from_utf8(&bytes).ok().and_then(|text| Fingerprint::from_hex(text.trim_end()));
        if said.is_none() {
            self.unmark(unit);
        }
        said
    }

    /// Takes a mark back: what was published turned out to be damaged.
    pub fn unmark(&self, unit: &str) {
        // If it cannot be removed, the next reader finds the damage again.
        let _ = self.store.remove(&self.path(unit));
    }

    /// Every unit of work that is marked, by ascending name; none once the folder is swept away.
    ///
    /// # Errors
    /// When the folder cannot be listed.
    pub fn all(&self) -> Result<Vec<String>, StoreError> {
        let paths = match self.store.list(&self.folder) {
            Err(error) if error.kind() == ErrorKind::NotFound => Vec::new(),
            listed => listed.map_err(|source| StoreError::new("list", &self.folder, 0, source))?,
        };
        let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
        Ok(paths.iter().filter_map(|path| name(path)).filter(|name| !is_temporary(name)).collect())
    }

    fn path(&self, unit: &str) -> PathBuf {
        self.folder.join(unit)
    }
}
