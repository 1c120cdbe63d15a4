//! Files for engines that run the tasks of a build.

mod glue;
pub use glue::Glue;
mod dask;
pub use dask::dask;
mod ninja;
pub use ninja::ninja;
mod slurm;
pub use slurm::slurm;
