//! Files of other machines: the windows that an area needs of rasters, and other files whole.
//!
//! ```text
//!   address    what a job names ─► what is asked for over HTTP
//!   s3         buckets: signatures and lists
//!   client     one range of bytes, with redirects, retries and what servers do wrong
//!   silence    what a person is told while no server sends anything
//!   plan       which ranges of which files an area needs; their bytes as a `Read + Seek` for their directories
//!   pieces     ranges on the disk: what came before a cut is kept
//!   check      whether a build can read what came
//!   run        all files of a job, each brought under its final name, and its lock
//! ```
//! No signature and no password is in any message.

mod address;
mod check;
mod client;
mod fault;
mod pieces;
mod plan;
mod run;
mod s3;
mod silence;

pub use run::{Options, fetch};
