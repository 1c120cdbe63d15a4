//! `work/RUN/`: what processes that share a directory leave for one another while they build, gone at the end.
//!
//! ```text
//!   work/3f6a…/leases/refine-r02c03.0   who works on it (`leases`)
//!   work/3f6a…/done/refine-r02c03       done in this run: the fingerprint of what was published
//!   work/3f6a…/shares/r02c03.json       what the tile may spend
//! ```
//! RUN names what the run is made from, so marks of another job or of other sources are never looked at.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use terrain::TileId;

use crate::folder::read;
use crate::publish::{Durability, is_temporary, write_atomically};
use crate::{DatabaseError, Fingerprint, Leases, json};

const LEASES: &str = "leases";
const DONE: &str = "done";
const SHARES: &str = "shares";

/// The work folder of one run.
#[derive(Clone, Debug)]
pub struct Work {
    folder: PathBuf,
}

/// What one tile may spend, as processes hand it to one another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// Points to select.
    pub points: Option<u64>,
    /// RMS residual that is good enough, in quanta.
    pub rms_quanta: Option<f64>,
    /// Triangles, with constrained edges.
    pub allowance: Option<ShareAllowance>,
}

/// Triangles one tile may spend, in all and by load module and window.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShareAllowance {
    /// South, west, north and east of the load modules that the room below is for.
    pub modules: [u32; 4],
    /// Room in each of them.
    pub module_room: Vec<u32>,
    /// South, west, north and east of the windows' origins.
    pub windows: [u32; 4],
    /// Rows and columns of load modules in a window.
    pub window_size: [u32; 2],
    /// Room in each window.
    pub window_room: Vec<u32>,
    /// Triangles in all.
    pub triangles: u32,
}

impl Work {
    /// The folders in it.
    pub(crate) const FOLDERS: [&'static str; 3] = [LEASES, DONE, SHARES];

    pub(crate) fn new(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// Removes the folder once the build is published, and the one of all runs if no other is left there. Any number of
    /// processes may do so at once; what none of them can remove, the next build does.
    pub fn sweep(&self) {
        /// What another process takes meanwhile ends a try.
        const TRIES: usize = 5;
        for _ in 0..TRIES {
            if fs::remove_dir_all(&self.folder).is_ok() || !self.folder.exists() {
                break;
            }
        }
        if let Some(all) = self.folder.parent() {
            let _ = fs::remove_dir(all);
        }
    }

    /// The leases, for the process that calls itself `holder`.
    pub fn leases(&self, holder: &str, expiry: Duration) -> Leases {
        Leases::new(self.folder.join(LEASES), holder, expiry)
    }

    /// Marks a unit of work, such as `refine-r02c03`, as done.
    ///
    /// # Errors
    /// When the mark cannot be written.
    pub fn mark(&self, unit: &str, fingerprint: Fingerprint) -> Result<(), DatabaseError> {
        write_atomically(&self.done_path(unit), format!("{fingerprint}\n").as_bytes(), Durability::Later)
    }

    /// The fingerprint of what was published when a unit of work was done; `None` while it is not.
    pub fn marked(&self, unit: &str) -> Option<Fingerprint> {
        Fingerprint::from_hex(fs::read_to_string(self.done_path(unit)).ok()?.trim_end())
    }

    /// Takes a mark back: what was published turned out to be damaged.
    pub fn unmark(&self, unit: &str) {
        // If it cannot be removed, whoever trusts it finds the damage again.
        let _ = fs::remove_file(self.done_path(unit));
    }

    /// Every unit of work that is marked, by name.
    pub fn all_marked(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.join(DONE)).into_iter().flatten().flatten();
        let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
        let mut names: Vec<String> = names.filter(|name| !is_temporary(name)).collect();
        names.sort();
        names
    }

    fn done_path(&self, unit: &str) -> PathBuf {
        self.folder.join(DONE).join(unit)
    }

    /// Hands over what a tile may spend.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write_share(&self, tile: TileId, share: &Share) -> Result<(), DatabaseError> {
        let path = self.share_path(tile);
        write_atomically(&path, json::encode(&path, share)?.as_bytes(), Durability::Later)
    }

    /// What a tile may spend.
    ///
    /// # Errors
    /// When nobody has said so yet, or the file is damaged.
    pub fn read_share(&self, tile: TileId) -> Result<Share, DatabaseError> {
        let path = self.share_path(tile);
        json::decode(&path, &read(&path)?)
    }

    fn share_path(&self, tile: TileId) -> PathBuf {
        self.folder.join(SHARES).join(format!("{tile}.json"))
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.folder
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Database, samples};

    #[test]
    fn marks_and_shares_survive_and_are_gone_with_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let (database, _) = Database::join(&folder.path().join("a.tdb"), &samples::area()).unwrap();
        let work = database.work("run").unwrap();
        assert_eq!(work.marked("refine-r00c01"), None);
        let fingerprint = samples::stamp().fingerprint;
        work.mark("refine-r00c01", fingerprint).unwrap();
        assert_eq!(work.marked("refine-r00c01"), Some(fingerprint));
        assert_eq!(work.all_marked(), ["refine-r00c01"]);
        assert_eq!(database.work("other run").unwrap().marked("refine-r00c01"), None);
        let share = Share { points: Some(7), rms_quanta: Some(0.1 + 0.2), allowance: None };
        work.write_share(samples::TILE, &share).unwrap();
        assert_eq!(work.read_share(samples::TILE).unwrap(), share);
        work.unmark("refine-r00c01");
        assert_eq!(work.marked("refine-r00c01"), None);
        database.remove_work().unwrap();
        assert!(!work.path().exists() && work.read_share(samples::TILE).is_err());
    }

    #[test]
    fn any_number_of_processes_sweep_their_own_run_and_leave_others() {
        let folder = tempfile::tempdir().unwrap();
        let (database, _) = Database::join(&folder.path().join("a.tdb"), &samples::area()).unwrap();
        let (work, other) = (database.work("run").unwrap(), database.work("other run").unwrap());
        let fingerprint = samples::stamp().fingerprint;
        (0..50).for_each(|unit| work.mark(&format!("unit-{unit}"), fingerprint).unwrap());
        std::thread::scope(|scope| (0..4).for_each(|_| drop(scope.spawn(|| work.sweep()))));
        assert!(!work.path().exists() && other.path().exists());
        other.sweep();
        assert!(!other.path().parent().unwrap().exists());
    }
}
