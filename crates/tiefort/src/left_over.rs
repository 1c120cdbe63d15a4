//! What a process makes under a name that is not its final one: a signal which ends it leaves none, and what one that
//! was killed has left half-written is told from what another is writing now.
//!
//! Everything is made under a name that begins with [`PREFIX`], and its maker holds the system's lock on it, which dies
//! with the process. What is locked is at work; what is not, and is a minute old, is left over. Where the file system
//! knows no such locks nothing is removed.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How names of what is half-written begin.
pub const PREFIX: &str = ".tiefort-";
/// Random characters after it.
const RANDOM_CHARACTERS: usize = 6;
/// Between being made and being locked a process may be held up; it is never so for long.
const YOUNG: Duration = Duration::from_secs(60);

/// Locks what is in the making at `path`, as long as the value lives; `None` where that cannot be.
pub fn hold(path: &Path) -> Option<File> {
    File::open(path).ok().filter(|file| file.try_lock().is_ok())
}

/// Removes what is left over directly in `folder`. What cannot be removed stays; nothing depends on it.
pub fn sweep(folder: &Path) {
    sweep_older(folder, YOUNG);
}

fn sweep_older(folder: &Path, age: Duration) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_ours = entry.file_name().to_str().and_then(|name| name.strip_prefix(PREFIX)).is_some_and(|random| {
            random.len() == RANDOM_CHARACTERS && random.bytes().all(|byte| byte.is_ascii_alphanumeric())
        });
        let Some(found) = is_ours.then(|| fs::symlink_metadata(entry.path()).ok()).flatten() else { continue };
        let is_old = found.modified().ok().and_then(|time| time.elapsed().ok()).is_some_and(|since| age <= since);
        // A pipe or device of that name would block when opened.
        if !is_old || !(found.is_dir() || found.is_file()) {
            continue;
        }
        // Held while it is removed, so that two that sweep do not meet.
        let Some(_held) = hold(&entry.path()) else { continue };
        let _ = if found.is_dir() { fs::remove_dir_all(entry.path()) } else { fs::remove_file(entry.path()) };
    }
}

/// Whether something is at `path`, a link that leads nowhere too.
pub fn is_taken(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// What is at `path`, for a message.
pub fn named(path: &Path) -> &'static str {
    match (path.is_symlink(), path.exists()) {
        (true, false) => "a link that leads nowhere",
        (true, true) => "a link",
        _ if path.is_dir() => "a folder that is not empty",
        _ if path.is_file() => "a file",
        _ => "a pipe, a socket or a device",
    }
}

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
pub fn remove_all_made() -> MutexGuard<'static, Vec<PathBuf>> {
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
    fn only_what_no_process_holds_is_swept() {
        let around = tempfile::tempdir().unwrap();
        let place = |name: &str| around.path().join(name);
        for name in [".tiefort-dead01", ".tiefort-live01", ".tiefort-notes", "tiefort-AAAAAA"] {
            fs::create_dir(place(name)).unwrap();
            fs::write(place(name).join("a.bin"), b"a").unwrap();
        }
        fs::write(place(".tiefort-dead02"), b"half").unwrap();
        let held = hold(&place(".tiefort-live01"));
        assert!(held.is_some());
        sweep(around.path());
        assert_eq!(fs::read_dir(around.path()).unwrap().count(), 5, "all of them are young");
        sweep_older(around.path(), Duration::ZERO);
        let mut left: Vec<_> = fs::read_dir(around.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        left.sort();
        assert_eq!(left, [".tiefort-live01", ".tiefort-notes", "tiefort-AAAAAA"]);
        drop(held);
        sweep_older(around.path(), Duration::ZERO);
        assert!(!place(".tiefort-live01").exists());
    }

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
        drop(remove_all_made());
        assert!(!file.exists() && !inside.exists() && made.exists());
    }
}
