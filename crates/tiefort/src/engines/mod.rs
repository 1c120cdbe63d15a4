//! Files for engines that run the tasks of a build.

mod glue;
pub use glue::{Glue, costs_of};
mod dask;
pub use dask::dask;
mod kubernetes;
pub use kubernetes::kubernetes;
mod ninja;
pub use ninja::ninja;
mod slurm;
pub use slurm::slurm;
mod snakemake;
pub use snakemake::snakemake;
