//! A folder of many files that appears under its name only when it is whole.

use std::path::{Path, PathBuf};
use std::{fs, io};

use tempfile::TempDir;

use crate::failure::Failure;
use crate::left_over::Making;
use crate::{left_over, signals};

/// A folder in the making, beside the place where it will appear.
#[derive(Debug)]
pub struct NewFolder {
    path: PathBuf,
    making: TempDir,
    /// Says to other exports that this one lives.
    _held: Option<fs::File>,
    _making: Making,
}

impl NewFolder {
    /// Begins a folder that will appear at `path`.
    ///
    /// # Errors
    /// When something is there already, or the folder around it is missing or not writable.
    pub fn begin(path: &Path) -> Result<Self, Failure> {
        Self::check(path)?;
        let path = std::path::absolute(path).map_err(|error| Failure::output(path, &error))?;
        let around = path.parent().unwrap_or(Path::new("/"));
        left_over::sweep(around);
        let mut builder = tempfile::Builder::new();
        builder.prefix(left_over::PREFIX);
        // A temporary folder is private by default; this one is about to be an ordinary one.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let making = builder.tempdir_in(around).map_err(|error| Failure::output(&path, &error))?;
        let held = left_over::hold(making.path());
        let noted = signals::making(making.path());
        Ok(Self { path, making, _held: held, _making: noted })
    }

    /// Whether a folder may appear at `path`, asked before long work.
    ///
    /// # Errors
    /// When something is there already.
    pub fn check(path: &Path) -> Result<(), Failure> {
        let is_empty = || fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none());
        if left_over::is_taken(path) && (path.is_symlink() || !is_empty()) {
            let found = left_over::named(path);
            let message = format!("{}: found {found}, expected a name that is free", path.display());
            return Err(Failure::new(message, "give another name, or remove it; a folder is never written over"));
        }
        Ok(())
    }

    /// Writes a file of this name, `/` between folders.
    ///
    /// # Errors
    /// Those of the system.
    pub fn put(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let path = self.making.path().join(name);
        match fs::write(&path, bytes) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                fs::create_dir_all(path.parent().unwrap_or(self.making.path()))?;
                fs::write(&path, bytes)
            }
            written => written,
        }
    }

    /// Lets the folder appear.
    ///
    /// # Errors
    /// When it cannot; then nothing is left behind.
    pub fn finish(self) -> Result<(), Failure> {
        fs::rename(self.making.path(), &self.path).map_err(|error| Failure::output(&self.path, &error))?;
        // It is no longer there to be removed.
        let _ = self.making.keep();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_appears_whole_or_not_at_all() {
        let around = tempfile::tempdir().unwrap();
        let path = around.path().join("out");
        let folder = NewFolder::begin(&path).unwrap();
        folder.put("a/b/c.bin", b"c").unwrap();
        assert!(!path.exists());
        drop(folder);
        assert_eq!(fs::read_dir(around.path()).unwrap().count(), 0);
        let folder = NewFolder::begin(&path).unwrap();
        folder.put("a/b/c.bin", b"c").unwrap();
        folder.finish().unwrap();
        assert_eq!(fs::read(path.join("a/b/c.bin")).unwrap(), b"c");
        assert!(NewFolder::begin(&path).unwrap_err().to_string().contains("found a folder that is not empty"));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_not_written_through_even_if_it_leads_nowhere() {
        let around = tempfile::tempdir().unwrap();
        let path = around.path().join("out");
        std::os::unix::fs::symlink(around.path().join("gone"), &path).unwrap();
        assert!(NewFolder::begin(&path).unwrap_err().to_string().contains("found a link that leads nowhere"));
    }
}
