//! How anything is made, kept, explained and shared, whatever it is: this crate knows no terrain.
//!
//! An artifact is a file that a pure function makes from other artifacts, windows of ground and settings. Its [`Key`]
//! names all of them, part by part. [`keep_or_make`] is the one place that decides whether a published artifact is
//! kept. Files lie in a [`Store`]: a [`Disk`], a [`Memory`], or a [`Faulty`] memory that fails as real disks and
//! computers do. Processes that share a store leave [`Leases`] and [`Marks`] for one another.

// A test that unwraps says by its line what failed.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod store;
pub(crate) use store::remove_all;
pub use store::{Clock, Durability, Entry, Guard, Held, LockKind, Store, StoreError, is_temporary};
mod disk;
pub use disk::{Disk, Writing, check_writable};
mod memory;
pub use memory::Memory;
mod faulty;
pub use faulty::{Faults, Faulty, World};
mod fingerprint;
pub use fingerprint::{Fingerprint, FingerprintBuilder};
mod artifact;
mod key;
pub use artifact::{Artifact, Before, Cause, Outcome, keep_or_make};
pub use key::{Key, Part, Parts, Stamp};
mod leases;
pub use leases::{Claim, Lease, Leases, Marks};
