//! Files through the public doors: what is read, what is refused and how, and that nothing hostile gets further.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod formats;
mod geotiff;
mod hostile;
mod mosaics;
mod overlays;
mod real_files;
mod refusals;
mod resampling;
mod support;
mod void_rules;
mod windows;
