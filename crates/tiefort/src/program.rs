//! Which program this is, for scripts that are to run it again.

use std::io;
use std::path::PathBuf;
use std::sync::OnceLock;

/// What was told, where the executable is another program that runs this one, as Python is.
static TOLD: OnceLock<PathBuf> = OnceLock::new();

/// From now on this is the program; nothing changes where there is none, or one was told before.
pub fn is(program: Option<PathBuf>) {
    if let Some(program) = program {
        TOLD.get_or_init(|| program);
    }
}

/// The path of the program.
///
/// # Errors
/// When the system does not say which executable this is, or where we are.
pub fn path() -> io::Result<PathBuf> {
    TOLD.get().map_or_else(std::env::current_exe, std::path::absolute)
}
