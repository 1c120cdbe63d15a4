//! The two streams: data to stdout, everything else to stderr.

use std::io::{ErrorKind, IsTerminal, Write, stderr, stdout};
use std::path::Path;

use crate::failure::Failure;

/// Prints data to stdout. A reader that has gone away (`| head`) has seen enough, so that is no failure.
///
/// # Errors
/// When stdout cannot be written to for another reason, such as a full disk.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::output(Path::new("stdout"), &error)),
        _ => Ok(()),
    }
}

/// Tells a person something, in whole lines on stderr. Nobody may be listening; the work goes on all the same.
pub fn tell(text: &str) {
    let line_end = if text.ends_with('\n') { "" } else { "\n" };
    let _ = stderr().lock().write_all(format!("{text}{line_end}").as_bytes());
}

/// Ends a line that bars may have left half-drawn.
pub fn clear_line() {
    if is_watched() {
        tell("");
    }
}

/// Whether a person sees stderr as it is written.
pub fn is_watched() -> bool {
    stderr().is_terminal() && std::env::var_os("TERM").is_none_or(|kind| kind != "dumb")
}

/// Whether colours are welcome (<https://no-color.org>).
pub fn wants_color() -> bool {
    std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
