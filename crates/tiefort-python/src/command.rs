//! The command `tiefort` of the package: the program itself, in this process.

use std::ffi::OsString;
use std::path::PathBuf;

use pyo3::prelude::*;

/// Runs the program with the words of a command line, the first of which is how it is run again; ends the process.
#[pyfunction]
pub fn command_line(py: Python<'_>, words: Vec<OsString>) {
    let program = words.first().map(PathBuf::from);
    // Ending the process here has the program's own output written out, and no thread wait for Python.
    py.detach(|| std::process::exit(i32::from(tiefort::command_line(words, program))))
}
