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

/// What gives someone the viewer, for the way in which this program came to be here: with a package of Python, by
/// `cargo install`, or built in a checkout.
#[cfg(all(feature = "serve", not(feature = "viewer")))]
pub fn how_to_get_the_viewer() -> String {
    let node = "it needs Node 20 or newer";
    if TOLD.get().is_some() {
        return format!("make the wheel by scripts/build_wheel.sh without --no-viewer ({node}), and install that");
    }
    let program = path().ok().and_then(|path| path.canonicalize().ok()).unwrap_or_default();
    let is_checkout = |folder: &&std::path::Path| folder.join("scripts/build_viewer.sh").exists();
    if let Some(checkout) = program.ancestors().find(is_checkout) {
        let script = checkout.join("scripts/build_viewer.sh");
        return format!(
            "run `{}` ({node}), then `cargo run --release --features viewer -- view DIR` in {}",
            script.display(),
            checkout.display()
        );
    }
    format!(
        "in a checkout of tiefort, run scripts/build_viewer.sh ({node}), then `cargo install --path crates/tiefort \
         --locked --features viewer`"
    )
}

/// The path of the program.
///
/// # Errors
/// When the system does not say which executable this is, or where we are.
pub fn path() -> io::Result<PathBuf> {
    TOLD.get().map_or_else(std::env::current_exe, std::path::absolute)
}
