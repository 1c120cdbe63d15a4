//! `work/RUN/`: what processes that share a directory leave for one another while they build, gone at the end.
//!
//! ```text
//!   work/3f6a…/leases/refine-r02c03.0   who works on it (`leases`)
//!   work/3f6a…/done/refine-r02c03       done in this run: the fingerprint of what was published
//!   work/3f6a…/shares/r02c03.json       what the tile may spend
//! ```
//! RUN names what the run is made from, so marks of another job or of other sources are never looked at.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use crate::engine::{Durability, Leases, Marks, Store, remove_all};
use serde::{Deserialize, Serialize};
use terrain::TileId;
use terrain::limits::Allowance;

use crate::read::read;
use crate::{DatabaseError, json};

const LEASES: &str = "leases";
const DONE: &str = "done";
const SHARES: &str = "shares";

/// Digits of a run's name.
pub const RUN_DIGITS: usize = 16;

/// The work folder of one run.
#[derive(Clone, Debug)]
pub struct Work {
    store: Arc<dyn Store>,
    folder: PathBuf,
    marks: Marks,
}

/// What one tile may spend; processes hand it to one another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TileBudget {
    /// Points to select, where those are counted.
    pub points: Option<usize>,
    /// RMS residual (quanta) that is good enough for this tile, where the area's is shared out.
    pub rms_quanta: Option<f64>,
    /// Triangles it may spend, with constrained edges.
    pub allowance: Option<Allowance>,
}

impl Work {
    /// The folders in it.
    pub(crate) const FOLDERS: [&'static str; 3] = [LEASES, DONE, SHARES];

    pub(crate) fn new(store: Arc<dyn Store>, folder: PathBuf) -> Self {
        let marks = Marks::new(Arc::clone(&store), folder.join(DONE));
        Self { store, folder, marks }
    }

    /// Removes the folder once the build is published, and the one of all runs if no other is left there. Any number of
    /// processes may do so at once; what none of them can remove, the next build does.
    pub fn sweep(&self) {
        /// What another process takes meanwhile ends a try.
        const TRIES: usize = 5;
        for _ in 0..TRIES {
            if remove_all(&*self.store, &self.folder).is_ok() || !self.is_there() {
                break;
            }
        }
        if let Some(all) = self.folder.parent() {
            let _ = self.store.remove_folder(all);
        }
    }

    /// Whether a path ends in the name of a run.
    pub(crate) fn is_of_run(path: &Path) -> bool {
        let name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
        name.len() == RUN_DIGITS && name.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
    }

    /// The leases, for the process that calls itself `holder`.
    pub fn leases(&self, holder: &str, expiry: Duration) -> Leases {
        Leases::new(Arc::clone(&self.store), self.folder.join(LEASES), holder, expiry)
    }

    /// What is done.
    pub fn marks(&self) -> &Marks {
        &self.marks
    }

    /// Whether the folder is there: it is swept away once the build is published.
    pub(crate) fn is_there(&self) -> bool {
        self.store.entry(&self.folder).is_ok()
    }

    /// Hands over what a tile may spend.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write_share(&self, tile: TileId, share: &TileBudget) -> Result<(), DatabaseError> {
        let path = self.share_path(tile);
        let text = json::encode(&path, share)?;
        let written = self.store.replace(&path, text.as_bytes(), Durability::Later);
        written.map_err(|source| DatabaseError::from_io("write", &path, text.len() as u64, source))
    }

    /// What a tile may spend.
    ///
    /// # Errors
    /// When no process has said so yet, or the file is damaged.
    pub fn read_share(&self, tile: TileId) -> Result<TileBudget, DatabaseError> {
        let path = self.share_path(tile);
        json::decode(&path, &read(&*self.store, &path)?)
    }

    fn share_path(&self, tile: TileId) -> PathBuf {
        self.folder.join(SHARES).join(format!("{tile}.json"))
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
        let work = database.work("0123456789abcdef").unwrap();
        assert_eq!(work.marks().marked("refine-r00c01"), None);
        let fingerprint = samples::stamp().fingerprint;
        work.marks().mark("refine-r00c01", fingerprint).unwrap();
        assert_eq!(work.marks().marked("refine-r00c01"), Some(fingerprint));
        assert_eq!(work.marks().all().unwrap(), ["refine-r00c01"]);
        assert_eq!(database.work("fedcba9876543210").unwrap().marks().marked("refine-r00c01"), None);
        let share = TileBudget { points: Some(7), rms_quanta: Some(0.1 + 0.2), allowance: None };
        work.write_share(samples::TILE, &share).unwrap();
        assert_eq!(work.read_share(samples::TILE).unwrap(), share);
        work.marks().unmark("refine-r00c01");
        assert_eq!(work.marks().marked("refine-r00c01"), None);
        database.remove_work().unwrap();
        assert!(!work.folder.exists() && work.read_share(samples::TILE).is_err());
    }

    #[test]
    fn any_number_of_processes_sweep_their_own_run_and_leave_others() {
        let folder = tempfile::tempdir().unwrap();
        let (database, _) = Database::join(&folder.path().join("a.tdb"), &samples::area()).unwrap();
        let (work, other) = (database.work("run").unwrap(), database.work("other run").unwrap());
        let fingerprint = samples::stamp().fingerprint;
        (0..50).for_each(|unit| work.marks().mark(&format!("unit-{unit}"), fingerprint).unwrap());
        std::thread::scope(|scope| (0..4).for_each(|_| drop(scope.spawn(|| work.sweep()))));
        assert!(!work.folder.exists() && other.folder.exists());
        other.sweep();
        assert!(!other.folder.parent().unwrap().exists());
    }
}
