//! The compiled part of the Python package: arrays in, meshes and answers out, and the command `tiefort`.
//!
//! Everything is done by the libraries that the commands use; what is here only brings values over. The package around
//! it, `python/tiefort`, holds names, documentation and what is optional. `waiting` lets other threads of Python run
//! meanwhile, passes on progress, and ends when Python has been interrupted.

mod raised;
mod waiting;

mod answers;
mod arrays;
mod command;
mod jobs;
mod meshes;
mod within;

/// The compiled part of the package.
#[pyo3::pymodule]
mod _tiefort {
    #[pymodule_export]
    use crate::answers::Ground;
    #[pymodule_export]
    use crate::command::command_line;
    #[pymodule_export]
    use crate::jobs::{Job, build, compare, compare_on_array, correlate, explain, export, plan, tile, verify};
    #[pymodule_export]
    use crate::meshes::{Tin, tin_of_array, tin_of_file};
    #[pymodule_export]
    use crate::within::heights_within;
}
