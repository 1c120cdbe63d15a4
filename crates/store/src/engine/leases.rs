//! Who works on what, among processes that share a directory: leases that expire.
//!
//! ```text
//!   refine-r02c03.0   made by the first process: only one can; its holder writes a count into it now and then
//!   refine-r02c03.1   made by one that has seen .0 unchanged for the length of a lease: again only one can
//! ```
//! The lease of the highest number counts. No clock is compared with another one: a lease is old when *this* process
//! has looked at the same bytes for long enough by its own clock, which the caller reads. A process that was only slow
//! and comes back does no harm, because every task is idempotent; leases save work, they do not make results right.
//!
//! Marks say which units of work are done.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use crate::engine::{Durability, Fingerprint, Store, StoreError, is_temporary};

/// What a lease says whose holder has given up.
const FREE: &[u8] = b"free\n";

/// The leases of one run, as one process sees them.
#[derive(Debug)]
pub struct Leases {
    store: Arc<dyn Store>,
    folder: PathBuf,
    holder: String,
    expiry: Duration,
    seen: BTreeMap<String, Seen>,
}

/// What this process last saw of a lease, and since when.
#[derive(Debug)]
struct Seen {
    number: u32,
    content: Vec<u8>,
    since: Duration,
}

/// What came of asking for a lease.
#[derive(Debug)]
pub enum Claim {
    /// It is ours; and whether it was taken from a holder that has gone silent.
    Ours(Lease, bool),
    /// A process holds it.
    Held,
}

/// A lease that is ours until it goes unrenewed for too long.
#[derive(Clone, Debug)]
pub struct Lease {
    store: Arc<dyn Store>,
    path: PathBuf,
    holder: String,
}

impl Leases {
    /// The leases in `folder` for the process that calls itself `holder`, a name that no other process has.
    pub(crate) fn new(store: Arc<dyn Store>, folder: PathBuf, holder: &str, expiry: Duration) -> Self {
        Self { store, folder, holder: holder.to_owned(), expiry, seen: BTreeMap::new() }
    }

    /// Asks for the lease of `what` at the time `now` of this process's own clock.
    ///
    /// # Errors
    /// When the folder cannot be read or written.
    pub fn claim(&mut self, what: &str, now: Duration) -> Result<Claim, StoreError> {
        let mut number = self.seen.get(what).map_or(0, |seen| seen.number);
        loop {
            let path = self.folder.join(format!("{what}.{number}"));
            let content = format!("{} 0\n", self.holder);
            match self.store.create_new(&path, content.as_bytes()) {
                Ok(()) => {
                    let lease = Lease { store: Arc::clone(&self.store), path, holder: self.holder.clone() };
                    return Ok(Claim::Ours(lease, 0 < number));
                }
                // The folder is gone: the build is published.
                Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Claim::Held),
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(StoreError::new("write", &path, content.len(), error)),
            }
            let has_successor = self.store.entry(&self.folder.join(format!("{what}.{}", number + 1))).is_ok();
            if !has_successor && !self.is_over(what, number, self.store.read(&path).unwrap_or_default(), now) {
                return Ok(Claim::Held);
            }
            number += 1;
        }
    }

    /// Whether the lease of this number, which says `content`, was given up or has been seen unchanged for too long.
    fn is_over(&mut self, what: &str, number: u32, content: Vec<u8>, now: Duration) -> bool {
        let is_free = content == FREE;
        let same = self.seen.get(what).filter(|seen| seen.number == number && seen.content == content);
        match same {
            Some(seen) => is_free || self.expiry <= now.saturating_sub(seen.since),
            None => {
                self.seen.insert(what.to_owned(), Seen { number, content, since: now });
                is_free
            }
        }
    }
}

impl Lease {
    /// Says that the holder is alive. `count` differs from call to call.
    ///
    /// # Errors
    /// When the file cannot be written, or is gone because the build is published.
    pub fn renew(&self, count: u64) -> Result<(), StoreError> {
        self.write(format!("{} {count}\n", self.holder).as_bytes())
    }

    /// Lets others have it at once.
    ///
    /// # Errors
    /// As [`Lease::renew`].
    pub fn give_up(self) -> Result<(), StoreError> {
        self.write(FREE)
    }

    fn write(&self, content: &[u8]) -> Result<(), StoreError> {
        let written = self.store.overwrite(&self.path, content);
        written.map_err(|source| StoreError::new("write", &self.path, content.len(), source))
    }
}

/// The marks of one run: a file for each unit of work that is done, with the fingerprint of what it published.
#[derive(Clone, Debug)]
pub struct Marks {
    store: Arc<dyn Store>,
    folder: PathBuf,
}

impl Marks {
    /// The marks in a folder.
    pub(crate) fn new(store: Arc<dyn Store>, folder: PathBuf) -> Self {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Memory;

    const EXPIRY: Duration = Duration::from_secs(10);

    fn store() -> Arc<dyn Store> {
        let store = Memory::new();
        store.make_folders("leases".as_ref()).unwrap();
        Arc::new(store)
    }

    fn leases(store: &Arc<dyn Store>, name: &str) -> Leases {
        Leases::new(Arc::clone(store), "leases".into(), name, EXPIRY)
    }

    fn seconds(count: u64) -> Duration {
        Duration::from_secs(count)
    }

    #[track_caller]
    fn ours(claim: Claim) -> Lease {
        match claim {
            Claim::Ours(lease, _) => lease,
            Claim::Held => panic!("another process holds it"),
        }
    }

    #[track_caller]
    fn is_held(leases: &mut Leases, now: u64) -> bool {
        matches!(leases.claim("refine-r00c00", seconds(now)).unwrap(), Claim::Held)
    }

    #[test]
    fn one_of_two_gets_it_and_a_renewed_lease_never_expires() {
        let store = store();
        let [mut one, mut two] = ["one", "two"].map(|name| leases(&store, name));
        let lease = ours(one.claim("refine-r00c00", seconds(5)).unwrap());
        // The other's clock is a year ahead, which means nothing.
        for step in 0..20 {
            assert!(is_held(&mut two, 31_000_000 + 9 * step));
            lease.renew(step + 1).unwrap();
        }
    }

    #[test]
    fn a_silent_holder_loses_it_to_exactly_one_other() {
        let store = store();
        let [mut dead, mut two, mut three] = ["dead", "two", "three"].map(|name| leases(&store, name));
        ours(dead.claim("refine-r00c00", seconds(0)).unwrap());
        assert!(is_held(&mut two, 100) && is_held(&mut three, 500));
        assert!(is_held(&mut two, 109) && is_held(&mut three, 509));
        assert!(matches!(two.claim("refine-r00c00", seconds(110)).unwrap(), Claim::Ours(_, true)));
        // The third has waited long enough for the dead one, and begins to wait for the second.
        assert!(is_held(&mut three, 511) && is_held(&mut three, 520));
        assert!(!is_held(&mut three, 521));
    }

    #[test]
    fn what_is_given_up_is_free_at_once() {
        let store = store();
        let [mut one, mut two] = ["one", "two"].map(|name| leases(&store, name));
        let lease = ours(one.claim("refine-r00c00", seconds(0)).unwrap());
        assert!(is_held(&mut two, 0));
        lease.give_up().unwrap();
        ours(two.claim("refine-r00c00", seconds(1)).unwrap());
        assert!(is_held(&mut one, 1));
    }

    #[test]
    fn where_the_folder_is_gone_nothing_is_free() {
        let store = store();
        let mut one = Leases::new(store, "gone".into(), "one", EXPIRY);
        assert!(is_held(&mut one, 0));
    }
}
