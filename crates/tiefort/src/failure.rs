//! Why a command ended without doing its work, in words: `error: …`, then `hint: …`; and exit codes.

use std::fmt;
use std::io;
use std::path::Path;

use build::CompileError;
use build::ground::{GroundError, TaskError};
use build::product::ProductError;
use exports::ExportError;
use job::JobError;
use store::DatabaseError;

use crate::terminal::{self, NotPrinted};

/// What it means that a database is outdated.
pub const OUTDATED: &str =
    "a tile was made again from changed sources, and not all that depends on them was; `tiefort build` does the rest";

/// How a command ended that did its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All limits met, or sound.
    Sound,
    /// Finished, with limits that could not be met.
    Breaches,
    /// Two databases were compared, and they differ.
    Differ,
    /// Found damage, or anything at all under `--strict`.
    Damaged,
    /// Not now; the same may do later.
    TryLater,
}

impl Outcome {
    /// The exit code, a contract.
    pub fn code(self) -> u8 {
        match self {
            Outcome::Sound => 0,
            Outcome::Breaches | Outcome::Differ => 1,
            Outcome::Damaged => FAILED,
            Outcome::TryLater => TRY_LATER,
        }
    }
}

/// Exit code of a failure.
const FAILED: u8 = 2;
/// Exit code when trying again later may help: `EX_TEMPFAIL` of sysexits.
const TRY_LATER: u8 = 75;

/// What a failure is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// What was asked for cannot be.
    Request,
    /// The job file.
    Job,
    /// A raster, or another file that is read.
    Source,
    /// A terrain database.
    Database,
    /// A terrain database that others are at work on: the same may do later.
    Busy,
    /// A file or a folder that is written.
    Output,
    /// It was asked to stop.
    Stopped,
    /// We are wrong.
    Bug,
}

impl Cause {
    fn of_compiler(error: &CompileError) -> Self {
        match error {
            error if error.is_stopped() => Self::Stopped,
            error if error.is_transient() => Self::Busy,
            CompileError::Ground(GroundError::Source(_)) => Self::Source,
            CompileError::Ground(GroundError::Database(_))
            | CompileError::Database(_)
            | CompileError::OtherJob { .. } => Self::Database,
            CompileError::Ground(
                GroundError::Task(TaskError::Panicked { .. }) | GroundError::OutsideSources { .. },
            )
            | CompileError::Task(TaskError::Panicked { .. }) => Self::Bug,
            CompileError::Package { .. } => Self::Output,
            _ => Self::Request,
        }
    }
}

/// Why a command did not do its work.
#[derive(Debug)]
pub struct Failure {
    message: String,
    hint: Option<String>,
    code: u8,
    cause: Cause,
}

impl Failure {
    /// Something wrong with the world: exit code 2.
    pub fn new(message: impl fmt::Display, hint: impl Into<String>) -> Self {
        Self { message: message.to_string(), hint: Some(hint.into()), code: FAILED, cause: Cause::Request }
    }

    /// The same about something else than what was asked for.
    pub fn about(cause: Cause, message: impl fmt::Display, hint: impl Into<String>) -> Self {
        Self { cause, ..Self::new(message, hint) }
    }

    /// A file that could not be written.
    pub fn output(path: &Path, source: &io::Error) -> Self {
        let hint = match source.kind() {
            io::ErrorKind::NotADirectory => "a part of the path is a file; name another place",
            io::ErrorKind::NotFound => "make the folder first, or name another place",
            _ => "check that the folder exists, is writable and has room; nothing was left half-written",
        };
        // A temporary file adds its own name, which is none that was given.
        let told = source.to_string();
        let told = told.split_once(" at path \"").map_or(told.as_str(), |(cause, _)| cause);
        Self { cause: Cause::Output, ..Self::new(format!("{}: cannot be written: {told}", path.display()), hint) }
    }

    /// We are wrong; what and where was told when it happened.
    pub fn bug() -> Self {
        let hint = "this is a fault in tiefort, not in your input; please report it with the note above";
        Self { cause: Cause::Bug, ..Self::new("found a state that should be impossible", hint) }
    }

    /// Why the compiler ended early; `signal` is the exit code of the signal that came, if one did.
    pub fn of_compiler(error: &CompileError, signal: Option<u8>) -> Self {
        let cause = Cause::of_compiler(error);
        if cause == Cause::Stopped {
            let code = signal.unwrap_or(FAILED);
            return Self { message: error.to_string(), hint: error.hint(), code, cause };
        }
        let code = if error.is_transient() { TRY_LATER } else { FAILED };
        Self { message: error.to_string(), hint: error.hint(), code, cause }
    }

    /// With the exit code of the signal that came, if one did: then that is why.
    pub fn after(self, signal: Option<u8>) -> Self {
        Self { code: signal.unwrap_or(self.code), ..self }
    }

    /// With another hint, where it was asked to stop: what it kept, only the command knows.
    pub fn hinted_if_stopped(self, hint: &str) -> Self {
        if self.cause == Cause::Stopped { Self { hint: Some(hint.into()), ..self } } else { self }
    }

    /// With another hint, where the message holds `part`.
    pub fn hinted_where(self, part: &str, hint: &str) -> Self {
        if self.message.contains(part) { Self { hint: Some(hint.into()), ..self } } else { self }
    }

    /// The same, with the line of the job file at `path` that says the key which the message begins with, if one does.
    pub fn in_job(self, path: &Path) -> Self {
        let is_of_key = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "_.".contains(c);
        let key = self.message.split(|c| !is_of_key(c)).next().unwrap_or_default();
        match job::place_of(path, key) {
            Some(place) => Self { message: format!("{place}: {}", self.message), ..self },
            None => self,
        }
    }

    /// Prints it and gives the exit code.
    pub fn tell(&self) -> u8 {
        terminal::tell(&self.to_string());
        self.code
    }

    /// What was found and what was expected.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// What could be done about it.
    pub fn hint(&self) -> &str {
        // What has no hint of its own is a refusal of the system.
        self.hint.as_deref().unwrap_or("check the path named above, its permissions, and the room on its disk")
    }

    /// What it is about.
    pub fn cause(&self) -> Cause {
        self.cause
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error: {}\nhint: {}", terminal::short(&self.message), terminal::short(self.hint()))
    }
}

impl From<NotPrinted> for Failure {
    fn from(NotPrinted(error): NotPrinted) -> Self {
        Self::output(Path::new("stdout"), &error)
    }
}

impl From<JobError> for Failure {
    fn from(error: JobError) -> Self {
        Self { cause: Cause::Job, ..Self::new(&error, error.hint()) }
    }
}

impl From<CompileError> for Failure {
    fn from(error: CompileError) -> Self {
        Self::of_compiler(&error, None)
    }
}

impl From<ProductError> for Failure {
    fn from(error: ProductError) -> Self {
        CompileError::from(error).into()
    }
}

impl From<ExportError> for Failure {
    fn from(error: ExportError) -> Self {
        match error {
            ExportError::Database(error) => error.into(),
            error => {
                let (message, hint) = (error.to_string(), error.hint());
                let cause = match error {
                    ExportError::Stopped { .. } => Cause::Stopped,
                    ExportError::Panicked { .. } => Cause::Bug,
                    ExportError::Write { .. } => Cause::Output,
                    _ => Cause::Request,
                };
                Self { message, hint, code: FAILED, cause }
            }
        }
    }
}

impl From<DatabaseError> for Failure {
    fn from(error: DatabaseError) -> Self {
        Self::of_compiler(&error.into(), None)
    }
}

/// The exit code after arguments that are none of this program's.
pub fn wrong_arguments() -> u8 {
    FAILED
}

/// A panic is told in one line instead of the usual trace: what should have held, and where.
pub fn report_bugs_in_one_line() {
    std::panic::set_hook(Box::new(|panic| {
        let place = panic.location().map(|place| format!(" ({}:{})", place.file(), place.line()));
        let message = panic.payload_as_str().unwrap_or("no message");
        terminal::tell(&format!("note: {message}{}", place.unwrap_or_default()));
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hint_is_a_line_of_its_own() {
        let failure = Failure::new("a mesh as .xyz is unknown", "write .ply or .obj");
        assert_eq!(failure.to_string(), "error: a mesh as .xyz is unknown\nhint: write .ply or .obj");
    }

    #[test]
    fn a_held_lock_is_worth_trying_again() {
        let failure = Failure::from(DatabaseError::Locked { path: "a.tdb".into() });
        assert_eq!(failure.code, 75);
        let failure = Failure::from(DatabaseError::Missing { path: "a.tdb".into() });
        assert_eq!(failure.code, 2);
    }

    #[test]
    fn only_a_run_that_keeps_its_work_is_said_to_go_on() {
        let stopped = CompileError::Task(TaskError::Stopped { stage: "refine", done: 1, total: 3 });
        let failure = Failure::of_compiler(&stopped, Some(130));
        assert!(!failure.hint().contains("go on") && failure.code == 130, "{failure}");
        assert_eq!(failure.hinted_if_stopped("go on").hint(), "go on");
        let other = Failure::new("a", "b").hinted_if_stopped("go on");
        assert_eq!(other.hint(), "b");
    }
}
