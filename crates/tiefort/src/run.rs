//! What `build` and `tile` share: the announcement, listening, and the end, with its report.

use std::path::{Path, PathBuf};

use compiler::{CompileError, Options};
use database::{Database, Report, files};
use job::Job;
use serde_json::json;
use views::{Align, BreachPlaces, Table, breaches_csv, breaches_geojson};

use crate::arguments::RunArguments;
use crate::end_table::{End, end_table};
use crate::events;
use crate::failure::{Failure, Outcome};
use crate::progress::{Listener, Show};
use crate::signals::Signals;
use crate::{page, terminal};

/// A run of the compiler on a job, as a person follows it.
#[derive(Debug)]
pub struct Run<'a> {
    job: &'a Job,
    arguments: &'a RunArguments,
    folder: PathBuf,
    signals: Signals,
}

/// What came of a run, before times are known.
#[derive(Debug)]
pub struct Finished {
    /// Its report, without stages.
    pub report: Report,
    /// The database, still locked.
    pub database: Database,
    /// Which tiles were built and which kept, in words.
    pub tiles: String,
}

impl<'a> Run<'a> {
    /// Announces the run: every setting with its value and meaning.
    ///
    /// # Errors
    /// When signals cannot be watched.
    pub fn announce(job: &'a Job, arguments: &'a RunArguments, what: &str) -> Result<Self, Failure> {
        let run = Self { job, arguments, folder: arguments.folder(job), signals: Signals::watch()? };
        if run.show() == Show::Progress {
            let (version, workers) = (env!("CARGO_PKG_VERSION"), arguments.workers.count());
            let (path, folder) = (job.path.display(), run.folder.display());
            terminal::tell(&format!("tiefort {version}: {what} {path} into {folder}, {workers} workers\n"));
            terminal::tell(&settings_text(job));
        }
        Ok(run)
    }

    /// Where the database lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What the compiler is told.
    pub fn options(&self, fresh: bool) -> Options<'_> {
        Options { workers: self.arguments.workers.count(), fresh, stop: self.signals.stop() }
    }

    /// Runs `work` while someone listens, then writes the report and tells the end.
    ///
    /// # Errors
    /// Why the compiler ended early, or the report could not be written.
    pub fn finish(
        &self,
        work: impl FnOnce(&mut Listener) -> Result<Finished, CompileError>,
    ) -> Result<Outcome, Failure> {
        let tiles = (self.job.tiles.rows, self.job.tiles.columns);
        let mut listener = Listener::start(self.show(), tiles, self.arguments.workers.count());
        let worked = work(&mut listener);
        let (stages, seconds) = listener.finish();
        let Finished { mut report, database, tiles } =
            worked.map_err(|error| Failure::of_compiler(&error, self.signals.exit_code()))?;
        report.stages = stages;
        database.write_json(files::REPORT, &report)?;
        self.write_views(&database, &report)?;
        let outcome = self.judge(&report);
        match self.show() {
            Show::Nothing => {}
            Show::Json => events::print_line(&json!({
                "event": "summary",
                "database": self.folder.display().to_string(),
                "exit_code": outcome.code(),
                "report": report,
            })),
            Show::Progress => {
                terminal::tell(&end_table(&End { report: &report, tiles: &tiles, folder: &self.folder, seconds }));
            }
        }
        Ok(outcome)
    }

    /// What people look at, beside `report.json`.
    fn write_views(&self, database: &Database, report: &Report) -> Result<(), Failure> {
        let places = places(self.job);
        database.write_bytes(files::BREACHES, breaches_geojson(report, &places).as_bytes())?;
        database.write_bytes(files::BREACHES_CSV, breaches_csv(report, &places).as_bytes())?;
        if self.arguments.no_html {
            // That of an earlier build would tell of another one.
            database.remove(files::REPORT_HTML)?;
            return Ok(());
        }
        let page = page::of_build(database.folder(), self.job, report, self.arguments.workers.count())?;
        database.write_bytes(files::REPORT_HTML, page.as_bytes())?;
        Ok(())
    }

    fn show(&self) -> Show {
        match (self.arguments.json, self.arguments.quiet) {
            (true, _) => Show::Json,
            (false, true) => Show::Nothing,
            (false, false) => Show::Progress,
        }
    }

    fn judge(&self, report: &Report) -> Outcome {
        let (breached, warned) = (!report.breaches.is_empty(), !report.warnings.is_empty());
        match self.arguments.strict {
            true if breached || warned => Outcome::Damaged,
            _ if breached => Outcome::Breaches,
            _ => Outcome::Sound,
        }
    }
}

/// Every setting of `job`, a line each: key, value, meaning.
pub fn settings_text(job: &Job) -> String {
    /// Columns of a value that its meaning still lines up behind.
    const VALUE_COLUMNS: usize = 36;
    let mut table = Table::new(&[Align::Left, Align::Left, Align::Left]);
    for setting in job.describe() {
        if setting.value.chars().count() <= VALUE_COLUMNS {
            table.row([setting.key, &setting.value, &setting.meaning]);
        } else {
            // A long value would push all meanings to the right.
            table.row([setting.key, "", &setting.meaning]);
            table.row(["", "", &format!("= {}", setting.value)]);
        }
    }
    table.text(2)
}

/// Where the load modules and windows of `job` lie.
fn places(job: &Job) -> BreachPlaces {
    let (area, window) = (&job.area, &job.limits.window);
    BreachPlaces {
        origin_m: area.origin_m,
        module_side_m: job.modules.side_m,
        modules: [area.grid.rows, area.grid.cols],
        window: [window.rows, window.cols],
        epsg: area.epsg,
    }
}
