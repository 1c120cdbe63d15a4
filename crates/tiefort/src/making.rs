//! What this process is making under a name that is not its final one, so that a signal which ends it leaves none.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

static ALL: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file or folder in the making, as long as the value lives.
#[derive(Debug)]
pub struct Making(PathBuf);

impl Making {
    /// Notes what is being made at `path`.
    pub fn begin(path: &Path) -> Self {
        listed().push(path.into());
        Self(path.into())
    }
}

impl Drop for Making {
    fn drop(&mut self) {
        listed().retain(|path| *path != self.0);
    }
}

/// Removes all that is in the making. Nothing else is begun while what is returned lives, which is to be until the
/// process ends.
pub fn remove_all() -> MutexGuard<'static, Vec<PathBuf>> {
    let all = listed();
    for path in all.iter() {
        // What has just got its final name is not there any more, and what cannot be removed stays.
        let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    }
    all
}

fn listed() -> MutexGuard<'static, Vec<PathBuf>> {
    ALL.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_the_making_is_removed_and_what_is_made_stays() {
        let folder = tempfile::tempdir().unwrap();
        let [file, inside, made] = ["file", "folder", "made"].map(|name| folder.path().join(name));
        fs::write(&file, "half").unwrap();
        fs::create_dir(&inside).unwrap();
        fs::write(inside.join("part"), "half").unwrap();
        fs::write(&made, "whole").unwrap();
        let _making = [Making::begin(&file), Making::begin(&inside)];
        drop(Making::begin(&made));
        drop(remove_all());
        assert!(!file.exists() && !inside.exists() && made.exists());
    }
}
