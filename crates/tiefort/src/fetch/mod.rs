//! Files of other machines: the windows that an area needs of rasters, and other files whole.
//!
//! ```text
//!   address    what a job names ─► what is asked for over HTTP
//!   s3         buckets: signatures and lists
//!   client     one range of bytes, with redirects, retries and what servers do wrong
//!   reader     the bytes of a file of another machine, as a `Read + Seek` for its directories
//!   plan       which ranges of which files an area needs
//!   pieces     ranges on the disk: what came before a cut is kept
//!   bring      a planned file, brought under its final name
//!   run        all files of a job, and its lock
//! ```
//! No signature and no password is in any message.

mod address;
mod bring;
mod client;
mod fault;
mod pieces;
mod plan;
mod reader;
mod run;
mod s3;

pub use run::{Options, fetch};
