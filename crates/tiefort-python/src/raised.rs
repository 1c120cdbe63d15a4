//! Failures as exceptions of the package, in the words of the command line but for the names of its flags.

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
    let words = (in_python(message), in_python(hint));
    let made = py.import("tiefort._errors").and_then(|errors| errors.getattr(name)?.call1(words));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// Flags whose argument in Python has another name than theirs.
const OTHERWISE: [(&str, &str); 3] = [("max-residual", "max_residual_m"), ("rms", "rms_m"), ("no-html", "html")];

/// `text` with arguments in place of flags: `workers` for `--workers`. Commands between backticks are for a shell.
fn in_python(text: &str) -> String {
    let parts = text.split('`').enumerate();
    let told = parts.map(|(index, part)| if index % 2 == 1 { part.to_owned() } else { without_flags(part) });
    told.collect::<Vec<_>>().join("`")
}

fn without_flags(text: &str) -> String {
    let mut told = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("--") {
        let (before, flag) = (&rest[..at], &rest[at + 2..]);
        let end = flag.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(flag.len());
        let name = flag[..end].trim_end_matches('-');
        let is_flag =
            name.starts_with(|c: char| c.is_ascii_lowercase()) && !before.ends_with(|c: char| !" ([<|'".contains(c));
        told += before;
        match OTHERWISE.iter().find(|(flag, _)| *flag == name) {
            _ if !is_flag => told += &rest[at..at + 2 + name.len()],
            Some((_, argument)) => told += argument,
            None => told += &name.replace('-', "_"),
        }
        rest = &flag[name.len()..];
    }
    told + rest
}
