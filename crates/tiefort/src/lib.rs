//! The command line: words in, words out, signals, clock. The only crate that prints, or reads the clock, the
//! environment or arguments.
//!
//! ```text
//!   main ─► commands/…   one file per command: arguments, help, what it calls
//!             run        what `build` and `tile` share: announcement, listening, end table, report
//!             progress   one thread that turns events into bars, lines or JSON
//! ```
//! Data goes to stdout, everything else to stderr.
//!
//! `main.rs` is the program; the Python package runs [`command_line`] as its command, and [`library`] is what its
//! functions share with the commands.

// A test that unwraps says by its line what failed.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod arguments;
mod board;
mod catalogue;
mod certificate;
mod clock;
mod commands;
pub mod contents;
mod engines;
mod estimate;
mod events;
mod failure;
#[cfg(feature = "fetch")]
mod fetch;
mod files;
mod fit;
mod left_over;
pub mod library;
mod measures;
mod measures_json;
mod new_folder;
mod places;
mod program;
mod progress;
mod resources;
mod run;
#[cfg(feature = "serve")]
mod serve;
mod signals;
mod steps;
mod terminal;
#[cfg(test)]
mod tests;
#[cfg(feature = "viewer")]
mod viewer;

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::LazyLock;

use clap::Parser;
use views::COLUMNS_MAX;

use commands::Command;

const AFTER_HELP: &str = "\
Examples:
  tiefort build configs/ntc.toml           compile a whole gaming area
  tiefort tile configs/ntc.toml 2,3        re-run one tile of it
  tiefort report ntc.tdb                   read what broke a limit, and why

Rows and columns count from the south-west corner, row first.
Exit codes:
  0    all limits met, or sound
  1    finished with breaches
  2    failed, or damaged, or any warning or breach under --strict
  75   not now: the same may do later
  130  stopped by SIGINT; 143 by SIGTERM";

/// What is built in beyond what every program has.
const FEATURES: &str = match (cfg!(feature = "serve"), cfg!(feature = "viewer"), cfg!(feature = "fetch")) {
    (_, true, true) => "serve, viewer, fetch",
    (_, true, false) => "serve, viewer (fetch is left out)",
    (true, false, true) => "serve, fetch (viewer is left out)",
    (true, false, false) => "serve (viewer and fetch are left out)",
    (false, false, true) => "fetch (serve and viewer are left out)",
    (false, false, false) => "none (serve, viewer and fetch are left out)",
};

/// Version of the program, what it was built from, versions of what it writes, and of how it decides.
static LONG_VERSION: LazyLock<String> = LazyLock::new(|| {
    format!(
        "{}\ncommit {}\nfeatures {FEATURES}\ndatabase format {}\nload-module format {}, {} with decks, {} with lines\n\
         algorithm revision {}",
        env!("CARGO_PKG_VERSION"),
        env!("TIEFORT_COMMIT"),
        store::FORMAT_VERSION,
        store::MODULES_FORMAT_VERSION_OF_GROUND,
        store::MODULES_FORMAT_VERSION_WITH_DECKS,
        store::MODULES_FORMAT_VERSION,
        build::ALGORITHM_REVISION
    )
});

/// Turns elevation rasters into a gaming area: a seamless terrain database of load modules within polygon limits.
#[derive(Parser)]
#[command(version, long_version = LONG_VERSION.as_str(), max_term_width = COLUMNS_MAX, after_help = AFTER_HELP)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// Runs the program with the words of a command line, the first of which names it; returns its exit code.
///
/// `program` is what is typed to run it, where that is not this executable.
pub fn command_line(words: impl IntoIterator<Item = OsString>, program: Option<PathBuf>) -> u8 {
    failure::report_bugs_in_one_line();
    signals::begin();
    program::is(program);
    let cli = match Cli::try_parse_from(words) {
        Ok(cli) => cli,
        Err(error) if error.use_stderr() => {
            // In this program's own lines: what was typed may be long, and hold what a terminal would obey.
            terminal::tell(&terminal::short(&error.render().to_string()));
            return failure::wrong_arguments();
        }
        // Help and version.
        Err(error) => error.exit(),
    };
    let outcome = std::panic::catch_unwind(|| cli.command.run());
    match outcome {
        Ok(Ok(outcome)) => outcome.code(),
        Ok(Err(failure)) => failure.tell(),
        Err(_) => failure::Failure::bug().tell(),
    }
}
