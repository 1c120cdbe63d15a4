//! One build at a time in one directory, or any number of processes that share one: a lock that dies with its process.
//!
//! The lock is the system's, on the file `lock`; the file itself means nothing and stays. Removing it would let one
//! process hold the removed file and another a new one of the same name.

use std::path::Path;

use crate::engine::{Entry, Guard, Held, LockKind};

use crate::{DatabaseError, Folder};

/// The name of the file that is locked.
pub(crate) const LOCK_NAME: &str = "lock";

/// Held as long as this value lives; the system frees it when the process ends, however it ends.
#[derive(Debug)]
pub struct Lock {
    _guard: Box<dyn Guard>,
}

impl Lock {
    /// Takes the lock of the database in `dir`, without waiting.
    ///
    /// # Errors
    /// [`DatabaseError::Locked`] when another build holds it; others when the file cannot be made.
    pub fn acquire(dir: &Path) -> Result<Self, DatabaseError> {
        Self::take(&Folder::new(dir), LockKind::Alone)
    }

    /// Takes it alone, or a share of it: any number of processes may hold one, and no build beside them.
    ///
    /// # Errors
    /// As [`Lock::acquire`].
    pub(crate) fn take(folder: &Folder, kind: LockKind) -> Result<Self, DatabaseError> {
        let (path, store) = (folder.path(LOCK_NAME), folder.store());
        // A link would have a file made wherever it leads.
        if matches!(store.entry(&path), Ok(Entry::Folder | Entry::Other)) {
            return Err(DatabaseError::NotAFile { path });
        }
        match store.lock(&path, kind) {
            Ok(Some(guard)) => Ok(Self { _guard: guard }),
            Ok(None) => Err(DatabaseError::Locked { path: folder.dir().to_path_buf() }),
            Err(source) => Err(DatabaseError::from_io("lock", &path, 0, source)),
        }
    }

    /// Who holds the lock of a database. Makes no file, and keeps others out for an instant at most.
    pub fn held(folder: &Folder) -> Held {
        folder.store().held(&folder.path(LOCK_NAME))
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    use super::*;

    const HELPER_DIR: &str = "TIEFORT_LOCK_TEST_DIR";

    #[test]
    fn the_second_to_come_is_refused_until_the_first_lets_go() {
        let folder = tempfile::tempdir().unwrap();
        let first = Lock::acquire(folder.path()).unwrap();
        let error = Lock::acquire(folder.path()).unwrap_err();
        assert_eq!(Lock::held(&Folder::new(folder.path())), Held::Alone);
        assert!(Lock::take(&Folder::new(folder.path()), LockKind::Shared).unwrap_err().is_transient());
        assert!(error.is_transient());
        assert!(error.to_string().starts_with(&folder.path().display().to_string()));
        drop(first);
        assert_eq!(Lock::held(&Folder::new(folder.path())), Held::Free);
        Lock::acquire(folder.path()).unwrap();
    }

    #[test]
    fn many_may_share_it_and_none_has_it_alone_meanwhile() {
        let folder = tempfile::tempdir().unwrap();
        let shares = [
            Lock::take(&Folder::new(folder.path()), LockKind::Shared).unwrap(),
            Lock::take(&Folder::new(folder.path()), LockKind::Shared).unwrap(),
        ];
        assert_eq!(Lock::held(&Folder::new(folder.path())), Held::Shared);
        assert!(Lock::acquire(folder.path()).unwrap_err().is_transient());
        drop(shares);
        Lock::acquire(folder.path()).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_place_of_the_lock_is_refused_and_makes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let elsewhere = tempfile::tempdir().unwrap();
        let made = elsewhere.path().join("made");
        std::os::unix::fs::symlink(&made, folder.path().join(LOCK_NAME)).unwrap();
        let error = Lock::acquire(folder.path()).unwrap_err();
        assert!(matches!(error, DatabaseError::NotAFile { .. }) && error.hint().is_some(), "{error}");
        assert!(!made.exists());
    }

    /// Does nothing unless `a_killed_process_holds_no_lock` starts it in a process of its own.
    #[test]
    fn helper_that_holds_a_lock_until_it_is_killed() {
        let Some(dir) = std::env::var_os(HELPER_DIR) else { return };
        let _lock = Lock::acquire(Path::new(&dir)).unwrap();
        println!("\nheld");
        loop {
            std::thread::park();
        }
    }

    #[test]
    fn a_killed_process_holds_no_lock() {
        let folder = tempfile::tempdir().unwrap();
        let mut helper = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "lock::tests::helper_that_holds_a_lock_until_it_is_killed", "--nocapture"])
            .env(HELPER_DIR, folder.path())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(helper.stdout.take().unwrap()).lines();
        assert!(lines.map_while(Result::ok).any(|line| line == "held"), "the helper did not get the lock");
        assert!(Lock::acquire(folder.path()).unwrap_err().is_transient());
        helper.kill().unwrap();
        helper.wait().unwrap();
        Lock::acquire(folder.path()).unwrap();
    }
}
