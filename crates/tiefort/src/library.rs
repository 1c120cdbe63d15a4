//! What functions of the Python package share with the commands: arguments in the command line's words, what commands
//! tell programs, and meshes written as commands write them. Nothing here prints, watches signals or ends the process.

use std::error::Error;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use build::workbench::{HeldGround, Mesh, TinRequest};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, Command, FromArgMatches};
use exports::Work;
use job::Job;
use store::Report;
use terrain::{ModuleId, TileId};

use crate::arguments::wanted_ground;
pub use crate::clock::SystemClock;
pub use crate::commands::tin::end_in_words;
use crate::commands::{budgets, compare, correlate, explain, export, plan, tile, tin};
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
    fit::check(job, &build::plan(job)?.forecast, workers, folder)
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
    Ok(plan::json_text(job, &build::plan(job)?, (features.as_ref(), &budgets::Tried::of_job(job)), &[]))
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
    let against: Vec<PathBuf> = against.map(Path::to_path_buf).into_iter().collect();
    let ground = wanted_ground(&against);
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

/// What `tiefort correlate --format json` prints with these words.
///
/// # Errors
/// When the words do not fit together, or there is nothing to compare.
pub fn correlate(words: Vec<OsString>, stop: &AtomicBool) -> Result<String, Failure> {
    correlate::json_text(&read(words)?, stop)
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
    matches.and_then(|matches| A::from_arg_matches(&matches)).map_err(|error| refused(&error))
}

/// Why words are refused, without what a terminal is told beside it of usage and help.
fn refused(error: &clap::Error) -> Failure {
    let text = |kind: ContextKind| match error.get(kind) {
        Some(ContextValue::String(one)) => vec![one.clone()],
        Some(ContextValue::Strings(all)) => all.clone(),
        _ => Vec::new(),
    };
    let names = |kind: ContextKind| text(kind).iter().flat_map(|words| flags(words)).collect::<Vec<&str>>().join(", ");
    let name = names(ContextKind::InvalidArg);
    let found = text(ContextKind::InvalidValue).join(" ");
    let message = match (error.kind(), error.source()) {
        (ErrorKind::InvalidValue, _) => {
            format!("{name}: found {found:?}, expected one of {}", text(ContextKind::ValidValue).join(", "))
        }
        (ErrorKind::ValueValidation, Some(why)) => format!("{name}: found {found:?}, {}", expected(&why.to_string())),
        (ErrorKind::ArgumentConflict, _) => {
            format!("found {name} and {}, expected one of them", names(ContextKind::PriorArg))
        }
        (ErrorKind::MissingRequiredArgument, _) => format!("found nothing, expected a value for one of {name}"),
        (ErrorKind::UnknownArgument, _) => format!("found an argument {name}, which there is none of here"),
        _ => error.kind().to_string(),
    };
    let hint = match text(ContextKind::SuggestedValue).first() {
        Some(similar) => format!("is it {similar:?}?"),
        None => "the function's documentation says of each argument what it may be".into(),
    };
    Failure::new(message, hint)
}

/// The flags in words such as `<--points <N>|--rms <R>>`, without what their values are called.
fn flags(words: &str) -> impl Iterator<Item = &str> {
    // Several meshes at once are for the command alone.
    words.split([' ', '=', '<', '>', '|']).filter(|word| word.starts_with("--") && *word != "--levels")
}

/// What a value should have been: a range in words, where it is one.
fn expected(why: &str) -> String {
    let (found, range) = why.split_once(" is not in ").unwrap_or_default();
    // The largest number of a type is told to one who passed it.
    let is_beyond = |most: &str| found.parse::<f64>().is_ok_and(|found| most.parse().is_ok_and(|most| found > most));
    match range.split_once("..=") {
        Some((least, most)) if most.len() < u32::MAX.to_string().len() || is_beyond(most) => {
            format!("expected {least} to {most}")
        }
        Some((least, _)) => format!("expected {least} or more"),
        None if why.starts_with("number too large") => "expected a smaller number".into(),
        None => why.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_refused_in_a_sentence() {
        let request = |words: &[&str]| tin_request(Path::new("array"), words.iter().map(Into::into).collect());
        let refused = |words: &[&str]| request(words).unwrap_err().message().to_owned();
        assert_eq!(request(&["--points", "50"]).unwrap().points, Some(50));
        let of_triangles = refused(&["--triangles", "1"]);
        assert_eq!(of_triangles, "--triangles: found \"1\", expected 2 or more");
        let beyond = refused(&["--triangles", "1000000000000"]);
        assert_eq!(beyond, "--triangles: found \"1000000000000\", expected 2 to 4294967295");
        let beyond = refused(&["--triangles", "100000000000000000000"]);
        assert!(beyond.ends_with(", expected a smaller number"), "{beyond}");
        let without_end = "found nothing, expected a value for one of --points, --triangles, --max-residual, --rms";
        assert_eq!(refused(&[]), without_end);
        let of_effort = refused(&["--points", "50", "--effort", "bset"]);
        assert_eq!(of_effort, "--effort: found \"bset\", expected one of fast, normal, best");
        assert!(refused(&["--points", "50", "--method", "paper", "--effort", "best"]).contains("effort"));
        let told =
            [&["--points", "x"][..], &["--effort", "bset"], &["--wings", "2"], &["--points", "5", "--points", "6"]];
        for words in told {
            let failure = request(words).unwrap_err();
            let text = format!("{} {}", failure.message(), failure.hint());
            assert!(!["Usage", "--help", "<"].iter().any(|part| text.contains(part)), "{text}");
        }
    }
}
