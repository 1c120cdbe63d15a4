//! What all commands that build share: the announcement, listening, and showing what came of it.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use build::{Built, CompileError, Options, Plan, Stage};
use job::Job;
use serde_json::json;
use store::Report;
use store::engine::Lease;
use views::{Align, Table, grouped, leading, stages_text};

use crate::arguments::{Log, RunArguments};
use crate::clock::SystemClock;
use crate::estimate::Estimate;
use crate::failure::{Failure, Outcome};
use crate::progress::{Listener, Show};
use crate::signals::{self, Signals};
use crate::{events, files, terminal};

/// What to do after a run was stopped that publishes what is done.
const GO_ON: &str = "run the same command again to go on from here";

/// A run of the compiler on a job, as a person follows it.
#[derive(Debug)]
pub struct Run<'a> {
    job: &'a Job,
    arguments: &'a RunArguments,
    folder: PathBuf,
    workers: usize,
    clock: SystemClock,
    /// Whether other processes do the rest: then there is no board to show, and every tile is told.
    is_part: bool,
    /// What is forecast of it; none where the job cannot be planned, which the run itself says.
    plan: Option<Plan>,
    signals: Signals,
    /// What a process that shares the directory holds, to be given up if it has to end.
    lease: Arc<Mutex<Option<Lease>>>,
}

/// What came of a run.
#[derive(Debug)]
pub struct Finished {
    /// Its report.
    pub report: Report,
    /// Which tiles were built and which kept, in words.
    pub tiles: String,
    /// Whether nothing had to be done, so that the report is the one of the build before.
    pub is_unchanged: bool,
}

impl From<Built> for Finished {
    fn from(built: Built) -> Self {
        let tiles = format!("{} built, {} kept", built.rebuilt, built.kept);
        Self { report: built.report, tiles, is_unchanged: built.is_unchanged }
    }
}

impl<'a> Run<'a> {
    /// Announces the run in a line; with `-v` every setting with its value and meaning, too.
    ///
    /// # Errors
    /// When signals cannot be watched.
    pub fn announce(job: &'a Job, arguments: &'a RunArguments, what: &str) -> Result<Self, Failure> {
        let (run, remark) = Self::new(job, arguments, false)?;
        if matches!(run.show(), Show::Progress | Show::Verbose) {
            let (version, workers) = (env!("CARGO_PKG_VERSION"), run.workers);
            let (path, folder) = (job.path.display(), run.folder.display());
            terminal::tell(&format!("tiefort {version}: {what} {path} into {folder}, {workers} workers"));
            remark.iter().for_each(|remark| terminal::tell(&format!("note: {remark}")));
        }
        if run.show() == Show::Verbose {
            terminal::tell(&format!("\n{}", settings_text(job)));
        }
        Ok(run)
    }

    /// Announces a part of a build in one line.
    ///
    /// # Errors
    /// When signals cannot be watched.
    pub fn announce_briefly(job: &'a Job, arguments: &'a RunArguments, what: &str) -> Result<Self, Failure> {
        let (run, _) = Self::new(job, arguments, true)?;
        if matches!(run.show(), Show::Progress | Show::Verbose) {
            let (path, folder) = (job.path.display(), run.folder.display());
            terminal::tell(&format!("tiefort {}: {what} of {path} in {folder}", env!("CARGO_PKG_VERSION")));
        }
        Ok(run)
    }

    fn new(job: &'a Job, arguments: &'a RunArguments, is_part: bool) -> Result<(Self, Option<String>), Failure> {
        let clock = SystemClock::start();
        let (workers, remark) = arguments.workers.for_job(job);
        let (folder, signals) = (arguments.folder(job), Signals::watch()?);
        let plan = build::plan(job).ok();
        Ok((Self { job, arguments, folder, workers, clock, is_part, plan, signals, lease: Arc::default() }, remark))
    }

    /// Where the database lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What the compiler is told.
    pub fn options(&self, fresh: bool) -> Options<'_> {
        let page = !self.arguments.no_html;
        Options { fresh, page, ..Options::new(self.workers, self.signals.stop(), &self.clock) }
    }

    /// The clock of this run.
    pub fn clock(&self) -> &SystemClock {
        &self.clock
    }

    /// Keeps in mind which lease this process holds.
    pub fn hold(&self, lease: Option<Lease>) {
        *self.lease.lock().unwrap_or_else(PoisonError::into_inner) = lease;
    }

    /// Runs `work` while someone listens, and gives what it gives.
    ///
    /// # Errors
    /// Why the compiler ended early.
    pub fn listen<T>(&self, work: impl FnOnce(&mut Listener) -> Result<T, CompileError>) -> Result<T, Failure> {
        let tiles = (self.job.tiles.rows, self.job.tiles.columns);
        let estimate = match &self.plan {
            Some(plan) => Estimate::of_build(plan, self.workers),
            None => Estimate::of_one_stage(Stage::Refine),
        };
        let mut listener = Listener::start(self.show(), tiles, self.workers, estimate, self.clock);
        let (place, lease) = (listener.place(), Arc::clone(&self.lease));
        self.signals.end_in_time(move || {
            // Others may have what is given up at once; if that fails, the lease expires.
            let held = lease.lock().unwrap_or_else(PoisonError::into_inner).take();
            let _ = held.map(Lease::give_up);
            signals::stopped(&place.lock().unwrap_or_else(PoisonError::into_inner).words(), GO_ON)
        });
        let worked = work(&mut listener);
        listener.finish();
        // From here on this thread says how the process ends.
        self.signals.tell_once(|| {});
        worked.map_err(|error| Failure::of_compiler(&error, self.signals.exit_code()).hinted_if_stopped(GO_ON))
    }

    /// Runs `work` while someone listens, then shows what came of it.
    ///
    /// # Errors
    /// Why the compiler ended early.
    pub fn finish(
        &self,
        work: impl FnOnce(&mut Listener) -> Result<Finished, CompileError>,
    ) -> Result<Outcome, Failure> {
        Ok(self.conclude(&self.listen(work)?))
    }

    /// Shows what came of a run, and judges it.
    pub fn conclude(&self, finished: &Finished) -> Outcome {
        let Finished { report, tiles, is_unchanged } = finished;
        let (outcome, seconds) = (self.judge(report), self.clock.seconds());
        match self.show() {
            Show::Nothing => {}
            Show::Json => events::print_line(&json!({
                "event": "summary",
                "database": self.folder.display().to_string(),
                "exit_code": outcome.code(),
                "unchanged": is_unchanged,
                "report": report,
            })),
            Show::JsonLog => {
                terminal::tell_json(&json!({ "event": "end", "exit_code": outcome.code(), "unchanged": is_unchanged,
                         "database": self.folder.display().to_string(), "at_s": seconds }))
            }
            Show::Progress | Show::Verbose if *is_unchanged => terminal::tell(&format!(
                "nothing changed: all {} tiles in {} are fresh, so nothing was done ({seconds:.2} s)",
                self.job.tiles.rows * self.job.tiles.columns,
                self.folder.display(),
            )),
            Show::Progress | Show::Verbose => {
                terminal::tell(&end_table(&End { report, tiles, folder: &self.folder, seconds }));
            }
        }
        outcome
    }

    fn show(&self) -> Show {
        let RunArguments { json, quiet, verbose, log, .. } = self.arguments;
        match (json, quiet, log) {
            (true, ..) => Show::Json,
            (_, true, _) => Show::Nothing,
            (.., Some(Log::Json)) => Show::JsonLog,
            _ if *verbose || self.is_part => Show::Verbose,
            _ => Show::Progress,
        }
    }

    /// How a run ends that has this report.
    pub fn judge(&self, report: &Report) -> Outcome {
        let (breached, warned) = (!report.breaches.is_empty(), !report.warnings.is_empty());
        match self.arguments.strict {
            true if breached || warned => Outcome::Damaged,
            _ if breached => Outcome::Breaches,
            _ => Outcome::Sound,
        }
    }
}

/// Every setting of `job` by the section of the job file it stands in: key, value, meaning.
pub fn settings_text(job: &Job) -> String {
    /// Columns of a value that its meaning still lines up behind.
    const VALUE_COLUMNS: usize = 18;
    let mut sections: Vec<(&str, Table)> = Vec::new();
    for setting in job.describe() {
        let (section, key) = setting.key.split_once('.').unwrap_or(("", setting.key));
        if sections.last().is_none_or(|(last, _)| *last != section) {
            sections.push((section, Table::new(&[Align::Left, Align::Left, Align::Left])));
        }
        let (_, table) = sections.last_mut().expect("one was just added if there was none");
        if setting.value.chars().count() <= VALUE_COLUMNS {
            table.row([key, &setting.value, &setting.meaning]);
        } else {
            // A long value would push all meanings to the right.
            table.row([key, "", &setting.meaning]);
            table.row(["", "", &format!("= {}", setting.value)]);
        }
    }
    sections.iter().map(|(section, table)| format!("  [{section}]\n{}", table.text(2))).collect()
}

/// What a run did, and where its result lies.
#[derive(Clone, Copy, Debug)]
struct End<'a> {
    /// What it found, stages included.
    pub report: &'a Report,
    /// Which tiles were built and which kept, in words.
    pub tiles: &'a str,
    /// Where the database lies.
    pub folder: &'a Path,
    /// Seconds from start to end.
    pub seconds: f64,
}

/// The end table: whole lines.
fn end_table(end: &End) -> String {
    let stages = stages_text(&end.report.stages, end.report.workers);
    let mut text = format!("\n{stages}\n");
    text += &findings(end.report).text(0);
    text += "\n";
    text += &output(end).text(0);
    text
}

fn findings(report: &Report) -> Table {
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Left]);
    let (against, residual) = leading(report);
    let largest = format!("RMS against the {against}, largest {:.2} m", residual.max_m);
    table.row(["Residual", &format!("{:.3} m", residual.rms_m), &largest]);
    let counted = if report.count == "triangles" { String::new() } else { format!(" {}", report.count) };
    let (mean, points) = (report.per_load_module.mean, grouped(report.points.total));
    let mean = format!("{mean:.2}{counted} per load module, {points} points");
    table.row(["Triangles", &grouped(report.triangles), &mean]);
    table.row(["Breaches", &grouped(report.breaches.len() as u64), &breach_kinds(report)]);
    if let Some(features) = &report.features {
        table.row(["Features", "", &views::remarks_in_words(features)]);
    }
    let refused = &report.refusals;
    let kinds = format!(
        "{} by load modules, {} by 4 km squares, {} by reservations",
        grouped(refused.by_module),
        grouped(refused.by_window),
        grouped(refused.by_reservation)
    );
    table.row(["Refused posts", &grouped(refused.count), if refused.count == 0 { "" } else { &kinds }]);
    table.row(["Warnings", &grouped(report.warnings.len() as u64), ""]);
    for warning in &report.warnings {
        table.row(["", "", warning]);
    }
    table
}

/// Breaches counted by kind, in the order of their first.
fn breach_kinds(report: &Report) -> String {
    let mut kinds: Vec<(&str, u64)> = Vec::new();
    for breach in &report.breaches {
        match kinds.iter_mut().find(|(kind, _)| *kind == breach.kind) {
            Some((_, count)) => *count += 1,
            None => kinds.push((&breach.kind, 1)),
        }
    }
    if kinds.is_empty() {
        return "all limits met".into();
    }
    let mut text = String::new();
    for (kind, count) in kinds {
        let comma = if text.is_empty() { "" } else { ", " };
        write!(text, "{comma}{} {kind}", grouped(count)).expect("a text takes all that is written to it");
    }
    text
}

fn output(end: &End) -> Table {
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Left]);
    let sizes = files::sizes(end.folder);
    let total: u64 = sizes.iter().map(|&(_, bytes)| bytes).sum();
    let parts: Vec<String> =
        sizes.iter().map(|(name, bytes)| format!("{name} {}", files::bytes_text(*bytes))).collect();
    table.row(["Output", &files::bytes_text(total), &parts.join(", ")]);
    table.row(["Tiles", "", end.tiles]);
    table.row(["Database", "", &files::shown(end.folder).display().to_string()]);
    table.row(["Time", &format!("{:.1} s", end.seconds), ""]);
    table
}
