//! What functions of the Python package share with the commands: arguments in the command line's words, what commands
//! tell programs, and meshes written as commands write them. Nothing here prints, watches signals or ends the process.

use std::ffi::OsString;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use build::product::WantedGround;
use build::workbench::{HeldGround, Mesh, TinRequest};
use clap::{Args, Command, FromArgMatches};
use exports::Work;
use job::Job;
use store::Report;
use terrain::{ModuleId, TileId};

pub use crate::clock::SystemClock;
use crate::commands::{budgets, compare, explain, export, plan, tile, tin};
pub use crate::failure::{Cause, Failure};
use crate::{files, fit, resources};

/// Cores this process may use.
pub fn cores() -> usize {
    resources::cores()
}

/// Workers for a build of `job`: those asked for, or as many as cores and memory allow.
pub fn workers_for(job: &Job, asked: Option<usize>) -> usize {
    build::plan(job).map_or_else(|_| asked.unwrap_or_else(cores), |plan| resources::workers(asked, &plan.forecast).0)
}

/// Refuses a build that will not fit this machine.
///
/// # Errors
/// When the job cannot be planned, or more memory or disk is forecast to be needed than is free.
pub fn check_fits(job: &Job, workers: usize, folder: &Path) -> Result<(), Failure> {
    fit::check(&build::plan(job)?.forecast, workers, folder)
}

/// What `tiefort tin` is asked for in these words, without those that say what to read and to write.
///
/// # Errors
/// When the words do not fit together.
pub fn tin_request(dem: &Path, words: Vec<OsString>) -> Result<TinRequest, Failure> {
    let beside = ["--out".into(), "mesh.ply".into(), dem.as_os_str().to_owned()];
    tin::request(&read(words.into_iter().chain(beside))?)
}

/// Writes a mesh as `tiefort tin` does.
///
/// # Errors
/// When it cannot be written, or its kind has no room for map coordinates.
pub fn write_mesh(mesh: &Mesh, out: &Path, on_map: bool) -> Result<(), Failure> {
    tin::write_mesh(mesh, tin::kind_of(out, on_map)?, on_map, out)
}

/// What `tiefort plan --emit json` prints of a job.
///
/// # Errors
/// When it cannot be planned.
pub fn plan(job: &Job) -> Result<String, Failure> {
    let features = build::foresee_features(job)?;
    Ok(plan::json_text(job, &build::plan(job)?, (features.as_ref(), &budgets::of_job(job)), &[]))
}

/// What `tiefort report --format json` prints.
pub fn report_json(report: &Report) -> String {
    serde_json::to_string(report).expect("a report has texts as keys, and its numbers are finite")
}

/// Refuses a tile that a job does not have.
///
/// # Errors
/// When there is no such tile.
pub fn check_tile(job: &Job, id: TileId) -> Result<(), Failure> {
    tile::check_tile(job, id)
}

/// What `tiefort explain --format json` prints of a load module.
///
/// # Errors
/// When there is no such load module, or the database cannot be read.
pub fn explain(folder: &Path, module: ModuleId, against: Option<&Path>) -> Result<String, Failure> {
    let ground = against.map_or(WantedGround::Recorded, WantedGround::Raster);
    Ok(explain::to_json(&inspect::explain(folder, module, ground, cores())?).to_string())
}

/// Exports as `tiefort export` does with these words; what was exported, in words.
///
/// # Errors
/// When the words do not fit together, the database cannot be read, or nothing can be written there.
pub fn export(words: Vec<OsString>, stop: &AtomicBool) -> Result<String, Failure> {
    let arguments: export::Arguments = read(words)?;
    let workers = schedule::Workers::new(arguments.workers());
    export::checked(&arguments, &Work { workers: &workers, stop, tell: &|_| {} })
}

/// What `tiefort compare --format json` prints with these words; on `ground`, where it is in memory.
///
/// # Errors
/// When the words do not fit together, or the ground cannot be used.
pub fn compare(words: Vec<OsString>, ground: Option<HeldGround>, stop: &AtomicBool) -> Result<String, Failure> {
    let arguments: compare::Arguments = read(words.into_iter().chain(["--quiet".into()]))?;
    compare::json_text(&arguments, ground, stop)
}

/// Whether a file can be made at `path`.
///
/// # Errors
/// When it cannot.
pub fn check_writable(path: &Path) -> Result<(), Failure> {
    files::check_writable(path)
}

/// The arguments of a command.
fn read<A: Args + FromArgMatches>(words: impl IntoIterator<Item = OsString>) -> Result<A, Failure> {
    let command = A::augment_args(Command::new("tiefort").no_binary_name(true).disable_help_flag(true));
    let matches = command.try_get_matches_from(words);
    matches.and_then(|matches| A::from_arg_matches(&matches)).map_err(|error| refused(&error.to_string()))
}

/// Why words are refused: the first paragraph of what is told on a terminal, and its tip.
fn refused(text: &str) -> Failure {
    let first = text.lines().take_while(|line| !line.trim().is_empty()).map(str::trim).collect::<Vec<_>>().join(" ");
    let tip = text.lines().find_map(|line| line.trim().strip_prefix("tip: "));
    let hint = tip.unwrap_or("`tiefort COMMAND --help` says of each argument what it may be");
    Failure::new(first.strip_prefix("error: ").unwrap_or(&first), hint)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_refused_as_the_command_line_does() {
        let request = |words: &[&str]| tin_request(Path::new("array"), words.iter().map(Into::into).collect());
        let refused = |words: &[&str]| request(words).unwrap_err().message().to_owned();
        assert_eq!(request(&["--points", "50"]).unwrap().points, Some(50));
        assert!(refused(&["--triangles", "1"]).starts_with("invalid value '1' for '--triangles <N>'"));
        assert!(refused(&["--points", "50", "--effort", "bset"]).contains("bset"));
        assert!(refused(&["--points", "50", "--method", "paper", "--effort", "best"]).contains("--effort"));
    }
}
