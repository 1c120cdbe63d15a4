//! Failures as exceptions of the package, in the words of the command line.

use pyo3::prelude::*;
use tiefort::library::{Cause, Failure};

/// The name of the exception for a cause.
fn name(cause: Cause) -> &'static str {
    match cause {
        Cause::Request => "RequestError",
        Cause::Job => "JobError",
        Cause::Source => "SourceError",
        Cause::Database => "DatabaseError",
        Cause::Busy => "BusyError",
        Cause::Output => "OutputError",
        Cause::Stopped => "StoppedError",
        Cause::Bug => "InternalError",
    }
}

/// A failure as an exception.
pub fn raised(py: Python<'_>, failure: &Failure) -> PyErr {
    named(py, name(failure.cause()), failure.message(), failure.hint())
}

/// The exception of this name, with what was found and expected, and a hint.
pub fn named(py: Python<'_>, name: &str, message: &str, hint: &str) -> PyErr {
    let made = py.import("tiefort._errors").and_then(|errors| errors.getattr(name)?.call1((message, hint)));
    made.map_or_else(|error| error, PyErr::from_value)
}
