//! One build at a time in one directory: a lock that dies with its process.
//!
//! The lock is the system's, on the file `lock`; the file itself means nothing and stays. Removing it would let one
//! process hold the removed file and another a new one of the same name.

use std::fs::{File, TryLockError};
use std::path::Path;

use crate::DatabaseError;

/// The name of the file that is locked.
pub(crate) const LOCK_NAME: &str = "lock";

/// Held as long as this value lives; the system frees it when the process ends, however it ends.
#[derive(Debug)]
pub struct Lock {
    _file: File,
}

impl Lock {
    /// Takes the lock of the database in `dir`, without waiting.
    ///
    /// # Errors
    /// [`DatabaseError::Locked`] when another build holds it; others when the file cannot be made.
    pub fn acquire(dir: &Path) -> Result<Self, DatabaseError> {
        let path = dir.join(LOCK_NAME);
        let fault = |source| DatabaseError::from_io("lock", &path, 0, source);
        let file = File::options().create(true).append(true).open(&path).map_err(fault)?;
        match file.try_lock() {
            Ok(()) => Ok(Self { _file: file }),
            Err(TryLockError::WouldBlock) => Err(DatabaseError::Locked { path: dir.to_path_buf() }),
            Err(TryLockError::Error(source)) => Err(fault(source)),
        }
    }

    /// Whether a build holds the lock of the database in `dir`. Makes no file, and keeps no other reader out.
    pub fn is_held(dir: &Path) -> bool {
        let Ok(file) = File::open(dir.join(LOCK_NAME)) else { return false };
        matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock))
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
        assert!(Lock::is_held(folder.path()));
        assert!(error.is_transient());
        assert!(error.to_string().starts_with(&folder.path().display().to_string()));
        drop(first);
        assert!(!Lock::is_held(folder.path()));
        Lock::acquire(folder.path()).unwrap();
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
